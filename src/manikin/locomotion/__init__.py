"""How people walk: paths by optimal control, footprints, segments ([Truong2010]_ chapters 4 and 5)."""

from manikin.locomotion.deviation import HolonomicEnds, PathDeviation, holonomic_ends, path_deviation
from manikin.locomotion.footprints import Footprint, Footprints
from manikin.locomotion.objective import LITERAL_ORDER, PROSE_ORDER, WalkObjective
from manikin.locomotion.obstacles import Walker, WalkObstacle
from manikin.locomotion.path import WalkingPath, WalkingResiduals, WalkingTask, walked
from manikin.locomotion.plan import walking_path, walking_paths
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

__all__ = [
    "HOLONOMIC",
    "KINDS",
    "LITERAL_ORDER",
    "NONHOLONOMIC",
    "PROSE_ORDER",
    "STANDING",
    "START",
    "TEST_TARGETS",
    "Footprint",
    "Footprints",
    "HolonomicEnds",
    "OnlineSegmentation",
    "PathDeviation",
    "PathSegment",
    "PathSegments",
    "SegmentationRule",
    "ShoulderPaths",
    "StepRule",
    "WalkObjective",
    "WalkObstacle",
    "Walker",
    "WalkingPath",
    "WalkingResiduals",
    "WalkingTask",
    "experiment_targets",
    "holonomic_ends",
    "path_deviation",
    "place_footprints",
    "segment_path",
    "walked",
    "walking_path",
    "walking_paths",
]
