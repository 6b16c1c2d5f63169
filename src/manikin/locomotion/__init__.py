"""How people walk: paths by optimal control ([Truong2010]_ chapter 5)."""

from manikin.locomotion.objective import LITERAL_ORDER, PROSE_ORDER, WalkObjective
from manikin.locomotion.obstacles import Walker, WalkObstacle
from manikin.locomotion.path import WalkingPath, WalkingResiduals, WalkingTask, walked
from manikin.locomotion.plan import walking_path, walking_paths
from manikin.locomotion.targets import START, TEST_TARGETS, experiment_targets

__all__ = [
    "LITERAL_ORDER",
    "PROSE_ORDER",
    "START",
    "TEST_TARGETS",
    "WalkObjective",
    "WalkObstacle",
    "Walker",
    "WalkingPath",
    "WalkingResiduals",
    "WalkingTask",
    "experiment_targets",
    "walked",
    "walking_path",
    "walking_paths",
]
