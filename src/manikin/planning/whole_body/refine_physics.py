"""Physics violation: the wrench that a motion needs and that no admissible contact force supplies.

The contact forces of each sample are the solution of a quadratic program ([Tonneau2015]_ 7.3.1, in the
form of [Mordatch2012]_):

    min_x |b - A x|^2 / (2 s^2) + sum_j (k x_j / c_j)^2 / 2,   0 <= x_j <= u_j,

with the wrench ``b`` that the whole body needs, the edges ``A`` of the friction pyramids and the axes of
the grasps, and the contact variable ``c_j`` of each: the larger it is, the less its force costs.  Here it
rises and falls within the time that the contact is held.  Caps on sums of forces are left to the margin.

What this program allows may lie on the very edge of what friction and soles admit.  Therefore the distance
to every facet of the stance's wrench polytope ([Qiu2012]_ 4.36), its caps included and moments about the CoM,
is wanted to be larger than a margin.

The finished motion is checked by linear programs, without polytopes or generators of forces: at each instant
the contacts must supply the wrench that the whole body needs and stay as far as they can inside their
limits ([Qiu2012]_ 4.2.2),

    max s   such that   sum_i G_i w_i = b,   A_i w_i + s <= b_i,   sum of normal forces + s <= cap,

where ``s >= 0`` exactly where the margin of ``b`` in the stance's wrench polytope is not negative.
"""

from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.optimize import linprog
from scipy.sparse import block_diag, coo_array, vstack
from scipy.special import expit

from manikin.balance import stability_margins, wrench_polytope
from manikin.balance.contact_forces import ContactGenerators, share
from manikin.balance.friction import contact_limits
from manikin.balance.margin import wrench_levers
from manikin.contact import Contact, ContactKind, ContactSchedule, FrictionModel, Stance
from manikin.motion.dynamics import MomentumRate, MotionSamples
from manikin.numerics.spatial import GRAVITY_VECTOR, FloatArray, cross, skew, wrench_map
from manikin.planning.whole_body.fit_objective import to_raw

ARM = 0.25
"""Length that makes moments comparable with forces [m]."""

LEAST_VARIABLE = 0.05
"""Contact variables below this do not make a force any costlier."""


def needed_wrench(motion: MotionSamples, mass: float) -> tuple[MomentumRate, FloatArray]:
    """``[m (c'' - g); c x m (c'' - g) + L']`` (n, 6) [N, N.m] ([Qiu2012]_ 4.51) with its derivatives.

    The second result is (n, 3, nq), the derivative of the CoM by the raw coordinates.
    """
    rate, arm = motion.momentum, skew(motion.com)
    force = rate.value[:, :3] - mass * GRAVITY_VECTOR
    moment = rate.value[:, 3:] + np.cross(motion.com, force)
    first, second, third = (
        np.concatenate([part[:, :3], part[:, 3:] + arm @ part[:, :3]], axis=1) for part in rate.jacobians
    )
    by_com = to_raw(motion.com_jacobian, motion.tangent)
    first[:, 3:] -= skew(force) @ by_com
    return MomentumRate(np.hstack([force, moment]), (first, second, third)), by_com


def centre_of(stance: Stance) -> FloatArray:
    """(3,) mean position of the contacts; the world origin without any [m]."""
    return np.mean([contact.position for contact in stance], axis=0) if len(stance) else np.zeros(3)


class WrenchCost(NamedTuple):
    """A convex function of wrenches with its second-order model.

    Attributes:
        value: (n,).
        gradient: (n, 6).
        curvature: (n, 6, 6) positive semi-definite.
        by_com: (n, 3) derivative by the CoM at the same wrench.
    """

    value: FloatArray
    gradient: FloatArray
    curvature: FloatArray
    by_com: FloatArray


class ForceShare(NamedTuple):
    """Contact forces of many samples of one stance.

    Attributes:
        magnitude: (n, g) of each generator [N, N.m].
        missing: (n, 6) wrench that they do not supply, about the centre, moments divided by :data:`ARM` [N].
        cost: Least value of the program at the wrenches about the world origin, with its derivatives.
    """

    magnitude: FloatArray
    missing: FloatArray
    cost: WrenchCost


class RefinedForces:
    """The contact forces that a stance can give.

    Args:
        names: Effectors in the order of the contact variables' columns.

    Attributes:
        columns: (g,) column of each generator of forces.
    """

    def __init__(self, stance: Stance, names: tuple[str, ...]) -> None:
        self.centre, generators = centre_of(stance), ContactGenerators.of(stance)
        columns = [names.index(contact.effector) for contact in stance]
        scale = np.repeat([1.0, 1.0 / ARM], 3)[:, None]
        self._to_local, self._limit = scale * wrench_map(self.centre), generators.upper
        self._matrix = scale * generators.about(self.centre)
        self.columns = np.array(columns, dtype=np.int64)[generators.contact]

    def share(
        self, wrench: FloatArray, variables: FloatArray, *, tolerance: float, force: float
    ) -> ForceShare:
        """Solve the program for many samples at once, see :func:`~manikin.balance.contact_forces.share`.

        The gradient of the least value by ``b`` is the multiplier of the wrench, its second derivative the
        inverse of Newton's matrix.

        Args:
            wrench: (n, 6) needed, about the world origin.
            variables: (n, effectors) contact variables.
            tolerance: ``s``, missing wrench that costs one unit [N].
            force: ``1 / k``, force that costs one unit [N].
        """
        target = wrench @ self._to_local.T
        gain = (force * np.maximum(variables, LEAST_VARIABLE)[:, self.columns]) ** 2
        found = share(self._matrix, target, gain, tolerance**2, upper=self._limit)
        magnitude, multiplier = found.magnitude, found.multiplier
        value = 0.5 * tolerance**2 * np.sum(multiplier**2, axis=1)
        value += 0.5 * np.sum(magnitude**2 / gain, axis=1)
        curvature = self._to_local.T @ np.linalg.inv(found.system) @ self._to_local
        cost = WrenchCost(value, multiplier @ self._to_local, curvature, np.zeros((len(value), 3)))
        return ForceShare(magnitude, tolerance**2 * multiplier, cost)


class MarginCost:
    """The margin of one stance.

    Attributes:
        polytope: Its wrenches about the mean contact point.
        is_flat: Whether the stance's wrenches fill no volume, as without contacts or on two points.
    """

    def __init__(self, stance: Stance) -> None:
        self._to_local = wrench_map(centre_of(stance))
        self.polytope = wrench_polytope(stance, reference=centre_of(stance))
        # Radius of the largest ball in it below which it has no inside to stay in [N.m].
        self.is_flat = self.polytope.inscribed_ball()[1] < 1.0

    def wanted(self, margin: float, com: FloatArray) -> float:
        """A wanted margin, or 0.4 of the largest one of any wrench about a CoM (3,) if that is less [N.m]."""
        if self.is_flat:
            return margin
        return min(margin, 0.4 * self.polytope.at_reference(com).inscribed_ball()[1])

    def margin(self, wrench: FloatArray, com: FloatArray) -> FloatArray:
        """(n,) margin about the CoM (n, 3) of wrenches (n, 6) about the world origin [N.m]."""
        return stability_margins(self.polytope, wrench @ self._to_local.T, com).wrench_about_com

    def cost(
        self, wrench: FloatArray, com: FloatArray, wanted: float, violation: float, softness: float
    ) -> WrenchCost:
        """Softened squares of what the distances to the facets lack, with derivatives by wrench and CoM.

        Args:
            wrench: (n, 6) about the world origin, with CoM (n, 3).
            wanted: Margin, see :meth:`wanted` [N.m].
            violation: Missing margin that costs one unit [N.m].
            softness: Width of the bend of the penalty [N.m].
        """
        n = len(wrench)
        if self.is_flat:
            return WrenchCost(np.zeros(n), np.zeros((n, 6)), np.zeros((n, 6, 6)), np.zeros((n, 3)))
        H, arm = self.polytope.H, com - self.polytope.reference
        length = wrench_levers(H, arm)
        distance = self.polytope.distances(wrench @ self._to_local.T) / length
        near = np.flatnonzero(np.any(distance < wanted + 6.0 * softness, axis=0))
        rows, missing = H[near] @ self._to_local, (wanted - distance[:, near]) / softness
        residual, length = softness * np.logaddexp(0.0, missing) / violation, length[:, near]
        slope = expit(missing) / violation / length
        # A row's length l has the derivative (H1 + H2 arm^) x H2 / l by the CoM.
        moment, at_com = H[near, 3:], H[near, :3] + cross(H[near, 3:], arm[:, None, :])
        by_length = residual * slope * distance[:, near] / length
        outer = (rows[:, :, None] * rows[:, None, :]).reshape(len(near), 36)
        return WrenchCost(
            0.5 * np.sum(residual**2, axis=1),
            (residual * slope) @ rows,
            (slope**2 @ outer).reshape(n, 6, 6),
            np.einsum("nf,nfc->nc", by_length, cross(at_com, moment)),
        )


def contact_slack(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> FloatArray:
    """(n,) room that the limits of all contacts have in common, in the units of their rows [N, N.m].

    It is negative where no admissible contact forces supply the wrench; minus infinity without any contact.

    Args:
        time: (n,) [s].
        wrench: (n, 6) needed by the whole body, about the world origin.
    """
    phases, slack = schedule.phase_at(time), np.full(len(time), -np.inf)
    for number, phase in enumerate(schedule.sequence):
        if len(phase.stance) == 0:
            continue
        rows = np.flatnonzero(phases == number)
        program, to_centre = _slack_program(phase.stance), wrench_map(centre_of(phase.stance)).T
        for start in range(0, len(rows), 50):  # one program holds several instants side by side
            part = rows[start : start + 50]
            slack[part] = _solve_slack(program, wrench[part] @ to_centre)
    return slack


def _slack_program(stance: Stance) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows of the balance and of the limits, and bounds of these, on the contacts' wrenches and the slack."""
    parts = [_contact_rows(contact, centre_of(stance), stance.friction_model) for contact in stance]
    maps, blocks, bounds = zip(*parts, strict=True)
    limits = np.asarray(linalg.block_diag(*blocks), dtype=np.float64)
    bound = np.concatenate(bounds)
    if stance.normal_force_cap is not None:
        normal = [
            (contact.kind is not ContactKind.GRASP) * np.eye(item.shape[1])[2]
            for contact, item in zip(stance, maps, strict=True)
        ]
        limits = np.vstack([limits, np.concatenate(normal)])
        bound = np.append(bound, stance.normal_force_cap)
    balance = np.hstack([*maps, np.zeros((6, 1))])
    return balance, np.hstack([limits, np.ones((len(limits), 1))]), bound


def _solve_slack(program: tuple[FloatArray, FloatArray, FloatArray], wrench: FloatArray) -> FloatArray:
    """(n,) slack of one stance at wrenches (n, 6) about its centre."""
    balance, limits, bound = program
    n, width = len(wrench), balance.shape[1]
    found = linprog(
        np.tile(-np.eye(width)[-1], n), A_ub=vstack([block_diag([coo_array(limits)] * n)]),
        b_ub=np.tile(bound, n), A_eq=block_diag([coo_array(balance)] * n), b_eq=wrench.ravel(),
        bounds=(None, None), method="highs",
    )  # fmt: skip
    if found.status == 0:
        return found.x[width - 1 :: width]
    if n == 1:  # too few directions of force: no slack whatever its size
        return np.array([-np.inf])
    return np.concatenate([_solve_slack(program, row[None]) for row in wrench])


def _contact_rows(
    contact: Contact, centre: FloatArray, model: FrictionModel
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Map (6, m) of a contact's wrench to one about the centre, rows (k, m) and bounds (k,) of its limits.

    The wrench is in the frame of the limits, without moments, m = 3, where the contact has none.
    """
    grasped, limits = contact.kind is ContactKind.GRASP, contact_limits(contact, model)
    rotation = np.eye(3) if grasped else contact.rotation_contact_to_world
    moved = wrench_map(centre - contact.position) @ np.kron(np.eye(2), rotation)
    if grasped and contact.max_moment == 0.0:
        kept = np.any(limits.A[:, :3] != 0.0, axis=1)
        return moved[:, :3], limits.A[kept][:, :3], limits.b[kept]
    width = 3 if contact.kind is ContactKind.POINT else 6
    return moved[:, :width], limits.A[:, :width], limits.b
