"""Measure the reconstruction of recorded markers: writes ``reconstruction.md``.

Run ``python docs/reconstruction.py FOLDER``, where FOLDER has C3D and TRC files of markers in ``mocap/grf``.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from manikin.recordings import MarkerRecording, Reconstruction, read_recording, reconstruct

PAGE = Path(__file__).with_suffix(".md")
COMPUTED = {
    "LFEP": "left_thigh", "RFEP": "right_thigh", "LFEO": "left_leg", "RFEO": "right_leg",
    "LTIO": "left_foot", "RTIO": "right_foot", "LHUP": "left_upper_arm", "RHUP": "right_upper_arm",
    "LHUO": "left_forearm", "RHUO": "right_forearm", "LRAO": "left_hand", "RRAO": "right_hand",
    "LKJC": "left_leg", "RKJC": "right_leg", "LAJC": "left_foot", "RAJC": "right_foot",
}  # fmt: skip
"""Joint centres that other programs wrote into the files and that are not followed."""

TEXT = """# Recorded markers, reconstructed

Every C3D and TRC file of walks, sitting down and a drop jump on force plates, whole, without smoothing, by
`docs/reconstruction.py`.

* *Frames*: reconstructed of recorded; frames at the ends that see less than half of the markers are left out.
* *Residual*: distance of a marker from its place on our human, over all markers and frames. The
  places of markers come from the same file, so this measures how well a chain of rigid segments with our
  joints follows, not where the joints are.
* *Other programs' joints*: median distance of our hips, knees, ankles, shoulders, elbows and wrists from
  those that another program wrote into the file and that are not followed. Elbows and wrists of Plug-in Gait
  are 3 to 4 cm off ours. The legs of `PlugInC3D` differ by 7 cm in thigh and shank each; our human is
  symmetric and has their mean.
* *Untold*: unmeasured parts, which stay as in standing, toes and hands not counted.
* *Time*: of the processor, with placing the markers.

"""


def parts(neutral: tuple[str, ...]) -> str:
    """Parts of the body without markers."""
    groups = {"trunk": "thorax", "head": "neck", "arms": "left_upper_arm", "legs": "left_thigh"}
    return ", ".join(name for name, segment in groups.items() if segment in neutral) or "-"


def joints_away(recording: MarkerRecording, found: Reconstruction) -> float | None:
    """Median distance of joints from those that other programs computed [m]."""
    data, body = found.body.pinocchio.createData(), found.body
    names = [
        name
        for name, segment in COMPUTED.items()
        if name in recording.marker_names and segment not in found.neutral
    ]
    if not names:
        return None
    theirs = recording.chosen(names).positions[found.first_frame :]
    frames = [body.segment_frame(COMPUTED[name]) for name in names]
    away = []
    for q, places in zip(found.q, theirs, strict=False):
        pin.framesForwardKinematics(body.pinocchio, data, q)
        ours = np.array([data.oMf[frame].translation for frame in frames])
        away.append(np.linalg.norm(ours - places, axis=1))
    return float(np.nanmedian(away))


def lines(folder: Path) -> Iterator[str]:
    """The table."""
    heads = (
        "file", "markers", "frames", "residual, median", "95 %", "largest", "other programs' joints",
        "untold", "time per frame",
    )  # fmt: skip
    yield "| " + " | ".join(heads) + " |"
    yield "|" + "---|" * len(heads)
    for path in sorted(path for path in folder.rglob("*") if path.suffix in (".c3d", ".trc")):
        recording = read_recording(path)
        assert isinstance(recording, MarkerRecording)
        begin = time.process_time()
        found = reconstruct(recording)
        taken = time.process_time() - begin
        away = joints_away(recording, found)
        cells = (
            f"{path.parent.name}/{path.name}", len(found.joints), f"{len(found.time)} of {len(recording)}",
            millimetres(found.median), millimetres(float(np.nanpercentile(found.residual, 95.0))),
            millimetres(found.worst), "-" if away is None else millimetres(away), parts(found.neutral),
            f"{1e3 * taken / len(found.time):.1f} ms",
        )  # fmt: skip
        yield "| " + " | ".join(map(str, cells)) + " |"


def millimetres(value: float) -> str:
    """In tables."""
    return f"{1e3 * value:.1f} mm"


def main() -> None:
    """Reconstruct the recordings of the folder on the command line and write the page."""
    if len(sys.argv) != 2 or not (folder := Path(sys.argv[1]) / "mocap" / "grf").is_dir():
        raise SystemExit("usage: python docs/reconstruction.py FOLDER; valid: a folder with mocap/grf")
    PAGE.write_text(TEXT + "\n".join(lines(folder)) + "\n")


if __name__ == "__main__":
    main()
