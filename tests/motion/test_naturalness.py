"""Naturalness: directions of the body's parts, and how near postures are to those of recorded people."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human, quadruped, random_configuration
from manikin.motion.naturalness import (
    PARTS,
    measure_naturalness,
    mirrored,
    naturalness_of,
    part_directions,
    recorded_postures,
)
from manikin.recordings import read_recording, reconstruct

BODY = human(1.75, 75.0, "male")


def postures(rng, count=20):
    return np.array([random_configuration(BODY, rng) for _ in range(count)])


def angles(q, **given):
    """A posture with other joint angles [deg]."""
    q = np.array(q)
    for name, angle in given.items():
        q[7 + BODY.joint_index(name)] = np.deg2rad(angle)
    return q


def test_directions_depend_neither_on_the_place_nor_on_the_heading():
    rng = np.random.default_rng(0)
    q = postures(rng)
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, 2.0))
    moved = q.copy()
    for row in moved:
        row[:3] = turn.matrix() @ row[:3] + [3.0, -2.0, 1.0]
        row[3:7] = (turn * pin.Quaternion(row[6], *row[3:6])).coeffs()
    np.testing.assert_allclose(part_directions(BODY, moved), part_directions(BODY, q), atol=1e-9)


def test_directions_of_standing_are_up_to_the_left_and_down():
    """Arms hang, 14 degrees away from the trunk; joints of a leg lie some degrees before each other."""
    found = dict(zip(PARTS, part_directions(BODY, BODY.standing_posture()[None])[0], strict=True))
    np.testing.assert_allclose(found["trunk"], [0.0, 0.0, 1.0], atol=0.1)
    for name in ("shoulders", "hips"):
        np.testing.assert_allclose(found[name], [0.0, 1.0, 0.0], atol=1e-9)
    for side in ("left", "right"):
        for name in ("thigh", "leg", "upper_arm"):
            np.testing.assert_allclose(found[f"{side}_{name}"], [0.0, 0.0, -1.0], atol=0.25)


def test_a_mirrored_posture_has_mirrored_directions():
    one = angles(
        BODY.standing_posture(), left_elbow_flexion=70.0, right_hip_flexion=40.0, right_knee_flexion=60.0
    )
    other = angles(
        BODY.standing_posture(), right_elbow_flexion=70.0, left_hip_flexion=40.0, left_knee_flexion=60.0
    )
    first, second = (part_directions(BODY, q[None]).reshape(1, -1) for q in (one, other))
    np.testing.assert_allclose(mirrored(first), second, atol=1e-9)
    rows = np.random.default_rng(1).normal(size=(5, 3 * len(PARTS)))
    np.testing.assert_array_equal(mirrored(mirrored(rows)), rows)


def test_a_distance_is_the_root_mean_square_of_the_parts():
    """As an exhaustive search over all recorded postures finds it, of standing, which is natural."""
    known, limit = recorded_postures()
    assert known.data.shape[1] == 3 * len(PARTS)
    assert 0.2 < limit < 0.6
    standing = BODY.standing_posture()
    found = naturalness_of(BODY, np.zeros(1), standing[None])
    directions = part_directions(BODY, standing[None]).reshape(-1)
    away = np.linalg.norm(known.data - directions, axis=1).min() / np.sqrt(len(PARTS))
    assert found.worst == pytest.approx(away)
    assert found.share == 1.0


def test_nobody_stands_on_one_leg_with_the_other_and_both_arms_out():
    q = angles(
        BODY.standing_posture(), left_hip_abduction=45.0, left_shoulder_abduction=80.0,
        right_hip_flexion=-25.0, right_shoulder_flexion=180.0, right_knee_flexion=120.0,
        left_elbow_flexion=140.0,
    )  # fmt: skip
    found = naturalness_of(BODY, np.array([2.0]), q[None])
    assert found.share == 0.0
    assert (found.worst_at, found.worst > found.limit) == (2.0, True)


def test_other_bodies_have_none():
    assert measure_naturalness(quadruped(), SimpleNamespace()) is None


@pytest.mark.parametrize(
    ("file", "least"),
    [("grf/btkdata/Gait.c3d", 0.95), ("grf/nimble_opencap_s4/STS1.trc", 0.95), ("grf/opensim_core", 0.95)],
)
def test_people_of_other_laboratories_are_natural(recordings_folder, file, least):
    """Of none of them is a posture in the file: the share that its limit is made for."""
    path = recordings_folder / file
    path = sorted(path.glob("*.c3d"))[0] if path.is_dir() else path
    found = reconstruct(read_recording(path))
    step = max(1, round(found.rate / 50.0))
    natural = naturalness_of(found.body, found.time[::step], found.q[::step])
    assert natural.share >= least
    assert natural.median < 0.3
