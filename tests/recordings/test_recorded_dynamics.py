"""Wrenches, forces, torques and margins of motions that are known, and of real ones beside force plates."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from manikin.balance import contact_limits, stability_margins, wrench_polytope
from manikin.balance.friction import contact_to_world, edge_wrenches
from manikin.body import human
from manikin.body.configuration import Configuration
from manikin.body.limbs import with_knees_and_elbows
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.errors import BodyError
from manikin.kinematics import PointTargets
from manikin.numerics.spatial import GRAVITY, wrench_about
from manikin.recordings import (
    ForcePlate,
    Reconstruction,
    compare_with_plates,
    dynamics_of,
    least_shift,
    mass_on_plates,
    motion_on_contacts,
    plate_forces,
    read_recording,
    reconstruct,
    recorded_margins,
    recorded_schedule,
    supports_of,
    touch_downs_of,
    with_mass,
    without_offsets,
)
from manikin.recordings.dynamics.plate_forces import compare_foot_forces
from manikin.recordings.dynamics.recorded_dynamics import HEIGHT_CUTOFF
from manikin.recordings.dynamics.recorded_forces import contact_wrenches, shared_wrenches, torques_of
from manikin.recordings.reconstruction.reconstruct import unmeasured_upright
from manikin.recordings.supports.body_supports import Support

RATE, FRAMES = 100.0, 301
TIME = np.arange(FRAMES) / RATE
INNER = slice(50, -50)
"""Away from the ends, where filter and differences look to one side."""

FEET = (
    sole("left_foot", (0.1, 0.1, 0.0), 0.2, length=0.28, width=0.12, friction=0.8),
    sole("right_foot", (-0.1, -0.1, 0.1), -0.3, length=0.28, width=0.12, friction=0.8),
)


def moving(hinges=None, rise=0.0, neutral=()):
    """Our human who bobs by ``rise`` at half a hertz while hinges swing at 0.7 Hz by amplitudes [rad]."""
    body = human()
    q = np.tile(body.standing_posture(), (FRAMES, 1))
    q[:, 2] += rise * np.sin(np.pi * TIME)
    for number, (name, amplitude) in enumerate((hinges or {}).items()):
        q[:, 7 + body.joint_index(name)] += amplitude * np.sin(1.4 * np.pi * TIME + number)
    targets = PointTargets(("hips",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    return Reconstruction(body, TIME, q, targets, np.zeros((FRAMES, 1)), neutral=neutral)


def on_feet(found, *, until=3.0, cap=3200.0):
    """Both feet where they are at first, from 0 to 3 s; none of them after an instant."""
    start = Configuration(found.body, found.q[0])
    feet = [
        sole(
            name, (*start.effector_placement(name)[1][:2], 0.0), length=0.28, width=0.12, friction=0.8
        )
        for name in ("left_foot", "right_foot")
    ]  # fmt: skip
    phases = [Phase(Stance(feet, cap), until)]
    if until < 3.0:
        phases.append(Phase(Stance((), cap), 3.0 - until))
    return ContactSchedule(StanceSequence(phases), [0.0, *([until] if until < 3.0 else []), 3.0])


@pytest.fixture(scope="module")
def swinging():
    arms = {"left_shoulder_flexion": 0.4, "right_shoulder_flexion": -0.3, "lumbar_side_bend": 0.1}
    return moving(arms | {"left_knee_flexion": 0.1, "thorax_rotation": 0.2}, rise=0.02)


@pytest.fixture(scope="module")
def dynamics(swinging):
    return dynamics_of(swinging)


def test_who_bobs_is_pushed_by_weight_and_acceleration():
    found = dynamics_of(moving(rise=0.05))
    mass, wanted = found.body.mass, -0.05 * np.pi**2 * np.sin(np.pi * TIME)
    # The low-pass of 5 Hz takes less than a thousandth of what has half a hertz.
    np.testing.assert_allclose(found.com_acceleration[INNER, 2], wanted[INNER], atol=2e-3)
    np.testing.assert_allclose(found.vertical_force[INNER], mass * (GRAVITY + wanted[INNER]), rtol=1e-3)
    np.testing.assert_allclose(found.angular_momentum_rate[INNER], 0.0, atol=1e-6 * mass * GRAVITY)
    np.testing.assert_allclose(found.zero_moment_point(0.0)[INNER], found.com[INNER, :2], atol=1e-6)


def test_the_wrench_is_the_rate_of_both_momenta(dynamics):
    # Second differences of positions at 100 Hz of what has 0.7 Hz are true to 1e-3 of their size.
    acceleration = np.gradient(np.gradient(dynamics.com, TIME, axis=0), TIME, axis=0)
    rate = np.gradient(dynamics.angular_momentum, TIME, axis=0)
    scale = (
        np.abs(dynamics.com_acceleration[INNER]).max(),
        np.abs(dynamics.angular_momentum_rate[INNER]).max(),
    )
    np.testing.assert_allclose(dynamics.com_acceleration[INNER], acceleration[INNER], atol=5e-3 * scale[0])
    np.testing.assert_allclose(dynamics.angular_momentum_rate[INNER], rate[INNER], atol=5e-3 * scale[1])
    without = dynamics.point_mass_wrench + np.hstack([np.zeros((FRAMES, 3)), dynamics.angular_momentum_rate])
    np.testing.assert_allclose(without, dynamics.wrench, atol=1e-8 * dynamics.body.mass)


def test_mass_scales_forces_and_nothing_else(swinging, dynamics):
    lighter = dynamics_of(with_mass(swinging, 60.0))
    np.testing.assert_allclose(lighter.com, dynamics.com, atol=1e-9)
    np.testing.assert_allclose(lighter.wrench / 60.0, dynamics.wrench / dynamics.body.mass, atol=1e-7)
    with pytest.raises(BodyError):
        with_mass(swinging, 10.0)
    kneeling = replace(swinging, body=with_knees_and_elbows(swinging.body))
    assert with_mass(kneeling, 60.0).body.effectors.keys() == kneeling.body.effectors.keys()


def test_contacts_leave_nothing_for_the_pelvis_to_hold(swinging, dynamics):
    schedule = on_feet(swinging)
    stance = schedule.sequence[0].stance
    shares = contact_wrenches(dynamics, schedule)
    torques = torques_of(dynamics, stance.effectors, shares)
    assert np.abs(torques[:, :6]).max() < 1e-7
    motion = motion_on_contacts(dynamics, schedule)
    assert all(np.isfinite(array).all() for array in motion.arrays().values())
    np.testing.assert_allclose(motion.tau[:, 6:], torques[:, 6:], atol=1e-7)
    np.testing.assert_allclose(motion.contact_force[..., :3].sum(axis=1), dynamics.wrench[:, :3], atol=1e-7)
    # At rest both feet carry alike.
    still = motion_on_contacts(dynamics_of(moving()), schedule)
    carried = still.contact_force[150, :, 2]
    np.testing.assert_allclose(carried, 0.5 * GRAVITY * swinging.body.mass, rtol=0.02)


@given(seed=st.integers(0, 2**16), contacts=st.integers(1, 3), inside=st.booleans())
def test_shares_add_up_and_are_admissible_if_any_are(seed, contacts, inside):
    rng = np.random.default_rng(seed)
    held = [*FEET, grasp("left_hand", (0.4, 0.3, 1.0), max_force=100.0)][:contacts]
    wrench = rng.normal(scale=300.0, size=(5, 6))
    if inside:
        pushes = [
            contact_to_world(one, edge_wrenches(one, "pyramid"), np.zeros(3)) for one in FEET[:contacts]
        ]
        generators = np.vstack(pushes)
        wrench = rng.uniform(5.0, 100.0, size=(5, len(generators))) @ generators
    shares = shared_wrenches(Stance(held, 3000.0), wrench, 700.0)
    np.testing.assert_allclose(shares.sum(axis=1), wrench, atol=1e-7 * np.abs(wrench).max())
    if not inside:
        return
    for number, contact in enumerate(held[:2]):
        limits, turn = contact_limits(contact), contact.rotation_contact_to_world
        local = wrench_about(shares[:, number], contact.position)
        local = np.hstack([local[:, :3] @ turn, local[:, 3:] @ turn])
        # What e leaves out, a millionth, is added without a look at the limits.
        assert (local @ limits.A.T - limits.b).max() < 1e-3 * np.abs(wrench).max()


def test_margins_are_those_of_the_polytope(swinging, dynamics):
    schedule = on_feet(swinging)
    margins = recorded_margins(dynamics, schedule)
    stance = schedule.sequence[0].stance
    reference = np.mean([contact.position for contact in stance], axis=0)
    wanted = stability_margins(
        wrench_polytope(stance, reference=reference), wrench_about(dynamics.wrench, reference), dynamics.com
    )
    np.testing.assert_allclose(margins.whole_body, wanted.wrench_about_com, atol=1e-6)
    np.testing.assert_allclose(margins.body.force, wanted.force, atol=1e-6)
    assert (margins.whole_body > 0.0).all()
    limiting = margins.limiting(margins.lowest)
    assert limiting is not None
    assert limiting.margin == pytest.approx(margins.whole_body.min())


@pytest.fixture(scope="module")
def script():
    """The script ``docs/recorded_balance.py``."""
    path = Path(__file__).resolve().parents[2] / "docs" / "recorded_balance.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = sys.modules[path.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_in_flight_nothing_holds(script, swinging, dynamics):
    schedule = on_feet(swinging, until=2.0)
    margins = recorded_margins(dynamics, schedule)
    flying = margins.phase == 1
    assert flying.sum() == 101
    missing = wrench_about(dynamics.wrench[flying], dynamics.com[flying])
    np.testing.assert_allclose(margins.whole_body[flying], -np.linalg.norm(missing, axis=1))
    assert margins.limiting(FRAMES - 1) is None
    motion = motion_on_contacts(dynamics, schedule)
    assert not motion.contact_force[flying].any()
    assert not motion.tau[:, :6].any()
    losses = script.balance_losses(margins, dynamics, schedule, cutoff=5.0)
    # For a quarter of 0.2 s the stance before the change still admits the wrench; the rest is flight.
    shares = script.share_by_cause(losses, FRAMES)
    frames = [FRAMES * shares[cause] for cause in script.Cause]
    assert frames == pytest.approx([6, 0, 95, 0, 0], abs=1.1)
    assert losses[0].cause is script.Cause.CHANGE
    assert losses[0].time == pytest.approx(2.0)


def test_a_wrench_out_of_reach_is_put_down_to_the_model_or_to_what_is_not_told(script, swinging):
    far = replace(swinging, q=swinging.q + np.eye(1, swinging.body.nq)[0])
    gone = dynamics_of(far)
    schedule = on_feet(swinging)
    margins = recorded_margins(gone, schedule)
    assert (margins.whole_body < 0.0).all()
    assert script.balance_losses(margins, gone, schedule)[150].cause is script.Cause.MODEL
    without_trunk = script.balance_losses(margins, gone, schedule, neutral=("thorax",))
    assert without_trunk[150].cause is script.Cause.UNTOLD


def plate_of(dynamics, share=1.0, corners=None):
    """A plate that feels a share of what the motion needs, at the same instants."""
    return ForcePlate("floor", share * dynamics.wrench, np.zeros(3), RATE, corners=corners)


SQUARE = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])


def test_plates_under_both_feet_tell_the_mass(swinging, dynamics):
    alone = on_feet(swinging).sequence[0].stance["left_foot"]
    schedule = ContactSchedule(StanceSequence([Phase(Stance([alone], 3200.0), 3.0)]), [0.0, 3.0])
    measured = plate_forces([plate_of(dynamics, 0.9, SQUARE)], TIME, schedule, cutoff=40.0)
    assert measured.covered.all()
    assert measured.single.all()
    assert mass_on_plates(dynamics, measured) == pytest.approx(0.9 * dynamics.body.mass, rel=1e-3)
    same = plate_forces([plate_of(dynamics, 1.0, SQUARE)], TIME, schedule, cutoff=40.0)
    shown = compare_with_plates(dynamics, recorded_margins(dynamics, schedule), same)
    assert shown is not None
    assert (shown.frames, shown.single_frames) == (FRAMES, FRAMES)
    assert shown.vertical_rms < 1e-3
    assert shown.cop_rms < 1e-3


def test_the_height_of_the_centre_of_mass_has_a_cutoff_of_its_own():
    """A bob of 6 Hz by 5 mm: ``1 / (1 + (sin / sin)^4)`` of it is left, of 5 Hz, and of 7 at touch-downs."""
    found = moving()
    q = np.array(found.q)
    q[:, 2] += 0.005 * np.sin(2.0 * np.pi * 6.0 * TIME)
    found = replace(found, q=q)
    every = np.arange(0.0, 3.01, 0.1)
    for touch_downs, cutoff in (((), HEIGHT_CUTOFF.usual), (every, HEIGHT_CUTOFF.highest)):
        height = dynamics_of(found, touch_downs=touch_downs).com[INNER, 2]
        left = np.sqrt(2.0) * np.std(height) / 0.005
        # Between bells 0.1 s apart the cutoff falls by 0.06 Hz.
        wanted = 1.0 / (1.0 + (np.sin(0.06 * np.pi) / np.sin(np.pi * cutoff / RATE)) ** 4)
        assert left == pytest.approx(wanted, rel=0.03)


def test_the_force_of_a_foot_is_compared_by_components(swinging, dynamics):
    """A plate that feels what the foot does, with 20 N more ahead, and 5 N.m about the vertical."""
    alone = on_feet(swinging).sequence[0].stance["left_foot"]
    schedule = ContactSchedule(StanceSequence([Phase(Stance([alone], 3200.0), 3.0)]), [0.0, 3.0])
    motion = motion_on_contacts(dynamics, schedule)
    dynamics = replace(dynamics, com=dynamics.com + np.outer(TIME, [0.5, 0.2, 0.0]))
    way = dynamics.com[-1, :2] - dynamics.com[0, :2]
    ahead = np.array([*(20.0 * way / np.linalg.norm(way)), 0.0, 0.0, 0.0, 0.0])
    weight = GRAVITY * dynamics.body.mass
    for more, component, apart in (
        (np.zeros(6), "up", 0.0), (ahead, "ahead", 20.0 / weight),
        (np.array([0.0, 0.0, 0.0, 0.0, 0.0, 5.0]), "free moment", 5.0 / weight),
    ):  # fmt: skip
        plate = replace(plate_of(dynamics, 1.0, SQUARE), wrenches=dynamics.wrench + more)
        measured = plate_forces([plate], TIME, schedule, cutoff=40.0)
        found = {one.component: one for one in compare_foot_forces(dynamics, motion, measured)}
        assert {one.frames for one in found.values()} == {FRAMES}
        assert found[component].rms == pytest.approx(apart, abs=1e-4)
        assert found["up"].r == pytest.approx(1.0, abs=1e-3)
        others = [one.rms for name, one in found.items() if name not in (component, "free moment")]
        assert max(others) < 1e-4
    assert compare_foot_forces(dynamics, motion, plate_forces([plate], TIME, on_feet(swinging))) == ()


def test_forces_of_both_feet_are_outwards(swinging, dynamics):
    """Plates feel 5 N more outwards. Both feet push inwards alike, which is no range of their forces."""
    motion, half = motion_on_contacts(dynamics, on_feet(swinging)), np.array([1.0, 1.0, 0.0])
    plates = [
        ForcePlate(
            side, wrenches, np.zeros(3), RATE,
            corners=SQUARE * half + np.array([0.0, 1.0 if side == "left" else -1.0, 0.0]),
        )
        for side, wrenches in zip(
            ("left", "right"), contact_wrenches(dynamics, on_feet(swinging)).swapaxes(0, 1), strict=True
        )
    ]  # fmt: skip
    plates[0] = replace(plates[0], wrenches=plates[0].wrenches + np.eye(6)[1] * 5.0)
    plates[1] = replace(plates[1], wrenches=plates[1].wrenches - np.eye(6)[1] * 5.0)
    way = dynamics.com[-1] - dynamics.com[0]
    still = replace(dynamics, com=dynamics.com + np.outer(TIME, [1.0, 0.0, 0.0]) - np.outer(TIME, way / 3.0))
    measured = plate_forces(plates, TIME, on_feet(swinging), cutoff=40.0)
    found = {one.component: one for one in compare_foot_forces(still, motion, measured)}
    assert found["aside"].frames == 2 * FRAMES
    assert found["aside"].rms == pytest.approx(5.0 / (GRAVITY * dynamics.body.mass), rel=1e-2)
    apart = np.ptp(motion.contact_force[150, :, 1])
    assert found["aside"].rms / found["aside"].rrmse < 0.5 * apart / (GRAVITY * dynamics.body.mass)
    assert compare_foot_forces(replace(dynamics, com=np.zeros_like(dynamics.com)), motion, measured) == ()


def test_a_foot_beside_the_plate_is_not_covered(swinging, dynamics):
    beyond = SQUARE + np.array([1.0, 0.0, 0.0])
    measured = plate_forces([plate_of(dynamics, 1.0, beyond)], TIME, on_feet(swinging))
    assert not measured.covered.any()
    assert mass_on_plates(dynamics, measured) is None
    margins = recorded_margins(dynamics, on_feet(swinging))
    assert compare_with_plates(dynamics, margins, measured) is None


def test_what_a_plate_reads_while_nobody_touches_it_is_taken_off(swinging, dynamics):
    """Half a second on the plate, then 2.5 s of flight: the offset is exact, the foot's load is kept."""
    schedule, on = on_feet(swinging, until=0.5), TIME < 0.5
    offset = np.array([1.0, -2.0, 70.0, 3.0, 4.0, 0.5])
    load = np.where(on[:, None], dynamics.wrench, 0.0)
    plate = ForcePlate("floor", load + offset, np.zeros(3), RATE, corners=SQUARE)
    (zeroed,), (remark,) = without_offsets([plate], schedule)
    np.testing.assert_allclose(zeroed.wrenches, load, atol=1e-9)
    assert "floor reads 70 N while nobody touches it" in remark
    aside = ForcePlate("aside", np.tile(offset, (FRAMES, 1)), np.zeros(3), RATE, corners=SQUARE + 5.0)
    (zeroed,), _ = without_offsets([aside], on_feet(swinging))
    assert not zeroed.wrenches.any()


def test_a_plate_that_is_never_free_or_that_others_load_is_left_as_it_is(swinging, dynamics):
    offset = np.array([0.0, 0.0, 70.0, 0.0, 0.0, 0.0])
    under = ForcePlate("floor", dynamics.wrench + offset, np.zeros(3), RATE, corners=SQUARE)
    someone = np.outer(1.0 + np.sin(40.0 * TIME), 4.0 * offset)
    other = ForcePlate("other", someone, np.zeros(3), RATE, corners=SQUARE + 5.0)
    (one, two), remarks = without_offsets([under, other], on_feet(swinging))
    assert remarks == ()
    np.testing.assert_array_equal(one.wrenches, under.wrenches)
    np.testing.assert_array_equal(two.wrenches, other.wrenches)


def test_a_seat_is_loaded_while_the_feet_lack_weight(script, dynamics, swinging):
    wrenches = np.array(dynamics.wrench)
    wrenches[100:200] *= 0.3
    plate = ForcePlate("floor", wrenches, np.zeros(3), RATE)
    feet = plate_forces([plate], TIME, on_feet(swinging), cutoff=45.0)
    seat = Support("buttocks", 1.05, 1.98, *(np.zeros(3),) * 3, True, True)
    on, off = script.seat_changes([seat], TIME, dynamics, feet)
    assert (on.event, off.event) == ("seat-on", "seat-off")
    assert (on.time, off.time) == pytest.approx((1.0, 2.0), abs=0.02)
    assert (on.error, off.error) == pytest.approx((0.05, -0.02), abs=0.02)


def test_an_untold_trunk_stays_upright_over_a_tilting_pelvis():
    neutral = ("lumbar", "thorax", "neck", "left_upper_arm", "right_upper_arm")
    found = moving(neutral=neutral)
    tilt = Rotation.from_euler("yzx", np.stack([0.1 * np.sin(TIME), 0.5 * TIME, 0.1 * np.cos(TIME)], axis=1))
    q = np.array(found.q)
    q[:, 3:7] = tilt.as_quat()
    upright = unmeasured_upright(replace(found, q=q))
    np.testing.assert_array_equal(upright.q[:, :7], q[:, :7])
    for frame in (0, 100, 300):
        at = Configuration(upright.body, upright.q[frame])
        for name in ("lumbar", "thorax", "head"):
            turn = at.segment_placement(name)[0]
            np.testing.assert_allclose(turn[2], [0.0, 0.0, 1.0], atol=1e-9)
    assert unmeasured_upright(moving()).q is not None
    told = replace(found, neutral=())
    assert unmeasured_upright(told) is told


def test_an_untold_trunk_calms_its_upper_end():
    found = moving(neutral=("lumbar", "thorax", "neck"))
    q = np.array(found.q)
    # Steps at 2 Hz push the pelvis to and fro by a centimetre while it goes ahead, and sideways at half that.
    q[:, 0] += TIME + 0.01 * np.sin(4.0 * np.pi * TIME)
    q[:, 1] += 0.02 * np.sin(2.0 * np.pi * TIME)
    calm = unmeasured_upright(replace(found, q=q))
    necks = np.array([Configuration(calm.body, one).segment_placement("neck")[1] for one in calm.q])
    beats = np.exp(4j * np.pi * TIME[50:-50])
    pelvis, neck = (2.0 * abs(np.mean(path[50:-50] * beats)) for path in (q[:, 0] - TIME, necks[:, 0] - TIME))
    assert pelvis == pytest.approx(0.01, rel=0.02)
    # What is faster than 1 Hz is nine tenths or more of 2 Hz.
    assert neck == pytest.approx(0.01 / 3.0, rel=0.15)
    np.testing.assert_allclose(necks[:, 1] - necks[0, 1], q[:, 1] - q[0, 1], atol=1e-4)


# --- real recordings ---------------------------------------------------------------------------


def analysed(path, frames=None):
    recording = read_recording(path, frames)
    found = reconstruct(recording)
    supports = supports_of(found, start=recording.start)
    touch_downs = touch_downs_of(supports)
    schedule, dynamics = recorded_schedule(found, supports), dynamics_of(found, touch_downs=touch_downs)
    measured = plate_forces(recording.plates, dynamics.time + supports.start, schedule)
    mass = mass_on_plates(dynamics, measured)
    dynamics = dynamics_of(with_mass(found, mass), touch_downs=touch_downs)
    return found, supports, schedule, dynamics, measured


@pytest.mark.parametrize(
    ("file", "mass", "cop", "positive", "shift", "vertical"),
    [
        # The bar of the centre of pressure is 3 cm, that of the share of frames in balance 97 % once shifted,
        # that of the vertical force of level walking 3.5 % of the weight; 6 % of single trials of others.
        ("btkdata/PiG_Motion-FlatFoot-One.c3d", 61.3, 0.030, 0.94, 0.003, 0.06),
        # No marker tells where trunk and arms are.
        ("btkdata/FunctionalWalk.c3d", 60.5, 0.030, 0.87, 0.002, 0.06),
        pytest.param(
            "nimble_opencap_s4/walkingTO1.trc", 63.7, 0.030, 0.99, 0.002, 0.035, marks=pytest.mark.long
        ),
        pytest.param("opensim_core/walking2.c3d", 66.1, 0.030, 0.93, 0.003, 0.035, marks=pytest.mark.long),
        ("opensim_core/walking5.c3d", 65.5, 0.030, 0.89, 0.005, 0.035),
    ],
)
def test_walks_agree_with_force_plates(script, recordings_folder, file, mass, cop, positive, shift, vertical):
    found, supports, schedule, dynamics, measured = analysed(recordings_folder / "grf" / file)
    assert dynamics.body.mass == pytest.approx(mass, abs=0.5)
    margins = recorded_margins(dynamics, schedule, supports.start)
    shown = compare_with_plates(dynamics, margins, measured)
    assert shown is not None
    assert shown.single_frames > 40
    # What the plates felt, our stances admit.
    assert shown.vertical_rms < vertical
    assert shown.margin_share > 0.99
    assert np.mean(margins.whole_body > 0.0) > positive
    nearest = least_shift(found, dynamics, margins)
    closer = compare_with_plates(nearest.dynamics, nearest.margins, measured)
    assert closer is not None
    assert closer.cop_rms < cop
    assert np.mean(nearest.margins.whole_body > 0.0) > 0.97
    assert nearest.rms < shift
    losses = script.balance_losses(nearest.margins, nearest.dynamics, schedule, supports.start, found.neutral)
    assert {loss.cause for loss in losses} <= {script.Cause.CHANGE, script.Cause.END}


def test_rising_from_a_seat_is_seen_by_the_plates_at_the_same_time(script, recordings_folder):
    path = recordings_folder / "grf" / "nimble_opencap_s4" / "STS1.trc"
    _, supports, schedule, dynamics, measured = analysed(path, (0, 330))
    changes = script.seat_changes(supports.of("buttocks"), dynamics.time, dynamics, measured)
    assert [change.event for change in changes] == ["seat-off", "seat-on"]
    assert max(abs(change.error) for change in changes) < 0.1
    margins = recorded_margins(dynamics, schedule, supports.start)
    assert np.mean(margins.whole_body > 0.0) > 0.97
