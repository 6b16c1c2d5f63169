"""Control: weighted multi-task inverse dynamics that follows a planned motion."""

from manikin.control.controller import Controller, ControlOutput
from manikin.control.estimate import StateNoise
from manikin.control.settings import (
    ControlSettings,
    ReturnSettings,
    ShiftSettings,
    SoleRoom,
    SupportSettings,
    TaskWeights,
)
from manikin.control.supports import SupportMode
from manikin.control.tasks import ForceWish

__all__ = [
    "ControlOutput", "ControlSettings", "Controller", "ForceWish", "ReturnSettings", "ShiftSettings",
    "SoleRoom", "StateNoise", "SupportMode", "SupportSettings", "TaskWeights",
]  # fmt: skip
