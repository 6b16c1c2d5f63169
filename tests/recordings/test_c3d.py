"""C3D files: places, gaps, plates and events of one written here, the real ones, and damaged copies."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.recordings import read_c3d, read_recording
from manikin.recordings.readers.c3d_layout import Parameter, c3d_frames, c3d_layout, of_long_trial

CORNERS = [[0.6, 0.4, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.6, 0.0, 0.0]]
"""Of the plate, in the order of the format: (+x, +y) of the plate's own axes first [m]."""


def parameter(group, name, kind, dimensions, raw):
    body = struct.pack("<bB", kind, len(dimensions)) + bytes(dimensions) + raw + b"\0"
    return struct.pack("<bb", len(name), group) + name.encode() + struct.pack("<h", len(body) + 2) + body


def group(number, name):
    return struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<hB", 3, 0)


def texts(words, width=16):
    return -1, (width, len(words)), b"".join(word.encode("latin-1").ljust(width) for word in words)


def reals(values, dimensions=None):
    flat = np.asarray(values, dtype="<f4")
    return 4, (flat.size,) if dimensions is None else dimensions, flat.tobytes()


def integers(values, dimensions=None):
    flat = np.asarray(values).astype("<i2")
    return 2, (flat.size,) if dimensions is None else dimensions, flat.tobytes()


def parameters_of(count, frames, samples, rate, first):
    """Parameters by group and name."""
    return {
        "POINT": {
            "USED": integers([count], ()), "FRAMES": integers([frames], ()), "SCALE": reals([-1.0], ()),
            "RATE": reals([rate], ()), "DATA_START": integers([5], ()), "UNITS": texts(["mm"], 2),
            "LABELS": texts(["LASI", "RASI", "LKneeAngles"]), "DESCRIPTIONS": texts([""] * 3, 1),
            "ANGLES": texts(["LKneeAngles"]), "X_SCREEN": texts(["+X"], 2), "Y_SCREEN": texts(["+Z"], 2),
        },
        "ANALOG": {
            "USED": integers([6], ()), "LABELS": texts(["Fx", "Fy", "Fz", "Mx", "My", "Mz"]),
            "DESCRIPTIONS": texts([""] * 6, 1), "GEN_SCALE": reals([1.0], ()), "SCALE": reals([1.0] * 6),
            "OFFSET": integers([0] * 6), "UNITS": texts(["N"] * 3 + ["Nmm"] * 3, 4),
            "RATE": reals([rate * samples], ()), "FORMAT": texts(["SIGNED"], 6), "BITS": integers([16], ()),
        },
        "FORCE_PLATFORM": {
            "USED": integers([1], ()), "TYPE": integers([2]), "ZERO": integers([1, 0]),
            "CORNERS": reals(1000.0 * np.array(CORNERS), (3, 4, 1)), "ORIGIN": reals([0, 0, -40], (3, 1)),
            "CHANNEL": integers([1, 2, 3, 4, 5, 6], (6, 1)),
        },
        "EVENT": {
            "USED": integers([1], ()), "CONTEXTS": texts(["Left"]), "LABELS": texts(["Foot Strike"]),
            "TIMES": reals([0.0, (first + 1) / rate], (2, 1)),
        },
    }  # fmt: skip


def c3d_bytes(points, analogs, rate=100.0, first=11, extra=()):
    """The file.

    Args:
        points: (n, 3, 4) places [mm] and residuals of markers LASI, RASI and of LKneeAngles.
        analogs: (n, s, 6) channels of the plate [N, N.mm].
        extra: Parameters to be changed or added, ``((group, name), value)``.
    """
    frames, count, samples = len(points), points.shape[1], analogs.shape[1]
    groups = parameters_of(count, frames, samples, rate, first)
    for (name, key), value in extra:
        groups.setdefault(name, {})[key] = value
    section = b""
    for number, (name, parameters) in enumerate(groups.items(), start=1):
        section += group(number, name)
        section += b"".join(parameter(number, key, *value) for key, value in parameters.items())
    blocks = (len(section) + 5) // 512 + 1
    head = struct.pack(
        "<BBHHHHHfHHf", 2, 0x50, count, 6 * samples, first, first + frames - 1, 0, -1.0, 2 + blocks, samples,
        rate,
    ).ljust(512, b"\0")  # fmt: skip
    data = b"".join(
        frame.astype("<f4").tobytes() + sampled.astype("<f4").tobytes()
        for frame, sampled in zip(points, analogs, strict=True)
    )
    return head + (struct.pack("<BBBB", 1, 0x50, blocks, 84) + section).ljust(512 * blocks, b"\0") + data


def small():
    """Four frames in which the second marker is lost once; 700 N press 0.1 m before the plate's middle."""
    points = np.zeros((4, 3, 4))
    points[:, 0, :3], points[:, 1, :3] = [100.0, 200.0, 900.0], [100.0, 0.0, 900.0]
    points[2, 1] = [0.0, 0.0, 0.0, -1.0]
    points[:, 2, :3] = [10.0, 20.0, 30.0]
    # The plate's y is the world's, its z points down: it measures what it does to the ground's frame.
    analogs = np.zeros((4, 2, 6))
    analogs[:, :, 2], analogs[:, :, 4] = 700.0, -700.0 * 100.0
    return points, analogs


@pytest.fixture
def c3d_file(tmp_path):
    file = tmp_path / "small.c3d"
    file.write_bytes(c3d_bytes(*small()))
    return file


def test_c3d_by_hand(c3d_file):
    """Millimetres to metres, a lost marker is NaN, angles are no markers, the clock is the trial's."""
    found = read_c3d(c3d_file)
    assert found.marker_names == ("LASI", "RASI")
    assert found.rate == 100.0
    assert found.start == pytest.approx(0.1)  # frame 11 at 100 Hz
    np.testing.assert_allclose(found.marker("LASI"), [[0.1, 0.2, 0.9]] * 4, atol=1e-7)
    assert [(gap.marker, gap.first, gap.stop) for gap in found.gaps] == [("RASI", 2, 3)]
    (event,) = found.events
    assert (event.label, event.context) == ("Foot Strike", "Left")
    assert event.time == pytest.approx(found.time[2], abs=1e-6)


def test_plate_by_hand(c3d_file):
    """Corners in metres, two samples per frame; the centre of pressure is where the force was put."""
    (plate,) = read_c3d(c3d_file).plates
    assert plate.rate == 200.0
    assert len(plate) == 8
    np.testing.assert_allclose(plate.corners, CORNERS, atol=1e-6)
    np.testing.assert_allclose(plate.origin, [0.3, 0.2, 0.0], atol=1e-6)
    np.testing.assert_allclose(plate.force, [[0.0, 0.0, 700.0]] * 8, atol=1e-3)
    np.testing.assert_allclose(plate.cop, [[0.4, 0.2, 0.0]] * 8, atol=1e-5)
    # About the world's origin: r x F.
    np.testing.assert_allclose(plate.wrenches[0, 3:], [0.2 * 700.0, -0.4 * 700.0, 0.0], atol=1e-2)
    assert read_c3d(c3d_file, plates=False).plates == ()


def test_a_missing_rate_of_the_channels_is_that_of_the_samples_of_a_frame(tmp_path, c3d_file):
    """Points, gaps and plates are those of the file with its rate, and a remark says what was missing."""
    file = tmp_path / "without.c3d"
    file.write_bytes(c3d_bytes(*small(), extra=[(("ANALOG", "RATE"), reals([0.0], ()))]))
    found, known = read_c3d(file), read_c3d(c3d_file)
    np.testing.assert_array_equal(found.positions, known.positions)
    np.testing.assert_allclose(found.plates[0].wrenches, known.plates[0].wrenches, atol=1e-9)
    assert (found.plates[0].rate, found.marker_names) == (200.0, known.marker_names)
    assert found.remarks == ("ANALOG:RATE is missing: 200 Hz by the samples of a frame",)


def test_the_axis_that_points_up_is_turned_to_z(tmp_path):
    """Markers and plate alike, whether the file declares the axis or the caller does."""
    points, analogs = small()
    plain, turned = tmp_path / "plain.c3d", tmp_path / "turned.c3d"
    plain.write_bytes(c3d_bytes(points, analogs))
    turned.write_bytes(c3d_bytes(points, analogs, extra=[(("POINT", "Y_SCREEN"), texts(["+Y"], 2))]))
    found, given_up = read_c3d(turned), read_c3d(plain, up="y")
    np.testing.assert_allclose(found.marker("LASI")[0], [0.1, -0.9, 0.2], atol=1e-7)
    np.testing.assert_allclose(given_up.positions, found.positions)
    np.testing.assert_allclose(found.plates[0].force[0], [0.0, -700.0, 0.0], atol=1e-3)


@pytest.mark.parametrize("unsigned", [False, True])
@pytest.mark.parametrize("extra", [[], [(("ANALOG", "OFFSET"), integers([0, 3, 9, 200, 1, 0]))]])
def test_frames_are_those_that_another_reader_finds(tmp_path, extra, unsigned):
    """ezc3d, a C++ library; bit for bit."""
    ezc3d = pytest.importorskip("ezc3d")
    words = [(("ANALOG", "FORMAT"), texts(["UNSIGNED"], 8))] if unsigned else []
    content = c3d_bytes(*small(), extra=extra + words)
    file = tmp_path / "small.c3d"
    file.write_bytes(content)
    points, channels = c3d_frames(content, c3d_layout(content, "small.c3d"))
    other = ezc3d.c3d(str(file))["data"]
    np.testing.assert_array_equal(points, other["points"][:3].transpose(2, 1, 0))
    np.testing.assert_array_equal(channels, other["analogs"][0])


def test_offsets_of_unsigned_channels_are_unsigned():
    """An offset of 40000 in two bytes is -25536 where channels have a sign."""
    points, analogs = small()
    offset, whole = np.array([40000, 0, 0, 0, 0, 0]).astype(np.uint16), c3d_bytes(points, analogs)
    _, plain = c3d_frames(whole, c3d_layout(whole, "small.c3d"))
    for word, moved in (("UNSIGNED", -40000.0), ("SIGNED", 25536.0)):
        extra = [(("ANALOG", "FORMAT"), texts([word], 8)), (("ANALOG", "OFFSET"), integers(offset))]
        content = c3d_bytes(points, analogs, extra=extra)
        _, found = c3d_frames(content, c3d_layout(content, "small.c3d"))
        np.testing.assert_allclose(found[0] - plain[0], moved)
        np.testing.assert_array_equal(found[1:], plain[1:])


def test_frames_beyond_the_header_are_those_of_the_trial():
    """70000 frames from number 66000 on; the header has no number above 65535, and is the truth below it."""
    content = c3d_bytes(*small())
    layout = c3d_layout(content, "small.c3d")
    words = {"START": 66000, "END": 135999}
    parameters = {
        ("TRIAL", f"ACTUAL_{name}_FIELD"): Parameter(2, (2,), np.array([value], "<u4").tobytes())
        for name, value in words.items()
    }
    long = replace(layout, parameters={**layout.parameters, **parameters})
    found = of_long_trial(long, 65535)
    assert (found.first_frame, found.frames) == (66000, 70000)
    assert of_long_trial(long, 65534) is long
    told = Parameter(4, (), np.float32(70000.0).tobytes())
    other = replace(layout, parameters={**layout.parameters, ("POINT", "FRAMES"): told})
    assert of_long_trial(other, 65535).frames == 70000


# --- broken files -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (("POINT", "USED"), integers([4], ()), "POINT:USED"),
        (("POINT", "RATE"), reals([0.0], ()), "RATE"),
        (("POINT", "RATE"), reals([np.nan], ()), "RATE"),
        (("POINT", "UNITS"), texts(["parsec"], 8), "unit of length"),
        (("POINT", "Y_SCREEN"), texts(["up"], 2), "points up"),
        (("POINT", "ANGLES"), texts(["LASI", "RASI", "LKneeAngles"]), "no point is a place"),
        (("ANALOG", "USED"), integers([600], ()), "ANALOG:USED"),
        (("ANALOG", "SCALE"), reals([1.0]), "ANALOG:SCALE"),
        (("FORCE_PLATFORM", "USED"), integers([9], ()), "force plates"),
        (("FORCE_PLATFORM", "TYPE"), integers([7]), "type"),
        (("FORCE_PLATFORM", "TYPE"), integers([3]), "CHANNEL"),
        (("FORCE_PLATFORM", "TYPE"), integers([4]), "CAL_MATRIX"),
        (("FORCE_PLATFORM", "CORNERS"), reals([0.0] * 3), "CORNERS"),
        (("FORCE_PLATFORM", "CORNERS"), reals([0.0] * 12, (3, 4, 1)), "NaN|no surface"),
        (("FORCE_PLATFORM", "ORIGIN"), reals([np.nan] * 3, (3, 1)), "NaN"),
        (("EVENT", "TIMES"), reals([0.0, np.inf], (2, 1)), "EVENT:TIMES"),
        (("EVENT", "TIMES"), reals([0.0] * 3), "EVENT:TIMES"),
        (("EVENT", "X"), (4, (1,) * 9, b"\0" * 4), "dimensions"),
        (("EVENT", "X"), (2, (255, 255, 255, 255, 0), b""), "dimensions"),
        (("ROTATION", "USED"), integers([1], ()), "rotations"),
    ],
)
def test_broken_parameters_are_refused_in_one_line(tmp_path, key, value, message):
    file = tmp_path / "broken.c3d"
    file.write_bytes(c3d_bytes(*small(), extra=[(key, value)]))
    with pytest.raises(InputError, match=message) as error:
        read_c3d(file)
    assert "\n" not in str(error.value)
    assert "valid: " in str(error.value)


def test_a_plate_without_its_channels_is_left_out_and_said(tmp_path):
    """Of 6 channels the plate names a 99th: the markers are read all the same."""
    file = tmp_path / "channels.c3d"
    wrong = integers([1, 2, 3, 4, 5, 99], (6, 1))
    file.write_bytes(c3d_bytes(*small(), extra=[(("FORCE_PLATFORM", "CHANNEL"), wrong)]))
    found = read_c3d(file)
    assert len(found) == 4
    assert not found.plates
    assert "channels are not among the 6" in found.remarks[0]


def test_moments_in_another_unit_of_length_are_converted_where_the_plate_says_so(tmp_path):
    """150 N.m beside millimetres: taken as N.mm the force would act in the middle, else 0.2 m from it."""
    points, analogs = small()
    channels = np.zeros_like(analogs)
    channels[..., 2], channels[..., 4] = -750.0, 150.0
    file = tmp_path / "units.c3d"
    units = (("ANALOG", "UNITS"), texts(["N"] * 3 + ["N.m"] * 3))
    file.write_bytes(c3d_bytes(points, channels, extra=[units]))
    mixed = read_c3d(file).plates[0]
    file.write_bytes(c3d_bytes(points, channels * [1, 1, 1, 1e3, 1e3, 1e3]))
    plain = read_c3d(file).plates[0]
    np.testing.assert_allclose(mixed.wrenches, plain.wrenches, rtol=1e-5)


@pytest.mark.parametrize(
    "name", [(g, n) for g, group in parameters_of(3, 4, 2, 100.0, 11).items() for n in group]
)
def test_a_parameter_of_another_kind_is_read_or_refused(tmp_path, name):
    """Empty, without dimensions, too long, of another type: each of them once made the library crash."""
    file = tmp_path / "other.c3d"
    values = [
        integers([], (0,)), integers([], (4, 0)), integers([3], ()), integers([-1] * 8), reals([], (0,)),
        reals([-np.inf] * 2), reals([0.0] * 250, (125, 2)), texts([], 2), (-1, (), b"x"), (-1, (0, 3), b""),
        texts(["\xff"] * 200, 1), (1, (3,), b"\0\1\2"), (-1, (1,), b"\xff"), (-1, (2, 2, 2), b"abcdefgh"),
    ]  # fmt: skip
    for value in values:
        file.write_bytes(c3d_bytes(*small(), extra=[(name, value)]))
        message = ""
        try:
            assert len(read_c3d(file)) == 4
        except InputError as refusal:
            message = str(refusal)
        assert "\n" not in message


@pytest.mark.parametrize("content", [b"", b"text", b"\0" * 2000, b"\x02P" + b"\xff" * 3000, b"\x01P" * 900])
def test_what_is_no_c3d_file_is_refused_in_one_line(tmp_path, content):
    file = tmp_path / "junk.c3d"
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"junk\.c3d: .*; valid: ") as error:
        read_recording(file)
    assert "\n" not in str(error.value)


def test_every_shorter_file_is_refused(c3d_file):
    """Never a shorter recording: the header says how many frames there have to be."""
    whole = c3d_file.read_bytes()
    for length in range(0, len(whole), 13):
        c3d_file.write_bytes(whole[:length])
        with pytest.raises(InputError):
            read_c3d(c3d_file)


@given(
    st.lists(st.tuples(st.floats(0.0, 1.0), st.binary(min_size=1, max_size=4)), min_size=1, max_size=4),
    st.sampled_from(["header", "parameters", "data"]),
)
def test_a_damaged_c3d_file_is_read_or_refused(c3d_file, changes, part):
    """Bytes replaced in any part: never a crash, a hang or another exception."""
    whole = c3d_file.read_bytes()
    blocks = whole[512 + 2]
    ends = {
        "header": (0, 24),
        "parameters": (516, 512 * (1 + blocks)),
        "data": (512 * (1 + blocks), len(whole)),
    }
    content = bytearray(whole)
    for share, junk in changes:
        first, stop = ends[part]
        at = first + int(share * (stop - first - len(junk)))
        content[at : at + len(junk)] = junk
    c3d_file.write_bytes(content)
    message = ""
    try:
        found = read_c3d(c3d_file)
        assert not np.any(np.isinf(found.positions))
        assert all(np.all(np.isfinite(plate.wrenches)) for plate in found.plates)
    except InputError as refusal:
        message = str(refusal)
    finally:
        c3d_file.write_bytes(whole)
    assert "\n" not in message


# --- real recordings ----------------------------------------------------------------------------


def test_foot_strikes_of_a_real_recording_are_those_of_its_plates(recordings_folder):
    """Events that a person marked fall on the first frame in which the plate is pressed: one clock."""
    found = read_c3d(recordings_folder / "grf" / "btkdata" / "PiG_Motion3_FF.c3d")
    strikes = np.array([event.time for event in found.events if event.label == "Foot Strike"])
    pressed = [plate.time[np.argmax(plate.pressed)] for plate in found.plates]
    assert len(pressed) == 3
    for instant in pressed:
        assert np.abs(strikes - instant).min() < 1.0 / found.rate


def test_the_computed_centre_of_mass_of_a_real_recording_is_in_the_pelvis(recordings_folder):
    """Millimetres, axes and names of another program's own output."""
    found = read_c3d(recordings_folder / "grf" / "btkdata" / "PiG_Motion-FlatFoot-One.c3d")
    pelvis = np.mean([found.marker(name) for name in ("LASI", "RASI", "LPSI", "RPSI")], axis=0)
    apart = np.linalg.norm(found.marker("CentreOfMass") - pelvis, axis=1)
    assert apart.max() < 0.15
    heads = found.marker("LFHD")[:, 2]
    assert 1.5 < heads.min() < heads.max() < 2.0
