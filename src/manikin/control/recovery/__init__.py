"""Recovery from pushes without a step: posture control and a quadratic program ([Kudoh2002]_)."""

from manikin.control.recovery.recovery_controller import BalanceRecovery, RecoveryOutput
from manikin.control.recovery.standing import FeltPush, JointGroups, Standing, joint_groups, sole_at, zmp_of
from manikin.control.recovery.strategy import RecoverySettings, Strategy, capture_point
from manikin.control.recovery.turning import edge_limits, held_impulse

__all__ = [
    "BalanceRecovery", "FeltPush", "JointGroups", "RecoveryOutput", "RecoverySettings", "Standing",
    "Strategy", "capture_point", "edge_limits", "held_impulse", "joint_groups", "sole_at", "zmp_of",
]  # fmt: skip
