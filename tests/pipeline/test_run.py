"""The main job where a stage fails; ``benchmarks/sweep_scenarios.py`` runs it with bodies of many sizes."""

import json

import numpy as np
import pytest

import manikin
from manikin.pipeline.runner import run
from manikin.scenarios import load_scenario


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
