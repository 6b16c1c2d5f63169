"""Recorded rotations of hips and shoulders as angles of our human's hinges."""

from collections.abc import Mapping

import numpy as np

from manikin.body import human
from manikin.body.ball_joint import ball_angles
from manikin.mocap.anatomy import SIDES, Anatomy
from manikin.mocap.recording import Recording
from manikin.spatial import FloatArray

BALL_SEGMENTS = ("thigh", "upper_arm")
"""Segments on ball joints, without their side."""


def ball_joint_angles(recording: Recording, anatomy: Anatomy) -> Mapping[str, FloatArray]:
    """Angles of the hips and shoulders of a recording.

    A shoulder's are those of the upper arm to the thorax, the movement of the shoulder girdle included.
    Each angle is within half a turn of the middle of its hinge's range.

    Args:
        recording: The motion.
        anatomy: Of the same person, see :func:`manikin.mocap.anatomy.anatomy_of`.

    Returns:
        (n, 3) [rad] in the order of the hinges, by segment (``"left_thigh"`` ...); equal angles of the
        two sides are mirrored postures.
    """
    body, found = human(), {}
    for part in BALL_SEGMENTS:
        for side in SIDES:
            name = f"{side}_{part}"
            hinges = body.segment(name).hinges
            axes = np.array([hinge.axis for hinge in hinges])
            middle = np.array([0.5 * (hinge.lower + hinge.upper) for hinge in hinges])
            found[name] = ball_angles(axes, anatomy.relative(recording, name), middle)
    return found
