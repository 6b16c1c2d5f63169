"""The main job, end to end with bodies of many sizes, and what it does when a stage fails."""

import json

import numpy as np
import pytest

import manikin
from manikin.pipeline.runner import run
from manikin.scenarios import load_scenario


@pytest.mark.slow
def test_another_body_runs_the_same_scenario():
    """A man 15 cm smaller, with the same footholds."""
    result = manikin.run(load_scenario("platform").with_body(1.60, 58.0, "male"), seed=3)
    assert result.succeeded, result.summary["failure"]
    assert result.summary["wholebody"]["min_clearance_m"] >= 0.01
    assert result.summary["execution"]["min_margin"] > 0.0


def test_an_infeasible_balance_is_explained_and_nothing_computed_is_lost(tmp_path):
    text = load_scenario("platform").to_yaml().replace("min_margin: 16.7", "min_margin: 75.0")
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


@pytest.mark.slow
def test_a_tall_person_walks_down_a_ramp():
    """[Qiu2012]_ 5.4.4: the ZMP stays inside the support polygon, of the point mass and the body."""
    scenario = load_scenario("ramp-down").with_body(stature_m=1.85, mass_kg=78.0)
    result = manikin.run(scenario)
    assert result.succeeded, result.summary["failure"]
    assert result.execution.min_margin > 0.0
    com, body = result.summary["centroidal"], result.summary["wholebody"]
    assert com["min_margin"] >= scenario.required_margin - 1e-6
    assert com["min_zmp_distance_m"] > 0.0
    assert body["min_zmp_distance_m"] > 0.0


def test_the_walk_asks_for_the_published_margin_and_duration():
    """[Qiu2012]_ 5.4.4: 25.86 N.m about the ground, 0.96 m below the CoM, in 3.54 s, four steps."""
    scenario = load_scenario("walk")
    assert scenario.required_margin == pytest.approx(25.86 / np.hypot(1.0, 0.96), abs=0.05)
    assert scenario.planning.max_duration_s == pytest.approx(3.54)
    assert scenario.goal_com - scenario.start_com == pytest.approx([0.0, 1.5, 0.0])
    assert len(scenario.build_sequence().swings()) == 4


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("walk@slippery", "friction of 0.05 is too low"),
        ("walk@long-step", "step is too long"),
        ("beam-H2C2@slippery", "friction of 0.05 is too low"),
        ("ramp@slippery", "slope of 15.0 degrees needs a friction of at least 0.27"),
        ("ramp-down@slippery", "slope of 15.0 degrees needs a friction of at least 0.27"),
    ],
)
def test_impossible_walks_and_passages_name_the_cause(name, cause):
    """The explanation names what would have to change, not where a solver stopped."""
    result = manikin.run(name)
    assert not result.succeeded
    assert cause in result.summary["failure"]["reason"]
