"""A recording elsewhere, and turned, is the same recording."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.analysis import Analysis, analyze
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.recordings import read_recording
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.supports.body_supports import median_place

TURN, PLACE = rotation_from_yaw(np.radians(37.0)), np.array([10.0, -7.0, 0.0])


def moved(recording: MarkerRecording) -> MarkerRecording:
    """Markers and plates turned by 37 deg about the vertical, then moved by (10, -7, 0) m."""
    plates = []
    for plate in recording.plates:
        force, moment = plate.wrenches[:, :3] @ TURN.T, plate.wrenches[:, 3:] @ TURN.T
        corners = None if plate.corners is None else plate.corners @ TURN.T + PLACE
        plates.append(
            replace(
                plate, wrenches=np.hstack([force, moment + np.cross(PLACE, force)]),
                origin=TURN @ plate.origin + PLACE, normal=TURN @ plate.normal, corners=corners,
            )
        )  # fmt: skip
    return replace(recording, positions=recording.positions @ TURN.T + PLACE, plates=tuple(plates))


def back(vectors: FloatArray) -> FloatArray:
    """Free vectors of the moved recording in the axes of the first."""
    return vectors @ TURN


@pytest.fixture(scope="module")
def pair(recordings_folder) -> tuple[Analysis, Analysis]:
    recording = read_recording(recordings_folder / "grf/nimble_opencap_s4/walkingTS1.trc")
    return analyze(recording), analyze(moved(recording))


def test_supports_are_the_same_in_the_moved_frame(pair):
    here, there = pair
    assert len(here.supports.supports) == len(there.supports.supports) > 2
    for one, other in zip(here.supports.supports, there.supports.supports, strict=True):
        assert one.effector == other.effector
        assert (one.start, one.end) == pytest.approx((other.start, other.end), abs=1e-12)
        np.testing.assert_allclose(back(other.place - PLACE), one.place, atol=1e-9)


def test_margins_and_the_shift_are_the_same(pair):
    """To 1e-6 relative; margins pass through zero, so relative to the weight times 1 cm as well."""
    here, there = pair
    for name in ("recorded_margin_Nm", "shifted_margin_Nm", "point_mass_margin_Nm"):
        one, other = here.series()[name], there.series()[name]
        np.testing.assert_allclose(other, one, rtol=1e-6, atol=1e-6 * 0.01 * here.weight)
    assert np.array_equal(here.series()["shifted_at_floor"], there.series()["shifted_at_floor"])
    assert here.measured.shifted is not None
    assert there.measured.shifted is not None
    assert here.measured.shifted.rms > 1e-3
    np.testing.assert_allclose(back(there.measured.shifted.shift), here.measured.shifted.shift, atol=1e-9)
    assert here.limiting is not None
    assert there.limiting is not None
    assert here.limiting.description == there.limiting.description


def test_torques_scores_and_plates_say_the_same(pair):
    here, there = pair
    np.testing.assert_allclose(there.motion.tau[:, 6:], here.motion.tau[:, 6:], atol=1e-5)
    np.testing.assert_allclose(
        back(there.motion.contact_force[..., :3]), here.motion.contact_force[..., :3], atol=1e-4
    )
    one, other = (analysis.as_dict() for analysis in pair)
    assert one["ergonomics"]["rula"] == other["ergonomics"]["rula"]
    for key in ("cop_rms_recorded_m", "cop_rms_shifted_m", "vertical_rms_body_weight", "timing_median_s"):
        assert other["force_plates"][key] == pytest.approx(one["force_plates"][key], rel=1e-6)


def test_a_median_place_turns_with_the_places():
    rng = np.random.default_rng(3)
    places = rng.normal(size=(41, 3)) * (0.02, 0.05, 0.01)
    places[:5] += 0.3  # outliers hardly matter
    turned = places @ TURN.T + PLACE
    np.testing.assert_allclose(back(median_place(turned) - PLACE), median_place(places), atol=1e-12)
    assert np.linalg.norm(median_place(places)[:2]) < 0.03 < np.linalg.norm(places.mean(axis=0)[:2])
    # No other place on the level has a smaller sum of distances.
    found = median_place(places)[:2]

    def distances(place):
        return np.linalg.norm(places[:, :2] - place, axis=1).sum()

    for way in rng.normal(size=(20, 2)):
        assert distances(found) < distances(found + 1e-3 * way) + 1e-6
