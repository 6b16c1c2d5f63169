"""Control: weighted multi-task inverse dynamics that follows a planned motion."""

from manikin.control.build_qp import ControlProblem, build_qp
from manikin.control.controller import Controller, ControlOutput
from manikin.control.settings import (
    ControlSettings,
    Impedance,
    Impedances,
    ReturnSettings,
    SupportSettings,
    TaskWeights,
)
from manikin.control.supports import SupportMode, SupportState
from manikin.control.tasks import AccelerationTask, ForceWish

__all__ = [
    "AccelerationTask", "ControlOutput", "ControlProblem", "ControlSettings", "Controller", "ForceWish",
    "Impedance", "Impedances", "ReturnSettings", "SupportMode", "SupportSettings", "SupportState",
    "TaskWeights", "build_qp",
]  # fmt: skip
