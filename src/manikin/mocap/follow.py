"""Postures of a body that follow targets from one instant to the next."""

import numpy as np
from scipy.interpolate import CubicSpline

from manikin.body import BodyModel
from manikin.mocap.inverse_kinematics import search
from manikin.mocap.posture_cost import PostureCost
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

POOR = 0.05
"""A frame with a point farther away than this [m] is searched from its own start, too."""

APART = 1.0 / 15.0
"""Time between the frames that are searched one by one [s]; those between begin on a curve through them."""

TOGETHER = 128
"""Most frames that are found at once."""

ROUGH = 1e-2
"""A step of a guess that lowers the cost by a smaller share is the last one."""


def follow(
    body: BodyModel, targets: Targets, starts: FloatArray, rate: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Postures that follow targets, each near the one before.

    Frame by frame, the search begins with the posture of the frame before. Of a dense recording some frames
    are searched so; those between begin on a curve through them and are found together.

    Args:
        body: The body that carries the targets' points.
        targets: Of n instants.
        starts: (n, nq) postures within the limits; the first is where the search begins, the others
            are tried where the search from the frame before leaves a point farther than :data:`POOR`.
        rate: Frames per second [Hz]; None for frames that are far from each other.

    Returns:
        (n, nq) postures and (n, k) distances of the points from their targets [m], NaN where not seen.
    """
    following = _Following(body, targets, starts, 1 if rate is None else max(round(APART * rate), 1))
    return following.q, following.residual


def improved(body: BodyModel, targets: Targets, q: FloatArray) -> FloatArray:
    """Postures (n, nq) closest to targets, searched from given ones and drawn to the given one before."""
    before = np.concatenate([q[:1], q[:-1]])
    return search(PostureCost(body, targets), q, targets.positions, before)[0]


class _Following:
    def __init__(self, body: BodyModel, targets: Targets, starts: FloatArray, apart: int) -> None:
        self._body, self._wanted, self._starts, self._apart = body, targets.positions, starts, apart
        self._cost = PostureCost(body, targets)
        self._heavy = targets.weights >= 1.0
        n = len(targets)
        self.q, self.residual = np.empty((n, body.nq)), np.empty((n, len(targets.names)))
        self._singly(0, 1)
        frame = 1
        while frame < n:
            if apart == 1 or n - frame < apart:
                frame = self._singly(frame, n)
            else:
                frame = self._together(frame, min(frame + TOGETHER // apart * apart, n))

    # --- frame by frame

    def _singly(self, first: int, stop: int) -> int:
        """Search frames one by one; the first one after them."""
        for frame in range(first, min(stop, len(self.q))):
            before = self.q[frame - 1] if frame else self._starts[0]
            q, cost = search(self._cost, before[None], self._wanted[frame : frame + 1], before[None])
            self._keep(frame, q)
            if frame:
                self._better_start(frame, cost)
        return min(stop, len(self.q))

    def _better_start(self, first: int, costs: FloatArray) -> int | None:
        """The first of the poor frames whose own start leads to a clearly better posture, which it gets."""
        worst = np.nanmax(self.residual[first : first + len(costs), self._heavy], axis=1, initial=0.0)
        poor = first + np.flatnonzero(worst > POOR)
        if not poor.size:
            return None
        starts = self._starts[poor]
        others, other_costs = search(self._cost, starts, self._wanted[poor], starts)
        better = np.flatnonzero(other_costs < 0.9 * costs[poor - first])
        if not better.size:
            return None
        frame = int(poor[better[0]])
        self._keep(frame, others[better[:1]])
        return frame

    def _keep(self, first: int, q: FloatArray) -> None:
        frames = slice(first, first + len(q))
        self.q[frames], self.residual[frames] = q, self._cost.distances(q, self._wanted[frames])

    # --- together

    def _together(self, first: int, stop: int) -> int:
        """Find frames at once; the first one after those that are kept."""
        guess = self._guess(first, stop)
        q, costs = search(self._cost, guess[1:], self._wanted[first:stop], guess[:-1])
        self._keep(first, q)
        found = self._better_start(first, costs)
        return stop if found is None else found + 1

    def _guess(self, first: int, stop: int) -> FloatArray:
        """Postures from the frame before the first, on a curve through some that are searched roughly."""
        knots, q = [first - 1], [self.q[first - 1]]
        for frame in [*range(first - 1 + self._apart, stop - 1, self._apart), stop - 1]:
            before = self._cost.later(q[-1], frame - knots[-1] - 1)
            wanted = self._wanted[frame : frame + 1]
            found = search(self._cost, q[-1][None], wanted, before[None], ROUGH)[0][0]
            found[3:7] *= np.copysign(1.0, found[3:7] @ q[-1][3:7])
            knots.append(frame)
            q.append(found)
        curve = CubicSpline(knots, q)(np.arange(first - 1, stop))
        curve[:, 3:7] /= np.linalg.norm(curve[:, 3:7], axis=1, keepdims=True)
        curve[:, 7:] = np.clip(curve[:, 7:], self._body.lower, self._body.upper)
        return curve
