"""Holonomic and nonholonomic stretches of a reconstructed person's walk."""

import numpy as np
import pinocchio as pin

from manikin.errors import InputError
from manikin.locomotion.segmentation import PathSegments, segment_path
from manikin.locomotion.shoulders import ShoulderPaths
from manikin.mocap.reconstruction import Reconstruction
from manikin.spatial import FloatArray

SHOULDERS = ("left_upper_arm", "right_upper_arm")
"""Segments that begin at the shoulders."""

UPRIGHT = 0.5
"""Height of the shoulders above the pelvis, per that in standing, below which nobody walks."""


def walked_segments(found: Reconstruction) -> PathSegments | None:
    """Function 1 on the shoulders of the reconstructed body (:mod:`manikin.locomotion.segmentation`).

    None where the trunk ever lies or is bent so far that the shoulders no longer say where the body looks.

    Args:
        found: At least three instants at an even rate.
    """
    places = _places(found, found.q)
    standing = _places(found, found.body.standing_posture()[None])[0]
    height = places[:, :2, 2].mean(axis=1) - places[:, 2, 2]
    if np.any(height < UPRIGHT * float(standing[:2, 2].mean() - standing[2, 2])):
        return None
    rate = (len(found.time) - 1) / float(found.time[-1] - found.time[0])
    try:
        return segment_path(ShoulderPaths(places[:, 0, :2], places[:, 1, :2], rate))
    except InputError:  # the shoulders are above each other
        return None


def _places(found: Reconstruction, postures: FloatArray) -> FloatArray:
    """(n, 3, 3) left shoulder, right shoulder and pelvis [m]."""
    body = found.body
    model, data = body.pinocchio, body.pinocchio.createData()
    frames = [body.segment_frame(name) for name in SHOULDERS]
    places = np.empty((len(postures), 3, 3))
    for number, q in enumerate(postures):
        pin.framesForwardKinematics(model, data, q)
        for shoulder, frame in enumerate(frames):
            places[number, shoulder] = data.oMf[frame].translation
    places[:, 2] = postures[:, :3]
    return places
