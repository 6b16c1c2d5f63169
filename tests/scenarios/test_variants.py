"""A scenario built on another, its variants, and values set from outside."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import ScenarioError
from manikin.pipeline.runner import run
from manikin.planning.contacts import Endpoints, Habit, PostureFinder
from manikin.scenarios import list_scenarios, list_variants, load_scenario
from manikin.scenarios.yaml_reader import Tree, merge

CHILD = {
    "extends": "platform",
    "name": "child",
    "supports": {"friction": 0.5, "normal_force_cap_N": None},
    "variants": {
        "slow": {"description": "slower", "planning": {"max_duration_s": 9.0}},
        "bare": {"floor_height_m": None, "com_constraints": [], "planning": {"weights": None}},
    },
}

SINGLE = st.integers(0, 9) | st.lists(st.integers(0, 9), max_size=2)
SECTIONS = st.dictionaries(st.sampled_from("abc"), SINGLE, max_size=3)
TREES = st.dictionaries(st.sampled_from("abc"), SINGLE | SECTIONS, max_size=3).map(Tree)


def write(folder, data, name="child.yaml"):
    path = folder / name
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False))
    return path


@given(TREES)
def test_merging_nothing_or_itself_changes_nothing(tree):
    assert merge(tree, Tree({})).data == merge(Tree({}), tree).data == merge(tree, tree).data == tree.data


@given(TREES, TREES)
def test_what_lies_above_is_all_there_and_nothing_below_is_lost_beside_it(below, above):
    merged = merge(below, above)
    assert merge(merged, above).data == merged.data
    assert set(merged.data) == set(below.data) | set(above.data)
    assert all(merged.data[key] == below.data[key] for key in set(below.data) - set(above.data))


def test_mappings_are_merged_lists_replaced_and_null_removes():
    below = Tree({"a": {"x": 1, "y": [1, 2]}, "b": 2, "floor_height_m": 0.0})
    above = Tree({"a": {"y": [3], "z": None}, "b": None, "c": {"d": None}, "floor_height_m": None})
    assert merge(below, above).data == {"a": {"x": 1, "y": [3]}, "c": {}, "floor_height_m": None}
    assert below.data["b"] == 2


def test_a_file_is_laid_over_the_one_it_extends(tmp_path):
    child, base = load_scenario(write(tmp_path, CHILD)), load_scenario("platform")
    assert (child.name, child.file.supports.friction, child.file.supports.normal_force_cap_N) == (
        "child",
        0.5,
        None,
    )
    assert child.file.scene == base.file.scene
    assert child.file.planning == base.file.planning
    assert child.file.description == base.file.description


def test_variants_are_laid_over_the_file(tmp_path):
    path = write(tmp_path, CHILD)
    plain, slow = load_scenario(path), load_scenario(path, "slow")
    assert (slow.name, slow.file.description, slow.file.planning.max_duration_s) == (
        "child@slow",
        "slower",
        9.0,
    )
    assert slow.file.supports == plain.file.supports
    bare = load_scenario(f"{path}@bare")
    assert bare.file.floor_height_m is None
    assert bare.file.com_constraints == []
    assert bare.file.planning.weights.margin is None
    assert bare.file.planning.min_margin == plain.file.planning.min_margin
    inherited = list_variants("platform")
    assert list_variants(path) == inherited | {"slow": "slower", "bare": plain.file.description}


def test_variants_are_inherited_changed_and_can_be_extended(tmp_path):
    write(tmp_path, CHILD)
    change = {"variants": {"slow": {"planning": {"min_margin": 10.0}}, "bare": None}}
    heir = write(tmp_path, {"extends": "child.yaml", "name": "heir"} | change, "heir.yaml")
    assert list(list_variants(heir)) == [*list_variants("platform"), "slow"]
    planning = load_scenario(heir, "slow").file.planning
    assert (planning.max_duration_s, planning.min_margin) == (9.0, 10.0)
    of_variant = load_scenario(write(tmp_path, {"extends": "child.yaml@slow"}, "of.yaml"))
    assert (of_variant.name, of_variant.file.planning.max_duration_s) == ("child@slow", 9.0)


def test_the_resolved_scenario_stands_alone(tmp_path):
    path = write(tmp_path, CHILD)
    for variant in (None, "slow", "bare"):
        scenario = load_scenario(path, variant, ["supports.friction=0.4"])
        text = scenario.to_yaml()
        assert not {"extends", "variants"} & set(yaml.safe_load(text))
        again = load_scenario(write(tmp_path, text, "again.yaml"))
        assert again.file == scenario.file
        assert again.to_yaml() == text


def test_every_built_in_scenario_and_variant_is_usable():
    for name in list_scenarios():
        for scenario in (load_scenario(name), *(load_scenario(name, v) for v in list_variants(name))):
            assert scenario.name.split("@")[0] == name
            assert scenario.file.description
            if scenario.missing_mesh() is not None:
                continue  # an extra that is not installed
            scene = scenario.build_scene()
            if scenario.file.supports is None:
                continue  # its contacts are planned, tests/pipeline/test_contact_search.py
            scenario.check_contacts(scene)
            scenario.build_centroidal_problem()


def test_a_mesh_of_an_extended_file_is_found_from_elsewhere(tmp_path):
    import trimesh

    (tmp_path / "base").mkdir()
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "base" / "cube.stl")
    scene = [{"name": "cube", "mesh": "cube.stl", "position": [3, 0, 0.5]}]
    base = {"extends": "platform", "scene": scene, "variants": {"v": {"scene": scene}}}
    write(tmp_path / "base", base, "base.yaml")
    path = write(tmp_path, {"extends": "base/base.yaml"})
    for variant in (None, "v"):
        assert "cube" in load_scenario(path, variant).build_scene()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"extends": "plattform"}, r"child\.yaml:1: extends names .*did you mean 'platform'\?"),
        (
            {"extends": "none.yaml"},
            r"child\.yaml:1: extends names .*none\.yaml: there is no such file; .*valid: ",
        ),
        ({"extends": 3}, r"child\.yaml:1: extends is 3; valid: a built-in scenario"),
        ({"extends": "child.yaml"}, r"child\.yaml:1: extends is 'child\.yaml', which leads back"),
        ({"extends": "platform@none"}, r"has no variant 'none'; valid: slippery"),
        ({"variants": [1]}, r"child\.yaml:\d+: variants is \[1\]; valid: a mapping"),
        ({"variants": {"v": 3}}, r"child\.yaml:\d+: variants\.v is 3; valid: a mapping"),
        ({"variants": {"a/b": {}}}, r"variants\.a/b is a name that cannot be asked for"),
        ({"variants": {"v": {"extends": "platform"}}}, r"variants\.v\.extends is not for a variant"),
        ({"variants": {"v": {"supports": {"frictoin": 1}}}}, r"child\.yaml:\d+: supports\.frictoin .*'v'\)"),
        ({"variants": {"v": {"task": None}}}, r"task is missing; .*\(variant 'v'\)"),
        ({"supports": {"friction": -1}}, r"child\.yaml:4: supports\.friction is -1"),
    ],
)
def test_mistakes_give_one_line_with_their_place(tmp_path, change, says):
    with pytest.raises(ScenarioError, match=says) as caught:
        load_scenario(write(tmp_path, CHILD | change))
    assert "\n" not in str(caught.value)


def test_extends_is_the_first_key_and_leads_in_no_circle(tmp_path):
    with pytest.raises(ScenarioError, match=r"extends is not at the top; valid: the first key"):
        load_scenario(write(tmp_path, "name: a\nextends: platform\n"))
    write(tmp_path, {"extends": "b.yaml"}, "a.yaml")
    write(tmp_path, {"extends": "a.yaml"}, "b.yaml")
    with pytest.raises(ScenarioError, match=r"b\.yaml:1: extends is 'a\.yaml', which leads back to .*a\."):
        load_scenario(tmp_path / "a.yaml")


def test_a_mistake_in_the_extended_file_is_placed_there(tmp_path):
    write(tmp_path, "name: a\nbody: {mass_kg: -3}\ntask: {start: {com: [0, 0, 1]}}\n", "base.yaml")
    with pytest.raises(ScenarioError, match=r"base\.yaml:2: body\.mass_kg is -3"):
        load_scenario(write(tmp_path, {"extends": "base.yaml", "name": "b"}))


def test_an_unknown_variant_names_the_valid_ones(tmp_path):
    path = write(tmp_path, CHILD)
    with pytest.raises(
        ScenarioError,
        match=r"no variant 'slo'; did you mean 'slow'\? valid: slippery, found, pushed, pushed-hard, slow",
    ):
        load_scenario(path, "slo")
    with pytest.raises(
        ScenarioError, match=r"no variant ''; valid: slippery, found, pushed, pushed-hard, slow"
    ):
        load_scenario(f"{path}@")
    with pytest.raises(ScenarioError, match="names a variant, and so does 'bare'"):
        load_scenario(f"{path}@slow", "bare")
    with pytest.raises(ScenarioError, match="already loaded"):
        run(load_scenario(path), variant="slow")


def test_single_values_are_set():
    scenario = load_scenario(
        "platform",
        overrides=[
            "supports.friction=0.5", "scene.roof.position.2=1.4", "scene.1.box=[0.1, 1.5, 0.2]",
            "scene.platform=null", "planning.max_duration_s=null", "push={force_N: 1, direction_deg: 0, "
            "duration_s: 1, at_s: 0}", "supports.phases.1.min_duration_s=7e-1", "floor_height_m=null",
        ],
    )  # fmt: skip
    file = scenario.file
    assert file.supports.friction == 0.5
    assert [entry.name for entry in file.scene] == ["roof", "threshold"]
    assert file.scene[0].position == (0.9, 0.75, 1.4)
    assert file.scene[1].box == (0.1, 1.5, 0.2)
    assert (file.planning.max_duration_s, file.floor_height_m, file.push.force_N) == (None, None, 1.0)
    assert file.supports.phases[1].min_duration_s == 0.7
    assert load_scenario("platform").file.scene[0].position == (0.9, 0.75, 1.5)


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("supports.frictoin=1", "is not a known key; did you mean 'friction'? valid: friction, sole"),
        ("suports.friction=1", "suports is not a known key; did you mean 'supports'?"),
        ("scene.rof.position.2=1", "scene has no entry 'rof'; valid: an entry from 0 to 2, or roof,"),
        ("scene.7.position.2=1", "scene has no entry '7'; valid: an entry from 0 to 2"),
        ("scene.-1.position.2=1", "scene has no entry '-1'"),
        ("scene.0.position.3=1", "scene.0.position has no entry '3'; valid: an entry from 0 to 2"),
        ("supports.phases.1.right_foot.yaw_deg=1", "supports.phases.1.right_foot is 'same', which holds no"),
        ("supports.friction.x=1", "supports.friction is 0.7, which holds no 'x'"),
        ("supports.friction=slippery", "supports.friction is 'slippery'; valid: a number"),
        ("supports.friction=", "has no value; valid: a YAML value"),
        ("supports.friction=[1", "is not valid YAML"),
        ("supports.friction", "is not KEY=VALUE"),
        ("=3", "is not KEY=VALUE"),
        ("a..b=3", "is not KEY=VALUE"),
        ("task=null", "task is missing"),
        ("variants.v.seed=3", "variants cannot be set; valid: "),
        ("extends=platform", "extends cannot be set; valid: "),
    ],
)  # fmt: skip
def test_a_setting_that_is_wrong_is_refused_in_one_line(setting, says):
    with pytest.raises(ScenarioError, match=re.escape(says)) as caught:
        load_scenario("platform", overrides=[setting])
    assert str(caught.value).startswith("--set ")
    assert "\n" not in str(caught.value)


def test_the_cab_of_the_thesis_is_its_own_mesh():
    """Seated upright in it, a person of 1.60 m has room below the roof; the seat slopes by 9 degrees."""
    scenario = load_scenario("truck-egress", "cab").with_body(stature_m=1.60)
    if (missing := scenario.missing_mesh()) is not None:
        pytest.skip(missing)
    body, scene = scenario.build_body(), scenario.build_scene()
    start = Endpoints(PostureFinder(body, scene), 0.7).find(np.array([0.05, -0.42]), 0.0, Habit.SEATED, 1.23)
    assert start.stage is not None, start.failure
    assert np.degrees(np.arccos(start.stage.contacts["buttocks"].normal[2])) == pytest.approx(9.1, abs=0.1)
