"""What an executed motion must keep."""

from dataclasses import dataclass

import numpy as np

from manikin.simulation import Execution


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

        Where what was measured does not say when, the time is that of the least margin.

        Args:
            execution: What happened.
            seated: Whether the motion ends on a seat.
        """
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
