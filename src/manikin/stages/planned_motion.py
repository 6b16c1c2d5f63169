"""A planned motion with its contacts in time, as it is handed to the physics engine."""

from dataclasses import dataclass

from manikin.acting import PlannedAct
from manikin.balance.contact_forces import friction_use
from manikin.contact import ContactSchedule
from manikin.motion import Motion


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """What is to be executed.

    Attributes:
        schedule: Contacts in time.
        motion: All joints.
        act: The act at the end of both, or None.
    """

    schedule: ContactSchedule
    motion: Motion
    act: PlannedAct | None = None

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.motion.time[-1])


def use_of_friction(schedule: ContactSchedule, motion: Motion) -> dict[str, float | str]:
    """Largest use of friction by the contact forces of a planned motion, for the run's summary."""
    return friction_use(schedule, motion.time, motion.contact_names, motion.contact_force).summary()
