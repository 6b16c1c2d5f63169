"""Whole-body planning of the platform scenario, its parts, and the whole run.

Run with ``pytest benchmarks/bench_wholebody.py``. The star to steer by: planning and checking
the motion takes no longer than the motion lasts (5.0 s).
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from manikin.balance.motion_forces import plan_forces
from manikin.numerics.banded import BlockBandedSystem
from manikin.pipeline.runner import run
from manikin.planning.com import plan_com
from manikin.planning.whole_body import plan_whole_body
from manikin.planning.whole_body.fit_job import key_instants
from manikin.planning.whole_body.fit_targets import ignored_pairs
from manikin.planning.whole_body.plan_whole_body import WholeBodySettings, _Goal, _Planner
from manikin.planning.whole_body.posture_style import READY
from manikin.scenarios import load_scenario
from manikin.scene import Proximity


@pytest.fixture(scope="module")
def platform():
    scenario = load_scenario("platform")
    body, scene = scenario.build_body(), scenario.build_scene()
    trajectory = plan_com(scenario.build_centroidal_problem()).trajectory
    return body, scene, trajectory


@pytest.fixture(scope="module")
def planner(platform):
    return _Planner(*platform, np.random.default_rng(0), WholeBodySettings())


@pytest.fixture(scope="module")
def linearisation(planner, swings):
    """Objective, basis, control points at rest in the first posture, and no multipliers."""
    time, basis = planner.job.samples(planner.job.knots(planner.trajectory.schedule))
    scales = planner.settings.fit
    objective = _Goal(planner, swings, planner.guide(swings, READY, None, False), READY, True).objective(
        time, basis, scales
    )
    points = np.tile(objective.targets.reference[0], (basis.size, 1))
    return objective, basis, points, np.zeros((len(time), objective.task_rows))


@pytest.fixture(scope="module")
def swings(planner):
    return tuple(planner.flights.plan(swing) for swing in planner.flights.flights)


def test_swings(benchmark, planner):
    benchmark.pedantic(
        lambda: [planner.flights.plan(swing) for swing in planner.flights.flights], rounds=3, iterations=1
    )


def test_guide_postures(benchmark, planner, swings):
    def guide():
        planner.guide.cache_clear()
        return planner.guide(swings, READY, None, False)

    benchmark.pedantic(guide, rounds=3, iterations=1)


def test_fit(benchmark, planner, swings):
    goal = _Goal(planner, swings, planner.guide(swings, READY, None, False), READY, True)
    benchmark.pedantic(planner.job.solve, args=(goal, planner.settings.fit), rounds=3, iterations=1)


def test_strength(benchmark, planner, swings):
    """Constrained steps on closer knots at key instants, until torques of half the strength become dear."""
    goal = _Goal(planner, swings, planner.guide(swings, READY, None, False), READY, True)
    first = planner.job.attempt(goal, planner.settings.fit)
    fine, scales = (key_instants(goal.schedule),), replace(first.scales, strength_share=0.5)
    benchmark.pedantic(
        planner.job.solve, args=(goal, scales, fine, first.result.spline), rounds=3, iterations=1
    )


def test_dense_clearance(benchmark, platform):
    """The smallest distance over all samples of the motion at 1 kHz."""
    body, scene, trajectory = platform
    result = plan_whole_body(body, scene, trajectory, rng=np.random.default_rng(0))
    ignored = ignored_pairs(body, scene, trajectory.schedule, result.motion.time)
    proximity = Proximity(body, scene)
    benchmark.pedantic(proximity.minimum_over, args=(result.motion.q, ignored, 1e-5), rounds=3, iterations=1)


def test_linearisation(benchmark, linearisation):
    """One evaluation of the objective with all derivatives, after a step of a centimetre and a degree."""
    objective, _, points, shift = linearisation
    moved = itertools.cycle((points + 0.01, points))
    benchmark(lambda: objective.linearise(next(moved), WholeBodySettings().fit, shift))


def test_step(benchmark, linearisation):
    """Assembly and solution of the normal equations."""
    objective, basis, points, shift = linearisation
    state = objective.linearise(points, WholeBodySettings().fit, shift)
    system = BlockBandedSystem(basis, points.shape[1])

    def step():
        state.assemble(system)
        return system.solve(1.0)

    benchmark(step)


def test_forces(benchmark, platform):
    """Contact forces and joint torques at 1 kHz."""
    body, scene, trajectory = platform
    motion = plan_whole_body(body, scene, trajectory, rng=np.random.default_rng(0)).motion
    args = (body, trajectory.schedule, motion.time, motion.q, motion.v, motion.a)
    benchmark.pedantic(plan_forces, args=args, rounds=3, iterations=1)


def test_whole_body(benchmark, platform):
    benchmark.pedantic(
        lambda: plan_whole_body(*platform, rng=np.random.default_rng(0)), rounds=3, iterations=1
    )


def test_whole_run(benchmark):
    """Scenario to executed motion, without files, figures and start-up."""
    result = benchmark.pedantic(lambda: run("platform"), rounds=3, iterations=1)
    assert result.succeeded
