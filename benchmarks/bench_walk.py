"""The walk with rolling feet, stage by stage ([Qiu2012]_ 5.4.4; the thesis took < 3 minutes for the CoM)."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule
from manikin.pipeline.runner import run
from manikin.planning.com import plan_com
from manikin.planning.com.transcription import transcribe
from manikin.planning.whole_body import WholeBodySettings, plan_whole_body
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.scenarios import load_scenario
from manikin.walking import step_along, walking_path
from manikin.walking.gait.balanced_walk import balanced_walk


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


GOALS = {"straight": (3.0, 0.0, 0.0), "around": (2.0, 2.0, np.pi / 2), "behind": (-1.0, 1.0, 2.6)}


@pytest.mark.parametrize("name", GOALS)
def test_walk_in_balance(benchmark, name):
    """Steps and the whole body in balance on them, without the path and the execution."""
    path = walking_path((0, 0, 0), GOALS[name], max_speed=1.2)
    walk = benchmark.pedantic(lambda: balanced_walk(human(), step_along(path)), rounds=3, iterations=1)
    assert walk.missed < 1e-3


@pytest.mark.parametrize("name", ["stroll", "stroll@behind"])
def test_executed_walk(benchmark, name):
    """All stages with the execution, without files and figures."""
    result = benchmark.pedantic(lambda: run(name), rounds=2, iterations=1)
    assert result.succeeded
