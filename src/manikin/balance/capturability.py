"""Leave a contact in motion: one convex test of the way of the centre of mass after it.

Who rises from a chair leaves it while the centre of mass is still behind the feet, and its speed carries it
over them.  The way from there to rest is a Bezier curve whose only free point is one of its inner ones, so
that the moment ``c x m (c'' - g)`` is linear in it and balance on the contacts that stay, at instants of the
way, is a linear program (CROC: Fernbach, Tonneau, Stasse, Carpentier and Taix 2020, IEEE T-RO 36:676).  Speed
at the start and duration are tried one after the other, the slowest first.  While the contact is still held,
more wrenches are admissible than without it: the test of the contacts that stay covers that instant as well.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import linprog

from manikin.balance.criteria import admissible_com_polygon, support_height
from manikin.balance.margin import wrench_levers
from manikin.balance.wrench import WrenchPolytope, wrench_polytope
from manikin.contact import Stance
from manikin.numerics.polytope import signed_distance
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array, skew
from manikin.numerics.spline import bernstein_matrix

FORWARD_SPEEDS = (0.0, 0.15, 0.3, 0.45, 0.6)  # level, at the start, up to that of people who rise [m/s]
UPWARD_SPEEDS = (0.0, 0.15, 0.3)  # upward speeds at the start that are tried [m/s]
DURATIONS = (1.6, 1.2, 0.9)  # of the way that are tried; people rise within 0.7 to 1.6 s from there [s]
MARGIN = 3.0  # least one of the way about the centre of mass, at 75 kg and 1.75 m [N.m]; our choice
STEEPEST_LIFT = 4.0  # largest vertical acceleration on the way [m/s^2]; people who rise reach 3; our choice
CARRIED_ROOM = 0.03  # how far outside of where it could rest the velocity may seem to carry the body [m]
SAMPLES = 12  # instants of the way at which balance is imposed
_DEGREE = 5


@dataclass(frozen=True, eq=False)
class Momentum:
    """Motion of the centre of mass at the instant at which a contact is left.

    Attributes:
        velocity: (3,) [m/s].
        acceleration: (3,) [m/s^2].
        duration: Of the way from there to rest [s].
        margin: Least margin on that way, about the centre of mass [N.m].
    """

    velocity: FloatArray
    acceleration: FloatArray
    duration: float
    margin: float

    @property
    def backwards(self) -> "Momentum":
        """The same motion backwards in time, with which a contact is made."""
        return replace(self, velocity=frozen_array(-self.velocity, "velocity", (3,)))


def momentum_to_rest(staying: Stance, mass: float, com: FloatArray, rest: FloatArray) -> Momentum | None:
    """Slowest motion with which contacts may be left at ``com``, to come to rest on the others.

    Args:
        mass: Of the body [kg].
        com: (3,) centre of mass at the start [m].
        rest: (3,) where it comes to rest, in balance there [m].

    Returns:
        The motion at the start; None where no speed leads to rest in balance.
    """
    polytope = wrench_polytope(staying.bounded(mass))
    ahead = (rest - com) * [1.0, 1.0, 0.0]
    ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
    resting = admissible_com_polygon(polytope, mass)
    height = max(float(com[2]) - support_height(staying), 0.0)
    for forward, upward, duration in product(FORWARD_SPEEDS, UPWARD_SPEEDS, DURATIONS):
        velocity = forward * ahead + upward * np.array([0.0, 0.0, 1.0])
        # Where the velocity would carry it must be where it can rest, or nearly so for a rising body.
        carried = com[:2] + velocity[:2] * np.sqrt(height / GRAVITY)
        if len(resting) < 3 or signed_distance(carried, resting) < -CARRIED_ROOM:
            continue
        way = _way(polytope, mass, com, velocity, rest, duration)
        if way is not None and way.margin >= MARGIN * mass / 75.0:
            return way
    return None


def _way(
    polytope: WrenchPolytope, mass: float, com: FloatArray, velocity: FloatArray, rest: FloatArray,
    duration: float,
) -> Momentum | None:  # fmt: skip
    """The way with the largest margin: points ``com, com + v T / 5, free, rest, rest, rest``."""
    origin = polytope.reference
    points = np.array([com, com + velocity * duration / _DEGREE, np.zeros(3), rest, rest, rest])
    points[[0, 1, 3, 4, 5]] -= origin
    share = np.linspace(0.0, 1.0, SAMPLES + 1)
    place = bernstein_matrix(_DEGREE, share)
    inner = np.pad(bernstein_matrix(_DEGREE - 2, share), ((0, 0), (2, 2)))
    bend = _DEGREE * (_DEGREE - 1) / duration**2 * np.diff(inner, n=2, axis=1)
    gravity = np.array([0.0, 0.0, -GRAVITY])
    rows, bounds = [], []
    for number, (at, turn) in enumerate(zip(place, bend, strict=True)):
        known, push = at @ points, turn @ points - gravity
        # c x b with c = known + at_2 y and b = push + turn_2 y: the product of y with itself is zero.
        force, moment = mass * turn[2] * np.eye(3), mass * (turn[2] * skew(known) - at[2] * skew(push))
        wrench = mass * np.concatenate([push, np.cross(known, push)])
        lever = wrench_levers(polytope.H, (known + at[2] * 0.5 * (points[1] + points[3]))[None])[0]
        rows.append(np.column_stack([polytope.H @ np.vstack([force, moment]), lever]))
        bounds.append(polytope.h - polytope.H @ wrench)
        lift = float(push[2]) - GRAVITY
        rows.append(np.array([[0.0, 0.0, turn[2], 0.0], [0.0, 0.0, -turn[2], 0.0]]))
        # At first it does not fall: legs too weak to rise could seem strong enough.
        bounds.append(np.array([STEEPEST_LIFT - lift, (STEEPEST_LIFT if number else 0.0) + lift]))
    solution = linprog(
        [0.0, 0.0, 0.0, -1.0], A_ub=np.vstack(rows), b_ub=np.concatenate(bounds),
        bounds=[(-2.0, 2.0)] * 3 + [(None, None)], method="highs",
    )  # fmt: skip
    if not solution.success:
        return None
    points[2] = solution.x[:3]
    start = frozen_array(bend[0] @ points, "acceleration", (3,))
    return Momentum(frozen_array(velocity, "velocity", (3,)), start, duration, float(solution.x[3]))
