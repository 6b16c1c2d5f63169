"""Tasks of the controller: wanted accelerations and forces ([Qiu2012]_ 6.3).

Accelerations, linear in the generalised one, follow references by the impedance law ``reference acceleration
+ stiffness * error + damping * error rate``. A force is what an effector in contact should feel.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pinocchio as pin

from manikin.contact import ContactKind
from manikin.control.dynamics import DynamicsState, FrameState
from manikin.control.reference import EffectorReference, ReferenceSample
from manikin.control.settings import Impedance
from manikin.control.supports import SupportMode, SupportState
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array, skew


@dataclass(frozen=True, eq=False)
class ForceWish:
    """Force of the scene on one effector that rises from nothing and is held.

    Attributes:
        effector: Name of an effector of the schedule.
        force: (3,) when it is held [N].
        start: When it begins to rise [s].
        ramp: How long it rises [s].
        weight: Of its squared error beside the tasks of the controller [1/N^2]; our choice.
    """

    effector: str
    force: FloatArray
    start: float
    ramp: float
    weight: float = 10.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", frozen_array(self.force, "wished force [N]", (3,)))
        for name in ("ramp", "weight"):
            finite_number(getattr(self, name), f"force wish {name}", above=0.0)

    def at(self, time: float) -> FloatArray:
        """(3,) force at a time [N]; it rises without a jump of its rate."""
        share = min(max((time - self.start) / self.ramp, 0.0), 1.0)
        return share * share * (3.0 - 2.0 * share) * self.force


@dataclass(frozen=True, eq=False)
class AccelerationTask:
    """Cost ``weight * |matrix @ a - target|^2`` on the generalised acceleration ``a``.

    Attributes:
        name: What it does, such as ``"com"`` or ``"left_foot"``.
        matrix: (k, nv).
        target: (k,) wanted value of ``matrix @ a``.
        weight: (k,) not negative.
    """

    name: str
    matrix: FloatArray
    target: FloatArray
    weight: FloatArray

    def residual(self, acceleration: FloatArray) -> FloatArray:
        """(k,) error ``matrix @ a - target`` at the acceleration (nv,)."""
        return self.matrix @ acceleration - self.target


def com_task(
    state: DynamicsState, reference: ReferenceSample, gains: Impedance, weight: float
) -> AccelerationTask:
    """Follow the centre of mass in position, velocity and acceleration."""
    error, rate = reference.com - state.com, reference.com_velocity - state.momentum[:3] / state.mass
    wanted = reference.com_acceleration + gains.stiffness * error + gains.damping * rate
    matrix = state.centroidal_map[:3] / state.mass
    return AccelerationTask("com", matrix, wanted - state.momentum_drift[:3] / state.mass, _even(weight, 3))


def angular_momentum_task(
    state: DynamicsState, reference: ReferenceSample, gains: Impedance, weight: float
) -> AccelerationTask:
    """Follow the angular momentum about the centre of mass; only ``gains.damping`` acts."""
    error, rows = reference.angular_momentum - state.momentum[3:], state.centroidal_map[3:]
    target = reference.angular_momentum_rate + gains.damping * error - state.momentum_drift[3:]
    return AccelerationTask("angular_momentum", rows, target, _even(weight, 3))


def orientation_task(
    name: str, frame: FrameState, reference: EffectorReference, gains: Impedance, weight: float
) -> AccelerationTask:
    """Follow the orientation of a frame ("Basin" of [Qiu2012]_ Table 6.1)."""
    error, rate = orientation_error(reference.rotation, frame.rotation), reference.twist[3:] - frame.twist[3:]
    wanted = reference.acceleration[3:] + gains.stiffness * error + gains.damping * rate
    return AccelerationTask(name, frame.jacobian[3:], wanted - frame.drift[3:], _even(weight, 3))


def swing_task(
    name: str, frame: FrameState, reference: EffectorReference, gains: Impedance, weight: float,
    follow: float = 1.0, *, point: bool = False,
) -> AccelerationTask:  # fmt: skip
    """Follow placement, twist and acceleration of a flying effector; the gains times ``follow``.

    What touches in a point follows its place alone: a leg of three joints has no attitude of its own.
    """
    turn = orientation_error(reference.rotation, frame.rotation)
    error, rate = np.concatenate((reference.position - frame.position, turn)), reference.twist - frame.twist
    wanted = reference.acceleration + follow * gains.stiffness * error + follow * gains.damping * rate
    rows = 3 if point else 6
    return AccelerationTask(name, frame.jacobian[:rows], (wanted - frame.drift)[:rows], _even(weight, rows))


def lifted(reference: EffectorReference, support: SupportState) -> EffectorReference:
    """Reference of a flying effector with the support's lift on top."""
    twist = reference.twist.copy()
    twist[:3] += support.lift_rate
    return replace(reference, position=reference.position + support.lift, twist=twist)


def landing_reference(support: SupportState, planned: EffectorReference) -> EffectorReference:
    """Reference of an effector that is due to touch and does not: as planned, but on along the normal."""
    contact = support.contact
    if contact is None or support.mode is not SupportMode.LANDING:
        raise ValueError(f"{support.effector} is in {support.mode}; valid: a landing effector")
    twist = planned.twist.copy()
    twist[:3] -= support.press_rate * contact.normal
    return replace(planned, position=planned.position - support.press * contact.normal, twist=twist)


def rolling_task(
    name: str, frame: FrameState, reference: EffectorReference, support: SupportState, gains: Impedance,
    weight: float,
) -> AccelerationTask:  # fmt: skip
    """Let a foot tilt as planned about the part of its sole that touches.

    The planned twist turns about that part, which itself has no velocity in it. As in :func:`stance_task`, of
    the placement only the orientation is fed back. Before its planned landing the foot keeps its tilt.
    """
    wanted = -gains.damping * frame.twist
    if support.planned:
        wanted = reference.acceleration + gains.damping * (reference.twist - frame.twist)
        wanted[3:] += gains.stiffness * orientation_error(reference.rotation, frame.rotation)
    return AccelerationTask(name, frame.jacobian, wanted - frame.drift, _even(weight, 6))


def stance_task(
    name: str, frame: FrameState, support: SupportState, gains: Impedance, weight: float
) -> AccelerationTask:
    """Keep an effector in contact where it landed, turning its sole into the surface.

    The velocity is damped to zero. Of the placement only the sole's tilt against the surface is fed back: a
    foot beside its planned place or heading cannot be moved there while it carries load. What touches in a
    point may turn about it: held against turning as well, six feet of an insect hold its whole body.
    """
    wanted, contact = -gains.damping * frame.twist, support.contact
    if contact is not None:
        wanted[3:] += gains.stiffness * (skew(frame.rotation[:, 2]) @ contact.normal)
    rows = 3 if contact is not None and contact.kind is ContactKind.POINT else 6
    return AccelerationTask(name, frame.jacobian[:rows], (wanted - frame.drift)[:rows], _even(weight, rows))


def posture_task(
    name: str, state: DynamicsState, reference: ReferenceSample, gains: Impedance, weight: float,
    joints: Sequence[int],
) -> AccelerationTask:  # fmt: skip
    """Follow the planned angles of some joints, all with the same weight."""
    rows = list(joints)
    error, rate = reference.q[7:] - state.q[7:], reference.v[6:] - state.v[6:]
    wanted = reference.a[6:] + gains.stiffness * error + gains.damping * rate
    jacobian = _joint_rows(tuple(rows), len(state.v))
    return AccelerationTask(name, jacobian, wanted[rows], _even(weight, len(rows)))


@lru_cache(maxsize=64)
def _even(weight: float, rows: int) -> FloatArray:
    """(rows,) the same weight of each row of a task; read-only."""
    return frozen_array(np.full(rows, weight), "weights of rows")


@lru_cache(maxsize=64)
def _joint_rows(joints: tuple[int, ...], nv: int) -> FloatArray:
    """(joints, nv) map from the generalised acceleration to that of some joints; read-only."""
    return frozen_array(np.eye(nv - 6, nv, 6)[list(joints)], "rows of joints")


def orientation_error(wanted: FloatArray, actual: FloatArray) -> FloatArray:
    """(3,) rotation vector in world axes that turns ``actual`` into ``wanted`` [rad]."""
    return pin.log3(wanted @ actual.T)
