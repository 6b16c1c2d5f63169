"""How far recorded people are from losing their balance ([Qiu2012]_ 4.4).

Every phase has one polytope of admissible wrenches; in every frame the margin is the distance of the wrench
to its facets, for a point mass at the centre of mass (4.54) and for the whole body with its angular momentum
(4.55, here by the derivatives of the motion, not by a difference of two frames), both by 4.56.

The margin depends on the point of the moments. People walk far from the world's origin, so moments are taken
about the middle of the contacts of each phase, as if the world's origin were there, and besides about the
centre of mass, which makes scenes comparable ([Qiu2012]_ 4.2.9). Its sign is the same about every point.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.balance import LimitingConstraint, WrenchPolytope, wrench_polytope
from manikin.contact import ContactSchedule, Stance
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.spatial import FloatArray, cross, frozen_array


@dataclass(frozen=True, eq=False)
class RecordedMargins:
    """Margins of each frame, alpha = 1 m; negative where the wrench is not admissible.

    In flight there is nothing to push against: the only admissible wrench is 0, and the margin is minus the
    largest component of the one that the motion needs about its centre of mass: a ballistic flight needs
    none.

    Attributes:
        whole_body: (n,) about the middle of the contacts [N.m].
        point_mass: (n,) without angular momentum, about the same point [N.m].
        whole_body_about_com: (n,) about the centre of mass [N.m].
        point_mass_about_com: (n,) [N.m].
        phase: (n,) index of the phase.
        polytopes: One for each phase that has frames, by its index; None in flight.
        wrench: (n, 6) of the whole body about the world's origin [N, N.m].
    """

    whole_body: FloatArray
    point_mass: FloatArray
    whole_body_about_com: FloatArray
    point_mass_about_com: FloatArray
    phase: NDArray[np.int64]
    polytopes: tuple[WrenchPolytope | None, ...]
    wrench: FloatArray

    @property
    def lowest(self) -> int:
        """Frame of the lowest margin of the whole body."""
        return int(np.argmin(self.whole_body))

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n,) whether there is any contact."""
        return np.array([one is not None for one in self.polytopes], dtype=bool)[self.phase]

    @property
    def balanced(self) -> float | None:
        """Share of the frames in contact in which the whole body's margin is positive; None without any."""
        held = self.held
        return float(np.mean(self.whole_body[held] > 0.0)) if held.any() else None

    def limiting(self, frame: int) -> LimitingConstraint | None:
        """Contact and limit that the nearest facet in a frame stands for; None in flight."""
        polytope = self.polytopes[int(self.phase[frame])]
        if polytope is None:
            return None
        return polytope.limiting(wrench_at(self.wrench[frame], polytope.reference))


def recorded_margins(
    dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0
) -> RecordedMargins:
    """Margins of a recorded motion on its stances.

    Args:
        dynamics: The motion.
        schedule: Of :func:`manikin.mocap.recorded_stances.recorded_schedule`.
        start: The schedule's clock at the motion's first instant [s].
    """
    phases = schedule.phase_at(dynamics.time + start)
    known: dict[tuple[int, ...], WrenchPolytope] = {}  # the same contacts come back, as both feet and a hand

    def polytope_of(stance: Stance) -> WrenchPolytope:
        key = tuple(map(id, stance))
        if key not in known:
            known[key] = _polytope(stance)
        return known[key]

    polytopes = tuple(
        polytope_of(phase.stance) if len(phase.stance) and np.any(phases == number) else None
        for number, phase in enumerate(schedule.sequence)
    )
    return margins_within(polytopes, phases, dynamics)


def margins_within(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], dynamics: RecordedDynamics
) -> RecordedMargins:
    """Margins of a recorded motion in known polytopes.

    Args:
        polytopes: One for each phase; None for flight.
        phases: (n,) index of the phase in each frame.
        dynamics: The motion.
    """
    body = margins_of_wrenches(polytopes, phases, dynamics.wrench, dynamics.com)
    mass = margins_of_wrenches(polytopes, phases, dynamics.point_mass_wrench, dynamics.com)
    return RecordedMargins(body[0], mass[0], body[1], mass[1], phases, tuple(polytopes), dynamics.wrench)


def margins_of_wrenches(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], wrench: FloatArray, com: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n,) margins about the references of the polytopes and about the centre of mass [N.m].

    Args:
        polytopes: One for each phase; None for flight.
        phases: (n,) index of the phase.
        wrench: (n, 6) about the world's origin [N, N.m].
        com: (n, 3) [m].
    """
    ours, abouts = np.empty(len(wrench)), np.empty(len(wrench))
    for number in np.unique(phases):
        polytope, frames = polytopes[number], np.flatnonzero(phases == number)
        if polytope is None:
            ours[frames] = abouts[frames] = -np.abs(wrench_at(wrench[frames], com[frames])).max(axis=1)
            continue
        arms = com[frames] - polytope.reference
        ours[frames], abouts[frames] = _margins(polytope, wrench_at(wrench[frames], polytope.reference), arms)
    return frozen_array(ours, "margins"), frozen_array(abouts, "margins about the CoM")


def wrench_at(wrench: FloatArray, place: FloatArray) -> FloatArray:
    """(..., 6) wrenches about the world's origin with moments about another point [N, N.m]."""
    force = wrench[..., :3]
    return np.concatenate([force, wrench[..., 3:] - cross(place, force)], axis=-1)


def _polytope(stance: Stance) -> WrenchPolytope:
    """About the middle of the contacts."""
    return wrench_polytope(stance, reference=np.mean([contact.position for contact in stance], axis=0))


def _margins(polytope: WrenchPolytope, wrench: FloatArray, arm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) margins about the reference and about points ``arm`` (n, 3) away from it.

    A row of unit length about the reference has the length ``sqrt(|H1 + H2 x arm|^2 + |H2|^2)`` about the
    other point, a quadratic of the arm.
    """
    ours, abouts = np.empty(len(wrench)), np.empty(len(wrench))
    force, moment = polytope.H[:, :3], polytope.H[:, 3:]
    linear = 2.0 * cross(force, moment)
    for part in _blocks(len(wrench)):
        distances = polytope.distances(wrench[part])
        ours[part] = distances.min(axis=1)
        lever = 1.0 + arm[part] @ linear.T - (arm[part] @ moment.T) ** 2
        lever += np.outer(np.sum(arm[part] ** 2, axis=1), np.sum(moment**2, axis=1))
        abouts[part] = (distances / np.sqrt(np.maximum(lever, 1e-12))).min(axis=1)
    return ours, abouts


def _blocks(count: int, size: int = 512) -> Iterator[slice]:
    return (slice(first, first + size) for first in range(0, count, size))
