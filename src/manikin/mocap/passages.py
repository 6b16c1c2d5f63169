"""How low people go under something, and how much room they leave below it.

What hangs over the way is a bar or the underside of a box. Of a bar only the height is given: wherever it
was, it was where all of the body was below it. Each part may have passed it where it was lowest itself, so
the room below a bar is an upper bound. Of a box the place is given as well, and the room is the least one
while any part is below it; it is negative for who would have hit it.
Who crouches on the spot, or is low when the recording begins or ends, passes no bar.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.mocap.recorded_clip import RecordedClip
from manikin.mocap.runs import runs
from manikin.spatial import FloatArray, finite_number

CROSSED = 0.1
"""Level way of the centre of mass below a bar from which on it is passed [m]."""


@dataclass(frozen=True)
class Overhead:
    """Something to pass under.

    Attributes:
        height: Of its underside above the lowest surface on which feet stood [m].
        x: Where it begins and ends in the world [m]; None for a bar whose place is not known.
        y: As ``x``.
    """

    height: float
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        finite_number(self.height, "height to pass under [m]", above=0.0)
        if (self.x is None) != (self.y is None):
            raise InputError(
                "something overhead has one of x and y only; valid: both for a box, none for a bar"
            )
        for axis, ends in (("x", self.x), ("y", self.y)):
            if ends is not None and not ends[0] < ends[1]:
                raise InputError(f"something overhead has {axis} from {ends[0]} to {ends[1]}; valid: rising")

    def above(self, place: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether it is above each of the (n, 2 or more) places; a bar may be above any."""
        inside = np.ones(len(place), dtype=bool)
        for axis, ends in enumerate((self.x, self.y)):
            if ends is not None:
                inside &= (place[:, axis] >= ends[0]) & (place[:, axis] <= ends[1])
        return inside


@dataclass(frozen=True)
class Passage:
    """One time below something, or a whole recording.

    Attributes:
        start: [s].
        end: [s].
        com_lowest: Least height of the centre of mass above the floor [m].
        com_lowest_at: When [s].
        com_place: (x, y) where [m].
        com_highest: Largest height of the centre of mass above the floor [m].
        travelled: Level distance between where the centre of mass was at the start and at the end [m].
        tops: Height that counts of each part of the body: the least one, the largest one below a box [m].
        room: From the highest of these to what is passed; None for a whole recording [m].
        below: From the lowest centre of mass to what is passed ([Qiu2012]_ Fig. 3.14) [m].
    """

    start: float
    end: float
    com_lowest: float
    com_lowest_at: float
    com_place: tuple[float, float]
    com_highest: float
    travelled: float
    tops: Mapping[str, float]
    room: float | None = None
    below: float | None = None


def whole_passage(clip: RecordedClip) -> Passage:
    """Lowest centre of mass and lowest tops of a whole recording."""
    return _passage(clip, 0, len(clip.time), None)


def passages(clip: RecordedClip, overhead: Overhead) -> tuple[Passage, ...]:
    """Times in which a person is below something, in order; none for who never is.

    Args:
        clip: The motion, with tops.
        overhead: What is passed. Below a bar is who has all tops below it, below a box who has any part
            or the centre of mass there.

    Raises:
        InputError: If the motion has no tops.
    """
    if not clip.tops:
        raise InputError(f"clip {clip.name!r} has no highest points; valid: those of one part or more")
    if overhead.x is None:
        heights = np.max([top[:, 2] for top in clip.tops.values()], axis=0) - clip.floor
        under = heights < overhead.height
    else:
        under = np.any([overhead.above(place) for place in (clip.com, *clip.tops.values())], axis=0)
    found = [(first, stop, _passage(clip, first, stop, overhead)) for first, stop in runs(under)]
    if overhead.x is not None:
        return tuple(one for _, _, one in found)
    last = len(clip.time)
    return tuple(one for a, b, one in found if a > 0 and b < last and one.travelled >= CROSSED)


def _passage(clip: RecordedClip, first: int, stop: int, overhead: Overhead | None) -> Passage:
    part = slice(first, stop)
    com, floor = clip.com[part], clip.floor
    lowest = int(np.argmin(com[:, 2]))
    height = float(com[lowest, 2]) - floor
    if overhead is None or overhead.x is None:
        tops = {name: float(top[part, 2].min()) - floor for name, top in clip.tops.items()}
    else:
        inside = {name: top[part][overhead.above(top[part])] for name, top in clip.tops.items()}
        tops = {name: float(top[:, 2].max()) - floor for name, top in inside.items() if len(top)}
    room = overhead.height - max(tops.values()) if overhead is not None and tops else None
    return Passage(
        float(clip.time[first]), float(clip.time[stop - 1]), height, float(clip.time[part][lowest]),
        (float(com[lowest, 0]), float(com[lowest, 1])), float(com[:, 2].max()) - floor,
        float(np.hypot(*(com[-1] - com[0])[:2])), tops, room,
        None if overhead is None else overhead.height - height,
    )  # fmt: skip
