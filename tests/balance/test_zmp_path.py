"""The ZMP along a motion: on level and inclined ground, and where it does not decide."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance import pseudo_wrench, zero_moment_point
from manikin.balance.zmp import contact_wrench, projection_plane, zmp_path
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, point, sole
from manikin.motion import Motion
from manikin.numerics.spatial import rotation_from_normal

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}


def feet(lift=0.0, tilt=0.0):
    """Two soles 0.4 m apart along x, on ground that rises towards +x by ``tilt`` [rad]."""
    normal = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])
    rotation = rotation_from_normal(normal)
    ahead = 0.4 * np.array([np.cos(tilt), 0.0, np.sin(tilt)]) + [0.0, 0.0, lift]
    return [
        sole("left_foot", (0.0, 0.1, 0.0), rotation=rotation, **SIZE),
        sole("right_foot", ahead - [0.0, 0.1, 0.0], rotation=rotation, **SIZE),
    ]


def at_rest(com, mass=70.0):
    return pseudo_wrench(mass, np.atleast_2d(com), np.zeros((1, 3)))


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_on_level_ground_it_is_the_classical_one(x, y, ax, ay):
    plane = projection_plane(Stance(feet(), 1000.0))
    assert plane.decisive
    wrench = pseudo_wrench(70.0, [[x, y, 0.9]], [[ax, ay, 0.0]])
    found = plane.in_world(plane.zero_moment_point(wrench))
    np.testing.assert_allclose(found[0, :2], zero_moment_point(wrench)[0], atol=1e-9)


@given(st.floats(-0.5, 0.5), st.floats(0.0, 0.3), st.floats(-0.1, 0.1))
def test_at_rest_on_a_slope_it_lies_where_the_plumb_line_meets_the_slope(tilt, x, y):
    """Friction carries the part of the weight along the slope; the moment is still that of gravity."""
    plane = projection_plane(Stance(feet(tilt=tilt), 1000.0))
    assert plane.decisive
    com = np.array([x, y, 0.9])
    found = plane.in_world(plane.zero_moment_point(at_rest(com)))[0]
    np.testing.assert_allclose(found, [x, y, x * np.tan(tilt)], atol=1e-9)


def test_feet_at_two_heights_and_grasps_do_not_decide():
    assert not projection_plane(Stance(feet(lift=0.2), 1000.0)).decisive
    bar = grasp("right_hand", (0.4, -0.3, 1.0), max_force=100.0)
    assert not projection_plane(Stance([*feet(), bar], 1000.0)).decisive
    assert projection_plane(Stance([bar])) is None


def test_walls_have_no_zmp():
    wall = rotation_from_normal([1.0, 0.0, 0.0])
    assert projection_plane(Stance([sole("left_foot", (0, 0, 1), rotation=wall, **SIZE)], 500.0)) is None


def test_on_a_line_of_contacts_nothing_is_inside():
    """Heel edge: the polygon is a segment, its points are at distance 0 and no point is farther in."""
    edge = [point("a", (0.0, -0.05, 0.0), friction=0.7), point("b", (0.0, 0.05, 0.0), friction=0.7)]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(edge, 1000.0))]), [0.0, 1.0])
    wrench = np.vstack([at_rest((0.0, 0.02, 0.9)), at_rest((0.01, 0.0, 0.9))])
    path = zmp_path(schedule, np.array([0.2, 0.4]), wrench)
    assert path.decisive.all()
    np.testing.assert_allclose(path.distance, [0.0, -0.01], atol=1e-12)


def test_distance_is_to_the_polygon_of_the_phase():
    stances = [feet(), feet()[:1]]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(s, 1000.0)) for s in stances]), [0.0, 1.0, 2.0])
    com = np.tile([0.02, 0.1, 0.9], (2, 1))
    path = zmp_path(schedule, np.array([0.5, 1.5]), pseudo_wrench(70.0, com, np.zeros((2, 3))))
    # On the left sole alone the nearest edge is its side, 0.06 m away; with both it is the outer one.
    np.testing.assert_allclose(path.distance[1], 0.06, atol=1e-12)
    assert path.distance[0] == pytest.approx(0.06, abs=1e-12)
    flight = zmp_path(schedule, np.array([0.5]), np.zeros((1, 6)))
    assert np.isnan(flight.distance).all()
    assert not flight.decisive.any()


def test_contact_wrench_is_about_the_contact_held_left_or_made(finished_run):
    """0.05 s after lift-off the moment arm is still that of the contact left, later that of the next."""
    body = finished_run.body
    stances = [feet(), feet()[:1], [feet()[0], sole("right_foot", (1.0, -0.1, 0.0), **SIZE)]]
    schedule = ContactSchedule(
        StanceSequence([Phase(Stance(s, 1000.0)) for s in stances]), [0.0, 1.0, 2.0, 3.0]
    )
    time = np.array([0.5, 1.05, 1.5, 2.5])
    n = len(time)
    force = np.zeros((n, 2, 6))
    force[:, 1, 2] = 100.0
    zero = np.zeros((n, body.nv))
    motion = Motion(
        time=time, q=np.tile(body.standing_posture(), (n, 1)), v=zero, a=zero, tau=zero, com=np.zeros((n, 3)),
        angular_momentum=np.zeros((n, 3)), margin=np.zeros(n), support=np.ones((n, 2), bool),
        contact_force=force, contact_names=("left_foot", "right_foot"), joint_names=body.joint_names,
    )  # fmt: skip
    wrench = contact_wrench(motion, schedule)
    np.testing.assert_allclose(wrench[:, 2], 100.0)
    np.testing.assert_allclose(-wrench[:, 4] / 100.0, [0.4, 0.4, 1.0, 1.0], atol=1e-12)
