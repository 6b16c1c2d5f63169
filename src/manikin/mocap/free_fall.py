"""When nothing can support a recorded person: where the centre of mass falls freely.

What is slow and near a surface need not be on it: a foot that goes up in a jump turns round where it is
highest, be it at the height of the box that the jump began on. Newton's second law knows: the supports give
the centre of mass all the acceleration it has beside gravity.
"""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import Support
from manikin.mocap.support_levels import CUTOFF, track
from manikin.spatial import GRAVITY, FloatArray

FREE = 0.8
"""Downward acceleration over gravity from which, as a median, nothing carries: a tenth of a second of free
fall has about as much left after the low-pass."""


def while_carried(
    supports: Sequence[Support], found: Reconstruction, rate: float, *,
    start: float = 0.0, cutoff: float = CUTOFF,
) -> tuple[Support, ...]:  # fmt: skip
    """Those supports during which the centre of mass does not fall freely, in order.

    Args:
        supports: Of any effectors.
        found: At least four instants.
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the cutoff is too high.
    """
    falls = -vertical_acceleration(found, rate, cutoff) / GRAVITY
    kept = []
    for one in supports:
        first, last = (round((instant - start) * rate) for instant in (one.start, one.end))
        if float(np.median(falls[first : last + 1])) < FREE:
            kept.append(one)
    return tuple(kept)


def vertical_acceleration(found: Reconstruction, rate: float, cutoff: float = CUTOFF) -> FloatArray:
    """(n,) upward, of the low-passed centre of mass [m/s^2].

    Args:
        found: At least four instants.
        rate: Frames per second [Hz].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the cutoff is too high.
    """
    model = found.body.pinocchio
    data = model.createData()
    com = np.array([pin.centerOfMass(model, data, q).copy() for q in found.q])
    height = track(com, rate, cutoff).positions[:, 2]
    return np.gradient(np.gradient(height, 1.0 / rate), 1.0 / rate)
