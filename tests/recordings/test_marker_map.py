"""Marker maps: what a file says of markers whose names say nothing, and one line for each mistake in it."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.recordings import MarkerRecording, read_marker_map, read_recording
from manikin.recordings.readers.marker_sets import LANDMARKS, SEGMENTS, marker_set

MAP = """left_asis: "001"
right_asis: M2
sacrum: M3
left_thigh: [M4, no]
left_heel: M5
unused: [LTOE]
"""
NAMES = ("001", "M2", "M3", "M4", "no", "Anna:M5", "LTOE", "LANK", "LHEE")


@pytest.fixture
def map_file(tmp_path):
    file = tmp_path / "map.yaml"
    file.write_text(MAP)
    return file


def recording(names=NAMES):
    return MarkerRecording("some", names, np.zeros((1, len(names), 3)), 100.0)


def test_a_map_says_what_names_do_not_say(map_file):
    """Other markers are known by their names; of two for one landmark the map's is it."""
    found = marker_set(read_marker_map(map_file).applied_to(recording()))
    assert dict(found.roles) == {
        "left_asis": "001", "right_asis": "M2", "sacrum": "M3", "left_heel": "Anna:M5",
        "left_ankle_lateral": "LANK",
    }  # fmt: skip
    assert found.segments["M4"] == found.segments["no"] == "left_thigh"
    assert found.segments["LHEE"] == "left_foot"
    assert found.others == ("LTOE",)


def test_every_landmark_and_segment_can_be_mapped(tmp_path):
    places = (*LANDMARKS, *SEGMENTS)
    names = tuple(f"M{number}" for number in range(len(places)))
    file = tmp_path / "all.yaml"
    file.write_text("".join(f"{place}: {name}\n" for place, name in zip(places, names, strict=True)))
    found = marker_set(read_marker_map(file).applied_to(recording(names)))
    assert set(found.roles) == set(LANDMARKS)
    assert not found.others
    assert {found.segments[found.roles[name]] for name in LANDMARKS} <= set(SEGMENTS)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("left_knie_lateral: M1\n", "map.yaml:1: 'left_knie_lateral' is no landmark .*left_knee_lateral"),
        (
            "left_heel: M1\nleft_toe: M1\n",
            "map.yaml:2: marker 'M1' is given twice, for left_heel and left_toe",
        ),
        ("left_heel: M1\nleft_heel: M2\n", "map.yaml:2: left_heel is given twice"),
        ("left_heel: [M1, M2]\n", "map.yaml:1: left_heel is a list; valid: one marker"),
        ("left_heel: {a: b}\n", "map.yaml:1: holds no names"),
        ("left_heel:\n", "map.yaml:1: holds no names"),
        ("- M1\n", "map.yaml: is no mapping"),
        ("left_heel: [M1\n", "map.yaml:2: is not valid YAML"),
        ("[" * 5000, "map.yaml: is nested too deeply"),
    ],
)
def test_mistakes_in_a_map_are_one_line_with_their_place(tmp_path, text, told):
    file = tmp_path / "map.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=told) as caught:
        read_marker_map(file)
    assert "\n" not in str(caught.value)


def test_a_marker_that_is_not_in_the_recording_is_refused(map_file):
    wanted = read_marker_map(map_file)
    with pytest.raises(InputError, match="left_heel: marker 'M5' is 0 times in the recording 'some'; valid"):
        wanted.applied_to(recording(tuple(name for name in NAMES if name != "Anna:M5")))
    with pytest.raises(InputError, match="'M5' is 2 times"):
        wanted.applied_to(recording((*NAMES, "Ben:M5")))


def test_what_a_map_says_stays_with_the_frames(map_file):
    mapped = read_marker_map(map_file).applied_to(recording())
    assert replace(mapped, name="other").cut(0, 1).marker_map == mapped.marker_map


def test_a_skeleton_has_no_markers_to_map(standing_file, map_file):
    with pytest.raises(InputError, match="holds a skeleton"):
        read_recording(standing_file, markers=map_file)
