"""Supports of a recorded motion, its phases and key frames, as values."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.runtime.display import Displayed

SMALL = 1e-4
"""Distances much below this one count by their squares in a median place [m], which makes it unique."""

MEDIAN_STEPS = 60
"""Steps towards a median place; the same number always, so that equal motions give equal places."""


def median_place(positions: FloatArray) -> FloatArray:
    """(3,) median of (n, 3) positions that does not depend on where x and y point [m].

    In the horizontal plane it is the spatial median (Weiszfeld's steps), in height the ordinary median.
    """
    level = positions[:, :2] - positions[0, :2]
    place = level.mean(axis=0)
    for _ in range(MEDIAN_STEPS):
        weight = 1.0 / np.sqrt(np.sum((level - place) ** 2, axis=1) + SMALL**2)
        place = weight @ level / weight.sum()
    return np.append(positions[0, :2] + place, np.median(positions[:, 2]))


@dataclass(frozen=True, eq=False)
class Support:
    """One effector on a surface from an instant to another.

    Attributes:
        effector: Name of the body's effector.
        start: Touch-down, or the first instant of the recording [s].
        end: Lift-off, or the last instant of the recording [s].
        place: (3,) where the effector is, a :func:`median_place`; of a foot, at its surface's height [m].
        first_contact: (3,) heel or toes, whichever touched down, or the effector, then [m].
        last_contact: (3,) heel or toes, whichever lifted off, or the effector, then [m].
        start_seen: Whether the touch-down is in the recording.
        end_seen: Whether the lift-off is in the recording.
    """

    effector: str
    start: float
    end: float
    place: FloatArray
    first_contact: FloatArray
    last_contact: FloatArray
    start_seen: bool
    end_seen: bool

    def __post_init__(self) -> None:
        if self.end < self.start:
            raise InputError(
                f"support of {self.effector} from {self.start:g} to {self.end:g} s; valid: an end behind"
            )
        for name in ("place", "first_contact", "last_contact"):
            where = f"support of {self.effector} {name}"
            object.__setattr__(self, name, frozen_array(getattr(self, name), where, (3,)))

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.start


def support_between(
    effector: str, positions: FloatArray, frames: tuple[int, int], rate: float, start: float
) -> Support:
    """Support of one point for a run of frames.

    Args:
        positions: (n, 3) of the point in all frames [m].
        frames: First frame of the run and the one after its last.
        rate: Frames per second [Hz].
        start: Instant of the first of all frames [s].
    """
    (first, stop), last = frames, len(positions) - 1
    return Support(
        effector, start + first / rate, start + min(stop, last) / rate,
        median_place(positions[first:stop]), positions[first], positions[stop - 1],
        first > 0, stop <= last,
    )  # fmt: skip


@dataclass(frozen=True)
class SupportPhase:
    """A time in which the supports do not change.

    Attributes:
        start: [s].
        end: [s].
        effectors: Those that support; none in flight.
    """

    start: float
    end: float
    effectors: tuple[str, ...]

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.start


@dataclass(frozen=True, eq=False, repr=False)
class RecordedSupports(Displayed):
    """The supports of a recorded motion.

    Attributes:
        supports: In the order of their starts.
        start: First instant looked at [s].
        end: Last instant looked at [s].
        surfaces: Heights of the surfaces found on which feet stand, lowest first [m].
    """

    supports: tuple[Support, ...]
    start: float
    end: float
    surfaces: tuple[float, ...]

    def of(self, effector: str) -> tuple[Support, ...]:
        """Supports of one effector, in order."""
        return tuple(support for support in self.supports if support.effector == effector)

    def only(self, *effectors: str) -> "RecordedSupports":
        """These effectors' supports alone, as if nothing else could support: the feet of a walk, say."""
        return replace(self, supports=tuple(one for one in self.supports if one.effector in effectors))

    @cached_property
    def key_frames(self) -> tuple[float, ...]:
        """Instants at which supports change, with the first and the last instant ([Qiu2012]_ 3.2.2) [s]."""
        inner = {support.start for support in self.supports} | {support.end for support in self.supports}
        return tuple(sorted(inner | {self.start, self.end}))

    @cached_property
    def phases(self) -> tuple[SupportPhase, ...]:
        """From each key frame to the next."""
        return tuple(
            SupportPhase(start, end, tuple(sorted({
                support.effector for support in self.supports if support.start <= start and end <= support.end
            })))
            for start, end in pairwise(self.key_frames)
        )  # fmt: skip

    @property
    def sequence(self) -> tuple[str, ...]:
        """Effectors in the order in which they touch down during the recording."""
        return tuple(support.effector for support in self.supports if support.start_seen)
