"""Recovery from pushes without a step: posture control and a quadratic program ([Kudoh2002]_)."""

from manikin.control.recovery.recovery_controller import BalanceRecovery, RecoveryOutput
from manikin.control.recovery.recovery_problem import (
    Objective,
    RecoveryJointBounds,
    RecoveryProblem,
    build_recovery_qp,
    leg_symmetry,
)
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
    ComLaw,
    PostureControl,
    RecoverySettings,
    Strategy,
    StrategySwitch,
    capture_point,
    com_law,
    posture_control,
)
from manikin.control.recovery.turning import EdgeLimit, Turning, edge_limits, held_impulse

__all__ = [
    "BalanceRecovery",
    "ClosedLoop",
    "ComLaw",
    "EdgeLimit",
    "FeltPush",
    "JointGroups",
    "LinearMap",
    "Objective",
    "PostureControl",
    "RecoveryJointBounds",
    "RecoveryOutput",
    "RecoveryProblem",
    "RecoverySettings",
    "Standing",
    "Strategy",
    "StrategySwitch",
    "SupportArea",
    "Turning",
    "build_recovery_qp",
    "capture_point",
    "close_loop",
    "com_law",
    "edge_limits",
    "held_impulse",
    "joint_groups",
    "leg_symmetry",
    "posture_control",
    "sole_at",
    "zmp_of",
    "zmp_rows",
]
