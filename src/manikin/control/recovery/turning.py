"""How far arms, trunk and legs can help by turning: the bound of what is held without a step.

A linear inverted pendulum with a flywheel (Pratt et al. 2006, Stephens 2007) whose ZMP is at the edge ``p``
of the soles and whose flywheel is turned with the moment ``M`` has the capture point

    ``c' = w (c - p) - w M / (m g)``.

The flywheel has to stop before the ends of its range. Turning with ``M`` for the time ``t``, on with the
angular momentum ``L = M t`` for ``u``, and stopping with ``-M`` brings a capture point back to the edge from

    ``e = M / (m g) (1 - exp(-w t) - exp(-w (t + u)) (1 - exp(-w L / M)))``

at most, and takes ``M t^2 / 2 + L u + L^2 / (2 M)`` of the range. What a body can give is measured on it: the
moment by a linear program on its torques, contact forces and friction in the posture, angular momentum and
range by turning it as fast as its joints allow to their ends, feet and centre of mass in their places.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.body import integrate
from manikin.control.recovery.recovery_controller import BalanceRecovery
from manikin.control.recovery.standing import FeltPush, close_loop
from manikin.numerics.spatial import GRAVITY, FloatArray

TURN_STEP = 0.02
"""Time step of the turning by which range and angular momentum are measured [s]."""

LONGEST_TURN = 1.5
"""Time after which it is ended [s]; speeds of joints are some 10 rad/s and ranges some 2 rad."""


@dataclass(frozen=True)
class Turning:
    """How far a body can turn towards one side.

    Attributes:
        moment: Beyond what the ZMP gives [N.m].
        momentum: Largest angular momentum [kg.m^2/s].
        range: Integral of the angular momentum to the ends of the ranges [kg.m^2].
    """

    moment: float
    momentum: float
    range: float

    def excess(self, weight: float, frequency: float) -> float:
        """Farthest that a capture point outside the soles can be brought back from [m].

        For a body of a weight [N] whose pendulum has the frequency ``w`` [1/s].
        """
        if self.moment <= 0.0 or self.range <= 0.0:
            return 0.0
        longest = min(self.momentum / self.moment, np.sqrt(self.range / self.moment))
        time = np.linspace(0.0, longest, 400)[1:]
        momentum = self.moment * time
        coast = np.maximum(self.range - self.moment * time**2, 0.0) / momentum
        gained = 1.0 - np.exp(-frequency * time)
        lost = np.exp(-frequency * (time + coast)) * (1.0 - np.exp(-frequency * momentum / self.moment))
        # Less coasting than the range allows is never better: it only delays what is lost.
        return float(np.max(self.moment / weight * (gained - lost)))


def _moment(controller: BalanceRecovery, q: FloatArray, towards: FloatArray) -> float:
    """Largest moment beyond that of a ZMP at the edge, from the largest level acceleration back."""
    state = controller.evaluate(q, np.zeros(controller.body.nv))
    problem = controller.problem_at(state)
    program, loop = problem.program, problem.loop
    push_back = np.zeros(len(program.gradient))
    push_back[: loop.size] = towards @ loop.com.matrix[:2]
    level = np.zeros((1, len(push_back)))
    level[0, : loop.size] = loop.com.matrix[2]
    equal = program.equalities
    upper, lower = np.isfinite(program.rows_upper), np.isfinite(program.rows_lower)
    upper[:equal] = lower[:equal] = False
    result = linprog(
        push_back, A_ub=np.concatenate((program.rows[upper], -program.rows[lower])),
        b_ub=np.concatenate((program.rows_upper[upper], -program.rows_lower[lower])),
        A_eq=np.concatenate((program.rows[:equal], level)),
        b_eq=np.concatenate((program.rows_lower[:equal], -loop.com.offset[2:])),
        bounds=list(zip(program.lower, program.upper, strict=True)),
    )  # fmt: skip
    if not result.success:
        return 0.0
    height = controller.standing.height
    by_zmp = GRAVITY / height * float(np.max((controller.standing.area.corners - state.com[:2]) @ towards))
    beyond = -float(result.fun) - float(towards @ loop.com.offset[:2]) - by_zmp
    return max(0.0, state.mass * height * beyond)


def _turned(controller: BalanceRecovery, q: FloatArray, towards: FloatArray) -> tuple[float, float]:
    """Largest angular momentum on the way to the ends of the ranges, and its integral."""
    body, axis = controller.body, np.array([-towards[1], towards[0], 0.0])
    speed = controller.settings.strength * body.velocity_limit
    speed[controller.groups.locked(controller.settings.locked)] = 0.0
    momentum = travel = 0.0
    for _ in range(round(LONGEST_TURN / TURN_STEP)):
        state = controller.evaluate(q, np.zeros(body.nv))
        loop = close_loop(state, controller.standing.feet, FeltPush.none(body.nv))
        turns = axis @ state.centroidal_map[3:] @ loop.acceleration.matrix
        joints = loop.joints.matrix
        least = np.maximum(-speed, np.minimum(0.0, (body.lower - q[7:]) / TURN_STEP))
        most = np.minimum(speed, np.maximum(0.0, (body.upper - q[7:]) / TURN_STEP))
        result = linprog(
            -turns, A_ub=np.concatenate((joints, -joints)), b_ub=np.concatenate((most, -least)),
            A_eq=loop.com.matrix[:2], b_eq=np.zeros(2), bounds=(None, None),
        )  # fmt: skip
        if not result.success or -result.fun < 1e-3:
            break
        momentum, travel = max(momentum, -result.fun), travel - result.fun * TURN_STEP
        q = integrate(body, q, loop.acceleration.matrix @ result.x * TURN_STEP)
    return momentum, travel


@dataclass(frozen=True, eq=False)
class EdgeLimit:
    """How much one edge of the support area holds.

    Attributes:
        normal: (2,) unit, outward.
        turning: What the body can give against a fall over this edge.
        excess: How far outside it the capture point may be when the control begins [m].
        impulse: Largest impulse along the normal [N.s].
    """

    normal: FloatArray
    turning: Turning
    excess: float
    impulse: float

    def along(self, direction: float) -> float:
        """Largest impulse in a direction [rad] that this edge holds [N.s]; infinite away from it."""
        cosine = float(self.normal @ [np.cos(direction), np.sin(direction)])
        return self.impulse / cosine if cosine > 1e-9 else np.inf


def held_impulse(limits: Sequence[EdgeLimit], direction: float) -> float:
    """Upper bound of the impulse in a direction [rad] that is held without a step [N.s]."""
    return min(limit.along(direction) for limit in limits)


def edge_limits(controller: BalanceRecovery, q: ArrayLike, duration: float) -> tuple[EdgeLimit, ...]:
    """Upper bounds of what a posture (nq,) holds of a push of a duration [s] without a step, by support edge.

    The pendulum is pushed with a constant force. Until it reacts it has the spring of its ankles; over the
    side of two feet the stiffness of both legs, with which the ZMP can be at the edge at once, as with ankles
    of more than ``m g h`` per radian. Then its ZMP is at the edge and its flywheel turns. The mass stays as
    high as in the posture, and trunk and arms that turn down unload no ground: a body holds less.
    """
    posture = np.array(q, dtype=np.float64)
    weight = controller.body.mass * GRAVITY
    frequency = float(np.sqrt(GRAVITY / controller.standing.height))
    normals, offsets = controller.standing.area.half_planes()
    limits = []
    for normal, offset in zip(normals, offsets, strict=True):
        turning = Turning(_moment(controller, posture, normal), *_turned(controller, posture, normal))
        excess = turning.excess(weight, frequency)
        room = float(offset - normal @ controller.standing.com[:2])
        impulse = _impulse(controller, normal, room, excess, duration)
        limits.append(EdgeLimit(normal, turning, excess, impulse))
    return tuple(limits)


def _impulse(
    controller: BalanceRecovery, normal: FloatArray, room: float, excess: float, duration: float
) -> float:
    """Impulse that puts the capture point at an excess over an edge when the control begins [N.s]."""
    settings, feet = controller.settings, controller.standing.soles
    frequency = float(np.sqrt(GRAVITY / controller.standing.height))
    pull = 1.0 / (duration * controller.body.mass)
    pushed = min(duration, settings.delay)
    ahead = feet[0].rotation_contact_to_world[:2, 0]
    share = 0.5 * len(feet) * settings.ankle_stiffness
    start, zmp = np.zeros(2), 0.0
    sideways = len(feet) > 1 and abs(normal @ ahead) < np.sqrt(0.5)
    if sideways or share > 1.0:
        start, zmp, share = np.array([-room, 0.0]), room, 0.0
    # The excess is linear in the impulse: from its values without and with one of 1 N.s.
    values = []
    for impulse in (0.0, 1.0):
        state = _swayed(start, frequency, share, impulse * pull, pushed)
        state = _swayed(state, frequency, share, 0.0, settings.delay - pushed)
        left = impulse * pull / frequency**2 * (1.0 - np.exp(-frequency * (duration - pushed)))
        values.append(float(state[0] + state[1] / frequency + left + zmp - room))
    return (excess - values[0]) / (values[1] - values[0])


def _swayed(state: FloatArray, frequency: float, share: float, pull: float, time: float) -> FloatArray:
    """Displacement and speed (2,) after a time of a pendulum under an acceleration [m/s^2].

    Its ankles have a share of ``m g h`` per radian.
    """
    squared = frequency**2 * (1.0 - share)
    if abs(squared) < 1e-9:
        return np.array([state[0] + state[1] * time + 0.5 * pull * time**2, state[1] + pull * time])
    root = np.sqrt(complex(squared))
    away = state[0] + pull / squared
    ch, sh = np.cosh(root * time), np.sinh(root * time)
    return np.array([
        away * ch.real - pull / squared + (state[1] * sh / root).real,
        (away * root * sh).real + (state[1] * ch).real,
    ])  # fmt: skip
