"""The stages of every built-in scenario and of the best trial between the walls, in CPU time."""

import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from manikin.contact import ContactSchedule
from manikin.planning.com import plan_com, plan_com_through_key_frames
from manikin.planning.com.transcription import transcribe
from manikin.planning.whole_body import WholeBodySettings, plan_whole_body
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.scenarios import list_scenarios, load_scenario
from manikin.simulation import execute

pytestmark = pytest.mark.benchmark(timer=time.process_time)

NAMES = [*list_scenarios(), "walls@trial-5"]

scenario_of = cache(load_scenario)


def _plan_com(name):
    scenario = scenario_of(name)
    keyframes = scenario.build_keyframe_problem()
    if keyframes is None:
        return plan_com(scenario.build_centroidal_problem())
    return plan_com_through_key_frames(keyframes)


def _plan_whole_body(name, trajectory):
    scenario = scenario_of(name)
    return plan_whole_body(
        scenario.build_body(), scenario.build_scene(), trajectory, rng=np.random.default_rng(scenario.seed),
        settings=WholeBodySettings(manner=posture_style_of(scenario.file.manner)),
    )  # fmt: skip


@cache
def _trajectory(name):
    com = _plan_com(name).trajectory
    return replace(com, schedule=ContactSchedule(scenario_of(name).build_sequence(), com.schedule.instants))


@cache
def _motion(name):
    return _plan_whole_body(name, _trajectory(name)).motion


def _skip_point_mass(name):
    if scenario_of(name).is_point_mass:
        pytest.skip("a point mass has no joints to plan for")


@pytest.mark.parametrize("name", NAMES)
def test_com(benchmark, name):
    """The CoM, cold."""
    benchmark.pedantic(_plan_com, (name,), setup=transcribe.cache_clear, rounds=3)


@pytest.mark.parametrize("name", NAMES)
def test_whole_body(benchmark, name):
    """The whole body along the planned CoM."""
    _skip_point_mass(name)
    trajectory = _trajectory(name)
    result = benchmark.pedantic(_plan_whole_body, (name, trajectory), rounds=3)
    assert result.succeeded


@pytest.mark.parametrize("name", NAMES)
def test_execution(benchmark, name):
    """The planned motion in the physics engine, without the scenario's push."""
    _skip_point_mass(name)
    scenario, schedule = scenario_of(name), _trajectory(name).schedule
    body, scene, motion = scenario.build_body(), scenario.build_scene(), _motion(name)
    benchmark.pedantic(execute, (body, scene, motion, schedule), rounds=3)
