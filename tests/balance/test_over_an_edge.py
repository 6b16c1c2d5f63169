"""Soles of which only a part lies on a surface: limits, margins and shares against independent programs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from manikin.balance import wrench_polytope
from manikin.balance.friction import contact_limits
from manikin.contact import Stance, roll_feet, sole, sole_part
from manikin.contact.contact import SolePart
from manikin.contact.stance import Phase, StanceSequence
from manikin.errors import ContactError
from manikin.numerics.spatial import rotation_from_rpy

SIZE = {"length": 0.28, "width": 0.10}
SIDES = {"outer": 4, "inner": 4, "cone": 8}


def friction_edges(friction: float, model: str) -> np.ndarray:
    """(k, 3) edges of the pyramid with unit normal force, from its definition."""
    if model == "outer":
        return np.array([[x, y, 1.0] for x in (friction, -friction) for y in (friction, -friction)])
    start = np.pi / 4 if model == "inner" else 0.0
    angle = start + 2.0 * np.pi * np.arange(SIDES[model]) / SIDES[model]
    return np.column_stack([friction * np.cos(angle), friction * np.sin(angle), np.ones(len(angle))])


def corner_wrenches(corners: np.ndarray, friction: float, model: str) -> np.ndarray:
    edges = friction_edges(friction, model)
    return np.array([np.concatenate([edge, np.cross(corner, edge)]) for corner in corners for edge in edges])


def supplied(generators: np.ndarray, wrench: np.ndarray) -> bool:
    """Whether non-negative multiples of the generators make a wrench."""
    return linprog(np.zeros(len(generators)), A_eq=generators.T, b_eq=wrench, method="highs").status == 0


@pytest.mark.parametrize("model", ["outer", "inner", "cone"])
def test_limits_of_a_polygon_are_those_of_forces_at_its_corners(model):
    """Wrenches well inside the rows are supplied by corner forces, those beyond them are not."""
    rng = np.random.default_rng(3)
    shapes = (
        [(-0.095, -0.05), (0.14, -0.05), (0.14, 0.05), (-0.095, 0.05)],
        [(-0.14, -0.05), (0.10, -0.05), (0.02, 0.05), (-0.14, 0.05)],
        [(-0.14, -0.05), (0.14, -0.02), (0.14, 0.05), (0.0, 0.05), (-0.14, 0.0)],
    )
    for shape in shapes:
        contact = sole("left_foot", (0.0, 0.0, 0.0), friction=0.6, polygon=shape, **SIZE)
        assert contact.hangs_over
        limits = contact_limits(contact, model)
        middle = contact.centre
        generators = corner_wrenches(contact.points - middle, 0.6, model)
        inside = outside = 0
        for _ in range(60):
            some = generators[rng.integers(len(generators), size=4)]
            wrench = rng.dirichlet(np.ones(4)) @ some + rng.normal(0.0, 0.03, 6) * [1, 1, 0, 1, 1, 1]
            worst = float((limits.A @ wrench - limits.b).max())
            if abs(worst) > 1e-6:
                assert supplied(generators, wrench) == (worst < 0.0)
                inside, outside = inside + (worst < 0.0), outside + (worst > 0.0)
        assert min(inside, outside) > 5


def test_the_polytope_of_a_stance_over_edges_is_that_of_forces_at_the_corners():
    """Largest force along random directions, against a linear program over the corners on the surface."""
    tread = np.array([(-0.095, -0.05), (0.14, -0.05), (0.14, 0.05), (-0.095, 0.05)])
    turn = rotation_from_rpy(0.05, -0.1, 0.8)
    contacts = [
        sole("left_foot", (0.1, 0.2, 0.15), rotation=turn, friction=0.7, polygon=tread, **SIZE),
        sole("right_foot", (-0.2, 0.0, 0.0), 0.2, friction=0.7, **SIZE),
    ]
    stance = Stance(contacts, 1500.0)
    polytope = wrench_polytope(stance)
    generators = []
    for contact in contacts:
        corners = (
            contact.points if contact.effector == "right_foot" else np.column_stack([tread, np.zeros(4)])
        )
        places = contact.position + corners @ contact.rotation_contact_to_world.T
        for place in places:
            for edge in friction_edges(0.7, "outer") @ contact.rotation_contact_to_world.T:
                generators.append(np.concatenate([edge, np.cross(place, edge)]))
    generators = np.array(generators)
    for direction in np.random.default_rng(8).normal(size=(20, 6)):
        highest = max(0.0, 1500.0 * float((generators @ direction).max()))
        found = linprog(-direction, A_ub=polytope.H, b_ub=polytope.h, bounds=(None, None), method="highs")
        assert -found.fun == pytest.approx(highest, rel=1e-6, abs=1e-6)


def test_a_polygon_of_the_whole_sole_is_the_sole():
    plain = sole("left_foot", (0, 0, 0), friction=0.7, **SIZE)
    whole = sole("left_foot", (0, 0, 0), friction=0.7, polygon=plain.points[[2, 0, 3, 1], :2], **SIZE)
    assert not whole.hangs_over
    assert np.array_equal(plain.points, whole.points)


def test_a_sole_over_an_edge_lands_and_leaves_flat():
    hanging = sole("left_foot", (0, 0.2, 0), polygon=[(-0.1, -0.05), (0.14, -0.05), (0.14, 0.05)],
                   friction=0.7, **SIZE)  # fmt: skip
    whole = sole("right_foot", (0, 0, 0), friction=0.7, **SIZE)
    sequence = StanceSequence([Phase(Stance(held), 0.6) for held in ([whole], [whole, hanging], [hanging])])
    parts = [{c.effector: c.part for c in phase.stance} for phase in roll_feet(sequence, 0.06)]
    assert all(part["left_foot"] is SolePart.FULL for part in parts if "left_foot" in part)
    assert any(part.get("right_foot") is SolePart.TOES for part in parts)
    with pytest.raises(ContactError, match="hangs over an edge"):
        sole_part(hanging, SolePart.HEEL, 0.06)


def test_soles_of_any_size_over_an_edge_roll_in_the_same_phases():
    """Random cuts of a sole, and what is drawn together about its middle, as planning balances on it.

    Taken alone, some soles of one size rise onto their toes and those of the other do not.
    """
    whole = sole("right_foot", (0, 0, 0), friction=0.7, **SIZE)
    corners = whole.points[np.argsort(np.arctan2(whole.points[:, 1], whole.points[:, 0])), :2]
    rng, alone = np.random.default_rng(0), 0
    for _ in range(300):
        turn, offset = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.14)
        edge = np.array([np.cos(turn), np.sin(turn)])
        polygon = cut(corners, edge, offset)
        if len(polygon) < 3:
            continue
        hanging = sole("left_foot", (0, 0.2, 0), polygon=polygon, friction=0.7, **SIZE)
        points = hanging.centre + [0.8, 0.5, 1.0] * (hanging.points - hanging.centre)
        less = replace(hanging, points=points)
        one, other = (
            StanceSequence([Phase(Stance(held), 0.6) for held in ([sole_], [sole_, whole], [whole])])
            for sole_ in (hanging, less)
        )
        assert len(roll_feet(one, 0.06, other)) == len(roll_feet(other, 0.06, one))
        alone += len(roll_feet(one, 0.06)) != len(roll_feet(other, 0.06))
    assert alone > 0


def cut(corners, edge, offset):
    """Corners (k, 2) of what of a convex polygon, counter-clockwise, is below a line."""
    kept = []
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        first, second = here @ edge - offset, there @ edge - offset
        if first <= 0.0:
            kept.append(here)
        if first * second < 0.0:
            kept.append(here + first / (first - second) * (there - here))
    return kept


@pytest.mark.parametrize(
    ("polygon", "what"),
    [
        ([(-0.2, -0.05), (0.14, -0.05), (0.14, 0.05)], "beyond the sole"),
        ([(-0.1, 0.0), (0.1, 0.0)], "3 to 8"),
        ([(-0.1, -0.05), (0.1, -0.05), (0.0, 0.0), (0.1, 0.05)], "convex"),
    ],
)
def test_a_polygon_that_is_none_is_refused(polygon, what):
    with pytest.raises(ContactError, match=what):
        sole("left_foot", (0, 0, 0), friction=0.7, polygon=polygon, **SIZE)
