"""Recovery from pushes with steps: where a foot is put down, whether there is room, and how it gets there."""

from manikin.control.stepping.step_placement import StepSettings, capture_after, step_goals
from manikin.control.stepping.stepping import SteppingRecovery, StepTaken, SwingFoot

__all__ = ["StepSettings", "StepTaken", "SteppingRecovery", "SwingFoot", "capture_after", "step_goals"]
