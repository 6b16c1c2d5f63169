"""What a recording says nothing about, held as people hold it: trunk and head upright, arms hanging.

Left at rest on the segment that carries it, an untold trunk would tip with every tilt of the pelvis, and the
centre of mass with it. People keep trunk and head upright in the world, and arms hang: so each untold ball
joint turns its segment as in upright standing, towards where the carrying segment heads.

Bolt upright, the trunk would share every push forward that the pelvis gets in a step. People do not let it:
they tilt the trunk so that the head moves evenly (Menz, Lord and Fitzpatrick, "Acceleration patterns of the
head and pelvis when walking on level and irregular surfaces", Gait & Posture 18, 2003). Where walks here have
markers on the trunk, its upper end has a third of the pelvis' acceleration along the walk; sideways it
follows. So an untold trunk tilts forward and back by what leaves a third.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body.ball_joint import ball_angles, ball_rotation
from manikin.mocap.local_cutoff import smooth
from manikin.mocap.reconstruction import Reconstruction
from manikin.spatial import FloatArray

UPRIGHT = ("lumbar", "thorax", "neck", "left_upper_arm", "right_upper_arm")
"""Segments on ball joints, from the pelvis outward, that are upright or hang unless a recording tells."""

_TILTED = ("lumbar", "thorax")


CALMED_SHARE = 1.0 / 3.0
"""Of what is fast in the pelvis' motion forward and back, what the upper end of the trunk has as well."""

SLOW = 1.0
"""Slower motion of the pelvis takes the trunk along [Hz]: below the frequency of steps."""

LARGEST_TILT = np.deg2rad(10.0)
"""Of an untold trunk [rad]."""


def untold_upright(found: Reconstruction) -> Reconstruction:
    """The same with untold trunk, neck and upper arms as in upright standing, whatever carries them does.

    An untold trunk tilts to calm its upper end. Angles are kept to the limits of their hinges. Elbows and
    wrists stay as in standing. Nothing that is followed moves.
    """
    body, standing = found.body, found.body.standing_posture()
    if not set(UPRIGHT) & set(found.neutral):
        return found
    q = np.array(found.q)
    turns = {body.segments[0].name: Rotation.from_quat(q[:, 3:7]).as_matrix()}
    tilts = _calming_tilts(found, turns[body.segments[0].name])
    for name in UPRIGHT:
        segment = body.segment(name)
        axes = np.array([hinge.axis for hinge in segment.hinges])
        places = [7 + body.joint_index(hinge.name) for hinge in segment.hinges]
        carrier = turns[segment.parent or ""]
        if name in found.neutral:
            wanted = _heading(carrier) @ ball_rotation(axes, standing[places])
            if name in _TILTED:
                wanted = _heading(carrier) @ tilts @ ball_rotation(axes, standing[places])
            angles = ball_angles(axes, carrier.transpose(0, 2, 1) @ wanted, standing[places])
            limits = [(hinge.lower, hinge.upper) for hinge in segment.hinges]
            q[:, places] = np.clip(angles, *np.transpose(limits))
        turns[name] = carrier @ ball_rotation(axes, q[:, places])
    return replace(found, q=q)


def _calming_tilts(found: Reconstruction, pelvis: FloatArray) -> FloatArray:
    """(n, 3, 3) tilts of the trunk about the axis to the left; none where it is told, or for a few frames."""
    n, rate = len(found.q), (len(found.q) - 1) / max(float(found.time[-1] - found.time[0]), 1e-9)
    if not set(_TILTED) <= set(found.neutral) or n * SLOW < rate or rate <= 2.0 * SLOW:
        return np.tile(np.eye(3), (n, 1, 1))
    place = found.q[:, :2]
    fast = place - smooth(place, rate, np.full(n, SLOW))
    ahead = np.einsum("ij,ij->i", fast, _heading(pelvis)[:, :2, 0])
    length = sum(float(found.body.segment(name).origin[2]) for name in ("thorax", "neck"))
    tilt = np.clip((CALMED_SHARE - 1.0) * ahead / length, -LARGEST_TILT, LARGEST_TILT)
    return Rotation.from_rotvec(tilt[:, None] * [0.0, 1.0, 0.0]).as_matrix()


def _heading(turns: FloatArray) -> FloatArray:
    """(n, 3, 3) turns about the vertical to where the x axes of rotations point."""
    yaw = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    return Rotation.from_rotvec(yaw[:, None] * [0.0, 0.0, 1.0]).as_matrix()
