"""The outcome of executing a motion in the physics engine, and of pushes during it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manikin.balance.contact_forces import FrictionUse
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.runtime.display import Displayed
from manikin.simulation.carrying import Touch
from manikin.simulation.push_force import Push, push_impulse
from manikin.simulation.recorder import Recorder

BACK = 0.02
"""A body whose centre of mass stays within this of its plan, to the end, is back on it [m]."""

ARRIVED = 0.1
"""A disturbed body arrives that ends within this of where its plan did at first [m]; our choice."""


@dataclass(frozen=True)
class PushOutcome:
    """Outcome of the pushes of an execution.

    Attributes:
        impulse_Ns: Sum of all impulses, a sine's without regard to its sign [N.s].
        direction_deg: Direction of the first, counter-clockwise from the world's x axis [deg].
        at_s: When the first began [s].
        recovered: Whether the body came back on its plan, and nothing failed.
        max_deviation_m: Largest distance of the centre of mass from its plan since then [m].
        return_s: From the first push until the CoM is within :data:`BACK` of its plan for good [s], or None.
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


def push_outcome(pushes: Sequence[Push], recorder: Recorder, failure: str) -> PushOutcome | None:
    """Outcome of the pushes of a recorded execution, None without one; ``failure`` is empty for a success."""
    if not pushes:
        return None
    first = min(pushes, key=lambda push: push.start)
    since = np.array([sample.time for sample in recorder.samples]) - first.start
    errors, back = recorder.com_errors(), None
    if not failure and errors[-1] <= BACK:  # when the errors stay small to the end
        off = np.flatnonzero(errors > BACK)
        back = float(max(0.0, since[off[-1] + 1])) if len(off) else 0.0
    return PushOutcome(
        impulse_Ns=float(sum(push_impulse(push) for push in pushes)),
        direction_deg=float(np.degrees(np.arctan2(first.force[1], first.force[0]))), at_s=first.start,
        recovered=back is not None, max_deviation_m=float(errors[since >= -1e-9].max(initial=0.0)),
        return_s=back, waited_s=recorder.samples[-1].output.waited,
        max_foot_deviation_m=recorder.last_effector_error(),
    )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Execution(Displayed):
    """An executed motion and how well it followed the plan.

    Attributes:
        motion: Executed motion, one sample per control step; ``tau`` are the joint torques held from the
            sample on, ``a`` and ``contact_force`` measured in the step's first millisecond, moments about the
            origin of the *planned* contact frame, ``support`` where it presses, ``margin`` that of the mean
            wrench of all contacts over the step, about the CoM, in the polytope of those that carried it.
        fell: Whether the body fell.
        failure: Why the run is no success, in one line; empty for a success.
        failure_time_s: When it failed [s], or None.
        com_rms_error_m: RMS distance from the planned CoM, over motion and hold until it sits down [m].
        com_max_error_m: Largest such distance [m].
        max_foot_error_m: Largest distance of an effector from its plan; one that slides on a seat is out [m].
        worst_effector: Its name; empty without one.
        worst_effector_time_s: Its time [s].
        final_com_error_m: Distance of the CoM from its plan at the end of the hold [m].
        min_margin: Least wrench margin, about the CoM [N.m].
        max_penetration_m: Deepest penetration of any hard contact, at every engine step [m].
        max_padding_compression_m: How far the body sank into something padded [m].
        peak_torque_Nm: Largest absolute torque by joint [N.m].
        max_limit_use: Largest ratio of a joint's torque to its limit.
        realtime_factor: Simulated time per wall time.
        wall_s: Wall time [s].
        control_ms: Mean wall time of a control step [ms].
        touches: Touches that were not planned.
        counted_touches: Touches among them that are a failure: all but those of a pushed body with itself.
        fallbacks: Time [s] and reason of every control step whose program was not solved.
        max_slip_m: Farthest that an effector moved along its surface while in contact [m].
        push: Outcome of the pushes; None without one.
        friction: Largest use of friction by the forces that control counted on; None without control.
        schedule: When the planned contacts were due, later where the plan waited; None where it did not.
        min_force_at_com_N: Smallest force at the CoM that would have ended balance; None where none does [N].
        min_zmp_distance_m: Least distance of the ZMP to the edge of what carries, < 0 outside; or None [m].
        final_foot_error_m: Largest distance of an effector from its plan at the end of the hold [m].
        moved_m: How far the plan of a walk is moved at the end by steps that caught the body; distances from
            the plan are from the moved one [m].
    """

    motion: Motion
    fell: bool
    failure: str
    failure_time_s: float | None
    com_rms_error_m: float
    com_max_error_m: float
    max_foot_error_m: float
    worst_effector: str
    worst_effector_time_s: float
    final_com_error_m: float
    min_margin: float
    max_penetration_m: float
    max_padding_compression_m: float
    peak_torque_Nm: dict[str, float]
    max_limit_use: float
    realtime_factor: float
    wall_s: float
    control_ms: float
    touches: tuple[Touch, ...]
    counted_touches: tuple[Touch, ...]
    fallbacks: tuple[tuple[float, str], ...]
    max_slip_m: float
    push: PushOutcome | None = None
    schedule: ContactSchedule | None = None
    friction: FrictionUse | None = None
    min_force_at_com_N: float | None = None
    min_zmp_distance_m: float | None = None
    final_foot_error_m: float = 0.0
    moved_m: float = 0.0

    @property
    def succeeded(self) -> bool:
        """Whether the body stood to the end without an unplanned touch."""
        return not self.failure

    def summary(self) -> dict[str, Any]:
        """The "execution" block of the run's summary."""
        names = (
            "fell", "com_rms_error_m", "com_max_error_m", "max_foot_error_m", "final_com_error_m",
            "min_margin", "min_force_at_com_N", "min_zmp_distance_m", "max_penetration_m",
            "max_padding_compression_m", "peak_torque_Nm", "realtime_factor", "wall_s",
        )  # fmt: skip
        block = {name: getattr(self, name) for name in names}
        block["friction"] = None if self.friction is None else self.friction.summary()
        block["unplanned_touches"] = [touch.as_dict() for touch in self.touches]
        block["push"] = None if self.push is None else asdict(self.push)
        return block
