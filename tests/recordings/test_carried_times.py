"""When feet of runners carry, by the force that the motion needs."""

import numpy as np
import pytest

from manikin.body import human
from manikin.kinematics import PointTargets
from manikin.numerics.signals import low_passed
from manikin.numerics.spatial import GRAVITY
from manikin.recordings import Reconstruction, dynamics_of, read_recording, reconstruct
from manikin.recordings.supports.body_supports import Support
from manikin.recordings.supports.running_supports import AT_END, CUTOFF, FALLING, by_the_force
from manikin.recordings.supports.supports import supports_of, timing_errors

RATE, LIFT = 120.0, 0.3
TOES = np.array([0.25, 0.0, 0.0])


def pushes(time, stance, flight):
    """(n,) half-sines of a vertical force per weight whose mean over a step is 1, the first from 0 s on."""
    phase = time % (stance + flight)
    peak = 0.5 * np.pi * (stance + flight) / stance
    return np.where(phase < stance, peak * np.sin(np.pi * phase / stance), 0.0)


def runner(stance, flight, steps):
    """A body that moves up and down as such forces do, soles that land in turn, and when they do."""
    fine = np.arange(0.0, steps * (stance + flight), 1e-4)
    gained = np.cumsum(GRAVITY * (pushes(fine, stance, flight) - 1.0)) * 1e-4
    height = np.cumsum(gained - gained.mean()) * 1e-4
    time = np.arange(0.0, fine[-1], 1.0 / RATE)
    body = human(1.75, 75.0)
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[:, 2] += np.interp(time, fine, height)
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    found = Reconstruction(body, time, q, targets, np.zeros((len(time), 1)))
    downs = (stance + flight) * np.arange(steps)
    soles = {}
    for first, name in enumerate(("left_foot", "right_foot")):
        away = np.min(
            [np.clip(np.maximum(d - time, time - d - stance), 0.0, None) for d in downs[first::2]], 0
        )
        heel = np.column_stack([np.zeros((len(time), 2)), np.minimum(2.0 * away, LIFT)])
        soles[name] = heel, heel + TOES
    return found, soles, [(("left_foot", "right_foot")[k % 2], d, d + stance) for k, d in enumerate(downs)]


def support(name, start, end, last):
    nowhere = np.zeros(3)
    return Support(name, start, min(end, last), nowhere, nowhere, nowhere, start > 0.0, end < last)


def on_frame(instant):
    return round(instant * RATE) / RATE


@pytest.mark.parametrize(("stance", "flight"), [(0.27, 0.1), (0.22, 0.13), (0.2, 0.12)])
@pytest.mark.parametrize(("late", "longer"), [(0.05, -0.04), (0.04, 0.05), (-0.03, -0.03)])
def test_stances_of_a_runner_are_when_the_force_is(stance, flight, late, longer):
    found, soles, steps = runner(stance, flight, 8)
    last = float(found.time[-1])
    # The fifth stance is missed, the others are late or early, too short or too long.
    given = [
        support(name, on_frame(start + late if start else 0.0), on_frame(end + longer), last)
        for number, (name, start, end) in enumerate(steps)
        if number != 4
    ]
    supports = sorted(by_the_force(given, found, soles, [0.0])[0], key=lambda one: (one.start, one.effector))
    assert [one.effector for one in supports] == [name for name, _, _ in steps]
    for one, (_, start, end) in list(zip(supports, steps, strict=True))[1:-1]:
        # Two frames, and what the low-pass leaves of a half-sine at its ends.
        assert one.start == pytest.approx(start, abs=0.025)
        assert one.end == pytest.approx(end, abs=0.025)


def test_who_does_not_fall_keeps_all_supports():
    # A walk: the force is between 0.7 and 1.3 of the weight.
    body, time = human(1.75, 75.0), np.arange(0.0, 3.0, 1.0 / RATE)
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[:, 2] -= 0.3 * GRAVITY / (4.0 * np.pi) ** 2 * np.sin(4.0 * np.pi * time)
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    found = Reconstruction(body, time, q, targets, np.zeros((len(time), 1)))
    still = np.zeros((len(time), 3))
    soles = {"left_foot": (still, still + TOES), "right_foot": (still, still + TOES)}
    last = float(time[-1])
    given = [support("left_foot", 0.0, 1.6, last), support("right_foot", 1.5, last, last)]
    assert by_the_force(given, found, soles, [0.0])[0] == tuple(given)


@pytest.mark.parametrize(("stance", "flight"), [(0.3, 0.05), (0.27, 0.1), (0.22, 0.13), (0.17, 0.13)])
def test_the_threshold_is_what_the_low_pass_leaves_at_the_ends_of_a_stance(stance, flight):
    time = np.arange(0.0, 6.0 * (stance + flight), 1e-3)
    force = low_passed(pushes(time, stance, flight), CUTOFF, 1e3)
    down = 3.0 * (stance + flight)
    for instant in (down, down + stance):
        assert np.interp(instant, time, force) == pytest.approx(FALLING, abs=0.12)


def recorded(folder, *parts):
    path = folder.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path.name} is not there")
    return read_recording(path)


@pytest.mark.parametrize("name", ["09_01", "16_35", "127_08"])
def test_a_recorded_runner_needs_little_force_in_flight(recordings_folder, name):
    found = reconstruct(recorded(recordings_folder, "cmu_asf_amc", f"{name}.amc"))
    motion = dynamics_of(found)  # of 5 Hz, all three components: not what the supports are found with
    force = np.linalg.norm(motion.wrench[:, :3], axis=1) / (GRAVITY * motion.body.mass)
    inside = (found.time > AT_END) & (found.time < found.time[-1] - AT_END)
    left = []
    for with_force in (False, True):
        flight = np.ones(len(found.time), dtype=bool)
        for one in supports_of(found, with_force=with_force).supports:
            flight &= (found.time < one.start) | (found.time > one.end)
        left.append(float(np.sqrt(np.mean(force[flight & inside] ** 2))))
    alone, both = left
    assert both < 0.4
    assert both < 0.8 * alone


def test_every_step_of_a_recorded_sprint_is_found(recordings_folder):
    found = supports_of(reconstruct(recorded(recordings_folder, "cmu_asf_amc", "127_05.amc")))
    sprint = [one.effector[0] for one in found.supports if one.start < 0.95]
    assert sprint == ["r", "l", "r", "l", "r", "l"]


def test_a_drop_jump_lands_and_leaves_when_the_plates_say(recordings_folder):
    path = next(recordings_folder.rglob("DJ1.trc"), None)
    if path is None:
        pytest.skip("the drop jump is not there")
    recording = read_recording(path)
    found = supports_of(reconstruct(recording), start=recording.start)
    errors = [abs(one.error) for one in timing_errors(found, recording.plates)]
    # Two frames of 100 Hz; by the feet alone 40 to 50 ms.
    assert len(errors) == 6
    assert max(errors) <= 0.025


def test_feet_that_swing_in_the_air_carry_nothing():
    """Somebody who hangs still, both feet to and fro between 3 and 53 cm above a surface."""
    time = np.arange(0.0, 4.0, 1.0 / RATE)
    body = human(1.75, 75.0)
    q = np.tile(body.standing_posture(), (len(time), 1))
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    found = Reconstruction(body, time, q, targets, np.zeros((len(time), 1)))
    swing = np.cos(2.0 * np.pi * time / 1.5)
    heel = np.column_stack([1.0 * swing, 0.0 * time, 0.28 + 0.25 * swing])
    soles = {"left_foot": (heel, heel + TOES), "right_foot": (heel * [-1.0, 1.0, 1.0], heel + TOES)}
    assert by_the_force((), found, soles, (0.0,))[0] == ()
