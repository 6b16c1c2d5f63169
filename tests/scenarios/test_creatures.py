"""Insects and creatures from URDF in scenario files."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from manikin.cli import main
from manikin.errors import ScenarioError
from manikin.scenarios import load_scenario
from manikin.scenarios.world import start_posture

NAMES = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
DOG = {
    "urdf": "dog.urdf",
    "limbs": {name: {"tip": f"{name}_foot", "position": [0.02, 0, 0]} for name in NAMES},
    "standing_deg": {
        f"{name}_{joint}": angle for name in NAMES for joint, angle in (("pitch", 34), ("knee", 68))
    },
}


@pytest.fixture
def write(tmp_path):
    trimesh.creation.capsule(height=140.0, radius=15.0).export(tmp_path / "shank.stl")
    shutil.copy(Path(__file__).parents[1] / "body/data/dog.urdf", tmp_path)

    def write(body, **keys):
        file = tmp_path / "creature.yaml"
        scene = [{"name": "step", "box": [0.3, 0.6, 0.06], "position": [0.35, 0, 0.03]}]
        task = {"start": {"at": [0.0, 0.1], "heading_deg": 90}, "goal": {"at": [1, 0]}}
        file.write_text(
            yaml.safe_dump({"name": "creature", "body": body, "scene": scene, "task": task, **keys})
        )
        return file

    return write


def test_a_creature_is_built_from_its_file(write):
    scenario = load_scenario(write(DOG))
    body = scenario.build_body()
    assert body.name == "dog"
    assert [limb.name for limb in body.limbs] == NAMES
    assert scenario.mass == pytest.approx(12.0)
    assert body.standing_angles["rear_left_knee"] == pytest.approx(np.deg2rad(68.0))
    q = start_posture(scenario, body, scenario.build_scene())
    np.testing.assert_allclose(q[:2], [0.0, 0.1])
    assert q[5] == pytest.approx(np.sqrt(0.5))


WALKER = {
    "mjcf": "walker.xml",
    "limbs": {side: {"tip": f"{side}_foot", "contact": "sole"} for side in ("left", "right")},
    "sole": {"length_m": 0.2, "width_m": 0.1},
}


@pytest.fixture
def walker(tmp_path):
    """A robot as MuJoCo has it, and its mesh."""
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((200.0, 100.0, 40.0)).export(tmp_path / "meshes" / "sole.stl")
    shutil.copy(Path(__file__).parents[1] / "body/data/walker.xml", tmp_path)
    return WALKER


def test_a_robot_of_mjcf_is_built_from_its_file(write, walker):
    scenario = load_scenario(write({**walker, "joint_speed_deg_s": 360.0}))
    body = scenario.build_body()
    assert body.name == "walker"
    assert scenario.mass == body.mass
    assert [limb.kind for limb in body.limbs] == ["sole", "sole"]
    assert body.hinges[0].velocity_limit == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize("robot", ["urdf", "mjcf"])
def test_a_robot_is_found_from_another_folder(write, walker, tmp_path, robot):
    """In the scenario that a run keeps, and in one that is laid over it."""
    first = load_scenario(write(DOG if robot == "urdf" else walker))
    (tmp_path / "runs").mkdir()
    kept, over = tmp_path / "runs" / "scenario.yaml", tmp_path / "runs" / "over.yaml"
    kept.write_text(first.to_yaml())
    over.write_text("extends: ../creature.yaml\nname: over\n")
    for file in (kept, over):
        assert load_scenario(file).build_body().mass == first.build_body().mass


def test_an_insect_has_its_own_size(write):
    body = load_scenario(write({"model": "insect"})).build_body()
    assert body.name == "insect"
    assert body.mass == pytest.approx(2.0)
    assert load_scenario(write({"model": "insect", "mass_kg": 0.5})).build_body().mass == pytest.approx(0.5)


@pytest.mark.parametrize("body", [DOG, {"model": "insect", "length_m": 0.3}])
def test_what_is_written_out_is_read_again(write, body, tmp_path):
    scenario = load_scenario(write(body))
    again = tmp_path / "again.yaml"
    again.write_text(scenario.to_yaml())
    assert load_scenario(again).to_yaml() == scenario.to_yaml()
    assert "stature_m" not in yaml.safe_load(scenario.to_yaml())["body"]


def test_one_contact_of_a_creature_from_the_command_line(write, capsys):
    status = main(["contact", str(write(DOG)), "--limb", "front_left", "--task", "0", "0", "1", "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert status == 0
    assert answer["obstacle"] in ("step", "floor")
    assert answer["normal"] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("body", "keys", "match"),
    [
        ({**DOG, "mass_kg": 3}, {}, "mass_kg does not apply to a creature from URDF; valid: model, urdf"),
        ({"model": "insect", "sex": "male"}, {}, "sex does not apply to an insect; valid: model, length_m"),
        ({"model": "human", "urdf": "dog.urdf"}, {}, "body.urdf does not apply to a human"),
        ({"urdf": "dog.urdf"}, {}, "body.limbs is missing; valid: urdf: FILE and limbs"),
        ({"model": "urdf"}, {}, "body.urdf is missing"),
        ({"mjcf": "walker.xml"}, {}, "body.limbs is missing; valid: mjcf: FILE and limbs"),
        ({**DOG, "joint_speed_deg_s": 90}, {}, "joint_speed_deg_s does not apply to a creature from URDF"),
        ({**DOG, "limbs": {"leg": {"top": "x"}}}, {}, "valid: tip, root, contact, position, normal"),
        ({**DOG, "limbs": {"leg": {"tip": "x", "contact": "claw"}}}, {}, "'point', 'sole' or 'grasp'"),
        (DOG, {"reference_stature_m": 1.75}, "does not apply to a creature from URDF"),
        (
            {"model": "insect"},
            {"supports": {"phases": [{"left_foot": {"position": [0, 0, 0]}}]}},
            "do not apply",
        ),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(write, body, keys, match):
    with pytest.raises(ScenarioError, match=match) as error:
        load_scenario(write(body, **keys))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"urdf": "cat.urdf"}, r"cat\.urdf"),
        ({"limbs": {"leg": {"tip": "paw"}}}, "tip is 'paw'"),
        ({"standing_deg": {"front_left_knee": 170}}, "standing angle"),
    ],
)
def test_what_the_file_lacks_is_said_with_its_place(write, change, match):
    scenario = load_scenario(write({**DOG, **change}))
    with pytest.raises(ScenarioError, match=match) as error:
        scenario.build_body()
    assert "creature.yaml" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("body", "posture", "limbs", "method"),
    [
        ({"model": "human"}, "standing", None, "follow"),
        ({"model": "human"}, "climbing", ("left_arm", "right_arm", "left_leg", "right_leg"), "refine"),
        ({"model": "quadruped"}, "standing", (), "refine"),
    ],
)
def test_limbs_and_method_go_without_saying(body, posture, limbs, method, tmp_path):
    """A file with a start and a goal alone is no less clear for a creature or on a ladder than on feet."""
    task = {"start": {"at": [0.0, 0.0]}, "goal": {"at": [1.0, 0.0], "posture": posture}}
    file = tmp_path / "there.yaml"
    file.write_text(yaml.safe_dump({"name": "there", "body": body, "task": task}))
    scenario = load_scenario(file)
    assert scenario.contact_limbs == limbs
    assert scenario.file.wholebody.method == method
    assert not load_scenario(file, overrides=["wholebody.method=follow"]).refines
