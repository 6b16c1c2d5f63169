"""Recovery from pushes without a step: posture control and a quadratic program ([Kudoh2002]_)."""

from manikin.control.recovery.recovery_controller import BalanceRecovery, RecoveryOutput
from manikin.control.recovery.recovery_problem import Objective, leg_symmetry
from manikin.control.recovery.standing import (
    ClosedLoop,
    FeltPush,
    JointGroups,
    LinearMap,
    Standing,
    SupportArea,
    close_loop,
    joint_groups,
    sole_at,
    zmp_of,
    zmp_rows,
)
from manikin.control.recovery.strategy import (
    RecoverySettings,
    Strategy,
    StrategySwitch,
    capture_point,
    com_law,
    posture_control,
)
from manikin.control.recovery.turning import Turning, edge_limits, held_impulse

__all__ = [
    "BalanceRecovery", "ClosedLoop", "FeltPush", "JointGroups", "LinearMap", "Objective", "RecoveryOutput",
    "RecoverySettings", "Standing", "Strategy", "StrategySwitch", "SupportArea", "Turning", "capture_point",
    "close_loop", "com_law", "edge_limits", "held_impulse", "joint_groups", "leg_symmetry", "posture_control",
    "sole_at", "zmp_of", "zmp_rows",
]  # fmt: skip
