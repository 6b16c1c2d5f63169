"""Where hands are seen, and how far they reach."""

import numpy as np
import pytest
import trimesh

from manikin.body import Configuration, human
from manikin.body.segments import SIDES
from manikin.ergonomics import reach_envelopes, reach_use, sight_of, sight_zone
from manikin.ergonomics.sight import eyes_of
from manikin.errors import BodyError, InputError
from manikin.reports.export import write_reach

from .conftest import posture

AHEAD = np.array([[1.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def reach(body):
    return reach_envelopes(body)


def arm_of(body):
    """Length from the shoulder to the palm of a straight arm [m]."""
    state = Configuration(body, body.standing_posture())
    shoulder = state.segment_placement("left_upper_arm")[1]
    elbow = state.segment_placement("left_forearm")[1]
    wrist = state.segment_placement("left_hand")[1]
    palm = state.effector_placement("left_hand")[1]
    return sum(float(np.linalg.norm(b - a)) for a, b in ((shoulder, elbow), (elbow, wrist), (wrist, palm)))


def test_a_straight_arm_ahead_reaches_its_length(body, reach):
    """Up to the width of the bins, 8 degrees, in which the drawn postures are counted: 2 %."""
    for side in SIDES:
        farthest = float(reach[side].farthest(AHEAD)[0])
        assert farthest == pytest.approx(arm_of(body), rel=0.02)
        assert reach[side].radius.max() <= arm_of(body) + 1e-9


def test_both_arms_reach_alike(reach):
    """The mirror image, but for the draw of the bins: 3 % of the volume."""
    left, right = reach["left"], reach["right"]
    np.testing.assert_allclose(left.origin, right.origin * [1.0, -1.0, 1.0], atol=1e-12)
    assert left.volume == pytest.approx(right.volume, rel=0.03)


def test_reach_grows_with_the_cube_of_the_stature(reach):
    """Of two bodies of the same proportions, to rounding: the same angles are drawn."""
    small = reach_envelopes(human(1.40, 79.0))
    for name, envelope in reach.items():
        if name != "both":  # tested at distances that are the same for all bodies
            assert small[name].volume == pytest.approx(envelope.volume * (1.40 / 1.75) ** 3, rel=1e-6)


def test_what_both_hands_reach_each_of_them_reaches(reach):
    both = reach["both"]
    assert 0.0 < both.volume < min(reach[side].volume for side in SIDES)
    corners = np.array(both.mesh.vertices)[both.radius > 0.0]
    for side in SIDES:
        assert reach[side].share(corners).max() <= 1.0 + 1e-9


def test_arms_that_are_stretched_use_their_whole_reach(body):
    hanging, bent = posture(body), posture(body, left_elbow_flexion=120.0, right_elbow_flexion=120.0)
    shares = reach_use(body, np.array([hanging, bent])).shares
    for side in SIDES:
        assert shares[side][0] == pytest.approx(1.0, abs=0.03)
        assert shares[side][1] < 0.7


@pytest.mark.parametrize(
    ("aside", "above", "zone"),
    [(0, 0, 0), (15, -15, 0), (16, 0, 1), (35, 40, 1), (-35, -20, 1), (36, 0, 2), (0, 41, 2), (0, -21, 2)],
)
def test_zones_are_those_of_the_visual_field(aside, above, zone):
    """Best within 15 degrees; eyes turn 35 to the sides, 40 up and 20 down (MIL-STD-1472)."""
    angles = np.deg2rad([[aside], [above]])
    assert sight_zone(angles[0] * (1 - 1e-12), angles[1] * (1 - 1e-12))[0] == zone


def test_eyes_are_as_high_as_peoples(body):
    """0.936 of the stature (Drillis and Contini 1966), to half a percent of it."""
    head, eyes = eyes_of(body)
    rotation, position = Configuration(body, body.standing_posture()).segment_placement(head.name)
    height = float((position + rotation @ eyes)[2])
    feet = Configuration(body, body.standing_posture()).effector_placement("left_foot")[1][2]
    assert (height - feet) / body.stature == pytest.approx(0.936, abs=0.005)


def test_directions_are_those_from_the_eyes_against_the_normal_line_of_sight(body):
    """Of an upright head that looks along x they are angles in the world; hanging hands are not in sight."""
    arms = {f"{side}_shoulder_flexion": 70.0 for side in SIDES} | {"left_elbow_flexion": 40.0}
    postures = np.array([posture(body), posture(body, **arms)])
    sight, (head, eyes) = sight_of(body, postures), eyes_of(body)
    for row, q in enumerate(postures):
        state = Configuration(body, q)
        rotation, position = state.segment_placement(head.name)
        for side in SIDES:
            x, y, z = state.effector_placement(f"{side}_hand")[1] - position - rotation @ eyes
            assert sight.aside[side][row] == pytest.approx(np.arctan2(y, x), abs=1e-9)
            below = np.arctan2(z, np.hypot(x, y)) + np.deg2rad(15.0)
            assert sight.above[side][row] == pytest.approx(below, abs=1e-9)
            assert sight.zones[side][0] == 2


def test_a_body_without_a_skull_has_no_eyes():
    from manikin.body import insect

    with pytest.raises(BodyError):
        eyes_of(insect())


def test_the_reach_is_a_closed_mesh_in_the_world(body, tmp_path):
    q = np.array(body.standing_posture())
    q[:2] = 3.0, -2.0
    mesh = trimesh.load(write_reach(tmp_path / "reach.stl", body, q))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(reach_envelopes(body)["both"].volume, rel=1e-4)
    np.testing.assert_allclose(mesh.center_mass[1], -2.0, atol=0.02)
    assert mesh.center_mass[0] > 3.0  # the hands reach farther ahead than back
    with pytest.raises(InputError, match=r"ends in \.stl"):
        write_reach(tmp_path / "reach.txt", body, q)
