"""The objective's gradients are exact, term by term."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.planning.whole_body.fit_job import phase_knots, sample_times
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import FitScales
from manikin.planning.whole_body.fit_targets import EffectorTarget, FitTargets
from manikin.scene import Box, Obstacle, Proximity, Scene

OFF = dict.fromkeys(
    (
        "position", "rotation", "com", "clearance", "joint_limit", "joint_velocity", "acceleration",
        "pelvis_acceleration", "force", "moment_share", "rest",
    ),
    1e9,
)  # fmt: skip
"""Scales at which no term matters."""


@pytest.fixture(scope="module")
def setup(person):
    rng = np.random.default_rng(7)
    knots = phase_knots(np.array([0.0, 0.4]), 0.1)
    time = sample_times(knots, 2)
    n = len(time)
    targets = FitTargets(
        time=time,
        schedule=ContactSchedule(
            StanceSequence(
                [Phase(Stance([sole("left_foot", [0.0, 0.1, 0.0], length=0.28, width=0.12, friction=0.7)]))]
            ),
            [0.0, 0.4],
        ),
        strength=False,
        effectors={
            name: EffectorTarget(
                rng.normal(size=(n, 3)),
                np.tile(np.eye(3), (n, 1, 1)),
                np.ones(n),
                np.ones(n),
                np.tile(np.eye(3), (n, 1, 1)),
                np.tile(pivot, (n, 1)),
            )
            for name, pivot in (("left_foot", np.zeros(3)), ("right_hand", np.array([0.07, 0.0, 0.05])))
        },
        com=rng.normal(size=(n, 3)),
        com_weight=np.where(rng.random(n) < 0.5, 1.0, 0.1),
        com_acceleration=rng.normal(size=(n, 3)),
        margin=np.full(n, 30.0),
        reference=np.tile(person.standing_posture(), (n, 1)),
        reference_scale=np.full(person.nv, np.inf),
        ignored=(frozenset(),) * n,
    )
    basis = SampledBasis.at(time, knots, 5)
    points = np.tile(person.standing_posture(), (basis.size, 1))
    points[:, 3:7] = [0.1, -0.2, 0.3, 0.9]
    points[:, :3] += 0.05 * rng.normal(size=(basis.size, 3))
    points[:, 7:] += 0.3 * rng.normal(size=(basis.size, person.nq - 7))
    direction = rng.normal(size=points.shape)
    scene = Scene([Obstacle("table", Box((0.5, 0.5, 0.4)), translation=(0.2, 0.1, 0.3))])
    return targets, basis, points, direction, scene


@pytest.mark.parametrize(
    "term",
    [
        "position", "rotation", "com", "clearance", "joint_limit", "acceleration", "force", "moment_share",
        "rest", "reference",
    ],
)  # fmt: skip
def test_gradient_agrees_with_finite_differences(term, setup, person):
    """Central differences with h = 1e-6; the relative error of an exact gradient is below 1e-5."""
    targets, basis, points, direction, scene = setup
    scales = {**OFF, **({term: getattr(FitScales(), term)} if term in OFF else {})}
    if term == "reference":
        targets = replace(targets, reference_scale=np.full(person.nv, 0.5))
    objective = MotionObjective(person, Proximity(person, scene), targets, basis)
    shift = np.zeros((len(targets.time), objective.task_rows))

    def evaluate(p):
        return objective.linearise(p, FitScales(**scales), shift)

    system = BlockBandedSystem(basis, person.nq)
    evaluate(points).assemble(system)
    exact = -float(np.sum(system._right * direction))
    h = 1e-6
    numeric = (evaluate(points + h * direction).cost - evaluate(points - h * direction).cost) / (2 * h)
    assert exact == pytest.approx(numeric, rel=1e-5, abs=1e-4)


def test_shifting_the_tasks_equals_linearising_with_the_shift(setup, person):
    targets, basis, points, _, _ = setup
    objective = MotionObjective(person, None, targets, basis)
    zero = np.zeros((len(targets.time), objective.task_rows))
    shift = np.random.default_rng(1).normal(size=zero.shape)
    moved = objective.linearise(points, FitScales(), zero)
    moved.shift_tasks(zero, shift)
    direct = objective.linearise(points, FitScales(), shift)
    assert moved.cost == pytest.approx(direct.cost, rel=1e-12)
    np.testing.assert_allclose(moved.gradient[0], direct.gradient[0], rtol=1e-9, atol=1e-6)


def test_the_clearance_beside_an_instant_is_that_of_the_samples_before_and_after_it(setup, person):
    """As measured posture by posture; to 1e-6 m, the tolerance of a least distance."""
    targets, basis, points, _, scene = setup
    proximity = Proximity(person, scene)
    objective = MotionObjective(person, proximity, targets, basis)
    q = objective._sampled(points).states.q
    before = 2
    instant = 0.5 * float(targets.time[before] + targets.time[before + 1])
    least = min(proximity.minimum(row).distance for row in q[before : before + 2])
    assert objective.clearance_beside(points, instant) == pytest.approx(least, abs=1e-6)
    assert MotionObjective(person, None, targets, basis).clearance_beside(points, instant) == np.inf
