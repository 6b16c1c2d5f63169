"""Supports of people whose steps are known, and of recorded ones beside force plates."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human
from manikin.errors import InputError
from manikin.kinematics import PointTargets
from manikin.numerics.spatial import GRAVITY
from manikin.recordings import ForcePlate, Reconstruction, read_recording, reconstruct
from manikin.recordings.supports.body_supports import RecordedSupports, Support, SupportPhase
from manikin.recordings.supports.support_levels import RecordedSole
from manikin.recordings.supports.supports import plate_loads, supports_of, supports_of_points, timing_errors

STAND, SWING = 0.5, 0.45
TOES = np.array([0.25, 0.0, 0.0])


def steps(places, first, rate, end):
    """(n, 3) a foot that stands at each place in turn, and the lift-offs and touch-downs.

    It moves along half a wave of a cosine, over an arc of 10 cm; from lift-off to the next one it takes two
    swings and two double supports.
    """
    time = np.arange(round(end * rate) + 1) / rate
    foot, events = np.tile(places[0], (len(time), 1)), []
    for number, (here, there) in enumerate(pairwise(places)):
        lift = first + number * 2.0 * (SWING + 0.15)
        share = np.clip((time - lift) / SWING, 0.0, 1.0)
        part = (share > 0.0)[:, None]
        way = here + (0.5 - 0.5 * np.cos(np.pi * share))[:, None] * (there - here)
        way[:, 2] += 0.10 * np.sin(np.pi * share) ** 2
        foot = np.where(part, way, foot)
        events.append((lift, lift + SWING))
    return foot, events


def walk(rate, length, rise):
    """Heels and toes of a walk of three steps a foot, each ``rise`` above the one before, and its events."""
    left = [np.array([2 * k * length, 0.1, 2 * k * rise]) for k in range(4)]
    right = [left[0] - [0.0, 0.2, 0.0]]
    right += [np.array([(2 * k + 1) * length, -0.1, (2 * k + 1) * rise]) for k in range(3)]
    end = STAND + 6 * (SWING + 0.15) + STAND
    feet = {
        "left_foot": steps(left, STAND + SWING + 0.15, rate, end),
        "right_foot": steps(right, STAND, rate, end),
    }
    return {name: (foot, foot + TOES) for name, (foot, _) in feet.items()}, {
        n: e for n, (_, e) in feet.items()
    }


@given(
    rate=st.sampled_from([60.0, 100.0, 250.0]),
    length=st.floats(0.3, 0.8),
    rise=st.sampled_from([0.0, 0.17, -0.17]),
    noise=st.floats(0.0, 1e-3),
    seed=st.integers(0, 2**16),
)
def test_steps_are_found_when_and_where_they_are(rate, length, rise, noise, seed):
    soles, events = walk(rate, length, rise)
    rng = np.random.default_rng(seed)
    noisy = {name: tuple(p + noise * rng.normal(size=p.shape) for p in both) for name, both in soles.items()}
    found = supports_of_points(noisy, rate, start=2.0)
    for name, swings in events.items():
        supports = found.of(name)
        assert len(supports) == 4
        for (lift, touch), (before, after) in zip(swings, pairwise(supports), strict=True):
            # A share of the highest speed is reached a little after the foot leaves, and the filter
            # spreads what happens over a tenth of a second.
            assert before.end - 2.0 == pytest.approx(lift, abs=0.06)
            assert after.start - 2.0 == pytest.approx(touch, abs=0.06)
            assert before.end_seen
            assert after.start_seen
        assert not supports[0].start_seen
        assert not supports[-1].end_seen
        for one in supports:
            frame = round((0.5 * (one.start + one.end) - 2.0) * rate)
            np.testing.assert_allclose(one.place, soles[name][0][frame] + 0.5 * TOES, atol=0.02)
    heights = sorted({round(float(p[2]), 2) for heel, _ in soles.values() for p in heel[[0, -1]]})
    assert len(found.surfaces) == (7 if rise else 1)
    assert found.surfaces[0] == pytest.approx(heights[0], abs=5e-3)
    assert found.surfaces[-1] == pytest.approx(heights[-1], abs=5e-3)
    assert found.sequence == ("right_foot", "left_foot") * 3


def test_phases_follow_each_other_from_the_first_instant_to_the_last():
    found = supports_of_points(walk(100.0, 0.6, 0.0)[0], 100.0)
    assert len(found.key_frames) == 14
    assert (found.phases[0].start, found.phases[-1].end) == (found.start, found.end)
    assert all(one.end == next_one.start for one, next_one in pairwise(found.phases))
    both = ("left_foot", "right_foot")
    assert [phase.effectors for phase in found.phases] == [both, both[:1], both, both[1:]] * 3 + [both]


def test_a_foot_is_down_from_its_heel_to_its_toes():
    time = np.arange(201) / 100.0
    heel, toes = np.zeros((201, 3)), np.tile(TOES, (201, 1))
    # Toes come down 0.15 s after the heel at 0.6 s; the heel leaves 0.3 s before the toes at 1.5 s.
    for points, down, up in ((heel, 0.6, 1.2), (toes, 0.75, 1.5)):
        early, late = np.clip(down - time, 0.0, None), np.clip(time - up, 0.0, None)
        points[:, 0] += 3.0 * (late - early)
        points[:, 2] += 0.5 * (late + early)
    still = np.tile([0.0, 0.3, 0.0], (201, 1))
    found = supports_of_points({"left_foot": (heel, toes), "right_foot": (still, still + TOES)}, 100.0)
    (one,) = found.of("left_foot")
    # The filter makes a slope of 0.1 s of each of these sudden stops and starts.
    assert one.start == pytest.approx(0.6, abs=0.06)
    assert one.end == pytest.approx(1.5, abs=0.06)
    assert one.first_contact[0] == pytest.approx(0.0, abs=0.1)
    assert one.last_contact[0] == pytest.approx(0.25, abs=0.1)
    (other,) = found.of("right_foot")
    assert (other.start, other.end, other.start_seen, other.end_seen) == (0.0, 2.0, False, False)


def test_a_foot_put_on_a_step_supports_though_the_other_one_stands():
    lifted, _ = steps([np.array([0.0, 0.1, 0.0]), np.array([0.1, 0.1, 0.25])], 0.5, 100.0, 2.5)
    still = np.tile([0.0, -0.1, 0.0], (len(lifted), 1))
    feet = {"left_foot": (lifted, lifted + TOES), "right_foot": (still, still + TOES)}
    found = supports_of_points(feet, 100.0)
    assert found.surfaces == pytest.approx((0.0, 0.25), abs=5e-3)
    assert [one.place[2] for one in found.of("left_foot")] == pytest.approx([0.0, 0.25], abs=5e-3)
    assert found.phases[-1].effectors == ("left_foot", "right_foot")


def test_a_foot_held_still_in_the_air_supports_nothing():
    places = [np.array([0.0, 0.1, 0.0]), np.array([0.1, 0.1, 0.25])]
    lifted, _ = steps(places, 0.5, 100.0, 2.5)
    still = np.tile([0.0, -0.1, 0.0], (len(lifted), 1))
    hanging = TOES - np.outer(lifted[:, 2], [0.0, 0.0, 0.4])
    feet = {"left_foot": (lifted, lifted + hanging), "right_foot": (still, still + TOES)}
    found = supports_of_points(feet, 100.0)
    assert len(found.surfaces) == 1
    assert [one.end_seen for one in found.of("left_foot")] == [True]
    assert found.phases[-1].effectors == ("right_foot",)


def turning(share, seconds=0.6, rate=100.0):
    """A foot that rises by 60 degrees within a time, about the point at a share of its sole, and stays so."""
    time = np.arange(round(2.5 * rate) + 1) / rate
    angle = np.deg2rad(60.0) * (0.5 - 0.5 * np.cos(np.pi * np.clip((time - 0.8) / seconds, 0.0, 1.0)))
    along = np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=1) * np.linalg.norm(TOES)
    pivot = np.array([0.0, 0.1, 0.0]) + share * TOES
    return pivot - share * along, pivot + (1.0 - share) * along


def test_a_foot_that_rises_to_its_ball_has_not_left_the_ground():
    # Our sole is rigid and not quite where the person's is: toes and heel move, up and down, by 12 cm.
    feet = {"left_foot": turning(0.5), "right_foot": (np.zeros((251, 3)), np.tile(TOES, (251, 1)))}
    (one,) = supports_of_points(feet, 100.0).of("left_foot")
    assert not one.start_seen
    assert not one.end_seen


def test_a_floor_that_drifts_is_one_surface():
    soles, events = walk(100.0, 0.6, 0.018)
    found = supports_of_points(soles, 100.0)
    assert len(found.surfaces) == 1
    assert all(len(found.of(name)) == len(swings) + 1 for name, swings in events.items())


def test_a_support_that_the_recording_cuts_may_be_shorter_than_a_whole_one():
    rate = 100.0
    soles, events = walk(rate, 0.6, 0.0)
    frames = round((events["right_foot"][1][1] + 0.06) * rate)
    found = supports_of_points({n: (h[:frames], t[:frames]) for n, (h, t) in soles.items()}, rate)
    last = found.of("right_foot")[-1]
    assert not last.end_seen
    assert last.start == pytest.approx(events["right_foot"][1][1], abs=0.06)


def test_feet_of_a_run_that_the_filter_never_lets_rest_are_found():
    # Stances of 0.08 s between swings of 3.2 m within 0.5 s, in a sprint.
    rate, period, stance = 120.0, 0.58, 0.08
    time = np.arange(round(2.2 * rate)) / rate
    feet, downs = {}, {}
    for name, shift in (("left_foot", 0.0), ("right_foot", 0.5 * period)):
        cycle, phase = np.divmod(time + shift, period)
        share = np.clip((phase - stance) / (period - stance), 0.0, 1.0)
        heel = np.zeros((len(time), 3))
        heel[:, 0] = 3.2 * (cycle + 0.5 - 0.5 * np.cos(np.pi * share))
        heel[:, 2] = 0.4 * np.sin(np.pi * share) ** 2
        feet[name] = (heel, heel + TOES)
        downs[name] = [down for down in np.arange(1, 5) * period - shift if down < time[-1] - stance]
    found = supports_of_points(feet, rate)
    for name, instants in downs.items():
        starts = [one.start for one in found.of(name) if one.start_seen]
        assert starts[: len(instants)] == pytest.approx(instants, abs=0.06)


@pytest.mark.parametrize(("share", "slowest"), [(0.3, 0.0), (1.0, 0.0), (2.0, 0.25)])
def test_the_slowest_point_of_a_sole_is_nearest_to_what_it_turns_about(share, slowest):
    # At 1 rad/s, about a point on the sole or one sole's length, 0.25 m, before its toes.
    time = np.arange(200) / 100.0
    along = np.stack([np.cos(time), np.zeros(200), -np.sin(time)], axis=1) * np.linalg.norm(TOES)
    sole = RecordedSole.of([way * along for way in (-share, 1.0 - share)], 100.0)
    assert sole.speed[50:150] == pytest.approx(slowest, abs=1e-3)


@pytest.mark.parametrize(
    ("count", "rate", "told"),
    [(3, 100.0, "valid: at least 4"), (50, 10.0, "valid: above 0, below half the rate")],
)
def test_too_little_is_refused_in_one_line(count, rate, told):
    feet = {name: (np.zeros((count, 3)), np.zeros((count, 3))) for name in ("left_foot", "right_foot")}
    with pytest.raises(InputError, match=told) as refused:
        supports_of_points(feet, rate)
    assert "\n" not in str(refused.value)


def plate(loads, rate=1000.0, end=3.0):
    """A plate of a square metre that somebody presses with 700 N in its middle between instants."""
    wrenches = np.zeros((round(end * rate), 6))
    for begin, stop in loads:
        wrenches[round(begin * rate) : round(stop * rate), 2] = 700.0
    corners = [(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)]
    return ForcePlate("plate", wrenches, np.zeros(3), rate, corners=np.array(corners))


def support(name, start, end, heel):
    place = np.array([heel, 0.0, 0.0])
    return Support(name, start, end, place + 0.5 * TOES, place, place + TOES, True, True)


def test_loads_of_a_plate_are_without_blinks():
    loads = list(plate_loads(plate([(0.5, 0.9), (0.91, 1.2), (2.0, 2.05), (2.5, 3.0)])))
    assert [(load.start, load.end) for load in loads] == [(0.5, 1.2), (2.5, pytest.approx(3.0, abs=2e-3))]
    assert [(load.start_seen, load.end_seen) for load in loads] == [(True, True), (True, False)]
    np.testing.assert_allclose(loads[0].first_cop, 0.0, atol=1e-12)


def test_errors_are_those_of_the_foot_on_the_plate():
    seen = (support("left_foot", 0.52, 1.19, 0.0), support("right_foot", 1.1, 1.8, 0.9))
    errors = timing_errors(RecordedSupports(seen, 0.0, 3.0, (0.0,)), [plate([(0.5, 1.2)])])
    assert [(error.effector, error.event) for error in errors] == [
        ("left_foot", "touch-down"), ("left_foot", "lift-off")
    ]  # fmt: skip
    assert [error.error for error in errors] == pytest.approx([0.02, -0.01])


def test_a_heel_beside_the_plate_is_not_compared():
    step = Support(
        "left_foot", 0.3, 1.2, np.zeros(3), np.array([-0.6, 0.0, 0.0]), np.array([0.2, 0.0, 0.0]), True, True
    )
    (error,) = timing_errors(RecordedSupports((step,), 0.0, 3.0, (0.0,)), [plate([(0.5, 1.2)])])
    assert error.event == "lift-off"


def test_a_support_that_ends_before_it_begins_is_refused():
    with pytest.raises(InputError, match="valid: an end behind"):
        support("left_foot", 1.0, 0.9, 0.0)


def test_durations():
    assert support("left_foot", 1.0, 1.5, 0.0).duration == SupportPhase(1.0, 1.5, ()).duration == 0.5


@pytest.mark.parametrize(
    ("file", "compared"),
    [
        ("btkdata/FunctionalWalk", 6),
        ("btkdata/PiG_Motion-FlatFoot-One", 4),
        ("opensim_core/walking2", 3),
        ("opensim_core/walking5", 3),
    ],
)
def test_recorded_supports_are_those_of_the_plates(recordings_folder, file, compared):
    path = recordings_folder / "grf" / f"{file}.c3d"
    if not path.exists():
        pytest.skip(f"{path.name} is not there")
    recording = read_recording(path)
    found = supports_of(reconstruct(recording), start=recording.start)
    errors = [abs(error.error) for error in timing_errors(found, recording.plates)]
    assert len(errors) == compared
    assert np.median(errors) <= 0.030
    assert max(errors) <= 0.050
    assert len(found.surfaces) == 1


def rising(seconds_seated, rate=50.0):
    """A reconstruction of somebody who sits, rises within a second and stands for one; seat-off is known.

    The feet stay: the pelvis goes up and forward while knees and hips stretch.
    """
    body = human(1.75, 75.0)
    thigh, standing = float(np.linalg.norm(body.segment("left_leg").origin)), body.standing_posture()
    time = np.arange(round((seconds_seated + 2.0) * rate) + 1) / rate
    share = np.clip(time - seconds_seated, 0.0, 1.0)
    bend = 0.5 * np.pi * (0.5 + 0.5 * np.cos(np.pi * share))
    q = np.tile(standing, (len(time), 1))
    for side in ("left", "right"):
        hip, knee = body.joint_index(f"{side}_hip_flexion"), body.joint_index(f"{side}_knee_flexion")
        q[:, 7 + hip] += bend
        q[:, 7 + knee] += bend
    q[:, 0] -= thigh * np.sin(bend)
    q[:, 2] -= thigh * (1.0 - np.cos(bend))
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    off = float(time[np.flatnonzero(q[:, 2] > q[0, 2] + 0.04)[0]])
    return Reconstruction(body, time, q, targets, np.zeros((len(time), 1))), off


def test_who_sits_and_rises_has_left_the_seat_then():
    found, off = rising(1.0)
    supports = supports_of(found)
    (seat,) = supports.of("buttocks")
    assert not seat.start_seen
    assert seat.end == pytest.approx(off, abs=0.05)
    assert supports.phases[0].effectors == ("buttocks", "left_foot", "right_foot")
    assert supports.phases[-1].effectors == ("left_foot", "right_foot")


def test_who_stands_does_not_sit():
    found, _ = rising(0.5)
    standing = Reconstruction(
        found.body, found.time, np.tile(found.q[-1], (len(found.time), 1)), found.targets, found.residual
    )
    assert [one.effector for one in supports_of(standing).supports] == ["left_foot", "right_foot"]


def test_nothing_carries_who_is_in_the_air():
    # From a box of 0.5 m down to the floor, and up to where the soles turn round at the height of the box.
    body, rate, box = human(1.75, 75.0), 100.0, 0.5
    fall = np.sqrt(2.0 * box / GRAVITY)
    time = np.arange(round((0.5 + fall + 0.6 + 2.0 * fall + 0.5) * rate)) / rate
    jump = 0.5 + fall + 0.6
    since = np.clip(time - jump, 0.0, 2.0 * fall)
    height = np.clip(box - 0.5 * GRAVITY * np.clip(time - 0.5, 0.0, None) ** 2, 0.0, None)
    height += GRAVITY * fall * since - 0.5 * GRAVITY * since**2
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[:, 2] += height
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    found = supports_of(Reconstruction(body, time, q, targets, np.zeros((len(time), 1))))
    assert len(found.surfaces) == 2
    for name in ("left_foot", "right_foot"):
        assert [(one.start_seen, one.end_seen) for one in found.of(name)] == [
            (False, True), (True, True), (True, False)
        ]  # fmt: skip
    free = [phase for phase in found.phases if not phase.effectors]
    assert [phase.duration for phase in free] == pytest.approx([fall, 2.0 * fall], abs=0.12)


def test_recorded_seat_off_is_when_the_feet_carry_the_weight(recordings_folder):
    path = next(recordings_folder.rglob("STS1.trc"), None)
    if path is None:
        pytest.skip("the sit-to-stands are not there")
    recording = read_recording(path)
    found = supports_of(reconstruct(recording), start=recording.start)
    each = [np.interp(recording.time, plate.time, plate.force[:, 2]) for plate in recording.plates]
    carried = np.sum(each, axis=0)
    ends = [one.end for one in found.of("buttocks") if one.end_seen]
    assert len(ends) == 5
    for end in ends:
        # The chair stands beside the plates: all weight is on them, once the seat has none.
        near = np.abs(recording.time - end) < 0.4
        full = recording.time[near][np.flatnonzero(carried[near] >= 650.0)[0]]
        assert end == pytest.approx(full, abs=0.1)


def test_steps_of_a_recorded_stair_are_found(recordings_folder):
    path = recordings_folder / "cmu_asf_amc" / "14_21.amc"
    if not path.exists():
        pytest.skip("the clip on a stair is not there")
    found = supports_of(reconstruct(read_recording(path)))
    # Three steps of about 0.2 m up and down again, one foot on each in turn.
    assert np.diff(found.surfaces) == pytest.approx([0.21, 0.21, 0.21], abs=0.03)
    assert all(phase.effectors or phase.duration < 0.05 for phase in found.phases)
    assert all(one != other for one, other in pairwise(found.sequence))


@pytest.mark.parametrize("name", ["Male1_A7_Crouch.bvh", "Male1_B25_CrouchToWalk.bvh"])
def test_who_rises_to_the_balls_of_the_feet_stays_on_them(recordings_folder, name):
    path = recordings_folder / "accad_male1_bvh" / name
    if not path.exists():
        pytest.skip("the clip of somebody who crouches is not there")
    found = supports_of(reconstruct(read_recording(path).cut(0, 75)))
    assert found.sequence == ()
    assert len(found.surfaces) == 1


def test_feet_of_a_recorded_run_go_in_turn(recordings_folder):
    path = recordings_folder / "cmu_asf_amc" / "16_45.amc"
    if not path.exists():
        pytest.skip("the clip of a run is not there")
    found = supports_of(reconstruct(read_recording(path)))
    assert [one.effector for one in found.supports] == ["right_foot", "left_foot", "right_foot"]
    assert all(0.1 < one.duration < 0.3 for one in found.supports)
    assert all(before.end < after.start for before, after in pairwise(found.supports))


def test_a_step_of_who_ducks_in_running_is_not_a_shift(recordings_folder):
    path = recordings_folder / "cmu_asf_amc" / "127_32.amc"
    if not path.exists():
        pytest.skip("the clip of a run with a duck is not there")
    found = supports_of(reconstruct(read_recording(path)))
    # All of the left sole moves at 1.5 m/s at 1.83 s; the centre of mass falls at 0.6 g before.
    assert not [one for one in found.of("left_foot") if one.start < 1.83 < one.end]
    assert [one.effector for one in found.supports if one.start > 0.5 and one.start < 2.0] == [
        "right_foot", "left_foot", "right_foot", "left_foot", "right_foot", "left_foot"
    ]  # fmt: skip


def test_a_jump_has_no_support_where_it_is_highest(recordings_folder):
    path = next(recordings_folder.rglob("DJ1.trc"), None)
    if path is None:
        pytest.skip("the drop jump is not there")
    recording = read_recording(path)
    found = supports_of(reconstruct(recording), start=recording.start)
    loads = [list(plate_loads(plate)) for plate in recording.plates]
    off = max(load.end for each in loads for load in each if load.end_seen)
    carried = [np.interp(recording.time, plate.time, plate.force[:, 2]) for plate in recording.plates]
    again = recording.time[(recording.time > off + 0.1) & (np.sum(carried, axis=0) > 20.0)][0]
    assert again - off > 0.3
    # Less what the low-pass spreads events over.
    assert not [one for one in found.supports if off + 0.05 < one.start < again - 0.05]
