"""Contact forces and joint torques of a recorded motion.

The wrench that a motion needs is known; one contact has to supply all of it. Several can share it in many
ways: of all forces at the corners of the soles, each within its friction pyramid, those of least squares are
taken. With ``G`` their wrenches, one a column, they are ``max(0, G^T y)`` for the six multipliers ``y`` that
solve ``G max(0, G^T y) + e y = w``, found by Newton's method for all frames of a phase at once. What they
cannot supply, because the wrench is outside what the contacts admit, is added as the smallest wrenches at the
contacts: the sum is always the whole wrench, so that the pelvis needs no hand from heaven, and a centre of
pressure outside its sole is seen as such.
"""

import numpy as np

from manikin.balance.friction import contact_to_world, cross, edge_wrenches
from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind, ContactSchedule, Stance
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins, recorded_margins, wrench_at
from manikin.motion.motion import Motion
from manikin.spatial import GRAVITY, FloatArray

SOFTNESS = 1e-6
"""``e``, per mean eigenvalue of ``G G^T``: so small that little of an admissible wrench is left."""

ROUNDS = 30
"""Most steps of Newton's method."""

LEVER = 0.1
"""Length by which a moment counts as much as a force [m]: about half a sole."""


def shared_wrenches(stance: Stance, wrench: FloatArray, weight: float) -> FloatArray:
    """Share wrenches among the contacts of a stance.

    Args:
        stance: At least one contact.
        wrench: (n, 6) to be supplied, about the world's origin [N, N.m].
        weight: Of the body [N], the scale of forces.

    Returns:
        (n, c, 6) of each contact, about the world's origin; their sum over the contacts is ``wrench``.
    """
    middle = np.mean([contact.position for contact in stance], axis=0)
    wanted = wrench_at(wrench, middle) / weight
    wanted[:, 3:] /= LEVER
    if len(stance) == 1:
        shares = wanted[:, None]
    else:
        generators = [_generators(contact, middle, weight) for contact in stance]
        columns = np.vstack(generators).T
        pushes = np.maximum(_multipliers(columns, wanted) @ columns, 0.0)
        ends = np.cumsum([0, *map(len, generators)])
        shares = np.stack(
            [pushes[:, a:b] @ part for a, b, part in zip(ends[:-1], ends[1:], generators, strict=True)],
            axis=1,
        )
        shares += _smallest([contact.position - middle for contact in stance], wanted - shares.sum(axis=1))
    shares = shares * weight
    shares[..., 3:] *= LEVER
    return wrench_at(shares, -middle)


def torques_of(dynamics: RecordedDynamics, effectors: tuple[str, ...], wrenches: FloatArray) -> FloatArray:
    """(n, nv) generalised forces beside those of contacts: torques of the joints, and what the pelvis lacks.

    Args:
        dynamics: The motion.
        effectors: c names.
        wrenches: (n, c, 6) on each, about the world's origin [N, N.m].
    """
    torques = np.array(dynamics.free_torque)
    for number, effector in enumerate(effectors):
        moved = _moved_by(dynamics.body, effector)
        torques[:, moved] -= np.einsum("nij,ni->nj", dynamics.jacobians[:, :, moved], wrenches[:, number])
    return torques


def motion_on_contacts(
    dynamics: RecordedDynamics,
    schedule: ContactSchedule,
    start: float = 0.0,
    margins: RecordedMargins | None = None,
) -> Motion:
    """The recorded motion with contacts, their forces, joint torques and the margin of balance.

    The margin is that of the whole body about the middle of the contacts of each phase, see
    :func:`manikin.mocap.recorded_margins.recorded_margins`. In flight no contact can push: the torques are
    those that the motion would need with nothing to push against, and the margin is minus the size of the
    wrench that is missing. The pelvis' six generalised forces are zero: with contacts exactly (but for
    rounding), in flight what is missing is left out.

    Args:
        dynamics: The motion.
        schedule: Its stances, of :func:`manikin.mocap.recorded_stances.recorded_schedule`.
        start: The schedule's clock at the motion's first instant [s].
        margins: Of the same motion on the same stances, where they are known already.
    """
    names = schedule.sequence.effectors
    times = dynamics.time + start
    phases = schedule.phase_at(times)
    wrenches = np.zeros((len(dynamics), len(names), 6))
    forces = np.zeros_like(wrenches)
    for number, phase in enumerate(schedule.sequence):
        frames = np.flatnonzero(phases == number)
        if not len(frames) or not len(phase.stance):
            continue
        columns = [names.index(name) for name in phase.stance.effectors]
        shares = shared_wrenches(phase.stance, dynamics.wrench[frames], _weight(dynamics))
        wrenches[frames[:, None], columns] = shares
        for column, contact, share in zip(columns, phase.stance, shares.swapaxes(0, 1), strict=True):
            forces[frames, column] = wrench_at(share, contact.position)
    torques = torques_of(dynamics, names, wrenches)
    torques[:, :6] = 0.0
    return Motion(
        time=dynamics.time, q=dynamics.q, v=dynamics.v, a=dynamics.a, tau=torques, com=dynamics.com,
        angular_momentum=dynamics.angular_momentum,
        margin=(margins or recorded_margins(dynamics, schedule, start)).whole_body,
        support=schedule.support(times, names), contact_force=forces, contact_names=names,
        joint_names=tuple(dynamics.body.joint_names),
    )  # fmt: skip


def _weight(dynamics: RecordedDynamics) -> float:
    return GRAVITY * dynamics.body.mass


def _generators(contact: Contact, middle: FloatArray, weight: float) -> FloatArray:
    """(k, 6) wrenches of unit pushes about the middle, moments per lever."""
    if contact.kind is ContactKind.GRASP:
        axes = np.vstack([np.eye(3), -np.eye(3)]) * contact.max_force / weight
        wrenches = np.hstack([axes, cross(contact.position - middle, axes)])
    else:
        wrenches = contact_to_world(contact, edge_wrenches(contact, "pyramid"), middle)
    wrenches = np.array(wrenches)
    wrenches[:, 3:] /= LEVER
    return wrenches


def _multipliers(columns: FloatArray, wanted: FloatArray) -> FloatArray:
    """(n, 6) zeros of ``G max(0, G^T y) + e y - w``, the slope of a convex function, by Newton's method.

    A step that does not make the slope smaller is halved.
    """
    soft = SOFTNESS * float(np.trace(columns @ columns.T)) / 6.0
    y = np.asarray(np.linalg.solve(columns @ columns.T + soft * np.eye(6), wanted.T).T, dtype=np.float64)
    active = np.arange(len(y))
    slope = _slope(columns, soft, y, wanted)
    for _ in range(ROUNDS):
        active = active[np.linalg.norm(slope[active], axis=1) > 1e-10]
        if not len(active):
            break
        pushed = y[active] @ columns > 0.0
        bend = np.einsum("ik,nk,jk->nij", columns, pushed, columns, optimize=True) + soft * np.eye(6)
        step = -np.linalg.solve(bend, slope[active][..., None])[..., 0]
        size = np.linalg.norm(slope[active], axis=1)
        length = np.ones(len(active))
        for _ in range(8):
            there = y[active] + length[:, None] * step
            found = _slope(columns, soft, there, wanted[active])
            worse = np.linalg.norm(found, axis=1) > (1.0 - 1e-4 * length) * size
            if not worse.any():
                break
            length[worse] *= 0.5
        y[active], slope[active] = there, found
    return y


def _slope(columns: FloatArray, soft: float, y: FloatArray, wanted: FloatArray) -> FloatArray:
    return np.maximum(y @ columns, 0.0) @ columns.T + soft * y - wanted


def _smallest(arms: list[FloatArray], missing: FloatArray) -> FloatArray:
    """(n, c, 6) smallest wrenches at points ``arms`` away that add up to (n, 6) missing ones."""
    maps = []
    for arm in arms:
        x, y, z = arm / LEVER
        carried = np.eye(6)
        carried[3:, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
        maps.append(carried)
    joined = np.hstack(maps)
    each = missing @ np.linalg.pinv(joined).T
    return np.stack(
        [part @ one.T for part, one in zip(np.split(each, len(arms), axis=1), maps, strict=True)], axis=1
    )


def _moved_by(body: BodyModel, effector: str) -> list[int]:
    """Indices of the velocities that move an effector."""
    model = body.pinocchio
    joint = model.frames[body.effector_frame(effector)].parentJoint
    return [
        place
        for one in model.supports[joint]
        for place in range(model.idx_vs[one], model.idx_vs[one] + model.nvs[one])
        if one
    ]
