"""Postures that hold given contacts, centre of mass and clearances."""

from manikin.kinematics.alignment import Aligner, Alignment
from manikin.kinematics.limb_kinematics import EffectorPlacements, LimbKinematics, ReachVolume, reach_volume
from manikin.kinematics.point_targets import PointTargets
from manikin.kinematics.posture_problem import (
    Placement,
    PostureProblem,
    Preferences,
    com_target,
    pairs_beside,
    place_over_contacts,
    touching_pairs,
)
from manikin.kinematics.posture_search import PostureResult, SolverSettings, generate_posture

__all__ = [
    "Aligner", "Alignment", "EffectorPlacements", "LimbKinematics", "Placement", "PointTargets",
    "PostureProblem", "PostureResult", "Preferences", "ReachVolume", "SolverSettings", "com_target",
    "generate_posture", "pairs_beside", "place_over_contacts", "reach_volume", "touching_pairs",
]  # fmt: skip
