"""Postures that hold given contacts, centre of mass and clearances."""

from manikin.posture.generate import PostureResult, SolverSettings, generate_posture, place_over_contacts
from manikin.posture.problem import Placement, PostureProblem, Preferences, com_target, touching_pairs

__all__ = [
    "Placement",
    "PostureProblem",
    "PostureResult",
    "Preferences",
    "SolverSettings",
    "com_target",
    "generate_posture",
    "place_over_contacts",
    "touching_pairs",
]
