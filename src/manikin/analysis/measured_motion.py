"""The motion that an analysis measures: the recorded one, or the nearest one that its contacts can carry."""

from dataclasses import dataclass

from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins
from manikin.mocap.shifted_motion import LeastShift


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """A recorded motion as it is, and shifted onto its contacts.

    Attributes:
        recorded: Smoothed, as recorded.
        recorded_margins: Of it.
        shifted: The motion nearest to it that its contacts can carry.
        believed: Whether that one is measured; if not, it was not wanted or does not lead to balance.
    """

    recorded: RecordedDynamics
    recorded_margins: RecordedMargins
    shifted: LeastShift
    believed: bool

    @property
    def dynamics(self) -> RecordedDynamics:
        """Of the motion that is measured."""
        return self.shifted.dynamics if self.believed else self.recorded

    @property
    def margins(self) -> RecordedMargins:
        """Of the motion that is measured."""
        return self.shifted.margins if self.believed else self.recorded_margins
