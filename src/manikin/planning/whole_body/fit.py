"""Fit one smooth whole-body spline to contacts, swings and a centre-of-mass path.

All samples of the motion are solved together by damped Gauss-Newton over the control points of
a clamped quintic spline.  Unlike a posture-by-posture solution ([Qiu2012]_ 6.2) the result is
smooth by construction, and the rate of its centroidal momentum follows what the point-mass
plan assumes, so that the whole body keeps the balance that was planned for its centre of mass.

Also here. Other weights for a whole-body fit that has missed a requirement by a little.

The fit weighs everything that is wanted of a motion against everything else; what the certificate
finds broken gets more weight, and the fit goes on from where it was.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from manikin.body import BodyModel
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.fit_objective import FitLinearisation, MotionObjective
from manikin.planning.whole_body.fit_scales import FitScales, MotionScales
from manikin.planning.whole_body.fit_targets import FitTargets
from manikin.scene import Proximity

S = TypeVar("S", bound=MotionScales)

STRONGER = 0.5
"""Factor of the scales of what was missed."""

NEARER = 0.75
"""Factor of the wanted clearance where the required one is missed."""

LEAST_SAFE_DISTANCE = 0.014
"""Wanted clearance that this leaves [m]: more than the required one."""

MORE_ROUNDS = 12
"""Further rounds of the multipliers for contacts and centre of mass."""

FIRST_DECREASE = 0.02
"""Relative decrease of the objective below which the first repair stops."""

LATER_DECREASE = 0.005
"""The same where that did not help, or a fit begins anew: the harder, the more patience."""

_SCALES = MappingProxyType(
    {
        "max_support_error_m": ("tolerance",),
        "max_com_error_m": ("tolerance",),
        "max_meeting_error_m": ("position",),
        "min_clearance_m": ("clearance",),
        "max_joint_limit_violation_rad": ("joint_limit",),
        "max_velocity_share": ("joint_velocity",),
        "max_missing_wrench": ("force", "moment_share"),
        "max_torque_share": ("force", "moment_share", "torque_share"),
    }
)
"""Scales that decide each field of the certificate.  Contacts and the centre of mass have multipliers, which
are only updated until the tolerance is kept."""


def with_updated_penalties(
    scales: FitScales, broken: frozenset[str], *, narrow: bool = False, decrease: float = LATER_DECREASE
) -> FitScales:
    """Return scales at which the broken requirements weigh more.

    Args:
        scales: Those of the fit before.
        broken: Names of fields of the certificate, see :meth:`WholeBodyResiduals.broken`.
        narrow: Whether to count on less room where clearance is missed.
        decrease: Relative decrease of the objective below which the iteration stops.
    """
    if narrow and "min_clearance_m" in broken:
        scales = replace(scales, **_nearer(scales))
    return replace(stronger(scales, broken, _SCALES), multiplier_rounds=MORE_ROUNDS, decrease=decrease)


def stronger(scales: S, broken: frozenset[str], table: Mapping[str, tuple[str, ...]]) -> S:
    """Return scales at which what was missed weighs more.

    Args:
        scales: Those of the fit before.
        broken: Names of fields of a certificate.
        table: Scales that decide each field.
    """
    names = {scale for field in broken for scale in table.get(field, ())}
    return replace(scales, **{name: STRONGER * getattr(scales, name) for name in sorted(names)})


def _nearer(scales: FitScales) -> dict[str, float]:
    """Count on less room where there is little: what is far enough no longer pushes."""
    return {
        "safe_distance": max(NEARER * scales.safe_distance, LEAST_SAFE_DISTANCE),
        "softness": NEARER * scales.softness,
    }


LEAST_DAMPING = 1.0
"""Smallest Levenberg damping of a control point."""

MOST_DAMPING = 1.0e6
"""Largest one."""


ObjectiveMaker = Callable[[BodyModel, Proximity | None, FitTargets, SampledBasis], MotionObjective]
"""Makes the objective of a fit."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """The fitted spline and how well it meets its targets at the samples.

    Attributes:
        spline: The motion.
        iterations: Gauss-Newton steps taken.
        support_error: Largest position error of a controlled effector [m].
        com_error: Largest centre-of-mass error [m].
        clearance: Smallest counted distance [m] (infinite when nothing is near).
        closest: Names of the pair with that distance.
        cost: Final value of the objective.
    """

    spline: ConfigurationSpline
    iterations: int
    support_error: float
    com_error: float
    clearance: float
    closest: tuple[str, str]
    cost: float


class MotionFit:
    """Damped Gauss-Newton fit of a whole-body spline.

    Args:
        body: The body.
        proximity: Distances of the body to the scene and to itself, or None to ignore them.
        targets: What to do.
        knots: Clamped knots of the spline [s].
        degree: Its degree.
        scales: Residual scales and limits of the iteration.
        objective: Makes the objective from the first three and the spline's basis at the targets' times.
    """

    def __init__(
        self,
        body: BodyModel,
        proximity: Proximity | None,
        targets: FitTargets,
        knots: FloatArray,
        degree: int = 5,
        scales: MotionScales | None = None,
        objective: ObjectiveMaker = MotionObjective,
    ) -> None:
        self._knots, self._degree = knots, degree
        self._final = scales or FitScales()
        self._time = targets.time
        self._basis = SampledBasis.at(targets.time, knots, degree)
        self._system = BlockBandedSystem(self._basis, body.nq)
        self.objective = objective(body, proximity, targets, self._basis)
        self._damping = np.ones(self._basis.size)
        self._multiplier = np.zeros((len(targets.time), self.objective.task_rows))
        self._unit = self._final.position

    def initial_spline(self, configurations: FloatArray) -> ConfigurationSpline:
        """Least-squares spline through configurations (n, nq) at the targets' times."""
        return spline_through(configurations, self._basis, self._knots, self._degree)

    def rescale(self, scales: MotionScales) -> None:
        """Keep the forces of the multipliers at other scales, which loosen or tighten all tasks alike."""
        self._multiplier = scales.position / self._unit * self._multiplier
        self._unit = scales.position

    def solve(self, start: ConfigurationSpline) -> FitResult:
        """Solve from ``start``: first with loose tasks, so that the posture stays natural, then exactly.

        The last scales stay soft; the method of multipliers makes contacts and centre of mass
        exact without the stiff valleys of a large penalty.
        """
        return self._solve(start, self._final, self._final.stages)

    def improve(self, start: ConfigurationSpline, scales: MotionScales) -> FitResult:
        """Go on from an earlier solution ``start`` with other scales, at its multipliers."""
        return self._solve(start, scales, scales.stages[-1:])

    def _solve(self, start: ConfigurationSpline, final: MotionScales, stages: tuple[float, ...]) -> FitResult:
        points, iterations = np.array(start.control_points), 0
        scales = final.loosened(stages[0])
        state = self.objective.linearise(points, scales, self._multiplier)
        for number, factor in enumerate(stages):
            if number > 0:
                scales = final.loosened(factor)
                state = self.objective.linearise(points, scales, self._multiplier)
            points, state, taken = self._descend(points, state, scales, scales.max_iterations)
            iterations += taken
        moved = True
        for _ in range(final.multiplier_rounds):
            if scales.are_met(state.support_error, state.support_turn, state.com_error):
                break
            if moved:  # At a point that no step has left, another push says nothing new.
                self._update_multipliers(state)
            before = state
            points, state, taken = self._descend(points, state, scales, scales.iterations_per_round)
            iterations, moved = iterations + taken, state is not before
        spline = ConfigurationSpline(self._knots, points, self._degree)
        return FitResult(
            spline, iterations, state.support_error, state.com_error, state.clearance, state.closest,
            state.cost,
        )  # fmt: skip

    def _update_multipliers(self, state: FitLinearisation) -> None:
        before = self._multiplier
        self._multiplier = before + self.objective.exact_rows * state.task_residual
        state.shift_tasks(before, self._multiplier)

    def _descend(
        self, points: FloatArray, current: FitLinearisation, scales: MotionScales, most: int
    ) -> tuple[FloatArray, FitLinearisation, int]:
        """Damped Gauss-Newton at fixed scales; the damping is kept from call to call.

        Each control point has its own damping: where the objective around it rises, as at a
        leg that is almost straight, it grows, and the rest of the motion is not held up.
        """
        taken = 0
        while taken < most:
            taken += 1
            current.assemble(self._system)
            step = self._system.solve(self._damping)
            # A step of more than a radian leaves the region where the model holds.
            trial_points = points + step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-12))
            trial = self.objective.linearise(trial_points, scales, self._multiplier)
            self._adapt_damping(current, trial)
            if trial.cost < current.cost:
                decrease = (current.cost - trial.cost) / current.cost
                points, current = trial_points, trial
                if decrease < scales.decrease:
                    break
        return points, current, taken

    def _adapt_damping(self, before: FitLinearisation, after: FitLinearisation) -> None:
        old, new = (self._basis.gather(state.sample_cost) for state in (before, after))
        if after.cost < before.cost:
            factor = np.where(new > 1.02 * old + 0.1, 8.0, np.where(new < old, 0.4, 1.0))
        else:
            factor = np.where(new > old, 8.0, 1.0)
        self._damping = np.clip(self._damping * factor, LEAST_DAMPING, MOST_DAMPING)


def spline_through(
    configurations: FloatArray, basis: SampledBasis, knots: FloatArray, degree: int
) -> ConfigurationSpline:
    """Least-squares spline through configurations.

    Args:
        configurations: (n, nq) at the samples of the basis.
        basis: Of the knots at n times.
        knots: Clamped knots [s].
        degree: Of the spline.
    """
    system = BlockBandedSystem(basis, 1)
    n = len(configurations)
    points = []
    for column in configurations.T:
        system.reset()
        system.add(np.ones((n, 1, 1)), -column[:, None])
        system.add(np.full((n, 1, 1), 1e-4), np.zeros((n, 1)), order=1)
        points.append(system.solve(1e-9)[:, 0])
    return ConfigurationSpline(knots, np.stack(points, axis=1), degree)
