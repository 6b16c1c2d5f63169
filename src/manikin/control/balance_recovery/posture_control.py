"""Posture control with the largest gains that keep the ZMP inside ([Kudoh2002]_ 2.5.2)."""

from dataclasses import dataclass

import numpy as np

from manikin.control.balance_recovery.closed_loop import ClosedLoop, LinearMap
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class PostureControl:
    """What the posture control asks for.

    Attributes:
        joints: (nv - 6,) joint accelerations [rad/s^2], nearest ones that leave the feet where they are.
        share: Of the largest gains, in [0, 1].
        inside: Whether it keeps the ZMP inside.
    """

    joints: FloatArray
    share: float
    inside: bool = True


def posture_control(
    loop: ClosedLoop, rows: LinearMap, pull: FloatArray, *, always: bool = False
) -> PostureControl | None:
    """Find the largest share of the gains at which no row is positive.

    The acceleration, and with it every row, is linear in the share, so that it is found in closed form.

    Args:
        loop: Maps at the state.
        rows: Not positive when the ZMP is inside.
        pull: (nv - 6,) joint accelerations at the largest gains, ``K_p e + K_d e'`` ([Kudoh2002]_ 2.65).
        always: Where no share keeps the ZMP inside, whether to take the one at which it leaves least.

    Returns:
        None where no share in (0, 1] keeps the ZMP inside.
    """
    sought = np.column_stack((-loop.joints.offset, pull))
    still, pulled = np.linalg.lstsq(loop.joints.matrix, sought, rcond=None)[0].T
    at_rest, slope = rows(still), rows.matrix @ pulled
    rising, falling = slope > 0.0, slope < 0.0
    most = float(np.min(-at_rest[rising] / slope[rising], initial=1.0))
    least = float(np.max(-at_rest[falling] / slope[falling], initial=0.0))
    level = bool(np.any(at_rest[slope == 0.0] > 0.0))
    share = most
    if level or most <= 0.0 or least > most:
        if not always:
            return None
        share = _least_excess(at_rest, slope)
    return PostureControl(loop.joints(still + share * pulled), share, share == most)


def _least_excess(at_rest: FloatArray, slope: FloatArray) -> float:
    """Share in [0, 1] at which the largest of the rows ``at_rest + slope * share`` is smallest."""
    steeper = slope[:, None] - slope
    crossings = (at_rest - at_rest[:, None])[steeper != 0.0] / steeper[steeper != 0.0]
    shares = np.concatenate(([0.0, 1.0], crossings[(crossings > 0.0) & (crossings < 1.0)]))
    largest = np.max(at_rest[:, None] + slope[:, None] * shares, axis=0)
    return float(shares[np.argmin(largest)])
