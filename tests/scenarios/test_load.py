"""Scenario files: what is built from them, and one line for whatever is wrong with them."""

import copy
import re
from pathlib import Path

import casadi
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from manikin.contact import ContactKind
from manikin.errors import ScenarioError
from manikin.scenarios import json_schema, list_scenarios, load_scenario

MINIMAL = {
    "name": "test",
    "supports": {
        "phases": [
            {
                "left_foot": {"position": [0, 0.1, 0], "yaw_deg": 90},
                "right_foot": {"position": [0, -0.1, 0]},
                "right_hand": {"position": [0.4, -0.2, 1.1], "max_force_N": 100},
            },
            {"left_foot": "same", "min_duration_s": 0.4},
        ]
    },
    "scene": [{"name": "step", "box": [1, 1, 0.2], "position": [2, 0, 0.1]}],
    "task": {"start": {"com": [0, 0, 0.9]}, "goal": {"com": [0, 0.1, 0.9]}},
    "com_constraints": [{"height_band": {"lower": "0.5", "upper": "1.0"}}],
}


def write(folder: Path, data, name="test.yaml"):
    path = folder / name
    if isinstance(data, bytes):
        path.write_bytes(data)
    else:
        path.write_text(data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False))
    return path


def changed(path, value):
    """MINIMAL with the value at a path replaced, or removed when it is ``...``."""
    data = copy.deepcopy(MINIMAL)
    place = data
    for key in path[:-1]:
        place = place[key]
    if value is ...:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


PLATFORM = load_scenario("platform")

FOOT = ("supports", "phases", 0, "left_foot")

BAD_VALUES = [
    (("name",), ..., "name", "is missing"),
    (("task",), ..., "task", "is missing"),
    (("task", "goal", "com"), ..., "task.goal", "com"),
    (("task", "start"), {"at": [0, 0]}, "task.start.com", "is missing"),
    (("task", "start", "com"), [0, 0], "task.start.com", "three numbers"),
    (("task", "start", "com"), [0, 0, float("nan")], "task.start.com[2]", "finite number"),
    (("task", "start", "com"), [0, 0, "high"], "task.start.com", "three numbers"),
    (("body",), {"mass_kg": -79}, "body.mass_kg", "> 0"),
    (("body",), {"mass_kg": "79"}, "body.mass_kg", "a number"),
    (("body",), {"mass_kg": float("nan")}, "body.mass_kg", "finite"),
    (("body",), {"mass_kg": float("inf")}, "body.mass_kg", "finite"),
    (("body",), {"mass_kg": True}, "body.mass_kg", "a number"),
    (("body",), {"sex": "other"}, "body.sex", "'male' or 'female'"),
    (("body",), {"model": "robot"}, "body.model", "'human'"),
    (("body",), {"mass": 79}, "body.mass", "mass_kg"),
    (("body",), "human", "body", "a mapping"),
    (("supports", "friction"), 0, "supports.friction", "> 0"),
    (("supports", "frictoin"), 0.7, "supports.frictoin", "did you mean 'friction'"),
    (("supports", "sole"), {"length_m": 0.28}, "supports.sole.width_m", "missing"),
    (("supports", "planning_sole"), {"length_m": 0.3, "width_m": 0.1}, "planning_sole.length_m", "most"),
    (("supports", "normal_force_cap_N"), 0, "supports.normal_force_cap_N", "> 0"),
    (("supports", "phases"), [], "supports.phases", "at least 1"),
    (("supports", "phases"), {"a": 1}, "supports.phases", "a list"),
    (("supports", "phases", 1, "min_duration_s"), -1, "supports.phases[1].min_duration_s", "> 0"),
    (("supports", "phases", 1, "max_duration_s"), 0.1, "supports.phases[1].max_duration_s", "at least"),
    (("supports", "phases", 1), {"min_duration_s": 1}, "supports.phases[1]", "no contact"),
    (("supports", "phases", 1, "right_hand"), "sam", "supports.phases[1].right_hand", "'same'"),
    (("supports", "phases", 0, "left_foot"), "same", "supports.phases[0].left_foot", "'same'"),
    (("supports", "phases", 1, "tail"), "same", "supports.phases[1].tail", "left_foot"),
    ((*FOOT, "position"), ..., "supports.phases[0].left_foot.position", "missing"),
    ((*FOOT, "position"), [0, 0, 0, 0], "supports.phases[0].left_foot.position", "three numbers"),
    ((*FOOT, "yaw_deg"), "north", "supports.phases[0].left_foot.yaw_deg", "a number"),
    ((*FOOT, "friction"), 0, "supports.phases[0].left_foot.friction", "> 0"),
    ((*FOOT, "kind"), "foot", "supports.phases[0].left_foot.kind", "'sole'"),
    ((*FOOT, "normal"), [0, 0, 0], "supports.phases[0].left_foot.normal", "not zero"),
    ((*FOOT, "max_force_N"), 10, "supports.phases[0].left_foot.max_force_N", "does not belong to a sole"),
    (("supports", "phases", 0, "right_hand", "max_force_N"), ..., "right_hand.max_force_N", "missing"),
    (("supports", "phases", 0, "right_hand", "friction"), 0.5, "right_hand.friction", "grasp"),
    (("scene", 0, "box"), ..., "scene[0]", "exactly one of box"),
    (("scene", 0, "sphere"), {"radius_m": 1}, "scene[0]", "exactly one"),
    (("scene", 0, "box"), [1, 0, 1], "scene[0].box[1]", "> 0"),
    (("scene", 0, "boxx"), [1, 1, 1], "scene[0].boxx", "did you mean 'box'"),
    (("scene", 0, "scale"), 2.0, "scene[0].scale", "only with mesh"),
    (("scene",), [MINIMAL["scene"][0]] * 2, "scene[1].name", "unique"),
    (("scene",), 3, "scene", "a list"),
    (("com_constraints", 0, "height_band", "lower"), "import os", "height_band.lower", "cannot be read"),
    (("com_constraints", 0, "height_band", "lower"), "foo(x)", "height_band.lower", "atan"),
    (("com_constraints", 0, "height_band", "lower"), "1/0", "height_band.lower", "finite height"),
    (("com_constraints", 0, "height_band", "lower"), "1.1", "height_band", "lower <= upper"),
    (("com_constraints", 0, "height_band", "lower"), 0.5, "height_band.lower", "a text"),
    (("com_constraints", 0), {}, "com_constraints[0]", "exactly one"),
    (("com_constraints",), [{"max_support_distance_m": 1.0}] * 2, "com_constraints", "twice"),
    (("planning",), {"degree": 2}, "planning.degree", ">= 3"),
    (("planning",), {"degree": 5.5}, "planning.degree", "whole number"),
    (("planning",), {"weights": {"speed": 1}}, "planning.weights.speed", "margin"),
    (("planning",), {"weights": {"jerk": [1, 1, -1]}}, "planning.weights.jerk[2]", ">= 0"),
    (("push",), {"force_N": 200}, "push.direction_deg", "missing"),
    (("seed",), -1, "seed", ">= 0"),
    (("seed",), 1.5, "seed", "whole number"),
    (("name",), "../../elsewhere", "name", "letters"),
    (("name",), "n" * 101, "name", "at most 100"),
    (("task", "start", "at"), [0, 0], "task.start.at", "only com"),
    (("task", "goal", "posture"), "seated", "task.goal.posture", "only com"),
    (("task", "goal", "heading_deg"), 90, "task.goal.heading_deg", "only com"),
    (("task", "goal", "com"), [1e160, 0, 0.9], "task.goal.com[0]", "<= 1e+06"),
    (("body",), {"mass_kg": 1e300}, "body.mass_kg", "<= 1e+06"),
    (("supports", "normal_force_cap_N"), 1e-300, "supports.normal_force_cap_N", ">= 1e-06"),
    (("supports", "phases", 1, "min_duration_s"), 1e5, "supports.phases[1].min_duration_s", "<= 60"),
    (("floor_height_m",), "low", "floor_height_m", "a number"),
    (("colour",), 1, "colour", "not a known key"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("path", "value", "key", "says"), BAD_VALUES, ids=[f"{k}-{s[:12]}" for _, _, k, s in BAD_VALUES]
)
def test_bad_value_gives_one_line_with_file_key_and_remedy(tmp_path, path, value, key, says):
    file = write(tmp_path, changed(path, value))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(str(file))
    assert key in text
    assert says in text
    # The line of the file is there as well.
    assert re.match(re.escape(str(file)) + r":\d+: ", text)


def without_supports(**changes):
    task = {"start": {"at": [0, 0]}, "goal": {"at": [1, 0]}}
    return changed(("supports",), ...) | {"task": task} | changes


ALIASES = "\n".join([
    "a0: &a0 [1,1,1,1,1,1,1,1,1]",
    *(f"a{n}: &a{n} [{','.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)),
])  # fmt: skip
"""Nine levels of nine aliases each stand for 387 million entries."""

TASK = "name: a\ntask:\n  start: {com: [0, 0, 1]}\n  goal: {com: [0, 0, 1]}\n"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("name: a\nbody:\n  stature_m: 1.75\n  mass_kg: -3\ntask: {start: {com: [0,0,1]}}\n",
         r":4: body.mass_kg is -3; valid: a number > 0 \(and 1 more\)"),
        ("name: a\nbody: {}\n  x: : :\n", r"test\.yaml:3: is not valid YAML"),
        (b"\xff\xfe\x00name", "UTF-8"),
        (ALIASES, "more than"),
        (TASK + "supports:\n  phases:\n  - left_foot: same\n",
         r":7: supports\.phases\[0\]\.left_foot is 'same'"),
        (changed(("supports", "sole"), {"length_m": 0.28}),
         r"sole\.width_m is missing; valid: across it \[m\]"),
        (MINIMAL | {"contacts": {"friction": 0.5}}, "contacts is given beside supports; valid: one of them"),
        (without_supports(body={"model": "point_mass"}),
         "supports is missing; valid: explicit supports for a point mass"),
        (without_supports(task={"start": {"at": [0, 0], "com": [0, 0, 1]}, "goal": {"at": [1, 0]}}),
         r"task\.start\.com has no meaning without explicit supports; valid: at"),
        (without_supports(wholebody={"method": "refine"},
                          task={"start": {"at": [0, 0]}, "goal": {"at": [1, 0], "posture": "seated"}}),
         r"task\.goal\.posture is seated; valid: standing or crouched"),
        (without_supports(task={"start": {"at": [0, 0], "posture": "lying"}, "goal": {"at": [1, 0]}}),
         r"task\.start\.posture is 'lying'; valid: .*standing"),
        (without_supports(contacts={"stride_m": 0}), r"contacts\.stride_m is 0; valid: a number > 0"),
    ],
    ids=lambda value: value[:24] if isinstance(value, str) else "",
)  # fmt: skip
def test_what_cannot_be_loaded_is_refused(tmp_path, data, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario(write(tmp_path, data))


@pytest.mark.parametrize(
    ("data", "build", "message"),
    [
        (without_supports(), lambda job: job.build_sequence(),
         "supports is missing; valid: an explicit sequence of phases"),
        (changed(("supports", "sole"), {"length_m": 3.0, "width_m": 0.1}), lambda job: job.build_body(),
         r"supports\.sole: .*sole_length"),
        (changed((*FOOT, "position"), [0, 0.1, 0.05]), lambda job: job.check_contacts(job.build_scene()),
         r"supports\.phases\[0\]\.left_foot.*above"),
        (changed(("supports", "phases", 1, "left_foot"), {"position": [0, 0.2, 0], "yaw_deg": 90}),
         lambda job: job.build_sequence(), "slides"),
        (changed(("scene", 0), {"name": "car", "mesh": "car.stl"}), lambda job: job.build_scene(),
         r"test\.yaml:\d+: scene\[0\].*car\.stl"),
        (changed(("scene", 0), {"name": "car", "mesh": "broken.stl"}), lambda job: job.build_scene(),
         r"test\.yaml:\d+: scene\[0\].*broken\.stl"),
    ],
)  # fmt: skip
def test_what_cannot_be_built_is_refused_in_one_line(tmp_path, data, build, message):
    (tmp_path / "broken.stl").write_text("not a mesh")
    with pytest.raises(ScenarioError, match=message) as caught:
        build(load_scenario(write(tmp_path, data)))
    assert "\n" not in str(caught.value)


def test_a_phase_may_say_where_the_centre_of_mass_begins(tmp_path):
    """Six planes for each such phase: the faces of a box about the place."""
    near = {"com_near": [0.01, 0.02, 0.9], "com_within_m": [0.03, 0.04, 0.05]}
    phases = [*MINIMAL["supports"]["phases"]]
    phases[1] = phases[1] | near
    job = load_scenario(write(tmp_path, changed(("supports", "phases"), phases)))
    planes = job.build_centroidal_problem().key_planes
    assert [plane.key for plane in planes] == [1] * 6
    inside, corner = np.array([0.01, 0.02, 0.9]), np.array([0.04, 0.06, 0.95])
    rooms = [plane.violation(inside) for plane in planes]
    np.testing.assert_allclose(rooms, [-0.03, -0.03, -0.04, -0.04, -0.05, -0.05], atol=1e-12)
    assert max(plane.violation(corner) for plane in planes) == pytest.approx(0.0, abs=1e-12)
    phases[0] = phases[0] | near
    with pytest.raises(ScenarioError, match=r"supports\.phases\[0\]\.com_near is given"):
        load_scenario(write(tmp_path, changed(("supports", "phases"), phases)))


def test_a_push_after_the_motion_is_refused(tmp_path):
    push = {"force_N": 10, "direction_deg": 0, "duration_s": 0.1, "at_s": 5}
    job = load_scenario(write(tmp_path, MINIMAL | {"push": push}))
    job.check_push(5.1)
    with pytest.raises(ScenarioError, match=r"push\.at_s is 5; valid: before the motion ends at 4\.900 s"):
        job.check_push(4.9)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("# nothing\n", "is empty"),
        ("name: [1, 2\n", "not valid YAML"),
        ("name: a\n\tbody: 1\n", "not valid YAML"),
        ("- 1\n- 2\n", "a mapping"),
        ("just a text", "a mapping"),
        ("name: a\nname: b\n", ":2: key 'name' is given twice"),
        ("a: &x [*x]\n", "alias"),
        ("name: !!python/object/apply:os.system ['true']\n", "not valid YAML"),
        ("name: a\n---\nname: b\n", "not valid YAML"),
        ("x: " + "[" * 200_000, ":1: is nested too deeply"),
        ("".join("  " * level + "a:\n" for level in range(120)), ":101: is nested too deeply"),
        ("\na: !!float ''\n", ":2: is not valid YAML ('' is no float)"),
        ("a: !!int ''\n", ":1: is not valid YAML ('' is no int)"),
        ("a: !!bool x\n", ":1: is not valid YAML ('x' is no bool)"),
        ("a: !!timestamp x\n", ":1: is not valid YAML ('x' is no timestamp)"),
        ("? [a, b]\n: 1\n", "YAML"),
    ],
)
def test_broken_yaml_gives_one_line(tmp_path, text, says):
    file = write(tmp_path, text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)
    assert says in str(caught.value)


def test_missing_file_directory_and_other_files_name_the_built_in_scenarios(tmp_path):
    for name in ("plattform", tmp_path / "none.yaml", tmp_path, ""):
        with pytest.raises(ScenarioError, match="platform") as caught:
            load_scenario(name)
        assert "\n" not in str(caught.value)
    (tmp_path / "motion.h5").write_bytes(b"x")
    with pytest.raises(ScenarioError, match=r"\.yaml"):
        load_scenario(tmp_path / "motion.h5")
    with pytest.raises(ScenarioError, match="did you mean 'platform'"):
        load_scenario("plattform")


def test_numbers_are_read_as_yaml_1_2_has_them(tmp_path):
    text = yaml.safe_dump(MINIMAL) + "seed: 010\nbody: {mass_kg: 8e1}\n"
    text += "push: {force_N: 1e2, direction_deg: -5, duration_s: .1, at_s: 0}\n"
    with pytest.raises(ScenarioError, match=r"seed is 10\.0"):
        load_scenario(write(tmp_path, text))
    scenario = load_scenario(write(tmp_path, text.replace("010", "10")))
    assert (scenario.seed, scenario.mass, scenario.file.push.force_N) == (10, 80.0, 100.0)


def test_mesh_path_is_relative_to_the_file_and_absolute_in_the_resolved_one(tmp_path):
    import trimesh

    trimesh.creation.box((100.0, 100.0, 100.0)).export(tmp_path / "cube.stl")
    entry = {"name": "cube", "mesh": "cube.stl", "unit": "cm", "position": [3, 0, 0.5]}
    scenario = load_scenario(write(tmp_path, changed(("scene", 0), entry)))
    low, high = scenario.build_scene()["cube"].bounds
    np.testing.assert_allclose([low, high], [[2.5, -0.5, 0.0], [3.5, 0.5, 1.0]], atol=1e-6)  # float32 STL
    (tmp_path / "elsewhere").mkdir()
    copy_ = load_scenario(write(tmp_path / "elsewhere", scenario.to_yaml()))
    for one, other in zip(copy_.build_scene(), scenario.build_scene(), strict=True):
        assert (one.name, type(one.shape)) == (other.name, type(other.shape))
        np.testing.assert_array_equal(one.to_trimesh().vertices, other.to_trimesh().vertices)


def test_every_shape_is_built(tmp_path):
    round_ = {"radius_m": 0.1, "length_m": 0.5}
    shapes = [
        {"cylinder": round_}, {"capsule": round_}, {"sphere": {"radius_m": 0.2}}, {"box": [1, 2, 3]},
        {"plane": [0, 1, 0]}, {"half_space": [1, 0, 0]},
    ]  # fmt: skip
    scene = [
        {"name": f"o{i}", "position": [5, 5, 5], "rpy_deg": [0, 0, 90], **s} for i, s in enumerate(shapes)
    ]
    built = load_scenario(write(tmp_path, changed(("scene",), scene))).build_scene()
    kinds = [type(obstacle.shape).__name__ for obstacle in built]
    assert kinds == ["HalfSpace", "Cylinder", "Capsule", "Sphere", "Box", "Plane", "HalfSpace"]
    np.testing.assert_allclose(built["o4"].world_plane[0], [-1, 0, 0], atol=1e-15)


def test_defaults_and_overrides_of_contacts(tmp_path):
    data = copy.deepcopy(MINIMAL)
    data["supports"].update(
        friction=0.6,
        sole={"length_m": 0.3, "width_m": 0.1},
        planning_sole={"length_m": 0.2, "width_m": 0.08},
        normal_force_cap_N=1200,
    )
    data["supports"]["phases"][0]["right_foot"].update(
        friction=0.3, sole={"length_m": 0.25, "width_m": 0.05}, normal_force_cap_N=600
    )
    scenario = load_scenario(write(tmp_path, data))
    stance = scenario.build_sequence()[0].stance
    left, right, hand = stance["left_foot"], stance["right_foot"], stance["right_hand"]
    assert (left.kind, right.kind, hand.kind) == (ContactKind.SOLE, ContactKind.SOLE, ContactKind.GRASP)
    assert (left.friction, left.length, left.width) == pytest.approx((0.6, 0.3, 0.1))
    assert left.yaw == pytest.approx(np.pi / 2)
    assert (right.friction, right.length, right.width, right.normal_force_cap) == pytest.approx(
        (0.3, 0.25, 0.05, 600)
    )
    assert hand.max_force == 100.0
    assert stance.normal_force_cap == 1200.0
    planned = scenario.build_sequence(planning=True)[0].stance
    assert (planned["left_foot"].length, planned["left_foot"].width) == pytest.approx((0.2, 0.08))
    assert (planned["right_foot"].length, planned["right_foot"].width) == pytest.approx((0.2, 0.05))


def test_cap_is_three_body_weights_when_none_is_given(tmp_path):
    stance = load_scenario(write(tmp_path, MINIMAL)).build_sequence()[0].stance
    assert stance.normal_force_cap == pytest.approx(3 * 79 * 9.81)


def test_resolved_scenario_is_the_same_scenario(tmp_path):
    for source in ("platform", write(tmp_path, changed(("floor_height_m",), None))):
        scenario = load_scenario(source).with_body(stature_m=1.6, mass_kg=58).with_seed(7)
        again = load_scenario(write(tmp_path, scenario.to_yaml(), "again.yaml"))
        assert again.file == scenario.file
        assert again.to_yaml() == scenario.to_yaml()
        assert (again.file.body.stature_m, again.mass, again.seed) == (1.6, 58.0, 7)


def test_overrides_are_checked():
    scenario = load_scenario("platform")
    for change in ({"stature_m": float("nan")}, {"mass_kg": -1.0}, {"sex": "x"}):
        with pytest.raises(ScenarioError, match="body"):
            scenario.with_body(**change)
    with pytest.raises(ScenarioError, match="seed"):
        scenario.with_seed(-1)
    with pytest.raises(ScenarioError, match="body"):
        scenario.with_body(stature_m=9.0).build_body()


def test_platform_has_the_published_numbers():
    """[Qiu2012]_ 5.4.4, Tables 5.2 and 5.3."""
    scenario = load_scenario("platform")
    scene, sequence = scenario.build_scene(), scenario.build_sequence()
    scenario.check_contacts(scene)
    assert scenario.name in list_scenarios()
    np.testing.assert_allclose(scene["roof"].bounds, [[0.35, 0.0, 1.475], [1.45, 1.5, 1.525]], atol=1e-12)
    assert [phase.stance.effectors for phase in sequence] == [
        ("left_foot", "right_foot"), ("right_foot",), ("left_foot", "right_foot"), ("left_foot",),
        ("left_foot", "right_foot"), ("right_foot",), ("left_foot", "right_foot"),
    ]  # fmt: skip
    assert [phase.min_duration for phase in sequence][1::2] == [0.4, 0.8, 0.8]
    np.testing.assert_array_equal(scenario.start_com, [0.0, 0.0, 0.92])
    np.testing.assert_array_equal(scenario.goal_com, [0.6, 0.65, 0.86])
    # 1.0 m in [Qiu2012]_ 3.2.3, 1.08 m in 7.5.
    assert 1.0 <= scenario.max_support_distance <= 1.08
    problem = scenario.build_centroidal_problem()
    assert (problem.degree, problem.mass, len(problem.geometric)) == (5, 79.0, 2)
    body = scenario.build_body()
    assert (body.stature, body.sole_length, body.sole_width) == (1.75, 0.28, 0.12)
    assert body.mass == pytest.approx(79.0)


def test_reference_stature_changes_nothing():
    scenario = load_scenario("platform")
    x, y, z = np.random.default_rng(0).uniform(-1, 2, (3, 100))
    band = scenario.height_band
    np.testing.assert_array_equal(band.upper(x, y, z), band.upper_expression(x, y, z))
    np.testing.assert_array_equal(band.lower(x, y, z), band.lower_expression(x, y, z))


@given(st.floats(1.55, 1.95), st.floats(-0.5, 1.2), st.floats(-0.5, 1.2))
def test_heights_scale_about_the_supports(stature, x, y):
    scenario = PLATFORM.with_body(stature_m=stature)
    s = stature / 1.75
    assert scenario.start_com[2] == pytest.approx(0.92 * s, rel=1e-12)
    assert scenario.goal_com[2] == pytest.approx(0.2 + 0.66 * s, rel=1e-12)
    assert scenario.max_support_distance == pytest.approx(s * PLATFORM.max_support_distance, rel=1e-12)
    band = scenario.height_band
    # The ends stay inside the band, and the band stays a band.
    for com in (scenario.start_com, scenario.goal_com):
        assert band.violation(com) < 0
    assert band.upper(x, y, 0.9) - band.lower(x, y, 0.9) == pytest.approx(0.02 * s, rel=1e-9)


def test_support_level_goes_smoothly_from_floor_to_platform():
    level = load_scenario("platform").support_level()
    share = np.linspace(-0.5, 1.5, 4001)
    heights = level(0.6 * share, 0.65 * share)
    assert heights[0] == 0.0
    assert heights[-1] == pytest.approx(0.2, abs=1e-15)
    assert np.all(np.diff(heights) >= -1e-15)
    # Second differences of a C2 function: bounded by its largest curvature, 5.78 * 0.2 for this blend,
    # and without a jump from one sample to the next.
    curvature = np.diff(heights, 2) / np.diff(share)[0] ** 2
    assert np.abs(curvature).max() < 1.16
    assert np.abs(np.diff(curvature)).max() < 0.01


def test_scaled_band_is_differentiable_for_casadi():
    band = load_scenario("platform").with_body(stature_m=1.6).height_band
    symbols = [casadi.SX.sym(name) for name in "xyz"]
    value = band.upper(*symbols)
    compiled = casadi.Function("f", symbols, [value, casadi.gradient(value, casadi.vertcat(*symbols))])
    for point in np.random.default_rng(1).uniform(-0.3, 1.0, (20, 3)):
        found, slope = compiled(*point)
        assert float(found) == pytest.approx(float(band.upper(*point)), rel=1e-13)
        step = 1e-6  # central differences of a function of order one: errors near 1e-10
        for axis, direction in enumerate(np.eye(3) * step):
            difference = (band.upper(*(point + direction)) - band.upper(*(point - direction))) / (2 * step)
            assert float(slope[axis]) == pytest.approx(float(difference), abs=1e-8)


def test_json_schema_knows_every_section():
    schema = json_schema()
    assert {"SupportsSection", "ContactSection", "ObstacleSection"} <= set(schema["$defs"])
    assert "same" in str(schema["$defs"]["PhaseSection"])
    ways = (["extends"], ["name", "task"], ["name", "recovery"])
    assert schema["anyOf"] == [{"required": keys} for keys in ways]
