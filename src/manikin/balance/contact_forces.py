"""Forces that the contacts of a stance can give, and the sharing of a wrench among them.

Every contact force is a sum of generators with magnitudes from 0 to a bound: the edges of the friction
pyramid at each point of a sole or point, in the friction model of the stance, and the axes of a grasp
both ways. The wrench that is needed is shared among these generators by one quadratic program,

    min_x |b - A x|^2 / (2 e) + sum_j (x_j - l_j)^2 / (2 g_j),   0 <= x_j <= u_j,

with the wrench ``b``, the generators ``A``, a gain ``g`` (the larger, the less its force costs) and a
magnitude ``l`` to stay near to. With the multiplier ``y = (b - A x) / e`` of the wrench the magnitudes are
``x_j = clip(l_j + g_j a_j . y, 0, u_j)``, and ``y`` solves six monotone, piecewise linear equations.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from manikin.balance.friction import edges_in_world, pyramid_sides
from manikin.contact import Contact, ContactKind, ContactSchedule, FrictionModel, Stance
from manikin.numerics.spatial import FloatArray, cross

STEPS, HALVINGS = 40, 8
"""Newton steps after which a sample is left to a general solver, and times that one is halved."""
LEAST_NORMAL = 1.0
"""Smallest normal force that friction is a share of [N]."""
SOLVED = 1e-12
"""Error of the equations that is rounding, relative to the wrench."""


@dataclass(frozen=True, eq=False)
class ContactGenerators:
    """Force directions of a stance, each with a magnitude from 0 to :attr:`upper`.

    Attributes:
        point: (g, 3) where each acts [m].
        force: (g, 3) force of a unit magnitude in world axes; of unit normal force, for soles and points.
        couple: (g, 3) pure moment of a unit magnitude, of grasps that can hold one [m].
        contact: (g,) index of its contact in the stance.
        normal: (g,) normal force of a unit magnitude; 0 for grasps.
        upper: (g,) largest magnitude: the limits of a grasp, infinite for the others [N, N.m].
    """

    point: FloatArray
    force: FloatArray
    couple: FloatArray
    contact: NDArray[np.int64]
    normal: FloatArray
    upper: FloatArray

    @classmethod
    def of(
        cls, stance: Stance, points: Sequence[FloatArray] | None = None, *, grasp_moments: bool = True
    ) -> "ContactGenerators":
        """Generators of all contacts of a stance in its friction model.

        Args:
            points: Of each contact, (k, 3) points of the contact frame that carry force [m]; those of the
                contact when omitted.
            grasp_moments: Whether grasps may use their moments.
        """
        none, empty = np.zeros(0), np.zeros((0, 3))
        parts: list[tuple[np.ndarray, ...]] = [(empty, empty, empty, none.astype(np.int64), none, none)]
        for number, contact in enumerate(stance):
            local = contact.points if points is None else points[number]
            if contact.kind is ContactKind.GRASP:
                wrench = np.vstack([np.eye(6), -np.eye(6)])
                upper = np.tile(np.repeat([contact.max_force, contact.max_moment * grasp_moments], 3), 2)
                wrench, upper = wrench[upper > 0.0], upper[upper > 0.0]
                force, couple, normal = wrench[:, :3], wrench[:, 3:], np.zeros(len(wrench))
                point = np.tile(contact.position, (len(wrench), 1))
            else:
                rotation = contact.rotation_contact_to_world
                edges = edges_in_world(contact, stance.friction_model)
                force = np.tile(edges, (len(local), 1))
                point = np.repeat(contact.position + local @ rotation.T, len(edges), axis=0)
                couple, normal = np.zeros(force.shape), np.ones(len(force))
                upper = np.full(len(force), np.inf)
            parts.append((point, force, couple, np.full(len(force), number), normal, upper))
        return cls(*(np.concatenate(part) for part in zip(*parts, strict=True)))  # type: ignore[arg-type]

    def about(self, reference: FloatArray) -> FloatArray:
        """(6, g) wrenches of unit magnitudes in world axes about a point (3,) or points (g, 3) [m]."""
        return np.vstack([self.force.T, (cross(self.point - reference, self.force) + self.couple).T])


@dataclass(frozen=True, eq=False)
class SharedForces:
    """Solutions of the program for many wrenches.

    Attributes:
        magnitude: (n, g) of the generators.
        multiplier: (n, 6) of the wrench; ``e`` times it is what the magnitudes do not supply.
        system: (n, 6, 6) derivative of the wrench by the multiplier.
    """

    magnitude: FloatArray
    multiplier: FloatArray
    system: FloatArray


def share(
    generators: FloatArray, wrench: FloatArray, gain: FloatArray, softness: float, *,
    prior: FloatArray | float = 0.0, upper: FloatArray | float = np.inf,
) -> SharedForces:  # fmt: skip
    """Share wrenches among generators, for many samples at once.

    Newton's method on the six equations of each sample, from all generators free. It ends where the free
    generators stay the same, which is exact; a sample for which it does not is left to a general solver.

    Args:
        generators: (6, g) wrench of each unit magnitude, ``A``.
        wrench: (n, 6) to be supplied, ``b``.
        gain: (n, g) of each magnitude, ``g``.
        softness: ``e``, of the wrench.
        prior: (n, g) magnitudes to stay near to, ``l``.
        upper: (g,) largest magnitudes, ``u``.
    """
    prior = np.broadcast_to(prior, gain.shape)
    upper = np.broadcast_to(upper, gain.shape[1:])
    problem = _Program(generators, wrench, gain, softness, prior, upper)
    free, full = np.ones(gain.shape, dtype=np.bool_), np.zeros(gain.shape, dtype=np.bool_)
    multiplier, error = np.zeros(wrench.shape), np.full(len(wrench), np.inf)
    magnitude, system = np.zeros(gain.shape), np.empty((len(wrench), 6, 6))
    rest = np.arange(len(wrench))
    for _ in range(STEPS):
        system[rest], aim = problem.newton(rest, free[rest], full[rest])
        reached = problem.step(rest, multiplier[rest], aim, error[rest])
        wanted = problem.wanted(rest, reached)
        now_full = wanted >= upper
        now_free = (wanted > 0.0) & ~now_full
        same = np.all((now_free == free[rest]) & (now_full == full[rest]), axis=1)
        free[rest], full[rest], multiplier[rest] = now_free, now_full, reached
        magnitude[rest] = np.clip(wanted, 0.0, upper)
        error[rest] = problem.error(rest, reached)
        done = same & np.all(reached == aim, axis=1)
        done |= error[rest] <= SOLVED * (1.0 + np.linalg.norm(wrench[rest], axis=1))
        rest = rest[~done]
        if len(rest) == 0:
            break
    for k in rest.tolist():
        magnitude[k], multiplier[k] = problem.solve_one(k)
    return SharedForces(magnitude, multiplier, system)


@dataclass(frozen=True, eq=False)
class _Program:
    """The program of :func:`share`; ``rows`` are the samples that are looked at."""

    A: FloatArray
    b: FloatArray
    gain: FloatArray
    softness: float
    prior: FloatArray
    upper: FloatArray

    def newton(
        self, rows: NDArray[np.int64], free: NDArray[np.bool_], full: NDArray[np.bool_]
    ) -> tuple[FloatArray, FloatArray]:
        """Newton's matrices (k, 6, 6), and the multipliers (k, 6) at which it aims."""
        weight = np.where(free, self.gain[rows], 0.0)
        system = (self.A * weight[:, None, :]) @ self.A.T + self.softness * np.eye(6)
        known = np.where(full, self.upper, 0.0) if full.any() else np.zeros(full.shape)
        known = np.where(free, self.prior[rows], known)
        missing = (self.b[rows] - known @ self.A.T)[:, :, None]
        aim: FloatArray = np.linalg.solve(system, missing)[:, :, 0].astype(np.float64, copy=False)
        return system, aim

    def step(
        self, rows: NDArray[np.int64], start: FloatArray, aim: FloatArray, error: FloatArray
    ) -> FloatArray:
        """(k, 6) multipliers as far towards the aim as the error falls."""
        reached, length = aim.copy(), np.ones(len(aim))
        for _ in range(HALVINGS):
            worse = self.error(rows, reached) > (1.0 - 1e-4 * length) * error
            if not worse.any():
                break
            length[worse] *= 0.5
            reached[worse] = (start + length[:, None] * (aim - start))[worse]
        return reached

    def wanted(self, rows: NDArray[np.int64], multiplier: FloatArray) -> FloatArray:
        """(k, g) magnitudes before they are clipped."""
        return self.prior[rows] + (multiplier @ self.A) * self.gain[rows]

    def error(self, rows: NDArray[np.int64], multiplier: FloatArray) -> FloatArray:
        """(k,) norm of the six equations."""
        magnitude = np.clip(self.wanted(rows, multiplier), 0.0, self.upper)
        return np.linalg.norm(magnitude @ self.A.T + self.softness * multiplier - self.b[rows], axis=1)

    def solve_one(self, row: int) -> tuple[FloatArray, FloatArray]:
        """Magnitudes (g,) and multiplier (6,) by a general solver."""
        weight, stiff = np.asarray(self.gain[row] ** -0.5), self.softness**-0.5
        stacked = np.vstack([stiff * self.A, np.diag(weight)])
        target = np.concatenate([stiff * self.b[row], weight * self.prior[row]])
        solution = lsq_linear(stacked, target, bounds=(0.0, self.upper), method="bvls", tol=1e-12).x
        magnitude: FloatArray = np.clip(solution, 0.0, self.upper).astype(np.float64)
        return magnitude, (self.b[row] - self.A @ magnitude) / self.softness


@dataclass(frozen=True)
class FrictionUse:
    """Largest share of a friction model's pyramid that a motion uses, by whom and when [s].

    1 is on one of the sides, 0 without soles and points.
    """

    model: FrictionModel
    share: float
    time: float
    effector: str

    def summary(self) -> dict[str, float | str]:
        """Plain values for a run's summary."""
        return {
            "model": self.model, "max_share": self.share, "time_s": self.time, "effector": self.effector,
        }  # fmt: skip


def friction_share(contact: Contact, contact_force: FloatArray, friction_model: FrictionModel) -> FloatArray:
    """(n,) share of its friction pyramid that the force (n, 3) [N] of a sole or point uses, in world axes.

    1 is on a side of the pyramid. A normal force below :data:`LEAST_NORMAL` counts as that much.
    """
    local = contact_force @ contact.rotation_contact_to_world
    sides = pyramid_sides(contact, friction_model)
    used = (local[:, :2] @ sides[:, :2].T).max(axis=1) / -sides[0, 2]
    return used / np.maximum(local[:, 2], LEAST_NORMAL)


def friction_use(
    schedule: ContactSchedule, time: FloatArray, names: Sequence[str], contact_force: FloatArray
) -> FrictionUse:
    """Largest share of the friction that contact forces of a motion use, in the model of its stances.

    Args:
        schedule: Contacts in time.
        time: (n,) [s].
        names: Effectors of the columns of the forces.
        contact_force: (n, c, 6) or (n, c, 3) in world axes [N].
    """
    phases = schedule.phase_at(time)
    most = FrictionUse(schedule.sequence[0].stance.friction_model, 0.0, 0.0, "")
    for number, phase in enumerate(schedule.sequence):
        rows, model = np.flatnonzero(phases == number), phase.stance.friction_model
        for contact in phase.stance:
            if contact.kind is ContactKind.GRASP or not len(rows):
                continue
            force = contact_force[rows, list(names).index(contact.effector), :3]
            shares = friction_share(contact, force, model)
            worst = int(np.argmax(shares))
            if shares[worst] > most.share:
                at = float(time[rows[worst]])
                most = FrictionUse(model, float(shares[worst]), at, contact.effector)
    return most
