"""Clamped B-splines of any degree with exact derivatives ([Qiu2012]_ 2.4).

Knots are ``t_0 <= ... <= t_m``, control points ``a_0 ... a_n`` and ``m = n + k + 1`` for the degree ``k``
(the thesis says "order"). Knot spans are half-open, ``[t_j, t_j+1)``, and the last one is closed. Arguments
``degree`` are k, ``knots`` (m + 1,) clamped, ``t`` (s,) parameters inside the domain.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline as ScipySpline

from manikin.errors import SplineError
from manikin.numerics.spatial import FloatArray, frozen_array

_DOMAIN_TOLERANCE = 1e-9
"""Share of the domain by which a parameter may lie outside it (rounding of sums of durations)."""


@dataclass(frozen=True, eq=False)
class BSpline:
    """A clamped B-spline curve ``p(t) = sum_i N_i,k(t) a_i`` ([Qiu2012]_ 2.28).

    Attributes:
        degree: Degree k >= 0.
        knots: (m + 1,) nondecreasing, the first and the last repeated k + 1 times ([Qiu2012]_ 2.31).
        control_points: (n + 1, d) de Boor points, n = m - k - 1.
    """

    degree: int
    knots: FloatArray
    control_points: FloatArray

    def __init__(self, degree: int, knots: ArrayLike, control_points: ArrayLike) -> None:
        points = frozen_array(control_points, "spline control points", (None, None), SplineError)
        object.__setattr__(self, "degree", degree)
        object.__setattr__(self, "knots", check_clamped(degree, knots, len(points)))
        object.__setattr__(self, "control_points", points)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter value."""
        return float(self.knots[0]), float(self.knots[-1])

    @property
    def breakpoints(self) -> FloatArray:
        """Distinct knots, in order."""
        return np.unique(self.knots)

    def __call__(self, t: ArrayLike, derivative: int = 0) -> FloatArray:
        """(..., d) values of the curve or of a derivative at (...) parameters ([Qiu2012]_ 2.28, 2.34).

        Beyond the degree the derivative is zero.

        Raises:
            SplineError: If a value lies outside the domain.
        """
        t = _inside(self.knots, t)
        if derivative > self.degree:
            return np.zeros((*t.shape, self.control_points.shape[1]))
        return self.derivative(derivative)._engine(t)

    def derivative(self, order: int = 1) -> "BSpline":
        """Return the derivative curve of degree k - order ([Qiu2012]_ 2.32-2.34).

        Raises:
            SplineError: If ``order`` is negative or larger than the degree.
        """
        if order == 0:
            return self
        if order not in self._derivatives:
            matrix = derivative_matrix(self.degree, self.knots, order)
            inner = self.knots[order : len(self.knots) - order]
            self._derivatives[order] = BSpline(self.degree - order, inner, matrix @ self.control_points)
        return self._derivatives[order]

    def bezier_points(self) -> FloatArray:
        """(spans, k + 1, d) Bezier points of each polynomial piece between breakpoints.

        A piece is ``sum_j C(k, j) s^j (1 - s)^(k - j) b_j`` with s in [0, 1] across its span.
        """
        s = np.linspace(0.0, 1.0, self.degree + 1)
        times = self.breakpoints[:-1, None] + np.diff(self.breakpoints)[:, None] * s
        return np.asarray(np.linalg.solve(bernstein_matrix(self.degree, s), self(times)), dtype=np.float64)

    @classmethod
    def fit(
        cls, degree: int, knots: ArrayLike, t: ArrayLike, values: ArrayLike, *,
        first: ArrayLike | None = None, last: ArrayLike | None = None,
    ) -> "BSpline":  # fmt: skip
        """Least-squares fit with some of the first and last control points given.

        Args:
            degree: Degree k.
            knots: Clamped knots.
            t: (s,) parameter values.
            values: (s, d) wanted positions.
            first: (i, d) control points a_0 ... a_i-1 to keep, see :func:`start_control_points`.
            last: (j, d) control points a_n-j+1 ... a_n to keep, see :func:`end_control_points`.

        Raises:
            SplineError: If knots or parameter values are not usable.
        """
        design = basis_matrix(degree, knots, t)
        wanted = frozen_array(values, "spline fit values", (len(design), None), SplineError)
        count, dimension = design.shape[1], wanted.shape[1]
        head = np.zeros((0, dimension)) if first is None else np.atleast_2d(np.asarray(first, float))
        tail = np.zeros((0, dimension)) if last is None else np.atleast_2d(np.asarray(last, float))
        middle = slice(len(head), count - len(tail))
        points = np.concatenate([head, np.zeros((max(count - len(head) - len(tail), 0), dimension)), tail])
        points[middle] = np.linalg.lstsq(design[:, middle], wanted - design @ points, rcond=None)[0]
        return cls(degree, knots, points)

    @cached_property
    def _engine(self) -> ScipySpline:
        return ScipySpline(self.knots, self.control_points, self.degree, extrapolate=False)

    @cached_property
    def _derivatives(self) -> "dict[int, BSpline]":
        return {}


def check_clamped(degree: int, knots: ArrayLike, control_points: int) -> FloatArray:
    """Return the knots as a read-only array after checking them ([Qiu2012]_ 2.27, 2.29, 2.31).

    Raises:
        SplineError: If degree, number or order of knots do not make a clamped B-spline.
    """
    if isinstance(degree, bool) or not isinstance(degree, (int, np.integer)) or degree < 0:
        raise SplineError(f"spline degree is {degree!r}; valid: an integer >= 0")
    times = frozen_array(knots, "spline knots", (None,), SplineError)
    needed = control_points + degree + 1
    if control_points <= degree:
        raise SplineError(f"spline has {control_points} control points; valid: more than its degree {degree}")
    if len(times) != needed:
        sum_of = f"control points {control_points} + degree + 1"
        raise SplineError(f"spline has {len(times)} knots; valid: {needed} ({sum_of})")
    inner = times[degree + 1 : len(times) - degree - 1]
    clamped = times[degree] == times[0] and times[-1 - degree] == times[-1]
    wanted = None
    if np.any(np.diff(times) < 0):
        wanted = "nondecreasing"
    elif not clamped or times[0] == times[-1] or np.any((inner == times[0]) | (inner == times[-1])):
        wanted = f"first and last knot repeated {degree + 1} times"
    elif degree > 0 and np.any(inner[degree:] == inner[:-degree]):
        wanted = f"inner knots repeated at most {degree} times"
    if wanted:
        raise SplineError(f"spline knots are {times.tolist()}; valid: {wanted}")
    return times


def clamped_knots(degree: int, breakpoints: ArrayLike) -> FloatArray:
    """(b + 2 k,) knots that pass once through each inner breakpoint ([Qiu2012]_ 2.31 and 5.4.3).

    The b increasing breakpoints make b - 1 spans, hence b + k - 1 control points.

    Raises:
        SplineError: If the breakpoints do not increase.
    """
    times = frozen_array(breakpoints, "spline breakpoints", (None,), SplineError)
    if len(times) < 2 or np.any(np.diff(times) <= 0):
        raise SplineError(f"spline breakpoints are {times.tolist()}; valid: at least two, increasing")
    return np.concatenate([np.full(degree, times[0]), times, np.full(degree, times[-1])])


def basis_matrix(degree: int, knots: ArrayLike, t: ArrayLike, derivative: int = 0) -> FloatArray:
    """(s, n + 1) matrix A with ``p^(d)(t_j) = A[j] @ control_points`` ([Qiu2012]_ 2.52, 2.55).

    The control points are those of the spline itself for a derivative d, too.

    Raises:
        SplineError: If the knots are not clamped or a value lies outside the domain.
    """
    times = check_clamped(degree, knots, np.size(knots) - degree - 1)
    inside = np.atleast_1d(_inside(times, t))
    if derivative > degree:
        return np.zeros((len(inside), len(times) - degree - 1))
    inner = times[derivative : len(times) - derivative]
    design = ScipySpline.design_matrix(inside, inner, degree - derivative).toarray()
    return design if derivative == 0 else design @ derivative_matrix(degree, times, derivative)


def derivative_matrix(degree: int, knots: ArrayLike, order: int) -> FloatArray:
    """(n + 1 - d, n + 1) ``T_d0`` from control points to those of a derivative ([Qiu2012]_ 2.32, 2.44).

    Raises:
        SplineError: If the knots are not clamped or the order is out of range.
    """
    times = check_clamped(degree, knots, np.size(knots) - degree - 1)
    if not 0 <= order <= degree:
        raise SplineError(f"spline derivative order is {order}; valid: 0 to the degree {degree}")
    count = len(times) - degree - 1
    matrix = np.eye(count)
    for d in range(1, order + 1):
        index = np.arange(count - d)
        width = times[index + degree + 1] - times[index + d]
        scale = np.divide(degree - d + 1, width, out=np.zeros_like(width), where=width > 0)
        matrix = scale[:, None] * np.diff(matrix, axis=0)
    return matrix


def start_control_points(
    degree: int, knots: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
) -> FloatArray:  # fmt: skip
    """(1 to 3, d) first control points that give the wanted start ([Qiu2012]_ 2.45-2.47).

    Position and derivatives are (d,); None leaves one free. An acceleration needs a degree of 2 or more.

    Raises:
        SplineError: If an acceleration is given without a velocity.
    """
    t, k, points = np.asarray(knots, dtype=np.float64), degree, [np.asarray(position, dtype=np.float64)]
    if acceleration is not None and velocity is None:
        problem = "spline end acceleration is given without a velocity"
        raise SplineError(f"{problem}; valid: both or only a velocity")
    if velocity is not None:
        speed = np.asarray(velocity, dtype=np.float64)
        points.append(points[0] + (t[k + 1] - t[0]) / k * speed)
        if acceleration is not None:
            next_speed = speed + (t[k + 1] - t[0]) / (k - 1) * np.asarray(acceleration, dtype=np.float64)
            points.append(points[1] + (t[k + 2] - t[0]) / k * next_speed)
    return np.array(points)


def end_control_points(
    degree: int, knots: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
) -> FloatArray:  # fmt: skip
    """Last control points that give the wanted end ([Qiu2012]_ 2.48-2.50).

    Equation 2.49 is read with ``t_n+k - t_n`` in place of the printed ``t_n+k-1 - t_n-1``.
    Arguments and result as :func:`start_control_points`, the last row being a_n.

    Raises:
        SplineError: If an acceleration is given without a velocity.
    """
    backwards = -np.asarray(knots, dtype=np.float64)[::-1]
    reversed_speed = None if velocity is None else -np.asarray(velocity, dtype=np.float64)
    return start_control_points(degree, backwards, position, reversed_speed, acceleration)[::-1]


def bernstein_matrix(degree: int, s: ArrayLike) -> FloatArray:
    """(n, k + 1) Bernstein polynomials ``C(k, j) s^j (1 - s)^(k - j)`` at (n,) parameters in [0, 1].

    They are the B-spline basis of a single span ([Qiu2012]_ 2.30).
    """
    return basis_matrix(degree, clamped_knots(degree, (0.0, 1.0)), s)


def _inside(knots: FloatArray, t: ArrayLike) -> FloatArray:
    times, first, last = np.asarray(t, dtype=np.float64), knots[0], knots[-1]
    slack = _DOMAIN_TOLERANCE * (last - first)
    if not np.all((times >= first - slack) & (times <= last + slack)):
        raise SplineError(f"spline parameter outside [{first:g}, {last:g}]; valid: values of the domain")
    return np.clip(times, first, last)
