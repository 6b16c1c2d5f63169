"""Objects that are taken up are drawn where they are: with the hands, and where they were put down."""

import base64
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manikin.pipeline.run_directory import RunRecord
from manikin.reports.player import player_data
from manikin.reports.taken_objects import object_places, scene_at
from manikin.scene import Box, Obstacle, Scene

BEFORE, BEGUN, LET_GO = (0.5, 0.1, 0.9), 1.0, 3.0


@pytest.fixture(scope="module")
def carried(finished_run):
    """A box that is in the hands from 1 to 3 s, and then stays, and where it is put down."""
    motion = finished_run.planned
    first, last = np.searchsorted(motion.time, (BEGUN, LET_GO))
    # The made-up motion moves the pelvis and turns it by nothing: hands go as far as it does.
    after = np.add(BEFORE, motion.q[last, :3] - motion.q[first, :3])
    rest = [{"name": "box", "mass_kg": 5.0, "position": list(BEFORE), "yaw_deg": 0.0}]
    down = [{"name": "box", "mass_kg": 5.0, "position": after.tolist(), "yaw_deg": 0.0}]
    ends = (("grasp", 0.0, BEGUN, rest), ("place", BEGUN, 4.0, down), ("sit", 4.0, 5.0, down))
    listed = [
        {"operation": name, "start_s": start, "end_s": end, "objects": objects}
        for name, start, end, objects in ends
    ]
    scene = Scene([Obstacle("box", Box((0.2, 0.2, 0.2)), translation=BEFORE)])
    content = replace(finished_run, scene=scene)
    return RunRecord("fetch", content, {"operations": {"list": listed}}), motion, after


def test_what_is_carried_goes_with_the_hands_and_stays_where_it_is_put(carried):
    """Hands and pelvis move alike here; between two of the 60 instants looked at they go less than 5 mm."""
    record, motion, after = carried
    samples = np.searchsorted(motion.time, (0.5, 2.0, 3.5, 4.1))
    places = object_places(record, motion, samples)["box"][:, :3]
    begin = np.searchsorted(motion.time, BEGUN)
    shift = motion.q[samples[1], :3] - motion.q[begin, :3]
    assert np.linalg.norm(shift) > 0.02
    np.testing.assert_allclose(places, [BEFORE, BEFORE + shift, after, after], atol=5e-3)
    scene = scene_at(record, motion, int(samples[-1]))
    assert scene is not None
    np.testing.assert_allclose({item.name: item for item in scene}["box"].translation, after, atol=1e-12)


def test_the_player_moves_the_box_as_one_more_segment(carried):
    """Its corners as the page decodes them; shares of some metres in 16 bits are off by 0.05 mm."""
    record, motion, after = carried
    data = player_data(record.body, motion, record.scene, None, partial(object_places, record, motion))
    part, number = data["skin"], data["segments"] - 1
    bones = np.frombuffer(base64.b64decode(part["bones"]), "u1").reshape(-1, 4)[:, 0]
    kind = np.frombuffer(base64.b64decode(part["places"]), "<u2").reshape(-1, 4)[bones == number, :3]
    corners = kind / 65535.0 * part["size"] + part["low"]
    tracks = np.frombuffer(base64.b64decode(data["tracks"]), "<f4").reshape(data["frames"], -1, 7)
    for frame, place in ((0, BEFORE), (-1, after)):
        turn, shift = Rotation.from_quat(tracks[frame, number, :4]), tracks[frame, number, 4:]
        drawn = turn.apply(corners) + shift
        np.testing.assert_allclose(drawn.min(axis=0), np.subtract(place, 0.1), atol=5e-4)
        np.testing.assert_allclose(drawn.max(axis=0), np.add(place, 0.1), atol=5e-4)
    assert data["scene"] is None
