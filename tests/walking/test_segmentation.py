"""Holonomic and nonholonomic segments of made-up walks, of optimal ones and of recorded ones."""

import csv
import itertools
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.recordings import Recording, read_recording
from manikin.walking import (
    HOLONOMIC,
    KINDS,
    NONHOLONOMIC,
    STANDING,
    START,
    SegmentationRule,
    ShoulderPaths,
    segment_path,
    walking_path,
)

RATE = 100.0
DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
FUNCTION_1 = SegmentationRule(cutoff=None, noise=0.0, boundary=None)


def shoulders(place, heading, half=0.18, rate=RATE):
    """Shoulders of a stiff walker at (n, 2) places [m] and (n,) headings [rad]."""
    left = half * np.column_stack([-np.sin(heading), np.cos(heading)])
    return ShoulderPaths(place + left, place - left, rate)


def moved(speed, aside, heading=0.3, duration=1.0):
    """A walker that goes at angles ``aside`` [rad] from a constant heading."""
    n = round(duration * RATE) + 1
    angle = heading + np.broadcast_to(aside, (n,))
    step = np.column_stack([np.cos(angle), np.sin(angle)]) * (np.broadcast_to(speed, (n,)) / RATE)[:, None]
    return shoulders(np.cumsum(step, axis=0), np.full(n, heading))


def test_a_straight_walk_is_one_nonholonomic_segment():
    found = segment_path(moved(1.2, 0.0))
    assert [(s.kind, s.start, s.end) for s in found.segments] == [(NONHOLONOMIC, 0.0, 1.0)]
    assert np.allclose(found.deviations, 0.0, atol=1e-9)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_sidestep_deviates_by_a_quarter_turn(side):
    found = segment_path(moved(0.8, side * np.pi / 2))
    assert found.share(HOLONOMIC) == 1.0
    assert np.allclose(found.deviations, -side * np.pi / 2)


def test_going_back_is_holonomic():
    """The tangent is a direction, not a line: the arctangent of two arguments."""
    assert segment_path(moved(0.8, np.pi)).share(HOLONOMIC) == 1.0


@pytest.mark.parametrize("online", [True, False])
@pytest.mark.parametrize(("angle", "kind"), [(14.0, NONHOLONOMIC), (16.0, HOLONOMIC), (-16.0, HOLONOMIC)])
def test_the_tolerance_is_fifteen_degrees(angle, kind, online):
    assert segment_path(moved(1.0, np.radians(angle)), online=online).share(kind) == 1.0


@pytest.mark.parametrize("radius", [0.1, 1.0, -2.0])
def test_a_circle_along_its_tangent_is_nonholonomic(radius):
    """Both shoulders go along the heading; on a circle narrower than the shoulders, the outer one only."""
    turned = np.linspace(0.0, 2 * np.pi, 300) * np.sign(radius)
    place = radius * np.column_stack([np.sin(turned), 1.0 - np.cos(turned)])
    found = segment_path(shoulders(place, turned))
    assert found.share(NONHOLONOMIC) == 1.0
    inner = np.abs(found.deviations[5:-5, 0 if radius > 0 else 1])
    assert np.allclose(inner, np.pi if abs(radius) < 0.18 else 0.0, atol=0.02)


@pytest.mark.parametrize("turn", [-2.0, 2.0])
def test_on_the_spot_one_shoulder_goes_ahead_and_one_back(turn):
    """Figure 4.3 (d); the frame is nonholonomic by the shoulder that goes ahead."""
    heading = turn * np.arange(150) / RATE
    found = segment_path(shoulders(np.zeros((150, 2)), heading), online=True)
    ahead, back = (1, 0) if turn > 0 else (0, 1)
    assert found.share(NONHOLONOMIC) == 1.0
    # The first and the last tangents are one-sided, half a frame's turn off.
    assert np.abs(found.deviations[:, ahead]).max() <= 0.01 + 1e-6
    assert np.abs(found.deviations[:, back]).min() >= np.pi - 0.01 - 1e-6


@pytest.mark.parametrize(("share", "kind"), [(0.97, NONHOLONOMIC), (1.03, HOLONOMIC)])
def test_a_turn_that_drifts_aside_is_holonomic_beyond_a_speed(share, kind):
    """The foremost shoulder goes at ``omega b`` ahead: drifting at ``tan(15 deg) omega b`` is the border."""
    half, omega, n = 0.18, 2.0, 150
    heading = omega * np.arange(n) / RATE
    drift = share * np.tan(np.radians(15.0)) * omega * half
    # The velocity of this is to the left.
    middle = np.column_stack([np.cos(heading), np.sin(heading)]) * drift / omega
    labels = segment_path(shoulders(middle, heading, half)).labels
    # The first and the last tangents are one-sided.
    assert np.all(labels[1:-1] == kind)


def test_who_does_not_move_stands():
    still = segment_path(shoulders(np.zeros((50, 2)), np.zeros(50)))
    assert still.share(STANDING) == 1.0
    assert np.all(np.isnan(still.deviations))
    # Without a standing speed, no direction is no nonholonomic one either.
    never = segment_path(shoulders(np.zeros((50, 2)), np.zeros(50)), SegmentationRule(standing_speed=0.0))
    assert never.share(NONHOLONOMIC) == 0.0


def disturbed(angle, duration):
    """A straight walk that goes aside for a while, and the frames of that while."""
    aside = np.zeros(301)
    aside[150 : 150 + round(duration * RATE)] = np.radians(angle)
    return moved(1.2, aside, duration=3.0)


@pytest.mark.parametrize(("angle", "duration"), [(25.0, 0.05), (40.0, 0.03), (-30.0, 0.08)])
def test_short_flat_noise_is_removed_off_line_only(angle, duration):
    paths = disturbed(angle, duration)
    assert segment_path(paths, online=True).share(HOLONOMIC) > 0.0
    assert segment_path(paths).share(NONHOLONOMIC) == 1.0


@pytest.mark.parametrize(("angle", "duration"), [(25.0, 0.5), (85.0, 0.16), (-60.0, 0.3)])
def test_long_or_strong_deviations_are_no_noise(angle, duration):
    """Longer than ``noise``, or too large to vanish in the low-pass."""
    found = segment_path(disturbed(angle, duration))
    assert [s.kind for s in found.segments] == [NONHOLONOMIC, HOLONOMIC, NONHOLONOMIC]


def test_noise_of_the_markers_below_and_above_what_matters():
    """0.3 mm turn the tangent at 1.2 m/s by one degree (standard deviation), 6 mm by twenty."""
    rng, clean = np.random.default_rng(4), moved(1.2, 0.0, duration=3.0)
    shares = {}
    for size in (0.0003, 0.006):
        left, right = (p + rng.normal(0.0, size, p.shape) for p in (clean.left, clean.right))
        noisy = ShoulderPaths(left, right, RATE)
        shares[size] = [segment_path(noisy, online=online).share(HOLONOMIC) for online in (True, False)]
    assert shares[0.0003] == [0.0, 0.0]
    assert shares[0.006][1] < 0.5 * shares[0.006][0]


def rest_to_rest(aside, turned=0.0, length=0.45, half=0.18):
    """Standing, a way at an angle to the first heading, and standing [rad]; 1 s for each step of 0.6 m."""
    n = 100 + max(100, round(length / 0.6 * RATE))
    share = np.clip((np.arange(n) - 50) / (n - 100), 0.0, 1.0)
    share = share**2 * (3 - 2 * share)
    place = length * share[:, None] * [np.cos(aside), np.sin(aside)]
    return shoulders(place, turned * share, half)


@pytest.mark.parametrize(
    ("aside", "turned", "kind"),
    [(0.0, 0.0, NONHOLONOMIC), (10.0, 0.0, HOLONOMIC), (-10.0, 0.5, HOLONOMIC), (10.0, 12.0, NONHOLONOMIC)],
)
def test_flat_diagonal_steps_are_told_from_straight_steps(aside, turned, kind):
    """Same heading at both ends but a way oblique to it ([Truong2010]_ 4.2.2.2, figure 4.8)."""
    walk = rest_to_rest(np.radians(aside), np.radians(turned))
    assert [s.kind for s in segment_path(walk).segments] == [STANDING, kind, STANDING]
    plain = segment_path(walk, SegmentationRule(boundary=None))
    assert [s.kind for s in plain.segments] == [STANDING, NONHOLONOMIC, STANDING]


@pytest.mark.parametrize("length", [1.5, 8.5])
@pytest.mark.parametrize(
    ("aside", "kind"),
    [(0.0, NONHOLONOMIC), (2.0, NONHOLONOMIC), (-9.0, NONHOLONOMIC), (13.0, NONHOLONOMIC),
     (17.0, HOLONOMIC), (-45.0, HOLONOMIC), (90.0, HOLONOMIC)],
)  # fmt: skip
def test_a_walk_of_several_steps_is_what_it_is_on_the_way(length, aside, kind):
    """Straight, drifting, diagonal and sidewards, one heading throughout: Function 1 and its 15 degrees."""
    found = segment_path(rest_to_rest(np.radians(aside), length=length))
    assert [s.kind for s in found.segments] == [STANDING, kind, STANDING]


def test_a_long_walk_that_ends_with_its_first_heading_is_no_diagonal_step():
    """8.5 m to a goal 20 degrees aside: it turns there and back, and drifts by 9 degrees at most."""
    walk = shoulders(*turned_there_and_back(np.radians(20.0), np.radians(9.0)))
    found = segment_path(walk)
    moving = found.labels != STANDING
    assert np.degrees(np.nanmax(np.abs(found.deviations[moving]))) < 9.5
    assert found.share(HOLONOMIC) == 0.0
    assert found.pattern == "N"


def turned_there_and_back(bearing, drift):
    """(n, 2) places and (n,) headings of a straight walk at a bearing whose heading lags by the drift."""
    n = 1000
    share = np.clip((np.arange(n) - 50) / (n - 100), 0.0, 1.0)
    share = share**2 * (3 - 2 * share)
    heading = (bearing - drift * np.cos(2.0 * np.pi * share)) * np.sin(np.pi * np.clip(share, 0.0, 1.0))
    course = heading + drift * np.cos(2.0 * np.pi * share)
    step = np.gradient(8.5 * share)
    place = np.cumsum(step[:, None] * np.column_stack([np.cos(course), np.sin(course)]), axis=0)
    return place, heading


def test_patterns_name_the_moving_parts():
    """Standing between two parts of one kind does not part them."""
    assert segment_path(rest_to_rest(np.radians(10.0), 0.0)).pattern == "H"
    aside = np.radians(np.repeat([60.0, 10.0, 60.0], [50, 51, 50]))
    assert segment_path(moved(1.0, aside, duration=1.5)).pattern == "H-N-H"
    there = moved(1.0, np.radians(60.0))
    rest = [np.repeat(side[-1:], 50, axis=0) for side in (there.left, there.right)]
    on = [side + side[-1] - side[0] for side in (there.left, there.right)]
    paused = ShoulderPaths(
        np.vstack([there.left, rest[0], on[0]]), np.vstack([there.right, rest[1], on[1]]), RATE
    )
    found = segment_path(paused)
    assert STANDING in [one.kind for one in found.segments]
    assert found.pattern == "H"


@pytest.mark.parametrize(
    ("degrees", "either"), [(180.0, NONHOLONOMIC), (170.0, NONHOLONOMIC), (160.0, HOLONOMIC)]
)
def test_backward_counts_as_ahead_only_where_the_rule_says_so(degrees, either):
    paths = moved(1.0, np.radians(degrees))
    assert segment_path(paths).share(HOLONOMIC) == 1.0
    assert segment_path(paths, SegmentationRule(either_way=True)).share(either) == 1.0


def test_walks_that_do_not_begin_at_rest_have_no_boundary():
    assert segment_path(moved(1.0, np.radians(10.0))).share(NONHOLONOMIC) == 1.0


def test_between_holonomic_parts_there_is_no_boundary():
    """Only what lies between two rests is asked whether it keeps its heading."""
    aside = np.radians(np.repeat([60.0, 10.0, 60.0], [50, 51, 50]))
    found = segment_path(moved(1.0, aside, duration=1.5))
    assert [s.kind for s in found.segments] == [HOLONOMIC, NONHOLONOMIC, HOLONOMIC]


wandering = st.builds(
    lambda seed, n, rate: _wander(seed, n, rate),
    st.integers(0, 10**6), st.integers(3, 120), st.sampled_from([30.0, 100.0, 120.0]),
)  # fmt: skip


def _wander(seed, n, rate):
    rng = np.random.default_rng(seed)
    speed = np.cumsum(rng.normal(0.0, 0.1, (n, 2)), axis=0)
    speed[:, 0] += rng.uniform(0.0, 1.0)
    turning = np.cumsum(rng.normal(0.0, 0.3, n))
    return shoulders(np.cumsum(speed, axis=0) / rate, np.cumsum(turning) / rate, rate=rate)


@given(wandering, st.sampled_from([0.0, 0.01, 0.05, 0.3]))
def test_on_line_labels_are_those_of_function_1(paths, half_step):
    online = segment_path(paths, SegmentationRule(half_step=half_step), online=True).labels
    off = SegmentationRule(half_step=half_step, cutoff=None, noise=0.0, boundary=None)
    assert online.tolist() == segment_path(paths, off).labels.tolist()


@given(wandering)
def test_segments_tile_the_walk(paths):
    found = segment_path(paths)
    segments = found.segments
    assert segments[0].start == 0.0
    assert segments[-1].end == paths.time[-1]
    for before, after in itertools.pairwise(segments):
        assert before.end == after.start
        assert before.kind != after.kind
    for segment in segments:
        inside = (paths.time >= segment.start) & (paths.time < segment.end)
        assert np.all(found.labels[inside] == segment.kind)
    assert sum(found.share(kind) for kind in KINDS) == pytest.approx(1.0)


@given(wandering, st.floats(-3.0, 3.0), st.floats(-5.0, 5.0))
def test_deviations_do_not_depend_on_place_and_change_sign_in_the_mirror(paths, turn, shift):
    turning = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    elsewhere = ShoulderPaths(paths.left @ turning.T + shift, paths.right @ turning.T + shift, paths.rate)
    mirrored = ShoulderPaths(paths.right * [1, -1], paths.left * [1, -1], paths.rate)
    first, second, third = (
        np.exp(1j * segment_path(p, FUNCTION_1).deviations) for p in (paths, elsewhere, mirrored)
    )
    # Slow frames give directions of few digits.
    fast = np.linalg.norm(paths.velocities(), axis=2) > 1e-3
    assert np.allclose(first[fast], second[fast], atol=1e-6)
    assert np.allclose(first[fast], np.conj(third[:, ::-1])[fast], atol=1e-6)


def test_a_step_of_half_a_metre_to_the_side_is_holonomic():
    """[Truong2010]_ 4.6, on the optimal path of chapter 5."""
    found = segment_path(ShoulderPaths.of_walk(walking_path(START, (0.5, 0.0, np.pi / 2))))
    assert {s.kind for s in found.segments} - {STANDING} == {HOLONOMIC}


def test_shoulders_of_a_recording_are_its_upper_arms():
    names = ("root", "lhumerus", "rhumerus")
    recording = Recording(
        "by hand", names, np.array([-1, 0, 0]), np.array([[0, 0, 0], [0, 0.2, 0.5], [0, -0.2, 0.5]]), {},
        np.broadcast_to(np.eye(3), (4, 3, 3, 3)), np.column_stack([np.arange(4), np.zeros((4, 2))]), 60.0,
    )  # fmt: skip
    paths = ShoulderPaths.of_recording(recording)
    assert np.allclose(paths.left, np.column_stack([np.arange(4), np.full(4, 0.2)]))
    assert np.allclose(paths.right, np.column_stack([np.arange(4), np.full(4, -0.2)]))
    assert np.allclose(paths.heading, 0.0)
    assert paths.rate == 60.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ShoulderPaths(np.zeros((5, 2)), np.ones((4, 2)), RATE), "shape"),
        (lambda: ShoulderPaths(np.zeros((2, 2)), np.ones((2, 2)), RATE), "at least 3"),
        (lambda: ShoulderPaths(np.zeros((5, 2)), np.zeros((5, 2)), RATE), "meet at frame 0"),
        (lambda: ShoulderPaths(np.full((5, 2), np.nan), np.zeros((5, 2)), RATE), "finite"),
        (lambda: ShoulderPaths(np.zeros((5, 2)), np.ones((5, 2)), 0.0), "rate"),
        (lambda: SegmentationRule(tolerance=-0.1), "tolerance"),
        (lambda: SegmentationRule(cutoff=1.0), "cutoff"),
        (lambda: SegmentationRule(noise=-1.0), "noise"),
        (lambda: SegmentationRule(boundary=0.0), "boundary"),
        (lambda: segment_path(moved(1.0, 0.0)).share("sideways"), "holonomic"),
    ],
)
def test_bad_input_is_refused_in_one_line(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


EXPECTED = {
    "walk straight": NONHOLONOMIC,
    "walk veer": NONHOLONOMIC,
    "turn on spot (1 s core)": NONHOLONOMIC,
    "sidestep core": HOLONOMIC,
    "diagonal back-right": HOLONOMIC,
}


@cache
def recorded(file):
    return ShoulderPaths.of_recording(read_recording(DATA / "mocap" / file))


@pytest.mark.parametrize("online", [True, False])
def test_recorded_walks_agree_with_what_they_are_called(online):
    """On nine frames of ten, and in each class but turns on the spot, where the people drift."""
    table = DATA / "clips_locomotion.csv"
    if not table.is_file():
        pytest.skip("the real recordings are not beside this repository")
    agreed = {name: [] for name in EXPECTED}
    with table.open(newline="") as rows:
        for row in csv.DictReader(rows):
            if row["class"] in EXPECTED:
                labels = segment_path(recorded(row["file"]), online=online).labels
                window = labels[int(row["first_frame0"]) : int(row["end_frame0"])]
                agreed[row["class"]].extend(window == EXPECTED[row["class"]])
    assert np.mean(np.concatenate(list(agreed.values()))) >= 0.9
    for name in set(EXPECTED) - {"turn on spot (1 s core)"}:
        assert np.mean(agreed[name]) >= 0.95, name
