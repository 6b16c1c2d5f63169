"""Whole-body motion: swings, their search, and the motion that joins them."""

from manikin.wholebody.assemble import WholeBodyResult, WholeBodySettings, plan_whole_body
from manikin.wholebody.certificate import WholeBodyRequirements, WholeBodyResiduals
from manikin.wholebody.configuration_spline import ConfigurationSpline
from manikin.wholebody.eligibility import Eligibility, find_eligible_plan
from manikin.wholebody.failure import WholeBodyFailure
from manikin.wholebody.fit_scales import FitScales
from manikin.wholebody.flights import PlannedSwing
from manikin.wholebody.key_postures import KeyPosture, KeyPostures, find_key_postures
from manikin.wholebody.passage import Passage, head_segments, measure_passage
from manikin.wholebody.refine import refine_motion
from manikin.wholebody.refine_certificate import RefineRequirements, RefineResiduals
from manikin.wholebody.refine_measures import RefineMeasures
from manikin.wholebody.refine_result import RefineResult, RefineSettings
from manikin.wholebody.refine_scales import RefineScales
from manikin.wholebody.seated import SeatedContinuation, continue_seated

__all__ = [
    "ConfigurationSpline",
    "Eligibility",
    "FitScales",
    "KeyPosture",
    "KeyPostures",
    "Passage",
    "PlannedSwing",
    "RefineMeasures",
    "RefineRequirements",
    "RefineResiduals",
    "RefineResult",
    "RefineScales",
    "RefineSettings",
    "SeatedContinuation",
    "WholeBodyFailure",
    "WholeBodyRequirements",
    "WholeBodyResiduals",
    "WholeBodyResult",
    "WholeBodySettings",
    "continue_seated",
    "find_eligible_plan",
    "find_key_postures",
    "head_segments",
    "measure_passage",
    "plan_whole_body",
    "refine_motion",
]
