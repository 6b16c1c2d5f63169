"""How far standing feet slide."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.locomotion.foot_placement import Sole
from manikin.locomotion.leg_kinematics import LegKinematics
from manikin.locomotion.stance_foot import borders
from manikin.spatial import FloatArray


def stance_slides(body: BodyModel, q: FloatArray, standing: NDArray[np.bool_]) -> FloatArray:
    """Largest displacement over the floor in every stance of either foot [m].

    From frame to frame, that of the lower end of the sole, heel or ball of the foot, is added up: a foot that
    rolls over its ends does not slide.

    Args:
        body: A human.
        q: (n, nq) postures.
        standing: (2, n) whether the left and the right foot stand.

    Returns:
        (stances,).
    """
    found = []
    sole = Sole.of_body(body)
    pelvis = Rotation.from_quat(q[:, 3:7]).as_matrix()
    feet = LegKinematics(body).feet(pelvis, q[:, :3], q[:, 7:])
    for foot, ankle, stands in zip(*feet, standing, strict=True):
        below = ankle - sole.depth * foot[:, :, 2]
        ends = np.stack([below + end * foot[:, :, 0] for end in (sole.heel, sole.ball)], axis=1)
        moved = np.diff(ends[..., :2], axis=0)
        lower = (ends[1:, :, 2] + ends[:-1, :, 2]).argmin(axis=1)
        moved = moved[np.arange(len(lower)), lower]
        for first, last in pairwise(borders(stands)):
            if stands[first] and last - first > 1:
                way = np.cumsum(moved[first : last - 1], axis=0)
                found.append(float(np.hypot(*way.T).max()))
    return np.array(found)
