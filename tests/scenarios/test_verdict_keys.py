"""The keys ``execution`` and ``expect``: what is asked for, and how a run should end."""

import pytest
import yaml

from manikin.errors import ScenarioError
from manikin.scenarios import list_scenarios, list_variants, load_scenario

SINK = "{outcome: failure, stage: execution, because: It sinks}"


def loaded(tmp_path, text, variant=None):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    return load_scenario(file, variant)


def test_only_what_has_joints_and_is_planned_to_move_is_executed():
    """Point masses and recorded walks are planned-only jobs; everything else has to be executed."""
    for name in list_scenarios():
        for variant in (None, *list_variants(name)):
            job = load_scenario(name, variant)
            walking = job.file.walking
            recorded = walking is not None and walking.whole_body == "recorded"
            assert job.execution_required is not (job.is_point_mass or recorded), job.name


def test_a_plan_alone_may_be_asked_for(tmp_path):
    job = loaded(tmp_path, "extends: platform\nname: mine\nexecution: none\n")
    assert not job.execution_required
    assert yaml.safe_load(job.to_yaml())["execution"]["required"] is False


def test_trials_may_be_asked_for_and_set(tmp_path):
    """A mapping, a single value that is set, and the words of before mean the same execution."""
    job = loaded(tmp_path, "extends: platform\nname: mine\nexecution: {trials: 3}\n")
    assert (job.execution_required, job.file.execution.trials) == (True, 3)
    other = load_scenario("platform", overrides=["execution.trials=3", "execution.uncertainty.factor=2"])
    assert other.file.execution.model_copy(update={"uncertainty": job.file.execution.uncertainty}) == (
        job.file.execution
    )
    assert other.file.execution.uncertainty.factor == 2.0
    assert loaded(tmp_path, "extends: platform\nname: mine\nexecution: required\n").file.execution.trials == 0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("extends: platform\nname: mine\nexecution: attempted\n", "valid: required, none, or a mapping"),
        ("extends: platform\nname: mine\nexecution: {trials: -1}\n", "trials"),
        ("extends: platform\nname: mine\nexecution: {required: false, trials: 2}\n", "with required true"),
        ("extends: platform\nname: mine\nexecution: {uncertainty: {factor: 9.0}}\n", "factor is 9.0"),
        ("extends: push-right-200\nname: mine\nexecution: {trials: 2}\n", "beside recovery; valid: 0"),
        (
            "extends: platform\nname: mine\nexecution: {uncertainty: {mass_share: 1.5}}\n",
            "uncertainty.mass_share is 1.5; valid: 0 to 0.9",
        ),
        ("extends: walls\nname: mine\nexecution: required\n", "valid: none for a point mass"),
        (
            "extends: goal-left\nname: mine\nexecution: required\nwalking: {whole_body: recorded}\n",
            "valid: none for a recorded walk",
        ),
        ("extends: push-right-200\nname: mine\nexecution: none\n", "valid: required beside recovery"),
        ("extends: platform\nname: mine\nexpect: perhaps\n", "'success' or 'failure'"),
        (
            "extends: platform\nname: mine\nexpect: {outcome: success, because: It is easy}\n",
            "valid: beside outcome: failure",
        ),
    ],
)
def test_other_words_are_refused_in_one_line(tmp_path, text, says):
    with pytest.raises(ScenarioError, match=says) as refused:
        loaded(tmp_path, text)
    assert "\n" not in str(refused.value)


def test_an_expected_failure_may_name_its_stage_and_reason(tmp_path):
    text = (
        f"extends: platform\nname: mine\nexpect: {SINK}\n"
        "variants:\n  short: {expect: failure}\n  fine: {expect: success}\n"
    )
    wanted = loaded(tmp_path, text).file.expect
    assert (wanted.outcome, wanted.stage, wanted.because) == ("failure", "execution", "It sinks")
    short, fine = (loaded(tmp_path, text, name).file.expect for name in ("short", "fine"))
    assert (short.outcome, short.stage, short.because) == ("failure", None, None)
    assert fine.outcome == "success"
    again = loaded(tmp_path, loaded(tmp_path, text).to_yaml())
    assert again.file.expect == wanted
