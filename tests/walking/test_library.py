"""The motion library that comes with the package: its file, its cycles, their blends."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.body.limbs import mirrored
from manikin.errors import BodyError, InputError
from manikin.numerics.signals import fourier_basis
from manikin.walking.gait.blend import ControlSpace, Gait, travelled
from manikin.walking.gait.follow_path import stance_slides
from manikin.walking.gait.motion_library import (
    MIRRORED,
    ROOT,
    leg_length,
    load_library,
    reference_body,
    save_library,
)
from manikin.walking.gait.stance_foot import Legs, put_in_place

LIBRARY = load_library()
BODY = reference_body()
GAIT = Gait(LIBRARY, BODY)
PHASE = np.arange(64) / 64
CLASSES = ("walk straight", "walk veer", "walk 90 turn", "walk turn", "turn on spot", "sidestep",
           "diagonal back-right", "backward", "run straight", "stand")  # fmt: skip


def walk(velocity, cycles=4):
    """Frames of a steady walk at some 60 a second, a whole number to a cycle; postures with feet in place."""
    blend = GAIT.blend(np.array([velocity], dtype=float))
    period = float(GAIT.period(blend)[0])
    count = round(60.0 * period)
    time = np.arange(cycles * count + 1) * period / count
    blend = GAIT.blend(np.tile(velocity, (len(time), 1)).astype(float))
    frames = GAIT.frames(blend, time / period, travelled(blend.velocity, time))
    swing, legs = frames.swing(), Legs(BODY)
    q, sink = legs.reached(frames, put_in_place(legs.feet(frames), swing))
    return frames, swing, q, sink, time[count]


def hinges_rms(first, second):
    """Root mean square difference of the hinges over a cycle [deg]."""
    return float(np.degrees(np.sqrt(np.mean((fourier_basis(PHASE) @ (first - second))[:, len(ROOT) :] ** 2))))


def test_what_is_in_it():
    assert len(LIBRARY) >= 68
    assert set(CLASSES) <= set(LIBRARY.kinds)
    assert any("NSF EIA-0196217" in text for text in LIBRARY.acknowledgements)
    assert any("ACCAD" in text and "CC BY 3.0" in text for text in LIBRARY.acknowledgements)
    assert LIBRARY.leg == pytest.approx(leg_length(BODY))


def test_angles_are_within_the_ranges():
    """But for the few degrees by which a truncated series overshoots."""
    angles = (fourier_basis(PHASE) @ LIBRARY.coefficients)[..., len(ROOT) :]
    over = np.maximum(angles - BODY.upper, BODY.lower - angles).max(axis=(0, 1))
    assert np.degrees(np.median(np.maximum(over, 0.0))) < 5.0


def test_a_cycle_comes_back_at_its_own_velocity():
    """Joint RMS of at most 2 degrees; here exactly, but for rounding."""
    blend = GAIT.blend(LIBRARY.velocities)
    assert not blend.outside.any()
    for cycle in range(len(LIBRARY)):
        mixed = np.tensordot(blend.weights[cycle], LIBRARY.coefficients[blend.cycles[cycle]], axes=1)
        assert hinges_rms(mixed, LIBRARY.coefficients[cycle]) < 0.01


def test_weights_give_the_velocity():
    """Equation 6.2: weights are positive, add up to 1 and mix the velocities to the one asked for."""
    rng = np.random.default_rng(1)
    wanted = rng.uniform([-1.5, -0.8, -2.0], [4.0, 0.8, 2.0], (500, 3))
    blend = GAIT.blend(wanted)
    mixed = np.einsum("nk,nki->ni", blend.weights, LIBRARY.velocities[blend.cycles])
    np.testing.assert_allclose(mixed, blend.velocity, atol=1e-9)
    np.testing.assert_allclose(blend.velocity[~blend.outside], wanted[~blend.outside], atol=1e-9)
    np.testing.assert_allclose(blend.weights.sum(axis=1), 1.0)
    assert blend.weights.min() >= 0.0
    assert 0 < blend.outside.sum() < len(wanted)


def test_outside_the_nearest_velocity_is_walked():
    """No other point of the hull is nearer than the one that is taken."""
    rng = np.random.default_rng(2)
    wanted = rng.uniform(-8.0, 8.0, (100, 3))
    space = ControlSpace(LIBRARY)
    blend = space.blend(wanted)
    taken = np.linalg.norm((blend.velocity - wanted) * space.scale, axis=1)
    shares = rng.dirichlet(np.full(len(LIBRARY), 0.05), 3000)
    others = shares @ LIBRARY.velocities * space.scale
    away = np.linalg.norm(others[None] - (wanted * space.scale)[:, None], axis=2).min(axis=1)
    assert np.all(taken <= away + 1e-9)
    again = space.blend(blend.velocity)
    np.testing.assert_allclose(again.velocity, blend.velocity, atol=1e-6)


def test_mirror_images():
    """Posture and root of a mirrored cycle, half a step later, are the reflected ones."""
    for name in [n for n in LIBRARY.names if n.endswith(MIRRORED)][:10]:
        one, other = (LIBRARY.names.index(n) for n in (name.removesuffix(MIRRORED), name))
        np.testing.assert_allclose(LIBRARY.velocities[other], LIBRARY.velocities[one] * [1.0, -1.0, -1.0])
        both = [GAIT.blend(LIBRARY.velocities[[i] * 8]) for i in (one, other)]
        phase = np.arange(8) / 8
        off = LIBRARY.events[one, 1]
        at_origin = np.zeros((8, 3))
        first = GAIT.frames(both[0], phase + off, at_origin).q
        second = GAIT.frames(both[1], phase, at_origin).q
        np.testing.assert_allclose(second, mirrored(BODY, first), atol=1e-9)


@pytest.mark.parametrize(("speed", "tolerance"), [(0.5, 1e-6), (1.2, 1e-6), (3.0, 0.1)])
def test_straight_walks_are_symmetric(speed, tolerance):
    """The right half of the cycle is the reflected left half.

    Exactly where symmetric cycles are blended only; one-sided ones with their mirror images step unevenly.
    """
    blend = GAIT.blend(np.tile([speed, 0.0, 0.0], (16, 1)))
    phase, place = np.arange(16) / 16, np.zeros((16, 3))
    q = GAIT.frames(blend, phase, place).q
    np.testing.assert_allclose(GAIT.frames(blend, phase + 0.5, place).q, mirrored(BODY, q), atol=tolerance)


@pytest.mark.parametrize(
    "velocity",
    [(0.5, 0, 0), (1.2, 0, 0), (1.6, 0, 0), (1.0, 0, 0.6), (1.0, 0.05, -0.6), (0, 0.4, 0), (0, 0, 1.5),
     (-0.7, 0, 0), (0.6, 0.3, 0), (-0.5, -0.4, 0), (3.0, 0, 0)],
)  # fmt: skip
def test_steady_walks(velocity):
    """Velocity within 3 %, feet within 5 mm in every stance and on the floor, joints within their limits."""
    frames, swing, q, sink, period = walk(velocity)
    before = stance_slides(BODY, frames.q, swing < 0.0)
    after = stance_slides(BODY, q, swing < 0.0)
    assert before.max() > 0.01
    assert after.max() < 0.005
    assert sink.max() < 0.1
    assert np.all((q[:, 7:] >= BODY.lower) & (q[:, 7:] <= BODY.upper))
    # Mean velocity of the pelvis over whole cycles, in the axes of its own heading at their begins.
    count = (len(q) - 1) // 4
    heading = np.unwrap(2.0 * np.arctan2(q[:, 5], q[:, 6]))
    cycles = 3
    turned = heading[cycles * count] - heading[0]
    expected = travelled(np.array(velocity, dtype=float), np.array(cycles * period))
    cos, sin = np.cos(expected[2]), np.sin(expected[2])
    place = expected[:2] + np.array([[cos, -sin], [sin, cos]]) @ q[0, :2]
    assert np.hypot(*(q[cycles * count, :2] - place)) <= 0.03 * np.hypot(*expected[:2]) + 1e-6
    assert abs(turned - expected[2]) <= 0.03 * abs(expected[2]) + 1e-6


def test_feet_of_every_cycle_stand():
    """At the velocity of every cycle no foot slides by 5 mm in a stance; as blended, most do by more."""
    before, after = [], []
    for velocity in LIBRARY.velocities:
        frames, swing, q, _, _ = walk(velocity, cycles=2)
        before.append(stance_slides(BODY, frames.q, swing < 0.0))
        after.append(stance_slides(BODY, q, swing < 0.0))
    assert np.median(np.concatenate(before)) > 0.02
    assert np.concatenate(after).max() < 0.005


def test_leaving_a_cycle_out():
    """Interior cycles from the others: joint RMS of at most 8 degrees in the median."""
    space = ControlSpace(LIBRARY)
    found = []
    for cycle in np.flatnonzero(~space.on_hull):
        others = np.delete(np.arange(len(LIBRARY)), cycle)
        rest = LIBRARY.chosen(others)
        blend = ControlSpace(rest).blend(LIBRARY.velocities[[cycle]])
        mixed = np.tensordot(blend.weights[0], rest.coefficients[blend.cycles[0]], axes=1)
        found.append(hinges_rms(mixed, LIBRARY.coefficients[cycle]))
    assert len(found) > 60
    assert np.median(found) <= 8.0


def test_other_statures():
    """Velocities scale with the length of the legs: the same blend at the same multiple."""
    tall = human(1.95)
    gait = Gait(LIBRARY, tall)
    scale = leg_length(tall) / LIBRARY.leg
    one, other = GAIT.blend(np.array([[1.0, 0.1, 0.3]])), gait.blend(np.array([[scale, 0.1 * scale, 0.3]]))
    np.testing.assert_allclose(one.weights, other.weights, atol=1e-9)


def test_file_keeps_everything(tmp_path):
    save_library(LIBRARY, tmp_path / "library.npz")
    found = load_library(tmp_path / "library.npz")
    assert (found.names, found.kinds, found.acknowledgements) == (
        LIBRARY.names, LIBRARY.kinds, LIBRARY.acknowledgements,
    )  # fmt: skip
    for name in ("velocities", "periods", "events", "coefficients"):
        np.testing.assert_array_equal(getattr(found, name), getattr(LIBRARY, name))
    assert (tmp_path / "library.npz").stat().st_size < 500_000


def arrays(file):
    with np.load(file) as archive:
        return dict(archive)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("velocities", None, "has no 'velocities'"),
        ("format", np.array("else"), "format"),
        ("coefficients", np.full((3, 17, 45), np.nan), "motion library"),
        ("coefficients", np.zeros((3, 17)), "dimensions"),
        ("periods", np.array(["a"]), "periods"),
        ("joint_names", np.array(["knee"]), "hinges"),
        ("leg", np.array(-1.0), "leg length"),
        ("kinds", np.array(["walk"]), "kinds"),
        ("sided", np.array([True]), "sided"),
        ("events", "reversed", "order"),
    ],
)
def test_bad_content_is_refused_in_one_line(tmp_path, key, value, message):
    file = tmp_path / "library.npz"
    save_library(LIBRARY, file)
    content = arrays(file)
    if value is None:
        del content[key]
    elif isinstance(value, str):
        content[key] = content[key][:, ::-1]
    else:
        content[key] = value
    np.savez(file, **content)
    with pytest.raises(InputError, match=message) as caught:
        load_library(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("damage", ["missing", "empty", "binary", "truncated", "pickled", "array", "folder"])
def test_damaged_files_are_refused(tmp_path, damage):
    file = tmp_path / "library.npz"
    save_library(LIBRARY, file)
    content = file.read_bytes()
    if damage == "missing":
        file.unlink()
    elif damage == "empty":
        file.write_bytes(b"")
    elif damage == "binary":
        file.write_bytes(bytes(range(256)) * 40)
    elif damage == "truncated":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "pickled":
        np.savez(file, **(arrays(file) | {"names": np.array([{"a": 1}], dtype=object)}))
    elif damage == "array":
        with file.open("wb") as stream:
            np.save(stream, np.zeros(3))
    else:
        file.unlink()
        file.mkdir()
    with pytest.raises(InputError) as caught:
        load_library(file)
    assert "\n" not in str(caught.value)


def test_flipped_bytes_never_crash(tmp_path):
    """A damaged file is refused or, where the damage is in unused bytes, read."""
    file = tmp_path / "library.npz"
    save_library(LIBRARY.chosen(range(6)), file)
    content, rng = bytearray(file.read_bytes()), np.random.default_rng(0)
    for _ in range(60):
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), 3):
            damaged[place] ^= int(rng.integers(1, 256))
        file.write_bytes(bytes(damaged))
        with suppress(InputError):
            load_library(file)


def test_misuse():
    with pytest.raises(BodyError, match="hinges"):
        Gait(replace(LIBRARY, joint_names=tuple(f"x{name}" for name in LIBRARY.joint_names)), BODY)
    with pytest.raises(InputError, match="span no volume"):
        ControlSpace(LIBRARY.chosen([0, 1, 2]))


@pytest.mark.parametrize("velocity", [(0.5, 0, 0), (1.2, 0, 0), (0, 0.4, 0), (-0.7, 0, 0), (3.0, 0, 0)])
def test_limbs_do_not_pass_through_each_other(velocity):
    """Nothing is deeper than 5 mm in anything else; legs of steady turns may cross and are not looked at."""
    _, _, q, _, _ = walk(velocity, cycles=3)
    data, geometry = BODY.pinocchio.createData(), pin.GeometryData(BODY.geometry)
    once = len(q) // 3
    for posture in q[once : 2 * once : 3]:
        pin.computeDistances(BODY.pinocchio, data, BODY.geometry, geometry, posture)
        assert min(result.min_distance for result in geometry.distanceResults) > -0.005
