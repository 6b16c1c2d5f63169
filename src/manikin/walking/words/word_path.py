r"""Paths of the clothoid system ([Truong2010]_ 3.2) and the words that they spell.

.. math:: \dot x = \cos\varphi\, u_1,\quad \dot y = \sin\varphi\, u_1,\quad
   \dot\varphi = \kappa\, u_1,\quad \dot\kappa = u_2, \qquad u_1 = 1

where :math:`u_2` is positive the curvature increases (I), where it is negative it decreases (D); between
them, at an extremum of the curvature, is a switching point. The sequence of the arcs is the word of a path.

Also here. Words of three clothoid arcs, and whether a smaller derivative of the curvature would do nearby.

If only :math:`c = \max |u_2|` counts, Pontryagin's principle says :math:`u_2 = c \, \mathrm{sign}(p_\kappa)`:
arcs of clothoids, as the thesis describes them ([Truong2010]_ 3.3-3.4). With no curvature at both ends, words
of three arcs, IDI and DID, have one parameter beside their size: if the first two half arcs turn by :math:`A`
and the last two by :math:`B`, the turn in all is :math:`\pm (A - B)`. So all of them are found by looking at
the direction in which they end.

A global optimum does not exist, since loops can be scaled up. Where a word satisfies the maximum principle,
no small change improves it to first order; to many goals that face back to the start no such word leads.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, root_scalar

from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.walking.path.walking_model import START
from manikin.walking.words.word_program import basis

_MOST = 4.0 * np.pi
"""Largest parameter beside the turn that is looked at [rad]: twice a full loop at each end."""

_LARGEST_LOOKED_AT = 4000
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True, eq=False)
class ClothoidWord:
    """Three clothoid arcs from the start to a goal.

    Attributes:
        word: IDI or DID.
        rate: c, the derivative of the curvature but for its sign [1/m^2].
        lengths: (3,) of the arcs [m].
        turn: Final less initial heading [rad].
        extremal: Whether it satisfies the maximum principle.
    """

    word: str
    rate: float
    lengths: FloatArray
    turn: float
    extremal: bool

    def states(self, start: ArrayLike = START, count: int = 201) -> FloatArray:
        """(3 count - 2, 4) x, y [m], heading [rad], curvature [1/m] along the arcs from a start."""
        place = frozen_array(start, "start of a word [m, m, rad]", (3,))
        state, rows = np.append(place, 0.0), [np.append(place, 0.0)[None]]
        for length, rate in zip(self.lengths, self.rate * _signs(self.word), strict=True):
            arc = _arc(state, np.linspace(0.0, float(length), count)[1:], float(rate))
            rows.append(arc)
            state = arc[-1]
        return np.vstack(rows)


def clothoid_words(goal: ArrayLike, start: ArrayLike = START) -> list[ClothoidWord]:
    """All IDI and DID with turns of at most one whole turn that lead to a goal, the smallest rate first.

    Args:
        goal: (3,) x, y [m], heading [rad] modulo whole turns.
        start: (3,) the same.

    Raises:
        InputError: If they are not three finite numbers.
    """
    begin = frozen_array(start, "start of a word [m, m, rad]", (3,))
    end = frozen_array(goal, "goal of a word [m, m, rad]", (3,))
    turn = float(np.mod(end[2] - begin[2], 2.0 * np.pi))
    turns = [turn - 2.0 * np.pi, turn] + ([] if turn else [2.0 * np.pi])
    found = [
        one
        for word in ("IDI", "DID")
        for each in turns
        for one in _words(word, each, end[:2] - begin[:2], begin[2])
    ]
    return sorted(found, key=lambda one: one.rate)


def _words(word: str, turn: float, way: FloatArray, heading: float) -> Iterator[ClothoidWord]:
    """Those of one word and turn, by the roots of the direction in which shapes of rate 1 end."""
    sign = _signs(word)[0]
    least = max(0.0, sign * turn)
    aim = np.arctan2(way[1], way[0]) - heading

    def end(parameter: FloatArray) -> FloatArray:
        return _ends(sign, np.sqrt(parameter), np.sqrt(np.maximum(parameter - sign * turn, 0.0)))

    def missed(parameter: FloatArray) -> FloatArray:
        place = end(parameter)
        return np.angle(np.exp(1j * (np.arctan2(place[:, 1], place[:, 0]) - aim)))

    looked_at = least + _MOST * np.linspace(1e-4, 1.0, _LARGEST_LOOKED_AT)
    angles = missed(looked_at)
    for i in np.flatnonzero((angles[1:] * angles[:-1] < 0.0) & (np.abs(angles[1:] - angles[:-1]) < 1.0)):
        bracket = (looked_at[i], looked_at[i + 1])
        root = float(
            root_scalar(lambda one: float(missed(np.array([one]))[0]), bracket=bracket, xtol=1e-14).root
        )
        scale = float(np.hypot(*way) / np.hypot(*end(np.array([root]))[0]))
        first, last = np.sqrt(root), np.sqrt(max(root - sign * turn, 0.0))
        lengths = scale * np.array([first, first + last, last])
        rate = 1.0 / scale**2
        yield ClothoidWord(word, rate, lengths, turn, _extremal(word, rate, lengths))


def _signs(word: str) -> FloatArray:
    return np.array([1.0 if letter == "I" else -1.0 for letter in word])


def _ends(sign: float, first: FloatArray, last: FloatArray) -> FloatArray:
    """(k, 2) where words of rate 1 end from the origin, which they leave along x."""
    share = (_NODES + 1.0) / 2.0
    place = np.zeros((len(first), 2))
    heading, curvature = np.zeros(len(first)), np.zeros(len(first))
    for length, rate in ((first, sign), (first + last, -sign), (last, sign)):
        s = length[:, None] * share
        angle = heading[:, None] + curvature[:, None] * s + rate * s**2 / 2.0
        steps = length[:, None] * _WEIGHTS / 2.0
        place += np.column_stack([(steps * np.cos(angle)).sum(axis=1), (steps * np.sin(angle)).sum(axis=1)])
        heading = heading + curvature * length + rate * length**2 / 2.0
        curvature = curvature + rate * length
    return place


def _arc(state: FloatArray, along: FloatArray, rate: float) -> FloatArray:
    """(n, 4) states at distances along one arc from a state."""
    x, y, heading, curvature = state.tolist()
    s = along[:, None] * (_NODES + 1.0) / 2.0
    angle = heading + curvature * s + rate * s**2 / 2.0
    steps = along[:, None] * _WEIGHTS / 2.0
    return np.column_stack(
        [
            x + (steps * np.cos(angle)).sum(axis=1), y + (steps * np.sin(angle)).sum(axis=1),
            heading + curvature * along + rate * along**2 / 2.0, curvature + rate * along,
        ]
    )  # fmt: skip


def _extremal(word: str, rate: float, lengths: FloatArray) -> bool:
    """Whether p_kappa of some adjoint vanishes at both switching points and has the sign of u2 elsewhere.

    Its four constants are fixed, but for a factor, by both zeros and by a Hamiltonian of zero.
    """
    one = ClothoidWord(word, rate, lengths, 0.0, False)
    count = 401
    states = one.states((0.0, 0.0, 0.0), count)
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    way = np.concatenate([[0.0], *(np.linspace(a, b, count)[1:] for a, b in itertools.pairwise(knots))])
    primitives = [
        np.concatenate([[0.0], np.cumsum(np.diff(way) * (v[1:] + v[:-1]) / 2.0)]) for v in states[:, :2].T
    ]
    columns = np.column_stack([np.ones_like(way), -way, -primitives[1], primitives[0]])
    switches = columns[[count - 1, 2 * (count - 1)]]
    moving = np.array([rate * _signs(word)[0], 0.0, 1.0, 0.0])
    constants = np.linalg.svd(np.vstack([switches, moving]))[2][-1]
    controls = np.repeat(_signs(word), count - 1)
    product = controls * (columns @ constants)[1:]
    tolerance = 1e-6 * float(np.abs(product).max())
    return bool(np.all(product > -tolerance) or np.all(product < tolerance))


STRAIGHT = "straight"
"""In place of a word, for a path without curvature."""

THESIS_WORDS = ("IDI", "DID", "IDID", "DIDI", "IDIDI", "DIDID")
"""The six words of the thesis ([Truong2010]_ 3.3)."""

_FLAT = 1e-7
"""Largest derivative of the curvature of a straight path [1/m^2]."""

_PANELS = 400
_LOOKED_AT = (1.0 - np.cos(np.linspace(0.0, np.pi, 2001))) / 2.0
"""Shares of the length where the sign of the curvature's derivative is looked at, denser at the ends."""


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
        signs = self.curvature_rate(_LOOKED_AT) > 0.0
        found = [
            brentq(lambda share: float(self.curvature_rate(np.array([share]))[0]), a, b, xtol=1e-14)
            for (a, b), (before, after) in zip(
                itertools.pairwise(_LOOKED_AT), itertools.pairwise(signs), strict=True
            )
            if before != after
        ]
        return self.length * np.array(found)

    def curvature_rate(self, share: FloatArray) -> FloatArray:
        """(n,) u2, derivative of the curvature along the path [1/m^2], at shares of the length."""
        return basis(share, 0, len(self.shape)) @ self.shape / self.length**2

    def curvature(self, share: FloatArray) -> FloatArray:
        """(n,) curvature [1/m], positive to the left, at shares of the length."""
        return basis(share, 1, len(self.shape)) @ self.shape / self.length

    def states(self) -> FloatArray:
        """(n, 4) x, y [m], heading [rad] and curvature [1/m] at even steps along the path."""
        share = np.linspace(0.0, 1.0, _PANELS + 1)
        nodes, weights = np.polynomial.legendre.leggauss(6)
        inner = (share[:-1, None] + share[1:, None] + nodes / _PANELS) / 2.0
        degree = len(self.shape)
        heading = self.start[2] + (basis(inner.ravel(), 2, degree) @ self.shape).reshape(inner.shape)
        steps = self.length / (2.0 * _PANELS) * np.stack([np.cos(heading), np.sin(heading)], -1)
        way = np.cumsum(np.einsum("ijk,j->ik", steps, weights), axis=0)
        place = self.start[:2] + np.vstack([np.zeros((1, 2)), way])
        return np.column_stack(
            [place, self.start[2] + basis(share, 2, degree) @ self.shape, self.curvature(share)]
        )


def words_of(shapes: FloatArray, lengths: FloatArray) -> list[str]:
    """Words of (k, degree) shapes of paths of (k,) lengths [m]."""
    rates = shapes @ basis(_LOOKED_AT, 0, shapes.shape[1]).T / lengths[:, None] ** 2
    return [_word(row) for row in rates]


def _word(rates: FloatArray) -> str:
    if float(np.abs(rates).max()) < _FLAT:
        return STRAIGHT
    rising: NDArray[np.bool_] = rates > 0.0
    first = np.concatenate([[True], rising[1:] != rising[:-1]])
    return "".join("I" if one else "D" for one in rising[first])
