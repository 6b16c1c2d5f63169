"""The outcome of executing a motion in the physics engine."""

from dataclasses import dataclass
from typing import Any

from manikin.balance.contact_forces import FrictionUse
from manikin.contact import ContactSchedule
from manikin.display import Displayed
from manikin.motion import Motion
from manikin.simulation.pushed import PushOutcome
from manikin.simulation.world import Touch


@dataclass(frozen=True, eq=False, repr=False)
class Execution(Displayed):
    """An executed motion and how well it followed the plan.

    Attributes:
        motion: What happened, one sample per control step; ``tau`` are the joint torques
            held from the sample on, ``a`` and ``contact_force`` what the engine measured in
            the step's first millisecond, moments about the *planned* contact frame's origin,
            ``support`` where it presses, ``margin`` that of the measured wrench of all
            contacts, averaged over the control step, about the centre of mass, in the polytope
            of the contacts that really carried it.
        fell: Whether the body fell.
        failure: Why the run is no success, in one line; empty for a success.
        failure_time_s: When it failed [s], or None.
        com_rms_error_m: Of the distance from the planned CoM, over motion and hold, but only until
            the body sits down where it does [m].
        com_max_error_m: Largest such distance [m].
        max_foot_error_m: Largest distance of an effector of the schedule from its plan, but not of one
            that slides to its place on a seat [m].
        worst_effector: Which effector that is; empty without one.
        worst_effector_time_s: When [s].
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
        counted_touches: Those among them that are a failure: all but those of a pushed body with itself.
        fallbacks: Time [s] and reason of every control step whose program was not solved.
        max_slip_m: Farthest that an effector moved along its surface while in contact [m].
        push: What became of the pushes; None without one.
        friction: Largest use of friction by the forces that control counted on; None without control.
        schedule: When the planned contacts were due, later where the plan waited; None where it did not.
        min_force_at_com_N: Smallest force at the CoM that would have ended balance; None where none does [N].
        min_zmp_distance_m: Least distance of the measured ZMP to the edge of what carries, negative outside;
            None where it never spans one plane [m].
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

    @property
    def succeeded(self) -> bool:
        """Whether the body stood to the end without an unplanned touch."""
        return not self.failure

    def summary(self) -> dict[str, Any]:
        """The "execution" block of the run's summary."""
        names = (
            "fell", "com_rms_error_m", "com_max_error_m", "max_foot_error_m", "final_com_error_m",
            "min_margin", "min_force_at_com_N", "min_zmp_distance_m",
            "max_penetration_m", "max_padding_compression_m", "peak_torque_Nm",
            "realtime_factor", "wall_s",
        )  # fmt: skip
        block = {name: getattr(self, name) for name in names}
        block["friction"] = None if self.friction is None else self.friction.summary()
        block["unplanned_touches"] = [touch.as_dict() for touch in self.touches]
        block["push"] = None if self.push is None else self.push.as_dict()
        return block
