"""The motion of a point mass on massless feet: its CoM trajectory with the contact forces.

There is nothing to fit: the ball is at the CoM and does not turn.  The forces are shared among
the soles' corners with the least square, within the friction pyramids and the caps.
"""

from collections.abc import Sequence

import numpy as np

from manikin.balance import WrenchPolytope, motion_margin
from manikin.balance.contact_forces import ContactGenerators
from manikin.balance.motion_forces import load_shares
from manikin.contact import ContactKind, Stance
from manikin.motion import Motion
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import FloatArray, skew
from manikin.planning.com import CentroidalProblem, CentroidalTrajectory

STEP = 5e-3
"""Distance of the samples [s]."""


def point_mass_motion(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> Motion:
    """Sample a CoM trajectory with its margin and contact forces.

    Returns:
        The motion of :func:`manikin.body.further_bodies.point_mass`, every :data:`STEP` and at the key
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
        time=time, q=np.hstack([com, turn]), v=np.hstack([trajectory.velocity(time), rest]),
        a=np.hstack([trajectory.acceleration(time), rest]), tau=np.zeros((len(time), 6)), com=com,
        angular_momentum=rest, margin=_margins(problem, trajectory, polytopes, time),
        support=schedule.support(time, names), contact_force=point_mass_forces(trajectory, time),
        contact_names=names, joint_names=(), margin_unit=problem.margin_unit,
    )  # fmt: skip


def _margins(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope],
    time: FloatArray,
) -> FloatArray:  # fmt: skip
    """(n,) margin in the phase of each instant; at a key instant the smaller of both phases."""
    schedule = trajectory.schedule
    starts = np.searchsorted(time, schedule.instants - 1e-9)
    owners = [np.arange(starts[k], starts[k + 1] + 1) for k in range(len(polytopes))]
    rows, phases = np.concatenate(owners), np.repeat(np.arange(len(polytopes)), [len(own) for own in owners])
    stances = [phase.stance for phase in schedule.sequence]
    wrench, com = trajectory.pseudo_wrench(time), trajectory.position(time)
    found = motion_margin(stances, phases, wrench[rows], com[rows], polytopes=polytopes)
    margin = np.full(len(time), np.inf)
    np.minimum.at(margin, rows, found.force if problem.margin_space == "force" else found.margin)
    return margin


def point_mass_forces(trajectory: CentroidalTrajectory, time: FloatArray) -> FloatArray:
    """(n, c, 6) contact forces at times (n,) [s], with moments about each contact's origin [N, N.m]."""
    schedule, names = trajectory.schedule, trajectory.schedule.sequence.effectors
    forces = np.zeros((len(time), len(names), 6))
    wrench, phases = trajectory.pseudo_wrench(time), schedule.phase_at(time)
    shares = load_shares(schedule, time, names)
    for number, phase in enumerate(schedule.sequence):
        corners, columns = _Corners(phase.stance), [names.index(name) for name in phase.stance.effectors]
        for sample in np.flatnonzero(phases == number):
            forces[sample, columns] = corners.share(wrench[sample], shares[sample, columns])
    return forces


class _Corners:
    """The edges of the friction pyramids at every corner of one stance."""

    def __init__(self, stance: Stance) -> None:
        generators = ContactGenerators.of(stance, grasp_moments=False)
        self._owner = generators.contact
        limited = np.isfinite(generators.upper)
        self._unit, self._upper = np.where(limited, generators.upper, 1.0), np.where(limited, 1.0, 1e30)
        self._wrenches = self._unit * generators.about(np.zeros(3))
        self._places = [contact.position for contact in stance]
        # Sums of the normal forces, and what caps each.
        capped = [
            (self._owner == number, contact.normal_force_cap)
            for number, contact in enumerate(stance)
            if contact.kind is not ContactKind.GRASP and contact.normal_force_cap is not None
        ]
        if stance.normal_force_cap is not None:
            capped.append((generators.normal, stance.normal_force_cap))
        self._limits = np.array([row for row, _ in capped], dtype=float).reshape(-1, len(self._owner))
        self._caps = np.array([cap for _, cap in capped])

    def share(self, wrench: FloatArray, shares: FloatArray) -> FloatArray:
        """(c, 6) forces and moments that supply the wrench about the world origin."""
        size, out = len(self._owner), np.zeros((len(self._places), 6))
        if not size:
            return out
        cost = np.diag(1.0 / shares[self._owner])
        solution = solve_qp(
            cost, np.zeros(size), np.vstack([self._wrenches, self._limits]),
            np.concatenate([wrench, np.full(len(self._caps), -1e30)]), np.concatenate([wrench, self._caps]),
            (np.zeros(size), self._upper), equalities=6,
        )  # fmt: skip
        magnitude = solution.x
        if not solution.solved:  # on the edge of what is possible rounding decides; least squares are near
            magnitude = np.maximum(np.linalg.lstsq(self._wrenches, wrench, rcond=None)[0], 0.0)
        for index, origin in enumerate(self._places):
            total = self._wrenches[:, self._owner == index] @ magnitude[self._owner == index]
            out[index] = [*total[:3], *(total[3:] - skew(origin) @ total[:3])]
        return out
