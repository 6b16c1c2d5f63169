"""The choice between posture control and the quadratic program ([Kudoh2002]_ 2.5.3)."""

from enum import StrEnum

from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.balance_recovery.support_area import SupportArea
from manikin.spatial import FloatArray


class Strategy(StrEnum):
    """What decides the joint torques."""

    STIFF = "stiff"
    """Muscles hold the posture as before the push: no reaction yet."""
    POSTURE = "posture"
    """Posture control."""
    PROGRAM = "program"
    """The quadratic program of the balance."""
    STEP = "step"
    """The same program while a foot steps."""


class StrategySwitch:
    """Chooses by the place of the centre of mass over the support area, with hysteresis."""

    def __init__(self, settings: RecoverySettings) -> None:
        """Begin with posture control."""
        self._settings = settings
        self._near = True

    def choose(self, com: FloatArray, settled: FloatArray, area: SupportArea) -> Strategy:
        """Choose for a centre of mass (3,) and where the capture point settles (2,) [m].

        The thesis looks at the centre of mass alone, and would hold the posture while a fast body passes the
        centre; both must be near it here.
        """
        settings = self._settings
        if settings.posture_control_only:
            return Strategy.POSTURE
        reach = max(area.reach(com[:2]), area.reach(settled))
        self._near = reach < (settings.outer if self._near else settings.inner)
        return Strategy.POSTURE if self._near else Strategy.PROGRAM
