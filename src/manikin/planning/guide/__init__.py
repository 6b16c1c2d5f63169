"""Guides for the root: reachability roadmaps, queries and shortcuts ([Tonneau2015]_ chapter 6).

Ways over the ground for a column in its place are in :mod:`manikin.planning.guide.ground`.
"""

from manikin.planning.guide.abstraction import Abstraction, LimbReach, TrunkShape, abstraction_of
from manikin.planning.guide.checker import NO_MARGINS, Margins, ReachabilityChecker
from manikin.planning.guide.condition import Condition, LimbRule, UsableSurface
from manikin.planning.guide.guide import GuideResult, GuideTask, GuideWorld, offline_roadmap, plan_guide
from manikin.planning.guide.roadmap import Roadmap, RoadmapSettings, Route, request
from manikin.planning.guide.root_path import RootLimits, RootPath
from manikin.planning.guide.root_pose import root_pose
from manikin.planning.guide.sampler import PoseSampler, SamplingRegion
from manikin.planning.guide.steering import LocalPlanner

__all__ = [
    "NO_MARGINS", "Abstraction", "Condition", "GuideResult", "GuideTask", "GuideWorld", "LimbReach",
    "LimbRule", "LocalPlanner", "Margins", "PoseSampler", "ReachabilityChecker", "Roadmap",
    "RoadmapSettings", "RootLimits", "RootPath", "Route", "SamplingRegion", "TrunkShape", "UsableSurface",
    "abstraction_of", "offline_roadmap", "plan_guide", "request", "root_pose",
]  # fmt: skip
