"""A planned whole-body motion keeps what it promises, measured apart from its certificate."""

import importlib
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.kinematics.com_reach import ComReach
from manikin.planning.com import CentroidalProblem, Weights, plan_com
from manikin.planning.whole_body import (
    KeyPostures,
    WholeBodyRequirements,
    WholeBodySettings,
    find_key_postures,
    plan_whole_body,
    swing_planner,
)
from manikin.planning.whole_body.certificate import support_errors
from manikin.planning.whole_body.fit import is_eased
from manikin.planning.whole_body.fit_job import (
    CLOSEST_KNOTS,
    FitAttempt,
    FitJob,
    no_progress,
    phase_knots,
    refined,
    sample_times,
)
from manikin.planning.whole_body.fit_scales import FitScales
from manikin.planning.whole_body.posture_style import CLOSE, READY
from manikin.runtime.parallel import Deadline
from manikin.scene import Box, Obstacle, Scene

MODULE = importlib.import_module("manikin.planning.whole_body.plan_whole_body")
"""The module; the room hands on the function of the same name."""


def first_attempt(body, scene, com):
    """The first attempt at a motion along a trajectory of the centre of mass."""
    planner = MODULE._Planner(body, scene, com, np.random.default_rng(0), WholeBodySettings())
    swings = tuple(planner.flights.plan(swing) for swing in planner.flights.flights)
    return planner._attempt(swings, planner.settings.manner, no_progress)


def test_knots_hold_every_key_instant_and_are_dense_enough():
    instants = np.array([0.0, 0.33, 0.75, 1.2])
    knots = phase_knots(instants, 0.1)
    assert set(instants) <= set(knots)
    assert np.diff(np.unique(knots)).max() <= 0.1 + 1e-12
    assert np.all(knots[:6] == 0.0)
    assert np.all(knots[-6:] == 1.2)
    times = sample_times(knots, 3)
    assert len(times) == 3 * (len(np.unique(knots)) - 1) + 1


def test_the_step_succeeds_and_its_feet_stay_where_they_stand(step_motion, person, step_com):
    assert step_motion.succeeded, step_motion.failure
    motion, schedule = step_motion.motion, step_com.schedule
    data = person.pinocchio.createData()
    for k in range(0, len(motion.time), 7):
        pin.framesForwardKinematics(person.pinocchio, data, motion.q[k])
        for contact in schedule.stance_at(float(motion.time[k])):
            placement = data.oMf[person.effector_frame(contact.effector)]
            # 1 mm is the requirement; the certificate must not be more generous than this.
            assert np.linalg.norm(placement.translation - contact.position) <= 1.0e-3
    worst = np.linalg.norm(motion.com - step_com.position(motion.time), axis=1).max()
    assert worst <= 2.0e-3
    assert worst <= step_motion.certificate.value("max_com_error_m") + 1e-12


def test_one_fit_meets_the_contacts_exactly_where_they_are_constraints(step_attempt, step_com, person):
    """Feet and centre of mass are on their places to 0.03 and 0.1 mm at every knot, without a repair.

    As penalties with multipliers they were missed by as much as the tolerance let them, 0.5 and 1.5 mm.
    """
    assert not step_attempt.continued
    assert not step_attempt.broken
    spline, schedule, data = step_attempt.result.spline, step_com.schedule, person.pinocchio.createData()
    knots = np.unique(spline.knots)
    for time, q in zip(knots, spline.evaluate(knots).q, strict=True):
        pin.framesForwardKinematics(person.pinocchio, data, q)
        for contact in schedule.stance_at(float(time)):
            placement = data.oMf[person.effector_frame(contact.effector)]
            assert np.abs(placement.translation - contact.position).max() <= 3.0e-5
        com = pin.centerOfMass(person.pinocchio, data, q)
        assert np.abs(com - step_com.position(np.array([time]))[0]).max() <= 1.0e-4


@pytest.mark.long
def test_one_fit_holds_the_contacts_of_a_random_step():
    """Any body, up a step of 5 to 20 cm with a turned foot: feet that stand are on their places to 0.03 mm.

    So at the knots, where contacts are constraints; between them the spline bends by less than 0.4 mm, where
    1 mm is required.
    """
    rng = np.random.default_rng([7, 1])
    stature, height, ahead, yaw = rng.uniform([1.55, 0.05, 0.42, -0.4], [1.90, 0.20, 0.50, 0.4])
    long, wide = 0.16 * stature, 0.068 * stature
    body = human(
        stature, 24.0 * stature**2, rng.choice(["female", "male"]), sole_length=long, sole_width=wide
    )
    size = {"length": long, "width": wide, "friction": 0.7}
    step = Obstacle(
        "step", Box((1.0, 2.0, height)), translation=(ahead + 0.45 - 0.5 * long, 0.0, 0.5 * height)
    )
    right = sole("right_foot", (0.0, -0.1, 0.0), **size)
    behind = sole("left_foot", (0.0, 0.1, 0.0), **size)
    landed = sole("left_foot", (ahead, 0.12, height), yaw, **size)
    stances = [Stance(held, 1500.0) for held in ([behind, right], [right], [landed, right])]
    reach, rest = ComReach.of(body), (0.0, 0.0, 0.0)
    com = plan_com(CentroidalProblem(
        body.mass, StanceSequence([Phase(stance, 0.5, 1.5) for stance in stances]),
        (0.0, 0.0, 0.53 * stature), (0.5 * ahead, 0.0, 0.52 * stature + height / 3.0),
        start_acceleration=rest, goal_acceleration=rest, required_margin=5.0,
        regions=tuple(reach.region(stance.contacts) for stance in stances),
        weights=Weights(0.3, 10.0, 0.0, acceleration=(1.0, 1.0, 1.0)),
    )).trajectory  # fmt: skip
    attempt = first_attempt(body, Scene([step]), com)
    assert not attempt.broken
    knots = np.unique(attempt.result.spline.knots)
    for times, most in ((knots, 3.0e-5), (np.arange(0.0, com.duration, 0.005), 4.0e-4)):
        for time, q in zip(times, attempt.result.spline.evaluate(times).q, strict=True):
            state = Configuration(body, q)
            for contact in com.schedule.stance_at(float(time)):
                assert (
                    np.linalg.norm(state.effector_placement(contact.effector)[1] - contact.position) <= most
                )


def test_velocities_and_accelerations_are_those_of_the_configurations(step_motion, person):
    """Trapezoidal integration over 1 ms: the error is of order 1e-9 rad for jerks of 1e3 rad/s^3."""
    motion = step_motion.motion
    h = np.diff(motion.time)
    for k in range(0, len(h), 13):
        moved = pin.difference(person.pinocchio, motion.q[k], motion.q[k + 1])
        np.testing.assert_allclose(moved, 0.5 * h[k] * (motion.v[k] + motion.v[k + 1]), atol=2e-6)
        np.testing.assert_allclose(
            motion.v[k + 1] - motion.v[k], 0.5 * h[k] * (motion.a[k] + motion.a[k + 1]), atol=2e-4
        )


def test_planned_forces_obey_newton_and_euler(step_motion, person, step_com):
    """Contact forces and torques together satisfy the equation of motion of the whole body."""
    motion = step_motion.motion
    model, data = person.pinocchio, person.pinocchio.createData()
    schedule = step_com.schedule
    for k in range(0, len(motion.time), 29):
        pin.computeCentroidalMomentumTimeVariation(model, data, motion.q[k], motion.v[k], motion.a[k])
        force = motion.contact_force[k, :, :3].sum(axis=0)
        # 0.01 N in 775 N: the least-squares sharing of the forces weighs the wrench 1e6 times.
        weight = np.array([0.0, 0.0, 9.81 * person.mass])
        np.testing.assert_allclose(force, data.dhg.linear + weight, atol=0.05)
        moment = np.zeros(3)
        for c, name in enumerate(motion.contact_names):
            if motion.support[k, c]:
                contact = schedule.stance_at(float(motion.time[k]))[name]
                moment += motion.contact_force[k, c, 3:]
                moment += np.cross(contact.position - data.com[0], motion.contact_force[k, c, :3])
            else:
                assert not motion.contact_force[k, c].any()
        np.testing.assert_allclose(moment, data.dhg.angular, atol=0.05)
    assert np.abs(motion.tau[:, :6]).max() < 0.05


def test_no_contact_pulls_or_slips_in_the_plan(step_motion):
    force = step_motion.motion.contact_force[:, :, :3]
    assert force[..., 2].min() >= -1e-9
    # Friction pyramid of the flat soles, mu = 0.7.
    assert np.all(np.abs(force[..., :2]).max(axis=2) <= 0.7 * force[..., 2] + 1e-9)


def test_swinging_limbs_keep_the_whole_body_in_balance(step_motion):
    """The margin of the whole-body wrench (with angular momentum) stays positive."""
    assert step_motion.motion.margin.min() > 0.0


def test_the_motion_begins_and_ends_at_rest(step_motion):
    assert np.abs(step_motion.motion.v[[0, -1]]).max() < 5e-3


@pytest.mark.long
def test_the_same_seed_gives_the_same_bits(step_motion, person, flat_ground, step_com):
    again = plan_whole_body(person, flat_ground, step_com, rng=np.random.default_rng(0))
    for name, array in step_motion.motion.arrays().items():
        assert np.array_equal(array, getattr(again.motion, name)), name


def test_a_motion_that_breaks_its_requirement_is_a_failure_that_says_so(person, flat_ground, step_com):
    # Coarse, because what cannot be is tried in several ways.
    coarse = WholeBodySettings(guide_spacing=0.3, knot_spacing=0.1, manner=CLOSE)
    strict = replace(coarse, requirements=WholeBodyRequirements(com_error=1e-9))
    result = plan_whole_body(person, flat_ground, step_com, rng=np.random.default_rng(0), settings=strict)
    assert not result.succeeded
    assert "centre-of-mass error" in result.failure.reason
    assert result.failure.where.startswith("phase ")


@pytest.mark.parametrize("led_is_caught", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_caught_fit_is_led_by_the_key_postures_unless_that_is_caught_too(
    led_is_caught, step_motion, person, flat_ground, step_com, monkeypatch
):
    postures = find_key_postures(person, flat_ground, step_com)
    # Arms unlike the manner's: they show which guide was followed.
    arm = 7 + person.joint_index("left_elbow_flexion")
    bent = [replace(p, q=np.where(np.arange(person.nq) == arm, 1.4, p.q)) for p in postures.postures]
    answers = iter([True, led_is_caught])
    monkeypatch.setattr(FitAttempt, "is_caught", property(lambda _: next(answers, False)))
    result = plan_whole_body(
        person, flat_ground, step_com, rng=np.random.default_rng(0), waypoints=KeyPostures(tuple(bent))
    )
    assert result.succeeded, result.failure
    if led_is_caught:
        np.testing.assert_array_equal(result.motion.q, step_motion.motion.q)
    else:
        middle = slice(len(result.motion.q) // 3, -len(result.motion.q) // 3)
        assert np.abs(result.motion.q[middle, arm] - 1.4).max() < 0.1
        assert np.abs(step_motion.motion.q[middle, arm] - 1.4).min() > 0.2


def with_value(certificate, key, value, time):
    """The certificate with another measured value."""
    rows = (replace(row, measured=value, time_s=time) if row.key == key else row for row in certificate)
    return replace(certificate, rows=tuple(rows))


def blocked(attempt, name, value, nearest="thorax/chest"):
    """The attempt as if it broke one requirement, at 0.6 s, with a shape that is nearest to a wall."""
    certificate = replace(with_value(attempt.certificate, name, value, 0.6), closest_pair=(nearest, "wall"))
    return replace(attempt, certificate=certificate)


@pytest.fixture(scope="module")
def step_attempt(person, flat_ground, step_com):
    """The attempt that the planned step ends with."""
    return first_attempt(person, flat_ground, step_com)


@pytest.mark.long
def test_where_straight_toes_are_in_the_way_they_may_bend(person, flat_ground, step_com, monkeypatch):
    """Toes that are too near something while they are straight are fitted without that.

    Both fits are led by toes bent by 3 degrees; straight ones keep a tenth of that where their foot stands.
    """
    attempt, fits = MODULE._Planner._attempt, {}

    def too_near_with_straight_toes(planner, swings, manner, progress, straight_toes=True):
        found = fits[straight_toes] = attempt(planner, swings, manner, progress, straight_toes)
        return blocked(found, "min_clearance_m", -0.004, "left_toes/sole") if straight_toes else found

    monkeypatch.setattr(MODULE._Planner, "_attempt", too_near_with_straight_toes)
    bent = replace(READY, angles={**READY.angles, "toe_extension": np.radians(3.0)})
    settings = WholeBodySettings(manner=bent)
    result = plan_whole_body(
        person, flat_ground, step_com, rng=np.random.default_rng(0), settings=settings
    )  # fmt: skip
    assert [*fits] == [True, False]
    assert result.succeeded, result.failure
    toes = 7 + person.joint_index("right_toe_extension")
    foot = step_com.schedule.sequence.effectors.index("right_foot")
    straight, free = (
        np.median(motion.q[motion.support[:, foot].astype(bool), toes])
        for motion in (fits[way].motion for way in (True, False))
    )
    assert straight < np.radians(0.3) < np.radians(2.0) < free


@pytest.mark.parametrize(
    ("name", "value", "nearest", "tried"),
    [
        ("max_support_error_m", 0.01, "left_toes/sole", [("ready", True)]),
        ("min_clearance_m", -0.004, "thorax/chest", [("ready", True)]),
        ("min_clearance_m", -0.004, "left_forearm/arm", [("ready", True), ("close", True)]),
        ("min_clearance_m", -0.004, "left_toes/sole", [("ready", True), ("ready", False)]),
    ],
)
def test_what_is_too_near_decides_what_is_tried(
    name, value, nearest, tried, step_attempt, person, flat_ground, step_com, monkeypatch
):
    """Arms are kept close where an arm is too near, toes may bend where they are; a contact needs neither."""
    found = []

    def misses(_planner, _swings, manner, _progress, straight_toes=True):
        found.append((manner.name, straight_toes))
        return blocked(step_attempt, name, value, nearest)

    monkeypatch.setattr(MODULE._Planner, "_attempt", misses)
    monkeypatch.setattr(MODULE._Planner, "_search_again", lambda *_: None)
    result = plan_whole_body(person, flat_ground, step_com, rng=np.random.default_rng(0))
    assert found == tried
    assert not result.succeeded


@pytest.mark.parametrize(
    ("key", "values", "tried"),
    [
        ("max_torque_share", (1.2, 1.1, 1.05, 1.02), 3),
        ("max_torque_share", (1.2, 1.3, 1.1, 1.05), 3),
        ("max_torque_share", (1.2, 1.3, 1.35), 2),
        ("max_torque_share", (6.0, 6.5), 1),
        ("max_missing_wrench", (300.0, 60.0, 0.0), 2),
        ("max_joint_limit_violation_rad", (0.2,), 0),
        ("min_clearance_m", (-0.0008, -0.00082, 0.02), 1),
        ("min_clearance_m", (-0.0008, 0.002, 0.02), 2),
    ],
)
def test_repairs_end_where_they_make_nothing_better(step_attempt, key, values, tried):
    """Two repairs in a row that make it worse are the last; the attempt that misses least is the result.

    So is one that leaves what misses most where it was: the next one would end in the same minimum. None is
    tried where joints are far out of their range, but whatever forces are missing.
    """
    attempts = [blocked(step_attempt, key, value) for value in values]
    left = iter(attempts[1:])
    job = FitJob(0.05, gives_up=True)
    best = job.repair(attempts[0], lambda *_: next(left), 3)
    assert len(attempts) - 1 - len(list(left)) == tried
    held = values[: tried + 1]
    assert best.certificate.value(key) == (max(held) if key.startswith("min_") else min(held))


def test_nothing_is_repaired_after_the_deadline(step_attempt):
    attempt = blocked(step_attempt, "max_torque_share", 1.2)
    job = FitJob(0.05, deadline=Deadline.after(-1.0))
    best = job.repair(attempt, lambda *_: pytest.fail("it is too late for a repair"), 5)
    assert best.certificate is attempt.certificate


@pytest.mark.long
@pytest.mark.slow
def test_a_step_found_by_the_bi_rrt_is_followed_like_any_other(person, flat_ground, step_com, monkeypatch):
    """With smooth curves made to fail, the whole motion still keeps every requirement."""
    real = swing_planner.plan_swing

    def fails(*args, **kwargs):
        return replace(real(*args, **kwargs), clearance=-0.01, failure="made to fail")

    monkeypatch.setattr(swing_planner, "plan_swing", fails)
    result = plan_whole_body(person, flat_ground, step_com, rng=np.random.default_rng(0))
    assert [item.method for item in result.swings] == ["bi-rrt"]
    assert result.succeeded, result.failure


@pytest.mark.parametrize(
    ("name", "what"), [("torque_share", "share of a torque limit"), ("missing_wrench", "missing wrench")]
)
def test_the_certificate_refuses_forces_beyond_the_body_or_its_contacts(step_motion, name, what):
    certificate, key = step_motion.certificate, f"max_{name}"
    assert certificate.held
    found = with_value(certificate, key, 1.01, certificate[key].time_s).first_broken
    assert found is not None
    assert found.name.startswith(what)
    assert found.time_s == certificate[key].time_s


@pytest.mark.parametrize(
    ("depth", "error", "key"),
    [
        (0.03, 9.0e-3, "min_clearance_m"), (0.001, 1.1e-3, "min_clearance_m"),
        (0.001, 9.0e-3, "max_support_error_m"),
    ],
)  # fmt: skip
def test_the_cause_is_what_is_caught_or_else_misses_most(step_motion, depth, error, key):
    """A contact missed by a tenth of what is allowed is not the cause where a part is in another one."""
    certificate = with_value(step_motion.certificate, "max_support_error_m", error, 0.5)
    certificate = with_value(certificate, "min_clearance_m", -depth, 0.4)
    cause = certificate.cause
    assert cause is not None
    assert cause.key == key


@given(st.lists(st.floats(0.02, 1.0), min_size=1, max_size=6), st.floats(0.02, 0.2))
def test_refined_knots_keep_the_old_ones_and_halve_the_spans_at_key_instants(durations, spacing):
    """The spline space grows: whatever was fitted before can still be fitted."""
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    knots = phase_knots(instants, spacing)
    fine = refined(knots, instants, within=0.05)
    assert set(np.unique(knots)) <= set(fine)
    assert np.all(fine[:6] == instants[0])
    assert np.all(fine[-6:] == instants[-1])
    middle = 0.5 * (fine[1:] + fine[:-1])[np.diff(fine) > 0]
    near = np.abs(middle[:, None] - instants).min(axis=1) < 0.02
    widest = np.diff(np.unique(knots)).max()
    assert np.all(np.diff(np.unique(fine))[near] <= max(0.5 * widest, 2.0 * CLOSEST_KNOTS) + 1e-9)


@pytest.mark.parametrize(
    ("before", "after", "eased"),
    [(0.4, 0.3, True), (0.4, 0.3999, False), (0.0, 0.2, False), (None, 0.2, False)],
)
def test_a_step_is_worth_its_time_that_takes_away_some_of_the_excess(before, after, eased):
    assert is_eased(before, after) is eased


def test_what_is_broken_weighs_more():
    """Scales of the broken requirements become finer, the others stay."""
    scales, job = FitScales(), FitJob(0.05, penalties=MODULE.PENALTIES, patience=0.005)
    changed = job.updated(scales, frozenset({"min_clearance_m", "max_support_error_m"}), narrow=True)
    assert changed.clearance < scales.clearance
    assert WholeBodyRequirements().clearance < changed.safe_distance < scales.safe_distance
    assert job.updated(scales, frozenset({"min_clearance_m"})).safe_distance == scales.safe_distance
    assert changed.tolerance == scales.tolerance  # Contacts are constraints: no weight of theirs grows.
    assert changed.decrease == 0.005
    for name in ("joint_limit", "joint_velocity", "force", "moment_share", "position", "com"):
        assert getattr(changed, name) == getattr(scales, name)
    again = job.updated(changed, frozenset({"max_missing_wrench"}))
    assert again.force < scales.force
    assert again.moment_share < scales.moment_share
    assert again.clearance == changed.clearance


def test_the_certificate_names_the_contact_that_is_missed(step_motion, person, step_com):
    """The right foot stands still all the time; the left one is where it is planned to be."""
    motion, index = step_motion.motion, 7 + person.joint_index("right_ankle_inversion")
    q = motion.q.copy()
    q[:, index] += 0.01
    position, turn = support_errors(person, step_com.schedule, replace(motion, q=q))
    names = step_com.schedule.sequence.effectors
    assert turn.max(axis=0)[names.index("right_foot")] == pytest.approx(0.01, rel=0.2)
    assert turn.max(axis=0)[names.index("left_foot")] < 1.0e-3
    assert step_motion.certificate["max_support_error_m"].where in names
    assert position.shape == (len(q), len(names))


def test_knots_are_doubled_where_a_contact_is_missed_also_far_from_key_instants(step_attempt, step_com):
    """Contacts are constraints at knots; what is missed between two of them needs more, at any timing."""
    attempt = blocked(step_attempt, "max_support_error_m", 1.8e-3)  # at 0.6 s
    fine, schedule, job = (
        attempt.finer({"max_support_error_m", "max_com_error_m"}),
        step_com.schedule,
        FitJob(0.1),
    )
    assert np.abs(schedule.instants - 0.6).min() > 0.1
    assert attempt.finer({"max_com_error_m"}) == ()
    assert replace(attempt, fine=fine).is_fine
    assert not replace(attempt, fine=((0.3,), (1.2,))).is_fine
    worse = blocked(attempt, "min_clearance_m", -0.05)  # a clearance that is missed more hides no contact
    assert replace(worse, fine=worse.finer({"max_support_error_m", "min_clearance_m"})).is_fine
    for slower in (1.0, 1.5):
        later = ContactSchedule(schedule.sequence, slower * schedule.instants)
        plain, dense = (np.unique(job.knots(later, places)) for places in ((), fine))
        assert set(plain) <= set(dense)
        at = slower * 0.6
        widest = [np.diff(knots)[np.searchsorted(knots, at) - 1] for knots in (plain, dense)]
        assert widest[1] == pytest.approx(0.5 * widest[0])
        far = np.abs(dense[:, None] - [*later.instants, at]).min(axis=1) > 0.2
        assert set(dense[far]) <= set(plain)


@pytest.mark.parametrize(("below", "unsampled"), [(0.5e-3, False), (5e-3, True)])
def test_a_clearance_that_is_missed_between_samples_asks_for_more_of_them(step_attempt, below, unsampled):
    """A sole that flies by an edge in less than the time between two samples is seen by no weight."""
    time = step_attempt.certificate["min_clearance_m"].time_s
    seen = step_attempt.fit.clearance_beside(step_attempt.result.spline, time)
    row = replace(step_attempt.certificate["min_clearance_m"], measured=seen - below, limit=seen)
    rows = tuple(row if item.key == row.key else item for item in step_attempt.certificate)
    attempt = replace(step_attempt, certificate=replace(step_attempt.certificate, rows=rows))
    assert bool(attempt.unsampled) == unsampled
    fine = attempt.finer(attempt.unsampled)
    assert len(fine) == unsampled
    # Knots are doubled there alone: near key instants that are far from it, nothing is missed.
    job, schedule = FitJob(0.1), attempt.goal.schedule
    plain, dense = (np.unique(job.knots(schedule, places)) for places in ((), fine))
    more = np.setdiff1d(dense, plain)
    assert bool(len(more)) == unsampled
    assert np.all(np.abs(more - time) < 0.15)
