"""Weights, gains and limits of the controller."""

import math
from dataclasses import dataclass, field
from typing import Protocol

from manikin.contact import BODY_WEIGHTS_CAP, Contact, SolePart
from manikin.control.estimate import StateNoise
from manikin.numerics.spatial import FloatArray, finite_number


@dataclass(frozen=True)
class TaskWeights:
    """Weights of squared acceleration errors ([Qiu2012]_ Table 6.1).

    Attributes:
        com: Centre of mass [1/(m/s^2)^2].
        effectors: Placement of feet and grasping hands; also the hinges of toes, with their
            feet's gains in flight and those of the posture on the ground.
        flying: Placement of effectors on their way, which count as much by default.
        pelvis: Orientation of the pelvis.
        posture: Each joint angle.
        angular_momentum: Rate of the angular momentum [1/(N.m)^2]; 0, as in the thesis, leaves it free.
        acceleration: Regularisation of every generalised acceleration.
        force: Regularisation of every edge force of the friction pyramids [1/N^2].
        planned_force: Distance of edge forces from those that make up the planned wrench, added to it where
            the plan has one [1/N^2].
    """

    com: float = 2e4
    effectors: float = 5e4
    flying: float = 5e4
    pelvis: float = 1e4
    posture: float = 10.0
    angular_momentum: float = 0.0
    acceleration: float = 1e-3
    force: float = 5e-3
    planned_force: float = 0.03

    def __post_init__(self) -> None:
        for name in ("com", "effectors", "flying", "pelvis", "posture", "angular_momentum", "planned_force"):
            finite_number(getattr(self, name), f"task weight {name!r}", at_least=0.0)
        for name in ("acceleration", "force"):
            finite_number(getattr(self, name), f"task weight {name!r}", above=0.0)


@dataclass(frozen=True)
class Impedance:
    """Feedback ``stiffness * error + damping * error_rate`` as an acceleration.

    Attributes:
        stiffness: [1/s^2].
        damping: [1/s]; critical is ``2 sqrt(stiffness)``.
    """

    stiffness: float
    damping: float

    def __post_init__(self) -> None:
        finite_number(self.stiffness, "impedance stiffness [1/s^2]", at_least=0.0)
        finite_number(self.damping, "impedance damping [1/s]", at_least=0.0)


@dataclass(frozen=True)
class Impedances:
    """Feedback gains of each task; the thesis tuned its own by hand and prints none (6.4.2).

    Attributes:
        arms: Of the angles of arms that the plan gives nothing to hold or carry. They are light: a forearm
            whose true centre of mass is 1 cm aside turns about itself by tenths of a radian.
    """

    com: Impedance = Impedance(225.0, 30.0)
    swing: Impedance = Impedance(400.0, 40.0)
    stance: Impedance = Impedance(100.0, 40.0)
    pelvis: Impedance = Impedance(100.0, 20.0)
    posture: Impedance = Impedance(100.0, 20.0)
    arms: Impedance = Impedance(400.0, 40.0)
    angular_momentum: Impedance = Impedance(0.0, 10.0)


@dataclass(frozen=True)
class SupportSettings:
    """How supports are switched on and off.

    Attributes:
        unload_time: The normal force's limit falls to zero over this time before lift-off [s].
        follow_time: The gains with which a foot follows its flight rise over this time after lift-off [s].
        load_time: The limit rises from zero over this time after touch-down [s].
        rolling_load_time: The same at points that a foot has rolled onto, slowly at first [s].
        early_window: A touch this long before the planned landing counts as the landing [s].
        release_time: A support that has not touched for this long is landed anew [s].
        hover: Before its landing a foot is held this far above its support, not to touch ahead of time [m].
        press_speed: It goes down at up to this speed, to ``press_depth``, to land at its time [m/s].
        press_time: That speed rises from zero over this time [s].
        rolling_press_speed: The same of a foot that lands on its heel, which this speed sets turning [m/s].
        press_depth: How far below the planned support it is sent at most [m].
        default_cap: Normal force limit of a contact that states none [body weights].
        sole_inset: The controller keeps its forces this far inside the edge of the sole [m].
        friction_share: Share of the friction of soles and points that it makes use of. The friction model is
            that of the plan, the inner pyramid where the plan has the outer one.
    """

    unload_time: float = 0.05
    follow_time: float = 0.04
    load_time: float = 0.04
    rolling_load_time: float = 0.08
    early_window: float = 0.1
    release_time: float = 0.03
    hover: float = 0.0015
    press_speed: float = 0.05
    rolling_press_speed: float = 0.04
    press_time: float = 0.03
    press_depth: float = 0.03
    default_cap: float = BODY_WEIGHTS_CAP
    sole_inset: float = 0.01
    friction_share: float = 1.0

    def __post_init__(self) -> None:
        positive = (
            "unload_time", "follow_time", "load_time", "rolling_load_time", "press_speed", "press_time",
            "rolling_press_speed", "default_cap", "friction_share",
        )  # fmt: skip
        for name in positive:
            finite_number(getattr(self, name), f"support setting {name!r}", above=0.0)
        for name in ("early_window", "release_time", "hover", "press_depth", "sole_inset"):
            finite_number(getattr(self, name), f"support setting {name!r}", at_least=0.0)

    def descent(self, contact: Contact | None, late: float) -> tuple[float, float]:
        """Way [m] and speed [m/s], which rises evenly, of a foot ``late`` [s] after it began to go down."""
        speed, rising = self._press_speed(contact), min(max(late, 0.0), self.press_time)
        share = rising / self.press_time
        return speed * (max(late, 0.0) - rising + 0.5 * share * rising), speed * share

    def lead(self, contact: Contact, height: float) -> float:
        """Time in which a foot goes down by a height [m] to its contact [s]."""
        ways = height / self._press_speed(contact)
        half = 0.5 * self.press_time
        return half + ways if ways > half else math.sqrt(2.0 * ways * self.press_time)

    def _press_speed(self, contact: Contact | None) -> float:
        rolls = contact is not None and contact.part is not SolePart.FULL
        return self.rolling_press_speed if rolls else self.press_speed


@dataclass(frozen=True)
class ReturnSettings:
    """When a body counts as pushed off its plan, and how it comes back; see ``manikin.control.plan_return``.

    Attributes:
        small: Deviation of the capture point up to which the plan is followed as ever [m].
        large: Deviation from which the law of the return holds alone, and the plan may wait [m].
        rate: At which the capture point is brought back [1/s].
        turning: How far beyond the soles the wanted ZMP may be; arms and trunk make up for it [m].
        sole_inset: The edge is this far inside the soles [m].
        ahead: The plan waits unless more than this share of the deviation is along its way.
        stoppable: Reach of the planned capture point over the polygon up to which a plan can be stopped.
        slow: Speed of the planned centre of mass up to which the law of the return holds [m/s].
        brisk: Speed from which it does not, and the plan does not wait, as in a stride [m/s].
        stopping_time: In which its clock comes to a stop, and is back at its speed [s].
        longest_wait: The plan waits no longer than this altogether [s].
    """

    small: float = 0.01
    large: float = 0.03
    rate: float = 6.0
    turning: float = 0.4
    sole_inset: float = 0.01
    ahead: float = 0.3
    stoppable: float = 0.5
    slow: float = 0.35
    brisk: float = 0.5
    stopping_time: float = 0.15
    longest_wait: float = 5.0

    def __post_init__(self) -> None:
        for name in ("small", "rate", "stoppable", "stopping_time"):
            finite_number(getattr(self, name), f"return setting {name!r}", above=0.0)
        for name in ("turning", "sole_inset", "ahead", "longest_wait"):
            finite_number(getattr(self, name), f"return setting {name!r}", at_least=0.0)
        finite_number(self.large, "return setting 'large'", above=self.small)
        finite_number(self.slow, "return setting 'slow'", at_least=0.0)
        finite_number(self.brisk, "return setting 'brisk'", above=self.slow)

    def share(self, deviation: float, speed: float) -> float:
        """Share in [0, 1] of the law of the return, by the deviation [m] and the planned speed [m/s]."""
        off = min(max((deviation - self.small) / (self.large - self.small), 0.0), 1.0)
        return off * min(max((self.brisk - speed) / (self.brisk - self.slow), 0.0), 1.0)


class SoleRoom(Protocol):
    """Room of soles beside what stands on the floor."""

    def beside(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """(n,) least distances of a sole that goes straight from a place (3,) to each of others (n, 3) [m].

        Places are x, y [m], yaw [rad].
        """
        ...


@dataclass(frozen=True)
class ShiftSettings:
    """When and how far the steps of a pushed walker are moved; see ``manikin.control.capture_step``.

    Attributes:
        threshold: Deviation of the capture point, on one foot, from which the plan takes it over [m].
        filtering: Time constant with which that deviation is smoothed [s]: landings and noise pass.
        ankle: How far the pressure under the standing foot is moved along it at most, to hold the body [m].
        ankle_across: The same across it [m].
        latest: A foot is not moved later than this before its landing [s].
        narrowest: Least distance of a moved landing from the standing foot, across that [m].
        widest: Largest such distance [m].
        longest: Largest distance along it [m].
        nearest: Least distance of a moved sole from what stands on the floor, also on its way, unless it has
            less unmoved [m].
        room: Measures that distance; None where nothing stands there.
    """

    threshold: float = 0.035
    filtering: float = 0.03
    ankle: float = 0.05
    ankle_across: float = 0.03
    latest: float = 0.08
    narrowest: float = 0.05
    widest: float = 0.5
    longest: float = 0.8
    nearest: float = 0.03
    room: SoleRoom | None = None

    def __post_init__(self) -> None:
        for name in ("threshold", "filtering", "ankle", "ankle_across", "latest", "widest", "longest"):
            finite_number(getattr(self, name), f"shift setting {name!r}", above=0.0)
        finite_number(self.nearest, "shift setting 'nearest'", at_least=0.0)
        finite_number(self.narrowest, "shift setting 'narrowest'", at_least=0.0, at_most=self.widest)


@dataclass(frozen=True)
class ControlSettings:
    """Everything about the controller that can be tuned.

    Attributes:
        period: Time between two steps [s]; torques are held in between ([Qiu2012]_ 6.4.2).
        weights: Weights of the tasks.
        impedances: Feedback gains of the tasks.
        supports: How supports are switched.
        joint_limit_horizon: Joint angles and speeds must stay admissible over this time [s].
        max_joint_acceleration: No joint is accelerated faster than this [rad/s^2].
        returning: What to do when the body is off its plan; None follows the plan as ever.
        stepping: How the steps of a walk are moved when the body is off its plan; None never moves them.
        delay: Time by which torques are believed to act later than they are asked for [s], until torques that
            are felt tell another one: they are those of the state that is foreseen for then.
        noise: Of the state that control is told, which is estimated then; without any it is believed.
        watch_toes: Whether toes that bounce off as a foot lands carry nothing until they are down again, and
            come down fast, by torques that know their inertia in the engine; for motions that land at speed.
        toes_back: Gains with which they come down: the edge behind their hinge jams on the floor. With four
            times the stiffness a walk at 1.5 m/s fell.
    """

    period: float = 0.005
    weights: TaskWeights = field(default_factory=TaskWeights)
    impedances: Impedances = field(default_factory=Impedances)
    supports: SupportSettings = field(default_factory=SupportSettings)
    joint_limit_horizon: float = 0.05
    max_joint_acceleration: float = 500.0
    returning: ReturnSettings | None = None
    stepping: ShiftSettings | None = None
    delay: float = 0.0
    noise: StateNoise = field(default_factory=StateNoise)
    watch_toes: bool = False
    toes_back: Impedance = Impedance(2500.0, 100.0)

    def __post_init__(self) -> None:
        for name in ("period", "joint_limit_horizon", "max_joint_acceleration"):
            finite_number(getattr(self, name), f"control setting {name!r}", above=0.0)
        finite_number(self.delay, "control setting 'delay'", at_least=0.0)
