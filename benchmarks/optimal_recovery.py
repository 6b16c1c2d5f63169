"""How hard a push could be held at best: optimal control of the body of Kudoh in the sagittal plane.

The whole motion after the reaction delay is optimised at once, with the force of the push as the objective:
left and right alike, soles flat on the ground, ZMP inside them, friction, torques, speeds and ranges of the
joints, and at rest in the end. The motion until the reaction is simulated. A controller that looks at one
instant cannot find it; it says how much there is to gain by looking ahead, and what arms are worth.

    python benchmarks/optimal_recovery.py [--direction 0|180] [--locked arms]

A run takes some minutes.
"""

import argparse
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, kudoh
from manikin.control.recovery import BalanceRecovery, RecoverySettings
from manikin.numerics.spatial import GRAVITY
from manikin.simulation import Feet, RecoveryTask, push_near_com, recover

JOINTS = (
    "ankle_dorsiflexion", "knee_flexion", "hip_flexion", "waist_flexion", "shoulder_flexion",
    "shoulder_abduction", "elbow_flexion",
)  # fmt: skip
"""Coordinates; those of both sides are equal."""

ARMS = slice(4, 7)
STEP, STEPS = 0.02, 60
"""Time step [s] and their number."""

PUSH, DELAY = 0.1, 0.2
"""Duration of the push and delay of the reaction [s]."""

FRICTION, LEAST_LOAD, INSET, FASTEST = 0.63, 0.1, 0.005, 500.0
"""Of the soles; of the weight, carried at least; of the ZMP [m]; largest acceleration [rad/s^2]."""

SAMPLES = (260.0, 320.0)
"""Forces between and beyond which the state at the reaction is linear [N]."""


@dataclass(frozen=True)
class Plane:
    """The body in the sagittal plane, its feet fixed, as functions of ``y, y', y''`` (7,) each.

    Attributes:
        ground: Moment of the ground about the origin [N.m], its vertical and forward force [N], torques (7,).
        lower, upper, speed, torque: (7,) limits; torques are of both sides together.
        heel, toe: Edges of the soles [m].
        weight: [N].
    """

    ground: ca.Function
    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    heel: float
    toe: float
    weight: float


def columns(body: BodyModel) -> list[list[int]]:
    """Hinges of each coordinate."""
    return [[i for i, name in enumerate(body.joint_names) if name.endswith(end)] for end in JOINTS]


def plane(body: BodyModel) -> Plane:
    """Derive the equations of motion from kinetic energy and momentum."""
    q0 = body.standing_posture()
    y, yd, ydd = (ca.SX.sym(name, len(JOINTS)) for name in ("y", "yd", "ydd"))
    angle = [ca.SX(float(value)) for value in q0[7:]]
    for k, hinges in enumerate(columns(body)):
        for i in hinges:
            angle[i] = y[k]
    segments = moving_segments(body, angle)
    mass = body.mass
    com = ca.SX.zeros(3)
    for m, _, _, centre in segments:
        com += m * centre / mass

    def rate(of: ca.SX) -> ca.SX:
        return ca.jtimes(of, y, yd)

    def rate_of_rate(of: ca.SX) -> ca.SX:
        return ca.jtimes(of, y, yd) + ca.jtimes(of, yd, ydd)

    com_velocity = rate(com)
    energy, momentum = ca.SX(0), ca.SX.zeros(3)
    for m, inertia, rotation, centre in segments:
        velocity = rate(centre)
        spin = ca.reshape(rate(ca.reshape(rotation, 9, 1)), 3, 3) @ rotation.T
        turn = ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0])
        spun = rotation @ (ca.SX(inertia) @ (rotation.T @ turn))
        energy += 0.5 * m * ca.dot(velocity, velocity) + 0.5 * ca.dot(turn, spun)
        momentum += m * ca.cross(centre - com, velocity - com_velocity) + spun
    acceleration = rate_of_rate(com_velocity)
    vertical, forward = mass * (GRAVITY + acceleration[2]), mass * acceleration[0]
    moment = com[0] * vertical - com[2] * forward - rate_of_rate(momentum[1])
    torque = (
        rate_of_rate(ca.gradient(energy, yd)) - ca.gradient(energy, y)
        + ca.gradient(mass * GRAVITY * com[2], y)
    )  # fmt: skip
    corners = BalanceRecovery(body, q0).area.corners[:, 0]
    first = [hinges[0] for hinges in columns(body)]
    sides = np.array([len(hinges) for hinges in columns(body)])
    return Plane(
        ca.Function("ground", [y, yd, ydd], [moment, vertical, forward, torque]),
        body.lower[first], body.upper[first], body.velocity_limit[first],
        sides * np.minimum(-body.torque_lower, body.torque_upper)[first],
        float(corners.min()), float(corners.max()), float(mass) * GRAVITY,
    )  # fmt: skip


def moving_segments(body: BodyModel, angle: list[ca.SX]) -> list[tuple[float, np.ndarray, ca.SX, ca.SX]]:
    """Mass, inertia (3, 3), rotation and centre of each segment with the left foot where it stands."""
    model, data, q0 = body.pinocchio, body.pinocchio.createData(), body.standing_posture()
    rotation, position = {1: ca.SX(np.eye(3))}, {1: ca.SX.zeros(3)}
    foot = 1
    for joint in range(2, model.njoints):
        hinge, parent, placed = model.joints[joint], model.parents[joint], model.jointPlacements[joint]
        motion = hinge.createData()
        hinge.calc(motion, np.zeros(1))
        axis = np.asarray(motion.S).reshape(6)[3:]
        index = hinge.idx_q - 7
        position[joint] = position[parent] + rotation[parent] @ ca.SX(placed.translation)
        turned = ca.SX(np.eye(3)) + ca.sin(angle[index]) * pin.skew(axis)
        turned += (1 - ca.cos(angle[index])) * (pin.skew(axis) @ pin.skew(axis))
        rotation[joint] = rotation[parent] @ ca.SX(placed.rotation) @ turned
        if body.joint_names[index].startswith("left_ankle"):
            foot = joint
    pin.forwardKinematics(model, data, q0)
    root = ca.SX(data.oMi[foot].rotation) @ rotation[foot].T
    origin = ca.SX(data.oMi[foot].translation) - root @ position[foot]
    return [
        (
            model.inertias[j].mass, np.asarray(model.inertias[j].inertia), root @ rotation[j],
            origin + root @ (position[j] + rotation[j] @ ca.SX(model.inertias[j].lever)),
        )
        for j in range(1, model.njoints) if model.inertias[j].mass > 0.0
    ]  # fmt: skip


def reacting(body: BodyModel, force: float, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (7,) and their speeds when the body reacts."""
    push = push_near_com(body, (force, 0.0, 0.0), 0.0, PUSH)
    found = recover(body, RecoveryTask((push,), Feet.FREE, delay + 0.02), RecoverySettings(delay=delay))
    motion = found.trace.motion
    row = int(np.argmin(np.abs(motion.time - delay)))
    angles, speeds = (
        np.array([values[row, skip + np.array(hinges)].mean() for hinges in columns(body)])
        for values, skip in ((motion.q, 7), (motion.v, 6))
    )
    return angles, speeds


def largest(body: BodyModel, sign: float, *, locked: bool, delay: float = DELAY) -> float:
    """Largest force that is held [N]; ``sign`` is 1 for a push from the back.

    Raises:
        RuntimeError: If the solver does not converge.
    """
    limits = plane(body)
    (y0, v0), (y1, v1) = (reacting(body, sign * force, delay) for force in SAMPLES)
    program = ca.Opti()
    force = program.variable()
    y, v = (program.variable(len(JOINTS), STEPS + 1) for _ in range(2))
    a = program.variable(len(JOINTS), STEPS)
    share = (force - SAMPLES[0]) / (SAMPLES[1] - SAMPLES[0])
    program.subject_to(y[:, 0] == y0 + share * (y1 - y0))
    program.subject_to(v[:, 0] == v0 + share * (v1 - v0))
    program.subject_to(ca.vec(v[:, 1:] - v[:, :-1] - STEP * a) == 0)
    program.subject_to(ca.vec(y[:, 1:] - y[:, :-1] - STEP * v[:, :-1] - 0.5 * STEP**2 * a) == 0)
    program.subject_to(v[:, -1] == 0)
    moment, vertical, forward, torque = limits.ground.map(STEPS)(y[:, :-1], v[:, :-1], a)
    weight = limits.weight
    program.subject_to((moment - (limits.toe - INSET) * vertical) / weight <= 0)
    program.subject_to((moment - (limits.heel + INSET) * vertical) / weight >= 0)
    program.subject_to(vertical / weight >= LEAST_LOAD)
    program.subject_to((forward - FRICTION * vertical) / weight <= 0)
    program.subject_to((forward + FRICTION * vertical) / weight >= 0)
    for i in range(len(JOINTS)):
        program.subject_to(program.bounded(limits.lower[i] - 1e-3, y[i, 1:], limits.upper[i] + 1e-3))
        program.subject_to(program.bounded(-limits.speed[i], v[i, 1:], limits.speed[i]))
        program.subject_to(program.bounded(-1, torque[i, :] / limits.torque[i], 1))
    program.subject_to(program.bounded(-FASTEST, ca.vec(a), FASTEST))
    if locked:
        program.subject_to(ca.vec(y[ARMS, 2:] - ca.repmat(y[ARMS, 1], 1, STEPS - 1)) == 0)
    program.minimize(-force / 100.0 + 1e-7 * ca.sumsqr(a))
    program.set_initial(force, SAMPLES[0])
    program.set_initial(y, np.repeat(y0[:, None], STEPS + 1, axis=1))
    options = {"print_level": 0, "sb": "yes", "max_iter": 1500, "tol": 1e-5, "mu_strategy": "adaptive"}
    program.solver("ipopt", {"expand": True, "print_time": False}, options)
    return float(program.solve().value(force))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Largest push of 0.1 s that can be held at best.")
    parser.add_argument("--direction", type=int, choices=(0, 180), default=0, help="of the push [deg]")
    parser.add_argument("--locked", choices=("arms",), help="joints that hold the posture")
    parser.add_argument("--delay", type=float, default=DELAY, help="of the reaction [s]")
    chosen = parser.parse_args()
    sign = 1.0 if chosen.direction == 0 else -1.0
    found = largest(kudoh(), sign, locked=chosen.locked is not None, delay=chosen.delay)
    print(f"{found:.0f} N, {PUSH * found:.1f} N.s")
