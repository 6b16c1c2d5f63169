"""Hands, knees, elbows and the trunk as supports: of bodies told where to be, and of recorded people."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.body import human
from manikin.kinematics import PointTargets
from manikin.kinematics.tracking import follow
from manikin.numerics.signals import lasting, mask_runs, switch
from manikin.recordings import Reconstruction, read_recording, reconstruct, supports_of
from manikin.recordings.supports.body_supports import RecordedSupports, Support
from manikin.recordings.supports.support_levels import effector_places

BODY = human(1.75, 75.0)
RATE = 50.0


def reconstruction(q):
    """A reconstruction of postures, followed exactly."""
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    return Reconstruction(BODY, np.arange(len(q)) / RATE, q, targets, np.zeros((len(q), 1)))


def standing(seconds):
    return np.tile(BODY.standing_posture(), (round(seconds * RATE) + 1, 1))


def passing(speed, begin, end, slide=0.0):
    """Who glides along x for three seconds, the left arm raised, and holds a rail between two instants.

    Before and after, the hand goes along with the body, from a place ahead of it to one behind it. In the
    middle of its hold it slides outward along the rail, within 0.4 s.
    """
    standing_q = standing(3.0)
    time = np.arange(len(standing_q)) / RATE
    names = ("pelvis", "left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh", "left_hand")
    places = effector_places(BODY, standing_q, names).transpose(1, 0, 2).copy()
    places[:, 5, 2] += 0.35
    places[:, 5, 0] += 0.5 * speed * (end - begin) - speed * np.clip(time - begin, 0.0, end - begin) + 0.3
    sliding = np.clip((time - 0.5 * (begin + end)) / 0.4 + 0.5, 0.0, 1.0)
    places[:, 5, 1] += slide * (0.5 - 0.5 * np.cos(np.pi * sliding))
    places[:, :, 0] += speed * time[:, None]
    segments = (*names[:5], "left_hand")
    targets = PointTargets(names, segments, np.zeros((6, 3)), places, np.ones(6))
    q, residual = follow(BODY, targets, standing_q)
    return Reconstruction(BODY, time, q, targets, residual)


@given(st.lists(st.booleans(), max_size=60), st.integers(1, 8))
def test_lasting_runs_are_apart_and_long_and_leave_nothing_long_out(holds, shortest):
    frames = np.array(holds, dtype=bool)
    found = lasting(frames, shortest)
    assert all(stop - first >= shortest for first, stop in found)
    assert all(before[1] + shortest <= after[0] for before, after in pairwise(found))
    for first, stop in mask_runs(frames):
        if stop - first >= shortest:
            assert any(a <= first and stop <= b for a, b in found)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=60))
def test_a_switch_changes_only_where_it_is_told_to(steps):
    closes, opens = (np.array([step[k] for step in steps], dtype=bool) for k in (0, 1))
    states = np.concatenate(([False], switch(closes, opens)))
    for frame, (before, after) in enumerate(pairwise(states)):
        assert after or not closes[frame]
        if after and not before:
            assert closes[frame]
        if before and not after:
            assert opens[frame]


def test_the_supports_of_the_feet_alone():
    place = np.zeros(3)
    both = tuple(Support(name, 0.0, end, place, place, place, False, True)
                 for name, end in (("left_foot", 1.0), ("left_hand", 0.4)))  # fmt: skip
    found = RecordedSupports(both, 0.0, 1.0, (0.0,))
    assert len(found.phases) == 2
    assert [phase.effectors for phase in found.only("left_foot").phases] == [("left_foot",)]


def test_places_are_those_of_effectors_knees_and_segments():
    q = standing(0.1)
    hand, knee, neck = effector_places(BODY, q, ("left_hand", "left_knee", "neck"))
    assert hand.shape == knee.shape == neck.shape == (len(q), 3)
    assert knee[0, 0] > 0.0
    assert knee[0, 2] < hand[0, 2] < neck[0, 2]


@settings(max_examples=8)
@given(st.floats(0.0, 2.0), st.floats(0.0, 2e-3), st.integers(0, 2**16))
def test_hands_that_hang_support_nothing(speed, noise, seed):
    q = standing(2.0)
    q[:, 0] += speed * np.arange(len(q)) / RATE
    q[:, 7:] += noise * np.random.default_rng(seed).normal(size=q[:, 7:].shape)
    found = supports_of(reconstruction(q))
    assert not {one.effector for one in found.supports} & {"left_hand", "right_hand", "left_knee", "pelvis"}


def test_a_hand_on_a_rail_supports_while_the_body_moves_past_it():
    (one,) = supports_of(passing(0.4, 1.0, 2.0)).of("left_hand")
    # The filter makes slopes of a tenth of a second of the sudden stop and start.
    assert one.start == pytest.approx(1.0, abs=0.1)
    assert one.end == pytest.approx(2.0, abs=0.1)
    assert np.linalg.norm(one.last_contact - one.first_contact) < 0.1


def test_a_hand_that_slides_along_its_rail_holds_on_to_it():
    (one,) = supports_of(passing(0.4, 0.8, 2.2, 0.1)).of("left_hand")
    assert one.start == pytest.approx(0.8, abs=0.1)
    assert one.end == pytest.approx(2.2, abs=0.1)


def test_a_hand_that_is_carried_along_supports_nothing():
    assert supports_of(passing(0.4, 1.0, 1.0)).of("left_hand") == ()


def clip(folder, name, frames=None):
    path = next(folder.rglob(name), None)
    if path is None:
        pytest.skip(f"{name} is not there")
    recording = read_recording(path)
    return supports_of(reconstruct(recording.cut(0, frames or len(recording))))


@pytest.fixture(scope="module")
def crawl(recordings_folder):
    return clip(recordings_folder, "Male1_A11_CrawlForward.bvh")


def test_hands_of_who_crawls_go_in_turn_at_the_height_of_the_floor(crawl):
    # He lies until 1.2 s, crawls 3.7 m in four cycles, and lies again from 9 s on.
    crawling = [one for name in ("left_hand", "right_hand") for one in crawl.of(name)
                if 1.5 < one.start < 8.8 and one.duration > 0.4]  # fmt: skip
    crawling.sort(key=lambda one: one.start)
    assert 6 <= len(crawling) <= 9
    assert all(one.effector != other.effector for one, other in pairwise(crawling))
    assert all(-0.05 < one.place[2] < 0.15 for one in crawling)
    ways = [np.linalg.norm((after.place - before.place)[:2]) for before, after in pairwise(crawling)]
    assert min(ways) > 0.2


def test_knees_of_who_crawls_carry_and_nobody_sits(crawl):
    assert crawl.surfaces == pytest.approx((0.0,), abs=0.05)
    assert crawl.of("buttocks") == ()
    for name in ("left_knee", "right_knee"):
        assert 4 <= len([one for one in crawl.of(name) if one.duration > 0.4]) <= 9
    assert all(phase.effectors or phase.duration < 0.2 for phase in crawl.phases)


def test_knees_of_who_crawls_slide_without_being_lifted(crawl):
    # From when the first knee is drawn up, at 1.3 s, until he lies down, each carries once a cycle.
    knees = [one for name in ("left_knee", "right_knee") for one in crawl.of(name) if 1.5 < one.start < 8.3]
    knees.sort(key=lambda one: one.start)
    assert len(knees) == 7
    assert all(one.effector != other.effector for one, other in pairwise(knees))
    assert all(one.end > other.start - 0.05 for one, other in pairwise(knees))


@pytest.mark.parametrize(
    ("name", "held"),
    [
        ("01_09_f3900-4242.amc", {"left_hand": 1.4, "right_hand": 1.4}),
        ("01_13_f140-760.amc", {"left_hand": 4.1, "right_hand": 1.1}),
    ],
)
def test_hands_that_slide_along_a_bar_hold_it_until_the_body_is_below(recordings_folder, name, held):
    # Until then the palms, side by side, are within 5 cm of the height of the bar.
    found = clip(recordings_folder, name)
    for hand, instant in held.items():
        assert any(one.start < instant - 0.4 and one.end > instant for one in found.of(hand))


def test_who_kneels_down_slides_on_the_knees(recordings_folder):
    found = clip(recordings_folder, "Male1_A8_CrouchToLie.bvh")
    for name in ("left_knee", "right_knee"):
        (one,) = found.of(name)
        assert 3.2 < one.start < 3.6
        assert not one.end_seen


def test_who_lies_lies_on_the_trunk_with_hands_and_knees_on_the_floor(recordings_folder):
    found = clip(recordings_folder, "Male1_A9_LieDown.bvh")
    whole = {one.effector for one in found.supports if one.duration > 0.99 * (found.end - found.start)}
    assert {"pelvis", "left_hand", "right_hand", "left_knee", "right_knee"} <= whole
    assert "buttocks" not in whole


def test_who_climbs_a_structure_holds_on_to_it(recordings_folder):
    found = clip(recordings_folder, "01_02_f400-1300.amc")
    hands = [one for one in found.supports if one.effector.endswith("hand")]
    assert len(hands) == 6
    assert all(0.9 < one.place[2] < 1.5 for one in hands)
    # On the ladder at least two of hands and feet hold at any time, and mostly three.
    climbing = [phase for phase in found.phases if phase.start > 0.6 and phase.end < 6.2]
    assert min(len(phase.effectors) for phase in climbing) >= 2
    three = sum(phase.duration for phase in climbing if len(phase.effectors) >= 3)
    assert three > 0.6 * sum(phase.duration for phase in climbing)


def test_who_sits_down_holds_the_stool_and_not_the_own_knees(recordings_folder):
    found = clip(recordings_folder, "14_31_f1-1150.amc", 480)
    (seat,) = found.of("buttocks")
    for name in ("left_hand", "right_hand"):
        (hand,) = found.of(name)
        assert hand.start < seat.start < hand.end < seat.start + 0.5
        assert hand.place[2] == pytest.approx(seat.place[2], abs=0.05)


@pytest.mark.parametrize(
    "name",
    [
        "Male1_B3_Walk.bvh", "Male1_B20_WalkWithBox.bvh", "Male1_A5_PickUpBox.bvh",
        "Male1_C10_RunBackStopRunForward.bvh", "02_01.amc", "127_28.amc",
    ],
)  # fmt: skip
def test_who_walks_runs_or_carries_is_on_the_feet_alone(recordings_folder, name):
    found = clip(recordings_folder, name)
    assert {one.effector for one in found.supports} == {"left_foot", "right_foot"}


def test_steps_of_a_run_over_an_obstacle_are_on_it(recordings_folder):
    found = clip(recordings_folder, "127_33.amc")
    assert len(found.surfaces) == 2
    on_top = [one.effector for one in found.supports if one.place[2] == found.surfaces[1]]
    assert on_top == ["right_foot", "left_foot"]


def test_who_squats_on_the_toes_stays_on_one_floor(recordings_folder):
    found = clip(recordings_folder, "Male1_B24_WalkToCrouch.bvh")
    assert found.surfaces == pytest.approx((0.0,), abs=0.03)
    assert found.phases[-1].effectors == ("left_foot", "right_foot")
    assert found.phases[-1].duration > 2.0


def test_a_hand_of_which_nothing_was_recorded_supports_nothing():
    found = replace(passing(0.4, 1.0, 2.0), neutral=("left_hand",))
    assert supports_of(found).of("left_hand") == ()
