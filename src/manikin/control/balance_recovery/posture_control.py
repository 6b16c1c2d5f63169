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
        share: Of the largest gains, in (0, 1].
    """

    joints: FloatArray
    share: float


def posture_control(loop: ClosedLoop, rows: LinearMap, pull: FloatArray) -> PostureControl | None:
    """Find the largest share of the gains at which no row is positive.

    The acceleration, and with it every row, is linear in the share, so that it is found in closed form.

    Args:
        loop: Maps at the state.
        rows: Not positive when the ZMP is inside.
        pull: (nv - 6,) joint accelerations at the largest gains, ``K_p e + K_d e'`` ([Kudoh2002]_ 2.65).

    Returns:
        None where no share in (0, 1] keeps the ZMP inside.
    """
    sought = np.column_stack((-loop.joints.offset, pull))
    still, pulled = np.linalg.lstsq(loop.joints.matrix, sought, rcond=None)[0].T
    at_rest, slope = rows(still), rows.matrix @ pulled
    least, most = 0.0, 1.0
    for value, change in zip(at_rest, slope, strict=True):
        if change > 0.0:
            most = min(most, -value / change)
        elif change < 0.0:
            least = max(least, -value / change)
        elif value > 0.0:
            return None
    if most <= 0.0 or least > most:
        return None
    return PostureControl(loop.joints(still + most * pulled), most)
