"""Return of a pushed body to its plan.

The capture point ``c = s + s' / w`` of the body is compared with that of the plan; ``e`` is their difference.
As long as ``|e|`` is small the plan is followed as ever. Beyond that two things change:

*The wish of the centre of mass.* Following the plan stiffly asks for a ZMP far beyond the soles. Instead the
wish is the ZMP that brings the capture point back to that of the plan at the rate ``k``, ``p = p_plan + (1 +
k / w) e``, kept within a distance beyond the support polygon: so much is left for arms and trunk.

*The time of the plan.* A plan that goes on takes its next foot off the ground whether the body stands well
or not. Its clock is stopped, over a short time, and goes on when ``e`` is small again; but only while all
feet are on the ground and both capture points well inside the polygon, so that body and plan can be stopped
as they stand, and not where the body is pushed ahead, the way of the plan.

Neither is done where the plan is brisk, as in the middle of a stride: it cannot be stopped there, and a body
that follows it stiffly was found to take more; nor with anything else than soles in contact. The polygon is
the hull of the soles that carry load, seen from above, and their mean height that of the ground.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from manikin.contact import ContactKind
from manikin.control.dynamics import DynamicsState
from manikin.control.recovery.standing import SupportArea
from manikin.control.reference import ReferenceSample
from manikin.control.settings import ReturnSettings
from manikin.control.supports import SupportMode, SupportState
from manikin.numerics.polytope import convex_polygon
from manikin.numerics.spatial import GRAVITY, FloatArray

LEAST_HEIGHT = 0.2
"""Least height of the centre of mass over the soles of a pendulum [m]."""

LEAST_SPEED = 0.05
"""Least speed of a plan that has a direction [m/s]."""


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far the body is from its plan.

    Attributes:
        error: (2,) its capture point less that of the plan [m].
        capture_point: (2,) its own [m].
        planned: (2,) that of the plan [m].
        area: Where the ZMP may be.
        frequency: ``w`` of the pendulum [1/s].
        ahead: Part of the error along the plan's way, relative to it.
        speed: Of the planned centre of mass, level [m/s].
        grounded: Whether every effector of the plan is on its support.
    """

    error: FloatArray
    capture_point: FloatArray
    planned: FloatArray
    area: SupportArea
    frequency: float
    ahead: float
    speed: float
    grounded: bool

    @property
    def size(self) -> float:
        """Length of the error [m]."""
        return float(np.linalg.norm(self.error))


def deviation_from_plan(
    state: DynamicsState, reference: ReferenceSample, supports: Mapping[str, SupportState]
) -> Deviation | None:
    """Compare the body with its plan; None where it does not stand on soles alone."""
    stances = [support for support in supports.values() if support.mode is SupportMode.STANCE]
    held = [support.contact for support in stances if support.contact is not None]
    if not held or any(contact.kind is not ContactKind.SOLE for contact in held):
        return None
    points = np.concatenate([contact.points_in_world for contact in held])
    corners, ground = convex_polygon(points[:, :2]), float(points[:, 2].mean())
    height = float(state.com[2]) - ground
    if len(corners) < 3 or height < LEAST_HEIGHT:
        return None
    frequency, velocity = float(np.sqrt(GRAVITY / height)), reference.com_velocity[:2]
    actual = state.com[:2] + state.momentum[:2] / state.mass / frequency
    planned = reference.com[:2] + velocity / frequency
    speed, error, grounded = float(np.linalg.norm(velocity)), actual - planned, len(stances) == len(supports)
    ahead = float(error @ velocity) / max(speed, LEAST_SPEED) / max(float(np.linalg.norm(error)), 1e-9)
    return Deviation(error, actual, planned, SupportArea(corners, ground), frequency, ahead, speed, grounded)


def returning_acceleration(
    wanted: FloatArray, state: DynamicsState, reference: ReferenceSample, deviation: Deviation,
    settings: ReturnSettings,
) -> FloatArray:  # fmt: skip
    """(3,) wanted acceleration of the centre of mass of a body that is off its plan [m/s^2].

    ``wanted`` (3,) is that of a body that follows its plan; upward it is kept.
    """
    share = settings.share(deviation.size, deviation.speed)
    square, area = deviation.frequency**2, deviation.area
    planned = reference.com[:2] - reference.com_acceleration[:2] / square
    zmp = planned + (1.0 + settings.rate / deviation.frequency) * deviation.error
    zmp = area.nearest(zmp, settings.sole_inset - settings.turning)
    law = wanted.copy()
    law[:2] = square * (state.com[:2] - zmp)
    return (1.0 - share) * wanted + share * law


class PlanClock:
    """The time of the plan, which stops while the body finds its way back.

    Attributes:
        waited: How long it has stood still so far [s].
        rate: Its speed relative to real time, in [0, 1].
    """

    def __init__(self, period: float, settings: ReturnSettings | None) -> None:
        """Start with real time, for control steps of a period [s]; without settings it never waits."""
        self.waited, self.rate = 0.0, 1.0
        self._period, self._settings = period, settings
        self._off = False

    def at(self, time: float) -> float:
        """Time of the plan at the time of a control step [s]."""
        return time - self.waited

    def next_rate(self, deviation: Deviation | None) -> float:
        """Rate at the end of the step that begins now."""
        settings = self._settings
        if settings is None:
            return 1.0
        size = 0.0 if deviation is None else deviation.size
        self._off = size > (settings.small if self._off else settings.large)
        stops = self._off and deviation is not None and self._may_stop(deviation, settings)
        step = self._period / settings.stopping_time
        return float(np.clip(0.0 if stops else 1.0, self.rate - step, self.rate + step))

    def advance(self, rate: float) -> None:
        """Let one step pass at whose end the rate is ``rate``."""
        self.waited += (1.0 - rate) * self._period
        self.rate = rate

    def _may_stop(self, deviation: Deviation, settings: ReturnSettings) -> bool:
        """Whether body and plan can be stopped here, and whether that helps."""
        area = deviation.area
        return (
            deviation.grounded
            and self.waited < settings.longest_wait
            and deviation.ahead <= settings.ahead
            and deviation.speed < settings.brisk
            and area.reach(deviation.capture_point) < 1.0
            and area.reach(deviation.planned) < settings.stoppable
        )
