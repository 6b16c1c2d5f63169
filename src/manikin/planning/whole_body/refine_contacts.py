"""Contact variables and the contact-invariant term ([Tonneau2015]_ 7.3.1, after [Mordatch2012]_).

Each effector has a contact variable ``c`` at each time: 1 while the sequence holds its contact, 0 in flight,
with a smooth ramp on the way.  The term is ``c (|e|^2 + |e'|^2)``: the place of an effector relative to its
contact, and its speed.  Here the variables are given and not unknowns; where ``c`` is 1 the place is met
exactly by multipliers.

The EFORT term ([Tonneau2015]_ 7.8-7.9) keeps contacts in postures in which their limb presses well: ``C = c /
alpha`` for each limb in contact, with ``alpha = f_T (v . n)``.  As printed, the cost is singular or negative
where the surface would have to pull (``alpha <= 0``), and 7.9 drops the contact variable and the unit length
of the direction; here ``alpha`` is clamped to :data:`LEAST`, ``c`` is kept, and directions have length 1.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import limb_slots
from manikin.contact import Contact, ContactKind, ContactSchedule
from manikin.kinematics.efort import Task
from manikin.motion.configuration_spline import TurnDerivatives
from manikin.motion.dynamics import MotionSamples
from manikin.numerics.spatial import FloatArray, skew
from manikin.planning.whole_body.fit_targets import ALMOST, GRASP_ROTATION_WEIGHT, EffectorTarget
from manikin.planning.whole_body.foot_roll import Rolls
from manikin.planning.whole_body.refine_input import KeyPath

LEAST = 0.1
"""Smallest alpha; below it the cost is constant [N per N.m]."""


@dataclass(frozen=True, eq=False)
class LimbDirections:
    """Joints and directions of one limb's EFORT.

    Attributes:
        joints: (m,) velocity indices of the limb's hinges, from its root to its effector.
        direction: (n, 3) unit direction in which the scene shall push it at each sample; zero for none.
        normal: (n, 3) of its contact; zero without one.
    """

    joints: np.ndarray
    direction: FloatArray
    normal: FloatArray


def limb_directions(
    body: BodyModel, path: KeyPath, schedule: ContactSchedule, time: FloatArray, task: Task | None
) -> dict[str, LimbDirections]:
    """Directions at times (n,) [s] of every limb of the sequence that has one.

    Without a task the direction is that of the pelvis' displacement in the phase, as 7.9 wants.
    """
    phases = schedule.phase_at(time)
    moved = np.diff(path.at(schedule.instants)[:, :3], axis=0)
    # A pelvis that moves less than this during a phase has no direction [m].
    length, still = np.linalg.norm(moved, axis=1, keepdims=True), 1.0e-3
    forward = np.where(length > still, moved / np.maximum(length, still), 0.0)
    found = {}
    for limb in body.limbs:
        if limb.effector not in schedule.sequence.effectors:
            continue
        direction = forward[phases] if task is None else np.tile(task.reaction_on(limb.name), (len(time), 1))
        held = (phase.stance if limb.effector in phase.stance else None for phase in schedule.sequence)
        normals = np.array([np.zeros(3) if one is None else one[limb.effector].normal for one in held])
        found[limb.effector] = LimbDirections(limb_slots(body, limb) - 1, direction, normals[phases])
    return found


def efort_with_derivative(
    limb: LimbDirections, jacobian: FloatArray, chain: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """EFORT of one limb (n,), not clamped, and its derivative (n, nv) by the body's tangent.

    With ``s = sum_i (v . J_i)^2`` over the limb's joints, ``alpha = (v . n) / sqrt(s)``, and
    ``dJ_i/dq_k = z_k x J_i`` for a joint ``k`` before ``i`` in the chain, ``z_i x J_k`` after it.

    Args:
        jacobian: (n, 6, nv) of the effector, linear above angular, world axes.
        chain: (m,) velocity indices of the joints that move it, in order.
    """
    own = np.flatnonzero(np.isin(chain, limb.joints))
    linear, axes = jacobian[:, :3, chain], jacobian[:, 3:, chain]
    along = np.einsum("nc,nci->ni", limb.direction, linear[:, :, own])
    square = np.maximum(np.sum(along**2, axis=1), 1e-12)
    alpha = np.sum(limb.direction * limb.normal, axis=1) / np.sqrt(square)
    # v . (z x J) = (v x z) . J
    turned = np.cross(limb.direction[:, :, None], axes, axis=1)
    before = np.einsum("nck,nci->nik", turned, linear[:, :, own])
    after = np.einsum("nci,nck->nik", turned[:, :, own], linear)
    place = np.arange(len(chain))
    slope = np.einsum("ni,nik->nk", along, np.where(place <= own[:, None], before, after))
    derivative = np.zeros((len(alpha), jacobian.shape[2]))
    derivative[:, chain] = -(alpha / square)[:, None] * slope
    return alpha, derivative


def contact_variables(schedule: ContactSchedule, time: FloatArray) -> dict[str, FloatArray]:
    """(n,) contact variable of every effector of the sequence at each time, in [0, 1]."""
    names = schedule.sequence.effectors
    found = dict(zip(names, schedule.support(time, names).T.astype(np.float64, "C"), strict=True))
    for swing in schedule.sequence.swings():
        start, end = schedule.swing_interval(swing)
        rows = (time >= start) & (time < end)
        # Time before and after a contact in which its variable is above 0 [s].
        ramp = min(0.15, 0.25 * (end - start))
        variable = found[swing.effector]
        for contact, away in ((swing.start, time - start), (swing.end, end - time)):
            if contact is not None:
                near = np.clip(1.0 - away[rows] / ramp, 0.0, 1.0)
                variable[rows] = np.maximum(variable[rows], near**2 * (3.0 - 2.0 * near))
    return found


def contact_targets(
    schedule: ContactSchedule,
    time: FloatArray,
    variables: dict[str, FloatArray],
    approach: float,
    rolls: Rolls = (),
) -> dict[str, EffectorTarget]:
    """Targets of every effector at times (n,) [s] by the contact variables.

    In flight it keeps to the contact's normal; the height above the surface is left to the distances.

    Args:
        variables: Those of :func:`contact_variables`.
        approach: Weight of the distance to a contact's normal in flight, relative to that of a held
            contact, at a variable of 1.
        rolls: Of feet that leave from their toes.
    """
    targets = {name: EffectorTarget.free(len(time)) for name in schedule.sequence.effectors}
    for swing in schedule.sequence.swings():
        target, (start, end) = targets[swing.effector], schedule.swing_interval(swing)
        middle = 0.5 * (start + end)
        for contact, first, last in ((swing.start, start, middle), (swing.end, middle, end)):
            if contact is not None:
                rows = (time >= first) & (time < last)
                # Weights are of residuals, the contact variable of their squares.
                weight = approach * np.sqrt(variables[swing.effector][rows])
                target.put(rows, contact)
                target.weight[rows] = np.minimum(weight, ALMOST)
                target.along[rows] = np.eye(3) - np.outer(contact.normal, contact.normal)
                target.rotation_weight[rows] = weight * _turn_weight(contact)
    for phase, (start, end) in zip(schedule.sequence, pairwise(schedule.instants), strict=True):
        for contact in phase.stance:
            target, rows = targets[contact.effector], (time >= start) & (time <= end)
            target.put(rows, contact)
            target.weight[rows], target.rotation_weight[rows] = 1.0, _turn_weight(contact)
            target.along[rows] = np.eye(3)
    for name, roll in rolls:
        target, (up, *flight, flat) = targets[name], roll.instants.tolist()
        middle = 0.5 * sum(flight)
        for pivot, first, last in zip(roll.pivots, (up, middle), (middle, flat), strict=True):
            rows = (time > first) & (time < last)
            count = int(rows.sum())
            target.position[rows], target.rotation[rows] = roll.pose(
                np.tile(pivot.position, (count, 1)), np.tile(pivot.rotation, (count, 1, 1)), time[rows]
            )
    return targets


def _turn_weight(contact: Contact) -> float:
    """Importance of the orientation: of a sole whole, of a point none, of an oriented grasp a hint."""
    if contact.kind is ContactKind.GRASP:
        return GRASP_ROTATION_WEIGHT if contact.oriented else 0.0
    return 1.0 if contact.kind is ContactKind.SOLE else 0.0


def effector_speed(
    motion: MotionSamples, jacobian: FloatArray, chain: np.ndarray, turn: TurnDerivatives
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n, 3) velocity of an effector [m/s], and (n, 3, nq) its derivatives by the raw coordinates and rates.

    With the columns ``J_i`` and axes ``z_i`` of the joints from the pelvis to the effector,
    ``d(J v)/dq_i = (sum_{k <= i} z_k v_k) x J_i + z_i x (sum_{k > i} J_k v_k)``.

    Args:
        jacobian: (n, 6, nv) of the effector, linear above angular, world axes.
        chain: (m,) velocity indices of the joints that move it, the pelvis' six first, in order.
        turn: Derivatives of the pelvis' turn by the raw quaternion.
    """
    v = motion.states.v[:, chain]
    linear, axes = jacobian[:, :3, chain], jacobian[:, 3:, chain]
    turned, carried = np.cumsum(axes * v[:, None, :], axis=2), linear * v[:, None, :]
    value = carried.sum(axis=2)
    beyond = value[:, :, None] - np.cumsum(carried, axis=2)
    by_joint = np.cross(turned, linear, axis=1) + np.cross(axes, beyond, axis=1)
    n, nq = motion.raw[0].shape
    by_value, by_rate = np.zeros((n, 3, nq)), np.zeros((n, 3, nq))
    joints = chain[chain >= 6]
    by_value[:, :, joints + 1] = by_joint[:, :, len(chain) - len(joints) :]
    by_rate[:, :, joints + 1] = jacobian[:, :3, joints]
    pelvis_to_world = motion.tangent[:, :3, :3].transpose(0, 2, 1)
    relative = skew(value - motion.raw[1][:, :3])
    by_omega = jacobian[:, :3, 3:6]
    by_value[:, :, 3:7] = (
        -relative @ pelvis_to_world @ motion.tangent[:, 3:6, 3:7] + by_omega @ turn.omega_by_value
    )
    by_rate[:, :, :3] = np.eye(3)
    by_rate[:, :, 3:7] = by_omega @ turn.omega_by_rate
    return value, by_value, by_rate
