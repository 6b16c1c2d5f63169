"""Postures within the joints' limits whose points lie closest to their targets."""

import numpy as np

from manikin.mocap.posture_cost import PostureCost
from manikin.mocap.projected_step import projected_step
from manikin.spatial import FloatArray

MOST_STEPS = 60
LEAST_GAIN = 1e-4
"""A step that lowers the cost by a smaller share is the last one."""

LEAST_COST = 1e-10
"""Cost [m^2] below which nothing is left to gain."""

LEAST_DAMPING, FIRST_DAMPING, FAILED_DAMPING, MOST_DAMPING = 1e-8, 1e-6, 1e-3, 1e3
"""Least, at first, least after a step that failed, and beyond which the search gives up [m^2]."""


def search(
    cost: PostureCost, starts: FloatArray, wanted: FloatArray, before: FloatArray,
    least_gain: float = LEAST_GAIN,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """The closest postures by Levenberg-Marquardt, projected onto the joints' ranges.

    The n searches do not depend on each other; together they take less time.

    Args:
        cost: Of postures.
        starts: (n, nq) postures within the limits.
        wanted: (n, k, 3) places of the targets [m]; NaN where one is not seen.
        before: (n, nq) postures to stay near.
        least_gain: Share of the cost by which a step has to lower it, not to be the last one.

    Returns:
        (n, nq) postures and their costs (n,) [m^2].
    """
    held = cost.drawn_to(before)
    here = cost.at(cost.settled(starts, held), held, wanted)
    q, costs = here.q, here.cost
    damping, frames = np.full(len(q), FIRST_DAMPING), np.flatnonzero(costs > LEAST_COST)
    gradient, matrix = np.empty((len(q), len(cost.slots))), np.empty((len(q), *2 * [len(cost.slots)]))
    fresh, here = frames, here.only(costs > LEAST_COST)
    for _ in range(MOST_STEPS):
        if not frames.size:
            break
        if fresh.size:
            gradient[fresh], matrix[fresh] = cost.equations(here)
        lower, upper = cost.room(q[frames])
        steps, promised = np.empty_like(lower), np.empty(len(frames))
        for number, frame in enumerate(frames):
            right = -gradient[frame]
            steps[number] = projected_step(matrix[frame], right, damping[frame], lower[number], upper[number])
            promised[number] = right @ steps[number]
        here = cost.at(cost.moved(q[frames], steps), held[frames], wanted[frames])
        gained = costs[frames] - here.cost
        better, enough = gained > 0.0, least_gain * costs[frames]
        last = (promised <= enough) | (better & (gained <= enough))
        here, fresh = here.only(better), frames[better]
        q[fresh], costs[fresh] = here.q, here.cost
        damping[frames] = _next_damping(damping[frames], gained, promised)
        going = ~last & (damping[frames] < MOST_DAMPING) & (costs[frames] > LEAST_COST)
        here, fresh, frames = here.only(going[better]), frames[better & going], frames[going]
    return q, costs


def _next_damping(damping: FloatArray, gained: FloatArray, promised: FloatArray) -> FloatArray:
    """(n,) less after a step that kept its promise, more after one that failed."""
    less = np.maximum(0.1 * damping, LEAST_DAMPING)
    kept = np.where(gained >= 0.75 * promised, less, damping)
    return np.where(gained > 0.0, kept, np.maximum(10.0 * damping, FAILED_DAMPING))
