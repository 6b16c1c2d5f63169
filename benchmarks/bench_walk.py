"""The walk with rolling feet, stage by stage ([Qiu2012]_ 5.4.4; the thesis took < 3 minutes for the CoM)."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule
from manikin.pipeline.runner import run
from manikin.planning.com import plan_com
from manikin.planning.com.transcription import transcribe
from manikin.planning.whole_body import WholeBodySettings, plan_whole_body
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.scenarios import load_scenario
from manikin.scenarios.planned import walk_before, walking_supports
from manikin.walking import place_footprints, walking_path


@pytest.fixture(scope="module", params=["walk", "walk@flat"])
def scenario(request):
    return load_scenario(request.param)


def test_com(benchmark, scenario):
    """The CoM, cold."""
    problem = scenario.build_centroidal_problem()
    result = benchmark.pedantic(plan_com, (problem,), setup=transcribe.cache_clear, rounds=3)
    assert result.succeeded


def test_whole_body(benchmark, scenario):
    """The whole body along a planned CoM."""
    com = plan_com(scenario.build_centroidal_problem()).trajectory
    trajectory = replace(com, schedule=ContactSchedule(scenario.build_sequence(), com.schedule.instants))
    body, scene = scenario.build_body(), scenario.build_scene()
    settings = WholeBodySettings(manner=posture_style_of(scenario.file.manner))
    result = benchmark.pedantic(
        lambda: plan_whole_body(body, scene, trajectory, rng=np.random.default_rng(0), settings=settings),
        rounds=2, iterations=1,
    )  # fmt: skip
    assert result.succeeded


def test_everything(benchmark, scenario):
    """All stages with the execution, without files and figures."""
    result = benchmark.pedantic(lambda: run(scenario), rounds=2, iterations=1)
    assert result.succeeded


@pytest.fixture(scope="module", params=["straight", "around", "to the platform"])
def walked(request):
    """Scenarios on footprints: 3 m in 8 steps, a quarter turn in 11, 4 m and three steps more in 13."""
    if request.param == "to the platform":
        path = walking_path((0, -4, np.pi / 2), (0, 0, np.pi / 2), max_speed=0.6)
        return walk_before(place_footprints(path, first="right_foot"), load_scenario("platform"))
    goal = {"straight": (3.0, 0.0, 0.0), "around": (2.0, 2.0, np.pi / 2)}[request.param]
    return walking_supports(
        place_footprints(walking_path((0, 0, 0), goal, max_speed=0.6)), load_scenario("walk")
    )


def test_walk_on_footprints_com(benchmark, walked):
    """The CoM of a long walk, cold; the motions last 8 to 12 s."""
    problem = walked.build_centroidal_problem()
    result = benchmark.pedantic(plan_com, (problem,), setup=transcribe.cache_clear, rounds=3)
    assert result.succeeded


def test_walk_on_footprints(benchmark, walked):
    """All stages with the execution, without files and figures."""
    result = benchmark.pedantic(lambda: run(walked), rounds=2, iterations=1)
    assert result.succeeded
