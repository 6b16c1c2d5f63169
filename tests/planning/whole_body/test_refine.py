"""Refined motions: what they gain on their input, and what is caught where they fail."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance import MotionMargin
from manikin.body import human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.errors import ContactError, InputError
from manikin.kinematics import PostureProblem, generate_posture
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.spatial import GRAVITY_VECTOR
from manikin.planning.whole_body import refine_motion
from manikin.planning.whole_body.certificate import certify_refined
from manikin.planning.whole_body.refine_contacts import contact_variables
from manikin.planning.whole_body.refine_input import KeyPath, stretched_around, stretched_for_speed
from manikin.planning.whole_body.refine_measures import RefineObstacles, balance_of, differences, rooms_of
from manikin.scene import Box, Obstacle, Proximity, Scene

FEET = [
    sole(f"{side}_foot", (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
    for side, y in (("left", 0.1), ("right", -0.1))
]


each = pytest.mark.parametrize("name", ["crouching", pytest.param("climbing", marks=pytest.mark.long)])
"""On feet, and with hands that grasp."""


@pytest.fixture(scope="module")
def crouching(cases):
    case = cases.crouch(1)
    return case, refine_motion(*case)


@pytest.fixture(scope="module")
def climbing(cases):
    case = cases.climb(2)
    return case, refine_motion(*case)


@each
def test_a_refined_motion_keeps_every_requirement(name, request):
    _, result = request.getfixturevalue(name)
    assert result.failure is None, result.failure
    assert result.certificate.held


@each
def test_a_refined_motion_is_smoother_and_physical(name, request):
    """At least a fifth of the squared accelerations, a tenth of the violation, and no penetration.

    Both are measured by differences every 10 ms, at the same timing.
    """
    _, result = request.getfixturevalue(name)
    before, after = result.before, result.after
    assert before.duration_s == pytest.approx(after.duration_s)
    assert after.squared_accelerations <= before.squared_accelerations / 5.0
    assert before.physics_violation > 0.0
    assert after.physics_violation <= before.physics_violation / 10.0
    assert after.min_clearance_m >= max(0.0, min(before.min_clearance_m, 0.01))
    assert after.max_penetration_m <= 1e-3
    assert after.contact_slide_mps < before.contact_slide_mps


@each
def test_a_refined_motion_is_smoother_than_a_spline_through_its_input(name, request):
    """The jumps of the input's velocity at its keys do not decide the comparison."""
    _, result = request.getfixturevalue(name)
    assert result.after.squared_accelerations < result.smoothed.squared_accelerations / 2.0


@pytest.fixture(scope="module")
def knee_bends():
    """Keys with the pelvis 8 cm lower in the middle, and 4 cm at the end of the first and the third phase."""
    body, keys = human(), []
    for height in (0.92, 0.88, 0.84, 0.88, 0.92):
        problem = PostureProblem(body, tuple(FEET), com=np.array([0.0, 0.0, height]))
        found = generate_posture(problem, keys[-1] if keys else None)
        assert found.succeeded, found.failure
        keys.append(found.q)
    instants = np.array([0.0, 0.8, 1.6, 2.4, 3.2])
    schedule = ContactSchedule(StanceSequence([Phase(Stance(FEET, 1500.0))] * 4), instants)
    return body, instants, np.array(keys), schedule


def test_a_motion_with_rests_is_at_rest_there_in_its_key(knee_bends):
    """Without velocity and acceleration, in the posture that was given, all requirements kept throughout."""
    body, time, q, schedule = knee_bends
    result = refine_motion(body, Scene(), time, q, schedule, rests=[2])
    assert result.failure is None, result.failure
    found = result.spline.evaluate(result.schedule.instants)
    np.testing.assert_allclose(found.q[2], KeyPath(time, q).q[2], atol=1e-9)
    np.testing.assert_allclose(found.v[2], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.a[2], 0.0, atol=1e-6)
    assert np.abs(found.v[[1, 3]]).max() > 0.05  # and goes on elsewhere
    assert result.motion.time[-1] == pytest.approx(result.schedule.instants[-1])


def test_parts_that_another_plan_has_too_are_not_fitted_again(knee_bends):
    """Three parts; the other plan comes to the second one half a second later, and bends deeper in the third.

    The part taken over is the same motion later; certificates are measured on the motion, and hold.
    """
    body, time, q, _ = knee_bends
    phases, fitted = StanceSequence([Phase(Stance(FEET, 1500.0))] * 5), {}

    def refined(standing, keys, known):
        instants = np.concatenate([[0.0], time + standing])
        given = body, Scene(), instants, np.vstack([q[:1], keys]), ContactSchedule(phases, instants)
        return refine_motion(*given, rests=[1, 3], fitted=known)

    first, again = refined(1.0, q, fitted), refined(1.0, q, fitted)
    assert again.iterations == 0 < first.iterations
    np.testing.assert_array_equal(again.spline.control_points, first.spline.control_points)
    found = refined(1.5, q[[0, 1, 2, 2, 4]], fitted)
    assert found.failure is None, found.failure
    assert len(fitted) == 5
    instants = np.linspace(1.0, 2.6, 50)
    before, after = first.spline.evaluate(instants), found.spline.evaluate(instants + 0.5)
    np.testing.assert_allclose(after.q, before.q, atol=1e-12)
    np.testing.assert_allclose(after.a, before.a, atol=1e-8)


@pytest.mark.long
def test_a_motion_with_rests_ends_with_the_part_that_fails(knee_bends):
    """A post in the pelvis: nothing after the first rest is fitted."""
    body, time, q, schedule = knee_bends
    post = Obstacle("post", Box((0.1, 0.1, 0.2)), translation=tuple(q[0, :3]))
    result = refine_motion(body, Scene([post]), time, q, schedule, rests=[2])
    assert result.failure is not None
    assert len(result.schedule.sequence) == 2
    assert result.failure.time <= result.motion.time[-1] == result.schedule.instants[-1]


@each
def test_margin_is_positive_every_10_ms(name, request):
    """Measured from differences of the configurations alone, with the scene's own polytopes."""
    (body, *_), result = request.getfixturevalue(name)
    time = np.arange(0.0, result.motion.time[-1], 0.01)
    q = result.spline.evaluate(time).q
    v, a = differences(body, time, q)
    found = centroidal_motion(body, q, v, a)
    margin, violation = balance_of(
        result.schedule, rooms_of(result.schedule.sequence), time[1:-1], found.wrench[1:-1], found.com[1:-1]
    )
    assert margin.margin.min() > 0.0
    assert violation.max() == 0.0
    assert result.motion.margin.min() > 0.0


def test_the_motion_is_consistent(crouching):
    """Velocities are derivatives, forces carry the weight, and the motion rests at both ends."""
    (body, *_), result = crouching
    motion = result.motion
    step = motion.time[1] - motion.time[0]
    for k in (50, 200, 400):
        rate = pin.difference(body.pinocchio, motion.q[k - 1], motion.q[k + 1]) / (2.0 * step)
        np.testing.assert_allclose(motion.v[k], rate, atol=2e-3)
    force = motion.contact_force[:, :, :3].sum(axis=1)
    com_rate = np.gradient(np.gradient(motion.com, step, axis=0), step, axis=0)
    needed = body.mass * (com_rate - GRAVITY_VECTOR)
    np.testing.assert_allclose(force[5:-5], needed[5:-5], atol=0.02 * body.mass * 9.81)
    assert np.abs(motion.v[[0, -1]]).max() < 0.02


def test_the_motion_begins_and_ends_where_its_input_does(crouching):
    case, result = crouching
    for k in (0, -1):
        moved = pin.difference(case.body.pinocchio, case.q[k], np.array(result.motion.q[k]))
        assert np.abs(moved[:3]).max() < 0.05
        assert np.abs(moved[6:]).max() < 0.3


SLOW_JOINT = "right_shoulder_flexion"


def raised_arm(speed):
    """Who stands on both feet and has 0.02 s to raise an arm by 2.5 rad; a shoulder of ``speed`` [rad/s]."""
    person = human(1.75, 79.0, "male")
    segments = [
        replace(segment, hinges=tuple(
            replace(hinge, velocity_limit=speed) if hinge.name == SLOW_JOINT else hinge
            for hinge in segment.hinges
        ))
        for segment in person.segments
    ]  # fmt: skip
    body = replace(person, segments=tuple(segments))
    bent = {"hip_flexion": 0.3, "knee_flexion": 0.6, "ankle_dorsiflexion": 0.3}
    crouched = body.posture({f"{side}_{name}": bent[name] for side in ("left", "right") for name in bent})
    found = generate_posture(
        PostureProblem(body, tuple(FEET), com=np.array([0.0, 0.0, 0.84]), reference=crouched)
    )
    assert found.succeeded, found.failure
    arm = 7 + body.joint_index(SLOW_JOINT)
    down, up = np.array(found.q), np.array(found.q)
    down[arm], up[arm] = 0.0, 2.5
    time = np.array([0.0, 0.4, 0.42, 0.82])
    schedule = ContactSchedule(StanceSequence([Phase(Stance(FEET, 1500.0))]), time[[0, -1]])
    return body, time, np.array([down, down, up, up]), schedule, arm


def test_a_motion_that_is_too_fast_is_slowed_down():
    """125 rad/s are asked of a shoulder that has 2.5: the motion succeeds in three times the time.

    Its speeds, by differences of the configurations, keep the limits, to the curvature within 5 ms; it
    begins and ends at rest, with the pelvis within 1 cm and the arm within 0.1 rad, twice the deviation
    that costs one unit there.
    """
    body, time, q, schedule, arm = raised_arm(2.5)
    result = refine_motion(body, Scene(), time, q, schedule)
    assert result.succeeded, result.failure
    # At the peak of a smooth motion, with nine tenths of the limit: 1.6 * 2.5 / (0.9 * 2.5) = 1.78 s.
    assert result.stretch == pytest.approx((0.8 + 1.6 / 0.9) / 0.82, rel=1e-6)
    motion = result.motion
    speed = np.abs(np.diff(motion.q[:, 7:], axis=0)) / np.diff(motion.time)[:, None]
    share = (speed / body.velocity_limit).max()
    assert share <= 1.0
    assert result.certificate.value("max_velocity_share") == pytest.approx(share, rel=1e-2)
    assert (speed[:, arm - 7] / 2.5).max() > 0.5  # the arm is what takes the time
    for k in (0, -1):
        assert np.linalg.norm(motion.q[k, :3] - q[k, :3]) < 0.01
        assert abs(motion.q[k, arm] - q[k, arm]) < 0.1
        assert np.abs(motion.v[k]).max() < 1e-3


def test_retiming_keeps_what_is_asked_for(cases):
    """Every joint needs its peak time between two keys, and contacts move with the keys."""
    case = cases.crouch(1, duration=0.05)
    path = KeyPath(case.time, case.q)
    slower, schedule = stretched_for_speed(case.body, path, case.schedule, 0.9)
    speed = np.abs(np.diff(slower.q[:, 7:], axis=0)) / np.diff(slower.time)[:, None]
    assert np.all(speed <= 0.9 * case.body.velocity_limit / 1.6 + 1e-9)
    np.testing.assert_allclose(schedule.instants[[0, -1]], slower.time[[0, -1]])
    np.testing.assert_allclose(slower.at(slower.time)[3], slower.q[3], atol=1e-12)


def test_a_longer_phase_leaves_the_others_as_long(cases):
    schedule = cases.crouch(1).schedule
    path = KeyPath(schedule.instants[[0, -1]], np.tile([0.0, 0, 1, 0, 0, 0, 1], (2, 1)))
    _, longer = stretched_around(path, schedule, 0.9, 1.4)
    np.testing.assert_allclose(longer.durations, 0.6 * np.array([1.2, 1.4, 1.2, 1.0, 1.0]))


def test_the_certificate_catches_a_bad_motion(crouching):
    """The input itself, sampled: it penetrates, slides, is out of balance and says when."""
    case, result = crouching
    proximity = Proximity(case.body, case.scene)
    good, bad = result.motion, case.q[np.searchsorted(case.time, result.motion.time, side="right") - 1]
    shifted = np.array(bad)
    shifted[:, 2] -= 0.03
    low = np.full(len(bad), -5.0)
    motion = replace(good, q=shifted, margin=low, v=40.0 * np.ones_like(good.v))
    obstacles = RefineObstacles(case.body, case.scene, result.schedule, good.time)
    flat = (False,) * len(result.schedule.sequence)
    found = certify_refined(
        case.body, proximity, result.schedule, obstacles, motion, np.full(len(bad), 7.0),
        MotionMargin(low, low, low), flat,
    )  # fmt: skip
    assert found.broken >= {
        "max_support_error_m", "max_penetration_m", "max_velocity_share", "max_physics_violation",
        "min_margin",
    }  # fmt: skip
    assert "support error" in found.first_broken.reason
    assert found.value("max_support_error_m") > 0.029


def test_an_impossible_contact_is_an_explained_failure(person):
    """A foot 1.5 m ahead of the other is out of reach: a result that says what and when.

    Contacts are constraints of the fit: legs that are too short bend joints beyond their ranges for them.
    """
    far = sole("left_foot", (1.5, 0.1, 0.0), length=0.28, width=0.12, friction=0.7)
    schedule = ContactSchedule(StanceSequence([Phase(Stance([far, FEET[1]], 1500.0))]), [0.0, 0.6])
    q = np.tile(person.standing_posture(), (2, 1))
    result = refine_motion(person, Scene(), [0.0, 0.6], q, schedule)
    assert not result.succeeded
    assert result.failure.reason.startswith(("support error", "support turn", "joint range violation of"))
    assert result.failure.where == "phase 0 on left_foot, right_foot"


def test_inputs_that_do_not_fit_are_refused(person):
    schedule = ContactSchedule(StanceSequence([Phase(Stance(FEET, 1500.0))]), [0.0, 1.0])
    q = np.tile(person.standing_posture(), (2, 1))
    with pytest.raises(InputError, match="same interval"):
        refine_motion(person, Scene(), [0.0, 0.9], q, schedule)
    with pytest.raises(InputError, match="strictly increasing"):
        refine_motion(person, Scene(), [0.0, 0.0], q, schedule)
    with pytest.raises(InputError, match="at least two"):
        refine_motion(person, Scene(), [0.0], q[:1], schedule)
    with pytest.raises(InputError, match="columns"):
        refine_motion(person, Scene(), [0.0, 1.0], q[:, :20], schedule)
    tail = sole("tail", (0.0, 0.0, 0.0), length=0.1, width=0.1, friction=0.7)
    other = ContactSchedule(StanceSequence([Phase(Stance([tail], 1500.0))]), [0.0, 1.0])
    with pytest.raises(ContactError, match="tail"):
        refine_motion(person, Scene(), [0.0, 1.0], q, other)


@given(st.floats(0.0, 4.2))
def test_contact_variables_are_one_in_contact_and_fade_out(time):
    schedule = crouch_schedule()
    variables = contact_variables(schedule, np.array([time]))
    held = schedule.stance_at(time).effectors
    for name, value in variables.items():
        assert 0.0 <= value[0] <= 1.0
        if name in held:
            assert value[0] == 1.0
    middle = 0.5 * (schedule.instants[1] + schedule.instants[2])
    assert contact_variables(schedule, np.array([middle]))["left_foot"][0] == 0.0


def crouch_schedule(duration: float = 1.4) -> ContactSchedule:
    """Both feet, the right one, both; so long each [s]."""
    stances = (FEET, FEET[1:], FEET)
    phases = StanceSequence([Phase(Stance(contacts, 1500.0)) for contacts in stances])
    return ContactSchedule(phases, duration * np.arange(4))


def test_clearance_of_a_flight_rises_and_falls(person):
    """Nothing is wanted of what is held; a flying foot has to keep off the floor in mid-flight only.

    That is until 0.35 s before it lands, however slow it is: in the last third of a long flight it may still
    be before the edge of what it is to stand on.
    """
    schedule, scene = crouch_schedule(), Scene()
    time = np.array([0.5, 1.4, 2.1, 2.79])
    ignored = RefineObstacles(person, scene, schedule, time).ignored
    assert ("left_foot", "floor") in ignored[0]
    assert ("left_foot", "floor") not in ignored[2]
    by_sample = wanted_of_left_foot(person, schedule, time)
    assert by_sample[1] == pytest.approx(-0.01)
    assert by_sample[2] == pytest.approx(0.02)
    assert by_sample[3] < 0.0
    slow = wanted_of_left_foot(person, crouch_schedule(2.4), np.array([2.4, 2.8, 4.4, 4.79]))
    assert slow[1] == slow[2] == pytest.approx(0.02)
    assert slow[3] < 0.0


def wanted_of_left_foot(person, schedule, time) -> dict[int, float]:
    """Wanted distance of a standing person's left foot from the floor at times, by sample [m]."""
    scene = Scene()
    obstacles = RefineObstacles(person, scene, schedule, time)
    q = np.tile(person.standing_posture(), (len(time), 1))
    found = Proximity(person, scene).evaluate_over(q, 0.1, obstacles.ignored)
    wanted = obstacles.wanted(found, 0.02, -0.01)
    left = np.array([pair == ("left_foot/sole", "floor") for pair in found.pairs])
    return {int(k): float(w) for k, w in zip(found.sample[left], wanted[left], strict=True)}
