"""The law of the centre of mass ([Kudoh2002]_ 2.45-2.48), and when angular momentum has done its work.

The thesis lets the centre of mass accelerate against its displacement and its speed. With the frequency
``w = sqrt(g / h)`` of a linear inverted pendulum, whose capture point ``c = s + s' / w`` obeys

    ``c' = w (c - p) - w L' / (m g)``

for the ZMP ``p`` and the angular momentum ``L`` towards the fall, such a law is the wish for a ZMP
``p = c + k / w (c - c0)``: it brings the capture point back at the rate ``k``,
``s'' = -w k s - (w + k) s'``. As long as that ZMP is over the soles nothing need turn.

Where it is not, arms and trunk have to turn, and before the ends of their ranges they have to stop. Turning
that is stopped by the moment ``M`` lasts ``L / M``, and with the ZMP at the edge it ends with the capture
point over the soles when it begins with the *settled point*

    ``c + M / (m g) (1 - exp(-w L / M))``

over them. While that is beyond the soles the law asks for turning, and once it is over them for stopping
it. The moment that stops it is what uses up the range ``R`` of arms and trunk that is left, ``M = L^2 / (2
R)``: stopping sooner and harder would throw the capture point out again. Where it would have to be large,
the law asks for stopping even if the capture point is not back: else the joints stop at their ends, all at
once. This part is ours; it is what a controller that looks no step ahead has in place of a plan.
"""

from dataclasses import dataclass

import numpy as np

from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.balance_recovery.support_area import SupportArea
from manikin.control.dynamics import DynamicsState
from manikin.spatial import GRAVITY, FloatArray

NEED = (0.85, 1.0)
"""Reaches of the settled point over the soles between which the law goes from stopping to turning."""

STOPPING = 0.1
"""The moment that stops the turning is at most the angular momentum over this time [s]."""

SLOW = 5.0
"""Angular momentum up to which the ends of the ranges are nothing to stop for [kg.m^2/s]."""


@dataclass(frozen=True, eq=False)
class ComLaw:
    """What the law asks for.

    Attributes:
        acceleration: (3,) of the centre of mass [m/s^2].
        settled: (2,) settled point [m].
        reach: Of the settled point over the soles: 1 at their edge.
        need: How much turning is needed, in [0, 1].
    """

    acceleration: FloatArray
    settled: FloatArray
    reach: float
    need: float


def fall_momentum(state: DynamicsState) -> FloatArray:
    """(2,) angular momentum about the horizontal axes, as the direction of the fall that it goes with."""
    return np.array([state.momentum[4], -state.momentum[3]])


def com_law(
    state: DynamicsState,
    home: FloatArray,
    area: SupportArea,
    settings: RecoverySettings,
    turned: FloatArray,
    *,
    may_turn: bool = True,
) -> ComLaw:
    """Find the wanted acceleration of the centre of mass.

    Args:
        state: Of the body.
        home: (3,) where the centre of mass shall be [m].
        area: Where the ZMP may be.
        settings: Gains.
        turned: (2,) integral over time of :func:`fall_momentum` [kg.m^2].
        may_turn: Whether arms and trunk may turn where the ZMP is not enough; otherwise they are stopped.
    """
    height, weight = home[2] - area.height, state.mass * GRAVITY
    frequency = np.sqrt(GRAVITY / height)
    velocity = state.momentum[:3] / state.mass
    momentum = fall_momentum(state)
    amount = float(np.linalg.norm(momentum))
    most = settings.turning * weight
    needed = _needed_braking(momentum, turned, settings.range * state.mass)
    brake = float(np.clip(needed, settings.least_braking * weight, most))
    settled = capture_point(state.com, velocity, height)
    if amount > 0.0:
        settled = settled + brake / weight * (1.0 - np.exp(-frequency * amount / brake)) * momentum / amount
    reach = area.reach(settled)
    need = float(np.clip((reach - NEED[0]) / (NEED[1] - NEED[0]), 0.0, 1.0))
    if not may_turn or (amount > SLOW and needed > settings.late_braking * weight):
        need = 0.0
    zmp = area.nearest(settled + settings.calm / frequency * (settled - home[:2]), settings.sole_inset)
    outward = settled - area.centre
    stopping = momentum / max(STOPPING, amount / brake)
    moment = need * most * outward / max(float(np.linalg.norm(outward)), 1e-9) - (1.0 - need) * stopping
    law = np.empty(3)
    law[:2] = frequency**2 * (state.com[:2] - zmp) - moment / (state.mass * height)
    law[2] = settings.height.stiffness * (home[2] - state.com[2]) - settings.height.damping * velocity[2]
    return ComLaw(law, settled, reach, need)


def _needed_braking(momentum: FloatArray, turned: FloatArray, reach: float) -> float:
    """Moment that stops the turning at the end of the range [N.m]; infinite where that is used up."""
    amount = float(np.linalg.norm(momentum))
    left = reach - float(turned @ momentum) / max(amount, 1e-9)
    return amount**2 / (2.0 * left) if left > 0.0 else np.inf


def capture_point(com: FloatArray, velocity: FloatArray, height: float) -> FloatArray:
    """(..., 2) where the pendulum would come to rest above a foot: ``s + s' / w`` [m].

    Args:
        com: (..., 3) centre of mass [m].
        velocity: (..., 3) its velocity [m/s].
        height: Of the pendulum [m].
    """
    return com[..., :2] + velocity[..., :2] * np.sqrt(height / GRAVITY)
