"""Where people put their feet and hands, seen from what they pass or from where they begin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError
from manikin.mocap.phase_sequence import mirrored
from manikin.mocap.recorded_clip import RecordedClip
from manikin.spatial import FloatArray, finite_number, frozen_array

AROUND = 0.25
"""Time before and after an instant over which the direction of travel is taken [s]."""

FEWEST_TRAVELLED = 0.02
"""Way over which a direction is told [m]."""


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
class Placement:
    """One support of several motions ([Qiu2012]_ Fig. 3.9).

    Attributes:
        effector: Which one.
        number: Its how-manieth support behind the origin; 0 the last before it.
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

        Args:
            share: Between 0 and 1.

        Returns:
            (2,) half axes, the longer one first [m], and the direction of the longer one [rad].

        Raises:
            InputError: If the share is not in between, or there is one place only.
        """
        if not 0.0 < share < 1.0 or len(self.places) < 2:
            raise InputError(
                f"ellipse of {share:g} of {len(self.places)} places; valid: a share in 0 to 1, two places"
            )
        values, axes = np.linalg.eigh(self.covariance)
        halves = np.sqrt(np.maximum(values[::-1], 0.0) * -2.0 * np.log(1.0 - share))
        return halves, float(np.arctan2(axes[1, 1], axes[0, 1]))


def first_stance(clip: RecordedClip) -> Origin:
    """Middle of the first places of the feet, x towards the farthest place reached.

    Without any foot that supports it is the middle of the first places of all effectors.

    Raises:
        InputError: If nothing supports, or the centre of mass does not move on.
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

    Raises:
        InputError: If the centre of mass does not move on there.
    """
    frame = int(np.argmax(clip.com[:, 2]) if highest else np.argmin(clip.com[:, 2]))
    instant = float(clip.time[frame])
    before, after = (
        [np.interp(instant + shift, clip.time, clip.com[:, axis]) for axis in range(2)]
        for shift in (-AROUND, AROUND)
    )
    return Origin(clip.com[frame, :2], _heading(clip, np.subtract(after, before)), instant)


def support_placements(
    clips: Sequence[RecordedClip], origins: Sequence[Origin] | None = None, *, mirror: bool = False
) -> tuple[Placement, ...]:
    """Supports of the same number of several motions, seen from their origins.

    Args:
        clips: The motions of one group.
        origins: One for each; :func:`first_stance` if None.
        mirror: Whether motions whose first step behind the origin is made by the right foot are seen in a
            mirror, so that all begin with the left one.

    Returns:
        By effector and number, in their order.

    Raises:
        InputError: As :func:`first_stance`, or if there are not as many origins as motions.
    """
    if origins is None:
        origins = [first_stance(clip) for clip in clips]
    if len(origins) != len(clips):
        raise InputError(f"{len(origins)} origins of {len(clips)} motions; valid: one for each")
    found: dict[tuple[str, int], list[tuple[str, FloatArray]]] = {}
    for clip, origin in zip(clips, origins, strict=True):
        turned = mirror and _first_behind(clip, origin) == "right_foot"
        for effector, places in _numbered(clip, origin).items():
            name = mirrored(effector) if turned else effector
            for number, place in places.items():
                seen = origin.seen(place) * ([1.0, -1.0] if turned else [1.0, 1.0])
                found.setdefault((name, number), []).append((clip.name, seen))
    return tuple(
        Placement(name, number, tuple(clip for clip, _ in each), np.array([place for _, place in each]))
        for (name, number), each in sorted(found.items())
    )


def _numbered(clip: RecordedClip, origin: Origin) -> Mapping[str, Mapping[int, FloatArray]]:
    numbered = {}
    for name in {one.effector for one in clip.supports.supports}:
        supports = clip.supports.of(name)
        before = sum(one.start <= origin.instant for one in supports)
        numbered[name] = {index + 1 - before: one.place for index, one in enumerate(supports)}
    return numbered


def _first_behind(clip: RecordedClip, origin: Origin) -> str | None:
    later = (one for one in clip.supports.supports if one.start > origin.instant)
    return next((one.effector for one in later if one.effector.endswith("foot")), None)


def _heading(clip: RecordedClip, way: FloatArray) -> float:
    if np.hypot(*way) < FEWEST_TRAVELLED:
        raise InputError(
            f"clip {clip.name!r} stays where it is, which tells no direction; valid: an origin with a heading"
        )
    return float(np.arctan2(way[1], way[0]))
