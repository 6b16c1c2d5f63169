"""Robots from MJCF: the same mechanics as MuJoCo's own model of the file, our export as it was."""

import os
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.reports.export.test_bvh import make_motion

from manikin.body import (
    Configuration,
    ShapeKind,
    creature_from_mjcf,
    human,
    quadruped,
    random_configuration,
)
from manikin.errors import BodyError
from manikin.reports.formats.robots import to_mjcf

WALKER = Path(__file__).with_name("data") / "walker.xml"
LIMBS = {side: {"tip": f"{side}_foot", "contact": "sole"} for side in ("left", "right")}
SOLE = {"sole_length": 0.2, "sole_width": 0.1}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The description with its mesh, a sole in millimetres."""
    folder = tmp_path_factory.mktemp("walker")
    (folder / "meshes").mkdir()
    trimesh.creation.box((200.0, 100.0, 40.0)).export(folder / "meshes" / "sole.stl")
    return Path(shutil.copy(WALKER, folder))


@pytest.fixture(scope="module")
def walker(written):
    return creature_from_mjcf(written, LIMBS, **SOLE)


@pytest.fixture
def file(written, tmp_path):
    """A copy that may be changed."""
    shutil.copytree(written.parent, tmp_path, dirs_exist_ok=True)
    return tmp_path / written.name


def test_segments_hinges_and_limits_are_those_of_the_file(walker):
    """Fixed bodies are merged, three joints of a hip are one segment's; the knee is off its body's origin."""
    legs = ["left_thigh", "left_shank/left_knee", "right_thigh", "right_shank/right_knee"]
    assert [segment.name for segment in walker.segments] == ["trunk", *legs]
    assert walker.joint_names[:4] == ("left_yaw", "left_roll", "left_pitch", "left_knee")
    torques = [(hinge.torque_lower, hinge.torque_upper) for hinge in walker.hinges[:4]]
    # Motor with a gear, position servo with a force range, general with a gain, the joint's own range.
    assert torques == [(-30.0, 30.0), (-40.0, 40.0), (-120.0, 100.0), (-50.0, 70.0)]
    np.testing.assert_allclose([walker.hinges[2].lower, walker.hinges[2].upper], np.deg2rad([-90.0, 60.0]))
    assert {hinge.velocity_limit for hinge in walker.hinges} == {10.0}
    assert [limb.mirror for limb in walker.limbs] == ["right", "left"]


def test_what_cannot_touch_is_left_out_and_a_mesh_is_the_box_that_it_is(walker):
    assert [shape.kind for shape in walker.segment("trunk").shapes] == [ShapeKind.BOX, ShapeKind.BOX]
    shank = walker.segment("left_shank/left_knee").shapes
    assert [shape.kind for shape in shank] == [ShapeKind.CAPSULE, ShapeKind.BOX]
    np.testing.assert_allclose(np.sort(shank[1].size), [0.04, 0.1, 0.2], atol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_mechanics_are_those_of_mujoco(walker, written, seed):
    """Mass matrix, centre of mass and feet in random postures, to rounding."""
    model = mujoco.MjModel.from_xml_path(str(written))
    model.dof_armature[:] = 0.0
    data, q = mujoco.MjData(model), random_configuration(walker, np.random.default_rng(seed))
    state, dofs = Configuration(walker, q), [0, 1, 2, 3, 4, 5]
    data.qpos[:7] = q[[0, 1, 2, 6, 3, 4, 5]]
    for name in walker.joint_names:
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]] = q[7 + walker.joint_index(name)]
        dofs.append(joint.dofadr[0])
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.subtree_com[model.body("trunk").id], state.com, atol=1e-9)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    turn = np.eye(model.nv)  # MuJoCo has the root's linear velocity in the world, we in the root
    turn[:3, :3] = Rotation.from_quat(q[3:7]).as_matrix()
    wanted = turn.T @ matrix[np.ix_(dofs, dofs)] @ turn
    np.testing.assert_allclose(wanted, state.mass_matrix, atol=1e-8)
    for side in ("left", "right"):
        foot = state.effector_placement(f"{side}_foot")[1]
        np.testing.assert_allclose(data.body(f"{side}_foot").xpos, foot, atol=1e-9)


@pytest.mark.parametrize("make", [human, quadruped])
def test_our_own_export_comes_back(make, tmp_path):
    """Masses within 1e-9, joint frames within 1e-6 m, and limits; segments without a hinge are merged."""
    body = make()
    file = tmp_path / "body.xml"
    file.write_text(to_mjcf(body, make_motion(body, body.standing_posture()[None])))
    tips = {limb.name: {"tip": body.effector(limb.effector).segment} for limb in body.limbs}
    again = creature_from_mjcf(file, tips)
    assert again.joint_names == body.joint_names
    moving = [segment.name for segment in body.segments if segment.hinges or segment.parent is None]
    assert [segment.name for segment in again.segments] == moving
    assert again.mass == pytest.approx(body.mass, rel=1e-9)
    q = random_configuration(body, np.random.default_rng(5))
    first, second = Configuration(body, q), Configuration(again, q)
    np.testing.assert_allclose(second.com, first.com, atol=1e-9)
    scale = np.abs(first.mass_matrix).max()
    np.testing.assert_allclose(second.mass_matrix, first.mass_matrix, atol=1e-8 * scale)
    for name in moving:
        (turn, place), (wanted, at) = second.segment_placement(name), first.segment_placement(name)
        np.testing.assert_allclose(place, at, atol=1e-6)
        np.testing.assert_allclose(turn, wanted, atol=1e-6)
    for hinge, other in zip(body.hinges, again.hinges, strict=True):
        assert [other.lower, other.upper] == pytest.approx([hinge.lower, hinge.upper], rel=1e-9)
        # The engine's writer has six digits.
        torques = [other.torque_lower, other.torque_upper]
        assert torques == pytest.approx([hinge.torque_lower, hinge.torque_upper], rel=1e-5)


TABLE = '<geom type="box" size="0.4 0.4 0.4"/></body>'


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("<mujoco", "<robot", "is no XML"),
        ("</mujoco>", "", "is no XML"),
        ("<worldbody>", '<include file="/dev/zero"/><worldbody>', "has <include>; valid: one file"),
        ('<geom class="visual" type', '<composite type="grid"/><geom class="visual" type', "has <composite>"),
        ("<sensor>", '<equality><joint joint1="left_yaw"/></equality><sensor>', "has <equality>"),
        ('file="sole.stl"', 'file="gone.stl"', "'gone.stl' is not found"),
        ('file="sole.stl"', 'file="../walker.xml"', "has this ending; valid: a file of .stl"),
        ('mesh file="sole.stl"', 'mesh name="sole" builtin="sphere" params="9"', "built in"),
        ('<joint name="left_knee"', '<joint name="left_knee" type="slide"', "type is slide; valid: hinge"),
        ('<joint name="left_knee"', '<joint name="left_knee" type="ball"', "left_knee"),
        ('<joint name="left_knee"', "<joint", "joint without a name"),
        ('<body name="left_foot"', "<body", "body has no name"),
        ("<freejoint/>", '<joint name="pole" range="-1 1"/>', "turns on the world; valid: a free joint"),
        (TABLE, '<freejoint/><geom size="0.1"/></body>', "cannot be compiled"),
        (
            TABLE, '<freejoint/><geom type="sphere" size="0.1"/></body>',
            r"robots are \['table', 'trunk'\]; valid: one body",
        ),
        (' actuatorfrcrange="-50 70"', "", "torques from -inf to inf; valid: limits"),
        ('gear="30"', 'gear="0"', "torques from 0 to 0"),
        ('mass="20"', 'mass="1e6"', r"mass is 1e\+06"),
        ('mass="20"', 'mass="-1"', "has mass '-1'; valid: not below 0"),
        ('fullinertia="0.6', 'fullinertia="9', "cannot be compiled"),
        ('fromto="0 0 0 0 0 -0.35"', 'fromto="inf 0 0 0 0 -0.35"', "has axes without directions"),
        ('pos="0.02 0 -0.4"', 'pos="0.02 0 -400"', "at most 100 m away"),
        ('type="box" size="0.1', 'type="box" size="1000', "valid: > 0 and at most 100 m"),
        ('type="box" size="0.1 0.15 0.25"', 'type="plane" size="1 1 1"', "plane"),
        ('material="grey"', 'colour="grey"', "unrecognized attribute"),
    ],
)  # fmt: skip
def test_broken_descriptions_are_refused_in_one_line(file, old, new, match, monkeypatch):
    monkeypatch.chdir(file.parent)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(BodyError, match=match) as error:
        creature_from_mjcf(file, LIMBS, **SOLE)
    assert "\n" not in str(error.value)
    assert "valid: " in str(error.value)
    assert not Path("MUJOCO_LOG.TXT").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_and_vast_files_are_refused_before_they_are_compiled(tmp_path):
    os.mkfifo(tmp_path / "pipe.xml")
    (tmp_path / "many.xml").write_text(f"<mujoco><worldbody>{'<body/>' * 300}</worldbody></mujoco>")
    (tmp_path / "more.xml").write_text(f"<mujoco><custom>{'<text/>' * 30_000}</custom></mujoco>")
    (tmp_path / "none.xml").write_text("<mujoco/>")
    (tmp_path / "urdf.xml").write_text("<robot/>")
    for name, said in (
        ("pipe", "no regular file"), ("many", "300 bodies; valid: at most 200"),
        ("more", "30002 elements; valid: at most 20000"), ("none", r"robots are \[\]"),
        ("urdf", "begins with <robot>; valid: <mujoco>"), ("gone", "valid: an MJCF file"),
    ):  # fmt: skip
        with pytest.raises(BodyError, match=said):
            creature_from_mjcf(tmp_path / f"{name}.xml", LIMBS)


@given(st.integers(0, 10**6), st.binary(max_size=3))
def test_a_damaged_description_is_read_or_refused(written, place, junk):
    whole = written.read_bytes()
    at = place % len(whole)
    damaged = written.with_name("damaged.xml")
    damaged.write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
    message = ""
    try:
        creature_from_mjcf(damaged, LIMBS, **SOLE)
    except BodyError as error:
        message = str(error)
    assert "\n" not in message
