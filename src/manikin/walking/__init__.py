"""How people walk: paths, footprints, segments, words, whole-body walks ([Truong2010]_ chapters 3 to 6)."""

from manikin.walking.footprints import Footprints
from manikin.walking.gait.follow_path import Walk, WalkController, WalkFrame, walk_along
from manikin.walking.gait.motion_library import load_library, save_library
from manikin.walking.goal_categories import (
    CategorySpread,
    CategoryStatistics,
    HolonomicZone,
    category_goals,
    category_of,
    category_statistics,
    holonomic_ends,
    holonomic_zone,
    path_deviation,
)
from manikin.walking.path.path_plan import walking_path
from manikin.walking.path.route import WalkRoute, Waypoint, walking_route
from manikin.walking.path.walk_obstacles import Walker, WalkObstacle, floor_plan
from manikin.walking.path.walking_model import (
    LITERAL_ORDER,
    PROSE_ORDER,
    RECORDED_TURNS,
    RECORDED_WALKS,
    START,
    WalkObjective,
    experiment_targets,
)
from manikin.walking.path.walking_path import WalkingPath
from manikin.walking.segmentation import (
    HOLONOMIC,
    KINDS,
    NONHOLONOMIC,
    STANDING,
    PathSegments,
    SegmentationRule,
    ShoulderPaths,
    segment_path,
)
from manikin.walking.stepper import SteppedPath, StepRule, step_along

__all__ = [
    "HOLONOMIC", "KINDS", "LITERAL_ORDER", "NONHOLONOMIC", "PROSE_ORDER", "RECORDED_TURNS",
    "RECORDED_WALKS", "STANDING", "START", "CategorySpread", "CategoryStatistics",
    "Footprints", "HolonomicZone", "PathSegments", "SegmentationRule", "ShoulderPaths", "StepRule",
    "SteppedPath", "Walk", "WalkController", "WalkFrame", "WalkObjective", "WalkObstacle", "WalkRoute",
    "Walker", "WalkingPath", "Waypoint", "category_goals", "category_of", "category_statistics",
    "experiment_targets", "floor_plan", "holonomic_ends", "holonomic_zone", "load_library",
    "path_deviation", "save_library", "segment_path", "step_along", "walk_along",
    "walking_path", "walking_route",
]  # fmt: skip
