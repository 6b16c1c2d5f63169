"""What became of a push during an execution: how far off its plan the body came, and when it was back."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manikin.motion import Motion
from manikin.simulation.recorder import Recorder
from manikin.simulation.world import Push
from manikin.spatial import FloatArray, rotation_from_quaternion, rotation_from_yaw

BACK = 0.02
"""A body whose centre of mass stays within this of its plan, to the end, is back on it [m]."""


PUSHED_SEGMENT = "thorax"
"""Segment on whose centre of mass a body on its way is pushed."""


@dataclass(frozen=True)
class PushOutcome:
    """What became of the pushes of an execution.

    Attributes:
        impulse_Ns: Of all of them, a sine's without regard to its sign [N.s].
        direction_deg: Of the first, counter-clockwise from the world's x axis [deg].
        at_s: When the first began [s].
        recovered: Whether the body came back on its plan, and nothing failed.
        max_deviation_m: Largest distance of the centre of mass from its plan since then [m].
        return_s: From the first push until the centre of mass is within :data:`BACK` of its plan for
            good [s]; None if it is not.
        waited_s: How long the plan waited for the body [s].
        max_foot_deviation_m: Largest distance of an effector from its plan at the end [m].
    """

    impulse_Ns: float
    direction_deg: float
    at_s: float
    recovered: bool
    max_deviation_m: float
    return_s: float | None
    waited_s: float
    max_foot_deviation_m: float

    def as_dict(self) -> dict[str, Any]:
        """The ``push`` block of the execution's summary."""
        return asdict(self)


def push_on_the_way(
    motion: Motion, force: float, direction: float, start: float, duration: float, frequency: float = 0.0
) -> Push:
    """Push on the thorax of a body that carries out a motion.

    Args:
        motion: What it carries out.
        force: Size [N]; of a sine its amplitude.
        direction: Counter-clockwise from the forward axis that the pelvis has in the plan then [deg].
        start: In the motion's time [s].
        duration: [s].
        frequency: Of a sine that begins with the push [Hz]; 0 for a constant force.
    """
    sample = min(int(np.searchsorted(motion.time, start)), len(motion.time) - 1)
    forward = rotation_from_quaternion(motion.q[sample : sample + 1, 3:7])[0][:, 0]
    heading = float(np.arctan2(forward[1], forward[0]))
    way = rotation_from_yaw(heading + np.deg2rad(direction))[:, 0]
    return Push(PUSHED_SEGMENT, force * way, start, duration, frequency=frequency)


def push_impulse(push: Push) -> float:
    """Impulse of a push without regard to the sign of a sine [N.s]."""
    size = float(np.linalg.norm(push.force))
    if push.frequency == 0.0:
        return size * push.duration
    half_waves, rest = divmod(2.0 * push.frequency * push.duration, 1.0)
    return size / (np.pi * push.frequency) * (half_waves + 0.5 * (1.0 - np.cos(np.pi * rest)))


def push_outcome(pushes: Sequence[Push], recorder: Recorder, failure: str) -> PushOutcome | None:
    """Say what became of the pushes; None without one.

    Args:
        pushes: What disturbed the execution.
        recorder: What happened.
        failure: Why the execution is no success; empty for one.
    """
    if not pushes:
        return None
    first = min(pushes, key=lambda push: push.start)
    since = np.array([sample.sensed.time for sample in recorder.samples]) - first.start
    errors = recorder.com_errors()
    back = None if failure else _return(since, errors)
    after = errors[since >= -1e-9]
    return PushOutcome(
        impulse_Ns=float(sum(push_impulse(push) for push in pushes)),
        direction_deg=float(np.degrees(np.arctan2(first.force[1], first.force[0]))),
        at_s=first.start,
        recovered=back is not None,
        max_deviation_m=float(after.max(initial=0.0)),
        return_s=back,
        waited_s=recorder.samples[-1].output.waited,
        max_foot_deviation_m=recorder.last_effector_error(),
    )


def _return(since: FloatArray, errors: FloatArray) -> float | None:
    """Time after which the errors stay small to the end [s]."""
    if errors[-1] > BACK:
        return None
    off = np.flatnonzero(errors > BACK)
    return 0.0 if not len(off) else float(max(0.0, since[off[-1] + 1]))
