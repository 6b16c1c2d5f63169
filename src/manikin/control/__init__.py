"""Control: weighted multi-task inverse dynamics that follows a planned motion."""

from manikin.control.build_qp import ControlProblem, QuadraticProgram, build_qp
from manikin.control.controller import Controller, ControlOutput
from manikin.control.force_wish import ForceWish
from manikin.control.settings import (
    ControlSettings,
    Impedance,
    Impedances,
    ReturnSettings,
    SupportSettings,
    TaskWeights,
)
from manikin.control.supports import SupportMode, SupportState
from manikin.control.tasks import AccelerationTask

__all__ = [
    "AccelerationTask",
    "ControlOutput",
    "ControlProblem",
    "ControlSettings",
    "Controller",
    "ForceWish",
    "Impedance",
    "Impedances",
    "QuadraticProgram",
    "ReturnSettings",
    "SupportMode",
    "SupportSettings",
    "SupportState",
    "TaskWeights",
    "build_qp",
]
