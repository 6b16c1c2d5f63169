"""What an executed motion must keep."""

from dataclasses import dataclass

import numpy as np

from manikin.simulation import Execution
from manikin.simulation.pushed import BACK, PushOutcome


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

    def violation(self, execution: Execution, seated: bool = False) -> tuple[str, float] | None:
        """Explain the first requirement that is not kept, with a time [s], or None.

        Where what was measured does not say when, the time is that of the least margin. A body that was
        pushed is out of balance and off its plan for a while; it has to be back on it at the end.

        Args:
            execution: What happened.
            seated: Whether the motion ends on a seat.
        """
        if execution.push is not None:
            return self._not_returned(execution, execution.push)
        penetration = self.padding_compression if seated else self.penetration
        thinnest = float(execution.motion.time[int(np.argmin(execution.motion.margin))])
        if execution.min_margin <= self.margin:
            return (
                f"executed margin falls to {execution.min_margin:.2f} N.m; allowed > {self.margin:g}",
                thinnest,
            )
        effector = f"error of {execution.worst_effector}"
        for value, limit, what, time in (
            (execution.com_rms_error_m, self.com_rms_error, "RMS error of the centre of mass", thinnest),
            (execution.max_foot_error_m, self.foot_error, effector, execution.worst_effector_time_s),
            (execution.max_penetration_m, penetration, "penetration", thinnest),
            (
                execution.max_padding_compression_m,
                self.padding_compression,
                "compression of padding",
                thinnest,
            ),
        ):
            if value > limit:
                return f"{what} is {value:.4f} m; allowed {limit:g} m", time
        return None

    def _not_returned(self, execution: Execution, push: PushOutcome) -> tuple[str, float] | None:
        """What a body that was pushed has not come back to, or None."""
        end = float(execution.motion.time[-1])
        if push.return_s is None and not execution.failure:
            error = execution.final_com_error_m
            return f"not back on its plan: the CoM ends {error:.3f} m from it; allowed {BACK:g} m", end
        if push.max_foot_deviation_m > self.foot_error:
            error = push.max_foot_deviation_m
            return f"an effector ends {error:.3f} m from its plan; allowed {self.foot_error:g} m", end
        return None
