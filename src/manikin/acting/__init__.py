"""Acts on objects: the posture that pushes or pulls with a wanted force, and what it can exert."""

from manikin.acting.act import Act, ActKind
from manikin.acting.approach import arrival, with_hands
from manikin.acting.brace import Brace, BraceResult, BraceSettings, find_brace
from manikin.acting.capacity import BracedForces, largest_force, share_force
from manikin.acting.hold import MeasuredAct, PlannedAct, Timing, measure_act, plan_act

__all__ = [
    "Act",
    "ActKind",
    "Brace",
    "BraceResult",
    "BraceSettings",
    "BracedForces",
    "MeasuredAct",
    "PlannedAct",
    "Timing",
    "arrival",
    "find_brace",
    "largest_force",
    "measure_act",
    "plan_act",
    "share_force",
    "with_hands",
]
