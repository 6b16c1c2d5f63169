"""Lengths in another unit, and a start or goal on nothing or in a wall, are bad input."""

import pytest

from manikin.cli import main
from manikin.errors import ScenarioError
from manikin.scenarios import list_scenarios, load_scenario
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scenarios.plausibility import check_plausible

TEXT = """
name: places
description: From a place to another
body: {{model: human, stature_m: 1.75, mass_kg: 75, sex: male}}
floor_height_m: {floor}
contacts: {{friction: 0.7, sole: {{length_m: 0.28, width_m: 0.12}}}}
scene:
  - {{name: block, box: {box}, position: {position}}}
{more}
task: {{start: {{at: {start}}}, goal: {{at: {goal}}}}}
"""
GIVEN = {"floor": 0.0, "box": [0.6, 1.2, 0.3], "position": [1.5, 0.0, 0.15], "start": [0, 0], "goal": [3, 0],
         "more": ""}  # fmt: skip

STEP = "  - {{name: step, box: [1, 1, {}], position: [1, 0, {}]}}"


def judged(folder, **changed):
    file = folder / "places.yaml"
    file.write_text(TEXT.format(**{**GIVEN, **changed}))
    scenario = load_scenario(str(file))
    check_plausible(scenario, scenario.build_body(), scenario.build_scene())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"box": [600, 1000, 300], "position": [900, 0, 150]}, r"scene\[0\] measures 600 x .*millimetres\?"),
        ({"box": [6e-4, 1e-3, 3e-4], "position": [2e-3, 0, 0]}, r"scene .* measure 0\.0006.*kilometres\?"),
        ({"floor": "null"}, r"task\.start\.at is .* nothing is below the body"),
        ({"floor": "null", "position": [0.0, 0.0, 0.0]}, r"task\.goal\.at is .* nothing is below the body"),
        ({"box": [1, 1, 2.5], "position": [0, 0, 1.25]}, r"start\.at .* inside of 'block', 2\.5 m high"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused_in_one_line(tmp_path, changed, said):
    judged(tmp_path)
    with pytest.raises(ScenarioError, match=said) as caught:
        judged(tmp_path, **changed)
    assert "\n" not in str(caught.value)
    assert "; valid: " in str(caught.value)


def test_a_start_on_a_high_block_is_asked_for_by_its_height(tmp_path):
    judged(tmp_path, box=[1, 1, 2.5], position=[0, 0, 1.25], start="[0, 0], height_m: 2.5")
    with pytest.raises(ScenarioError, match=r"start\.height_m is 9 m, but the nearest surface, at 2\.5 m"):
        judged(tmp_path, box=[1, 1, 2.5], position=[0, 0, 1.25], start="[0, 0], height_m: 9")


def test_a_centre_of_mass_in_millimetres_ends_with_status_2(capsys):
    scenario = load_scenario("platform")
    com = scenario.file.task.start.com
    given = f"task.start.com.2={1000 * com[2]}"
    status = main(["run", scenario.name, "--json", "--no-figures", "--set", given])
    said = capsys.readouterr().err.strip()
    assert status == 2
    assert len(said.splitlines()) == 1
    assert "task.start.com" in said
    assert "millimetres?" in said


@pytest.mark.parametrize("name", list_scenarios())
def test_every_built_in_scenario_is_plausible(name):
    scenario = load_scenario(name)
    if scenario.missing_mesh() is not None:
        pytest.skip("its meshes are of a distribution that is not installed")
    check_plausible(scenario, scenario.build_body(), scenario.build_scene())


def test_a_landing_that_steps_lead_up_to_may_be_started_on(tmp_path):
    """A landing above 2 m is a place to start on where a step is less than half a stature below it."""
    judged(tmp_path, box=[1, 1, 2.5], position=[0, 0, 1.25], more=STEP.format(1.8, 0.9))
    with pytest.raises(ScenarioError, match="inside of 'block'"):
        judged(tmp_path, box=[1, 1, 2.5], position=[0, 0, 1.25], more=STEP.format(1.0, 0.5))


@pytest.mark.parametrize("seeds", [2, pytest.param(10, marks=pytest.mark.long)])
@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_of_the_benchmark_is_plausible(family, seeds, tmp_path):
    for seed in range(seeds):
        scenario = draw_scene(FAMILIES[family], seed, tmp_path)
        check_plausible(scenario, scenario.build_body(), scenario.build_scene())
