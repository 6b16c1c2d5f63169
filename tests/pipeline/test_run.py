"""The main job where a stage fails; ``benchmarks/sweep_scenarios.py`` runs it with bodies of many sizes."""

import json
from functools import partial

import numpy as np
import pytest

import manikin
from manikin.pipeline import runner
from manikin.pipeline.runner import run
from manikin.pipeline.stages import RunResult
from manikin.scenarios import Scenario, load_scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate


def test_an_infeasible_balance_is_explained_and_nothing_computed_is_lost(tmp_path):
    text = load_scenario("platform").to_yaml().replace("min_margin: 16.7", "min_margin: 120.0")
    file = tmp_path / "greedy.yaml"
    file.write_text(text)
    result = run(file, out=tmp_path / "out")
    failure = result.summary["failure"]
    assert not result.succeeded
    assert failure["stage"] == "centroidal"
    assert "margin" in failure["reason"]
    assert "phase" in failure["where"]
    assert result.summary["wholebody"] is None
    assert result.summary["execution"] is None
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["failure"] == failure


def test_the_walk_asks_for_the_published_margin_and_duration():
    """[Qiu2012]_ 5.4.4: 25.86 N.m about the ground, 0.96 m below the CoM, in 3.54 s, four steps."""
    scenario = load_scenario("walk")
    assert scenario.required_margin == pytest.approx(25.86 / np.hypot(1.0, 0.96), abs=0.05)
    assert scenario.file.planning.max_duration_s == pytest.approx(3.54)
    assert scenario.goal_com - scenario.start_com == pytest.approx([0.0, 1.5, 0.0])
    assert len(scenario.build_sequence().swings()) == 4


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("walk@slippery", "friction of 0.05 is too low"),
        ("walk@long-step", "step is too long"),
        pytest.param("beam-H2C2@slippery", "friction of 0.05 is too low", marks=pytest.mark.long),
        ("ramp@slippery", "slope of 15.0 degrees needs a friction of at least 0.27"),
        ("ramp-down@slippery", "slope of 15.0 degrees needs a friction of at least 0.27"),
    ],
)
def test_impossible_walks_and_passages_name_the_cause(name, cause):
    """The explanation names what would have to change, not where a solver stopped."""
    result = manikin.run(name)
    assert not result.succeeded
    assert cause in result.summary["failure"]["reason"]


@pytest.mark.parametrize("limit", [300.0, 0.01])
def test_nothing_else_is_tried_after_the_time_limit(limit, monkeypatch):
    """A short walk whose motion is made to fail: it is slowed down and other contacts are found, or not."""
    tried = []

    def fails(context, report, _requirements):
        tried.append(context)
        report.fail("wholebody", "made to fail", 0.1, "phase 1")
        return partial(RunResult.of, report), None

    monkeypatch.setattr(runner, "_planned", fails)
    task = {"start": {"at": [0.0, 0.0]}, "goal": {"at": [0.4, 0.0]}}
    content = {
        "name": "ahead",
        "body": {"stature_m": 1.75},
        "task": task,
        "planning": {"time_limit_s": limit},
    }
    failure = run(Scenario(validate(ScenarioFile, content, "ahead"))).summary["failure"]
    told = f"made to fail; no time was left to try anything else (planning.time_limit_s: {limit:g})"
    assert failure["reason"] == (told if limit < 1.0 else "made to fail")
    assert (len(tried) == 1) == (limit < 1.0)
