"""Fit one smooth whole-body spline to contacts, swings and a centre-of-mass path.

All samples of the motion are solved together by damped Gauss-Newton over the control points of a clamped
quintic spline.  Unlike a posture-by-posture solution ([Qiu2012]_ 6.2) the result is smooth by construction,
and the rate of its centroidal momentum follows what the point-mass plan assumes, so that the whole body keeps
the balance that was planned for its centre of mass.

Contacts and a required centre of mass are constraints. Penalties show the way to them; then every step is
the best one that meets their linearisation, and a last one restores what its curvature left.
"""

from typing import NamedTuple

import numpy as np

from manikin.motion.configuration_spline import ConfigurationSpline, align_quaternions
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.fit_objective import FitLinearisation, MotionObjective
from manikin.planning.whole_body.fit_scales import MotionScales

DEGREE = 5
"""Degree of every whole-body spline: four continuous derivatives."""

LEAST_DAMPING, FIRST_DAMPING, RESTORING_DAMPING, MOST_DAMPING = 1.0, 30.0, 100.0, 1.0e5
"""Levenberg damping of a control point: the smallest one, that with which a fit begins, the largest one of a
step that only restores the contacts, and the largest one."""

MORE, LESS = 5.0, 0.3
"""Factors of the damping where a step makes the objective greater and less."""

HELD, AT_REST = 1.0e15, 3
"""Damping of control points that stay, and their number at an end at rest in a given posture: velocity and
acceleration are zero there."""

FURTHER_DECREASE, SPARED, EASED = 3.0e-4, 0.1, 0.01
"""Relative decrease of the objective below which constrained steps stop where the strength is exceeded, a
small part of the objective; share of the strength beyond the wanted one from which it counts as that; and the
part of this excess that a step has to take away."""

SHARINGS, FALLING, BEYOND = 3, 0.7, 2.0
"""How often the contact forces are shared at most for the strength, the share of the excess before that is
left at most where they are shared once more, and the excess of a motion that goes wrong in another way."""

STIFFNESS = 1.0e4
"""Factor on the squares of the constraints in the matrix with which a step and its multipliers are found."""

LENGTHS, VAIN = (1.0, 0.3), 4
"""Shares of a constrained step that are tried, until one makes the objective less, and constrained steps in a
row that hardly make anything better, after which no more are tried."""


class FitResult(NamedTuple):
    """A fitted spline, and how many Gauss-Newton steps were taken."""

    spline: ConfigurationSpline
    iterations: int


class MotionFit:
    """Damped Gauss-Newton fit of a whole-body spline.

    Args:
        knots: Clamped knots of the spline [s].
    """

    def __init__(self, objective: MotionObjective, knots: FloatArray) -> None:
        self._objective, self._knots = objective, knots
        self._basis = objective.basis
        self._system = BlockBandedSystem(self._basis, objective.targets.reference.shape[1])
        self._damping = np.full(self._basis.size, FIRST_DAMPING)
        first, last = (AT_REST * (posture is not None) for posture in objective.targets.ends)
        self._held = np.zeros(self._basis.size, dtype=np.bool_)
        self._held[:first], self._held[self._basis.size - last :] = True, True
        self._multiplier = np.zeros((len(objective.targets.time), objective.task_rows))

    def solve(self, start: ConfigurationSpline, final: MotionScales, *, further: bool = False) -> FitResult:
        """Solve from ``start``: first with loose tasks, so that the posture stays natural, then exactly.

        Args:
            final: Scales of the last stage.
            further: Go on from an earlier solution at its multipliers, with that stage alone. Penalties come
                first only where no step that meets the contacts is better: they would lead off them.
        """
        points, iterations = self._with_ends(np.array(start.control_points)), 0
        scales = final.loosened(final.stages[-1])
        if further:
            self._objective.share_forces(points)
            moved, state, iterations = self._constrain(points, scales)
            if moved is not points:
                return self._exact(moved, state, scales, iterations)
        for factor in final.stages[-1:] if further else final.stages:
            scales = final.loosened(factor)
            state = self._objective.linearise(points, scales, self._multiplier)
            points, state, taken = self._descend(points, state, scales)
            iterations += taken
        points, state, constrained = self._constrain(points, scales)
        return self._exact(points, state, scales, iterations + constrained)

    def clearance_beside(self, spline: ConfigurationSpline, time: float) -> float:
        """Least distance at the samples on both sides of an instant [m], see :meth:`.MotionObjective`."""
        return self._objective.clearance_beside(spline.control_points, time)

    def _constrain(
        self, points: FloatArray, scales: MotionScales
    ) -> tuple[FloatArray, FitLinearisation, int]:
        """Steps that meet contacts and centre of mass, and then the strength where it is exceeded.

        Contact forces are shared when the contacts are met: those of a motion that is far off say nothing.
        They are shared anew after that, since forces that are held make torques seem too small.
        """
        state, last = self._objective.linearise(points, scales, self._multiplier), np.inf
        points, state, taken = self._constrained(points, state, scales)
        for _ in range(SHARINGS):
            self._objective.share_forces(points)
            state = self._objective.linearise(points, scales, self._multiplier)
            excess = state.excess or 0.0
            if not SPARED <= excess < min(FALLING * last, BEYOND):
                break
            points, state, more = self._constrained(points, state, scales)
            taken, last = taken + more, excess
        return points, state, taken

    def _exact(
        self, points: FloatArray, state: FitLinearisation, scales: MotionScales, iterations: int
    ) -> FitResult:
        """The result after a number of iterations, contacts and centre of mass restored."""
        points, restored = self._restore(points, state, scales)
        return FitResult(ConfigurationSpline(self._knots, points, DEGREE), iterations + restored)

    def _with_ends(self, points: FloatArray) -> FloatArray:
        """Control points (k, nq) with those of given ends in place."""
        ends = slice(AT_REST), slice(-AT_REST, None)
        for rows, posture in zip(ends, self._objective.targets.ends, strict=True):
            if posture is not None:
                points[rows] = align_quaternions(np.array([points[rows][0], posture]))[1]
        return points

    def _damped(self, most: float = np.inf) -> FloatArray:
        """Damping of each control point, at most so large where it may move."""
        return np.where(self._held, HELD, np.minimum(self._damping, most))

    def _constrained(
        self, points: FloatArray, current: FitLinearisation, scales: MotionScales
    ) -> tuple[FloatArray, FitLinearisation, int]:
        """Steps that meet contacts and centre of mass: each is the best that meets their linearisation.

        The multipliers that hold them come with the step, so that the augmented objective falls along it
        and what is left of their errors is of second order in the step. The whole step sets the damping, also
        where only a part of it is taken: where it made the objective greater, the next one is shorter.
        They stop after one that hardly makes it less, or after :data:`VAIN` in a row where only parts of
        steps help or the strength is exceeded, and hardly less from step to step.
        """
        taken = vain = 0
        while taken < scales.constrained_steps and vain < VAIN:
            taken += 1
            current.assemble(self._system)
            before, (held, missed) = self._multiplier, self._constraints(current)
            self._stiffen(held, missed)
            factor = self._system.factorised(self._damped())
            step, after = factor.constrained(
                self._system.right, held, missed, before, scales.multiplier_rounds
            )
            step = self._within_reach(step)
            current.shift_tasks(before, after)
            for length in LENGTHS:
                trial_points = points + length * step
                trial = self._objective.linearise(trial_points, scales, after)
                if length == 1.0:
                    self._adapt_damping(current, trial)
                if trial.cost < current.cost:
                    break
            if trial.cost >= current.cost:
                current.shift_tasks(after, before)
                vain += 1
                continue
            # The squared multipliers in the augmented objective say nothing of the motion.
            decrease = (current.cost - trial.cost) / (current.cost - 0.5 * float(np.sum(after**2)))
            strong = trial.excess is not None and trial.excess >= SPARED
            eased = strong and is_eased(current.excess, trial.excess)
            slight = decrease < (FURTHER_DECREASE if eased else scales.constrained_decrease)
            points, current, self._multiplier = trial_points, trial, after
            vain = vain + 1 if slight else 0
            if slight and not strong and length == 1.0:
                break
        return points, current, taken

    def _restore(
        self, points: FloatArray, current: FitLinearisation, scales: MotionScales
    ) -> tuple[FloatArray, int]:
        """The nearest motion that meets contacts and centre of mass: their errors fall quadratically."""
        taken = 0
        while taken < scales.restoring_steps and self._missed(current) > scales.tolerance:
            taken += 1
            current.assemble(self._system)
            # A step this small needs little damping, which would keep it from the constraints.
            factor = self._system.factorised(self._damped(RESTORING_DAMPING))
            step = factor.smallest(*self._constraints(current), scales.multiplier_rounds)
            trial_points = points + self._within_reach(step)
            trial = self._objective.linearise(trial_points, scales, self._multiplier)
            if self._missed(trial) >= self._missed(current):
                break
            points, current = trial_points, trial
        return points, taken

    def _stiffen(self, held: FloatArray, missed: FloatArray) -> None:
        """Add squares of the constraints: no step that meets them changes, and fewer rounds find it."""
        transposed = STIFFNESS * held.transpose(0, 2, 1)
        self._system.add(transposed @ held, (transposed @ missed[:, :, None])[:, :, 0])

    def _missed(self, state: FitLinearisation) -> float:
        return float(np.abs(self._objective.exact_rows * state.task_residual).max(initial=0.0))

    def _constraints(self, state: FitLinearisation) -> tuple[FloatArray, FloatArray]:
        """Derivatives (n, m, nq) and residuals (n, m) of the tasks, zero for those that are only wished."""
        held = self._objective.exact_rows
        return held[:, :, None] * state.task_jacobian, held * state.task_residual

    def _descend(
        self, points: FloatArray, current: FitLinearisation, scales: MotionScales
    ) -> tuple[FloatArray, FitLinearisation, int]:
        """Damped Gauss-Newton at fixed scales; the damping is kept from call to call.

        Each control point has its own damping: where the objective around it rises, as at a
        leg that is almost straight, it grows, and the rest of the motion is not held up.
        """
        taken = 0
        while taken < scales.max_iterations:
            taken += 1
            current.assemble(self._system)
            trial_points = points + self._within_reach(self._system.solve(self._damped()))
            trial = self._objective.linearise(trial_points, scales, self._multiplier)
            self._adapt_damping(current, trial)
            if trial.cost < current.cost:
                decrease = (current.cost - trial.cost) / current.cost
                points, current = trial_points, trial
                if decrease < scales.decrease:
                    break
        return points, current, taken

    def _within_reach(self, step: FloatArray) -> FloatArray:
        """The step, shortened to a radian: a longer one leaves the region where the model holds."""
        step = np.where(self._held[:, None], 0.0, step)
        return step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-12))

    def _adapt_damping(self, before: FitLinearisation, after: FitLinearisation) -> None:
        old, new = (self._basis.gather(state.sample_cost) for state in (before, after))
        if after.cost < before.cost:
            factor = np.where(new > 1.02 * old + 0.1, MORE, np.where(new < old, LESS, 1.0))
        else:
            factor = np.where(new > old, MORE, 1.0)
        self._damping = np.clip(self._damping * factor, LEAST_DAMPING, MOST_DAMPING)


def is_eased(before: float | None, after: float | None) -> bool:
    """Whether a step takes away a part of the excess of strength that is worth it."""
    return before is not None and after is not None and after < (1.0 - EASED) * before


def spline_through(configurations: FloatArray, basis: SampledBasis, knots: FloatArray) -> ConfigurationSpline:
    """Least-squares spline with clamped knots [s] through configurations (n, nq) at the basis's samples."""
    system, n, points = BlockBandedSystem(basis, 1), len(configurations), []
    for column in configurations.T:
        system.reset()
        system.add(np.ones((n, 1, 1)), -column[:, None])
        system.add(np.full((n, 1, 1), 1e-4), np.zeros((n, 1)), order=1)
        points.append(system.solve(1e-9)[:, 0])
    return ConfigurationSpline(knots, np.stack(points, axis=1), DEGREE)
