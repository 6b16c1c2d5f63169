"""Measure the supports of recorded people: writes ``supports.md`` and the strips in ``images``.

Run ``python docs/supports.py FOLDER [STRIPS]``, where FOLDER has ``clips_cluttered.csv`` (recordings among
obstacles) and, in ``mocap``, those recordings and trials on force plates in ``grf``. With STRIPS, a folder,
strips of at most four seconds of every clip are written there: they are what the judgement by eye is of.
"""

import csv
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from acknowledgements import THANKS
from PIL import Image
from support_strip import support_strip_figure

from manikin.errors import ManikinError
from manikin.recordings import (
    MarkerRecording,
    Reconstruction,
    RecordedSupports,
    TimingError,
    read_recording,
    reconstruct,
    supports_of,
    timing_errors,
)
from manikin.reports.figures import save_figure

PAGE = Path(__file__).with_suffix(".md")
IMAGES = PAGE.parent / "images"
NAMED = ("FunctionalWalk", "PiG_Motion-FlatFoot-One", "walking2", "walking5")
"""Trials for which the errors are to be within 30 ms."""

STRIPS = {
    "01_02_f400-1300": ("supports-climb.png", "Climbing over a playground structure", (0.0, 6.9)),
    "14_31_f1-1150": ("supports-stool.png", "Sitting down on a low stool", (0.8, 3.2)),
    "Male1_A11_CrawlForward": ("supports-crawl.png", "Crawling", (3.4, 7.6)),
}
LONGEST = 4.2
"""Of a strip to be judged [s]."""

ERRORS = {
    "14_21": "none seen",
    "14_31_f1-1150": "none seen",
    "01_02_f400-1300": "none seen",
    "01_05_f2000-3120": "left foot 0.2 s late at 1.9 s (tips of its toes slide under the bar); "
    "small steps on the spot from 2.7 to 6.4 s are taken for shifts",
    "01_13_f140-760": "none seen",
    "01_09_f3900-4242": "none seen",
    "03_01": "none seen",
    "03_02": "none seen (the recording jumps before 0.4 s)",
    "03_03_f1-1000": "none seen",
    "127_29": "none seen",
    "127_31": "whether there are flights, of 0.03 and 0.06 s, at 1.9 and 2.5 s cannot be told",
    "127_32": "whether there is a flight, of 0.04 s, at 0.64 s cannot be told",
    "127_37": "whether the right hand is on the floor from 1.9 to 2.05 s, or passes close, cannot be told",
    "127_38": "whether the hands touch the floor at 0.55 s cannot be told",
    "127_25": "none seen",
    "127_26": "none seen",
    "127_28": "none seen",
    "127_33": "none seen",
    "127_36": "none seen",
    "127_18": "none seen",
    "127_05": "none seen",
    "16_08": "none seen",
    "16_57": "none seen",
    "17_03": "the support that begins in the last 0.05 s is missed",
    "Male1_A7_Crouch": "none seen",
    "Male1_A8_CrouchToLie": "none seen",
    "Male1_A9_LieDown": "none seen",
    "Male1_A10_LieToCrouch": "whether the right elbow, 5 cm above the left one, lies on the floor until "
    "1.7 s cannot be told",
    "Male1_A11_CrawlForward": "hands, knees and elbows in the right order; pieces of the left hand, at 6.2 "
    "and 8.3 s, before it swings; feet broken into pieces, toes that drag count as supports",
    "Male1_A12_CrawlBackward": "hands and knees in the right order but for pieces of the right hand at 1.5 "
    "and 2.1 s; feet and right elbow broken into pieces, some missed; the floor drifts by 0.1 m",
    "Male1_B24_WalkToCrouch": "none seen",
    "Male1_B25_CrouchToWalk": "none seen",
    "Male1_A5_PickUpBox": "none seen",
    "Male1_B19_WalkToPickUpBox_Working": "none seen",
    "Male1_B20_WalkWithBox": "none seen",
    "Male1_B21_PutDownBoxToWalk": "none seen",
    "Male1_C26_RunToCrouch": "none seen",
    "Male1_B18_Walk2Leap2Walk": "left foot in the air from 4.3 to 4.8 s is doubtful (step after the landing)",
}
"""What is wrong with the sequence of each clip, judged by eye on its strips."""

TEXT = """# Supports of recorded people

Which of feet, hands, knees, elbows and trunk carry a recorded person, when and where, found from positions
alone (`supports_of`). By `docs/supports.py`.

* Positions of effectors of the reconstructed body, low-passed at 5 Hz (Butterworth, second order, forward
  and backward), and their speeds. A switch with hysteresis closes where a point is slow, below 10 % of the
  highest speed of its swing or 0.12 m/s, and opens above 20 %, the shares with the
  least errors against plates of [other laboratories](laboratories.md).
* **Feet**: heel and toes, and the ball of a foot with a raised heel, each on one of the *surfaces*: heights
  at which a sole rests while another foot moves, one where they differ by less than 8 cm or go over into each
  other without a gap of 3 cm. A foot of which even the
  slowest point gets faster than 0.6 m/s steps. A support lasts at least 0.08 s, or 0.04 s where the recording
  cuts it.
* **Seat**: a person who is still and low with the centre of mass beside the feet sits.
* **Hands**: a palm that rests on the ground; on the seat while it is taken or left; or elsewhere, where
  the shoulder moves by more than 12 cm while the palm stays (less than 0.45 of that, for more than 0.25
  s) and is more than 30 cm away from the own hips and knees. Hands that hang, lie on a knee or carry a
  box are none. Where such a hand takes part of the weight or only touches does not show in positions.
* **Sliding**: hands, knees and elbows slide without leaving by up to 15 cm between two times below 0.2 m/s,
  at less than 0.6 m/s; half of the time a hand off the ground is slower than 0.4 m/s.
* **Knees and elbows**: near the surface under the feet, with the body's thickness; **pelvis**, for the
  whole trunk, where it is low and the trunk is 60° or more from upright.
* **None** while the centre of mass falls freely, at a median of 0.8 g or more: as at the top of a jump, where
  feet are slow and may be as high as the box it began on.
* **Runners**: feet do not begin or end to carry while the motion needs less than 0.2 of the weight; while it
  needs more, the feet beside carry on as long as they are low, and missed ones are added, see [recorded
  runs](runs.md).

## Beside force plates

Errors of touch-downs and lift-offs of feet that step on a plate alone, found minus measured. Their median
is {down:.0f} ms at touch-down and {up:.0f} ms at lift-off in {named}, and {all_down:.0f} and {all_up:.0f}
ms over all trials.

"""
CLUTTERED = """
The two errors of seconds in `levelground_ccw_fast_01_01` are one step on the spot of the right foot, by 7
cm, which is taken for a shift of a foot that stays.

## Among obstacles

The {count} clips of people among obstacles. *Touch-downs*: seen in the clip, of all effectors.
*Surfaces*: heights on which feet stand. *Errors*: false, missed, early or late supports, by eye on strips
like those below, where less than 0.05 s cannot be seen. {right} clips are without an error, {doubtful}
more with a doubt that positions cannot settle, and in {others} something is wrong.

"""
AFTER = """
What is wrong has three causes:

* **Fast and short.** Filters spread events: whether there is a flight of less than 0.06 s in a crouched run
  shows neither in the feet nor in the acceleration of the centre of mass; at 30 Hz of ACCAD a frame is 33
  ms. What begins in the last 0.05 s of a recording is missed.
* **Small steps.** A foot that turns on the spot has a point that hardly moves, loaded or not; the tips of
  toes that slide at 0.4 m/s may carry.
* **Crawling low.** Limbs of the model are thinner than flesh, toes are not recorded and the recorded floor
  drifts by up to 0.1 m. Hands and knees come out right; feet, which drag, do not. Of the trunk only the
  pelvis is reported: chest and head are not distinguished.

The thresholds were chosen on these clips. What guards against choosing too well: the plates above, the walks
and runs below, and the rule that what a cut of the recording shortens counts from 0.04 s on, which was
tried on recordings cut at random.

## Strips

Postures from the side with a dot at every support; heights of effectors, thick while they support; the
supports.

"""
NO_HANDS = """
## Where there are none

Hands, knees, elbows and trunk support nobody in the recordings of walks and runs on free ground, {walks}
of them: found were {found}; recordings without a support of a foot: {missing}. In {unseen} other recordings
that the rules were not made on, of walks, runs, a jump and a box: {unseen_found}, and {unseen_missing}.
"""


@dataclass(frozen=True, eq=False)
class Clip:
    """A recording among obstacles and its supports."""

    name: str
    description: str
    reconstruction: Reconstruction
    supports: RecordedSupports


def clips(folder: Path) -> Iterator[Clip]:
    """All of the table."""
    with (folder / "clips_cluttered.csv").open(newline="") as rows:
        for row in csv.DictReader(rows):
            path = folder / "mocap" / row["file"]
            found = reconstruct(read_recording(path))
            yield Clip(path.stem, row["description"], found, supports_of(found))


def on_plates(folder: Path) -> Iterator[tuple[str, list[TimingError]]]:
    """Trials on plates, and the errors of each that has any."""
    for path in sorted(path for path in folder.rglob("*") if path.suffix in (".c3d", ".trc")):
        recording = read_recording(path)
        assert isinstance(recording, MarkerRecording)
        try:
            found = supports_of(reconstruct(recording), start=recording.start)
        except ManikinError as refused:
            print(f"{path.name}: {refused}", file=sys.stderr)
            continue
        errors = timing_errors(found, recording.plates)
        if errors:
            yield path.stem, list(errors)


def listed(folder: Path, table: str) -> set[str]:
    """Files of a table."""
    with (folder / table).open(newline="") as rows:
        return {row["file"] for row in csv.DictReader(rows)}


def unlisted(folder: Path, files: set[str]) -> set[str]:
    """Recordings of skeletons that are not among these files."""
    paths = [
        *(folder / "mocap" / "cmu_asf_amc").glob("*.amc"),
        *(folder / "mocap" / "accad_male1_bvh").glob("*.bvh"),
    ]
    found = {str(path.relative_to(folder / "mocap")) for path in paths}
    return found - files


def free_ground(folder: Path, files: set[str]) -> tuple[str, int]:
    """Other supports than feet in recordings, and in how many of them there is none of a foot."""
    others, missing = [], 0
    for file in sorted(files):
        found = supports_of(reconstruct(read_recording(folder / "mocap" / file)))
        names = {one.effector for one in found.supports}
        others += [f"{name} in {Path(file).stem}" for name in sorted(names - {"left_foot", "right_foot"})]
        missing += not names
    return ", ".join(others) or "none", missing


def milliseconds(errors: Sequence[TimingError], event: str) -> list[float]:
    """Of one kind of event, found minus measured."""
    return [1e3 * error.error for error in errors if error.event == event]


def median(values: Sequence[float]) -> float:
    """Of absolute values; NaN of none."""
    return float(np.median(np.abs(values))) if len(values) else float("nan")


def plate_table(trials: Sequence[tuple[str, list[TimingError]]]) -> Iterator[str]:
    """Table by trial."""
    yield from row("trial", "touch-downs [ms]", "lift-offs [ms]", "median [ms]", "largest [ms]")
    for name, errors in trials:
        cells = [
            ", ".join(f"{v:+.0f}" for v in milliseconds(errors, event)) or "-"
            for event in ("touch-down", "lift-off")
        ]
        every = [abs(1e3 * error.error) for error in errors]
        yield from row(name, *cells, f"{np.median(every):.0f}", f"{max(every):.0f}", head=False)


def clip_table(found: Sequence[Clip]) -> Iterator[str]:
    """Table by clip."""
    yield from row(
        "clip", "what", "duration [s]", "touch-downs", "supports", "phases", "surfaces [m]", "errors by eye"
    )
    for clip in found:
        kinds: dict[str, int] = {}
        for one in clip.supports.supports:
            kind = one.effector.split("_")[-1]
            kinds[kind] = kinds.get(kind, 0) + 1
        yield from row(
            clip.name, clip.description.split(" (")[0], f"{clip.supports.end - clip.supports.start:.1f}",
            len(clip.supports.sequence), ", ".join(f"{kind} {count}" for kind, count in kinds.items()),
            len(clip.supports.phases), ", ".join(f"{height + 0.0:.2f}" for height in clip.supports.surfaces),
            ERRORS[clip.name], head=False,
        )  # fmt: skip


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def draw(found: Sequence[Clip], strips: Path | None) -> Iterator[str]:
    """Write the strips of the page, and those to be judged; lines of the page that show them."""
    for clip in found:
        if clip.name in STRIPS:
            name, title, window = STRIPS[clip.name]
            figure = support_strip_figure(clip.reconstruction, clip.supports, title, window, 13.0)
            figure.set_dpi(100)
            save_figure(figure, IMAGES / name)
            Image.open(IMAGES / name).quantize(96).save(IMAGES / name, optimize=True)
            yield f"![{title}: postures, heights and supports](images/{name})"
        if strips is not None:
            start, end = clip.supports.start, clip.supports.end
            edges = np.linspace(start, end, int(np.ceil((end - start) / LONGEST)) + 1)
            for number, window in enumerate(pairwise(edges)):
                figure = support_strip_figure(clip.reconstruction, clip.supports, clip.name, window, 13.0)
                save_figure(figure, strips / f"{clip.name}-{number}.png")


def main() -> None:
    """Find the supports in the folder on the command line and write the page."""
    if len(sys.argv) not in (2, 3) or not (Path(sys.argv[1]) / "clips_cluttered.csv").is_file():
        raise SystemExit(
            "usage: python docs/supports.py FOLDER [STRIPS]; valid: a folder with clips_cluttered.csv"
        )
    folder = Path(sys.argv[1])
    found, trials = list(clips(folder)), list(on_plates(folder / "mocap" / "grf"))
    pictures = "\n\n".join(draw(found, Path(sys.argv[2]) if len(sys.argv) == 3 else None)) + "\n"
    named = [error for name, errors in trials if name in NAMED for error in errors]
    every = [error for _, errors in trials for error in errors]
    verdicts = [ERRORS[clip.name] for clip in found]
    right = sum(verdict.startswith("none seen") for verdict in verdicts)
    doubtful = sum("doubtful" in verdict or "cannot be told" in verdict for verdict in verdicts)
    walks = listed(folder, "clips_locomotion.csv")
    unseen = unlisted(folder, walks | listed(folder, "clips_cluttered.csv"))
    others, missing = free_ground(folder, walks)
    unseen_others, unseen_missing = free_ground(folder, unseen)
    numbers = {
        "named": ", ".join(f"`{name}`" for name in NAMED), "count": len(found), "right": right,
        "doubtful": doubtful, "others": len(found) - right - doubtful, "walks": len(walks),
        "found": others, "missing": missing, "unseen": len(unseen), "unseen_found": unseen_others,
        "unseen_missing": unseen_missing,
        "down": median(milliseconds(named, "touch-down")), "up": median(milliseconds(named, "lift-off")),
        "all_down": median(milliseconds(every, "touch-down")),
        "all_up": median(milliseconds(every, "lift-off")),
    }  # fmt: skip
    PAGE.write_text(
        TEXT.format(**numbers) + "\n".join(plate_table(trials)) + "\n" + CLUTTERED.format(**numbers)
        + "\n".join(clip_table(found)) + "\n" + AFTER + pictures + NO_HANDS.format(**numbers) + THANKS
    )  # fmt: skip


if __name__ == "__main__":
    main()
