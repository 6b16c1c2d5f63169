"""Volumes of joint angles: signed distances, hollows, and the limits of limbs."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from manikin.body import (
    JointVolume,
    NaturalRange,
    human,
    human_volumes,
    insect,
    limb_named,
    volume_of,
    with_knees_and_elbows,
)
from manikin.body.natural_range import FILE, ball_range, load_volumes
from manikin.errors import BodyError
from manikin.kinematics import LimbKinematics

SCRIPT = Path(__file__).parents[2] / "docs/ranges_of_motion.py"
STEP = np.deg2rad(4.0)
ANGLES = arrays(float, 3, elements=st.floats(-3.5, 3.5))


def ball(rng, radius, count=60_000):
    """Points spread evenly in a ball."""
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return radius * direction * rng.random((count, 1)) ** (1.0 / 3.0)


@pytest.fixture(scope="module")
def round_volume():
    return volume_of(ball(np.random.default_rng(0), 0.8), closing=0.3, margin=0.1, step=STEP, fewest=1)


@pytest.fixture(scope="module")
def bent_volume():
    """Two thirds of a ring of radius 1: a gap that closing does not fill and a hole in the middle."""
    turn = np.linspace(0.0, 4.0, 4000)
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(4000)])
    return volume_of(ring, closing=0.4, margin=0.2, step=STEP, fewest=1)


def test_distance_to_a_ball_is_known(round_volume):
    """Radius plus margin minus the distance to the centre, to the grid's step."""
    points = ball(np.random.default_rng(1), 1.3, 500)
    wanted = 0.9 - np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(round_volume.distance(points), wanted, atol=STEP)


def test_hollows_stay_and_gaps_are_filled(bent_volume):
    first, last = np.array([1.0, 0.0, 0.0]), np.array([np.cos(4.0), np.sin(4.0), 0.0])
    assert bent_volume.distance([first, last]).min() >= 0.0
    assert bent_volume.distance(0.5 * (first + last)) < 0.0
    assert bent_volume.distance([0.0, 0.0, 0.0]) < 0.0
    # Every other eighth of the ring left out is a gap narrower than twice the closing.
    turn = np.linspace(0.0, 4.0, 4000)
    kept = np.sin(8.0 * turn) > 0.0
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(4000)])
    filled = volume_of(ring[kept], closing=0.4, margin=0.2, step=STEP, fewest=1)
    inside = (turn > turn[kept][0]) & (turn < turn[kept][-1])
    assert filled.distance(ring[inside]).min() >= 0.0


@given(ANGLES, ANGLES)
def test_distance_changes_no_faster_than_angles(bent_volume, first, second):
    """At most by the square root of 3 times the way, which linear interpolation allows at worst."""
    change = abs(float(bent_volume.distance(first) - bent_volume.distance(second)))
    assert change <= np.sqrt(3.0) * np.linalg.norm(first - second) + 1e-12


@given(arrays(float, 3, elements=st.floats(-1.0, 1.0)))
def test_gradient_is_the_derivative(round_volume, place):
    """Inside one cell, by central differences; the interpolant is cubic there."""
    cell = np.floor((place - round_volume.origin) / round_volume.step)
    middle = round_volume.origin + (cell + 0.37) * round_volume.step
    step = 1e-5
    difference = [
        (round_volume.distance(middle + e) - round_volume.distance(middle - e)) / (2 * step)
        for e in step * np.eye(3)
    ]
    np.testing.assert_allclose(round_volume.gradient(middle), difference, atol=1e-8)


@given(arrays(float, 3, elements=st.floats(-4.0, 4.0)))
def test_gradient_is_the_derivative_off_the_grid_too(round_volume, place):
    """Along one axis, two or three beyond the grid; away from the planes between cells."""
    shape = np.array(round_volume.distances.shape)
    cell = np.floor((place - round_volume.origin) / round_volume.step)
    middle = round_volume.origin + (cell + 0.37) * round_volume.step
    outside = (cell < 0) | (cell > shape - 2)
    step = 1e-5
    difference = [
        (round_volume.distance(middle + e) - round_volume.distance(middle - e)) / (2 * step)
        for e in step * np.eye(3)
    ]
    np.testing.assert_allclose(round_volume.gradient(middle), difference, atol=1e-6)
    if outside.all():
        assert np.linalg.norm(round_volume.gradient(middle)) == pytest.approx(1.0)


def test_a_file_of_volumes_comes_back(round_volume, tmp_path):
    """Distances to half of 1e-4 rad."""
    spec = importlib.util.spec_from_file_location("ranges_of_motion", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.save_volumes(tmp_path / "v.npz", {"thigh": round_volume}, "nobody")
    again = load_volumes(tmp_path / "v.npz")["thigh"]
    np.testing.assert_allclose(again.distances, round_volume.distances, atol=0.51e-4)
    np.testing.assert_array_equal(again.origin, round_volume.origin)
    assert again.step == round_volume.step
    (tmp_path / "v.npz").write_bytes(b"PK broken")
    for name in ("v.npz", "none.npz"):
        with pytest.raises(BodyError, match="valid: a file of joint volumes"):
            load_volumes(tmp_path / name)


def test_misuse_is_refused(round_volume):
    with pytest.raises(BodyError, match="no recorded angles"):
        volume_of(np.zeros((0, 3)))
    with pytest.raises(BodyError, match="closing"):
        volume_of(np.zeros((9, 3)), closing=0.1, margin=0.2)
    with pytest.raises(BodyError, match="seen in 5 frames"):
        volume_of(np.zeros((4, 3)), fewest=5)
    with pytest.raises(BodyError, match="cells"):
        volume_of(np.array([[0.0, 0.0, 0.0], [100.0, 100.0, 100.0]]))
    with pytest.raises(BodyError, match="overlap"):
        ball_range(round_volume, [2.0, 0.0, 0.0], [3.0, 1.0, 1.0])
    with pytest.raises(BodyError, match="holds nothing"):
        JointVolume(np.zeros(3), 0.1, -np.ones((3, 3, 3)))
    with pytest.raises(BodyError, match=r"valid: \(\.\.\., 3\)"):
        round_volume.distance(np.zeros(2))


# --- the human -----------------------------------------------------------------------------------


def ball_ranges():
    body, found = human(), {}
    for part, volume in human_volumes().items():
        hinges = body.segment(f"left_{part}").hinges
        found[part] = ball_range(volume, [h.lower for h in hinges], [h.upper for h in hinges])
    return found


def test_shipped_volumes_name_their_sources():
    with np.load(FILE) as archive:
        text = str(archive["acknowledgement"])
    assert "mocap.cs.cmu.edu" in text
    assert "NSF EIA-0196217" in text
    assert "ACCAD / The Ohio State University, Open Motion Project, CC BY 3.0" in text
    assert FILE.stat().st_size < 300_000


@pytest.mark.parametrize(
    ("part", "postures"),
    [
        # Flexion, abduction, rotation inward [deg].
        ("thigh", [(0, 0, 0), (90, 10, 0), (110, 20, 0), (-15, 0, 0), (20, -10, 0), (40, 30, -20)]),
        ("upper_arm", [(0, 8, 0), (40, 0, 0), (90, -30, 0), (130, 0, 0), (-30, 20, 0), (60, 40, 0)]),
    ],
)
def test_everyday_postures_are_inside(part, postures):
    """Standing, sitting, squatting, striding; hanging arms, arms forward, raised, back and aside."""
    assert np.all(ball_ranges()[part].normalised(np.deg2rad(postures)) > 0.05)


@pytest.mark.parametrize(
    ("part", "postures"),
    [
        ("thigh", [(130, 45, -45), (120, -30, -45), (100, -25, 45), (-25, -30, 45)]),
        ("upper_arm", [(180, -75, 80), (-60, -75, -90), (180, 80, 80), (-60, 80, -90)]),
    ],
)
def test_absurd_postures_within_the_intervals_are_outside(part, postures):
    """Corners of the box of joint limits: each angle is possible, all three at once are not."""
    ball, angles = ball_ranges()[part], np.deg2rad(postures)
    assert np.all((angles >= ball.lower - 1e-9) & (angles <= ball.upper + 1e-9))
    assert np.all(ball.normalised(angles) < -0.2)


def test_the_shoulders_volume_is_not_convex():
    """An arm turned out behind, and one raised across the body: both possible, half way between is not."""
    shoulder = ball_ranges()["upper_arm"]
    behind, across = np.deg2rad([(-17, 12, -83), (133, -32, -23)])
    values = shoulder.normalised(np.array([behind, across, 0.5 * (behind + across)]))
    assert values[0] > 0.1
    assert values[1] > 0.1
    assert values[2] < -0.3


@pytest.mark.parametrize("part", ["thigh", "upper_arm"])
def test_the_deepest_posture_has_distance_one(part):
    ball = ball_ranges()[part]
    assert ball.normalised(ball.volume.points).max() == pytest.approx(1.0, abs=1e-12)


def test_range_of_a_limb_is_that_of_its_worst_joint():
    body = with_knees_and_elbows(human())
    arm = NaturalRange(body, limb_named(body, "right_arm"))
    assert arm.learnt
    middle = 0.5 * (arm.lower + arm.upper)
    middle[:3] = np.deg2rad([30.0, 10.0, 0.0])
    alone = arm.volume_distance(middle[None])[0]
    assert arm.normalised(middle[None])[0] == pytest.approx(alone)
    elbow = middle.copy()
    elbow[3] = arm.upper[3] - 0.05 * (arm.upper[3] - arm.lower[3])
    assert arm.normalised(elbow[None])[0] == pytest.approx(0.1)
    elbow[3] = arm.upper[3] + 0.05 * (arm.upper[3] - arm.lower[3])
    assert arm.normalised(elbow[None])[0] < 0.0
    assert arm.volume_distance(elbow[None])[0] == pytest.approx(alone)
    with pytest.raises(BodyError, match=r"valid: \(n, 7\)"):
        arm.normalised(np.zeros(7))


def test_mirrored_limbs_have_the_same_range():
    body, rng = human(), np.random.default_rng(2)
    left, right = (NaturalRange(body, limb_named(body, f"{side}_leg")) for side in ("left", "right"))
    angles = rng.uniform(left.lower, left.upper, (50, len(left.lower)))
    np.testing.assert_array_equal(left.normalised(angles), right.normalised(angles))


def test_other_creatures_have_the_intervals_of_their_hinges():
    body = insect()
    limb = limb_named(body, "left_front_leg")
    leg, chain = NaturalRange(body, limb), LimbKinematics(body, limb)
    assert not leg.learnt
    q = chain.random_angles(np.random.default_rng(0), 100)
    assert leg.normalised(q).min() >= 0.0
    assert np.all(np.isinf(leg.volume_distance(q)))
    middle = 0.5 * (chain.lower + chain.upper)
    assert leg.normalised(middle[None])[0] == pytest.approx(1.0)


def test_random_angles_are_within_the_range():
    body = human()
    arm = NaturalRange(body, limb_named(body, "left_arm"))
    q = arm.random_angles(np.random.default_rng(0), 2000)
    assert q.shape == (2000, 7)
    assert arm.normalised(q).min() >= 0.0
