"""Arms raised and swung against a fall ahead, and the moment that stops the turning."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human, kudoh
from manikin.control.recovery import BalanceRecovery, RecoverySettings, joint_groups
from manikin.control.recovery.recovery_problem import APART, FAR, RAISED, SWUNG, ArmSwing
from manikin.control.recovery.strategy import capture_point, com_law, fall_momentum
from manikin.numerics.spatial import GRAVITY

BODIES = {"kudoh": kudoh(), "human": human()}
KUDOH = BODIES["kudoh"]
FORWARD = np.array([1.0, 0.0])


@pytest.fixture(scope="module")
def controller():
    return BalanceRecovery(KUDOH, KUDOH.standing_posture())


def swing_momentum(body, flexion):
    """Angular momentum about the lateral axis of arms that swing back at 1 rad/s, their feet at rest."""
    q, v = body.standing_posture(), np.zeros(body.nv)
    for side in ("left", "right"):
        index = body.joint_index(f"{side}_shoulder_flexion")
        q[7 + index], v[6 + index] = flexion, -1.0
    data = body.pinocchio.createData()
    pin.computeCentroidalMomentum(body.pinocchio, data, q, v)
    return float(data.hg.angular[1])


@pytest.mark.parametrize("name", BODIES)
def test_raised_arms_are_worth_more_than_hanging_ones(name):
    """Why they are raised: swung from overhead they have over four times the angular momentum."""
    hanging, raised = (swing_momentum(BODIES[name], flexion) for flexion in (0.0, 2.8))
    assert raised > 1.0
    assert abs(hanging) < raised / 4.0


@pytest.mark.parametrize("name", BODIES)
def test_arms_go_up_apart_and_then_down(name):
    body = BODIES[name]
    controller = BalanceRecovery(body, body.standing_posture())
    arms = ArmSwing(body, controller.groups)
    state = controller.evaluate(body.standing_posture(), np.zeros(body.nv))
    assert arms.wish(state, 0.0) is None
    arms.begin(1.0, FORWARD, FAR + 0.1, FORWARD)
    early, late, down = (arms.wish(state, 1.0 + since)[0].reshape(3, 2) for since in (0.0, 0.2, 0.5))
    assert APART < 0.2 < RAISED < 0.5 < SWUNG
    flexion, abduction, elbow = early
    assert np.all(flexion > 0.0)
    assert np.all(abduction > 0.0)
    assert np.all(elbow > 0.0)
    assert np.all(late[0] > 0.0)
    assert np.all(late[1] < 0.0)
    assert np.all(down[0] < 0.0)
    np.testing.assert_allclose(early[:, 0], early[:, 1], rtol=1e-9)
    assert arms.wish(state, 1.0 + SWUNG) is None
    arms.begin(1.1, FORWARD, 9.0, FORWARD)
    assert arms.wish(state, 2.3) is None, "a swing that has been begun does not begin again"
    arms.reset()
    arms.begin(2.3, FORWARD, 9.0, FORWARD)
    assert arms.wish(state, 2.3) is not None


@given(angle=st.floats(-np.pi, np.pi), reach=st.floats(0.0, 3.0))
def test_only_a_far_fall_ahead_raises_them(angle, reach):
    controller = BalanceRecovery(KUDOH, KUDOH.standing_posture())
    arms = ArmSwing(KUDOH, controller.groups)
    arms.begin(0.0, 0.3 * np.array([np.cos(angle), np.sin(angle)]), reach, FORWARD)
    state = controller.evaluate(KUDOH.standing_posture(), np.zeros(KUDOH.nv))
    begun = arms.wish(state, 0.0) is not None
    if abs(abs(angle) - np.pi / 3.0) > 1e-6:
        assert begun == (reach > FAR and abs(angle) < np.pi / 3.0)


def test_locked_arms_are_not_swung():
    """They keep their weight and their hold, whatever the swing wishes."""
    controller = BalanceRecovery(KUDOH, KUDOH.standing_posture(), RecoverySettings(locked=("arms",)))
    q, v = KUDOH.standing_posture(), np.zeros(KUDOH.nv)
    v[0] = 0.9
    output = controller.step(q, v)
    arm = joint_groups(KUDOH).joints["arm"]
    acceleration = output.problem.loop.joints(
        controller._solvers["full"].solve(output.problem.program).x[: output.problem.loop.size]
    )
    assert np.abs(acceleration[arm]).max() < 1.0


def turning_state(controller, speed):
    """A standing body whose trunk bends at a speed [rad/s]."""
    v = np.zeros(KUDOH.nv)
    v[6 + KUDOH.joint_index("waist_flexion")] = speed
    return controller.evaluate(KUDOH.standing_posture(), v)


@given(speed=st.floats(0.5, 5.0), share=st.floats(0.0, 1.5))
def test_stopping_uses_up_the_range_that_is_left(controller, speed, share):
    """The settled point is beyond the capture point by ``M / (m g) (1 - exp(-w L / M))``."""
    options = controller.settings
    state = turning_state(controller, speed)
    momentum = fall_momentum(state)
    amount = np.linalg.norm(momentum)
    whole = options.range * state.mass
    law = com_law(
        state, controller.standing.com, controller.standing.area, options, share * whole * momentum / amount
    )
    height, weight = controller.standing.height, state.mass * GRAVITY
    frequency = np.sqrt(GRAVITY / height)
    left = (1.0 - share) * whole
    needed = amount**2 / (2.0 * left) if left > 0.0 else np.inf
    moment = np.clip(needed, options.least_braking * weight, options.turning * weight)
    ahead = moment / weight * (1.0 - np.exp(-frequency * amount / moment))
    capture = capture_point(state.com, state.momentum[:3] / state.mass, height)
    np.testing.assert_allclose(law.settled - capture, ahead * momentum / amount, atol=1e-9)
    if options.least_braking * weight < needed < options.turning * weight:
        np.testing.assert_allclose(amount**2 / (2.0 * moment), left, rtol=1e-9)


def test_less_range_that_is_left_asks_to_stop_harder(controller):
    state = turning_state(controller, 3.0)
    towards = fall_momentum(state) / np.linalg.norm(fall_momentum(state))
    far = [
        com_law(
            state, controller.standing.com, controller.standing.area, controller.settings,
            share * state.mass * towards,
        ).settled @ towards
        for share in (0.0, 0.08, 0.14, 0.2)
    ]  # fmt: skip
    assert np.all(np.diff(far) >= 0.0)
    assert far[-1] > far[0] + 0.005
