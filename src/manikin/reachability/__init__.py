"""Guides for the root: reachability roadmaps, queries and shortcuts ([Tonneau2015]_ chapter 6)."""

from manikin.reachability.abstraction import Abstraction, LimbReach, TrunkShape, abstraction_of
from manikin.reachability.checker import NO_MARGINS, Margins, ReachabilityChecker
from manikin.reachability.condition import Condition, LimbRule
from manikin.reachability.pose import root_pose
from manikin.reachability.surfaces import UsableSurface

__all__ = [
    "NO_MARGINS",
    "Abstraction",
    "Condition",
    "LimbReach",
    "LimbRule",
    "Margins",
    "ReachabilityChecker",
    "TrunkShape",
    "UsableSurface",
    "abstraction_of",
    "root_pose",
]
