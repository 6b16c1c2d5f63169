"""Balance asked of linear programs, without polytopes or generators of forces.

At each instant the contacts must supply the wrench that the whole body needs.  The program finds contact
wrenches that do so and stay as far as they can inside the limits of every contact ([Qiu2012]_ 4.2.2):

    max s   such that   sum_i G_i w_i = b,   A_i w_i + s <= b_i,   sum of normal forces + s <= cap

``s >= 0`` exactly where the margin of ``b`` in the stance's wrench polytope is not negative.
"""

from itertools import pairwise

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_diag, coo_array, vstack

from manikin.balance.limits import contact_limits
from manikin.contact import Contact, ContactKind, ContactSchedule, FrictionModel, Stance
from manikin.spatial import FloatArray, wrench_map
from manikin.wholebody.refine_physics import centre_of

TOGETHER = 50
"""Instants that one program holds side by side."""


def contact_slack(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> FloatArray:
    """(n,) room that the limits of all contacts have in common, in the units of their rows [N, N.m].

    Args:
        schedule: Contacts in time.
        time: (n,) [s].
        wrench: (n, 6) needed by the whole body, about the world origin.

    Returns:
        Negative where no admissible contact forces supply the wrench; minus infinity without any contact.
    """
    phases, slack = schedule.phase_at(time), np.full(len(time), -np.inf)
    for number, phase in enumerate(schedule.sequence):
        rows = np.flatnonzero(phases == number)
        if len(phase.stance) == 0:
            continue
        program = _Program(phase.stance)
        edges = [*range(0, len(rows), TOGETHER), len(rows)]
        for start, end in pairwise(edges):
            slack[rows[start:end]] = program.solve(wrench[rows[start:end]])
    return slack


class _Program:
    """The program of one stance; its unknowns are the contacts' wrenches and the slack."""

    def __init__(self, stance: Stance) -> None:
        self._centre = centre_of(stance)
        parts = [_limits(contact, stance.friction_model) for contact in stance]
        maps = [_map(contact, self._centre) for contact in stance]
        self._balance = np.hstack([*maps, np.zeros((6, 1))])
        limits = np.zeros((sum(len(part[1]) for part in parts), self._balance.shape[1]))
        row = column = 0
        for (left, right), item in zip(parts, maps, strict=True):
            width = item.shape[1]
            limits[row : row + len(right), column : column + width] = left[:, :width]
            row, column = row + len(right), column + width
        limits[:, -1] = 1.0
        bound = np.concatenate([right for _, right in parts])
        if stance.normal_force_cap is not None:
            limits, bound = self._capped(stance, maps, limits, bound)
        self._limits, self._bound = limits, bound

    def _capped(
        self, stance: Stance, maps: list[FloatArray], limits: FloatArray, bound: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        row, column = np.zeros(limits.shape[1]), 0
        for contact, item in zip(stance, maps, strict=True):
            row[column + 2] = contact.kind is not ContactKind.GRASP
            column += item.shape[1]
        row[-1] = 1.0
        return np.vstack([limits, row]), np.append(bound, stance.normal_force_cap or 0.0)

    def solve(self, wrench: FloatArray) -> FloatArray:
        """(n,) slack at wrenches (n, 6) about the world origin."""
        n, width = len(wrench), self._balance.shape[1]
        cost = np.tile(np.append(np.zeros(width - 1), -1.0), n)
        equal = block_diag([coo_array(self._balance)] * n)
        below = block_diag([coo_array(self._limits)] * n)
        wanted = (wrench @ wrench_map(self._centre).T).ravel()
        found = linprog(
            cost, A_ub=vstack([below]), b_ub=np.tile(self._bound, n), A_eq=equal, b_eq=wanted,
            bounds=(None, None), method="highs",
        )  # fmt: skip
        if found.status != 0:  # too few directions of force: no slack whatever its size
            return self._one_by_one(wrench)
        return found.x[width - 1 :: width]

    def _one_by_one(self, wrench: FloatArray) -> FloatArray:
        if len(wrench) == 1:
            return np.array([-np.inf])
        return np.concatenate([self.solve(row[None]) for row in wrench])


def _map(contact: Contact, centre: FloatArray) -> FloatArray:
    """(6, 3 or 6) from a contact's wrench in the frame of its limits to one about the centre."""
    grasped = contact.kind is ContactKind.GRASP
    rotation = np.eye(3) if grasped else contact.rotation_contact_to_world
    moved = wrench_map(centre - contact.position) @ np.kron(np.eye(2), rotation)
    forces_only = contact.kind is ContactKind.POINT or (grasped and contact.max_moment == 0.0)
    return moved[:, :3] if forces_only else moved


def _limits(contact: Contact, model: FrictionModel) -> tuple[FloatArray, FloatArray]:
    """Rows (k, 6) and bounds (k,) of a contact, without those of moments that it does not have."""
    limits = contact_limits(contact, model)
    if contact.kind is ContactKind.GRASP and contact.max_moment == 0.0:
        kept = np.any(limits.A[:, :3] != 0.0, axis=1)
        return limits.A[kept], limits.b[kept]
    return limits.A, limits.b
