"""Contacts that really carry: a margin is that of what touches in the engine, not of what was planned."""

import numpy as np
import pytest

from manikin.balance import pseudo_wrench
from manikin.balance.motion_margin import motion_margin
from manikin.contact import Stance, sole
from manikin.numerics.spatial import GRAVITY
from manikin.simulation.carrying import TOUCHING, CarriedPoints, CarryingContacts

MASS = 70.0
FEET = {
    name: sole(name, (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
    for name, y in (("left_foot", 0.1), ("right_foot", -0.1))
}
SEGMENTS = {"left_foot": ("left_foot", "left_toes"), "right_foot": ("right_foot", "right_toes")}
UP = np.array([0.0, 0.0, 1.0])


def touches(*rows):
    """Carried points of (segment, obstacle, position, normal force)."""
    return CarriedPoints(
        tuple(row[0] for row in rows), tuple(row[1] for row in rows),
        np.array([row[2] for row in rows], dtype=float).reshape(-1, 3), np.tile(UP, (len(rows), 1)),
        np.array([row[3] for row in rows], dtype=float), np.full(len(rows), 0.7),
    )  # fmt: skip


def pressed(name, force, corners=range(4)):
    """A flat foot whose corners carry equal shares."""
    points = FEET[name].points_in_world[list(corners)]
    return [(name, "floor", point, force / len(points)) for point in points]


def flat(name):
    return FEET[name].position, np.eye(3)


def stance_of(points, pose=flat, planned=FEET):
    return CarryingContacts(SEGMENTS, MASS).stance(points, pose, planned)


def margin(stance, com):
    return float(motion_margin([stance], [0], [pseudo_wrench(MASS, com, np.zeros(3))], [com]).margin[0])


def test_two_feet_that_carry_are_the_planned_stance():
    found = stance_of(touches(*pressed("left_foot", 300.0), *pressed("right_foot", 386.7)))
    assert list(found) == list(FEET.values())
    assert found.normal_force_cap == pytest.approx(3.0 * MASS * GRAVITY)


@pytest.mark.parametrize("force", [0.0, 0.5])
def test_planned_on_two_feet_and_carried_by_one_is_the_margin_of_one(force):
    """The plan says double support; in the engine the right foot hangs, or brushes with half a newton."""
    points = touches(*pressed("left_foot", 686.0), *(pressed("right_foot", force) if force else []))
    found = stance_of(points)
    assert found.effectors == ("left_foot",)
    com, cap = np.array([0.0, 0.1, 0.9]), 3.0 * MASS * GRAVITY
    assert margin(found, com) == pytest.approx(margin(Stance([FEET["left_foot"]], cap), com), rel=1e-12)
    assert margin(found, com) < margin(Stance(list(FEET.values()), cap), com)


def test_what_counts_as_carrying_goes_by_the_weight():
    """Half a newton is nothing under a person, and a quarter of the weight of a body of 0.2 kg."""
    points = touches(*pressed("left_foot", 1.5), *pressed("right_foot", 0.5))
    assert CarryingContacts(SEGMENTS, 0.2).stance(points, flat, FEET).effectors == ("left_foot", "right_foot")


def test_the_middle_of_two_feet_is_out_of_balance_on_one_of_them():
    """4 cm beyond the inner edge of the left foot: what the planned stance would call balanced."""
    com = np.array([0.0, 0.0, 0.9])
    assert margin(Stance(list(FEET.values()), 3.0 * MASS * GRAVITY), com) > 10.0
    assert margin(stance_of(touches(*pressed("left_foot", 686.0))), com) < -5.0


def test_what_carries_without_any_plan_counts_at_its_points():
    """The right foot has no contact in the plan at all; it carries, and holds the body between both."""
    points = touches(*pressed("left_foot", 400.0), *pressed("right_foot", 286.0))
    found = stance_of(points, planned={"left_foot": FEET["left_foot"]})
    assert found.effectors == ("left_foot", "right_foot on floor")
    com = np.array([0.0, 0.0, 0.9])
    both = Stance(list(FEET.values()), found.normal_force_cap)
    assert margin(found, com) == pytest.approx(margin(both, com), rel=1e-9)


def tilted(angle):
    """A left foot turned by an angle about its front edge, heel up [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    edge = FEET["left_foot"].position + np.array([0.14, 0.0, 0.0])
    return lambda _: (edge - rotation @ [0.14, 0.0, 0.0], rotation)


def test_of_a_foot_on_its_front_edge_only_the_edge_counts():
    """Its heel 5 mm high: no moment about the edge, so that alone it balances nothing behind the edge."""
    pose = tilted(np.arcsin(0.005 / 0.28))
    front = [0, 1]
    found = stance_of(touches(*pressed("left_foot", 686.0, front)), pose)
    (edge,) = found
    assert np.ptp(edge.points_in_world[:, 0]) < 1e-6
    assert np.ptp(edge.points_in_world[:, 1]) == pytest.approx(0.12)
    assert margin(found, np.array([0.0, 0.1, 0.9])) < -10.0
    both = stance_of(touches(*pressed("left_foot", 300.0, front), *pressed("right_foot", 386.0)),
                     lambda name: pose(name) if name == "left_foot" else flat(name))  # fmt: skip
    assert margin(both, np.array([0.06, 0.0, 0.9])) > 0.0


def test_a_corner_that_soft_contacts_lift_by_less_than_a_millimetre_still_touches():
    pose = tilted(np.arcsin(0.5 * TOUCHING / 0.28))
    found = stance_of(touches(*pressed("left_foot", 686.0, [0, 1])), pose)
    assert list(found) == [FEET["left_foot"]]


def test_a_foot_that_stands_beside_its_place_is_judged_where_it_stands():
    beside = np.array([0.0, 0.015, 0.0])
    rows = [(name, other, point + beside, force) for name, other, point, force in pressed("left_foot", 686.0)]
    found = stance_of(touches(*rows), lambda _: (FEET["left_foot"].position + beside, np.eye(3)))
    (moved,) = found
    assert np.allclose(moved.position, FEET["left_foot"].position + beside)
    com = np.array([0.0, 0.115, 0.9])
    centred = margin(Stance([FEET["left_foot"]], found.normal_force_cap), com - beside)
    assert margin(found, com) == pytest.approx(centred, rel=1e-9)


def test_a_knee_that_touches_carries_too():
    knee = [("left_shank", "step", (0.3, 0.1, 0.2), 200.0)]
    found = stance_of(touches(*pressed("left_foot", 486.0), *knee))
    assert found.effectors == ("left_foot", "left_shank on step")
    assert np.allclose(found["left_shank on step"].points_in_world, [[0.3, 0.1, 0.2]])


def test_nothing_carries_nothing():
    """In the air the only admissible wrench is zero: the margin is the negative weight about the CoM."""
    found = stance_of(touches())
    assert len(found) == 0
    com = np.array([0.0, 0.0, 1.0])
    assert margin(found, com) == pytest.approx(-MASS * GRAVITY)


def test_the_wrench_of_any_carried_points_is_inside_their_stance():
    """Random forces at random points of both soles, lifted corners and all: the margin is never lost."""
    rng = np.random.default_rng(0)
    carrying = CarryingContacts(SEGMENTS, MASS)
    for _ in range(40):
        rows = []
        for name, foot in FEET.items():
            inside = rng.uniform(-0.5, 0.5, (rng.integers(1, 6), 3)) * [0.28, 0.12, 0.0]
            rows += [(name, "floor", foot.position + point, rng.uniform(5.0, 300.0)) for point in inside]
        points = touches(*rows)
        high = {name: (foot.position + 0.01 * UP, np.eye(3)) for name, foot in FEET.items()}
        stance = carrying.stance(points, high.__getitem__, FEET)
        force = points.forces[:, None] * UP
        wrench = np.concatenate([force.sum(axis=0), np.cross(points.positions, force).sum(axis=0)])
        com = np.array([0.0, 0.0, 0.9])
        stance = Stance(list(stance), 1e5)
        # Contacts are kept as they were while they move by less than TOUCHING.
        assert motion_margin([stance], [0], [wrench], [com]).margin[0] > -TOUCHING * points.forces.sum()
