"""Recovery from pushes: the closed loops, the ZMP, posture control, the choice and the program."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.body import BodyModel, human, insect, kudoh
from manikin.control.dynamics import Dynamics
from manikin.control.recovery import (
    BalanceRecovery,
    FeltPush,
    RecoverySettings,
    Strategy,
    joint_groups,
    zmp_of,
)
from manikin.control.recovery.recovery_problem import leg_symmetry
from manikin.control.recovery.standing import ClosedLoop, LinearMap, SupportArea, close_loop, zmp_rows
from manikin.control.recovery.strategy import StrategySwitch, posture_control
from manikin.errors import BodyError, InputError
from manikin.numerics.spatial import GRAVITY

SOME = settings(max_examples=15)
SEEDS = st.integers(0, 2**32 - 1)
BODIES = {"kudoh": kudoh(), "human": human()}


@pytest.fixture(scope="module", params=BODIES)
def body(request) -> BodyModel:
    return BODIES[request.param]


def moved_state(body, seed, spread=0.2):
    """A posture near standing, with random speeds that leave the feet where they are."""
    rng = np.random.default_rng(seed)
    groups = joint_groups(body)
    dynamics = Dynamics(body, {name: body.effector_frame(name) for name in groups.feet})
    q = pin.integrate(body.pinocchio, body.standing_posture(), spread * rng.normal(size=body.nv))
    still = dynamics.evaluate(q, np.zeros(body.nv))
    basis = close_loop(still, groups.feet, FeltPush.none(body.nv)).acceleration.matrix
    return dynamics, groups, q, basis @ rng.normal(size=basis.shape[1])


def test_groups_hold_every_joint_and_segment_once(body):
    groups = joint_groups(body)
    joints = np.concatenate(list(groups.joints.values()))
    assert sorted(joints) == list(range(body.nv - 6))
    segments = [name for names in groups.segments.values() for name in names]
    assert sorted(segments) == sorted(segment.name for segment in body.segments)
    assert set(groups.locked(("arms", "hips"))) == set(
        np.concatenate([groups.joints[name] for name in ("arm", "hip", "trunk")])
    )


def test_a_body_without_two_legs_is_refused():
    with pytest.raises(BodyError, match="two legs"):
        joint_groups(insect())


def test_both_feet_held_leave_28_of_kudoh_s_34_joint_angles_free():
    """34 - 6 = 28 closed-loop coordinates ([Kudoh2002]_ 2.2): 8 of 14 in the legs."""
    body = BODIES["kudoh"]
    dynamics, groups, q, v = moved_state(body, 0)
    loop = close_loop(dynamics.evaluate(q, v), groups.feet, FeltPush.none(body.nv))
    assert loop.size == 28


@SOME
@given(seed=SEEDS)
def test_feet_stay_and_forces_follow_from_the_accelerations(seed):
    """Against differences in time along the motion that the maps promise, for both bodies."""
    for body in BODIES.values():
        dynamics, groups, q, v = moved_state(body, seed)
        state = dynamics.evaluate(q, v)
        loop = close_loop(state, groups.feet, FeltPush.none(body.nv))
        phi = np.random.default_rng(seed + 1).normal(size=loop.size)
        a = loop.acceleration(phi)
        np.testing.assert_allclose(loop.joints(phi), a[6:], atol=1e-12)
        for foot in groups.feet:
            frame = state.frames[foot]
            np.testing.assert_allclose(frame.jacobian @ a + frame.drift, 0.0, atol=1e-9)
        h = 1e-5
        ends = [
            dynamics.evaluate(pin.integrate(body.pinocchio, q, s * h * v + 0.5 * h * h * a), v + s * h * a)
            for s in (-1.0, 1.0)
        ]
        rate = (ends[1].momentum - ends[0].momentum) / (2.0 * h)
        weight = np.array([0.0, 0.0, body.mass * GRAVITY])
        scale = 1.0 + np.abs(rate).max()
        np.testing.assert_allclose(loop.force(phi), rate[:3] + weight, atol=1e-5 * scale)
        np.testing.assert_allclose(loop.moment(phi), rate[3:], atol=1e-5 * scale)


@SOME
@given(seed=SEEDS)
def test_rows_of_the_zmp_are_its_distance_to_the_edges(seed):
    """Row = (distance outside) f_z for each edge, whatever pushes besides."""
    body = BODIES["kudoh"]
    dynamics, groups, q, v = moved_state(body, seed, spread=0.05)
    rng = np.random.default_rng(seed)
    state = dynamics.evaluate(q, v)
    push = FeltPush(rng.normal(scale=50.0, size=6), np.zeros(body.nv))
    loop = close_loop(state, groups.feet, push)
    phi = rng.normal(size=loop.size)
    area = SupportArea(np.array([[-0.1, -0.2], [0.15, -0.2], [0.15, 0.2], [-0.1, 0.2]]), 0.0)
    force = loop.force(phi)
    zmp = zmp_of(force, loop.moment(phi), state.com, area.height)
    normals, offsets = area.half_planes(0.01)
    rows = zmp_rows(area, loop, state.com, 0.01)(phi)
    np.testing.assert_allclose(rows, (normals @ zmp - offsets) * force[2], rtol=1e-9, atol=1e-9)


def test_the_zmp_of_a_vertical_force_is_where_it_acts():
    place = np.array([0.07, -0.03, 0.0])
    com, force = np.array([0.02, 0.05, 0.9]), np.array([30.0, -20.0, 700.0])
    moment = np.cross(place - com, force)
    np.testing.assert_allclose(zmp_of(force, moment, com, 0.0), place[:2], atol=1e-12)
    assert np.all(np.isnan(zmp_of(np.array([0.0, 0.0, -1.0]), moment, com, 0.0)))


def test_reach_is_one_on_the_edge_and_the_nearest_point_is_inside():
    area = SupportArea(np.array([[-0.1, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.1, 0.2]]), 0.0)
    assert area.reach(np.array([0.2, 0.1])) == pytest.approx(1.0)
    assert area.reach(area.centre) == pytest.approx(0.0)
    far = area.nearest(np.array([1.0, 0.3]), 0.01)
    assert float(area.inside(far)) == pytest.approx(0.01)
    np.testing.assert_allclose(area.nearest(np.array([0.1, 0.1]), 0.01), [0.1, 0.1])


@SOME
@given(seed=SEEDS)
def test_posture_gains_are_the_largest_that_keep_the_zmp_inside(seed):
    """At the share found no row is positive, and at none of 200 larger ones are all rows not positive."""
    loop, rows, stiff, damped = posture_problem(seed)
    found = posture_control(loop, rows, stiff, damped)

    def excess(share: float) -> float:
        return rows(reduced(loop, stiff, damped, share)).max()

    if found is None:
        assert all(excess(share) > -1e-6 for share in np.linspace(1e-3, 1.0, 200))
        return
    np.testing.assert_allclose(
        found.joints, loop.joints(reduced(loop, stiff, damped, found.share)), atol=1e-6
    )
    assert excess(found.share) <= 1e-9 * BODIES["kudoh"].mass * GRAVITY
    if found.share < 1.0:
        assert all(excess(share) > 0.0 for share in np.linspace(1.0, found.share, 200, endpoint=False))


@SOME
@given(seed=SEEDS)
def test_where_no_gains_keep_the_zmp_inside_it_leaves_least(seed):
    """No share of a fine grid has a smaller largest row."""
    loop, rows, stiff, damped = posture_problem(seed)
    outside = LinearMap(rows.matrix, rows.offset + 500.0)
    assert posture_control(loop, outside, stiff, damped) is None
    found = posture_control(loop, outside, stiff, damped, always=True)
    assert found is not None
    assert not found.inside
    excess = [
        outside(reduced(loop, stiff, damped, s)).max() for s in (found.share, *np.linspace(0.0, 1.0, 101))
    ]
    assert excess[0] <= min(excess[1:]) + 1e-6


def posture_problem(seed: int) -> tuple[ClosedLoop, LinearMap, np.ndarray, np.ndarray]:
    """A moved body, where its ZMP may be, and both parts of its posture control."""
    body = BODIES["kudoh"]
    dynamics, groups, q, v = moved_state(body, seed, spread=0.02)
    state = dynamics.evaluate(q, 0.2 * v)
    loop = close_loop(state, groups.feet, FeltPush.none(body.nv))
    area = SupportArea(np.array([[-0.1, -0.2], [0.14, -0.2], [0.14, 0.2], [-0.1, 0.2]]), 0.0)
    rows = zmp_rows(area, loop, state.com, 0.0)
    return loop, rows, 100.0 * (body.standing_posture() - q)[7:], -20.0 * state.v[6:]


def reduced(loop: ClosedLoop, stiff: np.ndarray, damped: np.ndarray, share: float) -> np.ndarray:
    """Accelerations of the closed loop with reduced gains."""
    wanted = share**2 * stiff + share * damped - loop.joints.offset
    return np.linalg.lstsq(loop.joints.matrix, wanted, rcond=None)[0]


def test_symmetry_lets_legs_grow_no_less_alike():
    """Acceleration order opposite to the angle order, none where the angles are equal (K-2)."""
    body = BODIES["kudoh"]
    dynamics, groups, q, v = moved_state(body, 3)
    loop = close_loop(dynamics.evaluate(q, v), groups.feet, FeltPush.none(body.nv))
    left, right = body.joint_index("left_knee_flexion"), body.joint_index("right_knee_flexion")
    angles, phi = np.zeros(34), np.random.default_rng(0).normal(size=loop.size)
    assert not len(leg_symmetry(loop, angles, [(left, right)], 0.01).offset)
    gap = loop.joints(phi)[right] - loop.joints(phi)[left]
    for sign in (1.0, -1.0):
        angles[right] = 0.2 * sign
        row = leg_symmetry(loop, angles, [(left, right)], 0.01)
        np.testing.assert_allclose(row(phi), [sign * gap])


def test_the_choice_does_not_chatter():
    """Noise smaller than the gap of the hysteresis changes the strategy once on the way out and once back."""
    area = SupportArea(np.array([[-0.1, -0.2], [0.1, -0.2], [0.1, 0.2], [-0.1, 0.2]]), 0.0)
    chosen_settings = RecoverySettings(inner=0.4, outer=0.6)
    switch, rng = StrategySwitch(chosen_settings), np.random.default_rng(0)
    places = 0.09 * np.sin(np.linspace(0.0, np.pi, 1000)) + rng.uniform(-0.009, 0.009, 1000)
    chosen = [switch.choose(np.array([x, 0.0, 0.9]), np.array([x, 0.0]), area) for x in places]
    changes = sum(a is not b for a, b in itertools.pairwise(chosen))
    assert chosen[0] is Strategy.POSTURE
    assert chosen[500] is Strategy.PROGRAM
    assert chosen[-1] is Strategy.POSTURE
    assert changes == 2


def test_a_step_keeps_its_limits(body):
    """Unilateral feet, friction, torques and ZMP of a body pushed to 0.55 m/s forward."""
    controller = BalanceRecovery(body, body.standing_posture())
    still = controller._dynamics.evaluate(body.standing_posture(), np.zeros(body.nv))
    loop = close_loop(still, controller.groups.feet, FeltPush.none(body.nv))
    com = still.centroidal_map[:3] @ loop.acceleration.matrix / body.mass
    phi = np.linalg.lstsq(com, [0.55, 0.0, 0.0], rcond=None)[0]
    output = controller.step(still.q, loop.acceleration.matrix @ phi)
    assert output.strategy is Strategy.PROGRAM
    assert not output.fallback
    assert body.torque_share(output.tau).max() <= 1.0 + 1e-9
    wrenches = np.array(list(output.wrenches.values()))
    assert np.all(wrenches[:, 2] >= -1e-3)
    sideways = np.abs(wrenches[:, :2]).max(axis=1)
    assert np.all(sideways <= 0.7 * wrenches[:, 2] + 1e-2)
    lever = wrenches[:, 3:5] / wrenches[:, 2:3]
    half = np.array([0.5 * body.sole_width, 0.5 * body.sole_length])
    assert np.all(np.abs(lever) <= half + 1e-4)


def test_standing_still_needs_no_program(body):
    controller = BalanceRecovery(body, body.standing_posture())
    output = controller.step(body.standing_posture(), np.zeros(body.nv))
    assert output.strategy is Strategy.POSTURE
    assert output.gain_share == pytest.approx(1.0)
    load = sum(wrench[2] for wrench in output.wrenches.values())
    assert load == pytest.approx(body.mass * GRAVITY, rel=1e-3)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"inner": 0.9, "outer": 0.5}, "inner <= outer"),
        ({"locked": ("legs",)}, "arms, hips"),
        ({"delay": -0.1}, "delay"),
        ({"period": float("nan")}, "period"),
    ],
)
def test_unusable_settings_are_refused(values, text):
    with pytest.raises(InputError, match=text):
        RecoverySettings(**values)


def test_linear_maps_are_joined_row_by_row():
    one = LinearMap(np.eye(2), np.array([1.0, 2.0]))
    both = one.joined(LinearMap(np.ones((1, 2)), np.array([5.0])))
    np.testing.assert_allclose(both(np.array([1.0, 1.0])), [2.0, 3.0, 7.0])
