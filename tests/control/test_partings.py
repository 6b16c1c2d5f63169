"""Parts of the body that come near to each other: their distances, and approaches stopped in time."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.control.conftest import standing_still

from manikin.control import Controller, ControlSettings, partings
from manikin.control.partings import APART, BRAKING, LARGEST, SelfWatch, least_parting
from manikin.control.settings import Impedances

PERIOD = 0.005
HAND = ("left_hand/palm", "left_thigh/thigh")


def with_arm(body, abduction):
    """Standing with the left arm this far from where it hangs [rad]."""
    q = body.standing_posture()
    q[7 + body.joint_index("left_shoulder_abduction")] += abduction
    return q


def towards_the_leg(body, q, speed):
    """(nv,) velocity of the left arm that brings the hand to the thigh at a speed [m/s]."""
    arm = [6 + body.joint_index(name) for name in body.joint_names if name.startswith(("left_sh", "left_el"))]
    slopes = np.zeros(body.nv)
    for joint in arm:
        step = np.zeros(body.nv)
        step[joint] = 1e-5
        slopes[joint] = (gap(body, pin.integrate(body.pinocchio, q, step)) - gap(body, q)) / 1e-5
    return -speed * slopes / (slopes @ slopes)


def gap(body, q, pair=HAND):
    data, shapes = body.pinocchio.createData(), body.geometry
    placed = shapes.createData()
    pin.updateGeometryPlacements(body.pinocchio, data, shapes, placed, q)
    index = shapes.findCollisionPair(pin.CollisionPair(*map(shapes.getGeometryId, pair)))
    return pin.computeDistance(shapes, placed, index).min_distance


@pytest.fixture
def plan(body, schedule):
    """A plan in which a hand hangs 0.13 m beside its thigh: it is watched."""
    return standing_still(body, schedule, with_arm(body, -0.05))


def test_how_a_distance_changes_is_the_derivative_of_that_distance(body, plan):
    """Central differences over 20 microseconds."""
    watch, rng = SelfWatch(body, plan), np.random.default_rng(0)
    q = with_arm(body, -0.2)
    v = towards_the_leg(body, q, 2.0) + 0.05 * rng.standard_normal(body.nv)
    state = SimpleNamespace(q=q, v=v)
    found = {one.pair: one for one in watch.partings(state, SimpleNamespace(q=plan.q[0]), 0.05, PERIOD)}
    gradient, step = found[HAND].gradient, 1e-5
    ends = [gap(body, pin.integrate(body.pinocchio, q, sign * step * v)) for sign in (-1, 1)]
    assert gradient @ v == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-5)
    assert gradient @ v < -1.5


def test_a_hand_that_swings_towards_a_leg_stops_before_it(body, plan, schedule, monkeypatch):
    """At 3 m/s, 8 cm away; its posture alone, which wants it back as softly as a leg, lets it go through."""
    soft = ControlSettings(impedances=Impedances(arms=Impedances().posture))

    def nearest(controller):
        q = with_arm(body, -0.2)
        v = towards_the_leg(body, q, 3.0)
        least = gap(body, q)
        for number in range(40):
            a = controller.step(number * PERIOD, q, v).acceleration
            q = pin.integrate(body.pinocchio, q, PERIOD * v + 0.5 * PERIOD**2 * a)
            v = v + PERIOD * a
            least = min(least, gap(body, q))
        return least

    assert 0.5 * APART < nearest(Controller(body, plan, schedule, soft)) < 0.05
    monkeypatch.setattr(partings, "WATCHED", 0.0)
    assert nearest(Controller(body, plan, schedule, soft)) < 0.0


def test_what_is_as_near_as_planned_is_left_alone(body, schedule):
    """The same hand at the same speed, in a plan that has it there."""
    plan = standing_still(body, schedule, with_arm(body, -0.2))
    watch, v = SelfWatch(body, plan), towards_the_leg(body, plan.q[0], 3.0)
    state, reference = SimpleNamespace(q=plan.q[0], v=v), SimpleNamespace(q=plan.q[0])
    assert not watch.partings(state, reference, 0.05, PERIOD)


@given(room=st.floats(1e-3, 0.12), rate=st.floats(-3.0, 3.0))
def test_the_braking_stops_an_approach_within_its_room(room, rate):
    least = least_parting(room, rate, 0.05)
    needed = 0.5 * rate**2 / room if rate < 0.0 else 0.0
    assert -LARGEST <= least <= LARGEST
    if needed >= LARGEST:
        assert least == LARGEST
    elif needed >= BRAKING:
        assert least == pytest.approx(needed)
    elif needed <= 0.5 * BRAKING:
        assert least == -LARGEST
    else:
        assert least < needed
