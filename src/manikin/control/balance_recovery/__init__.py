"""Recovery from pushes on both feet: posture control and a quadratic program ([Kudoh2002]_)."""

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
from manikin.control.balance_recovery.step_placement import StepGoal, StepSettings, capture_after, step_goals
from manikin.control.balance_recovery.stepping import SteppingRecovery, StepTaken
from manikin.control.balance_recovery.strategy import Strategy, StrategySwitch
from manikin.control.balance_recovery.support_area import SupportArea, zmp_of, zmp_rows

__all__ = [
    "BalanceRecovery",
    "ClosedLoop",
    "ComLaw",
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
    "StepGoal",
    "StepSettings",
    "StepTaken",
    "SteppingRecovery",
    "Strategy",
    "StrategySwitch",
    "SupportArea",
    "build_recovery_qp",
    "capture_after",
    "capture_point",
    "close_loop",
    "com_law",
    "joint_groups",
    "leg_symmetry",
    "posture_control",
    "sole_at",
    "step_goals",
    "zmp_of",
    "zmp_rows",
]
