import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.contact import grasp, point, sole
from manikin.errors import ContactError, SceneError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import Box, Capsule, Obstacle, Scene, Sphere

PLATFORM = Obstacle("platform", Box((1.0, 1.0, 0.2)), translation=(0.6, 0.0, 0.1))
FOOT = {"length": 0.28, "width": 0.12, "friction": 0.7}


def test_names_must_be_unique_and_the_floor_is_taken():
    with pytest.raises(SceneError, match="'platform' twice"):
        Scene([PLATFORM, PLATFORM])
    with pytest.raises(SceneError, match="scene's own floor"):
        Scene([Obstacle("floor", Sphere(1.0))])
    assert Scene([Obstacle("floor", Sphere(1.0))], floor_height=None).names == ("floor",)
    with pytest.raises(SceneError, match="Obstacle values"):
        Scene(["box"])
    with pytest.raises(SceneError, match="floor_height"):
        Scene([], floor_height=np.nan)


def test_obstacles_are_found_by_name():
    scene = Scene([PLATFORM])
    assert scene.names == ("floor", "platform")
    assert scene["platform"] is PLATFORM
    assert "floor" in scene
    assert len(scene) == len(list(scene)) == 2
    with pytest.raises(KeyError, match="platform"):
        scene["roof"]


def test_a_foot_is_held_by_the_surface_under_it():
    scene = Scene([PLATFORM])
    assert scene.supporting_surface(sole("left_foot", (0.5, 0.0, 0.2), **FOOT)).obstacles == ("platform",)
    assert scene.supporting_surface(sole("left_foot", (-0.5, 0.0, 0.0), **FOOT)).obstacles == ("floor",)
    assert scene.supporting_surface(sole("left_foot", (0.5, 0.0, 0.204), **FOOT)).obstacles == ("platform",)


@pytest.mark.parametrize(
    ("position", "said"),
    [
        ((0.5, 0.0, 0.3), "'platform', has a contact point 100.0 mm above"),
        ((0.5, 0.0, 0.19), "'platform', has a contact point 10.0 mm below"),
        ((0.1, 0.0, 0.2), "140.0 mm beyond its edge"),
        ((-2.0, 0.0, -0.2), "'floor', has a contact point 200.0 mm below"),
    ],
)
def test_a_contact_off_any_surface_is_told_how_far_the_nearest_is(position, said):
    with pytest.raises(ContactError) as caught:
        Scene([PLATFORM]).supporting_surface(sole("left_foot", position, **FOOT))
    message = str(caught.value)
    assert said in message
    assert "left_foot" in message
    assert "valid: every contact point within 5 mm" in message
    assert "\n" not in message


def test_normals_must_agree():
    scene = Scene([PLATFORM])
    tilted = (np.sin(np.deg2rad(3.0)), 0.0, np.cos(np.deg2rad(3.0)))
    contact = point("left_hand", (0.5, 0.0, 0.2), friction=0.5, normal=tilted)
    with pytest.raises(ContactError, match="none faces its normal"):
        scene.supporting_surface(contact)
    side = point("left_hand", (1.1, 0.0, 0.1), friction=0.5, normal=(1.0, 0.0, 0.0))
    assert scene.supporting_surface(side).obstacles == ("platform",)


@given(
    st.floats(-0.6, 0.6),
    st.floats(-0.6, 0.6),
    st.floats(-3.0, 3.0),
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
)
def test_support_is_found_on_a_box_of_any_orientation(roll, pitch, yaw, x, y):
    rotation = rotation_from_rpy(roll, pitch, yaw)
    ramp = Obstacle("ramp", Box((1.0, 1.0, 0.1)), rotation, (0.0, 0.0, 1.0))
    position = ramp.to_world([x, y, 0.05])
    contact = sole("left_foot", position, rotation=rotation, **FOOT)
    assert Scene([ramp]).supporting_surface(contact).obstacles == ("ramp",)


def test_grasps_need_a_surface_near_their_point_and_round_bars_are_found_by_distance():
    bar = Obstacle("bar", Capsule(0.02, 1.0), translation=(0.0, 0.0, 1.0))
    scene = Scene([PLATFORM, bar])
    hand = grasp("right_hand", (0.02, 0.0, 1.2), max_force=100.0)
    assert scene.nearest(hand.position)[0] == "bar"
    assert scene.nearest((0.12, 0.0, 1.2))[1] == pytest.approx(0.1)
    assert scene.touched_obstacles(hand) == ("bar",)
    assert scene.touched_obstacles(sole("left_foot", (0.5, 0.0, 0.2), **FOOT)) == ("platform",)
    with pytest.raises(ContactError):
        scene.touched_obstacles(sole("left_foot", (0.5, 0.0, 0.5), **FOOT))
    with pytest.raises(SceneError, match="empty"):
        Scene([], None).nearest((0, 0, 0))
