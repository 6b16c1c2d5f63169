r"""The shortest and smoothest paths to many goals as one batch of small nonlinear programmes.

With the heading :math:`\varphi(\xi) = \varphi_0 + \sum_i b_i Q_i(\xi)` over the share :math:`\xi` of the
length, :math:`Q_i` being twice integrated Legendre polynomials, the end of the curvature and of the heading
is met by :math:`b_1 = -6\,\Delta`, :math:`\Delta` the turn. For a goal at the distance :math:`D` in the
direction :math:`\beta`, with :math:`p = \int \cos(\varphi - \beta)` and :math:`q = \int \sin(\varphi -
\beta)`, the length is :math:`D / p`, and what is left is

.. math:: \min_b \; J = D / p + (p / D)^3 \sum_i b_i^2 / (2 i + 1) \quad \text{subject to} \quad q = 0.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from manikin.numerics.spatial import FloatArray

DEGREE = 20
"""Highest degree of the derivative of the curvature; 32 changes no word of the grid, no cost by 1e-9 m."""


def basis(share: FloatArray, integrals: int, degree: int = DEGREE) -> FloatArray:
    """(n, degree) Legendre polynomials of degree 1, 2, ... on [0, 1], integrated from 0 so many times.

    They are taken at shares of the length (n,). Degree 0 is left out: the integrals of all others vanish at
    1, so that the curvature ends at zero.
    """
    return np.column_stack([_integrated(number, integrals)(share) for number in range(1, degree + 1)])


@cache
def _integrated(number: int, integrals: int) -> Legendre:
    return Legendre.basis(number, domain=[0.0, 1.0]).integ(integrals, lbnd=0.0)


@cache
def quadrature(degree: int = DEGREE) -> tuple[FloatArray, FloatArray]:
    """(m, degree) twice integrated polynomials at the nodes of Gauss' rule on [0, 1], and (m,) weights."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    return basis((nodes + 1.0) / 2.0, 2, degree), weights / 2.0


def squares(degree: int = DEGREE) -> FloatArray:
    """(degree,) integrals of the squared polynomials over [0, 1]."""
    return 1.0 / (2.0 * np.arange(1.0, degree + 1.0) + 1.0)


TOLERANCE = 1e-11
"""Error of the direction in which a path ends [rad], and of the cost's gradient, as a share of its scale."""

_LEAST = 0.02
"""Smallest p, the share of the way that leads to the goal."""


@dataclass(frozen=True, eq=False)
class Goals:
    """k goals in polar coordinates about the start, each with the turn that the path to it makes.

    Attributes:
        distance: (k,) from the start [m].
        direction: (k,) of the goal from the heading at the start [rad].
        turn: (k,) final less initial heading, with whole turns [rad].
    """

    distance: FloatArray
    direction: FloatArray
    turn: FloatArray

    @classmethod
    def of(cls, start: FloatArray, goals: FloatArray) -> "Goals":
        """Goals (k, 3) seen from a start (3,), both x, y [m] and heading with whole turns [rad]."""
        x, y = (goals[:, :2] - start[:2]).T
        return cls(np.hypot(x, y), np.arctan2(y, x) - start[2], goals[:, 2] - start[2])

    def __getitem__(self, index: object) -> "Goals":
        """Some of the goals, by numpy's indexing."""
        return Goals(self.distance[index], self.direction[index], self.turn[index])  # type: ignore[index]

    def __len__(self) -> int:
        return len(self.turn)


@dataclass(frozen=True, eq=False)
class Minima:
    """Local minima of a batch of k programmes.

    Attributes:
        shapes: (k, degree) coefficients b of the headings [rad].
        cost: (k,) J [m]; infinite where no minimum was reached.
        length: (k,) lengths of the paths [m].
    """

    shapes: FloatArray
    cost: FloatArray
    length: FloatArray

    @property
    def found(self) -> NDArray[np.bool_]:
        """(k,) whether a minimum was reached."""
        return np.isfinite(self.cost)


class _Values(NamedTuple):
    """Cost and constraint of a batch with their first derivatives, and whether p is large enough."""

    cost: FloatArray
    q: FloatArray
    gradient: FloatArray
    q_gradient: FloatArray
    valid: NDArray[np.bool_]


def minimise(goals: Goals, shapes: FloatArray) -> Minima:
    """Newton's method with damping on every programme of a batch; each depends on nothing but itself.

    A step is kept if it makes the cost, with an exact penalty on the direction missed, smaller; else it is
    damped more. A result counts only if the Hessian of the Lagrangian is positive definite along the
    constraint: so it is a strict local minimum. It begins at ``shapes`` (k, degree), whose first coefficient
    is set from the turns.
    """
    shapes = shapes.copy()
    shapes[:, 0] = -6.0 * goals.turn
    cost, length = np.full(len(goals), np.inf), np.full(len(goals), np.nan)
    damping, values = np.full(len(goals), 1e-2), _values(goals, shapes)
    active, values = np.flatnonzero(values.valid), _only(values, values.valid)
    for _ in range(120):
        if not len(active):
            break
        some, b = goals[active], shapes[active]
        step, multiplier, residual, hessian = _step(some, b, values, damping[active])
        done = (residual < TOLERANCE) & (np.abs(values.q) < TOLERANCE)
        if np.any(done):
            good = done.copy()
            good[done] = _definite(hessian[done], values.q_gradient[done])
            cost[active[good]] = values.cost[good]
            length[active[good]] = some[good].distance / _integrals(some[good], b[good])[0].sum(axis=1)
        tried = _values(some, b + step)
        penalty = 1.5 * np.abs(multiplier) + 1e-3
        merit, before = (v.cost + penalty * np.abs(v.q) for v in (tried, values))
        better = tried.valid & (merit <= before + 1e-13 * np.abs(before)) & np.all(np.isfinite(step), axis=1)
        shapes[active[better]] = (b + step)[better]
        pairs = zip(tried, values, strict=True)
        values = _Values(*(np.where(better if a.ndim == 1 else better[:, None], a, b) for a, b in pairs))
        damping[active] = np.where(better, damping[active] * 0.15, np.maximum(damping[active], 1e-4) * 8.0)
        damping[active] = np.where(damping[active] < 1e-6, 0.0, damping[active])
        going_on = ~done & (damping[active] < 1e8)
        active, values = active[going_on], _only(values, going_on)
    return Minima(shapes, cost, length)


def _integrals(goals: Goals, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k, m) weighted cosine and sine of the heading from the goal's direction."""
    turned, weights = quadrature(b.shape[1])
    angle = b @ turned.T - goals.direction[:, None]
    return np.cos(angle) * weights, np.sin(angle) * weights


def _values(goals: Goals, b: FloatArray) -> _Values:
    (cosine, sine), free = _integrals(goals, b), quadrature(b.shape[1])[0][:, 1:]
    true, weights = cosine.sum(axis=1), squares(b.shape[1])
    p, effort = np.maximum(true, _LEAST), (b**2) @ weights
    cubed = (p / goals.distance) ** 3
    cost = goals.distance / p + cubed * effort
    slope = -goals.distance / p**2 + 3.0 * cubed / p * effort
    gradient = slope[:, None] * (-sine @ free) + 2.0 * cubed[:, None] * weights[1:] * b[:, 1:]
    return _Values(cost, sine.sum(axis=1), gradient, cosine @ free, true > _LEAST)


def _step(
    goals: Goals, b: FloatArray, values: _Values, damping: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Step, multiplier of the constraint, remaining gradient and Hessian of the Lagrangian."""
    size, n = values.gradient.shape
    normal = values.q_gradient
    now = -np.einsum("ki,ki->k", values.gradient, normal) / np.einsum("ki,ki->k", normal, normal)
    hessian, diagonal = _hessian(goals, b, now)
    index, system = np.arange(n), np.zeros((size, n + 1, n + 1))
    system[:, :n, :n] = hessian
    system[:, index, index] += damping[:, None] * diagonal
    system[:, :n, n] = system[:, n, :n] = normal
    solved = _solved(system, np.concatenate([-values.gradient, -values.q[:, None]], axis=1))
    step = np.concatenate([np.zeros((size, 1)), solved[:, :n]], axis=1)
    # Coefficients of higher degrees bend less: compare gradients in the measure of the cost itself.
    rest = np.abs(values.gradient + now[:, None] * normal)
    residual: FloatArray = np.max(rest / np.sqrt(diagonal), axis=1) / np.sqrt(values.cost)
    return step, solved[:, n], residual, hessian


def _solved(system: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions of (k, n, n) systems; NaN, with which no step is taken, where one is singular."""
    try:
        return np.asarray(np.linalg.solve(system, right[..., None])[..., 0], np.float64)
    except np.linalg.LinAlgError:  # one of many: the others are solved by themselves
        if len(system) == 1:
            return np.full_like(right, np.nan)
        half = len(system) // 2
        return np.concatenate([_solved(system[:half], right[:half]), _solved(system[half:], right[half:])])


def _hessian(goals: Goals, b: FloatArray, multiplier: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k, n, n) Hessian of the Lagrangian by the free coefficients; (k, n) that of the cost at fixed p."""
    size, degree = b.shape
    cosine, sine = _integrals(goals, b)
    weights = squares(degree)
    p = np.maximum(cosine.sum(axis=1), _LEAST)
    p_gradient = -sine @ quadrature(degree)[0][:, 1:]
    cubed, effort = (p / goals.distance) ** 3, (b**2) @ weights
    slope = -goals.distance / p**2 + 3.0 * cubed / p * effort
    bend = 2.0 * goals.distance / p**3 + 6.0 * cubed / p**2 * effort
    mixed = (6.0 * cubed / p)[:, None] * weights[1:] * b[:, 1:]
    seen = slope[:, None] * cosine + multiplier[:, None] * sine
    hessian = -np.asarray(seen @ _products(degree), np.float64).reshape(size, degree - 1, degree - 1)
    hessian += bend[:, None, None] * p_gradient[:, :, None] * p_gradient[:, None, :]
    crossed = mixed[:, :, None] * p_gradient[:, None, :]
    hessian += crossed + crossed.transpose(0, 2, 1)
    diagonal = np.asarray(2.0 * cubed[:, None] * weights[1:], np.float64)
    index = np.arange(degree - 1)
    hessian[:, index, index] += diagonal
    return hessian, diagonal


@cache
def _products(degree: int) -> FloatArray:
    """(m, n n) products of the free polynomials at the nodes."""
    free = quadrature(degree)[0][:, 1:]
    return (free[:, :, None] * free[:, None, :]).reshape(len(free), -1)


def _definite(hessian: FloatArray, normal: FloatArray) -> NDArray[np.bool_]:
    """Whether (k, n, n) Hessians are positive definite across (k, n) normals."""
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", hessian).clip(1e-300))
    scaled, unit = hessian * scale[:, :, None] * scale[:, None, :], normal * scale
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    projector = np.eye(hessian.shape[1]) - unit[:, :, None] * unit[:, None, :]
    inside = projector @ scaled @ projector + unit[:, :, None] * unit[:, None, :]
    return np.linalg.eigvalsh(inside)[:, 0] > 1e-9


def _only(values: _Values, index: NDArray[np.bool_]) -> _Values:
    return _Values._make(part[index] for part in values)
