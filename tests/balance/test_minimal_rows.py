"""Every facet once, none missing, however the last digits of the contacts' positions fall."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from manikin.balance import wrench_polytope
from manikin.contact import ContactKind, SolePart, Stance, grasp, point, sole, sole_part
from manikin.numerics.spatial import rotation_from_rpy

CAP = 1500.0
SHOE = {"length": 0.28, "width": 0.12, "friction": 0.7}
LEFT = sole("left_foot", (0.0, 0.1, 0.0), **SHOE)
RIGHT = sole("right_foot", (0.0, -0.1, 0.0), **SHOE)
HAND = grasp("right_hand", (0.4, -0.2, 1.1), max_force=100.0)
WALLS = {"length": 0.1, "width": 0.4, "friction": 1.0}

STANCES = {
    "one sole": [LEFT],
    "two soles": [LEFT, RIGHT],
    "a step up": [LEFT, sole("right_foot", (0.4, -0.1, 0.2), **SHOE)],
    "a turned step": [LEFT, sole("right_foot", (0.4, -0.1, 0.2), 0.3, **SHOE)],
    "two soles and a hand": [LEFT, RIGHT, HAND],
    "two soles and a hand that turns": [LEFT, RIGHT, replace(HAND, max_moment=5.0)],
    "a sole and a hand that turns": [LEFT, replace(HAND, max_moment=5.0)],
    "a hand on a wall": [
        LEFT, RIGHT,
        point("left_hand", (0.5, 0.0, 1.2), friction=0.5, normal=(-1, 0, 0), normal_force_cap=150.0),
    ],
    "feet on two walls": [sole(f"foot{x:+g}", (x, 0, 0.85), normal=(-x, 0, 0), **WALLS) for x in (1.0, -1.0)],
    "a heel's edge and a sole": [sole_part(LEFT, SolePart.HEEL, 0.07), RIGHT],
    "toes and a sole": [sole_part(LEFT, SolePart.TOES, 0.07), RIGHT],
    "four points": [point(f"p{x}{y}", (x, y, 0.0), friction=0.7) for x in (-0.1, 0.1) for y in (-0.1, 0.1)],
    "a seat and two soles": [
        replace(LEFT, position=np.array([0.5, 0.1, 0.0])),
        replace(RIGHT, position=np.array([0.5, -0.1, 0.0])),
        sole("pelvis", (0.0, 0.0, 0.45), length=0.3, width=0.3, friction=0.5),
    ],
}  # fmt: skip
MANY = {"two soles and a hand that turns", "a turned step", "a hand on a wall"}
"""Names of those with many rows, whose kinds of contacts others have as well."""

names = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] if name in MANY else []) for name in STANCES]
)


def centre(contacts):
    return np.mean([contact.position for contact in contacts], axis=0)


def facet_radius(W, row):
    """Radius of the largest ball of dimension 5 in a facet: 0 for a row that is not needed."""
    others = np.arange(len(W)) != row
    sine = np.sqrt(np.maximum(0.0, 1.0 - (W.H[others] @ W.H[row]) ** 2))
    answer = linprog(
        np.append(np.zeros(6), -1.0),
        A_ub=np.column_stack([W.H[others], sine]),
        b_ub=W.h[others] / CAP,  # the solver's absolute tolerance is 1e-7
        A_eq=np.append(W.H[row], 0.0)[None],
        b_eq=[W.h[row] / CAP],
        bounds=(None, None),
        method="highs",
    )
    return CAP * answer.x[-1]


@names
def test_every_row_is_needed_and_tight(name, contact_program):
    """A facet holds a ball, so no row follows from the others; forces at the contacts reach it."""
    contacts = STANCES[name]
    W = wrench_polytope(Stance(contacts, CAP), reference=centre(contacts))
    program = contact_program(W.stance, reference=W.reference)
    for row in range(len(W)):
        assert facet_radius(W, row) > 0.1
        assert program.support(W.H[row])[0] == pytest.approx(W.h[row], abs=2e-4)


@names
@settings(max_examples=15)
@given(
    st.integers(0, 100_000),
    st.sampled_from([0.0, 1.0, 100.0]),
    st.sampled_from([0.0, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11]),
)
def test_facets_do_not_depend_on_rounding(name, seed, distance, noise):
    """Turned, moved far away, listed in another order and shaken by noise [m]: the same facets."""
    contacts = STANCES[name]
    base = wrench_polytope(Stance(contacts, CAP), reference=centre(contacts))
    rng = np.random.default_rng(seed)
    held = any(contact.kind is ContactKind.GRASP for contact in contacts)  # in a box along the world's axes
    turn = rotation_from_rpy(0.0, 0.0, rng.integers(4) * np.pi / 2 if held else rng.uniform(-3, 3))
    shift = distance * rng.normal(size=3)
    moved = [
        replace(
            contact,
            position=turn @ contact.position + shift + noise * rng.normal(size=3),
            rotation_contact_to_world=turn @ contact.rotation_contact_to_world,
        )
        for contact in contacts
    ]
    moved = [moved[i] for i in rng.permutation(len(moved))]
    W = wrench_polytope(Stance(moved, CAP), reference=turn @ centre(contacts) + shift)
    expected = np.hstack([base.H[:, :3] @ turn.T, base.H[:, 3:] @ turn.T])
    gap = np.abs(W.H[:, None] - expected[None]).max(axis=-1)
    assert len(W) == len(base)
    # Shoes are 0.1 m wide: 1e-11 m turn a facet by 1e-10, and a force of 1500 N by 1e-7 N.
    np.testing.assert_array_less(gap.min(axis=0), 1e-8)
    np.testing.assert_allclose(W.h[gap.argmin(axis=0)], base.h, atol=1e-5)
