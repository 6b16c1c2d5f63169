"""What a walk costs: time, accelerations and looking away from the goal ([Truong2010]_ 5.4-5.5)."""

from dataclasses import dataclass, fields

import numpy as np

from manikin.spatial import FloatArray, finite_number

TERMS = ("time", "forward", "lateral", "angular", "goal")
"""Names of the five terms, in the order of every vector of them."""

HOLONOMIC_ZONE = 0.5
"""Nearer goals are reached by stepping, without a look along the way [m] ([Truong2010]_ 4.6, Fig. 4.23)."""


@dataclass(frozen=True)
class WalkObjective:
    """``T + a1 int u_forward^2 + a2 int u_lateral^2 + a3 int u_angular^2 + a4 int w(r) psi^2`` (5.6).

    ``psi`` is the direction of the goal from the body's heading, in (-pi, pi] (5.7). At the goal it has no
    value, and the thesis does not say what it does there. Here it fades with the distance ``r`` of the goal
    as ``w = r^2 / (r^2 + goal_fade^2)``. The default lets the direction go within the radius in which the
    thesis' subjects stepped sideways without turning (4.6); a fade of a few centimetres gives the criterion
    as it is printed, under which a goal half a metre aside is approached in an arc.

    The defaults are the numbers of (5.8) in the order of the text of 5.5.1: lateral accelerations cost about
    1.5 times what forward ones do, angular ones less. Read literally, (5.5) and (5.8) swap the two:
    :data:`LITERAL_ORDER`.

    Attributes:
        time: a0 [1/s].
        forward: a1 [s^3/m^2].
        lateral: a2 [s^3/m^2].
        angular: a3 [s^3/rad^2].
        goal: a4 [1/(s rad^2)].
        goal_fade: Distance at which the goal term has faded to one half [m].
    """

    time: float = 1.0
    forward: float = 1.2
    lateral: float = 1.7
    angular: float = 0.7
    goal: float = 5.2
    goal_fade: float = HOLONOMIC_ZONE

    def __post_init__(self) -> None:
        for field in fields(self):
            name = field.name.replace("_", " ")
            value = getattr(self, field.name)
            if field.name == "goal":
                number = finite_number(value, f"walking weight {name}", at_least=0.0)
            else:
                number = finite_number(value, f"walking weight {name}", above=0.0)
            object.__setattr__(self, field.name, number)

    @property
    def weights(self) -> FloatArray:
        """(5,) weights in the order of :data:`TERMS`."""
        return np.array([self.time, self.forward, self.lateral, self.angular, self.goal])

    def straight_duration(self, distance: float) -> float:
        """Duration of the best walk straight ahead, ``(36 a1 d^2 / a0)^(1/4)`` [s]; its cost is 4/3 a0 T."""
        return float((36.0 * self.forward * distance**2 / self.time) ** 0.25)


PROSE_ORDER = WalkObjective()
"""The weights of (5.8) as the text of 5.5.1 explains them."""

LITERAL_ORDER = WalkObjective(lateral=0.7, angular=1.7)
"""The weights of (5.8) with u_1, u_2, u_3 as (5.5) names them."""

RECORDED_WALKS = WalkObjective(forward=4.4, lateral=2.7, angular=0.82, goal=1.2)
"""Identified from 42 recorded walks of all kinds at once, to two digits (``docs/inverse.md``); ours."""

RECORDED_TURNS = WalkObjective(forward=2.8, lateral=0.58, angular=0.63, goal=1.1)
"""Identified from the 15 of them in which somebody turns a corner, so that heading and way part; ours.

With these weights most walks to goals 1 to 3 m away begin and end holonomically, as those of the thesis'
subjects do (4.5); with the printed ones few do (``docs/patterns.md``)."""


def goal_direction(place: FloatArray, goal: FloatArray) -> FloatArray:
    """(n,) psi of (n, 3) places: direction of the goal from the heading, in (-pi, pi] [rad] (5.7)."""
    offset = goal[:2] - place[:, :2]
    cos, sin = np.cos(place[:, 2]), np.sin(place[:, 2])
    return np.arctan2(cos * offset[:, 1] - sin * offset[:, 0], cos * offset[:, 0] + sin * offset[:, 1])


def cost_rates(
    place: FloatArray, acceleration: FloatArray, goal: FloatArray, objective: WalkObjective
) -> FloatArray:
    """(n, 5) integrands of the terms, without their weights.

    Args:
        place: (n, 3) x, y [m], heading [rad].
        acceleration: (n, 3) forward, left [m/s^2], angular [rad/s^2].
        goal: (3,) x, y [m], heading [rad].
        objective: For its fade.
    """
    square = np.sum((goal[:2] - place[:, :2]) ** 2, axis=1)
    faded = square / (square + objective.goal_fade**2) * goal_direction(place, goal) ** 2
    return np.column_stack([np.ones(len(place)), acceleration**2, faded])
