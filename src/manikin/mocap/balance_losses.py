"""Why a recorded person, who did not fall, has frames without a positive margin.

A low-pass spreads what happens at touch-down over a quarter of its period to either side, and supports are
known no better. A wrench that the stance before or after such a change admits is told from one that no
stance does; so are the ends of the recording, where derivatives look to one side only, and recordings that
say nothing about trunk or arms.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from manikin.contact import ContactSchedule
from manikin.mocap.recorded_dynamics import CUTOFF, RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins
from manikin.spatial import wrench_about


class Cause(StrEnum):
    """What a margin that is not positive is put down to."""

    CHANGE = "change of support"
    """The stance before or after a change within a quarter of the cutoff's period admits the wrench."""
    END = "end of the recording"
    """Half of the cutoff's period from the first or the last frame, or less."""
    FLIGHT = "flight"
    """Nothing supports."""
    UNTOLD = "untold trunk or arms"
    """No marker tells where a third of the body, or its arms, are."""
    MODEL = "model"
    """None of these: the body's masses, the soles, the recording."""


@dataclass(frozen=True)
class Loss:
    """A frame whose margin is not positive.

    Attributes:
        frame: Its index.
        time: On the clock of the stances [s].
        margin: [N.m].
        cause: What it is put down to.
    """

    frame: int
    time: float
    margin: float
    cause: Cause


def balance_losses(
    margins: RecordedMargins, dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0,
    neutral: Sequence[str] = (), cutoff: float = CUTOFF,
) -> tuple[Loss, ...]:  # fmt: skip
    """Every frame without a positive margin of the whole body, with its cause.

    Args:
        margins: Of the motion.
        dynamics: The motion.
        schedule: Its stances.
        start: The schedule's clock at the motion's first instant [s].
        neutral: Segments about which the recording says nothing.
        cutoff: Of the low-pass of the postures [Hz].
    """
    times, near = dynamics.time + start, 0.25 / cutoff
    untold = bool({"thorax", "left_upper_arm", "right_upper_arm"} & set(neutral))
    before, after = schedule.phase_at(times - near), schedule.phase_at(times + near)
    found = []
    for frame in np.flatnonzero(margins.whole_body <= 0.0).tolist():
        others = [margins.polytopes[k] for k in range(before[frame], after[frame] + 1)]
        wrench = dynamics.wrench[frame]
        if any(one is not None and one.margin(wrench_about(wrench, one.reference)) > 0.0 for one in others):
            cause = Cause.CHANGE
        elif margins.polytopes[int(margins.phase[frame])] is None:
            cause = Cause.FLIGHT
        elif min(times[frame] - times[0], times[-1] - times[frame]) <= 2.0 * near:
            cause = Cause.END
        else:
            cause = Cause.UNTOLD if untold else Cause.MODEL
        found.append(Loss(frame, float(times[frame]), float(margins.whole_body[frame]), cause))
    return tuple(found)


def share_by_cause(losses: Sequence[Loss], frames: int) -> dict[Cause, float]:
    """Share of all frames that each cause takes."""
    counts = Counter(loss.cause for loss in losses)
    return {cause: counts[cause] / frames for cause in Cause}
