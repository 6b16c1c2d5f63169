"""Postures within the joints' limits whose points lie closest to targets, from one instant to the next."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg.blas import dsymv
from scipy.linalg.lapack import dposv

from manikin.body import BodyModel
from manikin.kinematics.point_targets import PointTargets, PostureCost
from manikin.numerics.spatial import FloatArray

MOST_STEPS, MOST_ROUNDS = 60, 5
LEAST_GAIN, ROUGH = 1e-4, 1e-2
"""A step that lowers the cost by a smaller share is the last one, and the last one of a guess."""
LEAST_COST = 1e-10
"""Cost [m^2] below which nothing is left to gain."""
LEAST_DAMPING, FIRST_DAMPING, FAILED_DAMPING, MOST_DAMPING = 1e-8, 1e-6, 1e-3, 1e3
"""Least, at first, least after a step that failed, and beyond which the search gives up [m^2]."""


def search(
    cost: PostureCost, starts: FloatArray, wanted: FloatArray, before: FloatArray,
    least_gain: float = LEAST_GAIN,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """The closest postures (n, nq) by Levenberg-Marquardt in the joints' ranges, and their costs (n,) [m^2].

    The n searches do not depend on each other; together they take less time.

    Args:
        starts: (n, nq) postures within the limits.
        wanted: (n, k, 3) positions of the targets [m]; NaN where one is not seen.
        before: (n, nq) postures to stay near.
        least_gain: A step that lowers the cost by a smaller share is the last one.
    """
    held = cost.drawn_to(before)
    now = cost.at(cost.settled(starts, held), held, wanted)
    q, costs = now.q, now.cost
    damping, frames = np.full(len(q), FIRST_DAMPING), np.flatnonzero(costs > LEAST_COST)
    gradient, matrix = np.empty((len(q), len(cost.slots))), np.empty((len(q), *2 * [len(cost.slots)]))
    fresh, now = frames, now.only(costs > LEAST_COST)
    for _ in range(MOST_STEPS):
        if not frames.size:
            break
        if fresh.size:
            gradient[fresh], matrix[fresh] = cost.equations(now)
        lower, upper = cost.room(q[frames])
        steps, promised = np.empty_like(lower), np.empty(len(frames))
        for number, frame in enumerate(frames):
            right = -gradient[frame]
            steps[number] = bounded_step(matrix[frame], right, damping[frame], lower[number], upper[number])
            promised[number] = right @ steps[number]
        now = cost.at(cost.moved(q[frames], steps), held[frames], wanted[frames])
        gained = costs[frames] - now.cost
        better, enough = gained > 0.0, least_gain * costs[frames]
        last = (promised <= enough) | (better & (gained <= enough))
        now, fresh = now.only(better), frames[better]
        q[fresh], costs[fresh] = now.q, now.cost
        damping[frames] = _next_damping(damping[frames], gained, promised)
        going = ~last & (damping[frames] < MOST_DAMPING) & (costs[frames] > LEAST_COST)
        now, fresh, frames = now.only(going[better]), frames[better & going], frames[going]
    return q, costs


def _next_damping(damping: FloatArray, gained: FloatArray, promised: FloatArray) -> FloatArray:
    """(n,) less after a step that kept its promise, more after one that failed."""
    less = np.maximum(0.1 * damping, LEAST_DAMPING)
    kept = np.where(gained >= 0.75 * promised, less, damping)
    return np.where(gained > 0.0, kept, np.maximum(10.0 * damping, FAILED_DAMPING))


def bounded_step(
    matrix: FloatArray, right: FloatArray, damping: float, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Solution (d,) of ``(matrix + damping) @ step = right`` within bounds.

    Unknowns that would leave their bounds are put on them, the others solved for again, until none leaves. An
    unknown that is on its bound and pushed outward stays there (Bertsekas, "Projected Newton methods for
    optimization problems with simple constraints", 1982).

    The lower triangle of the semidefinite matrix (d, d) is read; the damping is above 0, the lower bounds
    (d,) are at most 0, the upper ones at least 0.
    """
    matrix = matrix.copy()
    matrix.reshape(-1)[:: len(right) + 1] += damping
    stopped = ((lower >= 0.0) & (right < 0.0)) | ((upper <= 0.0) & (right > 0.0))
    step = np.zeros_like(right)
    for _ in range(MOST_ROUNDS):
        step = _solved(matrix, right, stopped, step)
        kept = np.minimum(np.maximum(step, lower), upper)
        beyond = (kept != step) & ~stopped
        step = kept
        if not beyond.any():
            break
        stopped |= beyond
    return step


def _solved(
    matrix: FloatArray, right: FloatArray, stopped: NDArray[np.bool_], step: FloatArray
) -> FloatArray:
    """The solution in which some unknowns are as in a step."""
    fixed = stopped.nonzero()[0]
    if fixed.size:
        known = np.where(stopped, step, 0.0)
        right = np.where(stopped, step, right - dsymv(1.0, matrix.T, known))
        matrix = matrix.copy()
        matrix[fixed], matrix[:, fixed] = 0.0, 0.0
        matrix[fixed, fixed] = 1.0
    return dposv(matrix.T, right)[1]


POOR = 0.05
"""A frame with a point farther away than this [m] is searched from its own start, too."""
APART = 1.0 / 15.0
"""Time between the frames that are searched one by one [s]; those between begin on a curve through them."""
TOGETHER = 128
"""Most frames that are found at once."""


def follow(
    body: BodyModel, targets: PointTargets, starts: FloatArray, rate: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Postures that follow targets, each near the one before.

    Frame by frame, the search begins with the posture of the frame before. Of a dense recording some frames
    are searched so; those between begin on a curve through them and are found together.

    Args:
        starts: (n, nq) postures within the limits; the first is where the search begins, the others
            are tried where the search from the frame before leaves a point farther than :data:`POOR`.
        rate: Frames per second [Hz]; None for frames that are far from each other.

    Returns:
        (n, nq) postures and (n, k) distances of the points from their targets [m], NaN where not seen.
    """
    following = _Following(body, targets, starts, 1 if rate is None else max(round(APART * rate), 1))
    return following.q, following.residual


def improved(body: BodyModel, targets: PointTargets, q: FloatArray) -> FloatArray:
    """Postures (n, nq) closest to targets, searched from given ones and drawn to the given one before."""
    before = np.concatenate([q[:1], q[:-1]])
    return search(PostureCost(body, targets), q, targets.positions, before)[0]


class _Following:
    def __init__(self, body: BodyModel, targets: PointTargets, starts: FloatArray, apart: int) -> None:
        self._body, self._wanted, self._starts, self._apart = body, targets.positions, starts, apart
        self._cost = PostureCost(body, targets)
        self._heavy = targets.weights >= 1.0
        n = len(targets)
        self.q, self.residual = np.empty((n, body.nq)), np.empty((n, len(targets.names)))
        frame = 0
        while frame < n:
            if frame == 0 or apart == 1 or n - frame < apart:
                frame = self._singly(frame)
            else:
                frame = self._together(frame, min(frame + TOGETHER // apart * apart, n))

    def _singly(self, frame: int) -> int:
        """Search one frame; the first one after it."""
        before = self.q[frame - 1] if frame else self._starts[0]
        q, cost = search(self._cost, before[None], self._wanted[frame : frame + 1], before[None])
        self._keep(frame, q)
        if frame:
            self._better_start(frame, cost)
        return frame + 1

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

    def _together(self, first: int, stop: int) -> int:
        """Find frames at once; the first one after those that are kept."""
        guess = self._guess(first, stop)
        q, costs = search(self._cost, guess[1:], self._wanted[first:stop], guess[:-1])
        self._keep(first, q)
        better = self._better_start(first, costs)
        return stop if better is None else better + 1

    def _guess(self, first: int, stop: int) -> FloatArray:
        """Postures from the frame before the first, on a curve through some that are searched roughly."""
        knots, q = [first - 1], [self.q[first - 1]]
        for frame in [*range(first - 1 + self._apart, stop - 1, self._apart), stop - 1]:
            before = self._cost.later(q[-1], frame - knots[-1] - 1)
            wanted = self._wanted[frame : frame + 1]
            rough = search(self._cost, q[-1][None], wanted, before[None], ROUGH)[0][0]
            rough[3:7] *= np.copysign(1.0, rough[3:7] @ q[-1][3:7])
            knots.append(frame)
            q.append(rough)
        curve = CubicSpline(knots, q)(np.arange(first - 1, stop))
        curve[:, 3:7] /= np.linalg.norm(curve[:, 3:7], axis=1, keepdims=True)
        curve[:, 7:] = np.clip(curve[:, 7:], self._body.lower, self._body.upper)
        return curve
