"""What a recording says nothing about, held as people hold it: trunk and head upright, arms hanging.

Left at rest on the segment that carries it, an untold trunk would tip with every tilt of the pelvis, and the
centre of mass with it. People keep trunk and head upright in the world, and arms hang: so each untold ball
joint turns its segment as in upright standing, towards where the carrying segment heads.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body.ball_joint import ball_angles, ball_rotation
from manikin.mocap.reconstruction import Reconstruction
from manikin.spatial import FloatArray

UPRIGHT = ("lumbar", "thorax", "neck", "left_upper_arm", "right_upper_arm")
"""Segments on ball joints, from the pelvis outward, that are upright or hang unless a recording tells."""


def untold_upright(found: Reconstruction) -> Reconstruction:
    """The same with untold trunk, neck and upper arms as in upright standing, whatever carries them does.

    Angles are kept to the limits of their hinges. Elbows and wrists stay as in standing. Nothing that is
    followed moves.
    """
    body, standing = found.body, found.body.standing_posture()
    if not set(UPRIGHT) & set(found.neutral):
        return found
    q = np.array(found.q)
    turns = {body.segments[0].name: Rotation.from_quat(q[:, 3:7]).as_matrix()}
    for name in UPRIGHT:
        segment = body.segment(name)
        axes = np.array([hinge.axis for hinge in segment.hinges])
        places = [7 + body.joint_index(hinge.name) for hinge in segment.hinges]
        carrier = turns[segment.parent or ""]
        if name in found.neutral:
            wanted = _heading(carrier) @ ball_rotation(axes, standing[places])
            angles = ball_angles(axes, carrier.transpose(0, 2, 1) @ wanted, standing[places])
            limits = [(hinge.lower, hinge.upper) for hinge in segment.hinges]
            q[:, places] = np.clip(angles, *np.transpose(limits))
        turns[name] = carrier @ ball_rotation(axes, q[:, places])
    return replace(found, q=q)


def _heading(turns: FloatArray) -> FloatArray:
    """(n, 3, 3) turns about the vertical to where the x axes of rotations point."""
    yaw = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    return Rotation.from_rotvec(yaw[:, None] * [0.0, 0.0, 1.0]).as_matrix()
