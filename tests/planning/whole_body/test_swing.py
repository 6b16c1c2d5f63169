"""Swings: exact ends, consistent derivatives, clearance kept, explained failures."""

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import rotation_from_rpy, rotation_from_yaw
from manikin.planning.whole_body.swing import SwingLimits, check_swing, plan_swing
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import EffectorPath, Nearness, Pose

FACING_Y = rotation_from_yaw(np.pi / 2)
IDENTITY = np.eye(3)
FOOT = (0.28, 0.12, 0.06)
THRESHOLD = ((0.05, 1.5, 0.3), (0.35, 0.75, 0.15))
PLATFORM = ((1.1, 1.5, 0.2), (0.9, 0.75, 0.1))


def make_pose(position, rotation=IDENTITY):
    return Pose(np.array(position, dtype=float), rotation)


def pointwise(function):
    """Clearance from a function of one instant and pose, its gradient by forward differences."""

    def clearance(time, position, rotation, within=np.inf):
        def distances(places):
            poses = zip(time, places, rotation, strict=True)
            return np.array([function(instant, Pose(place, turn)) for instant, place, turn in poses])

        distance = distances(position)
        slopes = np.stack(
            [(distances(position + 1e-4 * axis) - distance) / 1e-4 for axis in np.eye(3)], axis=1
        )
        near = distance < within
        return Nearness(np.where(near, distance, np.inf), near[:, None] * slopes)

    return clearance


def box_clearance(standing=None):
    """Distance of a foot box and a shin to the floor, threshold, platform and a standing leg."""
    fixed = [(coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), coal.Transform3s.Identity())]
    for size, centre in (THRESHOLD, PLATFORM):
        fixed.append((coal.Box(*size), coal.Transform3s(np.eye(3), np.array(centre))))
    if standing is not None:
        foot_at = np.add(standing, (0, 0, 0.03))
        shin_at = np.add(standing, (0, -0.07, 0.35))
        fixed.append((coal.Box(FOOT[1], FOOT[0], FOOT[2]), coal.Transform3s(np.eye(3), foot_at)))
        fixed.append((coal.Capsule(0.05, 0.5), coal.Transform3s(np.eye(3), shin_at)))
    own = [(coal.Box(*FOOT), np.array([0, 0, 0.03])), (coal.Capsule(0.05, 0.3), np.array([-0.07, 0, 0.3]))]

    def clearance(_time, pose):
        distances = []
        for shape, offset in own:
            place = coal.Transform3s(pose.rotation, pose.position + pose.rotation @ offset)
            for other, where in fixed:
                result = coal.DistanceResult()
                distances.append(coal.distance(shape, place, other, where, coal.DistanceRequest(), result))
        return min(distances)

    return pointwise(clearance)


open_space = pointwise(lambda _time, _pose: 1.0)


positions = st.tuples(*[st.floats(-1, 1)] * 3)
angles = st.tuples(*[st.floats(-1.2, 1.2)] * 3)


@st.composite
def curves(draw):
    start = make_pose(draw(positions), rotation_from_rpy(*draw(angles)))
    goal = make_pose(draw(positions), rotation_from_rpy(*draw(angles)))
    begin = draw(st.floats(-2, 2))
    end = begin + draw(st.floats(0.3, 2))
    return SwingCurve.lift(
        start, goal, begin, end, height=draw(st.floats(0, 0.4)), lateral=draw(st.floats(-0.3, 0.3)),
        pitch=draw(st.floats(-0.5, 0.8)), controls=draw(st.integers(12, 26)),
    )  # fmt: skip


@given(curves())
def test_swing_starts_and_ends_exactly_at_rest(curve):
    """Pose exact, velocity and acceleration zero at both ends, and constant outside."""
    state = curve.evaluate([curve.start_time - 1, curve.start_time, curve.end_time, curve.end_time + 1])
    for row, pose in zip(range(4), (curve.start, curve.start, curve.end, curve.end), strict=True):
        # The basis sums to one only to rounding: 1e-12 of a metre.
        np.testing.assert_allclose(state.position[row], pose.position, atol=1e-12)
        np.testing.assert_allclose(state.rotation[row], pose.rotation, atol=1e-12)
    # Differences of equal control points, times rates of up to 1e3 per second squared.
    assert np.abs(state.velocity).max() < 1e-10
    assert np.abs(state.angular_velocity).max() < 1e-10
    assert np.abs(state.acceleration).max() < 1e-8


@given(curves())
def test_velocity_and_acceleration_are_the_derivatives(curve):
    """Central differences of poses and velocities agree with the closed forms."""
    h = 1e-5 * curve.duration
    time = np.linspace(curve.start_time + 2 * h, curve.end_time - 2 * h, 40)
    before, after, here = curve.evaluate(time - h), curve.evaluate(time + h), curve.evaluate(time)
    turn = Rotation.from_matrix(after.rotation @ np.swapaxes(before.rotation, 1, 2)).as_rotvec()
    # The error of central differences is h^2/6 times the third derivative, relative to the scale.
    speed = max(1.0, np.abs(here.velocity).max(), np.abs(here.angular_velocity).max())
    push = max(1.0, np.abs(here.acceleration).max())
    np.testing.assert_allclose((after.position - before.position) / (2 * h), here.velocity, atol=1e-6 * speed)
    np.testing.assert_allclose(turn / (2 * h), here.angular_velocity, atol=1e-5 * speed)
    np.testing.assert_allclose(
        (after.velocity - before.velocity) / (2 * h), here.acceleration, atol=1e-5 * push
    )


@given(curves())
def test_rotations_stay_rotations(curve):
    """Products of exponentials are orthonormal to rounding."""
    rotation = curve.evaluate(np.linspace(curve.start_time, curve.end_time, 50)).rotation
    identity = np.broadcast_to(np.eye(3), rotation.shape)
    np.testing.assert_allclose(rotation @ np.swapaxes(rotation, 1, 2), identity, atol=1e-12)


def test_acceleration_and_jerk_are_continuous():
    """Jumps between samples shrink with the step: the curve is C3 and more."""
    curve = SwingCurve.lift(make_pose((0, 0, 0)), make_pose((0.5, 0.2, 0.1), FACING_Y), 0.0, 0.8)
    for name, order in (("acceleration", 2), ("angular_velocity", 3)):
        coarse, fine = (
            np.abs(np.diff(getattr(curve.evaluate(np.linspace(-0.1, 0.9, n)), name), n=order, axis=0)).max()
            for n in (2001, 4001)
        )
        # Second differences of a C1 function fall at least linearly, of a C2 one quadratically.
        assert fine < 0.3 * coarse


def test_without_pitch_the_turn_is_the_shortest_one():
    """All rotations on the way lie on the geodesic from start to goal (SLERP)."""
    goal = rotation_from_rpy(0.4, -0.3, 1.1)
    curve = SwingCurve.lift(make_pose((0, 0, 0)), make_pose((0.5, 0, 0), goal), 0.0, 1.0)
    turns = Rotation.from_matrix(curve.evaluate(np.linspace(0, 1, 30)).rotation).as_rotvec()
    whole = Rotation.from_matrix(goal).as_rotvec()
    assert np.abs(np.cross(turns, whole)).max() < 1e-12


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.3, -0.2, 0.9)])
def test_lift_off_and_touch_down_follow_the_normal(normal):
    """The first and last millimetres leave and meet the surface along its normal."""
    normal = np.array(normal) / np.linalg.norm(normal)
    curve = SwingCurve.lift(
        make_pose((0, 0, 0)),
        make_pose((0.4, 0.1, 0)),
        0.0,
        0.6,
        height=0.1,
        start_normal=normal,
        end_normal=normal,
    )
    state = curve.evaluate([0.02, 0.58])
    for row, pose in ((0, curve.start), (1, curve.end)):
        offset = state.position[row] - pose.position
        along = offset @ normal
        assert along > 0
        # Across falls with one power of time more than along: 3 % of the flight gives about a tenth.
        assert np.linalg.norm(offset - along * normal) < 0.35 * along


def test_the_apex_is_passed_at_its_time():
    """As high above the higher end, and as far to the left of the travel, as asked."""
    start, goal = make_pose((0, 0, 0)), make_pose((0.5, 0, 0.1))
    curve = SwingCurve.lift(start, goal, 1.0, 2.0, height=0.2, lateral=0.07, apex=0.4)
    np.testing.assert_allclose(curve.at(1.4).position[1:], [0.07, 0.3], atol=1e-9)


def test_following_a_path_converges_to_it():
    """More control poses come closer to the polyline, and no faster than it allows."""
    corners = [[0, 0, 0], [0.2, 0, 0.4], [0.6, 0.2, 0.4], [0.7, 0.2, 0]]
    path = EffectorPath([0, 0.3, 0.7, 1.0], corners, np.tile(np.eye(3), (4, 1, 1)))
    gaps = []
    for controls in (12, 24, 48, 96):
        state = SwingCurve.along(path, controls).evaluate(np.linspace(0, 1, 200))
        dense = path.sample(np.linspace(0, 1, 2000))[0]
        gaps.append(np.linalg.norm(state.position[:, None] - dense[None], axis=2).min(axis=1).max())
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] < 0.02


@pytest.mark.parametrize(
    ("start", "goal", "standing"),
    [((0.1, 0, 0), (0.7, 0.65, 0.2), (0.2, 0.4, 0)), ((0.2, 0.4, 0), (0.5, 0.65, 0.2), (0.7, 0.65, 0.2))],
)
def test_feet_step_over_the_threshold(start, goal, standing):
    """Both steps of the platform scenario clear everything by 2.5 cm at human speed."""
    clearance = box_clearance(standing)
    plan = plan_swing(make_pose(start, FACING_Y), make_pose(goal, FACING_Y), 0.0, 0.8, clearance)
    assert plan.succeeded, plan.failure
    assert plan.failure is None
    assert plan.curve.peak_speed < 3.0
    assert np.linalg.norm(plan.curve.evaluate(np.linspace(0, 0.8, 101)).acceleration, axis=1).max() < 20.0
    assert plan.clearance >= 0.025 - 1e-9
    # Denser than the planner looked: half a millimetre may be lost between its samples.
    dense = check_swing(plan.curve, clearance, SwingLimits(clearance=0.0245, time_step=1e-3))
    assert dense.succeeded, dense.failure


def test_free_flight_needs_only_the_first_curve():
    """In open space the lowest curve is taken."""
    plan = plan_swing(make_pose((0, 0, 0)), make_pose((0.3, 0, 0)), 0.0, 0.5, open_space, refine=0)
    assert plan.succeeded
    assert plan.curve.at(0.25).position[2] == pytest.approx(0.06)


def test_planning_is_deterministic():
    """Same question, same bits."""
    start, goal = make_pose((0.1, 0, 0), FACING_Y), make_pose((0.7, 0.65, 0.2), FACING_Y)
    plans = [plan_swing(start, goal, 0.0, 0.8, box_clearance()) for _ in range(2)]
    assert np.array_equal(plans[0].curve.control_position, plans[1].curve.control_position)


def test_a_closed_way_is_explained():
    """A wall without end cannot be passed; the message says where and when."""

    @pointwise
    def wall(_time, pose):
        return abs(pose.position[0] - 0.25) - 0.05

    plan = plan_swing(make_pose((0, 0, 0)), make_pose((0.5, 0, 0)), 0.0, 0.6, wall, refine=5)
    assert not plan.succeeded
    assert "clearance is -0.0" in plan.failure
    assert "t = " in plan.failure


def test_too_little_time_is_explained():
    """A metre in a tenth of a second breaks the speed limit."""
    plan = plan_swing(make_pose((0, 0, 0)), make_pose((1, 0, 0)), 0.0, 0.1, open_space, refine=3)
    assert not plan.succeeded
    assert "speed reaches" in plan.failure


def test_clearance_may_depend_on_time():
    """An obstacle that leaves late is waited for or passed above."""

    @pointwise
    def gate(time, pose):
        inside = 0.2 < pose.position[0] < 0.3 and time < 0.35
        return pose.position[2] - 0.15 if inside else 0.5

    plan = plan_swing(make_pose((0, 0, 0)), make_pose((0.5, 0, 0)), 0.0, 0.8, gate)
    assert plan.succeeded, plan.failure


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"end_time": 0.0}, "after its start"),
        ({"start_normal": (0, 0, 0)}, "normal"),
        ({"start_time": np.nan}, "start_time"),
    ],
)
def test_misuse_is_refused(change, message):
    """Bad times and normals raise one line."""
    arguments = {"start_time": 0.0, "end_time": 0.5, **change}
    with pytest.raises(InputError, match=message):
        plan_swing(make_pose((0, 0, 0)), make_pose((0.3, 0, 0)), clearance=open_space, **arguments)


def test_bad_curves_are_refused():
    """Too few controls."""
    with pytest.raises(InputError, match="control poses"):
        SwingCurve(0.0, 1.0, np.zeros((5, 3)), np.tile(np.eye(3), (5, 1, 1)))


def test_too_fast_a_flight_is_not_lifted_higher():
    """0.83 m in 0.4 s needs more than 3 m/s at any height: the lowest clear curve is the best attempt."""
    start, goal = make_pose((0, 0, 0)), make_pose((0.83, 0, 0))

    @pointwise
    def above_floor(_time, pose):
        return float(pose.position[2])

    plan = plan_swing(start, goal, 0.0, 0.4, above_floor, refine=0)
    assert "speed" in plan.failure
    state = plan.curve.evaluate(np.linspace(0.0, 0.4, 101))
    # The family's lowest apex is 6 cm; a curve that wins centimetres of needless slack would fly at 70.
    assert state.position[:, 2].max() <= 0.1
