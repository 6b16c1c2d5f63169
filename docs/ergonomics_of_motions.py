"""Measure the ergonomics of recorded and of our own motions: writes ``ergonomics_of_motions.md``.

Run ``python docs/ergonomics_of_motions.py FOLDER``, where FOLDER has recordings in ``mocap``.
"""

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from manikin.body import BodyModel
from manikin.ergonomics import Circumstances, Ergonomics, ergonomics_of, upright_neck
from manikin.motion import Motion
from manikin.motion.file import read_motions
from manikin.pipeline.runner import run
from manikin.recordings import motion_of, read_recording, reconstruct

PAGE = Path(__file__).with_suffix(".md")
RECORDINGS = {
    "accad_male1_bvh/Male1_A1_Stand.bvh": "stands, steps off at the end",
    "accad_male1_bvh/Male1_A3_SwingArms.bvh": "stands, swings the arms a little",
    "accad_male1_bvh/Male1_B3_Walk.bvh": "walks",
    "accad_male1_bvh/Male1_B20_WalkWithBox.bvh": "walks with a box",
    "accad_male1_bvh/Male1_A6_LiftBox.bvh": "lifts a box",
    "accad_male1_bvh/Male1_A5_PickUpBox.bvh": "picks a box up from the ground",
    "accad_male1_bvh/Male1_A7_Crouch.bvh": "crouches down",
    "accad_male1_bvh/Male1_A11_CrawlForward.bvh": "crawls",
    "cmu_asf_amc/14_21.amc": "climbs three steps and comes down",
    "cmu_asf_amc/01_13_f140-760.amc": "ducks under a bar, twice",
    "cmu_asf_amc/01_05_f2000-3120.amc": "goes under bars, crouched, twice",
    "cmu_asf_amc/03_01.amc": "walks over uneven ground",
    "grf/nimble_opencap_s4/STS1.trc": "stands up and sits down",
    "grf/opensim_core/walking2.c3d": "walks; nothing is known of the arms",
}
OURS = ("platform", "walk", "beam-H1C1")

TEXT = """# Ergonomics of motions

Scores, shares and margins of recordings and of our own executed and planned motions, nothing in the hands, by
`docs/ergonomics_of_motions.py`. [What they mean](ergonomics.md).

* *Share of time*: at the action levels of each score, the lowest first (RULA 1 to 4, REBA 0 to 4).
* *Neck*: the recording's own upright neck, from which flexion is counted; "-" of a recording without an
  upright frame, counted from 0.
* *Time*: per frame, of everything in the report; reading and reconstruction are not in it.
* Recordings have neither torques nor margins here: both need contacts and inverse dynamics.
* Feet are on the ground by their heights where a recording is concerned. On steps that is wrong, and the legs
  score as if they stood on one foot; and no seat is known, so that bent knees of who sits count in REBA.
* RULA has no word for walking: on one foot the legs are not evenly loaded, which alone makes its score 3.

## Recordings

"""


def recordings(folder: Path) -> Iterator[str]:
    """The table of recordings."""
    yield head("recording", "what is done", "neck", *SCORES, "time")
    for name, what in RECORDINGS.items():
        found = reconstruct(read_recording(folder / name))
        motion = motion_of(found)
        neck = upright_neck(found.body, motion.q)
        given = Circumstances(neck_upright_deg=0.0 if neck is None else float(np.rad2deg(neck)))
        judged, taken = timed(found.body, motion, given=given, untold=found.neutral)
        upright = "-" if neck is None else f"{given.neck_upright_deg:.0f} deg"
        yield row(f"`{Path(name).stem}`", what, upright, *scores(judged), f"{1e6 * taken:.0f} us")


def ours() -> Iterator[str]:
    """The table of our own motions."""
    yield head(
        "scenario",
        "motion",
        *SCORES,
        "largest torque share",
        "rms share",
        "work given, taken",
        "lowest margin",
    )
    for name in OURS:
        with tempfile.TemporaryDirectory() as folder:
            run(name, out=folder, seed=0)
            content = read_motions(folder)
        assert content.body is not None
        for kind, motion in content.motions.items():
            judged, _ = timed(content.body, motion, schedule=content.schedule)
            yield row(f"`{name}`", kind, *scores(judged), *efforts(judged))


SCORES = ("RULA mean, worst", "share of time", "REBA mean, worst", "share of time")


def scores(found: Ergonomics) -> Iterator[str]:
    """Mean, worst and shares of both scores."""
    assert found.posture is not None
    for one in (found.posture.rula, found.posture.reba):
        told = one.as_dict()
        yield f"{told['mean']:.1f}, {told['max']}"
        yield " / ".join(f"{100 * share:.0f}" for share in told["share_of_time"].values()) + " %"


def efforts(found: Ergonomics) -> Iterator[str]:
    """Torques, effort and margin."""
    assert found.strength is not None
    assert found.effort is not None
    assert found.margin is not None
    joint = found.strength.order[0]
    yield f"{found.strength.peak[joint]:.0%}, {found.strength.joint_names[joint].replace('_', ' ')}"
    yield f"{found.effort.mean_share:.1%}"
    yield f"{found.effort.positive_work.sum():.0f} J, {found.effort.negative_work.sum():.0f} J"
    limit = "-" if found.margin.limiting is None else found.margin.limiting.description
    yield f"{found.margin.value:.1f} N.m at {found.margin.time:.2f} s, {limit}"


def timed(body: BodyModel, motion: Motion, **given: object) -> tuple[Ergonomics, float]:
    """The report and the time it took per frame [s]."""
    begin = time.process_time()
    found = ergonomics_of(body, motion, **given)  # type: ignore[arg-type]
    return found, (time.process_time() - begin) / len(motion.time)


def head(*cells: str) -> str:
    """First two lines of a table."""
    return row(*cells) + "\n|" + "---|" * len(cells)


def row(*cells: str) -> str:
    """A line of a table."""
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Judge the recordings of the folder on the command line and our own motions, and write the page."""
    if len(sys.argv) != 2 or not (folder := Path(sys.argv[1]) / "mocap").is_dir():
        raise SystemExit("usage: python docs/ergonomics_of_motions.py FOLDER; valid: a folder with mocap")
    tables = ["\n".join(recordings(folder)), "## Our own", "\n".join(ours())]
    PAGE.write_text(TEXT + "\n\n".join(tables) + "\n")


if __name__ == "__main__":
    main()
