"""BVH files, read back by a reader of our own and compared with Pinocchio."""

import warnings
from io import BytesIO

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from manikin.body import BodyModel, Configuration, Hinge, Segment, human, quadruped, random_configuration
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.recordings.readers import read_recording
from manikin.recordings.readers.marker_sets import JOINTS, joint_of
from manikin.reports.formats.bvh import (
    AXES,
    CENTIMETRES,
    NAMES,
    joint_names,
    rest_rotations,
    scene_obj,
    to_bvh,
)
from manikin.scene import Box, Obstacle, Scene


def make_motion(body, q, time=None):
    n = len(q)
    zero = np.zeros((n, body.nv))
    return Motion(
        time=np.arange(n) * 0.01 if time is None else time, q=q, v=zero, a=zero, tau=zero,
        com=np.zeros((n, 3)), angular_momentum=np.zeros((n, 3)), margin=np.zeros(n),
        support=np.ones((n, 1), dtype=bool), contact_force=np.zeros((n, 1, 6)),
        contact_names=("left_foot",), joint_names=body.joint_names,
    )  # fmt: skip


def read_bvh(text):
    """Joints (name, parent, offset, channels) in file order, and the frames."""
    lines = [line.split() for line in text.splitlines()]
    joints, stack, number = [], [], 0
    while lines[number] != ["MOTION"]:
        words = lines[number]
        if words[0] in ("ROOT", "JOINT"):
            joints.append({"name": words[1], "parent": stack[-1] if stack else None})
        elif words[0] == "End":
            joints.append({"name": None, "parent": stack[-1]})
        elif words[0] == "{":
            stack.append(len(joints) - 1)
        elif words[0] == "}":
            stack.pop()
        elif words[0] == "OFFSET":
            joints[-1]["offset"] = np.array(words[1:], dtype=float)
        elif words[0] == "CHANNELS":
            assert int(words[1]) == len(words) - 2
            joints[-1]["channels"] = words[2:]
        number += 1
    count, step = int(lines[number + 1][1]), float(lines[number + 2][2])
    frames = np.array([[float(word) for word in line] for line in lines[number + 3 :]])
    assert len(frames) == count
    return joints, frames, step


def forward_kinematics(joints, frame):
    """Position and rotation of every named joint by the BVH rules."""
    placements, column = [], 0
    for joint in joints:
        position, rotation = joint["offset"].copy(), np.eye(3)
        for channel in joint.get("channels", []):
            value, axis = frame[column], "XYZ".index(channel[0])
            column += 1
            if channel.endswith("position"):
                position[axis] += value
            else:
                c, s = np.cos(np.radians(value)), np.sin(np.radians(value))
                turn, a, b = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
                turn[a, a], turn[b, b], turn[a, b], turn[b, a] = c, c, -s, s
                rotation = rotation @ turn
        if joint["parent"] is not None:
            parent_position, parent_rotation = placements[joint["parent"]]
            position = parent_position + parent_rotation @ position
            rotation = parent_rotation @ rotation
        placements.append((position, rotation))
    assert column == len(frame)
    return {j["name"]: p for j, p in zip(joints, placements, strict=True) if j["name"]}


def assert_same_placements(body, q, **options):
    axes, own = AXES[options.get("up", "y")], joint_names(body, options.get("names", "manikin"))
    joints, frames, _ = read_bvh(to_bvh(body, make_motion(body, q), **options))
    assert len({tuple(joint["channels"][-3:]) for joint in joints if joint["name"]}) == 1
    data, rest = body.pinocchio.createData(), rest_rotations(body)
    for configuration, frame in zip(q, frames, strict=True):
        found = forward_kinematics(joints, frame)
        pin.framesForwardKinematics(body.pinocchio, data, configuration)
        assert set(found) == set(own.values())
        for segment, name in own.items():
            position, rotation = found[name]
            placement = data.oMf[body.segment_frame(segment)]
            # 7 decimals: 1e-9 m of rounding per offset and 1e-9 rad per angle over 2 m of chain.
            np.testing.assert_allclose(axes.T @ position / CENTIMETRES, placement.translation, atol=1e-7)
            turned = axes.T @ rotation @ axes @ rest[segment]
            np.testing.assert_allclose(turned, placement.rotation, atol=1e-7)


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("names", NAMES)
def test_written_file_puts_every_segment_where_pinocchio_does(names, up):
    body = human()
    rng = np.random.default_rng(0)
    q = np.array([random_configuration(body, rng) for _ in range(6)])
    assert_same_placements(body, q, names=names, up=up)


def test_rest_is_a_person_with_the_arms_aside():
    """All channels zero: hands at the height of the shoulders, feet below the hips, toes forward."""
    body = human()
    joints, frames, _ = read_bvh(to_bvh(body, make_motion(body, body.standing_posture()[None])))
    place = {name: at[0] for name, at in forward_kinematics(joints, np.zeros(frames.shape[1])).items()}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shoulder, elbow, hand = (place[f"{side}_{part}"] for part in ("upper_arm", "forearm", "hand"))
        np.testing.assert_allclose(hand[1:], shoulder[1:], atol=1e-6)
        assert sign * hand[0] > sign * elbow[0] > sign * shoulder[0] > 0.0
        assert place[f"{side}_foot"][1] < place[f"{side}_thigh"][1] - 50.0
        assert place[f"{side}_toes"][2] > place[f"{side}_foot"][2]


def test_own_reader_finds_the_joints_again(tmp_path):
    """By the names of CMU, within 0.1 mm."""
    body = human()
    rng = np.random.default_rng(4)
    motion = make_motion(body, np.array([random_configuration(body, rng) for _ in range(3)]))
    file = tmp_path / "motion.bvh"
    file.write_text(to_bvh(body, motion, "cmu"))
    recording = read_recording(file)
    for segment in JOINTS:
        found = recording.positions[:, joint_of(recording, segment)]
        wanted = [Configuration(body, q).segment_placement(segment)[1] for q in motion.q]
        np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_angles_are_continuous_where_a_hip_passes_the_right_angle():
    body = human()
    q = np.tile(body.standing_posture(), (60, 1))
    q[:, 7 + body.joint_index("left_hip_flexion")] = np.linspace(0.2, 2.0, 60)
    q[:, 7 + body.joint_index("left_hip_rotation")] = 0.3
    q[:, 7 + body.joint_index("left_hip_abduction")] = 0.2
    _, frames, _ = read_bvh(to_bvh(body, make_motion(body, q)))
    # 1.8 rad in 59 steps are 1.75 degrees each; near the singularity two angles turn faster together.
    assert np.abs(np.diff(frames, axis=0)).max() < 30.0


def test_scene_beside_has_the_axes_and_the_unit_of_the_motion():
    box = Obstacle("low wall", Box([0.2, 1.0, 0.4]), translation=[2.0, 0.5, 0.2])
    mesh = trimesh.load(BytesIO(scene_obj(Scene((box,))).encode()), file_type="obj", force="mesh")
    np.testing.assert_allclose(mesh.bounds, [[0.0, 0.0, 190.0], [100.0, 40.0, 210.0]], atol=1e-6)


def test_names_of_people_are_for_people():
    body = quadruped()
    q = body.standing_posture()[None]
    with pytest.raises(InputError, match="have none for"):
        to_bvh(body, make_motion(body, q), "vrm")
    with pytest.raises(InputError, match="valid: manikin, cmu, mixamo, vrm"):
        joint_names(human(), "maya")
    with pytest.raises(InputError, match="valid: y, z"):
        to_bvh(body, make_motion(body, q), up="x")


def test_pelvis_looking_straight_down_is_no_special_case():
    body = human()
    q = np.tile(body.standing_posture(), (3, 1))
    q[1, 3:7] = [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]
    q[2, 3:7] = [0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_same_placements(body, q)


def test_oblique_and_repeated_hinges_are_written_as_euler_angles():
    oblique = [np.array([1.0, 2.0, 0.5]), np.array([0.0, 0.0, -1.0]), np.array([0.3, -1.0, 0.2])]
    hinges = tuple(Hinge(f"h{i}", axis, -1.0, 1.0, 5.0, -50.0, 50.0) for i, axis in enumerate(oblique))
    inertia = np.eye(3) * 0.1
    root = Segment("root", None, np.zeros(3), (), 5.0, np.zeros(3), inertia)
    arm = Segment("arm", "root", np.array([0.1, 0.2, 0.3]), hinges, 1.0, np.array([0.0, 0.0, 0.2]), inertia)
    stick = Segment("stick", "arm", np.array([0.0, 0.0, 0.4]), (), 1.0, np.array([0.0, 0.1, 0.0]), inertia)
    body = BodyModel("stick", (root, arm, stick), {})
    rng = np.random.default_rng(1)
    assert_same_placements(body, np.array([random_configuration(body, rng) for _ in range(10)]))


def test_standing_person_faces_z_with_the_left_hand_towards_x():
    body = human()
    joints, frames, step = read_bvh(to_bvh(body, make_motion(body, body.standing_posture()[None])))
    found = forward_kinematics(joints, frames[0])
    assert found["head"][0][1] > 140.0  # centimetres, y up
    assert found["left_hand"][0][0] > 10.0 > -10.0 > found["right_hand"][0][0]
    assert found["left_toes"][0][2] > found["left_foot"][0][2]
    assert step == 0.01


def test_angles_do_not_jump_when_the_pelvis_turns_round_and_round():
    body = human()
    yaw = np.linspace(0.0, 12.0, 200)
    q = np.tile(body.standing_posture(), (200, 1))
    q[:, 5], q[:, 6] = np.sin(yaw / 2), np.cos(yaw / 2)
    _, frames, _ = read_bvh(to_bvh(body, make_motion(body, q)))
    assert np.abs(np.diff(frames[:, 3:6], axis=0)).max() < 10.0


def test_uneven_samples_and_foreign_motions_are_refused():
    body = human()
    q = np.tile(body.standing_posture(), (3, 1))
    with pytest.raises(MotionFileError, match="resample"):
        to_bvh(body, make_motion(body, q, time=np.array([0.0, 0.01, 0.03])))
    motion = make_motion(body, q)
    other = Motion(
        **motion.arrays(), contact_names=("left_foot",), joint_names=tuple("x" * k for k in range(1, 40))
    )
    with pytest.raises(MotionFileError, match="other joints"):
        to_bvh(body, other)
