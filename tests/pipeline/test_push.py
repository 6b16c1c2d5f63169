"""Pushes as scenarios: from the file to the summary, and what is refused."""

import json

import pytest
import yaml

from manikin.cli import main
from manikin.errors import ScenarioError
from manikin.motion.file import read_motions
from manikin.pipeline import runner
from manikin.scenarios import list_variants, load_scenario

NAMES = ("push-back-500", "push-front-300", "push-sine-100", "push-right-200")
SHORT = {
    "name": "short", "body": {"model": "kudoh"},
    "push": {"force_N": 100, "direction_deg": 90, "duration_s": 0.1, "at_s": 0.1},
    "recovery": {"duration_s": 0.8},
}  # fmt: skip


@pytest.fixture
def write(tmp_path):
    def write(**changes):
        content = {**SHORT, **changes}
        file = tmp_path / "short.yaml"
        file.write_text(yaml.safe_dump({key: value for key, value in content.items() if value is not None}))
        return file

    return write


@pytest.mark.parametrize("name", NAMES)
def test_the_four_experiments_are_those_of_the_thesis(name):
    """Forces, directions and durations of [Kudoh2002]_ 3.2, the control from 0.2 s on."""
    wanted = {
        "push-back-500": (500, 0, 0.1, None), "push-front-300": (300, 180, 0.1, None),
        "push-sine-100": (100, 180, 5.0, 1.0), "push-right-200": (200, 90, 0.1, None),
    }[name]  # fmt: skip
    scenario = load_scenario(name)
    push = scenario.file.push
    assert (push.force_N, push.direction_deg, push.duration_s, push.frequency_hz) == wanted
    assert scenario.file.recovery.delay_s == 0.2
    assert scenario.file.recovery.feet == "held"
    assert scenario.build_body().name == "kudoh"
    assert load_scenario(name, "free").file.recovery.feet == "free"
    assert "free" in list_variants(name)


def test_a_recovery_writes_its_summary_and_its_motion(write, tmp_path, capsys):
    assert main(["run", str(write()), "--json", "--no-figures", "--out", str(tmp_path / "run")]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["succeeded"]
    push = summary["push"]
    assert push["recovered"]
    assert push["feet"] == "held"
    assert push["impulse_Ns"] == pytest.approx(10.0)
    assert push["direction_deg"] == pytest.approx(90.0)
    assert push["posture_share"] + push["program_share"] == pytest.approx(1.0)
    assert set(push["angular_momentum_share"]) == {"arms", "trunk", "legs"}
    assert sum(push["angular_momentum_share"].values()) == pytest.approx(1.0)
    content = read_motions(tmp_path / "run")
    assert content.planned is None
    assert content.executed.duration == pytest.approx(0.8)
    assert content.body.mass == 70.0


def test_a_fall_is_an_explained_failure_and_no_recovery():
    result = runner.run("push-back-500", variant="slack")
    assert not result.succeeded
    assert result.summary["failure"]["stage"] == "push"
    assert "beyond the soles" in result.summary["failure"]["reason"]
    assert result.summary["push"]["recovered"] is False


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"push": None}, "push is missing"),
        ({"push": {**SHORT["push"], "force_N": float("nan")}}, "force_N"),
        ({"push": {**SHORT["push"], "force_N": 1e6}}, "push.force_N is 1000000.0; valid: a number <= 5000"),
        ({"push": {**SHORT["push"], "duration_s": -0.1}}, "duration_s"),
        ({"push": {**SHORT["push"], "at_s": 2.0}}, "before the run ends at 0.8 s"),
        ({"body": {"model": "insect"}}, "does not apply to an insect"),
        ({"recovery": None}, "task"),
        ({"recovery": {"locked": ["legs"]}}, "locked"),
        ({"task": {"start": {"at": [0, 0], "posture": "seated"}, "goal": {"at": [0, 0]}}}, "seated"),
    ],
)
def test_absurd_pushes_get_one_line(write, capsys, changes, text):
    assert main(["run", str(write(**changes)), "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.strip().splitlines()) == 1
    assert text in captured.err


def test_the_body_of_kudoh_is_not_planned_for(write):
    task = {"start": {"at": [0, 0]}, "goal": {"at": [1, 0]}}
    with pytest.raises(ScenarioError, match="recovery is missing"):
        load_scenario(write(recovery=None, push=None, task=task))


def test_a_pushed_body_obeys_the_friction_model_that_is_asked_for():
    """Margins are measured in the cone asked for, control stays inside the circular cone."""
    from manikin.control.edge_forces import inside_the_cone
    from manikin.pipeline.stages.recovery_stage import _settings

    for asked, held in (("outer", "inner"), ("inner", "inner"), ("cone", "cone")):
        scenario = load_scenario("push-back-500", None, (f"planning.friction_model={asked}",))
        settings = _settings(scenario, scenario.file.recovery)
        assert settings.friction_model == asked
        assert inside_the_cone(settings.friction_model) == held
