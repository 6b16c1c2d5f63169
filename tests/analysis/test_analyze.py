"""One recording measured from beginning to end."""

import re
from dataclasses import replace

import numpy as np
import pytest

from manikin.analysis import AnalysisOptions, analyze, analyze_file
from manikin.balance import evaluate_balance
from manikin.body import Configuration
from manikin.contact import Stance, sole
from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY
from manikin.recordings import read_recording
from manikin.recordings.dynamics.shifted_motion import LARGEST_RMS
from manikin.recordings.supports.recorded_stances import STRONGEST
from manikin.reports.pages import analysis_page


@pytest.fixture(scope="module")
def standing(standing_file):
    return analyze_file(standing_file)


def test_who_stands_is_pushed_by_their_weight_below_their_centre_of_mass(standing):
    """The postures are found to 5 micrometres in the first frame, which is all that moves."""
    assert standing.body.stature == pytest.approx(1.75, abs=1e-6)
    np.testing.assert_allclose(standing.vertical_force, standing.weight, rtol=1e-4)
    np.testing.assert_allclose(standing.cop, standing.motion.com[:, :2], atol=1e-4)
    np.testing.assert_allclose(standing.motion.angular_momentum, 0.0, atol=5e-3)  # a walk has some 1
    assert [one.effectors for one in standing.supports.phases] == [("left_foot", "right_foot")]
    assert standing.segments is not None
    assert {one.kind for one in standing.segments.segments} == {"standing"}


def test_margin_is_that_of_the_stance_found(standing):
    """Built by hand from the places of the feet, about the centre of mass."""
    body, frame = standing.body, 30
    feet = [standing.supports.of(name)[0] for name in ("left_foot", "right_foot")]
    soles = [
        sole(one.effector, one.place, 0.0, length=body.sole_length, width=body.sole_width, friction=0.8)
        for one in feet
    ]
    stance = Stance(soles, STRONGEST * body.mass * GRAVITY)
    com = standing.motion.com[frame]
    report = evaluate_balance(stance, body.mass, com, reference=com)
    assert standing.motion.margin[frame] == pytest.approx(report.margin, rel=1e-4)
    assert standing.point_mass_margin[frame] == pytest.approx(report.margin, rel=1e-4)


def test_both_legs_carry_the_same(standing):
    """Mirrored in the sagittal plane; nothing but the contacts pushes the pelvis."""
    names = standing.motion.joint_names
    left, right = (6 + names.index(f"{side}_ankle_dorsiflexion") for side in ("left", "right"))
    np.testing.assert_allclose(standing.motion.tau[:, left], standing.motion.tau[:, right], atol=0.05)
    np.testing.assert_allclose(standing.motion.tau[:, :6], 0.0, atol=1e-9)
    mirror = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
    one, other = standing.motion.contact_force.swapaxes(0, 1)
    np.testing.assert_allclose(one, other * mirror, atol=0.05)


def test_a_carried_load_is_in_forces_torques_centre_of_mass_and_margin(standing, standing_file):
    """10 kg in the right hand: the hand's share of everything is a point mass at the palm."""
    mass, frame = 10.0, 30
    found = analyze_file(standing_file, AnalysisOptions(load=mass, load_hand="right"))
    total = standing.body.mass + mass
    assert found.body.own_mass == pytest.approx(standing.body.mass)
    np.testing.assert_allclose(found.vertical_force, total * GRAVITY, rtol=1e-4)
    np.testing.assert_allclose(found.motion.contact_force[frame, :, 2].sum(), total * GRAVITY, rtol=1e-4)
    state = Configuration(standing.body, standing.motion.q[frame])
    hand, palm = state.effector_placement("right_hand")[1], standing.body.effector("right_hand")
    com = (standing.body.mass * standing.motion.com[frame] + mass * hand) / total
    np.testing.assert_allclose(found.motion.com[frame], com, atol=1e-5)
    weight = state.point_jacobian("right_hand", palm.translation).T @ [0.0, 0.0, mass * GRAVITY]
    arm = [6 + standing.motion.joint_names.index(f"right_{n}") for n in ("elbow_flexion", "shoulder_flexion")]
    change = (found.motion.tau - standing.motion.tau)[frame, arm]
    np.testing.assert_allclose(change, weight[arm], atol=0.02)
    assert np.abs(change).max() > 1.0
    assert found.motion.margin[frame] != pytest.approx(standing.motion.margin[frame], rel=1e-3)
    summary = found.as_dict()
    assert (summary["mass_kg"], summary["load_kg"]) == (pytest.approx(standing.body.mass), mass)


def test_summary_has_what_the_command_promises(standing):
    summary = standing.as_dict()
    promised = {
        "duration_s", "frames", "supports", "key_frames_s", "phase_durations_s", "com_height_min_m",
        "reconstruction_residual_m", "segments", "margin", "force_plates",
    }  # fmt: skip
    assert promised <= set(summary)
    assert summary["frames"] == 60
    assert summary["duration_s"] == pytest.approx(59 / 50.0)
    assert summary["margin"]["share_positive"] == 1.0
    assert summary["margin"]["form"] == "whole-body"
    assert summary["reconstruction_residual_m"]["max"] < 1e-4
    assert summary["force_plates"] is None
    assert sum(summary["phase_durations_s"]) == pytest.approx(summary["duration_s"])
    columns = standing.series()
    assert {len(column) for column in columns.values()} == {60}
    assert next(iter(columns)) == "time_s"


def test_same_file_same_numbers(standing, standing_file):
    again = analyze_file(standing_file)
    assert {name: one.tolist() for name, one in standing.series().items()} == {
        name: one.tolist() for name, one in again.series().items()
    }


def test_the_motion_as_recorded_leads_and_the_shifted_one_stands_beside_it(recordings_folder):
    """Both differ by the shift of the pelvis, and the margins with them."""
    path = recordings_folder / "grf/nimble_opencap_s4/walkingTS1.trc"
    both, plain = analyze_file(path), analyze_file(path, AnalysisOptions(as_recorded=True))
    told, shifted = both.as_dict(), both.shifted_motion
    assert shifted is not None
    assert told["margin"]["motion"] == "recorded"
    np.testing.assert_array_equal(both.motion.q, plain.motion.q)
    np.testing.assert_array_equal(both.motion.tau, plain.motion.tau)
    shift = shifted.q[:, :3] - both.motion.q[:, :3]
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), both.series()["shift_m"], atol=1e-12)
    np.testing.assert_array_equal(shifted.q[:, 7:], both.motion.q[:, 7:])
    np.testing.assert_array_equal(both.series()["recorded_margin_Nm"], both.motion.margin)
    np.testing.assert_array_equal(both.series()["shifted_margin_Nm"], shifted.margin)
    assert told["margin"]["min"] == told["margin"]["recorded"]["min"] == both.motion.margin.min() < 0.0
    assert told["ergonomics"]["margin"]["min"] == told["margin"]["min"]
    plates = told["force_plates"]
    assert plates["cop_rms_m"] == plates["cop_rms_recorded_m"] > plates["cop_rms_shifted_m"]
    # Without a shifted motion nothing is told of one.
    assert plain.shifted_motion is None
    assert plain.as_dict()["margin"]["shifted"] is None
    assert plain.as_dict()["force_plates"]["torques_shifted"] == {}
    assert not {"shifted_margin_Nm", "shift_m"} & set(plain.series())
    for page in (analysis_page(one, one.as_dict(), ("", "")) for one in (both, plain)):
        assert "lowest margin, as recorded" in page
    assert "imposed floor" not in page


def test_no_number_that_the_shift_imposed_is_given_as_a_result(recordings_folder):
    """In this walk the shift is held by its floor, 0.01 m times the weight, in every support of one foot."""
    found = analyze_file(recordings_folder / "accad_male1_bvh/Male1_B3_Walk.bvh")
    shifted, told = found.measured.believed, found.as_dict()
    assert shifted is not None
    floor = 0.01 * found.weight
    assert told["margin"]["shifted"]["floor_m"] == pytest.approx(0.01)
    assert told["margin"]["shifted"]["floor_Nm"] == pytest.approx(floor)
    assert told["margin"]["shifted"]["min"] is None
    assert told["margin"]["shifted"]["min_at_floor"]
    held = [one for one in told["phases"] if one["shifted_at_floor"]]
    assert len(held) == sum(len(one["effectors"]) == 1 for one in told["phases"])
    for one in told["phases"]:
        assert (one["shifted_margin_min_Nm"] is None) == one["shifted_at_floor"]
        recorded = found.motion.margin[(found.time >= one["start_s"]) & (found.time < one["end_s"])]
        assert one["margin_min_Nm"] == recorded.min()
    page = analysis_page(found, found.as_dict(), ("", ""))
    assert page.count("at the imposed floor") == len(held) + 1
    assert f"{told['margin']['shifted']['floor_Nm']:.1f} N.m" in page


def test_a_shift_that_does_not_lead_to_balance_is_not_believed(recordings_folder):
    """A run at 30 frames per second, whose forces are known too badly; and a leap, all in flight."""
    found = analyze_file(recordings_folder / "accad_male1_bvh/Male1_C03_Run.bvh")
    margin = found.as_dict()["margin"]
    assert not margin["shifted"]["believed"]
    assert found.shifted_motion is None
    assert margin["shifted"]["rms_m"] > LARGEST_RMS
    np.testing.assert_array_equal(found.motion.q, found.measured.recorded.q)
    assert any("is not to be believed" in line for line in found.remarks)
    leap = analyze_file(
        recordings_folder / "grf/nimble_opencap_s4/DJ1.trc", AnalysisOptions(frames=(114, 140))
    )
    margin = leap.as_dict()["margin"]
    assert (margin["motion"], margin["share_in_contact"]) == ("recorded", 0.0)
    assert margin["share_positive_in_contact"] is None
    assert "None" not in analysis_page(leap, leap.as_dict(), ("", ""))
    # Where the sheet is drawn the motion can be played.
    assert 'id="player-data"' in analysis_page(leap, leap.as_dict(), ("<svg></svg>", ""))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"sex": "child"}, "sex is 'child'; valid: male, female"),
        ({"mass": -3.0}, "mass"),
        ({"friction": 0.0}, "friction"),
        ({"load": float("nan")}, "load"),
    ],
)
def test_bad_options_are_refused(given, told):
    with pytest.raises(InputError, match=told):
        AnalysisOptions(**given)


def test_too_few_frames_are_refused(standing_file):
    with pytest.raises(InputError, match=r"has 9 frame\(s\); valid: at least 10"):
        analyze(read_recording(standing_file, (0, 9)))
    with pytest.raises(InputError, match=r"standing\.bvh: .*1 frame"):
        analyze_file(standing_file, AnalysisOptions(frames=(0, 1)))


def test_a_recorded_walk_beside_its_plates(recordings_folder):
    """Of the bars for recorded walks: supports within 30 ms, forces within 10 % of body weight."""
    found = analyze_file(recordings_folder / "grf/btkdata/FunctionalWalk.c3d")
    plates = found.as_dict()["force_plates"]
    assert plates["timing_median_s"] < 0.030
    assert plates["vertical_rms_body_weight"] < 0.10
    # And 97 % of the frames can be carried, the body shifted by less than its markers tell.
    margin = found.as_dict()["margin"]
    assert margin["shifted"]["believed"]
    assert margin["shifted"]["share_positive"] > 0.97 > margin["share_positive"]
    assert margin["recorded"]["share_positive"] == margin["share_positive"]
    assert margin["shifted"]["rms_m"] < 0.002
    assert plates["cop_rms_shifted_m"] < plates["cop_rms_recorded_m"]
    assert found.plates is not None
    both = found.plates.compared
    assert np.median(found.plates.vertical_force[both]) == pytest.approx(found.weight, rel=0.1)


def test_who_crawls_is_held_by_points_on_the_ground(recordings_folder):
    """Knees and elbows are contacts of the body then, and most of the weight can be given."""
    found = analyze_file(recordings_folder / "accad_male1_bvh/Male1_A11_CrawlForward.bvh")
    names = set(found.motion.contact_names)
    assert {"left_hand", "right_hand"} <= names
    assert names & {"left_knee", "right_knee"}
    assert names <= set(found.body.effectors)
    assert np.median(found.vertical_force) == pytest.approx(found.weight, rel=0.1)


def test_plates_that_carry_another_mass_than_the_file_tells_are_remarked(recordings_folder):
    """Of this person the file says 66.5 kg, and the plates 61.3 kg, 8 % less."""
    path = recordings_folder / "grf/btkdata/PiG_Motion-FlatFoot-One.c3d"
    found = analyze_file(path)
    assert found.body.mass == pytest.approx(66.5)
    plates = found.as_dict()["force_plates"]
    assert plates["mass_kg"] == pytest.approx(61.3, abs=0.3)
    for feet in (plates["foot_forces"], plates["foot_forces_shifted"]):
        assert set(feet) == {"ahead", "aside", "up", "free_moment"}
        assert feet["up"]["r"] > 0.9
    assert any(re.search(r"carry 61\.\d kg, not 66\.5 kg", line) for line in found.remarks)
    lighter = analyze_file(path, AnalysisOptions(mass=61.3))
    assert not any("carry" in line for line in lighter.remarks)


def test_one_marker_five_metres_off_leaves_the_least_margin_as_it_was(recordings_folder):
    """The filling of one frame of a walk is within a millimetre: margins stay to 1 N.m and 1 %."""
    recording = read_recording(recordings_folder / "grf/btkdata/FunctionalWalk.c3d").cut(150, 300)
    positions = np.array(recording.positions)
    positions[75, recording.marker_index("RTHI"), 0] += 5.0
    options = AnalysisOptions(as_recorded=True)
    clean, found = (
        analyze(one, options).as_dict() for one in (recording, replace(recording, positions=positions))
    )
    (repair,) = (one for one in found["cleaning"] if one["kind"] != "gap")
    assert (repair["marker"], repair["kind"], repair["first_frame"], repair["stop_frame"]) == (
        "RTHI", "spike", 75, 76,
    )  # fmt: skip
    assert repair["start_s"] == pytest.approx(recording.time[75])
    assert any("cleaned" in remark and "RTHI" in remark for remark in found["remarks"])
    assert not any(one["kind"] != "gap" for one in clean["cleaning"])
    assert found["margin"]["min"] == pytest.approx(clean["margin"]["min"], rel=0.01, abs=1.0)
