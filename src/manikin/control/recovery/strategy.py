"""Strategies of the recovery: posture control, and a law of the centre of mass ([Kudoh2002]_ 2.5).

The thesis lets the centre of mass accelerate against its displacement and its speed (2.45-2.48). With the
frequency ``w = sqrt(g / h)`` of a linear inverted pendulum, whose capture point ``c = s + s' / w`` obeys

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
R)``: stopping sooner and harder would throw the capture point out again. Where it would have to be large, the
law asks for stopping in any case: else the joints stop at their ends, all at once. This part is ours.

Near the centre of the soles posture control has the largest gains that keep the ZMP inside (2.5.2); farther
out the quadratic program is solved instead (2.5.3).
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from manikin.contact import FrictionModel
from manikin.control.dynamics import DynamicsState
from manikin.control.recovery.standing import ClosedLoop, LinearMap, SupportArea
from manikin.control.settings import Impedance
from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number


@dataclass(frozen=True, eq=False)
class PostureControl:
    """Answer of the posture control.

    Attributes:
        joints: (nv - 6,) joint accelerations [rad/s^2], nearest ones that leave the feet where they are.
        share: Of the largest damping, in [0, 1]; its square is that of the largest stiffness.
        inside: Whether it keeps the ZMP inside.
    """

    joints: FloatArray
    share: float
    inside: bool = True


def posture_control(
    loop: ClosedLoop, rows: LinearMap, stiff: FloatArray, damped: FloatArray, *, always: bool = False
) -> PostureControl | None:
    """Find the largest gains at which no row is positive, all reduced at the same damping ratio.

    With the share ``s`` of the damping and ``s^2`` of the stiffness the body comes back as with the largest
    gains, only ``1/s`` times more slowly: with equal shares of both, as in the thesis, it would sway. Every
    row is quadratic in ``s``, so that its borders are found in closed form.

    Args:
        loop: Maps at the state.
        rows: Not positive when the ZMP is inside.
        stiff: (nv - 6,) joint accelerations ``K_p e`` at the largest gains ([Kudoh2002]_ 2.65).
        damped: (nv - 6,) joint accelerations ``K_d e'`` at the largest gains.
        always: Where no share keeps the ZMP inside, whether to take the one at which it leaves least.

    Returns:
        None where no share in (0, 1] keeps the ZMP inside.
    """
    sought = np.column_stack((-loop.joints.offset, damped, stiff))
    powers = np.linalg.lstsq(loop.joints.matrix, sought, rcond=None)[0]
    values = rows.matrix @ powers
    values[:, 0] += rows.offset
    scale = 1e-12 * np.abs(values).sum(axis=1, keepdims=True)
    shares = _shares(values)
    inside = (np.max(_at(values, shares) - scale, axis=0) <= 0.0) & (shares > 0.0)
    if np.any(inside):
        share = float(shares[inside].max())
    elif always:
        pairs = np.triu_indices(len(values), 1)
        bent = values[:, 2] != 0.0
        turns = np.divide(-values[:, 1], 2.0 * values[:, 2], where=bent, out=np.zeros(len(values)))
        crossings = _shares(values[pairs[0]] - values[pairs[1]])
        shares = np.concatenate((shares, crossings, np.clip(turns, 0.0, 1.0)))
        share = float(shares[np.argmin(np.max(_at(values, shares), axis=0))])
    else:
        return None
    return PostureControl(loop.joints(powers @ share ** np.arange(3)), share, bool(np.any(inside)))


def _shares(values: FloatArray) -> FloatArray:
    """0, 1 and the zeros between them of polynomials ``a + b s + c s^2`` (m, 3)."""
    a, b, c = values.T
    far = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b**2 - 4.0 * a * c, 0.0)), b))
    with np.errstate(divide="ignore", invalid="ignore"):
        zeros = np.concatenate((far / c, a / far))
    return np.concatenate(([0.0, 1.0], zeros[(zeros > 0.0) & (zeros < 1.0)]))


def _at(values: FloatArray, shares: FloatArray) -> FloatArray:
    """(m, n) values of polynomials (m, 3) at n shares."""
    return values @ np.power.outer(shares, np.arange(3)).T


_HEIGHT, _UNWINDING, _SWING = Impedance(20.0, 9.0), Impedance(4.0, 4.0), Impedance(900.0, 60.0)
_POSTURE, _STIFFNESS = Impedance(100.0, 20.0), Impedance(400.0, 40.0)


@dataclass(frozen=True)
class RecoverySettings:
    """Everything about the recovery that can be tuned; the thesis prints none of it but the delay.

    Attributes:
        period: Time between two control steps [s]; the thesis has 10 ms ([Kudoh2002]_ 3.2).
        delay: Time from the beginning of the first push until the control reacts [s] (3.2).
        com_weight: Weight of the squared error of :func:`com_law`, which the thesis has as an equality.
        calm: Rate at which that law brings the capture point back [1/s] (2.45-2.48).
        turning: Largest moment that turns arms and trunk, and stops them again, in body weights [m].
        least_braking: Smallest moment with which they are stopped, in body weights [m].
        late_braking: Moment in body weights [m] beyond which turning is stopped, or the joints' ends do it.
        range: Integral over time of the angular momentum that limbs and trunk can have, by the mass [m^2].
        friction_model: Friction model of the soles, of margins; control stays inside the cone.
        least_load: Share of the weight that the ground carries where that is possible, to push against.
        stopping: Damping of all joints while the turning is stopped [1/s].
        height: Gains of the same law for the height.
        height_weight: Weight of its squared error; 0, as in the thesis, leaves the height to ``upward``.
        arm_weight: Weight of an arm joint's squared acceleration, 1 of any other: of ``C_theta`` (2.27).
        trunk_weight: The same of the trunk: hips fold first, so that both ranges end together.
        upward: Slope of the objective by the upward acceleration of the centre of mass (2.54).
        swing: Gains with which a stepping foot follows its way.
        swing_weight: Weight of its squared error, and of that of the pelvis' tilt meanwhile.
        unwinding: Gains back to the posture, from which the objective is measured; the thesis has none.
        posture: Largest gains of the posture control (2.65); less of them at the same damping ratio.
        stiffness: Gains with which muscles hold the posture before they react, and locked joints always.
        ankle_stiffness: Share of ``m g h`` per radian that both ankles have together before they react: calf
            muscles at rest have 0.64 to 0.91 of it (Casadio et al. 2005; Loram and Lakie 2002).
        sole_inset: The ZMP is kept this far inside the edge of the soles [m].
        friction_share: Share of the friction of the soles that is made use of.
        inner, outer: Half sizes of the regions in which posture control begins and ends, as shares of the
            support area's half size about its centre (Fig. 2.8); the gap keeps the choice from chattering.
        posture_area: Share of the support area about its centre in which posture control keeps the ZMP.
        locked: Groups of joints that hold the posture whatever happens: ``"arms"``, ``"hips"``.
        posture_control_only: Whether the quadratic program is never chosen.
        strength: Torque and speed limits relative to the body's own.
        joint_limit_horizon: Joint angles and speeds must stay admissible over this time [s].
        max_joint_acceleration: No joint is accelerated faster than this [rad/s^2].
    """

    period: float = 0.005
    delay: float = 0.2
    com_weight: float = 1e4
    calm: float = 5.37
    turning: float = 0.3
    least_braking: float = 0.1
    late_braking: float = 0.3
    range: float = 0.2
    least_load: float = 0.15
    stopping: float = 10.0
    height: Impedance = _HEIGHT
    height_weight: float = 220.0
    arm_weight: float = 0.03
    trunk_weight: float = 3.0
    upward: float = 1.0
    swing: Impedance = _SWING
    swing_weight: float = 1e3
    unwinding: Impedance = _UNWINDING
    posture: Impedance = _POSTURE
    stiffness: Impedance = _STIFFNESS
    ankle_stiffness: float = 0.64
    sole_inset: float = 0.005
    friction_share: float = 0.9
    friction_model: FrictionModel = "outer"
    inner: float = 0.7
    outer: float = 0.9
    posture_area: float = 0.9
    locked: tuple[str, ...] = ()
    posture_control_only: bool = False
    strength: float = 1.0
    joint_limit_horizon: float = 0.1
    max_joint_acceleration: float = 500.0

    def __post_init__(self) -> None:
        positive = (
            "period", "com_weight", "friction_share", "inner", "outer", "posture_area", "strength",
            "joint_limit_horizon", "max_joint_acceleration", "turning", "least_braking", "range",
            "arm_weight", "trunk_weight", "late_braking",
        )  # fmt: skip
        for name in positive:
            finite_number(getattr(self, name), f"recovery {name}", above=0.0)
        for name in ("delay", "upward", "sole_inset", "ankle_stiffness"):
            finite_number(getattr(self, name), f"recovery {name}", at_least=0.0)
        if (least := self.least_braking) > self.turning:
            raise InputError(f"recovery least_braking is {least:g}; valid: at most turning, {self.turning:g}")
        if self.inner > self.outer:
            raise InputError(f"recovery inner is {self.inner:g}, outer {self.outer:g}; valid: inner <= outer")
        for name in self.locked:
            if name not in ("arms", "hips"):
                raise InputError(f"recovery locked has {name!r}; valid: arms, hips")


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
        self._settings, self._near = settings, True

    def choose(self, com: FloatArray, settled: FloatArray, area: SupportArea) -> Strategy:
        """Choose for a centre of mass (3,) and where the capture point settles (2,) [m].

        The thesis looks at the first alone, and would hold the posture while a fast body passes the centre.
        """
        settings = self._settings
        if settings.posture_control_only:
            return Strategy.POSTURE
        reach = max(area.reach(com[:2]), area.reach(settled))
        self._near = reach < (settings.outer if self._near else settings.inner)
        return Strategy.POSTURE if self._near else Strategy.PROGRAM


NEED = (0.85, 1.0)
"""Reaches of the settled point over the soles between which the law goes from stopping to turning."""

STOPPING = 0.1
"""The moment that stops the turning is at most the angular momentum over this time [s]."""

SLOW = 5.0
"""Angular momentum up to which the ends of the ranges are nothing to stop for [kg.m^2/s]."""


@dataclass(frozen=True, eq=False)
class ComLaw:
    """Answer of the law of the centre of mass.

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
    state: DynamicsState, home: FloatArray, area: SupportArea, settings: RecoverySettings, turned: FloatArray,
    *, may_turn: bool = True,
) -> ComLaw:  # fmt: skip
    """Find the wanted acceleration of the centre of mass.

    Args:
        home: (3,) centre of mass to return to [m].
        area: Admissible area of the ZMP.
        turned: (2,) integral over time of :func:`fall_momentum` [kg.m^2].
        may_turn: Whether arms and trunk may turn where the ZMP is not enough; otherwise they are stopped.
    """
    height, weight = home[2] - area.height, state.mass * GRAVITY
    frequency = np.sqrt(GRAVITY / height)
    velocity = state.momentum[:3] / state.mass
    momentum = fall_momentum(state)
    amount, most = float(np.linalg.norm(momentum)), settings.turning * weight
    # What stops the turning at the end of the range [N.m]; infinite where that is used up.
    left = settings.range * state.mass - float(turned @ momentum) / max(amount, 1e-9)
    needed = amount**2 / (2.0 * left) if left > 0.0 else np.inf
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


def capture_point(com: FloatArray, velocity: FloatArray, height: float) -> FloatArray:
    """(..., 2) capture point ``s + s' / w`` of centres of mass (..., 3) at a height over the ground [m]."""
    return com[..., :2] + velocity[..., :2] * np.sqrt(height / GRAVITY)
