r"""Words of three clothoid arcs, and whether a smaller derivative of the curvature would do nearby.

If only :math:`c = \max |u_2|` counts in the clothoid system ([Truong2010]_ 3.2), Pontryagin's principle says
:math:`u_2 = c \, \mathrm{sign}(p_\kappa)`: arcs of clothoids, as the thesis describes them (3.3-3.4). With no
curvature at both ends, words of three arcs, IDI and DID, have one parameter beside their size: if the first
two half arcs turn by :math:`A` and the last two by :math:`B`, the turn in all is :math:`\pm (A - B)`. So all
of them are found by looking at the direction in which they end.

A global optimum does not exist, since loops can be scaled up. Where a word satisfies the maximum principle,
no small change improves it to first order; to many goals that face back to the start no such word leads.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import root_scalar

from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.walking import START

_MOST = 4.0 * np.pi
"""Largest parameter beside the turn that is looked at [rad]: twice a full loop at each end."""

_SAMPLES = 4000
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

    looked_at = least + _MOST * np.linspace(1e-4, 1.0, _SAMPLES)
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
