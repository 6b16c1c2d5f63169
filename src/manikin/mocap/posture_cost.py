"""What a posture costs that should have points at their targets, at many instants at once."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.mocap.point_equations import PointEquations
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

REST = 1e-3
"""Distance [m] that weighs as much as one radian away from the resting posture."""

STEADY = 3e-3
"""Distance [m] that weighs as much as one radian away from the posture before."""

HOLD = REST**2 + STEADY**2


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Of n postures.

    Attributes:
        q: (n, nq) the postures.
        held: (n, h) angles that the hinges are drawn to [rad].
        columns: (nv, 6, n), see :class:`manikin.mocap.segment_placements.Placements`.
        points: (k, 3, n) from the root [m].
        error: (k, 3, n) of the points from their targets [m]; 0 where one is not seen.
        weights: (k, n); 0 where one is not seen.
        cost: (n,) [m^2].
    """

    q: FloatArray
    held: FloatArray
    columns: FloatArray
    points: FloatArray
    error: FloatArray
    weights: FloatArray
    cost: FloatArray

    def only(self, chosen: NDArray[np.bool_]) -> "Evaluation":
        """That of some of the postures, chosen by (n,)."""
        if chosen.all():
            return self
        each = (self.columns, self.points, self.error, self.weights, self.cost)
        return Evaluation(self.q[chosen], self.held[chosen], *(values[..., chosen] for values in each))


class PostureCost:
    """Weighted squares of distances and of angles, with their normal equations.

    The cost is the weighted sum of squared distances of points from their targets plus
    ``(REST * (angle - rest))^2 + (STEADY * (angle - before))^2`` of every hinge, which settles what the
    points leave open without leaps from one instant to the next. The resting posture is the standing one.

    Attributes:
        slots: (d,) numbers of the velocities that move a point: the root's and those of some hinges.
    """

    def __init__(self, body: BodyModel, targets: Targets) -> None:
        """Prepare a body and the points of its segments."""
        self._body = body
        self._points = PointEquations(body, targets)
        self._rest = body.standing_posture()[7:]
        told = self._points.told
        self._untold = np.setdiff1d(np.arange(len(self._rest)), told)
        self.slots = np.concatenate([np.arange(6), 6 + told])
        self._angles = 7 + told
        self._lower, self._upper = body.lower[told], body.upper[told]

    def drawn_to(self, before: FloatArray) -> FloatArray:
        """(n, h) angles of least cost without points, after (n, nq) postures [rad]."""
        return (REST**2 * self._rest + STEADY**2 * before[:, 7:]) / HOLD

    def settled(self, q: FloatArray, held: FloatArray) -> FloatArray:
        """(n, nq) postures of which the hinges that move no point are as drawn to."""
        found = np.array(q)
        found[:, 7 + self._untold] = held[:, self._untold]
        return found

    def later(self, before: FloatArray, instants: int) -> FloatArray:
        """(nq,) a posture whose hinges are drawn to rest for some instants, without points."""
        found = np.array(before)
        found[7:] = self._rest + (STEADY**2 / HOLD) ** instants * (before[7:] - self._rest)
        return found

    def distances(self, q: FloatArray, wanted: FloatArray) -> FloatArray:
        """(n, k) distances of the points from their targets (n, k, 3) [m], NaN where one is not seen."""
        points = self._points.placed(q)[1].transpose(2, 0, 1)
        return np.linalg.norm(q[:, None, :3] + points - wanted, axis=2)

    def at(self, q: FloatArray, held: FloatArray, wanted: FloatArray) -> Evaluation:
        """The cost of (n, nq) postures.

        Args:
            q: The postures.
            held: (n, h), see :meth:`drawn_to`.
            wanted: (n, k, 3) targets [m]; NaN where one is not seen.
        """
        placed, points = self._points.placed(q)
        error = points + (placed.roots - wanted.transpose(1, 2, 0))
        weights = self._points.weights[:, None] * ~np.isnan(error[:, 0])
        error[np.isnan(error)] = 0.0
        away = q[:, 7:] - held
        cost = np.einsum("kn,kin,kin->n", weights, error, error) + HOLD * np.einsum("nh,nh->n", away, away)
        return Evaluation(q, held, placed.columns, points, error, weights, cost)

    def equations(self, here: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Half the gradient (n, d) by :attr:`slots`, and the lower Gauss-Newton matrix (n, d, d)."""
        gradient, matrix = self._points.assembled(here.columns, here.points, here.error, here.weights)
        gradient[:, 6:] += HOLD * (here.q[:, self._angles] - here.held[:, self._angles - 7])
        hinges = np.arange(6, len(self.slots))
        matrix[:, hinges, hinges] += HOLD
        return gradient, matrix

    def room(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest steps (n, d) that leave the hinges of (n, nq) postures in their ranges."""
        lower = np.full((len(q), len(self.slots)), -np.inf)
        upper = np.full((len(q), len(self.slots)), np.inf)
        angles = q[:, self._angles]
        lower[:, 6:], upper[:, 6:] = self._lower - angles, self._upper - angles
        return lower, upper

    def moved(self, q: FloatArray, steps: FloatArray) -> FloatArray:
        """Postures after steps (n, d), hinges within their ranges; no step turns by more than 1 rad."""
        largest = np.abs(steps[:, 3:]).max(axis=1)
        velocities = np.zeros((len(q), self._body.nv))
        velocities[:, self.slots] = steps / np.maximum(largest, 1.0)[:, None]
        model = self._body.pinocchio
        found = np.array([pin.integrate(model, *pair) for pair in zip(q, velocities, strict=True)])
        found[:, 7:] = np.clip(found[:, 7:], self._body.lower, self._body.upper)
        return found
