"""The quadratic programme of a CoM that stays near key frames and keeps its balance all the time.

A recorded position is not exact, so that the one CoM that passes all of them may be out of balance where a
person was not. Here the key frames pull instead, and balance is imposed every ten milliseconds: the
pseudo-wrench ``m [a - g; p x (a - g)]`` ([Qiu2012]_ 4.6), bilinear in position and acceleration, is
linearised about the last solution. Both our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import piqp
from scipy import sparse

from manikin.balance import WrenchPolytope
from manikin.centroidal.problem import Weights
from manikin.contact import ContactSchedule
from manikin.spatial import GRAVITY, FloatArray, skew
from manikin.spline import BSpline, basis_matrix, clamped_knots

DEGREE = 5
"""Degree of the spline ([Qiu2012]_ 5.3.3)."""

KNOT_SPACING = 0.05
"""Largest distance of the spline's knots: steps of a walk are supports of a tenth of a second [s]."""

BALANCE_STEP = 0.01
"""Largest distance of two instants at which balance is imposed [s]."""

FACETS = 16
"""Facets of a polytope that an instant is kept from: the nearest ones."""

PULL = 1e4
"""Cost of a mean squared distance from the key frames, against that of a speed of 1 m/s [1/m^2]."""

_NO_BOUND = 1e30


@dataclass(frozen=True, eq=False)
class NearProgramme:
    """Everything about the programme that does not depend on the last solution.

    Attributes:
        mass: [kg].
        polytopes: W_i of the phases about the world origin.
        knots: On [0, 1].
        smoothness: (n, n) matrix of the objective of one axis, without the pull.
        phases: (m,) phase of each instant at which balance is imposed; key instants count twice.
        position: (m, n) CoM there by control points.
        acceleration: (m, n) its acceleration.
    """

    mass: float
    polytopes: tuple[WrenchPolytope, ...]
    knots: FloatArray
    smoothness: FloatArray
    phases: np.ndarray
    position: FloatArray
    acceleration: FloatArray

    @classmethod
    def of(
        cls, mass: float, polytopes: Sequence[WrenchPolytope], schedule: ContactSchedule, weights: Weights
    ) -> "NearProgramme":
        """Lay out knots and instants.

        Args:
            mass: [kg].
            polytopes: W_i of the phases about the world origin.
            schedule: Stances with their instants, from 0 on.
            weights: Of velocity, acceleration and jerk; the first entry of each counts for all three axes.
        """
        duration = float(schedule.instants[-1])
        spans = max(1, round(duration / KNOT_SPACING))
        knots = clamped_knots(DEGREE, np.linspace(0.0, 1.0, spans + 1))
        times, phases = _instants(schedule)
        shares = np.minimum(times / duration, 1.0)
        return cls(
            mass, tuple(polytopes), knots, _smoothness(knots, duration, weights), phases,
            basis_matrix(DEGREE, knots, shares), basis_matrix(DEGREE, knots, shares, 2) / duration**2,
        )  # fmt: skip

    def spline(self, points: FloatArray) -> BSpline:
        """Spline over [0, 1] of (n, 3) control points."""
        return BSpline(DEGREE, self.knots, points)

    def free(self, shares: FloatArray, wanted: FloatArray) -> FloatArray:
        """(n, 3) control points without regard to balance.

        Args:
            shares: (f,) key frames on [0, 1].
            wanted: (f, 3) CoM there [m].
        """
        quadratic, linear = self._objective(shares, wanted)
        return np.asarray(np.linalg.solve(quadratic, -linear), dtype=np.float64)

    def solve(
        self, shares: FloatArray, wanted: FloatArray, margin: FloatArray, near: FloatArray
    ) -> tuple[FloatArray, int] | None:
        """Control points and iterations; None when the linearised programme has no solution.

        Args:
            shares: (f,) key frames on [0, 1].
            wanted: (f, 3) CoM there [m].
            margin: (phases,) to keep [N.m].
            near: (n, 3) control points about which the wrench is linearised.
        """
        quadratic, linear = self._objective(shares, wanted)
        rows, bounds = self._balance(margin, near)
        solver = piqp.SparseSolver()
        solver.settings.verbose = False
        cost = sparse.csc_matrix(np.kron(2.0 * quadratic, np.eye(3)))
        solver.setup(
            cost, 2.0 * linear.ravel(), None, None, rows, np.full(len(bounds), -_NO_BOUND), bounds
        )  # fmt: skip
        if solver.solve() != piqp.PIQP_SOLVED:
            return None
        return solver.result.x.reshape(-1, 3), int(solver.result.info.iter)

    def _objective(self, shares: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, n) and (n, 3): the objective is ``C' Q C + 2 l' C`` of each axis."""
        basis = basis_matrix(DEGREE, self.knots, shares)
        pull = PULL / len(shares) * basis.T
        return self.smoothness + pull @ basis, -pull @ wanted

    def _balance(self, margin: FloatArray, near: FloatArray) -> tuple[Any, FloatArray]:
        """Rows and bounds of unit length; ``p x b`` is ``p0 x b + p x b0 - p0 x b0`` with ``b = a - g``."""
        blocks, bounds = [], []
        gravity = np.array([0.0, 0.0, -GRAVITY])
        for row, phase in enumerate(self.phases):
            polytope = self.polytopes[phase]
            force, moment = self.mass * polytope.H[:, :3], self.mass * polytope.H[:, 3:]
            p, b = self.position[row] @ near, self.acceleration[row] @ near - gravity
            by_acceleration, by_position = force + moment @ skew(p), -moment @ skew(b)
            bound = polytope.h - margin[phase] + by_acceleration @ gravity + moment @ np.cross(p, b)
            room = bound - by_acceleration @ (b + gravity) - by_position @ p
            chosen = np.argsort(room, kind="stable")[:FACETS]
            block = (
                self.acceleration[row][:, None] * by_acceleration[chosen, None]
                + self.position[row][:, None] * by_position[chosen, None]
            ).reshape(len(chosen), -1)
            length = np.linalg.norm(block, axis=1)
            blocks.append(sparse.csr_matrix(block / length[:, None]))
            bounds.append(bound[chosen] / length)
        return sparse.vstack(blocks).tocsc(), np.concatenate(bounds)


def _instants(schedule: ContactSchedule) -> tuple[FloatArray, np.ndarray]:
    times, phases = [], []
    for index, (start, end) in enumerate(zip(schedule.instants[:-1], schedule.instants[1:], strict=True)):
        count = int(np.ceil((end - start) / BALANCE_STEP)) + 1
        times.append(np.linspace(start, end, count))
        phases.append(np.full(count, index))
    return np.concatenate(times), np.concatenate(phases)


def _smoothness(knots: FloatArray, duration: float, weights: Weights) -> FloatArray:
    """(n, n) mean over time of the weighted squared derivatives, exact for the polynomials."""
    nodes, shares = np.polynomial.legendre.leggauss(DEGREE)
    breaks = np.unique(knots)
    half = 0.5 * np.diff(breaks)[:, None]
    times, share = (breaks[:-1, None] + half * (1.0 + nodes)).ravel(), (half * shares).ravel()
    total = np.zeros((len(knots) - DEGREE - 1,) * 2)
    for order, diagonal in enumerate((weights.velocity, weights.acceleration, weights.jerk), start=1):
        basis = basis_matrix(DEGREE, knots, times, order) / duration**order
        total += diagonal[0] * basis.T @ (share[:, None] * basis)
    return total
