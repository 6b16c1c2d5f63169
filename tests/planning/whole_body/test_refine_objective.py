"""Terms of the refinement against finite differences and against independent solutions."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize

from manikin.balance import wrench_polytope
from manikin.balance.contact_forces import ContactGenerators, friction_share
from manikin.contact import (
    FRICTION_MODELS,
    ContactKind,
    ContactSchedule,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    sole,
)
from manikin.kinematics.efort import Task, efort
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.numerics.spatial import rotation_from_yaw, wrench_map
from manikin.planning.whole_body.fit_job import phase_knots, sample_times
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.refine_contacts import LimbDirections, efort_with_derivative
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.refine_measures import physics_violation, room_of
from manikin.planning.whole_body.refine_objective import RefineObjective, refine_targets
from manikin.planning.whole_body.refine_physics import MarginCost, RefinedForces, centre_of
from manikin.scene import Box, Obstacle, Proximity, Scene

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}
LIMITS = {
    "stages", "max_iterations", "decrease", "constrained_steps", "constrained_decrease", "multiplier_rounds",
    "restoring_steps", "tolerance", "joint_buffer", "safe_distance", "softness", "velocity_share", "margin",
    "margin_softness", "touching", "knee_flexion",
}  # fmt: skip
OFF = {item.name: 1e9 for item in fields(RefineScales) if item.name not in LIMITS}
"""Scales at which no term matters."""


@pytest.fixture(scope="module")
def stance():
    return Stance(
        [
            sole("left_foot", (0.0, 0.1, 0.0), **SIZE),
            sole("right_foot", (0.1, -0.1, 0.0), **SIZE),
            grasp("right_hand", (0.4, -0.3, 1.1), max_force=300.0, max_moment=10.0),
        ],
        1500.0,
    )


@pytest.fixture(scope="module")
def setup(person, stance):
    """A body that flails, in a flight of its left foot between two stances."""
    rng = np.random.default_rng(7)
    alone = Stance([stance["right_foot"], stance["right_hand"]], 1500.0)
    schedule = ContactSchedule(
        StanceSequence([Phase(stance), Phase(alone), Phase(stance)]), [0.0, 0.15, 0.35, 0.5]
    )
    knots = phase_knots(schedule.instants, 0.1)
    basis = SampledBasis.at(sample_times(knots, 2), knots, 5)
    points = np.tile(person.standing_posture(), (basis.size, 1))
    points[:, 3:7] = [0.1, -0.2, 0.3, 0.9]
    points[:, :3] += 0.05 * rng.normal(size=(basis.size, 3))
    points[:, 7:] += 0.3 * rng.normal(size=(basis.size, person.nq - 7))
    bar = Obstacle("bar", Box((0.05, 0.4, 0.05)), translation=(0.4, -0.3, 1.1))
    table = Obstacle("table", Box((0.5, 0.5, 0.4)), translation=(0.2, 0.1, 0.3))
    path = KeyPath([0.0, 0.5], points[[0, -1]])
    return schedule, path, knots, basis, points, rng.normal(size=points.shape), Scene([bar, table])


def linearise(person, setup, scales, points):
    schedule, path, knots, basis, _, _, scene = setup
    time = sample_times(knots, 2)
    task = Task((0.3, 0.2, 0.9))
    targets = refine_targets(person, scene, path, schedule, time, scales, task)
    rooms = tuple(MarginCost(phase.stance) for phase in schedule.sequence)
    objective = RefineObjective(person, Proximity(person, scene), targets, basis, rooms)
    shift = np.zeros((len(time), objective.task_rows))
    return objective.linearise(points, scales, shift)


@pytest.mark.parametrize(
    "term",
    [
        ("missing_wrench", "force"), ("margin_violation",), ("slide",), ("efort",), ("clearance",),
        ("guide", "guide_position"), ("toes",), ("straight",), ("end_position", "end_angle"),
        ("position", "approach"), ("rotation",), ("joint_velocity",), ("rest",),
        ("acceleration", "pelvis_acceleration"),
    ],
    ids=lambda names: names[0],
)  # fmt: skip
def test_gradient_agrees_with_finite_differences(term, person, setup):
    """Central differences with h = 1e-6; the relative error of an exact gradient is below 1e-5."""
    _, _, _, basis, points, direction, _ = setup
    usual = RefineScales()
    scales = replace(usual, **{**OFF, **{name: getattr(usual, name) for name in term}})
    system = BlockBandedSystem(basis, person.nq)
    linearise(person, setup, scales, points).assemble(system)
    exact = -float(np.sum(system._right * direction))
    h = 1e-6
    costs = [linearise(person, setup, scales, points + sign * h * direction).cost for sign in (1.0, -1.0)]
    assert exact != 0.0
    assert exact == pytest.approx((costs[0] - costs[1]) / (2 * h), rel=1e-5, abs=1e-4)


def test_forces_solve_their_program(stance):
    """The multiplier method against a bounded least-squares solver, on wrenches inside and outside."""
    names, rng = stance.effectors, np.random.default_rng(3)
    forces = RefinedForces(stance, names)
    wrench = np.array([0.0, 0.0, 775.0, 0.0, -30.0, 0.0]) + rng.normal(size=(20, 6)) * [300.0] * 3 + [0] * 6
    variables = rng.uniform(0.05, 1.0, (20, 3))
    found = forces.share(wrench, variables, tolerance=10.0, force=775.0)
    for k in range(20):
        gain = 775.0 * variables[k][forces.columns]
        stacked = np.vstack([forces._matrix / 10.0, np.diag(1.0 / gain)])
        wanted = np.concatenate([forces._to_local @ wrench[k] / 10.0, np.zeros(len(gain))])
        other = lsq_linear(stacked, wanted, (0.0, forces._limit), method="bvls", tol=1e-14)
        assert found.cost.value[k] == pytest.approx(other.cost, rel=1e-8)
    assert np.all(found.magnitude >= 0.0)
    assert np.all(found.magnitude <= forces._limit)


def test_a_standing_wrench_is_supplied_and_a_falling_one_is_not(stance):
    """What a body in free fall needs is nothing, what one pulled up by nothing needs is all missing."""
    forces = RefinedForces(Stance([]), ())
    fall = forces.share(np.zeros((1, 6)), np.zeros((1, 0)), tolerance=10.0, force=775.0)
    hang = forces.share(np.array([[0.0, 0, 775, 0, 0, 0]]), np.zeros((1, 0)), tolerance=10.0, force=775.0)
    np.testing.assert_allclose(fall.missing, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(hang.missing), 775.0)
    stand = RefinedForces(stance, stance.effectors).share(
        np.array([[0.0, 0.0, 775.0, 0.0, -0.05 * 775.0, 0.0]]), np.ones((1, 3)), tolerance=10.0, force=775.0
    )
    assert np.linalg.norm(stand.missing) < 0.1


def test_violation_is_the_distance_to_what_forces_can_supply(stance):
    """Distance to the wrench polytope against the same distance found over contact forces with their caps."""
    free = Stance(stance.contacts[:2], 1500.0)
    room, centre = MarginCost(free), centre_of(free)
    rng = np.random.default_rng(5)
    wrench = np.array([0.0, 0.0, 775.0, 0.0, 0.0, 0.0]) + 400.0 * rng.normal(size=(6, 6))
    forces = RefinedForces(free, free.effectors)
    matrix = np.repeat([1.0, 0.25], 3)[:, None] * forces._matrix
    normal = forces._matrix[2]
    for target, found in zip(wrench, physics_violation(room, wrench), strict=True):

        def square(x, target=target):
            return 0.5 * float(np.sum((matrix @ x - target) ** 2))

        def slope(x, target=target):
            return matrix.T @ (matrix @ x - target)

        best = minimize(
            square, np.full(matrix.shape[1], 20.0), jac=slope, bounds=[(0.0, None)] * matrix.shape[1],
            constraints={"type": "ineq", "fun": lambda x: 1500.0 - normal @ x},
            method="SLSQP", options={"maxiter": 1000, "ftol": 1e-12},
        )  # fmt: skip
        assert found == pytest.approx(np.sqrt(2.0 * best.fun), rel=1e-3, abs=0.1)
    inside = wrench_polytope(free, reference=centre).inscribed_ball()[0]
    assert physics_violation(room, inside[None])[0] == 0.0


def test_margin_is_that_of_the_wrench_polytope(stance):
    room, rng = MarginCost(stance), np.random.default_rng(2)
    wrench = np.array([0.0, 0.0, 775.0, 0.0, 0.0, 0.0]) + 50.0 * rng.normal(size=(8, 6))
    com = np.array([0.02, -0.03, 0.9]) + 0.1 * rng.normal(size=(8, 3))
    expected = [
        float(wrench_polytope(stance, reference=x).margin(wrench_map(x) @ w))
        for w, x in zip(wrench, com, strict=True)
    ]
    np.testing.assert_allclose(room.margin(wrench, com), expected, rtol=1e-9)


def test_efort_is_that_of_the_contact_planner(person):
    """One limb on a slope: the same alpha as from its J J^T."""
    rng = np.random.default_rng(4)
    jacobian = rng.normal(size=(3, 6, person.nv))
    chain, joints = np.arange(14), np.arange(9, 14)
    direction, normal = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.6, 0.8])
    limb = LimbDirections(joints, np.tile(direction, (3, 1)), np.tile(normal, (3, 1)))
    alpha, _ = efort_with_derivative(limb, jacobian, chain)
    own = jacobian[:, :3, joints]
    expected = efort(own @ own.transpose(0, 2, 1), direction, np.tile(normal, (3, 1)))
    np.testing.assert_allclose(alpha, expected, rtol=1e-12)


@pytest.mark.parametrize("model", FRICTION_MODELS)
def test_forces_of_the_refinement_keep_to_the_friction_model_of_the_stance(model):
    """Wrenches with more tangential force than any pyramid holds: every contact is on the side of its own."""
    feet = [
        sole("left_foot", (0.0, 0.1, 0.0), length=0.28, width=0.12, friction=0.3),
        sole("right_foot", (0.3, -0.1, 0.0), 0.4, length=0.28, width=0.12, friction=0.3),
    ]
    stance = Stance(feet, 1500.0, model)
    rng = np.random.default_rng(0)
    force = np.array([0.0, 0.0, 700.0]) + rng.normal(scale=400.0, size=(50, 3)) * [1.0, 1.0, 0.1]
    wrench = np.hstack([force, np.cross([0.15, 0.0, 0.9], force)])
    forces = RefinedForces(stance, stance.effectors)
    magnitude = forces.share(wrench, np.ones((50, 2)), tolerance=2.0, force=700.0).magnitude
    generators = ContactGenerators.of(stance)
    shares = []
    for number, contact in enumerate(feet):
        own = generators.contact == number
        shares.append(friction_share(contact, magnitude[:, own] @ generators.force[own], model))
    assert np.max(shares) == pytest.approx(1.0, abs=1e-9)


def test_cost_of_balance_does_not_depend_on_where_the_scene_stands(stance):
    """Moved by (10, -7, 0) m and turned by 37 degrees: cost, margin and wanted margin to 1e-6 relative."""
    turn, shift = rotation_from_yaw(np.deg2rad(37.0)), np.array([10.0, -7.0, 0.0])
    free = Stance(stance.contacts[:2], 1500.0)
    there = []
    for contact in free:
        rotation = turn @ contact.rotation_contact_to_world
        place = turn @ contact.position + shift
        there.append(replace(contact, position=place, rotation_contact_to_world=rotation))
    rng = np.random.default_rng(2)
    com = np.array([0.02, -0.03, 0.9]) + 0.05 * rng.normal(size=(8, 3))
    force = np.array([0.0, 0.0, 775.0]) + 30.0 * rng.normal(size=(8, 3))
    wrench = np.hstack([force, np.cross(com, force)])
    com_there, force_there = com @ turn.T + shift, force @ turn.T
    wrench_there = np.hstack([force_there, np.cross(com_there, force_there)])
    first, second = MarginCost(free), MarginCost(free.with_contacts(there))
    np.testing.assert_allclose(second.margin(wrench_there, com_there), first.margin(wrench, com), rtol=1e-6)
    wanted = first.wanted(22.0, com[0])
    assert second.wanted(22.0, com_there[0]) == pytest.approx(wanted, rel=1e-6)
    here = first.cost(wrench, com, wanted, 1.0, 3.0)
    moved = second.cost(wrench_there, com_there, wanted, 1.0, 3.0)
    np.testing.assert_allclose(moved.value, here.value, rtol=1e-6)


def test_the_wanted_room_is_that_of_smaller_soles(stance):
    """A share of the soles' length and width is kept about their middles; what else is held stays."""
    smaller = room_of(stance, 0.8, 0.7)
    for contact, kept in zip(stance, smaller.polytope.stance, strict=True):
        assert kept.friction == pytest.approx(0.8 * contact.friction)
        assert kept.centre == pytest.approx(contact.centre)
        size = 0.7 if contact.kind is ContactKind.SOLE else 1.0
        assert np.ptp(kept.points, axis=0) == pytest.approx(size * np.ptp(contact.points, axis=0))
