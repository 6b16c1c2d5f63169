"""How far recorded people are from losing their balance ([Qiu2012]_ 4.4).

Every phase has one polytope of admissible wrenches; in every frame the margin is the distance of the wrench
to its facets with moments about the centre of mass ([Qiu2012]_ 4.2.9, remark 2), for a point mass there
(4.54) and for the whole body with its angular momentum (4.55, here by the derivatives of the motion, not by a
difference of two frames), both by 4.56. It is :func:`manikin.balance.motion_margin`, as of planned motions.

Also here. Why a recorded person, who did not fall, has frames without a positive margin.

A low-pass spreads what happens at touch-down over a quarter of its period to either side, and supports are
known no better. A wrench that the stance before or after such a change admits is told from one that no
stance does; so are the ends of the recording, where derivatives look to one side only, and recordings that
say nothing about trunk or arms.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from manikin.balance import LimitingConstraint, MotionMargin, WrenchPolytope, motion_margin, wrench_polytopes
from manikin.contact import ContactSchedule, Stance
from manikin.numerics.spatial import FloatArray, wrench_about
from manikin.recordings.dynamics.recorded_dynamics import CUTOFF, RecordedDynamics

FLIGHT = Stance(())
"""Contacts of a phase without any."""


@dataclass(frozen=True, eq=False)
class RecordedMargins:
    """Margins of each frame about the centre of mass, alpha = 1 m; negative outside of what is admissible.

    In flight there is nothing to push against: the only admissible wrench is 0, and the margin is minus the
    length of the one that the motion needs about its centre of mass: a ballistic flight needs none.

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
        dynamics: The motion.
        schedule: Of :func:`manikin.recordings.supports.recorded_stances.recorded_schedule`.
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
        dynamics: The motion.
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


class Cause(StrEnum):
    """What a margin that is not positive is put down to."""

    CHANGE = "change of support"
    """The stance before or after a change within a quarter of the cutoff's period admits the wrench."""
    END = "end of the recording"
    """Half of the cutoff's period from the first or the last frame, or less."""
    FLIGHT = "flight"
    """Nothing supports."""
    UNTOLD = "untold trunk or arms"
    """No marker tells where a third of the body, or its arms, are."""
    MODEL = "model"
    """None of these: the body's masses, the soles, the recording."""


@dataclass(frozen=True)
class Loss:
    """A frame whose margin is not positive.

    Attributes:
        frame: Its index.
        time: On the clock of the stances [s].
        margin: [N.m].
        cause: What it is put down to.
    """

    frame: int
    time: float
    margin: float
    cause: Cause


def balance_losses(
    margins: RecordedMargins, dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0,
    neutral: Sequence[str] = (), cutoff: float = CUTOFF,
) -> tuple[Loss, ...]:  # fmt: skip
    """Every frame without a positive margin of the whole body, with its cause.

    Args:
        margins: Of the motion.
        dynamics: The motion.
        schedule: Its stances.
        start: The schedule's clock at the motion's first instant [s].
        neutral: Segments about which the recording says nothing.
        cutoff: Of the low-pass of the postures [Hz].
    """
    times, near = dynamics.time + start, 0.25 / cutoff
    untold = bool({"thorax", "left_upper_arm", "right_upper_arm"} & set(neutral))
    before, after = schedule.phase_at(times - near), schedule.phase_at(times + near)
    found = []
    for frame in np.flatnonzero(margins.whole_body <= 0.0).tolist():
        others = [margins.polytopes[k] for k in range(before[frame], after[frame] + 1)]
        wrench = dynamics.wrench[frame]
        if any(one is not None and one.margin(wrench_about(wrench, one.reference)) > 0.0 for one in others):
            cause = Cause.CHANGE
        elif margins.polytopes[int(margins.phase[frame])] is None:
            cause = Cause.FLIGHT
        elif min(times[frame] - times[0], times[-1] - times[frame]) <= 2.0 * near:
            cause = Cause.END
        else:
            cause = Cause.UNTOLD if untold else Cause.MODEL
        found.append(Loss(frame, float(times[frame]), float(margins.whole_body[frame]), cause))
    return tuple(found)


def share_by_cause(losses: Sequence[Loss], frames: int) -> dict[Cause, float]:
    """Share of all frames that each cause takes."""
    counts = Counter(loss.cause for loss in losses)
    return {cause: counts[cause] / frames for cause in Cause}
