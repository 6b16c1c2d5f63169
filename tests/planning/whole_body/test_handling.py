"""Courses of hands and of what they hold."""

import numpy as np
import pytest

from manikin.body import human
from manikin.planning.whole_body.handling import (
    ASIDE,
    CourseKind,
    HandCourse,
    Handling,
    HeldObject,
    held_arms,
    minimum_jerk,
)

BOX = HeldObject("box", np.array([0.25, 0.32, 0.22]), 5.0)
START, END = np.array([0.6, 0.0, 1.1, 0.0]), np.array([0.4, 0.2, 1.3, 0.6])
SHARE = np.linspace(0.0, 1.0, 101)


def course(kind=CourseKind.MOVE, **given):
    return HandCourse(kind, BOX.holds(BOX.size), START, END if kind is CourseKind.MOVE else START, **given)


def test_palms_lie_on_opposite_sides_of_the_box_backs_outwards():
    holds = BOX.holds(BOX.size)
    left, right = holds["left_hand"], holds["right_hand"]
    assert left.position[1] - right.position[1] == pytest.approx(0.32)
    for hold, side in ((left, 1.0), (right, -1.0)):
        np.testing.assert_allclose(hold.rotation[:, 2], [0.0, side, 0.0])  # out of the back of the hand
        np.testing.assert_allclose(hold.rotation[:, 0], [1.0, 0.0, 0.0])  # along the fingers
        assert np.linalg.det(hold.rotation) == pytest.approx(1.0)
        assert abs(hold.position[0]) <= 0.125


@pytest.mark.parametrize(
    ("yaw", "heading", "ahead", "depth"),
    [(0.0, 0.1, 0.0, 0.25), (0.0, 1.5, np.pi / 2, 0.32), (0.2, 3.3, 0.2 + np.pi, 0.25)],
)
def test_the_side_that_faces_the_body_is_the_nearest_to_its_heading(yaw, heading, ahead, depth):
    found, sizes = BOX.facing(yaw, heading)
    assert np.cos(found - ahead) == pytest.approx(1.0)
    assert sizes[0] == depth


def test_what_is_held_moves_as_a_rigid_thing():
    """The palms keep their distance, and their orientations relative to each other, to rounding."""
    targets = course().targets(SHARE)
    left, right = targets["left_hand"], targets["right_hand"]
    apart = np.linalg.norm(left.position - right.position, axis=1)
    np.testing.assert_allclose(apart, 0.32, atol=1e-12)
    relative = left.rotation.transpose(0, 2, 1) @ right.rotation
    np.testing.assert_allclose(relative, np.tile(relative[0], (len(SHARE), 1, 1)), atol=1e-12)


@pytest.mark.parametrize("rises_first", [True, False])
def test_a_box_is_taken_off_and_put_on_a_surface_vertically(rises_first):
    """While it moves level by less than a millimetre, it moves up, or down, by centimetres."""
    place = course(rises_first=rises_first).object_at(SHARE)
    np.testing.assert_allclose(place[[0, -1]], [START, END], atol=1e-12)
    end = START if rises_first else END
    still = np.linalg.norm(place[:, :2] - end[:2], axis=1) < 1e-3
    assert np.ptp(place[still, 2]) > 0.05


def test_minimum_jerk_begins_and_ends_at_rest():
    """Speed and acceleration vanish at both ends: the way near them grows with the cube of the time."""
    assert minimum_jerk(np.array([1e-3]))[0] < 1.1e-8
    assert 1.0 - minimum_jerk(np.array([1.0 - 1e-3]))[0] < 1.1e-8
    np.testing.assert_array_equal(minimum_jerk(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])), [0, 0, 0.5, 1, 1])


@pytest.mark.parametrize(("kind", "touch", "free"), [(CourseKind.TAKE, -1, 0), (CourseKind.LEAVE, 0, -1)])
def test_palms_come_to_the_faces_and_leave_them_from_the_side(kind, touch, free):
    target = course(kind).targets(SHARE)["left_hand"]
    on_face = START[:3] + BOX.holds(BOX.size)["left_hand"].position
    np.testing.assert_allclose(target.position[touch], on_face, atol=1e-12)
    np.testing.assert_allclose(target.position[free] - on_face, [0.0, ASIDE, 0.0], atol=1e-12)
    assert target.weight[free] == 0.0
    assert target.weight[touch] == pytest.approx(1.0)


def test_joints_of_the_arms_stay_at_their_angles():
    body = human(1.75, 79.0)
    q = np.array(body.standing_posture())
    q[7:] += 0.1
    handling = Handling(held=held_arms(body, q))
    kept = handling.applied(body, np.tile(body.standing_posture(), (3, 1)))
    arms = [7 + joint for joint in handling.angles(body)]
    assert len(arms) == 14
    np.testing.assert_array_equal(kept[:, arms], np.tile(q[arms], (3, 1)))
    others = np.setdiff1d(np.arange(body.nq), arms)
    np.testing.assert_array_equal(kept[:, others], np.tile(body.standing_posture()[others], (3, 1)))
