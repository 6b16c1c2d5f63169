"""Whole-body motion: swings, their search, and the motion that joins them."""

from manikin.planning.whole_body.certificate import (
    MotionCertificate,
    RefineRequirements,
    WholeBodyFailure,
    WholeBodyRequirements,
)
from manikin.planning.whole_body.fit_scales import FitScales, RefineScales
from manikin.planning.whole_body.handling import FREE_HANDS, HandCourse, Handling, HeldObject
from manikin.planning.whole_body.key_postures import (
    Eligibility,
    KeyPosture,
    KeyPostures,
    find_eligible_plan,
    find_key_postures,
)
from manikin.planning.whole_body.plan_whole_body import WholeBodyResult, WholeBodySettings, plan_whole_body
from manikin.planning.whole_body.refine import RefineResult, RefineSettings, refine_motion
from manikin.planning.whole_body.refine_measures import RefineMeasures
from manikin.planning.whole_body.seated import SeatedContinuation, continue_seated
from manikin.planning.whole_body.swing_planner import PlannedSwing

__all__ = [
    "FREE_HANDS", "Eligibility", "FitScales", "HandCourse", "Handling", "HeldObject", "KeyPosture",
    "KeyPostures", "MotionCertificate", "PlannedSwing", "RefineMeasures", "RefineRequirements",
    "RefineResult", "RefineScales", "RefineSettings", "SeatedContinuation", "WholeBodyFailure",
    "WholeBodyRequirements", "WholeBodyResult", "WholeBodySettings", "continue_seated",
    "find_eligible_plan", "find_key_postures", "plan_whole_body", "refine_motion",
]  # fmt: skip
