"""Fit one smooth whole-body spline to contacts, swings and a centre-of-mass path.

All samples of the motion are solved together by damped Gauss-Newton over the control points of
a clamped quintic spline.  Unlike a posture-by-posture solution ([Qiu2012]_ 6.2) the result is
smooth by construction, and the rate of its centroidal momentum follows what the point-mass
plan assumes, so that the whole body keeps the balance that was planned for its centre of mass.
"""

from dataclasses import dataclass

import numpy as np

from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.fit_objective import FitLinearisation, MotionObjective
from manikin.planning.whole_body.fit_scales import MotionScales

DEGREE = 5
"""Degree of every whole-body spline: four continuous derivatives."""

LEAST_DAMPING = 1.0
"""Smallest Levenberg damping of a control point."""

MOST_DAMPING = 1.0e6
"""Largest one."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A fitted spline.

    Attributes:
        iterations: Gauss-Newton steps taken.
    """

    spline: ConfigurationSpline
    iterations: int


class MotionFit:
    """Damped Gauss-Newton fit of a whole-body spline.

    Args:
        knots: Clamped knots of the spline [s].
    """

    def __init__(self, objective: MotionObjective, knots: FloatArray, scales: MotionScales) -> None:
        self._objective, self._knots, self._final = objective, knots, scales
        self._basis = objective.basis
        self._system = BlockBandedSystem(self._basis, objective.targets.reference.shape[1])
        self._damping = np.ones(self._basis.size)
        self._multiplier = np.zeros((len(objective.targets.time), objective.task_rows))
        self._unit = scales.position

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
        state = self._objective.linearise(points, scales, self._multiplier)
        for number, factor in enumerate(stages):
            if number > 0:
                scales = final.loosened(factor)
                state = self._objective.linearise(points, scales, self._multiplier)
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
        return FitResult(ConfigurationSpline(self._knots, points, DEGREE), iterations)

    def _update_multipliers(self, state: FitLinearisation) -> None:
        before = self._multiplier
        self._multiplier = before + self._objective.exact_rows * state.task_residual
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
            trial = self._objective.linearise(trial_points, scales, self._multiplier)
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


def spline_through(configurations: FloatArray, basis: SampledBasis, knots: FloatArray) -> ConfigurationSpline:
    """Least-squares spline with clamped knots [s] through configurations (n, nq) at the basis's samples."""
    system = BlockBandedSystem(basis, 1)
    n = len(configurations)
    points = []
    for column in configurations.T:
        system.reset()
        system.add(np.ones((n, 1, 1)), -column[:, None])
        system.add(np.full((n, 1, 1), 1e-4), np.zeros((n, 1)), order=1)
        points.append(system.solve(1e-9)[:, 0])
    return ConfigurationSpline(knots, np.stack(points, axis=1), DEGREE)
