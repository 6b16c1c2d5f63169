"""Recovery from pushes without a step: posture control and a quadratic program ([Kudoh2002]_)."""

from manikin.control.balance_recovery.closed_loop import ClosedLoop, FeltPush, LinearMap, close_loop
from manikin.control.balance_recovery.com_law import ComLaw, capture_point, com_law
from manikin.control.balance_recovery.joint_groups import JointGroups, joint_groups
from manikin.control.balance_recovery.posture_control import PostureControl, posture_control
from manikin.control.balance_recovery.problem import (
    JointBounds,
    Objective,
    RecoveryProblem,
    build_recovery_qp,
    leg_symmetry,
)
from manikin.control.balance_recovery.recovery import BalanceRecovery, RecoveryOutput
from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.balance_recovery.standing import Standing, sole_at
from manikin.control.balance_recovery.strategy import Strategy, StrategySwitch
from manikin.control.balance_recovery.support_area import SupportArea, zmp_of, zmp_rows
from manikin.control.balance_recovery.turning import EdgeLimit, Turning, edge_limits, held_impulse

__all__ = [
    "BalanceRecovery",
    "ClosedLoop",
    "ComLaw",
    "EdgeLimit",
    "FeltPush",
    "JointBounds",
    "JointGroups",
    "LinearMap",
    "Objective",
    "PostureControl",
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
