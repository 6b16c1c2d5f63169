"""Wrong cells of a recorded skeleton: found by the path of each joint, filled, or told."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manikin.analysis import AnalysisOptions, analyze
from manikin.body import human
from manikin.recordings import read_recording
from manikin.recordings.reconstruction.skeleton_cleaning import without_joint_jumps
from manikin.reports.formats.bvh import to_bvh
from manikin.walking import walk_along, walking_path

OPTIONS = AnalysisOptions(mass=79.0, as_recorded=True)
JOINTS = ("left_thigh", "right_leg", "pelvis", "thorax", "left_upper_arm")


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A walk at 50 Hz with noise of 2 mrad in every joint, as recorded ones have."""
    body = human(1.75, 79.0, "male")
    motion = walk_along(walking_path((0.0, 0.0, 0.0), (1.5, 0.0, 0.0)), body, rate=50.0).motion
    file = tmp_path_factory.mktemp("walk") / "walk.bvh"
    file.write_text(to_bvh(body, motion))
    found = read_recording(file)
    noise = Rotation.from_rotvec(
        np.random.default_rng(3).normal(0.0, 0.002, (*found.rotations.shape[:2], 3)).reshape(-1, 3)
    )
    return replace(found, rotations=found.rotations @ noise.as_matrix().reshape(found.rotations.shape))


def turned(recording, joint, frames, angle, axis=1):
    """The recording with a joint turned in some frames."""
    rotations, place = np.array(recording.rotations), recording.joint_names.index(joint)
    rotations[frames, place] = rotations[frames, place] @ Rotation.from_euler("xyz"[axis], angle).as_matrix()
    return replace(recording, rotations=rotations)


def off(first, second, joint):
    """(n,) angles between a joint's rotations [rad]."""
    place = first.joint_names.index(joint)
    between = Rotation.from_matrix(first.rotations[:, place]).inv() * Rotation.from_matrix(
        second.rotations[:, place]
    )
    return between.magnitude()


def test_what_is_right_stays_bit_for_bit(walk):
    cleaned, repairs = without_joint_jumps(walk)
    assert cleaned is walk
    assert repairs == ()


def test_a_landing_and_a_quick_kick_stay_as_they_are(walk):
    """A fall of 0.3 s that ends from one frame to the next, and a knee that turns out and back in 0.2 s."""
    slow = replace(walk, rate=30.0)
    time, places, rotations = slow.time, np.array(walk.root_positions), np.array(walk.rotations)
    fallen = np.clip(time - 1.0, 0.0, 0.3)
    places[:, 2] -= 0.5 * 9.81 * fallen**2
    landing = replace(slow, root_positions=places)
    assert without_joint_jumps(landing)[0] is landing
    knee = walk.joint_names.index("right_leg")
    angle = 1.2 * np.exp(-(((time - 2.0) / 0.08) ** 2))
    rotations[:, knee] = (
        rotations[:, knee] @ Rotation.from_rotvec(angle[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    )
    kick = replace(slow, rotations=rotations)
    cleaned, repairs = without_joint_jumps(kick)
    assert [one for one in repairs if one.outcome == "filled"] == []
    np.testing.assert_array_equal(cleaned.rotations, kick.rotations)


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize(("first", "count"), [(0, 1), (40, 1), (90, 3), (131, 5)])
def test_short_runs_are_filled(walk, joint, first, count):
    """Wrong by 0.6 rad before; after it by what a joint turns within the run at most, some 0.1 rad."""
    wrong = turned(walk, joint, slice(first, first + count), 0.6)
    cleaned, repairs = without_joint_jumps(wrong)
    assert [(one.marker, one.kind, one.first, one.stop, one.outcome) for one in repairs] == [
        (joint, "spike", first, first + count, "filled")
    ]
    error = off(walk, cleaned, joint)
    assert error[first : first + count].max() < 0.1
    assert np.delete(error, slice(first, first + count)).max() < 1e-9


def test_a_root_that_jumps_away_is_put_back(walk):
    places = np.array(walk.root_positions)
    places[60:62] += [0.0, 5.0, 0.3]
    cleaned, (repair,) = without_joint_jumps(replace(walk, root_positions=places))
    assert (repair.kind, repair.first, repair.stop) == ("spike", 60, 62)
    np.testing.assert_allclose(cleaned.root_positions, walk.root_positions, atol=5e-3)


def test_a_long_run_stays_and_is_told(walk):
    """Nothing says which part of the recording is wrong."""
    wrong = turned(walk, "left_thigh", slice(60, 100), 0.6)
    cleaned, repairs = without_joint_jumps(wrong)
    np.testing.assert_array_equal(cleaned.rotations, wrong.rotations)
    assert [(one.kind, one.first, one.outcome) for one in repairs] == [
        ("jump", 59, "as recorded"), ("jump", 99, "as recorded")
    ]  # fmt: skip
    assert repairs[0].distance == pytest.approx(0.6 * 0.95, rel=0.15)  # from the hip to the toes


def test_a_wrong_cell_changes_no_margin(walk):
    """The least one falls by 500 to 3000 N.m where such a cell is believed."""
    right = analyze(walk, OPTIONS)
    found = analyze(turned(walk, "right_thigh", [75], 0.9), OPTIONS)
    assert found.as_dict()["margin"]["min"] == pytest.approx(right.as_dict()["margin"]["min"], abs=5.0)
    assert any("cleaned: joints off their places in 1 run of frames" in line for line in found.remarks)
    assert found.implausible == ()


def test_a_joint_that_jumps_as_nobody_can_is_implausible(walk):
    """Half a turn of the pelvis within a frame."""
    found = analyze(turned(walk, "pelvis", slice(80, 140), 3.0, axis=0), OPTIONS)
    assert any(line.startswith("pelvis jumps after frame") for line in found.implausible)
