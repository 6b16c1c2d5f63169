"""Recorded human motion: readers of BVH and of ASF with AMC, and the angles of hips and shoulders."""

from manikin.mocap.amc import Skeleton, read_amc, read_asf
from manikin.mocap.anatomy import Anatomy, anatomy_of
from manikin.mocap.ball_joints import ball_joint_angles
from manikin.mocap.bvh import read_bvh
from manikin.mocap.read import read_recording
from manikin.mocap.recording import Recording

__all__ = [
    "Anatomy",
    "Recording",
    "Skeleton",
    "anatomy_of",
    "ball_joint_angles",
    "read_amc",
    "read_asf",
    "read_bvh",
    "read_recording",
]
