"""Ergonomics of any motion: posture scores, loads on the back, lifting, strength, effort, lowest margin."""

from manikin.ergonomics.assessment import (
    Assessment,
    JointStrength,
    assess_posture,
    cumulative_effort,
    joint_strength,
)
from manikin.ergonomics.body_parts import bearing_of
from manikin.ergonomics.capable_share import CapableShare, capable_share, capable_shares
from manikin.ergonomics.force_limits import (
    BASIC_FORCES,
    ForceLimit,
    ForceMultipliers,
    force_limit,
    force_multipliers,
)
from manikin.ergonomics.force_of_motion import ExertedOverTime, exerted_by
from manikin.ergonomics.lift_of_motion import lift_of
from manikin.ergonomics.lifting import (
    HandPlace,
    Lift,
    LiftingIndex,
    Multipliers,
    composite_index,
    lifting_index,
)
from manikin.ergonomics.load_report import LoadAssessment, loads_of
from manikin.ergonomics.low_back import LowBack, low_back_load
from manikin.ergonomics.owas import Owas, owas_category, owas_of
from manikin.ergonomics.postural_angles import postural_angles, upright_neck
from manikin.ergonomics.reach import ReachEnvelope, ReachUse, reach_envelopes, reach_use
from manikin.ergonomics.report import Ergonomics, LowestMargin, ergonomics_of, lowest_margin
from manikin.ergonomics.rula_reba import (
    Circumstances,
    RebaSteps,
    RulaSteps,
    reba_action_level,
    reba_score,
    rula_action_level,
    rula_score,
)
from manikin.ergonomics.sight import Sight, sight_of, sight_zone
from manikin.ergonomics.static_postures import StaticPostures, static_postures
from manikin.ergonomics.working_postures import PartPostures, WorkingPostures, working_postures

__all__ = [
    "BASIC_FORCES", "Assessment", "CapableShare", "Circumstances", "Ergonomics", "ExertedOverTime",
    "ForceLimit", "ForceMultipliers", "HandPlace", "JointStrength", "Lift", "LiftingIndex",
    "LoadAssessment", "LowBack", "LowestMargin", "Multipliers", "Owas", "PartPostures", "ReachEnvelope",
    "ReachUse", "RebaSteps", "RulaSteps", "Sight", "StaticPostures", "WorkingPostures", "assess_posture",
    "bearing_of", "capable_share", "capable_shares", "composite_index", "cumulative_effort",
    "ergonomics_of", "exerted_by", "force_limit", "force_multipliers", "joint_strength", "lift_of",
    "lifting_index", "loads_of", "low_back_load", "lowest_margin", "owas_category", "owas_of",
    "postural_angles", "reach_envelopes", "reach_use", "reba_action_level", "reba_score",
    "rula_action_level", "rula_score", "sight_of", "sight_zone", "static_postures", "upright_neck",
    "working_postures",
]  # fmt: skip
