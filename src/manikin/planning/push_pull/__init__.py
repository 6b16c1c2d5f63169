"""Acts on objects: the posture that pushes or pulls with a wanted force, and what it can exert."""

from manikin.planning.push_pull.act import Act, ActKind, BracedForces, largest_force, share_force
from manikin.planning.push_pull.act_execution import MeasuredAct, PlannedAct, Timing, measure_act, plan_act
from manikin.planning.push_pull.braced_posture import (
    Brace,
    BraceResult,
    BraceSettings,
    arrival,
    find_braced_posture,
    with_hands,
)

__all__ = [
    "Act", "ActKind", "Brace", "BraceResult", "BraceSettings", "BracedForces", "MeasuredAct", "PlannedAct",
    "Timing", "arrival", "find_braced_posture", "largest_force", "measure_act", "plan_act", "share_force",
    "with_hands",
]  # fmt: skip
