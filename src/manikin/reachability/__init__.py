"""Guides for the root: reachability roadmaps, queries and shortcuts ([Tonneau2015]_ chapter 6)."""

from manikin.reachability.abstraction import Abstraction, LimbReach, TrunkShape, abstraction_of
from manikin.reachability.checker import NO_MARGINS, Margins, ReachabilityChecker
from manikin.reachability.comfort import ComfortSettings, nearest_fit, relax
from manikin.reachability.condition import Condition, LimbRule
from manikin.reachability.guide import (
    GuideResult,
    GuideSettings,
    GuideTask,
    World,
    offline_roadmap,
    plan_guide,
)
from manikin.reachability.pose import root_pose
from manikin.reachability.query import Route, request
from manikin.reachability.restarts import plan_guide_with_restarts
from manikin.reachability.roadmap import Roadmap, RoadmapSettings
from manikin.reachability.root_path import RootLimits, RootPath
from manikin.reachability.sampler import PoseSampler, SamplerSettings, SamplingRegion
from manikin.reachability.shortcut import ShortcutSettings
from manikin.reachability.steering import LocalPlanner
from manikin.reachability.storage import load_roadmap, roadmap_for, save_roadmap
from manikin.reachability.surfaces import UsableSurface

__all__ = [
    "NO_MARGINS",
    "Abstraction",
    "ComfortSettings",
    "Condition",
    "GuideResult",
    "GuideSettings",
    "GuideTask",
    "LimbReach",
    "LimbRule",
    "LocalPlanner",
    "Margins",
    "PoseSampler",
    "ReachabilityChecker",
    "Roadmap",
    "RoadmapSettings",
    "RootLimits",
    "RootPath",
    "Route",
    "SamplerSettings",
    "SamplingRegion",
    "ShortcutSettings",
    "TrunkShape",
    "UsableSurface",
    "World",
    "abstraction_of",
    "load_roadmap",
    "nearest_fit",
    "offline_roadmap",
    "plan_guide",
    "plan_guide_with_restarts",
    "relax",
    "request",
    "roadmap_for",
    "root_pose",
    "save_roadmap",
]
