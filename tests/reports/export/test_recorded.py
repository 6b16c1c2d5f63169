"""Motions as recordings: TRC, MOT and C3D files read back by the readers of recordings."""

import numpy as np
import pytest

from manikin.body import Configuration, human, quadruped
from manikin.errors import InputError
from manikin.recordings.readers import read_recording
from manikin.recordings.readers.marker_sets import marker_set
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.reconstruction.marker_reconstruction import centres_of_markers
from manikin.recordings.virtual_markers import marker_paths, virtual_markers
from manikin.reports.export import export_motion, resample
from manikin.reports.formats.recorded import contact_events, contact_loads

RATE = 20.0


@pytest.fixture(scope="module", params=["trc", "c3d"])
def again(request, finished_run, tmp_path_factory):
    """A recording that was a motion, and that motion."""
    folder = tmp_path_factory.mktemp("recorded")
    path = export_motion(finished_run, folder, request.param, rate=RATE)
    return read_recording(path), resample(finished_run.executed, RATE)


def test_markers_come_back(again, finished_run):
    recording, motion = again
    markers = virtual_markers(finished_run.body)
    assert recording.marker_names == tuple(marker.name for marker in markers)
    assert recording.rate == pytest.approx(RATE)
    wanted = marker_paths(finished_run.body, markers, motion.q)
    # C3D has single precision of millimetres, TRC six decimals: 0.1 mm is what is promised.
    np.testing.assert_allclose(recording.positions, wanted, atol=1e-6)
    assert recording.remarks == ()


def test_forces_come_back(again, finished_run):
    recording, motion = again
    loads = contact_loads(finished_run.body, motion)
    assert len(recording.plates) == len(loads) == 2
    for plate, (force, place, moment) in zip(recording.plates, loads.values(), strict=True):
        # Of some 700 N, single precision of the C3D file.
        np.testing.assert_allclose(plate.force, force, atol=1e-3)
        np.testing.assert_allclose(plate.wrenches[:, 3:], moment + np.cross(place, force), atol=1e-2)


def test_events_come_back(again):
    recording, motion = again
    if not recording.events:  # TRC has no place for them
        assert recording.name.endswith(".trc")
        return
    told = [(event.label, event.context, event.time) for event in recording.events]
    wanted = contact_events(motion)
    assert len(told) == len(wanted) > 0
    assert [item[:2] for item in told] == [item[:2] for item in wanted]
    np.testing.assert_allclose([item[2] for item in told], [item[2] for item in wanted], atol=1e-5)


def test_every_marker_is_known_by_its_name_and_on_its_segment():
    body = human(1.6, 60.0, "female")
    markers = virtual_markers(body)
    q = body.standing_posture()[None]
    recording = MarkerRecording("a", tuple(m.name for m in markers), marker_paths(body, markers, q), 100.0)
    found = marker_set(recording)
    assert found.others == ()
    assert dict(found.segments) == {m.name: m.segment for m in markers} | {
        # Markers between two segments are known as those of the one whose end they mark.
        name: found.segments[name] for name in ("LANK", "RANK", "LANKM", "RANKM")
    }  # fmt: skip


@pytest.mark.parametrize("stature", [1.55, 1.9])
def test_joint_centres_follow_from_the_markers(stature):
    """Hips, knees, ankles, shoulders, elbows and wrists are where the reconstruction finds them."""
    body = human(stature, 25.0 * stature**2)
    markers, q = virtual_markers(body), body.standing_posture()[None]
    recording = MarkerRecording("a", tuple(m.name for m in markers), marker_paths(body, markers, q), 100.0)
    centres = centres_of_markers(recording)
    state = Configuration(body, q[0])
    for side in ("left", "right"):
        for part in ("thigh", "leg", "foot", "hand", "forearm"):
            name = f"{side}_{part}"
            np.testing.assert_allclose(
                centres[name][0], state.segment_placement(name)[1], atol=1e-4, err_msg=name
            )
        # The acromion is above the shoulder as seen from the pelvis, not quite along the thorax.
        name = f"{side}_upper_arm"
        assert np.linalg.norm(centres[name][0] - state.segment_placement(name)[1]) < 0.01


def test_creatures_have_no_landmarks():
    with pytest.raises(InputError, match="valid: a human"):
        virtual_markers(quadruped())
