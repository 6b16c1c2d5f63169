"""Passages of recorded people under something, placements of their supports, distances of the CoM from them.

What is overhead is a bar or the underside of a box. Of a bar only the height is given; the body passes it
while all of it is lower. As each part may pass where it is lowest itself, the room below a bar is an upper
bound. The position of a box is given, and the room is the least one while any part is below it, negative for
a collision. A person who crouches on the spot, or is low when the recording begins or ends, passes no bar.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.motion.passage import Passage
from manikin.numerics.signals import Spread, mask_runs
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.phases import mirrored

AROUND, FEWEST_TRAVELLED = 0.25, 0.02
"""Time before and after an instant over which the direction of travel is taken [s]; shortest way with one
[m]."""


@dataclass(frozen=True, eq=False)
class Origin:
    """A place on the floor from which supports are seen, and when it was passed.

    Attributes:
        place: (2,) in the world [m].
        heading: Direction of its x axis, counter-clockwise from the world's x [rad].
        instant: Supports that begin later are numbered from 1, all others down from 0 [s].
    """

    place: FloatArray
    heading: float
    instant: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "place", frozen_array(self.place, "origin place", (2,)))
        finite_number(self.heading, "origin heading [rad]")
        finite_number(self.instant, "origin instant [s]")

    def seen(self, places: FloatArray) -> FloatArray:
        """(..., 2) level coordinates of (..., 2 or more) places of the world in this frame [m]."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return (places[..., :2] - self.place) @ np.array([[c, -s], [s, c]])


@dataclass(frozen=True, eq=False)
class SupportPlacement:
    """One support of several motions ([Qiu2012]_ Fig. 3.9).

    Attributes:
        number: Its count after the origin, from 1; 0 is the last one before it.
        clips: (k,) names of the motions.
        places: (k, 2) in the frame of the origin, x ahead [m].
    """

    effector: str
    number: int
    clips: tuple[str, ...]
    places: FloatArray

    def __post_init__(self) -> None:
        shape = (len(self.clips), 2)
        object.__setattr__(self, "places", frozen_array(self.places, "placement places", shape))

    @property
    def mean(self) -> FloatArray:
        """(2,) [m]."""
        return self.places.mean(axis=0)

    @property
    def covariance(self) -> FloatArray:
        """(2, 2) of the sample, NaN for one place [m²]."""
        if len(self.places) < 2:
            return np.full((2, 2), np.nan)
        return np.cov(self.places.T)

    def ellipse(self, share: float = 0.5) -> tuple[FloatArray, float]:
        """Ellipse about the mean in which a share of places lies, were they normal with this covariance.

        Of two places or more, and a share between 0 and 1, it has (2,) half axes, the longer one first [m],
        and the direction of the longer one [rad].
        """
        if not 0.0 < share < 1.0 or len(self.places) < 2:
            wrong = f"ellipse of {share:g} of {len(self.places)} places"
            raise InputError(f"{wrong}; valid: a share in 0 to 1, two places")
        values, axes = np.linalg.eigh(self.covariance)
        halves = np.sqrt(np.maximum(values[::-1], 0.0) * -2.0 * np.log(1.0 - share))
        return halves, float(np.arctan2(axes[1, 1], axes[0, 1]))


def first_stance(clip: RecordedClip) -> Origin:
    """Middle of the first places of the feet, x towards the farthest place reached.

    Without any foot that supports it is the middle of the first places of all effectors. InputError if
    nothing supports, or the centre of mass does not move on.
    """
    supports = clip.supports.supports
    first = {one.effector: one.place for one in reversed(supports)}
    feet = [place for name, place in first.items() if name.endswith("foot")] or list(first.values())
    if not feet:
        raise InputError(f"clip {clip.name!r} has no support to see the others from; valid: one or more")
    way = clip.com[:, :2] - clip.com[0, :2]
    farthest = way[int(np.argmax(np.linalg.norm(way, axis=1)))]
    return Origin(np.mean(feet, axis=0)[:2], _heading(clip, farthest), clip.supports.start)


def com_extreme(clip: RecordedClip, *, highest: bool = False) -> Origin:
    """Where the centre of mass was lowest (highest), x along its way there: the place of what was passed.

    InputError if the centre of mass does not move on there.
    """
    frame = int(np.argmax(clip.com[:, 2]) if highest else np.argmin(clip.com[:, 2]))
    instant = float(clip.time[frame])
    around = (instant - AROUND, instant + AROUND)
    way = np.array([np.diff(np.interp(around, clip.time, clip.com[:, axis]))[0] for axis in range(2)])
    return Origin(clip.com[frame, :2], _heading(clip, way), instant)


def support_placements(
    clips: Sequence[RecordedClip], origins: Sequence[Origin] | None = None, *, mirror: bool = False
) -> tuple[SupportPlacement, ...]:
    """Supports of the same number of several motions, seen from their origins, by effector and number.

    Args:
        clips: The motions of one group.
        origins: One for each; :func:`first_stance`, with its errors, if None.
        mirror: Whether motions whose first step after the origin is made by the right foot are mirrored.
    """
    if origins is None:
        origins = [first_stance(clip) for clip in clips]
    if len(origins) != len(clips):
        raise InputError(f"{len(origins)} origins of {len(clips)} motions; valid: one for each")
    found: dict[tuple[str, int], list[tuple[str, FloatArray]]] = {}
    for clip, origin in zip(clips, origins, strict=True):
        later = [one.effector for one in clip.supports.supports if one.start > origin.instant]
        first = next((name for name in later if name.endswith("foot")), None)
        turned = mirror and first == "right_foot"
        for effector in {one.effector for one in clip.supports.supports}:
            supports = clip.supports.of(effector)
            before = sum(one.start <= origin.instant for one in supports)
            for number, one in enumerate(supports, start=1 - before):
                seen = origin.seen(one.place) * ([1.0, -1.0] if turned else [1.0, 1.0])
                name = mirrored(effector) if turned else effector
                found.setdefault((name, number), []).append((clip.name, seen))
    return tuple(
        SupportPlacement(name, number, tuple(clip for clip, _ in each), np.array([seen for _, seen in each]))
        for (name, number), each in sorted(found.items())
    )


def _heading(clip: RecordedClip, way: FloatArray) -> float:
    if np.hypot(*way) < FEWEST_TRAVELLED:
        wrong = "stays where it is, without a direction"
        raise InputError(f"clip {clip.name!r} {wrong}; valid: an origin with a heading")
    return float(np.arctan2(way[1], way[0]))


LIMIT = 1.08
"""Distance from the centre of mass to a foot within which motions are planned ([Qiu2012]_ Table 7.5) [m]."""


@dataclass(frozen=True, eq=False)
class SupportDistance:
    """Distance (k,) from the CoM to the place of one support at instants (k,) while it supports [m, s]."""

    clip: str
    effector: str
    time: FloatArray
    distance: FloatArray

    def __post_init__(self) -> None:
        for name in ("time", "distance"):
            value = frozen_array(getattr(self, name), f"support distance {name}", (len(self.time),))
            object.__setattr__(self, name, value)


def support_distances(clip: RecordedClip) -> tuple[SupportDistance, ...]:
    """Distances to each support, in order; supports too short for any instant are left out.

    A foot's support is at the middle of its sole on the ground; the thesis projects the foot's centre of mass
    ([Qiu2012]_ 3.2.3).
    """
    found = []
    for one in clip.supports.supports:
        within = (clip.time >= one.start - 1e-9) & (clip.time <= one.end + 1e-9)
        if within.any():
            distance = np.linalg.norm(clip.com[within] - one.place, axis=1)
            found.append(SupportDistance(clip.name, one.effector, clip.time[within], distance))
    return tuple(found)


def largest_distances(clips: Sequence[RecordedClip]) -> dict[str, Spread]:
    """The largest distance of each motion, by effector, over all motions ([Qiu2012]_ Table 3.5) [m]."""
    largest: dict[str, list[float]] = {}
    for clip in clips:
        for effector, each in _distances([clip]).items():
            largest.setdefault(effector, []).append(float(each.max()))
    return {effector: Spread.of(values) for effector, values in sorted(largest.items())}


def shares_within(clips: Sequence[RecordedClip], limit: float = LIMIT) -> dict[str, float]:
    """Share of all instants of all motions at which the distance is not above a limit, by effector."""
    return {name: float(np.mean(each <= limit)) for name, each in sorted(_distances(clips).items())}


def _distances(clips: Sequence[RecordedClip]) -> dict[str, FloatArray]:
    """All distances [m] by effector."""
    every: dict[str, list[FloatArray]] = {}
    for one in chain.from_iterable(map(support_distances, clips)):
        every.setdefault(one.effector, []).append(one.distance)
    return {effector: np.concatenate(each) for effector, each in every.items()}


CROSSED = 0.1
"""Level way of the centre of mass below a bar from which on it is passed [m]."""


@dataclass(frozen=True)
class Overhead:
    """Something to pass under.

    Attributes:
        height: Of its underside above the lowest surface on which feet stood [m].
        x: Where it begins and ends in the world [m], as ``y``; None for a bar whose place is not known.
    """

    height: float
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        finite_number(self.height, "height to pass under [m]", above=0.0)
        if (self.x is None) != (self.y is None):
            raise InputError("overhead has one of x and y only; valid: both for a box, none for a bar")
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


def whole_passage(clip: RecordedClip) -> Passage:
    """Lowest centre of mass and lowest tops of a whole recording."""
    return _passage(clip, 0, len(clip.time), None)


def passages(clip: RecordedClip, overhead: Overhead) -> tuple[Passage, ...]:
    """Times in which a person, with highest points of one part or more, is below something, in order.

    All tops have to be below a bar, any part or the centre of mass below a box.
    """
    if not clip.tops:
        raise InputError(f"clip {clip.name!r} has no highest points; valid: those of one part or more")
    last, box = len(clip.time), overhead.x is not None
    if box:
        under = np.any([overhead.above(place) for place in (clip.com, *clip.tops.values())], axis=0)
    else:
        under = np.max([top[:, 2] for top in clip.tops.values()], axis=0) - clip.floor < overhead.height
    found = [(first, stop, _passage(clip, first, stop, overhead)) for first, stop in mask_runs(under)]
    return tuple(one for a, b, one in found if box or (a > 0 and b < last and one.travelled >= CROSSED))


def _passage(clip: RecordedClip, first: int, stop: int, overhead: Overhead | None) -> Passage:
    part, floor = slice(first, stop), clip.floor
    if overhead is None or overhead.x is None:
        tops = {name: float(top[part, 2].min()) - floor for name, top in clip.tops.items()}
    else:
        inside = {name: top[part][overhead.above(top[part])] for name, top in clip.tops.items()}
        tops = {name: float(top[:, 2].max()) - floor for name, top in inside.items() if len(top)}
    room = overhead.height - max(tops.values()) if overhead is not None and tops else None
    height = None if overhead is None else overhead.height
    return Passage.of(clip.time[part], clip.com[part], floor, tops=tops, room=room, overhead=height)
