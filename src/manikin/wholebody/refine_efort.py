"""The EFORT term: contacts keep the posture in which their limb presses well ([Tonneau2015]_ 7.8-7.9).

``C = c / alpha`` for each limb in contact, with ``alpha = f_T (v . n)``.  As printed, the cost is
singular or negative where the surface would have to pull (``alpha <= 0``), and 7.9 drops the contact
variable and the unit length of the direction; here ``alpha`` is clamped to :data:`LEAST`, ``c`` is kept,
and directions have length 1.
"""

from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import limb_slots
from manikin.contact import ContactSchedule
from manikin.contact_planning.efort import Task
from manikin.spatial import FloatArray
from manikin.wholebody.refine_input import KeyPath

LEAST = 0.1
"""Smallest alpha; below it the cost is constant [N per N.m]."""

STILL = 1.0e-3
"""A pelvis that moves less than this during a phase has no direction [m]."""


@dataclass(frozen=True, eq=False)
class LimbDirections:
    """What EFORT is about, for one limb.

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
    """Directions of every limb of the sequence that has one.

    Without a task the direction is that of the pelvis' displacement in the phase, as 7.9 wants.

    Args:
        body: The body.
        path: The input.
        schedule: Contacts in time.
        time: (n,) [s].
        task: Direction of the task and the limbs that act on an object, or None.
    """
    phases = schedule.phase_at(time)
    moved = np.diff(path.at(schedule.instants)[:, :3], axis=0)
    length = np.linalg.norm(moved, axis=1, keepdims=True)
    forward = np.where(length > STILL, moved / np.maximum(length, STILL), 0.0)
    found = {}
    for limb in body.limbs:
        if limb.effector not in schedule.sequence.effectors:
            continue
        direction = forward[phases] if task is None else np.tile(task.reaction_on(limb.name), (len(time), 1))
        normal = np.zeros((len(time), 3))
        for number, phase in enumerate(schedule.sequence):
            if limb.effector in phase.stance:
                normal[phases == number] = phase.stance[limb.effector].normal
        found[limb.effector] = LimbDirections(limb_slots(body, limb) - 1, direction, normal)
    return found


def efort_with_derivative(
    limb: LimbDirections, jacobian: FloatArray, chain: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """EFORT of one limb (n,), not clamped, and its derivative (n, nv) by the body's tangent.

    With ``s = sum_i (v . J_i)^2`` over the limb's joints, ``alpha = (v . n) / sqrt(s)``, and
    ``dJ_i/dq_k = z_k x J_i`` for a joint ``k`` before ``i`` in the chain, ``z_i x J_k`` after it.

    Args:
        limb: Its joints and directions.
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
