"""Study files: what they make, and what is refused in one line."""

import pytest

from manikin.errors import ScenarioError
from manikin.scenarios.study_file import load_study

STEP = """
name: step
body: {model: human}
scene:
  - {name: step, box: [1.2, 1.6, 0.2], position: [1.0, 0.0, 0.1]}
task: {start: {at: [0.0, 0.0]}, goal: {at: [0.9, 0.0]}}
"""


@pytest.fixture
def study(tmp_path):
    """Reads a study file of this text, beside a scenario step.yaml."""
    (tmp_path / "step.yaml").write_text(STEP)

    def read(text):
        (tmp_path / "study.yaml").write_text(text)
        return load_study(tmp_path / "study.yaml")

    return read


def test_bodies_values_and_seeds_are_written_out(study):
    known = study("""
scenario: step.yaml
bodies:
  - {percentiles: [5, 95]}
  - {sex: male, boundary: 0.9, measures: [stature, mass]}
  - {sex: female, random: 2, seed: 4}
  - {name: giant, body: {stature_m: 2.0, mass_kg: 100}}
sweeps:
  - {key: contacts.friction, range: [0.3, 0.7, 3]}
  - {name: height, keys: {scene.step.box.2: 1.0, scene.step.position.2: 0.5}, values: [0.1, 0.3]}
seeds: 3
""")
    names = [body.name for body in known.bodies]
    assert names[:4] == ["female-P5", "female-P95", "male-P5", "male-P95"]
    assert names[4:] == ["male-axis1+", "male-axis1-", "male-axis2+", "male-axis2-", "female-draw4-0",
                         "female-draw4-1", "giant"]  # fmt: skip
    assert [body.drawn for body in known.bodies] == [False] * 8 + [True] * 2 + [False]
    assert [list(s.values.values()) for s in known.settings] == [
        [0.3, 0.1], [0.3, 0.3], [0.5, 0.1], [0.5, 0.3], [0.7, 0.1], [0.7, 0.3]
    ]  # fmt: skip
    assert known.file.seeds == [0, 1, 2]
    last = known.scenario.with_overrides((*known.bodies[-1].overrides, *known.settings[-1].overrides))
    assert (last.file.body.stature_m, last.file.body.mass_kg) == (2.0, 100.0)
    assert last.file.scene[0].box == (1.2, 1.6, 0.3)
    assert last.file.scene[0].position == (1.0, 0.0, 0.15)
    assert last.file.contacts.friction == 0.7


def test_a_study_of_one_scenario_alone(study):
    known = study("{scenario: stairs, seeds: [3, 5]}")
    assert [(body.name, dict(body.keys)) for body in known.bodies] == [("scenario", {})]
    assert [setting.overrides for setting in known.settings] == [()]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{stage: all}", "scenario is missing; valid: a built-in scenario"),
        ("{scenario: stars}", "stars: there is no such file"),
        ("{scenario: platform}", "stage is contacts, but platform has no contacts to plan; valid: all"),
        ("{scenario: stairs, bodies: [{percentile: [5]}]}", "did you mean 'percentiles'?"),
        (
            "{scenario: stairs, bodies: [{sex: male}]}",
            "bodies[0] is {'sex': 'male'}; valid: a mapping with one",
        ),
        ("{scenario: stairs, bodies: [{boundary: 0.9, random: 3}]}", "a mapping with one of percentiles"),
        ("{scenario: stairs, bodies: [{random: 3, corners: true}]}", "corners is given without boundary"),
        ("{scenario: stairs, bodies: [{percentiles: [101]}]}", "bodies[0] cannot be made: percentile is 101"),
        ("{scenario: stairs, bodies: [{random: 2}, {random: 1}]}", "bodies[1] makes 'female-draw0-0' again"),
        (
            "{scenario: stairs, bodies: [{name: a, body: {stature_m: 1.0e+300, mass_kg: 80}}]}",
            "bodies[0] cannot be made: ",
        ),
        ("{scenario: insect-books, bodies: [{random: 2}]}", "bodies are given for the body insect"),
        ("{scenario: stairs, seeds: 0}", "seeds is 0; valid: a list of seeds, or how many"),
        ("{scenario: stairs, seeds: [1, 1]}", "seeds hold one twice"),
        ("{scenario: stairs, sweeps: [{key: seed, values: [1]}]}", "sweeps[0].key is swept; valid: seeds"),
        ("{scenario: stairs, sweeps: [{key: a.b}]}", "with values, or else range"),
        ("{scenario: stairs, sweeps: [{values: [1]}]}", "with key, or else keys"),
        ("{scenario: stairs, sweeps: [{keys: {a: 2}, values: [x]}]}", "values[0] is 'x'; valid: a number"),
        (
            "{scenario: stairs, bodies: [{random: 2}], sweeps: [{key: body.mass_kg, values: [60]}]}",
            "sweeps[0].key is body.mass_kg, which bodies give; valid: one of them",
        ),
        ("{scenario: stairs, seeds: 9000, bodies: [{random: 2}]}", "makes 36000 jobs; valid: at most 20000"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(study, text, message):
    with pytest.raises(ScenarioError) as error:
        study(text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
