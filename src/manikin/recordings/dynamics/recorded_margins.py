"""How far recorded people are from losing their balance ([Qiu2012]_ 4.4).

Every phase has one polytope of admissible wrenches; in every frame :func:`manikin.balance.motion_margin`
measures the distance of the wrench to its facets with moments about the centre of mass (4.2.9, remark 2, and
4.56), for a point mass (4.54) and for the whole body with its angular momentum (4.55, by the derivatives of
the motion instead of a difference of two frames).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.balance import LimitingConstraint, MotionMargin, WrenchPolytope, motion_margin, wrench_polytopes
from manikin.contact import ContactSchedule, Stance
from manikin.numerics.spatial import FloatArray, wrench_about
from manikin.recordings.dynamics.recorded_dynamics import RecordedDynamics

FLIGHT = Stance(())
"""Contacts of a phase without any."""


@dataclass(frozen=True, eq=False)
class RecordedMargins:
    """Margins of each frame about the centre of mass, alpha = 1 m; negative outside of what is admissible.

    In flight only the wrench 0 is admissible: the margin is minus the length of the one that is needed.

    Attributes:
        body: (n,) of the whole body: margin [N.m], force at the centre of mass that would end balance [N],
            distance of the zero moment point from the edge [m].
        mass: (n,) the same without angular momentum.
        phase: (n,) index of the phase.
        polytopes: One for each phase that has frames, by its index, about the middle of its contacts; None in
            flight.
        wrench: (n, 6) of the whole body about the world's origin [N, N.m].
        com: (n, 3) centre of mass [m].
    """

    body: MotionMargin
    mass: MotionMargin
    phase: NDArray[np.int64]
    polytopes: tuple[WrenchPolytope | None, ...]
    wrench: FloatArray
    com: FloatArray

    @property
    def whole_body(self) -> FloatArray:
        """(n,) margin of the whole body [N.m]."""
        return self.body.margin

    @property
    def point_mass(self) -> FloatArray:
        """(n,) margin without angular momentum [N.m]."""
        return self.mass.margin

    @property
    def lowest(self) -> int:
        """Frame of the lowest margin of the whole body."""
        return self.body.lowest

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
        """Contact and limit that the facet with the margin of a frame stands for; None in flight."""
        polytope = self.polytopes[int(self.phase[frame])]
        if polytope is None:
            return None
        com = self.com[frame]
        return polytope.at_reference(com).limiting(wrench_about(self.wrench[frame], com))


def recorded_margins(
    dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0
) -> RecordedMargins:
    """Margins of a recorded motion on its stances.

    Args:
        schedule: Of :func:`manikin.recordings.supports.body_supports.recorded_schedule`.
        start: The schedule's clock at the motion's first instant [s].
    """
    phases = schedule.phase_at(dynamics.time + start)
    stances = [phase.stance for phase in schedule.sequence]
    held = [number for number in np.unique(phases).tolist() if len(stances[number])]
    found = dict(zip(held, wrench_polytopes([stances[number] for number in held]), strict=True))
    return margins_within([found.get(number) for number in range(len(stances))], phases, dynamics)


def margins_within(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], dynamics: RecordedDynamics
) -> RecordedMargins:
    """Margins of a recorded motion in known polytopes.

    Args:
        polytopes: One for each phase; None for flight.
        phases: (n,) index of the phase in each frame.
    """
    body, mass = (
        margins_of_wrenches(polytopes, phases, wrench, dynamics.com)
        for wrench in (dynamics.wrench, dynamics.point_mass_wrench)
    )
    return RecordedMargins(body, mass, phases, tuple(polytopes), dynamics.wrench, dynamics.com)


def margins_of_wrenches(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], wrench: FloatArray, com: FloatArray
) -> MotionMargin:
    """Margins of wrenches about the centre of mass in known polytopes.

    Args:
        polytopes: One for each phase; None for flight.
        phases: (n,) index of the phase.
        wrench: (n, 6) about the world's origin [N, N.m].
        com: (n, 3) [m].
    """
    stances = [FLIGHT if one is None else one.stance for one in polytopes]
    return motion_margin(stances, phases, wrench, com, polytopes=polytopes)
