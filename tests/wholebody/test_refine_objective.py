"""Terms of the refinement against finite differences and against independent solutions."""

from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.contact_planning import Task, efort
from manikin.scene import Box, Obstacle, Proximity, Scene
from manikin.spatial import GRAVITY_VECTOR
from manikin.wholebody.banded import BlockBandedSystem, SampledBasis
from manikin.wholebody.knots import phase_knots, sample_times
from manikin.wholebody.refine_balance import BalanceRoom
from manikin.wholebody.refine_input import KeyPath
from manikin.wholebody.refine_measures import physics_violation
from manikin.wholebody.refine_objective import RefineObjective, refine_targets
from manikin.wholebody.refine_physics import ContactForces, about, centre_of
from manikin.wholebody.refine_scales import RefineScales

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}
LIMITS = {
    "stages", "max_iterations", "decrease", "iterations_per_round", "multiplier_rounds", "tolerance",
    "turn_tolerance", "joint_buffer", "safe_distance", "softness", "velocity_share", "margin",
    "margin_softness",
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
    knots = phase_knots(schedule.instants, 0.1, 5)
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
    rooms = tuple(BalanceRoom(phase.stance) for phase in schedule.sequence)
    objective = RefineObjective(person, Proximity(person, scene), targets, basis, rooms)
    shift = np.zeros((len(time), objective.task_rows))
    return objective.linearise(points, scales, shift)


@pytest.mark.parametrize(
    "term",
    [
        ("missing_wrench", "force"), ("margin_violation",), ("slide",), ("efort",), ("clearance",), ("guide",),
        ("end_position", "end_angle"), ("position", "approach"), ("rotation",), ("joint_velocity",), ("rest",),
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
