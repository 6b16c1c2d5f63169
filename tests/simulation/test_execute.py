from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from manikin.balance.motion_margin import motion_margin
from manikin.body import Configuration, carrying, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.control import ControlSettings
from manikin.errors import ContactError, InputError
from manikin.numerics.spatial import GRAVITY, GRAVITY_VECTOR
from manikin.scene import Box, Obstacle, Scene
from manikin.simulation import PhysicsOptions, Push, compile_model, default_physics, execute


def smooth(share):
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def squat(time):
    """Down 15 cm and up again in 3 s, swaying 2 cm to the sides."""
    depth = smooth(time / 1.5) - smooth((time - 1.5) / 1.5)
    sway = 0.02 * np.sin(np.pi * time / 3) ** 2 * np.sin(2 * np.pi * time / 1.5)
    return np.array([0.0, sway, -0.15 * depth])


@pytest.fixture(scope="module")
def stepped(body, step):
    plan = step(shift=1.0, swing=0.6, stride=(0.2, 0.0, 0.0))
    return plan, execute(body, Scene(), plan.motion, plan.schedule)


def test_standing_still(body, stand):
    """The body stands where it is told, to a tenth of a millimetre, with its weight on its feet."""
    plan = stand(0.5)
    result = execute(body, Scene(), plan.motion, plan.schedule, hold=0.5)
    assert result.succeeded
    assert result.com_max_error_m < 2e-4
    assert result.max_penetration_m < 1e-3
    assert result.min_margin > 50
    weight = result.motion.contact_force[-1, :, 2].sum()
    assert weight == pytest.approx(9.81 * body.mass, rel=1e-3)


def test_squat_and_sway(body, stand):
    """A 15 cm squat is followed to 2 mm with the feet on the floor."""
    plan = stand(3.0, squat)
    result = execute(body, Scene(), plan.motion, plan.schedule, hold=0.2)
    assert result.succeeded
    assert result.com_rms_error_m < 2e-3
    assert result.max_foot_error_m < 1e-3
    assert result.min_margin > 20
    assert not result.fallbacks


def test_a_motion_that_begins_at_speed_stands_at_once(body, stand):
    """Feet planned 0.05 mm above the floor carry at least half the weight in the first millisecond."""
    plan = stand(0.6, lambda t: np.array([0.0, 0.0, -0.05]) * smooth(t / 0.6))
    motion, half = plan.motion, plan.motion.time.searchsorted(0.3)
    fields = ("q", "v", "a", "tau", "com", "angular_momentum", "margin", "support", "contact_force")
    late = {name: getattr(motion, name)[half:].copy() for name in fields}
    late["q"][:, 2] += 5e-5 - Configuration(body, late["q"][0]).effector_placement("left_foot")[1][2]
    begun = replace(motion, time=motion.time[half:] - motion.time[half], **late)
    instants = ContactSchedule(plan.schedule.sequence, [0.0, begun.duration])
    result = execute(body, Scene(), begun, instants, hold=0.0)
    assert result.succeeded
    assert result.motion.contact_force[0, :, 2].sum() > 0.5 * body.mass * GRAVITY


@pytest.mark.parametrize(
    ("stature", "mass"), [(1.55, 50.0), pytest.param(1.95, 110.0, marks=pytest.mark.long)]
)
def test_small_and_large_people_crouch_without_chatter(stand, stature, mass):
    """Light toes under load neither sink nor let the foot creep."""
    person = human(stature, mass)
    plan = stand(1.0, lambda t: np.array([0.01, 0.03, -0.08]) * smooth(t), person=person)
    result = execute(person, Scene(), plan.motion, plan.schedule, hold=0.5)
    assert result.succeeded
    assert result.com_max_error_m < 3e-3
    assert result.max_foot_error_m < 1e-3
    assert result.max_slip_m < 1e-3


def test_step_with_weight_shift(stepped):
    """A 20 cm step in 0.6 s: CoM 5 mm RMS, feet 1 cm, margin positive, nothing else touched."""
    plan, result = stepped
    assert result.succeeded, result.failure
    assert result.com_rms_error_m < 5e-3
    assert result.max_foot_error_m < 1e-2
    assert result.min_margin > 0
    assert result.max_penetration_m < 5e-3
    assert result.final_com_error_m < 1e-3
    assert result.motion.duration == pytest.approx(plan.motion.duration + 1.0)
    # Whole control steps from exactly 0, whatever the engine's own clock added up.
    np.testing.assert_array_equal(result.motion.time, np.round(0.005 * np.arange(len(result.motion.time)), 9))
    flight = result.motion.support[(result.motion.time > 1.05) & (result.motion.time < 1.45)]
    assert flight[:, 0].all()
    assert not flight[:, 1].any()


def test_executed_motion_obeys_newton_and_euler(body, stepped):
    """Recorded contact forces equal m (a - g) and Ldot of the recorded states and accelerations."""
    _, result = stepped
    motion, data = result.motion, body.pinocchio.createData()
    for k in range(0, len(motion.time), 10):
        pin.computeCentroidalMomentumTimeVariation(
            body.pinocchio, data, motion.q[k], motion.v[k], motion.a[k]
        )
        force = motion.contact_force[k, :, :3].sum(axis=0) + body.mass * GRAVITY_VECTOR
        # Forces of 1e3 N from an iterative contact solver.
        assert force == pytest.approx(data.dhg.linear, abs=0.05)
        assert motion.com[k] == pytest.approx(data.com[0], abs=1e-12)


def test_summary_has_the_agreed_keys(body, stepped):
    _, result = stepped
    assert list(result.summary()) == [
        "fell", "com_rms_error_m", "com_max_error_m", "max_foot_error_m", "final_com_error_m",
        "min_margin", "min_force_at_com_N", "min_zmp_distance_m", "max_penetration_m",
        "max_padding_compression_m", "peak_torque_Nm",
        "realtime_factor", "wall_s", "friction", "unplanned_touches", "push",
    ]  # fmt: skip
    assert set(result.peak_torque_Nm) == set(body.joint_names)
    assert result.max_limit_use <= 1 + 1e-6


def test_same_run_gives_the_same_bits(body, stand):
    plan = stand(0.1)
    first, second = (execute(body, Scene(), plan.motion, plan.schedule, hold=0.1) for _ in range(2))
    for name, values in first.motion.arrays().items():
        assert np.array_equal(values, second.motion.arrays()[name]), name


def test_com_beyond_the_feet_falls_and_is_reported(body, stand):
    """A CoM sent 25 cm forward has no support there."""
    plan = stand(2.0, lambda t: np.array([0.25, 0.0, -0.05]) * smooth(t))
    result = execute(body, Scene(), plan.motion, plan.schedule)
    assert result.fell
    assert not result.succeeded
    assert "fell: the CoM is" in result.failure
    assert 0.5 < result.failure_time_s < 3.0
    assert result.motion.time[-1] == pytest.approx(result.failure_time_s, abs=0.006)


def test_slippery_floor_is_seen_as_slip(body, stand):
    """Swaying with 0.06 of the weight sideways slides on friction 0.03; on 0.7 crouching bodies do not."""

    def sway(time):
        sideways = 0.03 * np.sin(1.4 * np.pi * time) * smooth(time) * smooth(2.0 - time)
        return np.array([0.0, sideways, -0.05 * smooth(time)])

    plan = stand(2.0, sway)
    icy = execute(
        body, Scene(), plan.motion, plan.schedule, hold=0.0,
        physics=PhysicsOptions(joint_damping=1.0, friction=0.03),
    )  # fmt: skip
    assert icy.max_slip_m > 5e-3
    assert icy.max_foot_error_m > 4e-3


def test_feet_do_not_slip_because_a_seat_is_smooth(body, stand):
    """Each segment has the friction of its own contacts: the engine takes the larger of two geometries."""
    schedule = stand(0.2).schedule
    feet = [replace(contact, friction=0.7) for contact in schedule.sequence[0].stance]
    place = Configuration(body, body.standing_posture()).effector_placement("buttocks")[1]
    seat = sole("buttocks", place, length=0.2, width=0.3, friction=0.3)
    phases = [Phase(Stance([*feet, seat])), Phase(Stance(feet))]
    physics = default_physics(body, ContactSchedule(StanceSequence(phases), [0.0, 0.1, 0.2]))
    model = compile_model(body, Scene(), physics).mujoco
    owners = [model.body(number).name for number in model.geom_bodyid]
    friction = {name: model.geom_friction[row, 0] for row, name in enumerate(owners)}
    for side in ("left", "right"):
        assert max(friction[f"{side}_foot"], friction["world"]) == 0.7
        assert max(friction[f"{side}_toes"], friction["world"]) == 0.7
    pelvis = body.effector("buttocks").segment
    assert max(friction[pelvis], friction["world"]) == 0.3


def test_push_is_withstood_and_too_strong_a_push_fells(body, stand):
    """20 N.s on the chest is absorbed, 80 N.s is not."""
    plan = stand(1.0)
    for impulse, falls in ((20.0, False), (80.0, True)):
        push = Push("thorax", np.array([10 * impulse, 0.0, 0.0]), start=0.3, duration=0.1)
        result = execute(body, Scene(), plan.motion, plan.schedule, pushes=[push])
        assert result.fell == falls
        if not falls:
            assert 1e-3 < result.com_max_error_m < 0.05
            assert result.final_com_error_m < 1e-3


@pytest.fixture(scope="module")
def landed_late(body, step):
    """A step onto a floor that is 4 mm below the planned one."""
    plan = step(shift=1.0, swing=0.6, stride=(0.1, 0.0, 0.0))
    return plan, execute(body, Scene(floor_height=-0.004), plan.motion, plan.schedule, hold=0.2)


def test_floor_lower_than_planned_is_found(landed_late):
    """With the floor 4 mm below the plan the foot lands late and the step still succeeds."""
    _, result = landed_late
    assert result.succeeded, result.failure
    assert result.com_max_error_m < 0.02


def test_the_margin_of_a_foot_that_lands_late_is_that_of_the_other_one(body, landed_late):
    """Planned on both feet, standing on one: the margin is that of the one that carries.

    The wrench of a sample is compared with that of the engine's first millisecond, hence the 3 N.m.
    """
    plan, result = landed_late
    motion, names = result.motion, plan.schedule.sequence.effectors
    planned = plan.schedule.support(motion.time, names).all(axis=1)
    touches = motion.support[:, names.index("right_foot")]
    # In the step before a touch the foot may touch after the first millisecond; it bounces.
    before = np.append(touches[1:], True)
    late = np.flatnonzero(planned & ~touches & ~before & (motion.time > 1.0))
    assert len(late) >= 2
    force = motion.contact_force[late, names.index("left_foot")]
    stance = plan.schedule.sequence[-1].stance
    left, cap = stance["left_foot"], 3.0 * body.mass * GRAVITY
    wrench = np.concatenate(
        [force[:, :3], force[:, 3:] + np.cross(left.position, force[:, :3])], axis=1
    )  # contact forces are about the planned contact's origin
    one, both = (
        motion_margin([Stance(contacts, cap)], np.zeros(len(late)), wrench, motion.com[late]).margin
        for contacts in ([left], list(stance))
    )
    assert both[0] > one[0] + 8.0
    assert np.abs(motion.margin[late] - one).max() < 3.0, np.abs(motion.margin[late] - one)


def test_obstacle_in_the_way_is_an_unplanned_touch(body, stepped, cut):
    """A block under the flying foot is touched, named and timed."""
    plan = cut(stepped[0], 1.7)
    block = Obstacle("block", Box((0.02, 0.1, 0.06)), translation=(0.25, -0.09, 0.03))
    result = execute(body, Scene([block]), plan.motion, plan.schedule, hold=0.0)
    assert not result.succeeded
    assert any(touch.other == "block" and "right" in touch.segment for touch in result.touches)
    assert 1.0 < result.touches[0].time < 1.6
    largest = max(result.touches, key=lambda touch: touch.force)
    assert largest.force > 5.0
    told = {(one["segment"], one["other"]): one for one in result.summary()["unplanned_touches"]}
    assert told[largest.segment, largest.other]["max_force_N"] == largest.force


def test_controller_works_with_any_period_of_whole_steps(body, stand):
    """A 4 ms period is fine; 4.5 ms of 1 ms steps is refused."""
    plan = stand(0.2)
    good = execute(
        body, Scene(), plan.motion, plan.schedule, settings=ControlSettings(period=0.004), hold=0.1
    )
    assert good.succeeded
    with pytest.raises(InputError, match="valid: a whole multiple"):
        execute(body, Scene(), plan.motion, plan.schedule, settings=ControlSettings(period=0.0045))


def test_support_off_any_surface_is_refused(body, stand):
    plan = stand(0.2)
    with pytest.raises(ContactError):
        execute(body, Scene(floor_height=-0.5), plan.motion, plan.schedule)


def test_motion_of_another_body_is_refused(body, stand):
    plan = stand(0.2)
    wrong = replace(plan.motion, joint_names=tuple(reversed(plan.motion.joint_names)))
    with pytest.raises(InputError, match="a motion planned for this body"):
        execute(body, Scene(), wrong, plan.schedule)


def test_a_body_stands_with_a_load_in_its_hand(stand):
    """12 kg in the right hand: the feet carry the weight of both, and the margin stays."""
    person = carrying(human(), 12.0, "right")
    plan = stand(0.5, person=person)
    result = execute(person, Scene(), plan.motion, plan.schedule, hold=0.5)
    assert result.succeeded
    assert result.com_max_error_m < 1e-3
    assert result.min_margin > 20
    force = result.motion.contact_force[-1, :, 2]
    assert force.sum() == pytest.approx(9.81 * (human().mass + 12.0), rel=1e-3)
    names = list(result.motion.contact_names)
    assert force[names.index("right_foot")] > force[names.index("left_foot")] + 20.0
