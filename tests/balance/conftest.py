"""The set of admissible wrenches as a linear program over contact forces, independent of the polytopes.

Unknowns are the forces at the contact points (and the wrench of a sole with a torsion
limit, of a grasp); nothing here knows pyramid edges, hulls or facets. Forces are counted
in kilonewtons inside, which the solver's absolute tolerances (1e-7) want.
"""

import numpy as np
import pytest
from scipy.optimize import linprog

from manikin.contact import ContactKind, Stance, grasp, point, sole
from manikin.numerics.spatial import skew

KILO = 1e3


class ContactProgram:
    """``w = grasp_matrix @ x`` with ``A x <= b`` and ``E x = 0`` for one stance."""

    def __init__(self, stance, friction_model="outer", reference=(0.0, 0.0, 0.0)):
        self.columns, self.A, self.b, self.E = [], [], [], []
        self.total = []
        self.friction_model = friction_model
        scale = 1.0 / np.sqrt(2.0) if friction_model == "inner" else 1.0
        reference = np.asarray(reference)
        for contact in stance:
            if contact.kind is ContactKind.GRASP:
                self._grasp(contact, reference)
            elif contact.torsion_limit is not None:
                self._sole_with_torsion(contact, reference, contact.friction * scale)
            else:
                self._points(contact, reference, contact.friction * scale)
        self.n = sum(c.shape[1] for c in self.columns)
        self.G = np.hstack(self.columns) if self.columns else np.zeros((6, 0))
        self.rows = [self._wide(row, at) for row, at in self.A]
        self.equalities = [self._wide(row, at) for row, at in self.E]
        self.bounds = list(self.b)
        if stance.normal_force_cap is not None and self.total:
            row = np.zeros(self.n)
            for part, at in self.total:
                row[at : at + len(part)] += part
            self.rows.append(row)
            self.bounds.append(stance.normal_force_cap)

    def _wide(self, part, at):
        row = np.zeros(self.n)
        row[at : at + len(part)] = part
        return row

    def _start(self):
        return sum(c.shape[1] for c in self.columns)

    def _points(self, contact, reference, mu):
        s, t, n = contact.rotation_contact_to_world.T
        first = self._start()
        cap = []
        for p in contact.points_in_world:
            at = self._start()
            self.columns.append(np.vstack([np.eye(3), skew(p - reference)]))
            for row in self._sides(s, t, n, mu):
                self.A.append((row, at))
                self.b.append(0.0)
            cap.append(n)
        cap = np.concatenate(cap)
        self.total.append((cap, first))
        if contact.normal_force_cap is not None:
            self.A.append((cap, first))
            self.b.append(contact.normal_force_cap)

    def _sides(self, s, t, n, mu):
        """Sides of the pyramid; an octagon with its corners at ``mu`` is the cone that is asked for."""
        if self.friction_model != "cone":
            return (s - mu * n, -s - mu * n, t - mu * n, -t - mu * n)
        angles = np.deg2rad(np.arange(22.5, 360.0, 45.0))
        return [np.cos(a) * s + np.sin(a) * t - mu * np.cos(np.pi / 8) * n for a in angles]

    def _sole_with_torsion(self, contact, reference, mu):
        s, t, n = contact.rotation_contact_to_world.T
        x, y, z = contact.length / 2, contact.width / 2, np.zeros(3)
        at = self._start()
        self.columns.append(
            np.block([[np.eye(3), np.zeros((3, 3))], [skew(contact.position - reference), np.eye(3)]])
        )
        rows = [np.r_[side, z] for side in self._sides(s, t, n, mu)]
        rows += [np.r_[-x * n, a * t] for a in (1, -1)] + [np.r_[-y * n, a * s] for a in (1, -1)]
        for row in rows:
            self.A.append((row, at))
            self.b.append(0.0)
        for a in (1, -1):
            for b in (1, -1):
                for c in (1, -1):
                    self.A.append((np.r_[z, a * n + b * mu * s + c * mu * t], at))
                    self.b.append(contact.torsion_limit)
        self.total.append((np.r_[n, z], at))
        if contact.normal_force_cap is not None:
            self.A.append((np.r_[n, z], at))
            self.b.append(contact.normal_force_cap)

    def _grasp(self, contact, reference):
        at = self._start()
        self.columns.append(
            np.block([[np.eye(3), np.zeros((3, 3))], [skew(contact.position - reference), np.eye(3)]])
        )
        for axis in range(6):
            row = np.zeros(6)
            row[axis] = 1.0
            limit = contact.max_force if axis < 3 else contact.max_moment
            for sign in (1.0, -1.0):
                self.A.append((sign * row, at))
                self.b.append(limit)

    def _solve(self, cost, extra_columns=0, A_eq=None, b_eq=None, bounds=(None, None)):
        b_eq = None if b_eq is None else np.asarray(b_eq) / KILO
        rows = np.array(self.rows).reshape(-1, self.n)
        rows = np.hstack([rows, np.zeros((len(rows), extra_columns))])
        answer = linprog(
            cost,
            A_ub=rows,
            b_ub=np.array(self.bounds) / KILO,
            A_eq=A_eq,
            b_eq=b_eq,
            bounds=bounds,
            method="highs",
        )
        assert answer.status in (0, 2), answer.message
        return answer

    def support(self, direction):
        """Largest ``direction @ w`` and a wrench that has it."""
        answer = self._solve(-(direction @ self.G))
        return -answer.fun * KILO, KILO * self.G @ answer.x

    def gap(self, wrench):
        """Smallest sum of |components| of a wrench missing from ``wrench``; 0 when it is admissible."""
        cost = np.concatenate([np.zeros(self.n), np.ones(12)])
        A_eq = np.hstack([self.G, np.eye(6), -np.eye(6)])
        lower = [None] * self.n + [0.0] * 12
        return self._solve(cost, 12, A_eq, wrench, [(bound, None) for bound in lower]).fun * KILO

    def reach(self, start, direction):
        """Largest t with ``start + t direction`` admissible; start must be, up to rounding."""
        # The last twelve unknowns make rounding good, at a price.
        cost = np.concatenate([np.zeros(self.n), [-1.0], np.full(12, 1e3)])
        A_eq = np.hstack([self.G, -direction[:, None], np.eye(6), -np.eye(6)])
        lower = [None] * (self.n + 1) + [0.0] * 12
        answer = self._solve(cost, 13, A_eq, start, [(bound, None) for bound in lower])
        return answer.x[self.n] * KILO


def make_random_stance(rng, kinds=("sole", "point", "grasp"), most=3, own_caps=False, tilt=0.5):
    """Make a stance with random poses, one of each four nearly level (1e-9 to 1e-4 off)."""
    nearly = rng.choice([0.0, 1e-9, 1e-6, 1e-4]) if rng.random() < 0.25 else 1.0
    contacts = []
    for i in range(int(rng.integers(1, most + 1))):
        position = rng.uniform(-0.5, 0.5, 3) * [1.0, 1.0, nearly]
        limits = {
            "friction": float(rng.choice([0.3, 0.7, rng.uniform(0.1, 1.2)])),
            "normal": np.array([0.0, 0.0, 1.0]) + nearly * tilt * rng.normal(size=3),
        }
        if own_caps and rng.random() < 0.7:
            limits["normal_force_cap"] = float(rng.choice([500.0, 800.0]))
        kind = rng.choice(kinds)
        if kind == "grasp":
            contacts.append(
                grasp(
                    f"hand_{i}",
                    position + np.array([0.0, 0.0, 1.0]),
                    max_force=100.0,
                    max_moment=float(rng.choice([0.0, 5.0])),
                )
            )
        elif kind == "point":
            contacts.append(point(f"point_{i}", position, **limits))
        else:
            yaw = float(rng.choice([0.0, np.pi / 2, rng.uniform(-3, 3)]))
            torsion = 10.0 if kind == "torsion" else None
            contacts.append(
                sole(f"foot_{i}", position, yaw, length=0.28, width=0.12, torsion_limit=torsion, **limits)
            )
    return Stance(contacts, 1000.0)


@pytest.fixture(scope="session")
def contact_program():
    return ContactProgram


@pytest.fixture(scope="session")
def random_stance():
    return make_random_stance


@pytest.fixture(scope="session")
def two_soles():
    return Stance(
        [
            sole("left_foot", (0.0, 0.1, 0.0), length=0.28, width=0.12, friction=0.7),
            sole("right_foot", (0.0, -0.1, 0.0), length=0.28, width=0.12, friction=0.7),
        ],
        1500.0,
    )
