"""Recorded motions re-planned: their stances, their centre of mass, and what becomes of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from manikin.analysis.adaptation import HEIGHT_ROOM, adapt_recording, crop
from manikin.analysis.contact_adaptation import (
    EARLY,
    REMNANT,
    RISEN,
    effector_placements,
    landing_flat,
    leaving_with_the_hinge,
    on_one_seat,
    rising_at_once,
    scene_under,
    toe_hinge,
    within_toe_strength,
    without_remnants,
)
from manikin.analysis.posture_adaptation import CUT_HEIGHT, SWING_HEIGHT, effector_paths
from manikin.balance import pseudo_wrench, wrench_polytope
from manikin.contact import ContactSchedule, Phase, SolePart, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.motion.file import read_motions, write_motions
from manikin.numerics.spatial import GRAVITY
from manikin.recordings import read_recording, reconstruct, recorded_schedule, smoothed, supports_of
from manikin.reports.analysis_directory import compare_with_recording


def test_who_stands_and_nods_is_planned_and_executed(nod):
    """Both feet flat all along: plan and execution are exact to millimetres, and balanced."""
    told = nod.as_dict()
    assert told["com_rms_m"] < 0.005
    assert told["min_margin"] > 0.0
    assert told["wholebody"]["max_support_error_m"] < 1e-3
    assert told["execution"]["failure"] is None
    assert told["execution"]["com_rms_error_m"] < 0.005
    assert told["execution"]["min_margin"] > 0.0


def test_the_result_is_plain_and_fits_a_motion_file(nod, tmp_path):
    assert json.loads(json.dumps(nod.as_dict(), allow_nan=False))["method"] == "keyframes"
    write_motions(tmp_path / "motion.h5", nod.content)
    back = read_motions(tmp_path / "motion.h5")
    assert back.planned is not None
    assert back.executed is not None
    np.testing.assert_array_equal(back.schedule.instants, nod.schedule.instants)


def test_an_unknown_method_is_refused(walk):
    with pytest.raises(InputError, match="valid: keyframes, timing-free"):
        adapt_recording(*walk, method="guessing")


def test_heels_land_flat_and_nothing_else_changes(walk):
    found, supports = walk
    recorded = recorded_schedule(smoothed(found), supports, rolling=True)
    flat = landing_flat(recorded, found.body)
    parts = {contact.part for phase in flat.sequence for contact in phase.stance}
    assert parts == {SolePart.FULL, SolePart.TOES}
    middles = 0.5 * (flat.instants[:-1] + flat.instants[1:])
    for time in middles:
        before, after = recorded.stance_at(time), flat.stance_at(time)
        assert set(before.effectors) == set(after.effectors)
        for name in after.effectors:
            np.testing.assert_array_equal(before[name].position, after[name].position)
    assert flat.instants[[0, -1]].tolist() == recorded.instants[[0, -1]].tolist()


def test_a_chair_does_not_move():
    """Places of one seat become their median; one a metre away is another seat."""
    places = [(0.0, 0.0, 0.40), (0.02, 0.0, 0.42), (0.01, 0.03, 0.41), (1.0, 0.0, 0.5)]
    foot = sole("left_foot", (0.5, 0.0, 0.0), length=0.26, width=0.11, friction=0.8)
    phases = []
    for place in places:
        seat = sole("buttocks", place, length=0.2, width=0.3, friction=0.8)
        phases += [Phase(Stance([foot, seat], 2000.0)), Phase(Stance([foot], 2000.0))]
    schedule = ContactSchedule(StanceSequence(phases), np.arange(9.0))
    changed = on_one_seat(schedule)
    found = [phase.stance["buttocks"].position.tolist() for phase in list(changed.sequence)[::2]]
    assert found == [[0.01, 0.0, 0.41]] * 3 + [[1.0, 0.0, 0.5]]
    assert all("buttocks" not in phase.stance for phase in list(changed.sequence)[1::2])


def rolling(*durations):
    """One foot that stands on its whole sole first and on its toes then, for some time each."""
    whole = sole("left_foot", (0.0, 0.0, 0.0), length=0.26, width=0.11, friction=0.8)
    feet = whole, replace(whole, part=SolePart.TOES)
    phases = [
        Phase(Stance([foot], 2000.0), lasting, lasting) for foot, lasting in zip(feet, durations, strict=True)
    ]
    return ContactSchedule(StanceSequence(phases), np.append(0.0, np.cumsum(durations)))


@pytest.mark.parametrize(
    ("durations", "left"),
    [
        ((0.5 * REMNANT, 0.3), [SolePart.TOES]),
        ((0.3, 0.5 * REMNANT), [SolePart.FULL]),
        ((2.0 * REMNANT, 0.3), [SolePart.FULL, SolePart.TOES]),
    ],
)
def test_what_a_clip_cuts_to_an_instant_is_as_beside(durations, left):
    changed = without_remnants(rolling(*durations))
    assert [phase.stance["left_foot"].part for phase in changed.sequence] == left
    assert changed.instants[[0, -1]] == pytest.approx([0.0, sum(durations)])
    assert changed.durations == pytest.approx([phase.min_duration for phase in changed.sequence])


def test_a_seat_is_left_as_soon_as_the_buttocks_rise(nod):
    """They rise at 0.1 m/s from 0.4 s on, and so by what a seat follows them after 0.4 s and a little."""
    body = nod.body
    foot = sole("left_foot", (0.5, 0.0, 0.0), length=0.26, width=0.11, friction=0.8)
    q = np.tile(body.standing_posture(), (101, 1))
    place = effector_placements(body, q[:1], "buttocks")[0][0]
    seat = sole("buttocks", place, length=0.2, width=0.3, friction=0.8)
    time = np.linspace(0.0, 1.0, 101)
    q[:, 2] += 0.1 * np.maximum(time - 0.4, 0.0)
    stances = Stance([foot, seat], 2000.0), Stance([foot], 2000.0)
    phases = [Phase(stance, d, d) for stance, d in zip(stances, (0.8, 0.2), strict=True)]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.8, 1.0])
    changed = rising_at_once(schedule, body, time, q)
    assert changed.instants[1] == pytest.approx(0.4 + RISEN / 0.1, abs=0.011)
    assert rising_at_once(schedule, body, time, np.tile(q[0], (101, 1))).instants[1] == 0.8


def test_a_window_is_a_recording_of_its_own(walk):
    found, supports = walk
    part, held = crop(found, supports, supports.start + 0.3, supports.start + 0.9)
    assert part.time[[0, -1]] == pytest.approx([0.0, 0.6], abs=1e-9)
    whole = recorded_schedule(found, supports)
    cut = recorded_schedule(part, held)
    for time in np.linspace(0.05, 0.55, 11):
        before, after = whole.stance_at(time + 0.3 + supports.start), cut.stance_at(time)
        assert set(before.effectors) == set(after.effectors)
    with pytest.raises(InputError, match="valid: at least 4"):
        crop(found, supports, 90.0, 91.0)


def test_every_contact_lies_on_the_scene(walk):
    found, supports = walk
    schedule = recorded_schedule(smoothed(found), supports)
    scene = scene_under(schedule, supports.surfaces[0] - 0.3)  # as if all of it were on a stage
    contacts = [contact for phase in schedule.sequence for contact in phase.stance]
    assert all(set(scene.touched_obstacles(contact)) <= set(scene.names) for contact in contacts)
    assert len(scene) == 1 + len(supports.supports)


def test_feet_keep_to_their_contacts_and_fly_clear_of_the_floor(walk):
    """On their contacts exactly while they lie flat; in flight no heel is below the floor."""
    found, supports = walk
    even = smoothed(found)
    schedule = landing_flat(recorded_schedule(even, supports, rolling=True), found.body)
    # The schedule's clock is the supports', here the reconstruction's too.
    paths = effector_paths(found.body, schedule, supports.start + found.time, even.q)
    phases = schedule.phase_at(supports.start + found.time)
    floor = supports.surfaces[0]
    for name, target in paths.targets.items():
        for row, phase in enumerate(phases):
            stance = schedule.sequence[phase].stance
            if name in stance and stance[name].part is SolePart.FULL:
                np.testing.assert_allclose(target.position[row], stance[name].position, atol=1e-12)
                assert target.weight[row] == 1.0
        flying = target.weight < 1.0
        half = 0.5 * found.body.sole_length
        heels = target.position[flying, 2] - half * target.rotation[flying, 2, 0]
        assert heels.min() > floor - 0.005


@pytest.mark.long
def test_a_walk_over_plates_is_reproduced_in_balance(walked):
    """The bar of the key frame method: 1.5 cm, with a margin that is never negative, measured here again."""
    told = walked.as_dict()
    assert told["com_rms_m"] <= 0.015
    trajectory = walked.com.trajectory
    times = np.linspace(0.0, trajectory.duration, 200)
    wrench = pseudo_wrench(walked.body.mass, trajectory.position(times), trajectory.acceleration(times))
    polytopes = [wrench_polytope(phase.stance) for phase in walked.schedule.sequence]
    phases = walked.schedule.phase_at(times)
    assert min(polytopes[p].margin(w) for p, w in zip(phases, wrench, strict=True)) >= 0.0


@pytest.mark.long
def test_the_walk_is_executed_at_its_own_speed(walked):
    """The controller follows it through both steps; 2 cm of CoM is a tenth of what a fall begins with."""
    ran = walked.execution
    assert not ran.fell
    assert ran.motion.duration == pytest.approx(walked.recording.time[-1], abs=0.01)
    assert ran.com_max_error_m < 0.02
    assert np.mean(ran.motion.margin > 0.0) > 0.9


@pytest.mark.long
def test_plan_and_execution_keep_to_the_recorded_postures(walked):
    """Below 8 degrees, with nothing in touch; the strongest joint needs 1.47 times the mean adult's strength.

    Arms that have to make up for what a point mass leaves out, and soles that tilt half as far as they were
    recorded to, come to 15 degrees.
    """
    told = walked.as_dict()
    assert np.degrees(told["wholebody"]["posture_rms_rad"]) < 8.0
    assert told["wholebody"]["max_torque_share"] <= 1.5
    assert told["wholebody"]["min_clearance_m"] >= 0.01
    # Planned with the recorded rate of the angular momentum alone: 95 %.
    assert told["wholebody"]["share_positive_margin"] > 0.97
    assert walked.execution.failure == ""
    assert len(walked.execution.touches) == 0


@pytest.mark.long
def test_the_plan_is_in_balance_as_a_point_mass_and_with_its_angular_momentum(walked):
    """Both every millisecond; the rate is no small one: walkers turn with some 30 N.m and more."""
    trajectory = walked.com.trajectory
    times = np.linspace(0.0, trajectory.duration, round(1000 * trajectory.duration) + 1)
    polytopes = [wrench_polytope(phase.stance) for phase in walked.schedule.sequence]
    phases = walked.schedule.phase_at(times)
    for way in (trajectory, replace(trajectory, turning=None)):
        wrench = way.pseudo_wrench(times)
        assert min(polytopes[p].margin(w) for p, w in zip(phases, wrench, strict=True)) >= 0.0
    assert np.abs(trajectory.angular_momentum_rate(times)).max() > 20.0


def test_feet_leave_while_their_toes_still_lie(walk):
    """At most a tenth of a second sooner than recorded, and with their hinge within 3 cm of its place."""
    found, supports = walk
    even, clock = smoothed(found), supports.start + found.time
    before = landing_flat(recorded_schedule(even, supports, rolling=True), found.body)
    after = leaving_with_the_hinge(before, found.body, clock, even.q)
    earlier = before.instants - after.instants
    assert earlier.max() > 0.02
    assert np.all((earlier >= 0.0) & (earlier < 0.1))
    for name in ("left_foot", "right_foot"):
        position, rotation = effector_placements(found.body, even.q, name)
        hinge = toe_hinge(found.body, name)
        path = position + rotation @ hinge
        for index, end in enumerate(after.instants[1:-1]):
            stance = after.sequence[index].stance
            if name not in stance or name in after.sequence[index + 1].stance:
                continue
            contact = stance[name]
            place = contact.position + contact.rotation_contact_to_world @ hinge
            assert np.linalg.norm(path[np.argmin(np.abs(clock - end))] - place) < 0.03


def test_who_turns_on_the_toes_while_they_carry_does_not_leave_at_once(walk):
    """With hinges that are nowhere near, and phases of half a second: a tenth of a second early, not more."""
    found, supports = walk
    even = smoothed(found)
    schedule = landing_flat(recorded_schedule(even, supports, rolling=True), found.body)
    instants = 0.5 * np.arange(len(schedule.instants))
    slow = ContactSchedule(StanceSequence([Phase(phase.stance) for phase in schedule.sequence]), instants)
    time = np.linspace(0.0, instants[-1], 200)
    elsewhere = np.tile(even.q[-1] + np.eye(found.body.nq)[2], (200, 1))
    after = leaving_with_the_hinge(slow, found.body, time, elsewhere)
    earlier = instants - after.instants
    assert sorted(set(np.round(earlier, 9))) == [0.0, EARLY]


@pytest.mark.long
def test_a_foot_is_on_its_contact_up_to_the_instant_of_its_lift_off(walked):
    """And no farther off by then than elsewhere: its hinge starts from rest."""
    schedule, instants = walked.schedule, walked.schedule.instants
    postures = walked.planned.q[np.round(1e3 * instants).astype(int)]
    paths = effector_paths(walked.body, schedule, instants, postures)
    left = 0
    for index in range(1, len(schedule.sequence)):
        before, after = schedule.sequence[index - 1].stance, schedule.sequence[index].stance
        for name in set(before.effectors) - set(after.effectors):
            assert paths.targets[name].weight[index] == 1.0
            left += 1
    assert left == 3
    assert walked.adapted.certificate.value("max_support_error_m") < 2e-3


def test_a_foot_about_to_land_where_a_clip_ends_is_not_held_up(walk):
    """Cut 30 ms before a touch-down its sole is not much higher than it was recorded, or has to be."""
    found, supports = walk
    end = next(s.start for s in supports.supports if s.start > supports.start + 0.3) - 0.03
    part, held = crop(found, supports, supports.start, end)
    even = smoothed(part)
    schedule = landing_flat(recorded_schedule(even, held, rolling=True), part.body)
    paths = effector_paths(part.body, schedule, part.time, even.q)
    half = 0.5 * part.body.sole_length
    flying = [name for name in paths.targets if name not in schedule.sequence[-1].stance]
    for name in flying:
        target = paths.targets[name]
        low = target.position[-1, 2] - half * abs(target.rotation[-1, 2, 0]) - held.surfaces[0]
        recorded, turn = effector_placements(part.body, even.q[-1:], name)
        was = recorded[0, 2] - half * abs(turn[0, 2, 0]) - held.surfaces[0]
        assert low < max(was, CUT_HEIGHT) + 0.01
    assert flying


@pytest.mark.long
def test_a_motion_that_ends_at_speed_is_not_stopped_dead(walked):
    """Load changes by less than a fifth of the weight in the last step, where one to rest would take all."""
    ran = walked.execution.motion
    load = ran.contact_force[:, :, 2].sum(axis=1)
    assert abs(load[-1] - load[-2]) < 0.2 * walked.body.mass * GRAVITY
    assert ran.time[-1] < walked.planned.time[-1]


def test_a_foot_tilts_on_its_toes_as_far_as_it_was_recorded_to(walk):
    """Beyond 35 degrees, up to which it once counted; its toes bend by the same angle and lie flat."""
    found, supports = walk
    even, clock = smoothed(found), supports.start + found.time
    schedule = landing_flat(recorded_schedule(even, supports, rolling=True), found.body)
    schedule = leaving_with_the_hinge(schedule, found.body, clock, even.q)
    paths = effector_paths(found.body, schedule, clock, even.q)
    tilts = []
    for name, target in paths.targets.items():
        pitch = np.arcsin(-target.rotation[:, 2, 0])
        held = target.weight >= 1.0
        toes = paths.toes[found.body.joint_index(name.replace("foot", "toe_extension"))]
        np.testing.assert_allclose(np.maximum(pitch, 0.0)[held], toes[held], atol=1e-6)
        tilts.append(np.degrees(pitch[held].max()))
    assert min(tilts) > 35.0


def test_who_lands_on_the_toes_comes_down_to_the_sole_without_a_jump(nod):
    """Toes are bent when they land under a foot of 20 degrees, whose heel is down when it counts."""
    body, tilted = nod.body, np.deg2rad(20.0)
    (whole, toes), time = (phase.stance for phase in rolling(0.5, 0.5).sequence), np.linspace(0.0, 1.0, 201)
    other = replace(next(iter(whole)), effector="right_foot", position=np.array([0.0, -0.2, 0.0]))
    stances = [Stance([other, *held], 2000.0) for held in ((), toes, whole)]
    phases = [Phase(stance, d, d) for stance, d in zip(stances, (0.4, 0.3, 0.3), strict=True)]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.4, 0.7, 1.0])
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[time < 0.7, 3:7] = [0.0, np.sin(0.5 * tilted), 0.0, np.cos(0.5 * tilted)]
    paths = effector_paths(body, schedule, time, q)
    pitch = np.arcsin(-paths.targets["left_foot"].rotation[:, 2, 0])
    bent = paths.toes[body.joint_index("left_toe_extension")]
    assert bent[time.searchsorted(0.4)] == pytest.approx(tilted, abs=1e-6)
    for angle in (bent, pitch):
        assert np.abs(np.diff(angle)).max() < 0.15 * tilted
    assert bent[0] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(pitch[time >= 0.7]).max() < 1e-9


@pytest.mark.parametrize("heights", [(0.0, 0.2), (0.2, 0.0)])
def test_a_foot_flies_above_the_higher_of_the_floors_that_it_goes_between(nod, heights):
    """Level all the time, it is 3 cm above a step of 20 cm from before to after the middle of its flight."""
    body, time = nod.body, np.linspace(0.0, 1.0, 201)
    feet = [
        sole("left_foot", (0.4 * number, 0.0, height), length=0.26, width=0.11, friction=0.8)
        for number, height in enumerate(heights)
    ]
    other = replace(feet[0], effector="right_foot", position=np.array([0.0, -0.2, 0.0]))
    stances = [Stance([other, *held], 2000.0) for held in (feet[:1], (), feet[1:])]
    phases = [Phase(stance, d, d) for stance, d in zip(stances, (0.2, 0.6, 0.2), strict=True)]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.2, 0.8, 1.0])
    paths = effector_paths(body, schedule, time, np.tile(body.standing_posture(), (len(time), 1)))
    height = paths.targets["left_foot"].position[:, 2]
    assert height[[0, -1]] == pytest.approx(heights)
    assert np.all(height[(time > 0.45) & (time < 0.55)] > 0.2 + SWING_HEIGHT - 1e-3)


def test_toes_carry_only_what_they_are_strong_enough_for(walk):
    """A load of 1.4 body weights at the tip of a shortened sole asks for the toes' strength."""
    found, supports = walk
    body = found.body
    schedule = landing_flat(recorded_schedule(smoothed(found), supports, rolling=True), body)
    lever = -body.torque_lower[body.joint_index("left_toe_extension")] / (1.4 * body.mass * GRAVITY)
    for phase in within_toe_strength(schedule, body).sequence:
        for contact in phase.stance:
            ahead = contact.points[:, 0].max() - toe_hinge(body, contact.effector)[0]
            assert ahead == pytest.approx(lever, abs=1e-9)
            if contact.part is SolePart.TOES:
                assert contact.normal_force_cap == pytest.approx(1.4 * body.mass * GRAVITY)


def test_planned_timing_free_double_supports_last_longer(walk):
    """As the thesis found (7.3.1): where polytopes are large the plan waits, and hurries on one foot."""
    found = adapt_recording(*walk, method="timing-free", rolling=False)
    told = found.as_dict()
    counts = np.array([len(held) for held in told["supports"]])
    mine, theirs = np.array(told["phase_durations_s"]), np.array(told["recorded_phase_durations_s"])
    assert np.all(mine[counts == 2] > theirs[counts == 2])
    assert np.all(mine[counts == 1] < theirs[counts == 1])
    compared = compare_with_recording(found).as_dict()
    assert compared["matched_phases"] == len(counts)
    assert compared["margins"]["point_mass"]["min_second"] == pytest.approx(told["min_margin"], abs=1e-9)
    assert compared["com"]["point_mass"]["rms_distance_m"] == pytest.approx(told["com_rms_m"], rel=0.2)


@pytest.mark.long
def test_planned_timing_free_nobody_walks_through_the_floor(recordings_folder):
    """Feet admit a way underground: without bounds of the height this walk found one, 1.2 m below."""
    recording = read_recording(recordings_folder / "grf/btkdata/FunctionalWalk.c3d")
    found = reconstruct(recording)
    supports = supports_of(found, start=recording.start)
    planned = adapt_recording(found, supports, method="timing-free", rolling=False)
    heights = planned.recording.com[:, 2]
    trajectory = planned.com.trajectory
    assert trajectory is not None
    path = trajectory.position(np.linspace(0.0, trajectory.duration, 400))
    assert path[:, 2].min() > heights.min() - HEIGHT_ROOM - 1e-3
    assert path[:, 2].max() < heights.max() + HEIGHT_ROOM + 1e-3
    # Of the five walks the plans are 7 to 13 cm off, root mean square.
    assert planned.as_dict()["com_rms_m"] < 0.15
