"""How people walk: paths, footprints, segments, words, whole-body walks ([Truong2010]_ chapters 3 to 6)."""

from manikin.locomotion.categories import (
    CategoryStatistics,
    Spread,
    category_goals,
    category_of,
    category_statistics,
)
from manikin.locomotion.controller import WalkController, WalkFrame
from manikin.locomotion.deviation import HolonomicEnds, PathDeviation, holonomic_ends, path_deviation
from manikin.locomotion.floor_plan import floor_plan
from manikin.locomotion.follow import Walk, walk_along
from manikin.locomotion.footprints import Footprint, Footprints
from manikin.locomotion.library import MotionLibrary
from manikin.locomotion.library_file import load_library, save_library
from manikin.locomotion.objective import (
    LITERAL_ORDER,
    PROSE_ORDER,
    RECORDED_TURNS,
    RECORDED_WALKS,
    WalkObjective,
)
from manikin.locomotion.obstacles import Walker, WalkObstacle
from manikin.locomotion.path import WalkingPath, WalkingResiduals, WalkingTask, walked
from manikin.locomotion.plan import walking_path, walking_paths
from manikin.locomotion.route import WalkRoute, Waypoint, walking_route
from manikin.locomotion.segmentation import (
    HOLONOMIC,
    KINDS,
    NONHOLONOMIC,
    STANDING,
    OnlineSegmentation,
    PathSegment,
    PathSegments,
    SegmentationRule,
    segment_path,
)
from manikin.locomotion.shoulders import ShoulderPaths
from manikin.locomotion.stepper import StepRule, place_footprints
from manikin.locomotion.targets import START, TEST_TARGETS, experiment_targets
from manikin.locomotion.walked_footprints import walked_footprints
from manikin.locomotion.zone import HolonomicZone, holonomic_zone

__all__ = [
    "HOLONOMIC",
    "KINDS",
    "LITERAL_ORDER",
    "NONHOLONOMIC",
    "PROSE_ORDER",
    "RECORDED_TURNS",
    "RECORDED_WALKS",
    "STANDING",
    "START",
    "TEST_TARGETS",
    "CategoryStatistics",
    "Footprint",
    "Footprints",
    "HolonomicEnds",
    "HolonomicZone",
    "MotionLibrary",
    "OnlineSegmentation",
    "PathDeviation",
    "PathSegment",
    "PathSegments",
    "SegmentationRule",
    "ShoulderPaths",
    "Spread",
    "StepRule",
    "Walk",
    "WalkController",
    "WalkFrame",
    "WalkObjective",
    "WalkObstacle",
    "WalkRoute",
    "Walker",
    "WalkingPath",
    "WalkingResiduals",
    "WalkingTask",
    "Waypoint",
    "category_goals",
    "category_of",
    "category_statistics",
    "experiment_targets",
    "floor_plan",
    "holonomic_ends",
    "holonomic_zone",
    "load_library",
    "path_deviation",
    "place_footprints",
    "save_library",
    "segment_path",
    "walk_along",
    "walked",
    "walked_footprints",
    "walking_path",
    "walking_paths",
    "walking_route",
]
