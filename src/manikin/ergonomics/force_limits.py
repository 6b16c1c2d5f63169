"""Recommended force limits by EN 1005-3 ([EN1005-3]_): what a hand, an arm, a body or a foot should exert.

    F_Br = F_B m_v m_f m_d,        m_r = F / F_Br

``F_B`` is the isometric force that 85 % of those who use a machine for professional purposes have, or 99 % of
those who use it at home. The multipliers take off for movement, for how long and how often an action is done,
and for how long at a stretch; the risk ``m_r`` falls into three zones.

The printed standard was not at hand. The forces were taken from one source that quotes its table
([Ergonomiesite]_); the formula and the zones from two. Of the three tables of multipliers no source at hand
prints the values: they are what is known of the standard here, were not checked against anything, and
:attr:`ForceLimit.unverified` says so. :class:`ForceMultipliers` takes those of a printed copy instead.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from manikin.errors import InputError
from manikin.numerics.spatial import finite_number

BASIC_FORCES: Mapping[str, tuple[float, float]] = {
    "hand_grip": (250.0, 184.0),
    "arm_up": (50.0, 31.0),
    "arm_down": (75.0, 44.0),
    "arm_outward": (55.0, 31.0),
    "arm_inward": (75.0, 49.0),
    "arm_push_supported": (275.0, 186.0),
    "arm_push": (62.0, 30.0),
    "arm_pull_supported": (225.0, 169.0),
    "arm_pull": (55.0, 28.0),
    "body_push": (200.0, 119.0),
    "body_pull": (145.0, 96.0),
    "pedal_ankle": (250.0, 154.0),
    "pedal_leg": (475.0, 308.0),
}
"""Basic forces ``F_B`` of professional and of domestic use [N].

Power grip of one hand; work of one arm, seated, with and without support of the trunk; pushing and pulling
with the whole body, standing; a pedal, seated with support of the trunk, by the ankle and by the leg.
"""

MOVING = 0.8
"""Multiplier ``m_v`` of an action with an evident movement; 1 of none or a very slow one."""
BRIEF = 3.0
"""Longest time of a brief action [s]."""
FREQUENCIES = (0.2, 2.0, 20.0)
"""Largest frequencies of the first three columns of :data:`FREQUENCY` [1/min]."""
FREQUENCY: Mapping[bool, tuple[float, ...]] = {True: (1.0, 0.8, 0.5, 0.3), False: (0.6, 0.4, 0.2)}
"""Multipliers ``m_f`` of brief and of longer actions by frequency; longer ones cannot be done that often."""
DURATIONS = ((1.0, 1.0), (2.0, 0.8), (8.0, 0.5))
"""Longest durations of such actions at a stretch [h], and their multipliers ``m_d``."""

ZONES = {1: "recommended", 2: "not recommended", 3: "to be avoided"}
"""Meaning of the zones."""
RECOMMENDED, AVOIDED = 0.5, 0.7
"""Largest ``m_r`` of the first two zones."""


@dataclass(frozen=True)
class ForceMultipliers:
    """What takes off of a basic force, from above 0 to 1 each.

    Attributes:
        velocity: ``m_v``.
        frequency: ``m_f``.
        duration: ``m_d``.
        checked: Whether they are those of a printed copy of the standard.
    """

    velocity: float = 1.0
    frequency: float = 1.0
    duration: float = 1.0
    checked: bool = True

    def __post_init__(self) -> None:
        for name in ("velocity", "frequency", "duration"):
            finite_number(getattr(self, name), f"multiplier of the {name}", above=0.0, at_most=1.0)

    @property
    def product(self) -> float:
        """Of all three."""
        return self.velocity * self.frequency * self.duration


@dataclass(frozen=True)
class ForceLimit:
    """A force against its recommended limit.

    Attributes:
        activity: Key of :data:`BASIC_FORCES`.
        domestic: Whether the machine is used at home.
        force: What is exerted [N].
        multipliers: What takes off.
    """

    activity: str
    domestic: bool
    force: float
    multipliers: ForceMultipliers

    @property
    def basic(self) -> float:
        """``F_B`` [N]."""
        return BASIC_FORCES[self.activity][self.domestic]

    @property
    def limit(self) -> float:
        """Reduced force ``F_Br`` [N]."""
        return self.basic * self.multipliers.product

    @property
    def recommended(self) -> float:
        """Largest force of the recommended zone [N]."""
        return RECOMMENDED * self.limit

    @property
    def risk(self) -> float:
        """Risk multiplier ``m_r``."""
        return self.force / self.limit

    @property
    def zone(self) -> int:
        """Zone of the risk, a key of :data:`ZONES`."""
        return 1 + (self.risk > RECOMMENDED) + (self.risk > AVOIDED)

    @property
    def unverified(self) -> tuple[str, ...]:
        """Values in it that come from no source at hand, or from one alone."""
        return ("basic force",) if self.multipliers.checked else ("basic force", "multipliers")

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "activity": self.activity, "use": "domestic" if self.domestic else "professional",
            "force_N": self.force, "basic_N": self.basic,
            "multipliers": {
                name: getattr(self.multipliers, name) for name in ("velocity", "frequency", "duration")
            },
            "limit_N": self.limit, "recommended_N": self.recommended, "risk": self.risk, "zone": self.zone,
            "verdict": ZONES[self.zone], "unverified": list(self.unverified),
        }  # fmt: skip


def force_multipliers(
    *, moving: bool, action_time: float, per_minute: float, hours: float
) -> ForceMultipliers:
    """Multipliers of an action; see this module for how far they are to be trusted.

    Args:
        moving: Whether what is acted on evidently moves.
        action_time: How long the force is exerted at a time [s].
        per_minute: How often.
        hours: For how long such actions are done at a stretch [h].

    Raises:
        InputError: If a value is out of its range, or the action cannot be done that often.
    """
    finite_number(action_time, "time of an action [s]", at_least=0.0)
    finite_number(per_minute, "actions per minute", at_least=0.0)
    finite_number(hours, "hours of such actions", above=0.0, at_most=DURATIONS[-1][0])
    row = FREQUENCY[action_time <= BRIEF]
    column = sum(per_minute > most for most in FREQUENCIES)
    if column >= len(row):
        raise InputError(
            f"an action of {action_time:.1f} s is done {per_minute:g} times a minute; valid: up to "
            f"{FREQUENCIES[-1]:g} times, or {BRIEF:g} s"
        )
    duration = next(multiplier for most, multiplier in DURATIONS if hours <= most)
    return ForceMultipliers(MOVING if moving else 1.0, row[column], duration, checked=False)


def force_limit(
    force: float, activity: str, *, domestic: bool = False, multipliers: ForceMultipliers | None = None
) -> ForceLimit:
    """Compare a force with its recommended limit.

    Args:
        force: Exerted [N].
        activity: One of :data:`BASIC_FORCES`.
        domestic: Whether the machine is used at home.
        multipliers: What takes off; nothing when None: at rest, at most 0.2 brief actions a minute, no
            longer than an hour.

    Raises:
        InputError: If the force is negative or there is no such activity.
    """
    finite_number(force, "force [N]", at_least=0.0)
    if activity not in BASIC_FORCES:
        raise InputError(f"activity is {activity!r}; valid: {', '.join(BASIC_FORCES)}")
    return ForceLimit(activity, domestic, float(force), multipliers or ForceMultipliers())
