"""Why a whole-body motion is no success."""

from dataclasses import dataclass

from manikin.contact import ContactSchedule


@dataclass(frozen=True)
class WholeBodyFailure:
    """Why no whole-body motion was found.

    Attributes:
        reason: What could not be met, in one line.
        time: When [s].
        where: The phase and what it stands on.
    """

    reason: str
    time: float
    where: str

    @classmethod
    def at(cls, schedule: ContactSchedule, time: float, reason: str) -> "WholeBodyFailure":
        """Failure at a time [s], with the phase that lasts then."""
        index = int(schedule.phase_at(time))
        held = ", ".join(schedule.sequence[index].stance.effectors) or "no contact"
        return cls(reason, time, f"phase {index} on {held}")
