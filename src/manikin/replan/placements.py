"""Where effectors are in given postures."""

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.limb import hanging_segment
from manikin.spatial import FloatArray


def effector_placements(body: BodyModel, q: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    """(n, 3) positions [m] and (n, 3, 3) rotations of an effector in the world, in postures (n, nq)."""
    data, frame = body.pinocchio.createData(), body.effector_frame(name)
    position, rotation = np.empty((len(q), 3)), np.empty((len(q), 3, 3))
    for row, one in enumerate(q):
        pin.framesForwardKinematics(body.pinocchio, data, one)
        position[row], rotation[row] = data.oMf[frame].translation, data.oMf[frame].rotation
    return position, rotation


def toe_hinge(body: BodyModel, name: str) -> FloatArray | None:
    """(3,) middle of the hinge of a foot's toes in the frame of its sole [m]; None without toes."""
    toes = hanging_segment(body, body.effector(name).segment)
    if toes is None:
        return None
    frame = body.effector(name)
    return frame.rotation.T @ (toes.origin - frame.translation)
