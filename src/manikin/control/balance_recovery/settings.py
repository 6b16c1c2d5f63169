"""Weights, gains and limits of the recovery from pushes."""

from dataclasses import dataclass

from manikin.control.settings import Impedance
from manikin.errors import InputError
from manikin.spatial import finite_number

_HEIGHT, _UNWINDING = Impedance(20.0, 9.0), Impedance(4.0, 4.0)
_SWING = Impedance(900.0, 60.0)
_POSTURE, _STIFFNESS = Impedance(100.0, 20.0), Impedance(400.0, 40.0)


@dataclass(frozen=True)
class RecoverySettings:
    """Everything about the recovery that can be tuned; the thesis prints none of it but the delay.

    Attributes:
        period: Time between two control steps [s]; the thesis has 10 ms ([Kudoh2002]_ 3.2).
        delay: Time from the beginning of the first push until the control reacts [s] (3.2).
        com_weight: Of the squared error of that law against a squared joint acceleration; it bends where the
            limits leave no choice, where the thesis' equality would have no solution.
        calm: Rate at which the law of the centre of mass brings the capture point back [1/s]
            ([Kudoh2002]_ 2.45-2.48, see :mod:`manikin.control.balance_recovery.com_law`).
        turning: Largest moment with which arms and trunk turn where the ZMP is not enough, and are stopped
            again, in body weights [m].
        least_braking: Smallest moment with which they are stopped, in body weights [m].
        late_braking: Moment in body weights [m] beyond which the turning is stopped wherever the capture
            point is: otherwise the stops of the joints do it, all at once.
        range: How far arms, trunk and legs can turn: the integral over time of the angular momentum, for
            each kilogram of the body [m^2].
        least_load: The ground carries at least this share of the weight where that is possible: a body that
            lets itself drop has nothing to push against.
        stopping: Damping of all joints while the turning is stopped [1/s].
        height: Gains of the same law for the height.
        height_weight: Of the squared error of that law; 0, as in the thesis, leaves the height to ``upward``.
        arm_weight: Of a squared acceleration of an arm's joint, against 1 of any other: the diagonal of
            ``C_theta`` (2.27).
        trunk_weight: The same of a joint of the trunk: hips fold first, so that both come to the end of their
            range together.
        upward: Wanted acceleration of the centre of mass upward, as the slope of the objective (2.54).
        swing: Gains with which a stepping foot follows its way.
        swing_weight: Of its squared error, and of that of the pelvis' tilt meanwhile.
        unwinding: Of the objective's joint accelerations: they are measured from those that bring the joints
            gently back to the posture; the thesis has none, so that swung arms go on to their stops.
        posture: Largest gains of the posture control (2.65); their damping ratio is kept where they must
            be less.
        stiffness: With these gains muscles hold the posture before they react, and locked joints always.
        ankle_stiffness: Share of ``m g h`` per radian that both ankles have together before they react:
            the stiffness of calf muscles at rest, 0.64 to 0.91 of it (Casadio et al. 2005; Loram and Lakie
            2002), too little to stand without control.
        sole_inset: The ZMP is kept this far inside the edge of the soles [m].
        friction_share: Share of the friction of the soles that is made use of.
        inner, outer: Half sizes of the region in which posture control begins and of that in which it ends,
            as shares of the support area's half size about its centre ([Kudoh2002]_ Fig. 2.8). The gap
            between the two keeps the choice from chattering.
        posture_area: Posture control keeps the ZMP in this share of the support area about its centre, so
            that its own motion does not carry the body away.
        locked: Groups of joints that hold the posture whatever happens: ``"arms"``, ``"hips"``.
        posture_control_only: Whether the quadratic program is never chosen.
        strength: Torque and speed limits relative to the body's own.
        joint_limit_horizon: Joint angles and speeds must stay admissible over this time [s].
        max_joint_acceleration: No joint is accelerated faster than this [rad/s^2].
        solver: ``"daqp"``, ``"proxqp"`` or ``"piqp"``.
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
    inner: float = 0.7
    outer: float = 0.9
    posture_area: float = 0.9
    locked: tuple[str, ...] = ()
    posture_control_only: bool = False
    strength: float = 1.0
    joint_limit_horizon: float = 0.1
    max_joint_acceleration: float = 500.0
    solver: str = "daqp"

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
        if self.least_braking > self.turning:
            raise InputError(
                f"recovery least_braking is {self.least_braking:g}; valid: at most turning, {self.turning:g}"
            )
        if self.inner > self.outer:
            raise InputError(f"recovery inner is {self.inner:g}, outer {self.outer:g}; valid: inner <= outer")
        for name in self.locked:
            if name not in ("arms", "hips"):
                raise InputError(f"recovery locked has {name!r}; valid: arms, hips")
