"""What an executed motion must keep."""

from dataclasses import dataclass

import numpy as np

from manikin.requirement import Requirement, RequirementTable, requirement_table
from manikin.simulation import Execution
from manikin.simulation.pushed import BACK


@dataclass(frozen=True)
class ExecutionRequirements:
    """What an executed motion must keep to count as a success.

    Attributes:
        com_rms_error: Root mean square distance of the CoM from its plan [m].
        foot_error: Largest distance of an effector from its plan [m].
        margin: Least margin, exclusive [N.m].
        penetration: Deepest penetration of hard contacts [m]; ``padding_compression`` where the motion
            ends on a seat, whose impact shakes every contact.
        padding_compression: Deepest one of padded obstacles, which give way [m].
    """

    com_rms_error: float = 0.015
    foot_error: float = 0.02
    margin: float = 0.0
    penetration: float = 0.005
    padding_compression: float = 0.01

    def table(self, execution: Execution, seated: bool = False) -> RequirementTable:
        """Every requirement with its measured value.

        Where what was measured does not say when, the time is that of the least margin. A body that was
        pushed is out of balance and off its plan for a while; it has to be back on it at the end.

        Args:
            execution: What happened.
            seated: Whether the motion ends on a seat.
        """
        rest = self._followed(execution, seated) if execution.push is None else self._returned(execution)
        return requirement_table([*_kept_standing(execution), *rest])

    def _followed(self, execution: Execution, seated: bool) -> list[Requirement | None]:
        """Of a body that nothing disturbs."""
        deepest = self.padding_compression if seated else self.penetration
        thinnest = float(execution.motion.time[int(np.argmin(execution.motion.margin))])
        pressed = execution.max_padding_compression_m > 0.0
        return [
            Requirement("min_margin", "executed margin", execution.motion.margin_unit, execution.min_margin,
                        ">", self.margin, thinnest),
            Requirement("com_rms_error_m", "RMS error of the centre of mass", "m",
                        execution.com_rms_error_m, "<=", self.com_rms_error, thinnest),
            Requirement("max_foot_error_m", "error", "m", execution.max_foot_error_m, "<=", self.foot_error,
                        execution.worst_effector_time_s, execution.worst_effector),
            Requirement("max_penetration_m", "penetration", "m", execution.max_penetration_m, "<=", deepest,
                        thinnest),
            Requirement("max_padding_compression_m", "compression of padding", "m",
                        execution.max_padding_compression_m, "<=", self.padding_compression, thinnest)
            if pressed else None,
        ]  # fmt: skip

    def _returned(self, execution: Execution) -> list[Requirement | None]:
        """Of a body that was pushed: what it has to come back to."""
        push, end = execution.push, float(execution.motion.time[-1])
        if push is None:
            return []
        return [
            Requirement("final_com_error_m", "distance of the centre of mass from its plan at the end", "m",
                        execution.final_com_error_m, "<=", BACK, end),
            Requirement("max_foot_deviation_m", "distance of an effector from its plan at the end", "m",
                        push.max_foot_deviation_m, "<=", self.foot_error, end),
        ]  # fmt: skip


def _kept_standing(execution: Execution) -> list[Requirement]:
    """The body does not fall, and nothing touches that should not."""
    touches = execution.counted_touches
    first = touches[0] if touches else None
    return [
        Requirement("fell", "falls", "", float(execution.fell), "<=", 0.0,
                    execution.failure_time_s if execution.fell else None),
        Requirement("unplanned_touches", "unplanned touches", "", float(len(touches)), "<=", 0.0,
                    None if first is None else first.time,
                    "" if first is None else f"{first.segment} on {first.other}"),
    ]  # fmt: skip
