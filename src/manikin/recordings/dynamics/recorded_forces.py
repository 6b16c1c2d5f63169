"""Contact forces and joint torques of a recorded motion.

A single contact supplies the whole wrench that the motion needs. Several contacts can share it in many ways.
People load a foot gradually from its touch-down and unload it until its lift-off; of all shares that add up
to the wrench in every frame, those are chosen whose wrenches ``f_i`` at the contacts minimise

    ``sum_i integral |f_i'|^2 + |f_i|^2 / T^2 + |m_i|^2 / A^2 dt``,

with ``f_i = 0`` before the contact is made and after it is left, and ``m_i`` the moment of the contact about
a point above the centre of mass: forces on people who walk or run meet there ([Maus2010]_). So the rear foot
pushes ahead while the front one brakes; least forces would not have the feet push against each other at all.
That a foot goes on with what it supplies alone before and after is the idea of [Ren2008]_, for contacts of
any number and kind. It was compared with plates under walkers, and under one who rises from a seat.

Shares that the contacts can give stay as they are. Others become pushes within the friction pyramids: with
``G`` the wrenches of unit pushes at the corners, one a column, and ``l`` the pushes of each contact that come
next to its share, the nearest to ``l`` that supply the wrench are ``max(0, l + G^T y)`` for the six
multipliers ``y`` that solve ``G max(0, l + G^T y) + e y = w`` (:func:`manikin.balance.contact_forces.share`);
caps and torsion limits of contacts are not regarded there. What they cannot supply, because
the wrench is outside what the contacts admit, is added as the smallest wrenches at the contacts: the sum is
always the whole wrench, so that the residual wrench at the pelvis is zero, and a centre of pressure
outside its sole shows as such.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from manikin.balance.contact_forces import ContactGenerators, share
from manikin.balance.friction import contact_limits
from manikin.contact import ContactSchedule, Stance
from manikin.motion.motion import Motion
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import GRAVITY, FloatArray, wrench_about, wrench_map
from manikin.recordings.dynamics.recorded_dynamics import RecordedDynamics, RecordedMargins, recorded_margins

SOFTNESS = 1e-6
"""``e``, per mean eigenvalue of ``G G^T``: so small that little of an admissible wrench is left."""

LEVER = 0.1
"""Length by which a moment counts as much as a force [m]: about half a sole."""

SLOW = 0.2
"""``T`` [s]: a double support of walking is short beside it, standing is long. Force plates under people who
walk would have it longer, under one who stands after a step shorter."""

AIM, ABOVE = 0.015, 0.2
"""``A`` [m.s], and height above the centre of mass of the point where forces meet [m], as [Maus2010]_. With
half and twice of ``A``, or on the centre of mass, forces along the way of walkers are as near to plates'."""

ALONE = 0.05
"""Time for which a contact has to carry alone to define its load in an adjoining support of several [s]:
instants of supports are known to some hundredths of a second."""


def smooth_shares(
    wrench: FloatArray, held: NDArray[np.bool_], points: FloatArray, meeting: FloatArray, step: float
) -> FloatArray:
    """(n, c, 6) shares of smoothly loaded contacts, about the world's origin; friction is not regarded.

    Their sum over the contacts is the wrench where any is made; they are 0 elsewhere.

    Args:
        wrench: (n, 6) to be supplied, about the world's origin [N, N.m], every ``step`` [s].
        held: (n, c) which contacts are made.
        points: (n, c, 3) where they are [m]; any value where they are not made.
        meeting: (n, 3) points that their forces rather pass [m].
    """
    found = np.where(held[..., None], wrench[:, None], 0.0)
    for first, end in mask_runs(held.sum(axis=1) > 1):
        found[first:end] = _smooth_run(found, held, points, meeting, step, first, end)
    return found


def shared_wrenches(
    stance: Stance, wrench: FloatArray, weight: float, near: FloatArray | None = None
) -> FloatArray:
    """(n, c, 6) shares of the contacts of a stance within their friction pyramids, about the world's origin.

    Their sum over the contacts is the wrench.

    Args:
        wrench: (n, 6) to be supplied, about the world's origin [N, N.m].
        weight: Of the body [N], the scale of forces.
        near: (n, c, 6) shares to stay near to, as of :func:`smooth_shares`; None for the least forces.
    """
    if len(stance) == 1:
        return np.array(wrench[:, None])
    if near is None:
        return _nearest(stance, wrench, weight, None)
    shares = np.array(near)
    wrong = np.flatnonzero(~_admissible(stance, near, weight))
    if len(wrong):
        shares[wrong] = _nearest(stance, wrench[wrong], weight, near[wrong])
    return shares


def _admissible(stance: Stance, shares: FloatArray, weight: float) -> NDArray[np.bool_]:
    """(n,) whether every contact can give its share."""
    fine = np.ones(len(shares), dtype=bool)
    for contact, part in zip(stance, shares.swapaxes(0, 1), strict=True):
        limits, turn = contact_limits(contact, stance.friction_model), contact.rotation_contact_to_world
        moved = wrench_about(part, contact.position)
        local = np.hstack([moved[:, :3] @ turn, moved[:, 3:] @ turn])
        fine &= (local @ limits.A.T - limits.b).max(axis=1) <= SOFTNESS * weight
    return fine


def _nearest(stance: Stance, wrench: FloatArray, weight: float, near: FloatArray | None) -> FloatArray:
    """(n, c, 6) admissible shares of several contacts, nearest to given ones, or the least."""
    middle = np.mean([contact.position for contact in stance], axis=0)
    wanted = _about(wrench, middle, weight)
    generators = _generators(stance, middle, weight)
    columns, known = np.vstack(generators).T, 0.0
    if near is not None:
        given = _about(near, middle, weight).swapaxes(0, 1)
        known = np.hstack([_pushes(one.T, part) for one, part in zip(generators, given, strict=True)])
    pushes = _pushes(columns, wanted, known)
    each = np.split(pushes, np.cumsum([len(one) for one in generators[:-1]]), axis=1)
    shares = np.stack([push @ part for push, part in zip(each, generators, strict=True)], axis=1)
    shares += _smallest([contact.position - middle for contact in stance], wanted - shares.sum(axis=1))
    shares *= weight
    shares[..., 3:] *= LEVER
    return wrench_about(shares, -middle)


def _smooth_run(
    found: FloatArray, held: NDArray[np.bool_], points: FloatArray, meeting: FloatArray, step: float,
    first: int, end: int,
) -> FloatArray:  # fmt: skip
    """(k, c, 6) smooth shares in the frames from ``first`` up to ``end``, all with several contacts.

    The wrenches about their own points, moments per lever, are the unknowns: their changes, their sizes and
    their moments about where they meet are least squares, with one linear equation for the sum in each frame.
    """
    made = held[first:end]
    places = np.where(made[..., None], points[first:end], 0.0)
    count = int(made.sum())
    index = np.full((end - first + 2, made.shape[1]), -1)
    index[1:-1][made] = np.arange(count)
    before, after = index[:-1], index[1:]
    # A change from one frame to the next; none is asked for across an end of the recording.
    inside = np.ones((len(before), 1), dtype=bool)
    inside[0], inside[-1] = _telling(held[:first][::-1], step), _telling(held[end:], step)
    changing = inside & ((before >= 0) | (after >= 0))
    frames, column = np.nonzero(changing)
    # Rows of the identity, and a last one of zeros for the index -1 of a contact that is not made.
    one = sparse.csr_array(sparse.vstack([sparse.eye_array(count), sparse.csr_array((1, count))]))
    change = one[after[frames, column]] - one[before[frames, column]]
    known, start, last = np.zeros((len(frames), 6)), frames == 0, frames == len(before) - 1
    if first > 0:
        known[start] = _about(found[first - 1, column[start]], places[0, column[start]])
    if end < len(held):
        known[last] = -_about(found[end, column[last]], places[-1, column[last]])
    cost = change.T @ change + (step / SLOW) ** 2 * sparse.eye_array(count)
    frame, contact = np.nonzero(made)
    middle = places.sum(axis=1) / made.sum(axis=1)[:, None]
    total = _about(found[first:end][frame, contact], middle[frame])  # the whole wrench, once per contact
    begins = np.searchsorted(frame, np.arange(end - first))
    sums = _sums(frame, places[frame, contact] - middle[frame], end - first)
    moments = wrench_map(meeting[first:end][frame] - places[frame, contact])[:, 3:] * (step / AIM)
    moments[..., 3:] *= LEVER
    sizes = sparse.bsr_array((moments.swapaxes(1, 2) @ moments, np.arange(count), np.arange(count + 1)))
    system = sparse.block_array([[sparse.kron(cost, np.eye(6)) + sizes, sums.T], [sums, None]])
    right = np.concatenate([(change.T @ known).ravel(), total[begins].ravel()])
    solved = splu(sparse.csc_matrix(system)).solve(right)[: 6 * count].reshape(count, 6)
    solved[:, 3:] *= LEVER
    shares = np.zeros((end - first, made.shape[1], 6))
    shares[frame, contact] = wrench_about(solved, -places[frame, contact])
    return shares


def _telling(beside: NDArray[np.bool_], step: float) -> bool:
    """Whether the load in the frames (n, c) beside a run, the nearest first, is known.

    It is in flight, and for a single contact that is long enough or lasts up to the recording's end.
    """
    if not len(beside):
        return False
    changed = np.flatnonzero((beside != beside[0]).any(axis=1))
    return not beside[0].any() or not len(changed) or bool(changed[0] * step > ALONE)


def _sums(frame: NDArray[np.int64], arm: FloatArray, frames: int) -> sparse.csr_array:
    """(6 f, 6 k) sums over each frame's contacts of wrenches about points ``arm`` (k, 3) off its middle."""
    carried = wrench_map(-arm / LEVER)
    rows = 6 * frame[:, None, None] + np.arange(6)[:, None] + np.zeros(6, dtype=np.int64)
    columns = 6 * np.arange(len(frame))[:, None, None] + np.zeros((6, 1), dtype=np.int64) + np.arange(6)
    return sparse.csr_array((carried.ravel(), (rows.ravel(), columns.ravel())), (6 * frames, 6 * len(frame)))


def _about(wrench: FloatArray, point: FloatArray, weight: float = 1.0) -> FloatArray:
    """(..., 6) about points, per weight and moments per lever."""
    moved = wrench_about(wrench, point) / weight
    moved[..., 3:] /= LEVER
    return moved


def _generators(stance: Stance, middle: FloatArray, weight: float) -> list[FloatArray]:
    """(k, 6) wrenches of unit pushes of each contact about the middle, moments per lever.

    A grasp's unit is its limit, in body weights.
    """
    found = ContactGenerators.of(stance, grasp_moments=False)
    unit = np.where(np.isfinite(found.upper), found.upper / weight, 1.0)
    wrenches = unit[:, None] * found.about(middle).T
    wrenches[:, 3:] /= LEVER
    return [wrenches[found.contact == number] for number in range(len(stance))]


def _pushes(columns: FloatArray, wanted: FloatArray, known: FloatArray | float = 0.0) -> FloatArray:
    """(n, k) pushes nearest to known ones that supply (n, 6) wrenches, as far as pushes can."""
    soft = SOFTNESS * float(np.trace(columns @ columns.T)) / 6.0
    return share(columns, wanted, np.ones((len(wanted), columns.shape[1])), soft, prior=known).magnitude


def _smallest(arms: Sequence[FloatArray], missing: FloatArray) -> FloatArray:
    """(n, c, 6) smallest wrenches at points ``arms`` away that add up to (n, 6) missing ones."""
    maps = wrench_map(-np.array(arms) / LEVER)
    each = missing @ np.linalg.pinv(np.hstack(list(maps))).T
    parts = zip(np.split(each, len(arms), axis=1), maps, strict=True)
    return np.stack([part @ one.T for part, one in parts], axis=1)


def torques_of(dynamics: RecordedDynamics, effectors: tuple[str, ...], wrenches: FloatArray) -> FloatArray:
    """(n, nv) generalised forces beside (n, c, 6) wrenches on effectors, about the world's origin [N, N.m].

    They are torques of the joints, and what the pelvis lacks.
    """
    torques, body, model = np.array(dynamics.free_torque), dynamics.body, dynamics.body.pinocchio
    for number, effector in enumerate(effectors):
        joints = model.supports[model.frames[body.effector_frame(effector)].parentJoint]
        moved = [model.idx_vs[one] + k for one in joints if one for k in range(model.nvs[one])]
        torques[:, moved] -= np.einsum("nij,ni->nj", dynamics.jacobians[:, :, moved], wrenches[:, number])
    return torques


def _points(schedule: ContactSchedule, phases: NDArray[np.int64]) -> FloatArray:
    """(n, c, 3) where each effector of a schedule is in contact in the phases (n,), else 0 [m]."""
    names = schedule.sequence.effectors
    points = np.zeros((len(phases), len(names), 3))
    for number, phase in enumerate(schedule.sequence):
        for contact in phase.stance:
            points[phases == number, names.index(contact.effector)] = contact.position
    return points


def contact_wrenches(dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0) -> FloatArray:
    """(n, c, 6) wrench on each effector of a schedule, about the world's origin [N, N.m]; 0 off its contacts.

    The schedule's clock is ``start`` [s] at the motion's first instant.
    """
    names, times = schedule.sequence.effectors, dynamics.time + start
    phases, held = schedule.phase_at(times), schedule.support(times, names)
    points = _points(schedule, phases)
    step, weight = float(dynamics.time[1] - dynamics.time[0]), GRAVITY * dynamics.body.mass
    meeting = dynamics.com + np.array([0.0, 0.0, ABOVE])
    wrenches = smooth_shares(dynamics.wrench, held, points, meeting, step)
    for number, phase in enumerate(schedule.sequence):
        frames, stance = np.flatnonzero(phases == number), phase.stance
        if len(frames) and len(stance) > 1:
            place = frames[:, None], [names.index(name) for name in stance.effectors]
            wrenches[place] = shared_wrenches(stance, dynamics.wrench[frames], weight, wrenches[place])
    return wrenches


def motion_on_contacts(
    dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0,
    margins: RecordedMargins | None = None,
) -> Motion:  # fmt: skip
    """The recorded motion with contacts, their forces, joint torques and the whole-body margin.

    In flight the torques are those that the motion would need without contacts, the margin is minus the
    length of the missing wrench, and the pelvis' six generalised forces are set to zero; with contacts they
    are zero but for rounding. The schedule's clock is ``start`` [s] at the motion's first instant; margins of
    the same motion on the same stances are taken where they are known already.
    """
    names, times = schedule.sequence.effectors, dynamics.time + start
    wrenches = contact_wrenches(dynamics, schedule, start)
    forces = wrench_about(wrenches, _points(schedule, schedule.phase_at(times)))
    torques = torques_of(dynamics, names, wrenches)
    torques[:, :6] = 0.0
    return Motion(
        time=dynamics.time, q=dynamics.q, v=dynamics.v, a=dynamics.a, tau=torques, com=dynamics.com,
        angular_momentum=dynamics.angular_momentum,
        margin=(margins or recorded_margins(dynamics, schedule, start)).whole_body,
        support=schedule.support(times, names), contact_force=forces, contact_names=names,
        joint_names=tuple(dynamics.body.joint_names),
    )  # fmt: skip
