r"""Paths that minimise the derivative of the curvature, from a start to goals.

What is minimised is the squared norm of the control of the clothoid system with :math:`u_1 = 1` and free
length,

.. math:: J = \int_0^L (u_1^2 + u_2^2) \, ds = \int_0^L (1 + \dot\kappa^2) \, ds .

The thesis ([Truong2010]_ 3.3) speaks of "the minimization of the curvature derivative" and of clothoid arcs
with :math:`u_2 = \pm c`. Without a price of the length there is no optimum: loops as large as one likes lead
to any goal, and scaling a loop by :math:`\lambda` divides :math:`\int \dot\kappa^2` by :math:`\lambda^3` and
:math:`\max |\dot\kappa|` by :math:`\lambda^2`. So there is no least :math:`c`, and where a path exists that
no small change improves, it spells IDI or DID only. The norm of the control is the criterion of the work that
the thesis summarises there [Arechavaleta 2008b]; with it an optimum exists and spells the six words. Its arcs
are no exact clothoids: as in the thesis, words are read off the local extrema of the curvature. Both controls
weigh the same in metres, a choice of a length scale. All turns of at most one whole turn to either side are
considered.

:func:`residuals` measures without the solver whether paths meet their goals and the necessary conditions of
optimality. For :math:`\int (1 + u_2^2)` Pontryagin's principle says :math:`u_2 = p_\kappa / 2`,
:math:`\dot p_\kappa = -p_\varphi`, :math:`\dot p_\varphi = p_x \sin\varphi - p_y \cos\varphi` with constant
:math:`p_x, p_y`, and a Hamiltonian that is zero since the length is free. So :math:`-2 \ddot u_2` must be a
combination of :math:`\sin\varphi` and :math:`\cos\varphi`.

Paths of the clothoid system ([Truong2010]_ 3.2)

.. math:: \dot x = \cos\varphi\, u_1,\quad \dot y = \sin\varphi\, u_1,\quad
   \dot\varphi = \kappa\, u_1,\quad \dot\kappa = u_2, \qquad u_1 = 1

spell words: where :math:`u_2` is positive the curvature increases (I), where it is negative it decreases (D);
between them, at an extremum of the curvature, is a switching point. The sequence of the arcs is the word.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.walking.path.walking_model import START, runge_kutta
from manikin.walking.words.word_program import DEGREE, Goals, Minima, basis, minimise, quadrature

STRAIGHT = "straight"
"""The word of a path without curvature."""

THESIS_WORDS = ("IDI", "DID", "IDID", "DIDI", "IDIDI", "DIDID")
"""The six words of the thesis ([Truong2010]_ 3.3)."""

_FLAT = 1e-7
"""Largest derivative of the curvature of a straight path [1/m^2]."""

_SAMPLES = (1.0 - np.cos(np.linspace(0.0, np.pi, 2001))) / 2.0
"""Shares of the length where the sign of the curvature's derivative is sampled, denser at the ends."""


@dataclass(frozen=True, eq=False)
class WordPath:
    """A path of the clothoid system from rest of the curvature to rest of the curvature.

    Attributes:
        start: (3,) x, y [m], heading [rad]; the curvature is 0 there.
        goal: (3,) the same at the end; the heading with the whole turns that the path makes.
        shape: (degree,) coefficients of the heading, see :mod:`manikin.walking.words.word_program` [rad].
        length: Of the path [m].
        cost: Integral of 1 + u2^2 along it [m], with u2 in 1/m^2.
    """

    start: FloatArray
    goal: FloatArray
    shape: FloatArray
    length: float
    cost: float

    @property
    def turn(self) -> float:
        """Final less initial heading [rad]."""
        return float(self.goal[2] - self.start[2])

    @cached_property
    def word(self) -> str:
        """Its arcs in order: I where the curvature increases, D where it decreases."""
        return words_of(self.shape[None], np.array([self.length]))[0]

    @cached_property
    def switches(self) -> FloatArray:
        """(k,) distances of the switching points from the start along the path [m]."""
        if self.word == STRAIGHT:
            return np.empty(0)
        rising = self.curvature_rate(_SAMPLES) > 0.0
        changes = np.flatnonzero(rising[1:] != rising[:-1])

        def rate(share: float) -> float:
            return float(self.curvature_rate(np.array([share]))[0])

        return self.length * np.array([brentq(rate, *_SAMPLES[i : i + 2], xtol=1e-14) for i in changes])

    def curvature_rate(self, share: FloatArray) -> FloatArray:
        """(n,) u2, derivative of the curvature along the path [1/m^2], at shares of the length."""
        return basis(share, 0, len(self.shape)) @ self.shape / self.length**2

    def curvature(self, share: FloatArray) -> FloatArray:
        """(n,) curvature [1/m], positive to the left, at shares of the length."""
        return basis(share, 1, len(self.shape)) @ self.shape / self.length

    def states(self) -> FloatArray:
        """(n, 4) x, y [m], heading [rad] and curvature [1/m] at even steps along the path."""
        panels, degree = 400, len(self.shape)
        share = np.linspace(0.0, 1.0, panels + 1)
        nodes, weights = np.polynomial.legendre.leggauss(6)
        inner = (share[:-1, None] + share[1:, None] + nodes / panels) / 2.0
        heading = self.start[2] + (basis(inner.ravel(), 2, degree) @ self.shape).reshape(inner.shape)
        steps = self.length / (2.0 * panels) * np.stack([np.cos(heading), np.sin(heading)], -1)
        way = np.cumsum(np.einsum("ijk,j->ik", steps, weights), axis=0)
        place = self.start[:2] + np.vstack([np.zeros((1, 2)), way])
        headings = self.start[2] + basis(share, 2, degree) @ self.shape
        return np.column_stack([place, headings, self.curvature(share)])


def words_of(shapes: FloatArray, lengths: FloatArray) -> list[str]:
    """Words of (k, degree) shapes of paths of (k,) lengths [m]."""
    rates = shapes @ basis(_SAMPLES, 0, shapes.shape[1]).T / lengths[:, None] ** 2
    return [
        STRAIGHT
        if float(np.abs(row).max()) < _FLAT
        else "".join("I" if rising else "D" for rising, _ in itertools.groupby((row > 0.0).tolist()))
        for row in rates
    ]


_STEPS = 3000


@dataclass(frozen=True, eq=False)
class WordResiduals:
    """Largest violations of each of k paths.

    Attributes:
        position: (k,) distance from the goal of the system (3.2) integrated densely under u2 [m]; the same of
            ``heading`` [rad] and ``curvature`` [1/m], 0 at the goal.
        adjoint: (k,) largest difference of u2 and the adjoint's p_kappa / 2, as a share of the largest u2 (at
            least 0.01 / m^2) [-].
        hamiltonian: (k,) largest Hamiltonian; the cost's rate is at least 1 [-].
    """

    position: FloatArray
    heading: FloatArray
    curvature: FloatArray
    adjoint: FloatArray
    hamiltonian: FloatArray


def residuals(start: FloatArray, goals: FloatArray, shapes: FloatArray, lengths: FloatArray) -> WordResiduals:
    """Integrate (3.2) by Runge and Kutta's rule and fit the adjoint to paths as of :class:`WordPath`.

    Start (3,), goals (k, 3) with whole turns, shapes (k, degree) and lengths (k,) [m].
    """
    share = np.linspace(0.0, 1.0, 2 * _STEPS + 1)
    rates = shapes @ basis(share, 0, shapes.shape[1]).T / lengths[:, None] ** 2
    state = np.tile(np.append(start, 0.0), (len(lengths), 1))
    states = runge_kutta(_derivative, state, rates.T, (lengths / _STEPS)[:, None])
    missed = np.abs(states[-1, :, :3] - goals)
    position, curvature = np.hypot(missed[:, 0], missed[:, 1]), np.abs(states[-1, :, 3])
    return WordResiduals(position, missed[:, 2], curvature, *_adjoint(states, rates[:, ::2], lengths))


def _derivative(state: FloatArray, control: FloatArray) -> FloatArray:
    """(k, 4) rates of (k, 4) states of the system (3.2) under (k,) u2."""
    return np.stack([np.cos(state[:, 2]), np.sin(state[:, 2]), state[:, 3], control], axis=1)


def _adjoint(states: FloatArray, rates: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Largest misfit of u2, and largest Hamiltonian, for the adjoint that fits both best.

    With p_x and p_y constant, p_phi = p_phi(0) + p_x (y - y_0) - p_y (x - x_0); it is integrated once more.
    """
    misfit, largest = np.empty(len(lengths)), np.empty(len(lengths))
    for k, length in enumerate(lengths):
        x, y, heading, curvature = states[:, k].T
        x, y, way, rate = x - x[0], y - y[0], np.linspace(0.0, length, len(x)), rates[k]
        # Columns: p_kappa(0), p_phi(0), p_x, p_y; integrals from the start by a rule of fourth order.
        x_primitive, y_primitive = (CubicSpline(way, line).antiderivative()(way) for line in (x, y))
        p_curvature = np.column_stack([np.ones_like(way), -way, -y_primitive, x_primitive])
        on_x, on_y = np.cos(heading) + y * curvature, np.sin(heading) - x * curvature
        moving = np.column_stack([np.zeros_like(way), curvature, on_x, on_y])
        hamiltonian = moving + rate[:, None] * p_curvature
        rows, wanted = np.vstack([p_curvature / 2.0, hamiltonian]), np.concatenate([rate, 1.0 + rate**2])
        missing = rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0] - wanted
        misfit[k] = np.max(np.abs(missing[: len(way)])) / max(0.01, np.abs(rate).max())
        largest[k] = np.max(np.abs(missing[len(way) :]))
    return misfit, largest


NEAREST, FARTHEST = 0.5, 15.0
"""Distances of goals that can be asked [m]; farther away the polynomials do not resolve the ends of paths."""

_CHEAPER = 1e-9
"""Share of the cost by which another path must be cheaper to be taken instead."""


def word_paths(goals: ArrayLike, start: ArrayLike = START) -> list[WordPath]:
    """Best paths to goals, each the cheapest local minimum that any guess led to; InputError if none did.

    Args:
        goals: (k, 3) x, y [m], heading [rad] modulo whole turns; 0.5 to 15 m from the start.
        start: (3,) the same; that of the thesis looks along y.
    """
    begin = frozen_array(start, "start of a word [m, m, rad]", (3,))
    ends = frozen_array(goals, "goals of words [m, m, rad]", (None, 3))
    distance = np.hypot(*(ends - begin)[:, :2].T)
    for number in np.flatnonzero((distance < NEAREST) | (distance > FARTHEST)):
        wrong = f"is {distance[number]:g} m from the start"
        raise InputError(f"goal {number} of words {wrong}; valid: {NEAREST:g} to {FARTHEST:g} m")
    turned, best = cheapest(begin, ends, guesses())
    for number in np.flatnonzero(~best.found):
        wrong = f"{ends[number].tolist()}: no path was found"
        raise InputError(f"goal {number} of words, {wrong}; valid: another goal")
    rows = zip(turned, best.shapes, best.length.tolist(), best.cost.tolist(), strict=True)
    return [WordPath(begin, *row) for row in rows]


def word_path(goal: ArrayLike, start: ArrayLike = START) -> WordPath:
    """Best path to one goal (3,), see :func:`word_paths`."""
    return word_paths([frozen_array(goal, "goal of a word [m, m, rad]", (3,))], start)[0]


def guesses() -> list[tuple[float, ...]]:
    """Largest headings of the second and third polynomial of every guess [rad]: turns aside and back."""
    return list(itertools.product((-2.0, -1.0, 0.0, 1.0, 2.0), (-1.2, 0.0, 1.2)))


def cheapest(
    start: FloatArray, goals: FloatArray, amplitudes: Sequence[Sequence[float]]
) -> tuple[FloatArray, Minima]:
    """(k, 3) goals with the turns of their paths, and for each the cheapest minimum of any guess and turn.

    A guess has the largest headings of the free polynomials, in order [rad].
    """
    turned, shapes = goals.copy(), np.zeros((len(goals), DEGREE))
    cost, length = np.full(len(goals), np.inf), np.full(len(goals), np.nan)
    for some, ends in _turns(start, goals):
        asked = Goals.of(start, ends)
        for guess in amplitudes:
            shape, free = np.zeros(DEGREE), slice(1, 1 + len(guess))
            shape[free] = np.asarray(guess) / np.abs(quadrature()[0]).max(axis=0)[free]
            minima = minimise(asked, np.tile(shape, (len(ends), 1)))
            better = minima.cost < cost[some] - _CHEAPER * minima.length
            chosen = some[better]
            turned[chosen], shapes[chosen] = ends[better], minima.shapes[better]
            cost[chosen], length[chosen] = minima.cost[better], minima.length[better]
    return turned, Minima(shapes, cost, length)


def _turns(start: FloatArray, goals: FloatArray) -> Iterator[tuple[NDArray[np.intp], FloatArray]]:
    """Indices of goals, and the goals whose headings differ by at most a whole turn from the start's."""
    turn = np.mod(goals[:, 2] - start[2], 2.0 * np.pi)
    for whole in (0, -1, 1):
        some = np.flatnonzero(np.abs(turn + 2.0 * np.pi * whole) <= 2.0 * np.pi + 1e-9)
        if some.size:
            ends = goals[some].copy()
            ends[:, 2] = start[2] + turn[some] + 2.0 * np.pi * whole
            yield some, ends
