"""Recordings of markers: gaps and their filling, windows, force plates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.numerics.spatial import wrench_about
from manikin.recordings import Event, ForcePlate, MarkerRecording, read_c3d
from manikin.recordings.readers.markers import unique_names
from manikin.recordings.readers.text_files import UP_TO_Z, metres_per, rotation_to_z_up

RATE = 100.0


def swinging(frames=200):
    """A foot's frequency and reach: 1 Hz, 0.4 m to and fro, beside a marker at rest."""
    time = np.arange(frames) / RATE
    foot = np.column_stack([0.4 * np.sin(2 * np.pi * time), np.zeros(frames), 0.1 + 0.0 * time])
    return np.stack([foot, np.full((frames, 3), 1.0)], axis=1)


def with_gaps(positions, *gaps):
    found = np.array(positions)
    for first, stop in gaps:
        found[first:stop, 0] = np.nan
    return MarkerRecording("made up", ("TOE", "C7"), found, RATE)


def test_short_gaps_are_filled_and_the_others_reported():
    """Of 5, 30 and, at both ends, 3 and 2 frames, only the first is short and inside."""
    whole = swinging()
    found = with_gaps(whole, (0, 3), (40, 45), (100, 130), (198, 200))
    assert [(g.marker, g.first, len(g)) for g in found.gaps] == [
        ("TOE", 0, 3), ("TOE", 40, 5), ("TOE", 100, 30), ("TOE", 198, 2),
    ]  # fmt: skip
    filled = found.with_gaps_filled(0.1)
    assert [g.first for g in filled.gaps] == [0, 100, 198]
    # The error of a cubic spline over 0.06 s of 0.4 m at 1 Hz: 5/384 h^4 w^4 0.4 = 0.1 mm.
    np.testing.assert_allclose(filled.positions[40:45, 0], whole[40:45, 0], atol=1e-4)
    kept = found.seen
    np.testing.assert_array_equal(filled.positions[kept], found.positions[kept])
    assert found.with_gaps_filled(0.0).gaps == found.gaps


def test_a_marker_seen_only_for_a_moment_is_not_made_up():
    found = with_gaps(swinging(20), (0, 5), (6, 10), (11, 20))
    assert not np.any(found.with_gaps_filled(1.0).seen[[0, 8, 15], 0])


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(0, 20))
def test_filling_changes_nothing_that_was_seen(seen, longest):
    """Whatever was seen stays; what is left of the gaps is long, at an end or beside too few frames."""
    seen = np.array(seen)
    positions = np.where(seen[:, None, None], swinging(len(seen)), np.nan)
    found = MarkerRecording("made up", ("TOE", "C7"), positions, RATE)
    filled = found.with_gaps_filled(longest / RATE)
    np.testing.assert_array_equal(filled.positions[seen], found.positions[seen])
    for gap in filled.gaps:
        few = min(seen[: gap.first].sum(), seen[gap.stop :].sum()) < 2
        assert len(gap) > longest or few


def test_gaps_cut_into_a_real_recording_are_filled_to_a_centimetre(recordings_folder):
    """0.1 s of every foot marker of a walk, wherever it was seen long enough: the rule's own limit."""
    file = recordings_folder / "grf" / "btkdata" / "PiG_Motion-FlatFoot-One.c3d"
    found = read_c3d(file).chosen(["LHEE", "LTOE", "RHEE", "RTOE"])
    for first in range(20, 230, 30):
        cut = np.array(found.positions)
        cut[first : first + 10] = np.nan
        filled = MarkerRecording("cut", found.marker_names, cut, found.rate).with_gaps_filled()
        apart = np.linalg.norm(filled.positions - found.positions, axis=2)
        assert np.nanmax(apart) < 0.01


def test_a_window_has_its_plates_and_events():
    """Frames 10 to 30 of a recording that begins at 2 s, of a plate with ten samples per frame."""
    plate = ForcePlate("plate", np.arange(6 * 400, dtype=float).reshape(400, 6), np.zeros(3), 1000.0, 2.0)
    events = (Event("late", "", 2.35), Event("early", "", 2.05), Event("inside", "Left", 2.2))
    found = MarkerRecording("made up", ("TOE", "C7"), swinging(40), RATE, 2.0, (plate,), events)
    assert [event.label for event in found.events] == ["early", "inside", "late"]
    part = found.cut(10, 30)
    assert part.start == pytest.approx(2.1)
    assert part.duration == pytest.approx(0.19)
    np.testing.assert_allclose(part.time, found.time[10:30])
    np.testing.assert_array_equal(part.plates[0].wrenches, plate.wrenches[100:300])
    np.testing.assert_allclose(part.plates[0].time, plate.time[100:300])
    assert [event.label for event in part.events] == ["inside"]
    with pytest.raises(InputError, match="at least one"):
        found.cut(30, 30)


@given(st.integers(0, 10**6))
def test_centre_of_pressure_of_any_surface(seed):
    """A force at a point of a sloping surface with a free moment about its normal: the point comes back."""
    rng = np.random.default_rng(seed)
    normal = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    origin, (a, b) = rng.uniform(-2, 2, 3), rng.uniform(-0.5, 0.5, 2)
    side = np.cross(normal, [1.0, 0.0, 0.0])
    point = origin + a * side + b * np.cross(normal, side)
    force = rng.uniform([-50, -50, 600], [50, 50, 800], (1, 3))
    wrench = wrench_about(np.hstack([force, rng.uniform(-20, 20) * normal[None]]), -point)
    plate = ForcePlate("plate", np.vstack([wrench, np.zeros((1, 6))]), origin, 1000.0, normal=normal)
    np.testing.assert_allclose(plate.cop[0], point, atol=1e-9)
    assert np.all(np.isnan(plate.cop[1]))  # nobody stands there


def test_axes_and_units():
    """Each table entry is a rotation that takes its axis to z; units are those of everyday."""
    for axis, rows in UP_TO_Z.items():
        rotation = rotation_to_z_up(axis.upper(), "here")
        np.testing.assert_allclose(rotation, rows)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == pytest.approx(1.0)
        along = (1.0 if axis[0] == "+" else -1.0) * np.eye(3)["xyz".index(axis[1])]
        np.testing.assert_allclose(rotation @ along, [0.0, 0.0, 1.0])
    assert metres_per(" MM ", "here") == 0.001
    with pytest.raises(InputError, match="points up is 'w'"):
        rotation_to_z_up("w", "here")


def test_names_are_made_unique():
    assert unique_names(["RKNE", "", "RKNE", "RKNE_2", ""]) == (
        "RKNE", "marker_2", "RKNE_3", "RKNE_2", "marker_5",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"marker_names": ("TOE", "TOE")}, "twice"),
        ({"marker_names": ("TOE",)}, "shape"),
        ({"positions": np.zeros((0, 2, 3))}, "at least one frame"),
        ({"positions": np.full((3, 2, 3), np.inf)}, "infinite"),
        ({"rate": 0.0}, "rate"),
        ({"start": np.nan}, "start"),
    ],
)
def test_what_is_no_recording_is_refused(change, message):
    given_values = {"name": "x", "marker_names": ("TOE", "C7"), "positions": swinging(3), "rate": RATE}
    with pytest.raises(InputError, match=message):
        MarkerRecording(**(given_values | change))


def test_a_marker_that_is_not_there_is_named():
    found = with_gaps(swinging(3))
    np.testing.assert_array_equal(found.chosen(["C7"]).positions, found.positions[:, 1:])
    with pytest.raises(InputError, match="no marker 'HEEL'; valid: TOE, C7"):
        found.marker("HEEL")
