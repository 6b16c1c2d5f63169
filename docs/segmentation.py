"""Measure the segmentation of recorded walks: writes ``segmentation.md``.

Run ``python docs/segmentation.py FOLDER``, where FOLDER has ``clips_locomotion.csv`` (windows of recordings
with a class each) and, in ``mocap``, recordings of the CMU Graphics Lab and of the ACCAD Open Motion Project.
"""

import csv
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from acknowledgements import THANKS
from numpy.typing import NDArray

from manikin.recordings import Recording, read_recording
from manikin.walking import (
    HOLONOMIC,
    KINDS,
    NONHOLONOMIC,
    PathSegments,
    SegmentationRule,
    ShoulderPaths,
    segment_path,
)

PAGE = Path(__file__).with_suffix(".md")
WALKS = {
    "walk straight": NONHOLONOMIC,
    "walk veer": NONHOLONOMIC,
    "turn on spot": NONHOLONOMIC,
    "sidestep core": HOLONOMIC,
    "diagonal back-right": HOLONOMIC,
}
RUNS = {"run straight": NONHOLONOMIC, "run veer": NONHOLONOMIC}
EXPECTED = WALKS | RUNS
"""What a class is by its name; a turn on the spot as in figure 4.3 (b) to (d)."""

TEXT = """# Segments of recorded walks

Function 1 of Truong (2010) on windows of recorded motion: a frame is nonholonomic if the left or the right
shoulder moves within {tolerance:.0f}° of the heading. *On-line*: Function 1 alone. *Off-line*: with the
low-pass ({cutoff:g} of the Nyquist frequency), noise up to {noise:g} s and the boundary of {boundary:g}°.
Both shoulders below {standing:g} m/s: standing, which counts as disagreement. By `docs/segmentation.py`.

"""
STOPS = """
Straight walks below 95 %: `16_33` and `16_34` come to a stop in the window, where the holonomic frames are;
in `05_01` and `38_01` both shoulders sway at once, by up to 24°. In veering runs both
go some 16° to 26° aside of the heading for a while.
"""
DRIFT = """
## Turns on the spot

Means over the window. While a body of half breadth *b* turns at *ω*, its foremost shoulder goes ahead at *ωb*
plus the forward speed of the middle; drifting aside by more than tan {tolerance:.0f}° of that, the limit, is
holonomic. *Left*, *right*: share of the frames in which that shoulder goes ahead within the tolerance.

"""
LINES = """
Function 1 has no case of its own for turns on the spot. Figure 4.3 (d) calls both shoulders nonholonomic
then, also the one that moves back; so do the constraint (1.1) and the quotient (4.1), which has no quadrants.
With `either_way` of the rule, off-line agreement is {turns} on turns on the spot, {walks} on walks,
{all} on walks and runs, and walks backward become nonholonomic ({back} of their frames). So these
turns disagree because of the drift aside, not because of the sense. The default is the direction.
"""


@dataclass(frozen=True, eq=False)
class Clip:
    """A window of a recording, segmented within the whole."""

    kind: str
    file: str
    window: slice
    online: PathSegments
    offline: PathSegments

    @property
    def expected(self) -> str | None:
        """What its class is by its name, or None."""
        return next((kind for name, kind in EXPECTED.items() if self.kind.startswith(name)), None)

    @property
    def frames(self) -> int:
        """Of the window."""
        return self.window.stop - self.window.start

    def agreement(self, online: bool) -> NDArray[np.bool_]:
        """Frames whose label is the expected one."""
        return (self.online if online else self.offline).labels[self.window] == self.expected


@cache
def shoulders(file: Path) -> ShoulderPaths:
    """Of a recording."""
    found = read_recording(file)
    assert isinstance(found, Recording)
    return ShoulderPaths.of_recording(found)


def clips(folder: Path, rule: SegmentationRule) -> Iterator[Clip]:
    """All windows of the table."""
    with (folder / "clips_locomotion.csv").open(newline="") as rows:
        for row in csv.DictReader(rows):
            paths = shoulders(folder / "mocap" / row["file"])
            window = slice(int(row["first_frame0"]), int(row["end_frame0"]))
            yield Clip(
                row["class"],
                Path(row["file"]).stem,
                window,
                segment_path(paths, rule, online=True),
                segment_path(paths, rule),
            )


def agreement(found: Sequence[Clip], classes: Iterable[str]) -> tuple[int, float, float]:
    """Frames of the classes, and shares of them that agree on-line and off-line."""
    chosen = [clip for clip in found if clip.kind.startswith(tuple(classes))]
    shares = [
        float(np.mean(np.concatenate([c.agreement(online) for c in chosen]))) for online in (True, False)
    ]
    return sum(clip.frames for clip in chosen), shares[0], shares[1]


def summary(found: Sequence[Clip]) -> Iterator[str]:
    """Table by class."""
    yield from row("class", "expected", "frames", "agree on-line", "agree off-line")
    for name, kind in EXPECTED.items():
        frames, online, offline = agreement(found, [name])
        yield from row(name, kind, frames, percent(online), percent(offline), head=False)
    for title, classes in (("**walks**", WALKS), ("**walks and runs**", EXPECTED)):
        frames, online, offline = agreement(found, classes)
        yield from row(title, "", frames, percent(online), percent(offline), head=False)


def by_clip(found: Sequence[Clip]) -> Iterator[str]:
    """Table by clip, off-line shares of each kind."""
    yield from row("class", "clip", "frames", *KINDS, "expected", "agree on-line", "agree off-line")
    for clip in found:
        labels = clip.offline.labels[clip.window]
        shares = [percent(float(np.mean(labels == kind))) for kind in KINDS]
        agree = [percent(float(np.mean(clip.agreement(o)))) if clip.expected else "-" for o in (True, False)]
        name = f"{clip.file} {clip.window.start}-{clip.window.stop}"
        yield from row(clip.kind, name, clip.frames, *shares, clip.expected or "-", *agree, head=False)


def drift(found: Sequence[Clip], rule: SegmentationRule) -> Iterator[str]:
    """Table of the turns on the spot."""
    yield from row("clip", "ωb [m/s]", "drift aside [m/s]", "limit [m/s]", "left", "right", "agree off-line")
    for clip in found:
        if not clip.kind.startswith("turn on spot"):
            continue
        paths, within = clip.offline.paths, clip.window
        velocity = paths.velocities().mean(axis=1)[within]
        heading = paths.heading[within]
        forward = velocity[:, 0] * np.cos(heading) + velocity[:, 1] * np.sin(heading)
        aside = velocity[:, 1] * np.cos(heading) - velocity[:, 0] * np.sin(heading)
        half = np.hypot(*(paths.left - paths.right)[within].T) / 2
        turning = np.abs(np.gradient(heading, 1.0 / paths.rate)) * half
        limit = np.tan(rule.tolerance) * np.maximum(turning + forward, 0.0)
        ahead = np.mean(np.abs(clip.offline.deviations[within]) < rule.tolerance, axis=0)
        values = [f"{np.mean(v):.2f}" for v in (turning, np.abs(aside), limit)]
        name = f"{clip.file} {within.start}-{within.stop}"
        agree = percent(float(np.mean(clip.agreement(False))))
        yield from row(name, *values, *(percent(float(share)) for share in ahead), agree, head=False)


def lines(folder: Path, rule: SegmentationRule) -> str:
    """What changes where a shoulder may go back as well as ahead."""
    found = list(clips(folder, replace(rule, either_way=True)))
    back = np.concatenate([
        clip.offline.labels[clip.window] == NONHOLONOMIC for clip in found if clip.kind.startswith("backward")
    ])  # fmt: skip
    shares = {"turns": ["turn on spot"], "walks": WALKS, "all": EXPECTED}
    return LINES.format(
        back=percent(float(np.mean(back))),
        **{name: percent(agreement(found, classes)[2]) for name, classes in shares.items()},
    )


def percent(share: float) -> str:
    """In tables."""
    return f"{100 * share:.1f} %"


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def main() -> None:
    """Segment the recordings of the folder on the command line and write the page."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "clips_locomotion.csv").is_file():
        raise SystemExit(
            "usage: python docs/segmentation.py FOLDER; valid: a folder with clips_locomotion.csv"
        )
    folder, rule = Path(sys.argv[1]), SegmentationRule()
    found = list(clips(folder, rule))
    assert rule.boundary is not None
    numbers = {
        "tolerance": np.degrees(rule.tolerance), "cutoff": rule.cutoff, "noise": rule.noise,
        "boundary": np.degrees(rule.boundary), "standing": rule.standing_speed,
    }  # fmt: skip
    tables = ["\n".join(lines) + "\n" for lines in (summary(found), drift(found, rule), by_clip(found))]
    PAGE.write_text(
        TEXT.format(**numbers) + tables[0] + STOPS + DRIFT.format(**numbers) + tables[1]
        + lines(folder, rule) + "\n## By clip\n\nShares of the kinds are off-line.\n\n" + tables[2] + THANKS
    )  # fmt: skip


if __name__ == "__main__":
    main()
