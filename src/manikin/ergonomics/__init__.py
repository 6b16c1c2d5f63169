"""Ergonomics of any motion: RULA and REBA, torques against strength, effort, the lowest margin."""

from manikin.ergonomics.assessment import (
    Assessment,
    JointStrength,
    assess_posture,
    cumulative_effort,
    joint_strength,
)
from manikin.ergonomics.body_parts import bearing_of
from manikin.ergonomics.postural_angles import postural_angles, upright_neck
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

__all__ = [
    "Assessment", "Circumstances", "Ergonomics", "JointStrength", "LowestMargin", "RebaSteps",
    "RulaSteps", "assess_posture", "bearing_of", "cumulative_effort", "ergonomics_of", "joint_strength",
    "lowest_margin", "postural_angles", "reba_action_level", "reba_score", "rula_action_level",
    "rula_score", "upright_neck",
]  # fmt: skip
