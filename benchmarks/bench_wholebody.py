"""Whole-body planning of the platform scenario, its parts, and the whole run.

Run with ``pytest benchmarks/bench_wholebody.py``. The star to steer by: planning and checking
the motion takes no longer than the motion lasts (5.0 s).
"""

import numpy as np
import pytest

from manikin.centroidal import plan_com
from manikin.pipeline import run
from manikin.scenarios import load_scenario
from manikin.scene import Proximity
from manikin.wholebody import plan_whole_body
from manikin.wholebody.assemble import WholeBodySettings, _Planner
from manikin.wholebody.banded import SampledBasis
from manikin.wholebody.objective import MotionObjective
from manikin.wholebody.targets import ignored_pairs


@pytest.fixture(scope="module")
def platform():
    scenario = load_scenario("platform")
    body, scene = scenario.build_body(), scenario.build_scene()
    trajectory = plan_com(scenario.build_centroidal_problem()).trajectory
    return body, scene, trajectory


@pytest.fixture(scope="module")
def planner(platform):
    return _Planner(*platform, np.random.default_rng(0), WholeBodySettings(), None)


@pytest.fixture(scope="module")
def swings(planner):
    return tuple(planner.flights.plan(swing) for swing in planner.flights.flights())


def test_swings(benchmark, planner):
    benchmark.pedantic(
        lambda: [planner.flights.plan(swing) for swing in planner.flights.flights()], rounds=3, iterations=1
    )


def test_guide_postures(benchmark, planner, swings):
    benchmark.pedantic(planner._guide, args=(swings,), rounds=3, iterations=1)


def test_fit(benchmark, planner, swings):
    guide = planner._guide(swings)
    scales = WholeBodySettings().fit
    benchmark.pedantic(planner._fit, args=(swings, guide, scales), rounds=3, iterations=1)


def test_dense_clearance(benchmark, platform):
    """The smallest distance over all samples of the motion at 1 kHz."""
    body, scene, trajectory = platform
    result = plan_whole_body(body, scene, trajectory, rng=np.random.default_rng(0))
    ignored = ignored_pairs(body, scene, trajectory.schedule, result.motion.time)
    proximity = Proximity(body, scene)
    benchmark.pedantic(proximity.minimum_over, args=(result.motion.q, ignored, 1e-5), rounds=3, iterations=1)


def test_linearisation(benchmark, planner, swings):
    """One evaluation of the objective with all derivatives."""
    targets, knots = planner._targets(swings, planner._guide(swings))
    basis = SampledBasis.at(targets.time, knots, 5)
    objective = MotionObjective(planner.body, planner.proximity, targets, basis)
    points = np.tile(targets.reference[0], (basis.size, 1))
    shift = np.zeros((len(targets.time), objective.task_rows))
    benchmark(objective.linearise, points, WholeBodySettings().fit, shift)


def test_whole_body(benchmark, platform):
    benchmark.pedantic(
        lambda: plan_whole_body(*platform, rng=np.random.default_rng(0)), rounds=3, iterations=1
    )


def test_whole_run(benchmark):
    """Scenario to executed motion, without files, figures and start-up."""
    result = benchmark.pedantic(lambda: run("platform"), rounds=3, iterations=1)
    assert result.succeeded
