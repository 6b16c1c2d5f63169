"""How far recorded people are from losing their balance ([Qiu2012]_ 4.4).

Every phase has one polytope of admissible wrenches; in every frame the margin is the distance of the wrench
to its facets, for a point mass at the centre of mass (4.54) and for the whole body with its angular momentum
(4.55, here by the derivatives of the motion, not by a difference of two frames), both by 4.56.

Moments are about the centre of mass, so that margins do not depend on where people walk and scenes are
comparable ([Qiu2012]_ 4.2.9, remark 2). The sign is the same about every point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.balance import (
    LimitingConstraint,
    MotionMargin,
    WrenchPolytope,
    motion_margin,
    wrench_about,
    wrench_polytopes,
)
from manikin.contact import ContactSchedule, Stance
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class RecordedMargins:
    """Margins of each frame, alpha = 1 m; negative where the wrench is not admissible.

    In flight there is nothing to push against: the only admissible wrench is 0, and the margin is minus the
    length of the one that the motion needs about its centre of mass: a ballistic flight needs none.

    Attributes:
        whole_body: (n,) about the centre of mass [N.m].
        point_mass: (n,) without angular momentum, about the same point [N.m].
        force: (n,) smallest force at the centre of mass that ends the whole body's balance [N].
        zmp_distance: (n,) of the whole body's ZMP to the edge of the support polygon, not a number where the
            contacts do not span one plane [m].
        phase: (n,) index of the phase.
        polytopes: One for each phase that has frames, by its index; None in flight.
        wrench: (n, 6) of the whole body about the world's origin [N, N.m].
        com: (n, 3) centre of mass [m].
    """

    whole_body: FloatArray
    point_mass: FloatArray
    force: FloatArray
    zmp_distance: FloatArray
    phase: NDArray[np.int64]
    polytopes: tuple[WrenchPolytope | None, ...]
    wrench: FloatArray
    com: FloatArray

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
        wrench = wrench_about(self.wrench[frame], polytope.reference)
        return polytope.limiting(wrench, self.com[frame])


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
    present = [
        number
        for number, phase in enumerate(schedule.sequence)
        if len(phase.stance) and np.any(phases == number)
    ]
    found = wrench_polytopes([schedule.sequence[number].stance for number in present])
    known = dict(zip(present, found, strict=True))
    polytopes = tuple(known.get(number) for number in range(len(schedule.sequence)))
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
    return RecordedMargins(
        body.margin, mass.margin, body.force, body.zmp_distance, phases, tuple(polytopes), dynamics.wrench,
        dynamics.com,
    )  # fmt: skip


def margins_of_wrenches(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], wrench: FloatArray, com: FloatArray
) -> MotionMargin:
    """Margins of a series of wrenches.

    Args:
        polytopes: One for each phase; None for flight.
        phases: (n,) index of the phase.
        wrench: (n, 6) about the world's origin [N, N.m].
        com: (n, 3) [m].
    """
    stances = [Stance([]) if polytope is None else polytope.stance for polytope in polytopes]
    return motion_margin(stances, phases, wrench, com, polytopes=polytopes)
