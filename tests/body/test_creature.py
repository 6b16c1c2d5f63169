"""Creatures from robot descriptions: the same mechanics as in the file, limbs where they were named."""

import os
import shutil
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, LimbSpec, ShapeKind, creature_from_urdf, random_configuration
from manikin.body.urdf import read_urdf
from manikin.errors import BodyError

DOG = Path(__file__).with_name("data") / "dog.urdf"
NAMES = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
LIMBS = {name: {"tip": f"{name}_foot", "position": (0.02, 0.0, 0.0)} for name in NAMES}
STANDING = {f"{name}_{joint}": angle for name in NAMES for joint, angle in (("pitch", 0.6), ("knee", 1.2))}


@pytest.fixture
def dog_file(tmp_path):
    """The description with its mesh, a shank in millimetres."""
    trimesh.creation.capsule(height=140.0, radius=15.0).export(tmp_path / "shank.stl")
    return Path(shutil.copy(DOG, tmp_path))


@pytest.fixture
def dog(dog_file):
    return creature_from_urdf(dog_file, LIMBS, standing=STANDING)


def test_segments_are_the_moving_links(dog):
    """Fixed links are merged, massless ones folded, the world left out; limits are the file's."""
    assert [segment.name for segment in dog.segments[:3]] == ["trunk", "front_left_thigh", "front_left_shank"]
    assert len(dog.segments) == 9
    assert dog.nv == 6 + 12
    assert dog.mass == pytest.approx(6.0 + 0.8 + 4 * (0.9 + 0.35 + 0.05))
    assert dog.joint_names[:3] == ("front_left_roll", "front_left_pitch", "front_left_knee")
    knee = dog.hinges[2]
    assert (knee.lower, knee.upper, knee.torque_lower, knee.torque_upper, knee.velocity_limit) == (
        0.05, 2.4, -40.0, 40.0, 15.0,
    )  # fmt: skip
    shapes = dog.segment("front_left_shank").shapes
    assert [shape.kind for shape in shapes] == [ShapeKind.CAPSULE, ShapeKind.SPHERE]
    # A mesh of a capsule is a capsule of the same size, to its facets.
    np.testing.assert_allclose(shapes[0].size, [0.015, 0.14], atol=5e-4)


def test_standing_dog_stands(dog):
    q = dog.standing_posture()
    state = Configuration(dog, q)
    for name in NAMES:
        rotation, position = state.effector_placement(f"{name}_foot")
        assert position[2] == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(rotation[:, 2], [0.0, 0.0, 1.0], atol=1e-12)
    # Two links of 0.2 m, 0.6 rad to either side of the vertical, and 0.02 m below the foot along the shank.
    assert q[2] == pytest.approx((0.2 + 0.2 + 0.02) * np.cos(0.6), abs=1e-12)


def test_limbs_are_chains_and_know_their_reflections(dog):
    assert [limb.name for limb in dog.limbs] == NAMES
    assert dog.limbs[0].segments == ("front_left_thigh", "front_left_shank")
    assert [limb.mirror for limb in dog.limbs] == ["front_right", "front_left", "rear_right", "rear_left"]


@given(st.integers(0, 2**32 - 1))
def test_mechanics_are_those_of_another_reader(dog, dog_file, seed):
    """Mass matrix, centre of mass and feet against Pinocchio's own URDF reader, to 1e-9."""
    other = pin.buildModelFromUrdf(str(dog_file))
    assert other.nv == dog.nv
    q = random_configuration(dog, np.random.default_rng(seed))
    state, data = Configuration(dog, q), other.createData()
    p = pin.neutral(other)
    p[:7] = q[:7]
    order = [0, 1, 2, 3, 4, 5]
    for name in dog.joint_names:
        joint = other.joints[other.getJointId(name)]
        p[joint.idx_q] = q[7 + dog.joint_index(name)]
        order.append(joint.idx_v)
    pin.framesForwardKinematics(other, data, p)
    pin.centerOfMass(other, data, p, False)
    np.testing.assert_allclose(data.com[0], state.com, atol=1e-9)
    matrix = np.triu(pin.crba(other, data, p))
    matrix += np.triu(matrix, 1).T
    np.testing.assert_allclose(matrix[np.ix_(order, order)], state.mass_matrix, atol=1e-9)
    for name in NAMES:
        foot = data.oMf[other.getFrameId(f"{name}_foot")]
        wanted = foot.act(np.array([0.02, 0.0, 0.0]))
        np.testing.assert_allclose(state.effector_placement(f"{name}_foot")[1], wanted, atol=1e-9)


def test_limbs_may_begin_later_touch_with_soles_and_have_normals(dog_file):
    limbs = {"leg": LimbSpec("rear_left_foot", "rear_left_shank", "sole", normal=(-1.0, 0.0, 0.0))}
    dog = creature_from_urdf(dog_file, limbs, sole_length=0.05, sole_width=0.04)
    assert dog.limbs[0].segments == ("rear_left_shank",)
    assert str(dog.limbs[0].kind) == "sole"
    # Minus the shank's x axis, which points down in the zero posture.
    np.testing.assert_allclose(dog.effectors["rear_left_foot"].rotation[:, 2], [0.0, 0.0, 1.0], atol=1e-12)


def test_a_continuous_joint_turns_half_a_turn_either_way(dog_file):
    text = dog_file.read_text().replace(
        '<joint name="front_left_knee" type="revolute">', '<joint name="front_left_knee" type="continuous">'
    )
    dog_file.write_text(text)
    knee = creature_from_urdf(dog_file, LIMBS).hinges[2]
    assert (knee.lower, knee.upper) == (-np.pi, np.pi)


def test_parts_that_always_overlap_are_not_checked(dog_file):
    """A collar around the head that the thighs touch in the standing posture."""
    text = dog_file.read_text().replace('<sphere radius="0.06"/>', '<sphere radius="0.3"/>')
    dog_file.write_text(text)
    fat = creature_from_urdf(dog_file, LIMBS, standing=STANDING)
    assert frozenset(("trunk", "front_left_shank")) in fat.soft_pairs


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("<robot", "<model", "is no XML"),
        ("</robot>", "", "is no XML"),
        ('<robot name="dog">', '<robot name="dog"><link name="spare"/>', "without parent"),
        ('type="revolute"', 'type="prismatic"', "type is 'prismatic'; valid: revolute"),
        ('type="revolute"', 'type="floating"', "floats; valid: only below a massless root"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="neck"/>', "mimics"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "axis is"),
        ('lower="0.05" upper="2.4"', 'lower="3" upper="2.4"', "lower 3, upper 2.4"),
        ('effort="40"', 'effort="0"', "effort 0"),
        ('effort="40"', "", "effort is missing"),
        ('<mass value="6.0"/>', '<mass value="nan"/>', "mass value is 'nan'"),
        ('<mass value="6.0"/>', '<mass value="-6.0"/>', "mass is -6"),
        ('<mass value="6.0"/>', '<mass value="1e300"/>', r"mass is 1e\+300; valid: 0 to 10000 kg"),
        ('<mass value="6.0"/>', "", "no <mass>"),
        ('ixx="0.03"', 'ixx="1e300"', "at most 1e"),
        ('scale="0.001 0.001 0.001"', 'scale="0.001 0 0.001"', "scale is .*; valid: not zero"),
        ('<box size="0.42 0.16 0.12"/>', '<box size="0.42 0.16 1e5"/>', "at most 100 m"),
        ('<mass value="0.9"/>', '<mass value="0"/>', "moves and has no mass"),
        ('ixx="0.03"', 'ixx="9.0"', "principal moments"),
        ('<box size="0.42 0.16 0.12"/>', '<box size="0.42 0.16"/>', "3 finite numbers"),
        ('<box size="0.42 0.16 0.12"/>', '<box size="0.42 0.16 -1"/>', "> 0 and at most"),
        ('<box size="0.42 0.16 0.12"/>', "<cone/>", "valid: box, sphere"),
        ("shank.stl", "nowhere.stl", "not found"),
        ("shank.stl", "dog.urdf", "cannot be read"),
        ('<link name="head">', '<link name="trunk">', "occurs twice"),
        ('<child link="head"/>', '<child link="tail"/>', "'tail'; valid: one of"),
        (
            '<parent link="trunk"/><child link="head"/>',
            '<parent link="head"/><child link="head"/>',
            "hangs on itself",
        ),
    ],
)
def test_broken_descriptions_are_refused_in_one_line(dog_file, old, new, match):
    text = dog_file.read_text()
    assert old in text
    dog_file.write_text(text.replace(old, new, 1))
    with pytest.raises(BodyError, match=match) as error:
        creature_from_urdf(dog_file, LIMBS)
    assert "\n" not in str(error.value)
    assert "valid: " in str(error.value)


@pytest.mark.parametrize(
    ("limbs", "options", "match"),
    [
        ({"leg": {"tip": "paw"}}, {}, "tip is 'paw'; valid: one of"),
        ({"leg": {"tip": "front_left_hip_roll"}}, {}, "tip is"),
        ({"leg": {"tip": "front_left_foot", "root": "rear_left_thigh"}}, {}, "does not carry"),
        ({"leg": {"tip": "front_left_foot", "toe": 1}}, {}, "key 'toe'; valid: tip, root"),
        ({"leg": {"root": "front_left_thigh"}}, {}, "no tip"),
        ({"leg": {"tip": "front_left_foot", "contact": "claw"}}, {}, "contact is 'claw'; valid: sole, point"),
        ({"leg": {"tip": "front_left_foot", "contact": "sole"}}, {}, "sole_length and sole_width"),
        ({"leg": {"tip": "front_left_foot", "normal": (0, 0, 0)}}, {}, "normal is zero"),
        ({"leg": {"tip": "front_left_foot", "position": (0, 0)}}, {}, "position"),
        ({"leg": {"tip": "head"}}, {}, "has segment none"),
        ({"a": {"tip": "front_left_foot"}, "b": {"tip": "front_left_foot"}}, {}, "same tip"),
        (LIMBS, {"standing": {"tail": 0.1}}, "standing angle of 'tail'"),
        (LIMBS, {"standing": {"front_left_knee": 3.0}}, "valid: 0.05 to 2.4"),
    ],
)
def test_limbs_that_do_not_fit_are_refused(dog_file, limbs, options, match):
    with pytest.raises(BodyError, match=match):
        creature_from_urdf(dog_file, limbs, **options)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_a_device_and_a_vast_file_are_refused_at_once(tmp_path):
    """Reading the first would wait for ever, the others would take all memory."""
    os.mkfifo(tmp_path / "pipe.urdf")
    with (tmp_path / "vast.urdf").open("wb") as file:
        file.truncate(10**12)
    links = "".join(f'<link name="l{number}"/>' for number in range(2000))
    (tmp_path / "many.urdf").write_text(f'<robot name="snake">{links}</robot>')
    for path, said in (
        (tmp_path / "pipe.urdf", "no regular file"), ("/dev/zero", "no regular file"),
        (tmp_path / "vast.urdf", "at most 20000000"),
        (tmp_path / "many.urdf", "2000 links; valid: at most 200"),
    ):  # fmt: skip
        with pytest.raises(BodyError, match=said):
            read_urdf(path)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"<robot/>", b"<robot><link/></robot>"])
def test_what_is_no_description_is_refused(tmp_path, content):
    (tmp_path / "x.urdf").write_bytes(content)
    with pytest.raises(BodyError, match=r"x\.urdf"):
        read_urdf(tmp_path / "x.urdf")
    with pytest.raises(BodyError, match="none"):
        read_urdf(tmp_path / "none.urdf")


@given(st.integers(0, 10**6), st.binary(max_size=3))
def test_a_damaged_description_is_read_or_refused(dog_file, place, junk):
    whole = dog_file.read_bytes()
    at = place % len(whole)
    dog_file.write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
    message = ""
    try:
        creature_from_urdf(dog_file, LIMBS)
    except BodyError as error:
        message = str(error)
    assert "\n" not in message
    dog_file.write_bytes(whole)
