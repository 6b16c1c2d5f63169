"""Recorded human motion: readers of BVH and of ASF with AMC."""

from manikin.mocap.amc import Skeleton, read_amc, read_asf
from manikin.mocap.bvh import read_bvh
from manikin.mocap.read import read_recording
from manikin.mocap.recording import Recording

__all__ = ["Recording", "Skeleton", "read_amc", "read_asf", "read_bvh", "read_recording"]
