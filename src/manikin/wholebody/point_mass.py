"""The motion of a point mass on massless feet: its CoM trajectory with the contact forces.

There is nothing to fit: the ball is at the CoM and does not turn.  The forces are shared among
the soles' corners with the least square, within the friction pyramids and the caps.
"""

from collections.abc import Sequence
from ctypes import c_int

import daqp
import numpy as np

from manikin.balance import WrenchPolytope
from manikin.balance.friction import pyramid_friction
from manikin.centroidal import CentroidalProblem, CentroidalTrajectory
from manikin.centroidal.certificate import facet_margins
from manikin.contact import Contact, ContactKind, Stance
from manikin.motion import Motion
from manikin.spatial import FloatArray, skew
from manikin.wholebody.forces import load_shares

STEP = 5e-3
"""Distance of the samples [s]."""


def point_mass_motion(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> Motion:
    """Sample a CoM trajectory with its margin and contact forces.

    Args:
        problem: What was planned.
        trajectory: The plan.
        polytopes: W_i of the phases about the world origin.

    Returns:
        The motion of :func:`manikin.body.point_mass.point_mass`, every :data:`STEP` and at the key
        instants; ``tau`` is zero.
    """
    schedule = trajectory.schedule
    grid = np.arange(0.0, trajectory.duration, STEP)
    time = np.unique(np.concatenate([grid, schedule.instants]))
    time = time[np.append(np.diff(time) > 1e-9, True)]
    names = schedule.sequence.effectors
    com, rest = trajectory.position(time), np.zeros((len(time), 3))
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (len(time), 1))
    return Motion(
        time=time,
        q=np.hstack([com, turn]),
        v=np.hstack([trajectory.velocity(time), rest]),
        a=np.hstack([trajectory.acceleration(time), rest]),
        tau=np.zeros((len(time), 6)),
        com=com,
        angular_momentum=rest,
        margin=_margins(problem, trajectory, polytopes, time),
        support=schedule.support(time, names),
        contact_force=_contact_forces(problem, trajectory, time, names),
        contact_names=names,
        joint_names=(),
        margin_unit=problem.margin_unit,
    )


def _margins(
    problem: CentroidalProblem,
    trajectory: CentroidalTrajectory,
    polytopes: Sequence[WrenchPolytope],
    time: FloatArray,
) -> FloatArray:
    """(n,) margin in the phase of each instant; at a key instant the smaller of both phases."""
    margin = np.full(len(time), np.inf)
    instants = trajectory.schedule.instants
    for phase, polytope in enumerate(polytopes):
        inside = (time >= instants[phase] - 1e-9) & (time <= instants[phase + 1] + 1e-9)
        blocks = [b.min(axis=1) for b in facet_margins(problem, trajectory, polytope, time[inside])]
        margin[inside] = np.minimum(margin[inside], np.concatenate(blocks))
    return margin


def _contact_forces(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, time: FloatArray, names: tuple[str, ...]
) -> FloatArray:
    """(n, c, 6) forces and moments about each contact's origin [N, N.m]."""
    schedule = trajectory.schedule
    corners = [_Corners(phase.stance, names, problem) for phase in schedule.sequence]
    wrench, phases = trajectory.pseudo_wrench(time), schedule.phase_at(time)
    shares = load_shares(schedule, time, names)
    forces = np.zeros((len(time), len(names), 6))
    for sample, phase in enumerate(phases):
        forces[sample] = corners[phase].share(wrench[sample], shares[sample])
    return forces


class _Corners:
    """The edges of the friction pyramids at every corner of one stance."""

    def __init__(self, stance: Stance, names: tuple[str, ...], problem: CentroidalProblem) -> None:
        self._count = len(names)
        directions, owners, points = [], [], []
        for contact in stance:
            for corner in contact.points_in_world:
                for edge in _edges(contact, problem):
                    directions.append(edge)
                    points.append(corner)
                    owners.append(names.index(contact.effector))
        force, place = np.array(directions), np.array(points)
        self._owner = np.array(owners)
        self._wrenches = np.vstack([force.T, np.cross(place, force).T])
        origin = {names.index(contact.effector): contact.position for contact in stance}
        self._origin = origin
        self._limits, self._caps = self._rows(stance, names)

    def _rows(self, stance: Stance, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """Sums of the normal forces, and what caps each."""
        rows, caps = [], []
        for contact in stance:
            if contact.kind is not ContactKind.GRASP and contact.normal_force_cap is not None:
                rows.append((self._owner == names.index(contact.effector)).astype(float))
                caps.append(contact.normal_force_cap)
        return np.array(rows).reshape(-1, len(self._owner)), np.array(caps)

    def share(self, wrench: FloatArray, shares: FloatArray) -> FloatArray:
        """(c, 6) forces and moments that supply the wrench about the world origin."""
        size = len(self._owner)
        cost = np.diag(1.0 / shares[self._owner])
        upper = np.concatenate([np.full(size, 1e30), wrench, self._caps])
        lower = np.concatenate([np.zeros(size), wrench, np.full(len(self._caps), -1e30)])
        sense = np.zeros(len(upper), dtype=c_int)
        sense[size : size + 6] = 5  # equalities
        rows = np.ascontiguousarray(np.vstack([self._wrenches, self._limits]))
        magnitude, _, flag, _ = daqp.solve(cost, np.zeros(size), rows, upper, lower, sense)
        if flag < 1:  # on the edge of what is possible rounding decides; the least square of all is near
            magnitude = np.maximum(np.linalg.lstsq(self._wrenches, wrench, rcond=None)[0], 0.0)
        out = np.zeros((self._count, 6))
        for index, origin in self._origin.items():
            total = self._wrenches[:, self._owner == index] @ magnitude[self._owner == index]
            out[index, :3] = total[:3]
            out[index, 3:] = total[3:] - skew(origin) @ total[:3]
        return out


def _edges(contact: Contact, problem: CentroidalProblem) -> FloatArray:
    if contact.kind is ContactKind.GRASP:
        return contact.max_force * np.vstack([np.eye(3), -np.eye(3)])
    friction = pyramid_friction(contact, problem.sequence[0].stance.friction_model)
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * friction
    return np.column_stack([signs, np.ones(4)]) @ contact.rotation_contact_to_world.T
