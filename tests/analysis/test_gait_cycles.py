"""Gait cycles of a walk whose events, angles and torques are known, and the activities of real recordings."""

import numpy as np
import pytest

from manikin.analysis.activity import recognise
from manikin.analysis.gait_bands import gait_band
from manikin.analysis.gait_cycles import CURVES, LegLoads, gait_report
from manikin.body import human
from manikin.motion import Motion
from manikin.recordings import (
    RecordedSupports,
    Support,
    TimingError,
    motion_of,
    read_recording,
    reconstruct,
    supports_of,
)
from manikin.reports.gait_sheet import gait_columns, gait_sheet

STRIDE, STANCE, LENGTH, WIDTH, MASS, CLOCK = 1.0, 0.6, 0.7, 0.1, 70.0, 2.0
"""Stride [s], its share in stance, length and width of a step [m], mass [kg], start of the clock [s]."""


def walk(yaw=0.4, strides=4):
    """Supports and motion of a walk along a heading: every foot half a stride after the other one."""
    body, supports = human(1.75, MASS), []
    ahead, left = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    end = CLOCK + strides * STRIDE
    for number in range(2 * strides):
        side = ("left", "right")[number % 2]
        start = CLOCK + 0.5 * STRIDE * number
        stop = min(start + STANCE * STRIDE, end)
        place = number * LENGTH * ahead + (0.5 if side == "left" else -0.5) * WIDTH * left
        supports.append(Support(f"{side}_foot", start, stop, place, place, place, number > 0, stop < end))
    time = np.arange(0.0, strides * STRIDE + 1e-9, 0.01)
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[:, :2] = (2.0 * LENGTH / STRIDE * time[:, None] * ahead)[:, :2]
    names = list(body.joint_names)
    v, tau = np.zeros((len(time), body.nv)), np.zeros((len(time), body.nv))
    turn = 2.0 * np.pi * time / STRIDE
    knee = names.index("right_knee_flexion")
    q[:, 7 + knee], v[:, 6 + knee] = 0.5 - 0.5 * np.cos(turn), np.pi / STRIDE * np.sin(turn)
    tau[:, 6 + knee] = -35.0
    n = len(time)
    motion = Motion(
        time=time, q=q, v=v, a=np.zeros_like(v), tau=tau, com=q[:, :3], angular_momentum=np.zeros((n, 3)),
        margin=np.full(n, np.nan), support=np.zeros((n, 0), dtype=bool), contact_force=np.zeros((n, 0, 6)),
        contact_names=(), joint_names=tuple(names),
    )  # fmt: skip
    return RecordedSupports(tuple(supports), CLOCK, end, (0.0,)), motion


@pytest.fixture(scope="module")
def report():
    return gait_report(*walk(), MASS)


def test_events_and_steps_are_those_of_the_walk(report):
    """A stance of 60 % has two double supports of 10 % each; nothing depends on the heading."""
    assert [one.side for one in report.cycles] == ["right", "left", "right", "left", "right"]
    assert report.cadence == pytest.approx(120.0)
    assert report.speed == pytest.approx(2.0 * LENGTH / STRIDE)
    for one in report.cycles:
        assert one.stance == pytest.approx(60.0)
        assert one.double_support == pytest.approx(20.0)
    for step in report.steps:
        assert (step.length, step.width) == (pytest.approx(LENGTH), pytest.approx(WIDTH))
    assert report.symmetry["step_length_m"] == pytest.approx(0.0, abs=1e-9)


def test_curves_are_angles_moments_and_powers_over_the_cycle(report):
    """The right foot lands half a stride after the knee is straight, at its largest flexion of 1 rad.

    An extending moment is a negative torque of the flexion; 35 N.m on 70 kg are 0.5 N.m/kg. The power is that
    torque times the speed of the hinge. Interpolation of samples every 10 ms errs by 5e-4 rad at most.
    """
    (mean, spread), share = report.curves["right"]["knee_flexion_deg"], 0.01 * np.arange(101.0)
    np.testing.assert_allclose(mean, np.degrees(0.5 + 0.5 * np.cos(2.0 * np.pi * share)), atol=0.03)
    np.testing.assert_allclose(spread, 0.0, atol=0.03)
    np.testing.assert_allclose(report.curves["right"]["knee_extension_Nm_per_kg"][0], 0.5, atol=1e-9)
    power = report.curves["right"]["knee_power_W_per_kg"][0]
    np.testing.assert_allclose(power, 0.5 * np.pi * np.sin(2.0 * np.pi * share), atol=2e-3)
    np.testing.assert_allclose(report.curves["left"]["knee_flexion_deg"][0], report_standing(), atol=1e-9)


def report_standing():
    """Flexion of a knee in standing [deg]."""
    body = human(1.75, MASS)
    return np.degrees(body.standing_posture()[7 + list(body.joint_names).index("left_knee_flexion")])


def test_events_of_plates_replace_those_found():
    """A touch-down found 20 ms late is where the plate has it; the lift-off that no plate saw stays."""
    supports, motion = walk()
    second = supports.of("right_foot")[0]
    late = TimingError("plate", "right_foot", "touch-down", second.start - 0.02, 0.02)
    cycle = gait_report(supports, motion, MASS, [late]).cycles[0]
    assert (cycle.start, cycle.off) == (pytest.approx(second.start - 0.02), pytest.approx(second.end))


def test_moments_are_those_of_plates_where_the_foot_is_alone_on_one():
    """The left foot is on a plate in its first whole stance only: one cycle has the plates' torque."""
    supports, motion = walk()
    first, time = supports.of("left_foot")[1], motion.time + CLOCK
    tau = np.full_like(motion.tau, -70.0)
    loads = LegLoads(tau, {"left_foot": (time >= first.start) & (time <= first.end)})
    found = gait_report(supports, motion, MASS, (), loads)
    assert [one.by_plate for one in found.of("left")] == [True, False]
    assert not any(one.by_plate for one in found.of("right"))
    by_plate, by_motion = (one.curves["knee_extension_Nm_per_kg"] for one in found.of("left"))
    np.testing.assert_allclose(by_plate, 1.0)
    np.testing.assert_allclose(by_motion, 0.0)


def test_a_band_is_that_of_the_persons_group_and_holds_its_own_mean(report):
    """The mean of the people is within one deviation of itself everywhere; children have another band."""
    adults, children = gait_band(1.75), gait_band(1.3)
    assert (adults.group, children.group) == ("adults", "children")
    assert min(adults.people, children.people) >= 3
    knee = adults.curves["knee_flexion_deg"][0]
    assert 50.0 < knee[60:85].max() < 70.0  # of the swing
    assert 0.0 < knee[5:25].max() < 30.0  # after loading
    assert 1.0 < adults.curves["ankle_plantarflexion_Nm_per_kg"][0].max() < 2.0
    assert set(adults.compared(report)["left"]) == set(CURVES)
    columns = gait_columns(report, adults)
    assert {len(column) for column in columns.values()} == {101}
    assert gait_sheet(report, adults, "cycles").count("<path") > 40


@pytest.mark.parametrize(
    ("file", "kind"),
    [
        ("accad_male1_bvh/Male1_A5_PickUpBox.bvh", "lifting"),
        ("accad_male1_bvh/Male1_A7_Crouch.bvh", "crouching"),
        ("accad_male1_bvh/Male1_A9_LieDown.bvh", "lying"),
        ("accad_male1_bvh/Male1_A11_CrawlForward.bvh", "crawling"),
        ("accad_male1_bvh/Male1_B20_WalkWithBox.bvh", "carrying"),
        ("accad_male1_bvh/Male1_B3_Walk.bvh", "walking"),
        ("grf/nimble_opencap_s4/STS1.trc", "sit-to-stand"),
        ("grf/nimble_opencap_s4/DJ1.trc", "jumping"),
        ("laboratories/vua_lift/stoop1_t169_f620f800.c3d", "lifting"),
        ("laboratories/nimble/WeirdFormatTests_markers_StairUp3.trc", "stairs up"),
        ("laboratories/c3d2opensim/jogging.c3d", "running"),
        ("laboratories/autosim_FHSTP/StandA.c3d", "standing"),
    ],
)
def test_what_is_recorded_is_recognised(recordings_folder, file, kind):
    if not (path := recordings_folder / file).exists():
        pytest.skip(f"{file} is not there")
    found = reconstruct(read_recording(path))
    assert recognise(found, supports_of(found), motion_of(found)).kind == kind
