"""Refinement of a short crouch and a short climb: `pytest benchmarks/bench_refine.py`.

The star to steer by: no longer than the motion lasts. CPU time is in ``extra_info`` [s].
"""

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.planning.whole_body import refine_motion
from manikin.planning.whole_body.fit_job import phase_knots, sample_times
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.refine_measures import rooms_of
from manikin.planning.whole_body.refine_objective import RefineObjective, refine_targets
from manikin.scene import Proximity

CASES = Path(__file__).parents[1] / "tests/planning/whole_body/refine_cases.py"


@pytest.fixture(scope="module")
def cases():
    spec = importlib.util.spec_from_file_location("refine_cases", CASES)
    module = importlib.util.module_from_spec(spec)
    sys.modules["refine_cases"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("name", "length"), [("crouch", 2), ("climb", 2)])
def test_refinement(benchmark, cases, name, length):
    case, took = getattr(cases, name)(length), []

    def refine():
        start = time.process_time()
        result = refine_motion(*case)
        took.append(time.process_time() - start)
        return result

    result = benchmark.pedantic(refine, rounds=3, warmup_rounds=1)
    benchmark.extra_info["cpu_s"] = float(np.median(took))
    benchmark.extra_info["duration_s"] = result.after.duration_s
    benchmark.extra_info["succeeded"] = result.succeeded


@pytest.fixture(scope="module")
def problem(cases):
    """Objective and control points of the climb at its start."""
    body, scene, times, q, schedule = cases.climb(2)
    scales, path = RefineScales(), KeyPath(times, q)
    knots = phase_knots(schedule.instants, 0.1)
    time = sample_times(knots, 3)
    basis = SampledBasis.at(time, knots, 5)
    targets = refine_targets(body, scene, path, schedule, time, scales, None)
    objective = RefineObjective(body, Proximity(body, scene), targets, basis, rooms_of(schedule.sequence))
    points = np.tile(path.q[0], (basis.size, 1))
    return objective, points, scales, np.zeros((len(time), objective.task_rows)), basis


def test_linearisation(benchmark, problem):
    objective, points, scales, shift, _ = problem
    rng = np.random.default_rng(0)
    benchmark(lambda: objective.linearise(points + 1e-4 * rng.normal(size=points.shape), scales, shift))


def test_step(benchmark, problem):
    """Assembly and solution of the normal equations."""
    objective, points, scales, shift, basis = problem
    state, system = objective.linearise(points, scales, shift), BlockBandedSystem(basis, points.shape[1])

    def step():
        state.assemble(system)
        return system.solve(1.0)

    benchmark(step)
