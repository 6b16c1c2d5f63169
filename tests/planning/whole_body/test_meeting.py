"""A seat that is reached at speed: how far the buttocks' shapes are from it, whatever their tilt."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance.motion_forces import _generators
from manikin.body import human
from manikin.body.human import SEAT_WIDTH
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.motion import Motion
from manikin.planning.whole_body.sliding_touchdown import (
    SITTING_DOWN,
    SlidingTouchdown,
    sliding_touchdown_at,
    sliding_touchdown_errors,
)
from manikin.scene import Box, Obstacle, Proximity, Scene
from manikin.scene.distance import ProximitySamples

BODY = human()
TOP, TOUCH, SETTLE = 0.5, 1.0, 0.4
SCENE = Scene([Obstacle("seat", Box((0.6, 0.6, 0.1)), translation=(0.0, 0.0, TOP - 0.05))])
FOOT = sole("left_foot", (0.4, 0.1, 0.0), length=0.26, width=0.1, friction=0.7)
SEAT = sole("buttocks", (0.0, 0.0, TOP), length=0.14, width=0.24, friction=0.4, settle=SETTLE)
SCHEDULE = ContactSchedule(
    StanceSequence([Phase(Stance([FOOT], 2000.0)), Phase(Stance([FOOT, SEAT], 2000.0))]), [0.0, TOUCH, 2.0]
)
RADIUS, ASIDE = 0.027 * BODY.stature, 0.5 * SEAT_WIDTH * BODY.stature


def on_seat(height, roll):
    """(nq,) posture whose buttocks' frame is ``height`` above the seat and turned about the x axis."""
    q = BODY.posture({"left_hip_flexion": 1.4, "right_hip_flexion": 1.4})
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(roll, 0.0, 0.0)).coeffs()
    data = BODY.pinocchio.createData()
    pin.framesForwardKinematics(BODY.pinocchio, data, q)
    q[:3] += np.array([0.0, 0.0, TOP + height]) - data.oMf[BODY.effector_frame("buttocks")].translation
    return q


def motion(time, q):
    n = len(time)
    return Motion(
        time=np.array(time), q=np.tile(q, (n, 1)), v=np.zeros((n, BODY.nv)), a=np.zeros((n, BODY.nv)),
        tau=np.zeros((n, BODY.nv)), com=np.zeros((n, 3)), angular_momentum=np.zeros((n, 3)),
        margin=np.zeros(n), support=np.zeros((n, 2), dtype=bool), contact_force=np.zeros((n, 2, 6)),
        contact_names=SCHEDULE.sequence.effectors, joint_names=BODY.joint_names,
    )  # fmt: skip


def test_a_seat_is_met_from_shortly_before_the_touch_until_the_body_has_settled():
    time = TOUCH + np.array([-SITTING_DOWN - 0.01, -SITTING_DOWN, -0.01, 0.0, SETTLE - 0.01, SETTLE])
    found = sliding_touchdown_at(BODY, SCENE, SCHEDULE, time)
    assert found.pairs == {("pelvis", "seat")}
    assert found.near.tolist() == [False, True, True, True, True, False]
    assert found.sliding.tolist() == [False, False, False, True, True, False]
    ignored = (frozenset({("pelvis", "seat"), ("left_foot", "floor")}),) * len(time)
    kept = [("pelvis", "seat") in pairs for pairs in found.without(ignored)]
    assert kept == [True, False, False, False, False, True]


def test_contacts_made_at_rest_meet_nothing():
    standing = ContactSchedule(StanceSequence([Phase(Stance([FOOT], 2000.0))]), [0.0, 1.0])
    assert sliding_touchdown_at(BODY, SCENE, standing, np.array([0.5])) is None


@given(st.floats(-0.004, 0.03), st.floats(-0.4, 0.4))
def test_the_error_is_the_distance_of_the_lower_buttock(height, roll):
    """Two capsules along x: turned by ``roll``, the lower one comes down by a sin - r (cos - 1)."""
    least = height - ASIDE * abs(np.sin(roll)) + RADIUS * (np.cos(roll) - 1.0)
    played = motion([TOUCH - 0.05, TOUCH + 0.1, TOUCH + SETTLE + 0.1], on_seat(height, roll))
    meeting = sliding_touchdown_at(BODY, SCENE, SCHEDULE, played.time)
    errors = sliding_touchdown_errors(Proximity(BODY, SCENE), meeting, played)
    # Before the touch only depth counts; while it slides distance too; settled, the contact's frame does.
    assert errors == pytest.approx([max(-least, 0.0), abs(least), 0.0], abs=1e-6)


@given(st.lists(st.floats(0.0, 0.05), min_size=1, max_size=4), st.booleans())
def test_the_importance_of_touching_is_shared_among_the_closest_shapes(distances, sliding):
    k = len(distances)
    found = ProximitySamples(
        np.zeros(k, dtype=np.int64), np.array(distances), np.zeros((k, BODY.nv)), (("pelvis/a", "seat"),) * k
    )
    meeting = SlidingTouchdown(frozenset({("pelvis", "seat")}), np.array([True]), np.array([sliding]))
    importance = meeting.importance(found, meeting.rows(found))
    assert np.sum(importance**2) == pytest.approx(1.0 if sliding else 0.0)
    assert np.argmin(distances) in np.flatnonzero(importance == importance.max())


def test_what_is_inside_the_surface_matters_fully():
    found = ProximitySamples(
        np.zeros(2, dtype=np.int64), np.array([-0.002, -0.001]), np.zeros((2, BODY.nv)),
        (("pelvis/a", "seat"), ("head/skull", "seat")),
    )  # fmt: skip
    meeting = SlidingTouchdown(frozenset({("pelvis", "seat")}), np.array([True]), np.array([False]))
    assert meeting.importance(found, meeting.rows(found)).tolist() == [1.0, 0.0]


@given(st.floats(0.05, 0.4))
def test_forces_act_where_a_tilted_contact_is_low(roll):
    """Planned forces move with the effector; those of raised corners cost more, of the low ones the same."""
    turn = pin.rpy.rpyToMatrix(roll, 0.0, 0.0)
    place = np.array([0.1, -0.05, TOP + 0.03])
    before = _generators(BODY, SCHEDULE.sequence[1].stance, SCHEDULE.sequence.effectors)
    number = SCHEDULE.sequence.effectors.index("buttocks")
    after = before.settling(number, SEAT, place, turn)
    own = before.contact == number
    local = before.point[own] - SEAT.position
    assert after.point[own] == pytest.approx(place + local @ turn.T)
    assert np.array_equal(after.point[~own], before.point[~own])
    low = after.point[own][:, 2] < TOP + 0.03
    assert after.cost[own][low] == pytest.approx(before.cost[own][low])
    assert np.all(after.cost[own][~low] > 2.0 * before.cost[own][~low])
