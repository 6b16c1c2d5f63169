"""Angles at which a posture changes its score where neither RULA nor REBA gives a number.

Both say "upright", "twisted", "abducted", "across the midline" and leave the rest to the observer; to a
measurement every posture is a little twisted. All values here are our choice, near what an observer would
notice; they are in degrees, as the published ones.
"""

import numpy as np
from numpy.typing import NDArray

from manikin.ergonomics.postural_angles import ArmAngles
from manikin.spatial import FloatArray

NEUTRAL = 5.0
"""Up to this trunk and neck are upright [deg]."""

TURNED = 10.0
"""Beyond this trunk and neck are twisted or bent to the side, and a wrist is deviated [deg]."""

ABDUCTED = 20.0
"""Beyond this an upper arm is abducted [deg]; a hanging arm stands off by up to 15."""

WRIST_NEUTRAL = 5.0
"""Up to this a wrist is neither flexed nor extended [deg]."""

WRIST_BENT = 15.0
"""Beyond this it is strongly so [deg]; published."""

WRIST_AT_END = 60.0
"""Beyond this a forearm is turned to near the end of its range [deg], which is 80 deg to either side."""

OUTWARD = 30.0
"""A bent forearm that points further out than this works out to the side of the body [deg]."""

BENT_ELBOW = 30.0
"""Less bent arms hang; where they point is told by the upper arm [deg]."""


def degrees(angle: FloatArray) -> FloatArray:
    """(n,) angle in degrees, rounded to 1e-9 so that a posture on a border falls on its published side."""
    return np.asarray(np.round(np.rad2deg(angle), 9), dtype=np.float64)


def band(value: FloatArray, *borders: float) -> NDArray[np.int64]:
    """(n,) 1 up to and with the first border, 2 up to the second, and so on."""
    return 1 + np.sum([value > border for border in borders], axis=0)


def turned(angle: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a trunk or neck is twisted or bent to the side."""
    return np.abs(degrees(angle)) > TURNED


def out_of_line(arm: ArmAngles) -> NDArray[np.bool_]:
    """(n,) whether an arm works across the midline of the body or out to its side."""
    out = (degrees(arm.elbow) > BENT_ELBOW) & (degrees(arm.outward) > OUTWARD)
    return out | (arm.aside < 0.0)


def rotated(arm: ArmAngles) -> NDArray[np.bool_]:
    """(n,) whether an upper arm is turned about itself: the bent forearm points out of the sagittal plane."""
    return (degrees(arm.elbow) > BENT_ELBOW) & (np.abs(degrees(arm.outward)) > OUTWARD)
