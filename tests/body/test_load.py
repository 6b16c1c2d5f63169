"""A load in the hands is a mass in the mechanics."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import (
    Configuration,
    body_from_signature,
    carrying,
    human,
    insect,
    kudoh,
    random_configuration,
    with_further_contacts,
)
from manikin.errors import BodyError
from manikin.motion.description import body_from, describe_body
from manikin.numerics.spatial import GRAVITY_VECTOR

LOAD = 12.0


def palm(state, hand="right_hand"):
    """Place (3,) of the load [m] and Jacobian (3, nv) of it in world axes."""
    _, place = state.effector_placement(hand)
    effector = state.body.effector(hand)
    return place, state.point_jacobian(effector.segment, effector.translation)


@given(st.integers(0, 2**31), st.floats(0.5, 40.0), st.sampled_from(["left", "right", "both"]))
def test_mass_centre_of_mass_and_dynamics_change_by_a_point_mass_at_the_palm(seed, mass, hand):
    """``M q'' + h`` of the loaded body is that of the body plus ``J^T m (J q'' + J' q' - g)`` of the load."""
    rng = np.random.default_rng(seed)
    body = human()
    loaded = carrying(body, mass, hand)
    q, v, a = random_configuration(body, rng), rng.standard_normal(body.nv), rng.standard_normal(body.nv)
    state, other = Configuration(body, q), Configuration(loaded, q)
    hands = {"left": ["left_hand"], "right": ["right_hand"], "both": ["left_hand", "right_hand"]}[hand]
    share = mass / len(hands)
    assert loaded.mass == pytest.approx(body.mass + mass, rel=1e-12)
    assert loaded.own_mass == pytest.approx(body.mass, rel=1e-12)
    places = [palm(state, name)[0] for name in hands]
    com = (body.mass * state.com + share * np.sum(places, axis=0)) / (body.mass + mass)
    np.testing.assert_allclose(other.com, com, atol=1e-12)
    model, data = body.pinocchio, body.pinocchio.createData()
    wanted = pin.rnea(model, data, q, v, a).copy()
    pin.forwardKinematics(model, data, q, v, a)
    for name in hands:
        frame = body.effector_frame(name)
        pin.updateFramePlacement(model, data, frame)
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, aligned).linear
        wanted += palm(state, name)[1].T @ (share * (acceleration - GRAVITY_VECTOR))
    found = pin.rnea(loaded.pinocchio, loaded.pinocchio.createData(), q, v, a)
    np.testing.assert_allclose(found, wanted, atol=1e-8 * max(1.0, np.abs(wanted).max()))


def test_a_man_with_a_load_is_as_strong_as_without():
    body, loaded = human(), carrying(human(), LOAD, "left")
    np.testing.assert_array_equal(loaded.torque_lower, body.torque_lower)
    np.testing.assert_array_equal(loaded.torque_upper, body.torque_upper)
    assert carrying(body, 0.0) is body


def test_two_loads_add_up():
    twice = carrying(carrying(human(), 3.0, "left"), 4.0, "both")
    assert dict(twice.loads) == {"left_hand": 5.0, "right_hand": 2.0}
    np.testing.assert_allclose(twice.mass, human().mass + 7.0, rtol=1e-12)


@pytest.mark.parametrize("make", [human, kudoh, lambda: with_further_contacts(human(), ("knees",))])
def test_files_keep_the_load(make):
    body = carrying(make(), LOAD, "right")
    again = body_from(describe_body(body))
    assert dict(again.loads) == {"right_hand": LOAD}
    assert again.own_mass == pytest.approx(body.own_mass, rel=1e-12)
    assert again.mass == pytest.approx(body.mass, rel=1e-12)
    if body.name == "human":
        signed = body_from_signature(body.signature())
        assert signed.signature() == body.signature()
        np.testing.assert_allclose(signed.segment("right_hand").inertia, body.segment("right_hand").inertia)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [((-1.0, "left"), "load"), ((1.0, "tail"), "hand"), ((float("nan"), "left"), "load")],
)
def test_what_nobody_carries_is_refused(arguments, word):
    with pytest.raises(BodyError, match=word):
        carrying(human(), *arguments)


def test_a_body_without_hands_carries_nothing():
    with pytest.raises(BodyError, match="right_hand"):
        carrying(insect(), 0.1, "right")
