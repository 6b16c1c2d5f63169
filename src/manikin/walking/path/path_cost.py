"""The cost of a walking path with exact slopes and curvatures, and its minimum where nothing constrains it.

The unknowns are the inner control points of one spline through x, y and heading over normalised time, and
the duration T. At a Gauss point the integrand of (5.6) depends on ten numbers: x, y, heading, their first and
second derivatives by the share of the duration, and T; three more for a jerk. These are linear in the
unknowns, so one small compiled function for all Gauss points and two products of matrices give the Hessian,
and Newton's method finds the nearest optimum in some milliseconds. This transcription is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.numerics.spline import basis_matrix, clamped_knots
from manikin.walking.path.walking_model import FURTHER_TERMS, POWER_BLUR, SPEED_BLUR

DEGREE = 4
"""Degree of the spline: continuous rates of the accelerations."""

_CONVERGED = 1e-10
"""Decrease of the cost that Newton's method still expects, as a share of it; one more step is taken."""

_ITERATIONS = 80


@lru_cache
def path_knots(pieces: int) -> FloatArray:
    """(n,) knots of a path of evenly long pieces over [0, 1]."""
    return frozen_array(clamped_knots(DEGREE, np.linspace(0.0, 1.0, pieces + 1)), "knots")


def gauss_points(pieces: int) -> tuple[FloatArray, FloatArray]:
    """(n,) shares of the duration, three in each piece, and (n,) their weights, whose sum is 1."""
    roots, weights = np.polynomial.legendre.leggauss(3)
    shares = ((np.arange(pieces)[:, None] + (roots + 1.0) / 2.0) / pieces).ravel()
    return shares, np.tile(weights / 2.0 / pieces, pieces)


def term_rates(
    place: Sequence[Any], rate: Sequence[Any], second: Sequence[Any], third: Sequence[Any] | None, goal: Any,
    fade: Any,
) -> list[Any]:  # fmt: skip
    """Integrands of the terms of (5.6), and with third derivatives those of all terms, as expressions.

    Args:
        place: x, y [m] and heading [rad].
        rate: Their first derivatives by time.
        second: Their second derivatives.
        third: Their third derivatives; None for the five terms of (5.6) alone.
        goal: x, y [m].
        fade: Distance at which the goal term has faded to one half [m].
    """
    cos, sin = ca.cos(place[2]), ca.sin(place[2])
    forward, left = cos * rate[0] + sin * rate[1], cos * rate[1] - sin * rate[0]
    along = cos * second[0] + sin * second[1] + rate[2] * left
    across = cos * second[1] - sin * second[0] - rate[2] * forward
    dx, dy = goal[0] - place[0], goal[1] - place[1]
    psi = ca.atan2(cos * dy - sin * dx, cos * dx + sin * dy)
    square = dx**2 + dy**2
    rates = [1.0 + 0.0 * square, along**2, across**2, second[2] ** 2, square / (square + fade**2) * psi**2]
    if third is None:
        return rates
    power, speed = rate[0] * second[0] + rate[1] * second[1], rate[0] ** 2 + rate[1] ** 2
    work, tangential = ca.sqrt(power**2 + POWER_BLUR**2) - POWER_BLUR, power**2 / (speed + SPEED_BLUR**2)
    return [*rates, speed, rate[2] ** 2, third[0] ** 2 + third[1] ** 2, work, tangential]


@dataclass(frozen=True, eq=False)
class PathEnds:
    """(3,) x, y [m], heading [rad] at both ends, the last one as it is reached, and their rates [1/s]."""

    start: FloatArray
    goal: FloatArray
    start_rate: FloatArray
    goal_rate: FloatArray


class PathCost:
    """The cost of free paths of a number of pieces, by :func:`path_cost` one for all.

    Unknowns are the (3 k + 1,) inner control points, x first, then y, then heading, and the duration [s].
    """

    def __init__(self, pieces: int, further: bool) -> None:
        """Lay out the Gauss points; ``further`` terms need third derivatives."""
        shares, self.parts = gauss_points(pieces)
        orders, knots = 4 if further else 3, path_knots(pieces)
        self.points, self.further, self.orders = pieces + DEGREE, further, orders
        self.end_step = 1.0 / (DEGREE * pieces)
        self.basis = np.stack([basis_matrix(DEGREE, knots, shares, order) for order in range(orders)], 1)
        # Each piece knows five control points of each axis only.
        first = np.repeat(np.arange(pieces), 3)[:, None]
        near = np.arange(DEGREE + 1)
        part = self.basis[
            np.arange(len(shares))[:, None, None], np.arange(orders)[:, None], first[:, None] + near
        ]
        self.local = np.einsum("goi,ab->goabi", part, np.eye(3)).reshape(pieces, 9 * orders, -1)
        columns = (np.arange(3)[:, None] * self.points + near).ravel() + np.arange(pieces)[:, None]
        self.columns = columns
        self.entries = 3 * self.points * columns[:, :, None] + columns[:, None, :]
        inner = np.arange(3)[:, None] * self.points + np.arange(2, self.points - 2)
        self.inner = inner.ravel()

    def minimum(
        self, unknowns: FloatArray, ends: PathEnds, goal_fade: float, weights: FloatArray
    ) -> tuple[FloatArray, float, int, bool]:
        """The optimum that Newton's method reaches: unknowns, cost, iterations, whether it converged.

        Where the Hessian is not positive definite or a step brings too little, its diagonal is raised
        (Levenberg and Marquardt), until the cost falls.
        """
        point = _Point(self, ends, np.concatenate([ends.goal[:2], [goal_fade], weights]))
        shift, value = 0.0, point.value(unknowns)
        for iteration in range(1, _ITERATIONS + 1):
            gradient, hessian = point.slopes(unknowns)
            scale = np.maximum(np.abs(np.diagonal(hessian)), 1e-9)
            for _ in range(40):
                step = _newton_step(gradient, hessian, shift * scale)
                if step is not None and unknowns[-1] + step[-1] > 0.2 * unknowns[-1]:
                    expected = -0.5 * float(gradient @ step)
                    if shift == 0.0 and expected <= _CONVERGED * value:
                        final = unknowns + step
                        return final, point.value(final), iteration, True
                    reached = point.value(unknowns + step)
                    if value - reached >= 0.1 * expected:
                        break
                shift = max(4.0 * shift, 1e-3)
            else:
                return unknowns, value, iteration, False
            unknowns, value = unknowns + step, reached
            shift = 0.1 * shift if shift > 1e-3 else 0.0
        return unknowns, value, _ITERATIONS, False

    def sensitivities(
        self, unknowns: FloatArray, ends: PathEnds, goal_fade: float, weights: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Hessian of the cost, and (unknowns, terms) slopes of the integrals of the terms without weights."""
        point = _Point(self, ends, np.concatenate([ends.goal[:2], [goal_fade], weights]))
        return point.slopes(unknowns)[1], point.term_slopes(unknowns)

    @cached_property
    def functions(self) -> tuple["_Mapped", "_Mapped", "_Mapped"]:
        """Of numbers at Gauss points and parameters: integrand; its gradient and Hessian; slopes of terms."""
        size, count = 3 * self.orders + 1, len(self.parts)
        q = ca.SX.sym("q", size)
        p = ca.SX.sym("p", 3 + 5 + (len(FURTHER_TERMS) if self.further else 0))
        derivatives = [
            [q[3 * order + axis] / q[-1] ** order for axis in range(3)] for order in range(self.orders)
        ]
        third = derivatives[3] if self.further else None
        rates = term_rates(derivatives[0], derivatives[1], derivatives[2], third, p[:2], p[2])
        value = q[-1] * ca.dot(p[3:], ca.vertcat(*rates))
        hessian, gradient = ca.hessian(value, q)
        slopes = [gradient, ca.vec(ca.densify(hessian))]
        terms = [ca.vec(ca.densify(ca.jacobian(q[-1] * ca.vertcat(*rates), q).T))]
        return tuple(
            _Mapped(ca.Function(name, [q, p], outputs), count)
            for name, outputs in (("value", [value]), ("slopes", slopes), ("terms", terms))
        )  # type: ignore[return-value]


@lru_cache(maxsize=8)
def path_cost(pieces: int, further: bool = False) -> PathCost:
    """The cost of free paths, shared by all tasks of the same number of pieces."""
    return PathCost(pieces, further)


class _Point:
    """The cost between two ends under one set of parameters."""

    def __init__(self, cost: PathCost, ends: PathEnds, parameters: FloatArray) -> None:
        self._cost, self._parameters = cost, parameters
        self._value, self._slopes, self._terms = cost.functions
        # Control points by a duration of zero, and how the two beside the ends move with it.
        self._points, self._moves = np.zeros((2, cost.points, 3))
        self._points[:2], self._points[-2:] = ends.start, ends.goal
        self._moves[1], self._moves[-2] = cost.end_step * ends.start_rate, -cost.end_step * ends.goal_rate

    def _numbers(self, unknowns: FloatArray) -> FloatArray:
        points = self._points + unknowns[-1] * self._moves
        points[2:-2] = unknowns[:-1].reshape(3, -1).T
        basis = self._cost.basis
        numbers = np.empty((len(basis), 3 * basis.shape[1] + 1))
        numbers[:, :-1] = (basis.reshape(-1, basis.shape[2]) @ points).reshape(len(basis), -1)
        numbers[:, -1] = unknowns[-1]
        return numbers

    def value(self, unknowns: FloatArray) -> float:
        """The cost."""
        return float(self._cost.parts @ self._value(self._numbers(unknowns), self._parameters)[0][:, 0])

    def slopes(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gradient and Hessian of the cost over the unknowns."""
        cost = self._cost
        gradient, hessian = self._slopes(self._numbers(unknowns), self._parameters)
        size, pieces = gradient.shape[1], len(cost.local)
        slope = self._slope(gradient)
        hessian = (hessian * cost.parts[:, None]).reshape(-1, size, size)
        local = cost.local.reshape(len(hessian), size - 1, -1)
        across = cost.local.transpose(0, 2, 1)
        both = across @ (hessian[:, :-1, :-1] @ local).reshape(cost.local.shape)
        count, inner, move = 3 * cost.points, cost.inner, self._moves.ravel(order="F")
        whole = _summed(cost.entries, both, count**2).reshape(count, count)
        mixed = _summed(cost.columns, across @ hessian[:, :-1, -1].reshape(pieces, -1, 1), count)
        turned = whole @ move
        total = np.empty((len(inner) + 1, len(inner) + 1))
        total[:-1, :-1] = whole[np.ix_(inner, inner)]
        total[-1, :-1] = total[:-1, -1] = (mixed + turned)[inner]
        total[-1, -1] = hessian[:, -1, -1].sum() + move @ (2.0 * mixed + turned)
        return slope, total

    def term_slopes(self, unknowns: FloatArray) -> FloatArray:
        """(unknowns, terms) slopes of the integrals of the terms without their weights."""
        (slopes,) = self._terms(self._numbers(unknowns), self._parameters)
        count = len(self._parameters) - 3
        parts = slopes.reshape(len(slopes), count, -1)
        return np.column_stack([self._slope(parts[:, term]) for term in range(count)])

    def _slope(self, gradient: FloatArray) -> FloatArray:
        """Slope over the unknowns of what has (n, k) slopes over the numbers at the Gauss points."""
        cost, parts = self._cost, gradient * self._cost.parts[:, None]
        local = cost.local.transpose(0, 2, 1) @ parts[:, :-1].reshape(len(cost.local), -1, 1)
        slope = _summed(cost.columns, local, 3 * cost.points)
        return np.append(slope[cost.inner], parts[:, -1].sum() + slope @ self._moves.ravel(order="F"))


class _Mapped:
    """A compiled function of one point, applied to many at once without copies: rows are points."""

    def __init__(self, function: ca.Function, count: int) -> None:
        mapped = function.map(count)
        buffer: Any
        buffer, self._evaluate = mapped.buffer()
        self._buffer = buffer
        self._inputs = [np.zeros((count, function.size1_in(i))) for i in range(2)]
        self._outputs = [np.zeros((count, function.size1_out(i))) for i in range(function.n_out())]
        for index, array in enumerate(self._inputs):
            buffer.set_arg(index, array.reshape(-1).data)
        for index, array in enumerate(self._outputs):
            buffer.set_res(index, array.reshape(-1).data)

    def __call__(self, numbers: FloatArray, parameters: FloatArray) -> list[FloatArray]:
        self._inputs[0][:], self._inputs[1][:] = numbers, parameters
        self._evaluate()
        return self._outputs


def _summed(places: NDArray[np.intp], values: FloatArray, count: int) -> FloatArray:
    """(count,) sums of the values that have the same place."""
    return np.bincount(places.ravel(), values.ravel(), count).astype(np.float64, copy=False)


def _newton_step(gradient: FloatArray, hessian: FloatArray, raised: FloatArray) -> FloatArray | None:
    """``-(hessian + diag(raised))^-1 gradient``, or None if that matrix is not positive definite."""
    lifted = hessian.copy()
    lifted[np.diag_indices(len(gradient))] += raised
    _, step, failed = dposv(lifted, -gradient)
    return None if failed else step
