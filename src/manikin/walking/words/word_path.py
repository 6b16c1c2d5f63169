r"""Paths of the clothoid system ([Truong2010]_ 3.2) and the words that they spell.

.. math:: \dot x = \cos\varphi\, u_1,\quad \dot y = \sin\varphi\, u_1,\quad
   \dot\varphi = \kappa\, u_1,\quad \dot\kappa = u_2, \qquad u_1 = 1

where :math:`u_2` is positive the curvature increases (I), where it is negative it decreases (D); between
them, at an extremum of the curvature, is a switching point. The sequence of the arcs is the word of a path.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from manikin.numerics.spatial import FloatArray
from manikin.walking.words.word_program import basis

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
        return np.column_stack(
            [place, self.start[2] + basis(share, 2, degree) @ self.shape, self.curvature(share)]
        )


def words_of(shapes: FloatArray, lengths: FloatArray) -> list[str]:
    """Words of (k, degree) shapes of paths of (k,) lengths [m]."""
    rates = shapes @ basis(_SAMPLES, 0, shapes.shape[1]).T / lengths[:, None] ** 2
    return [
        STRAIGHT
        if float(np.abs(row).max()) < _FLAT
        else "".join("I" if rising else "D" for rising, _ in itertools.groupby((row > 0.0).tolist()))
        for row in rates
    ]
