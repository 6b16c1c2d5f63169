"""Header, parameters, frames and force-plate channels of a C3D file (c3d.org, user guide).

Nothing is read before it is checked: every record of the parameters lies in its section, counts agree with
each other, and the file is as long as they say.

In a plate's own axes x points from its second corner to the first one, y from the fourth to the first, and
z at right angles to both, into the ground of most plates. Its origin is the middle of the surface relative to
the origin of its sensors, which lie deeper; some programs write the opposite sign.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import prod
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray


def plate_load(
    kind: int, channels: FloatArray, corners: FloatArray, origin: FloatArray, calibration: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """(n, 3) force and (n, 3) moment about the middle of the corners, in their axes and the channels' units.

    Args:
        kind: Type of the plate: 1 force, centre of pressure and free moment; 2 force and moment; 3 eight
            forces of four sensors; 4 as 2 with a calibration matrix.
        channels: (c, n) its channels; its ``corners`` are (4, 3), its ``origin`` (3,).
        calibration: (6, 6), used by type 4 only.
    """
    x, y = corners[0] - corners[1], corners[0] - corners[3]
    z = np.cross(x, y)
    axes, origin = np.stack([x, np.cross(z, x), z], axis=1), -origin if origin[2] > 0.0 else origin
    with np.errstate(invalid="ignore", divide="ignore"):
        axes /= np.linalg.norm(axes, axis=0)  # NaN where the corners enclose no surface
    if kind == 1:
        force, zero = channels[:3].T, np.zeros(channels.shape[1])
        place, free = np.stack([*channels[3:5], zero], axis=1), np.stack([zero, zero, channels[5]], axis=1)
        return force @ axes.T, (np.cross(place, force) + free) @ axes.T
    if kind == 3:
        x12, x34, y14, y23, z1, z2, z3, z4 = channels[:8]
        force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
        a, b, depth = origin
        moment = np.stack(
            [b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1
        )
        return force @ axes.T, (moment + np.cross(force, [0.0, 0.0, depth])) @ axes.T
    load = channels[:6] if kind == 2 or calibration is None else calibration @ channels[:6]
    force, moment = load[:3].T, load[3:].T
    return force @ axes.T, (moment + np.cross(force, origin)) @ axes.T


BLOCK, _FASTEST = 512, 1e6
_LAST, _MOST_FRAMES = 65535, 1e9  # the largest number of a frame in the header
_INTEL, _DEC, _MIPS = 84, 85, 86
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}
_TEXT, _INTEGERS, _REAL = -1, (1, 2), 4
_DIMENSIONS, _ENTRIES = 7, 65535  # of one parameter, the most that the format has room for
_READ = ("POINT", "ANALOG", "FORCE_PLATFORM", "EVENT", "ROTATION")


@dataclass(frozen=True)
class Parameter:
    """One parameter: its type (-1 text, 1 byte, 2 integer, 4 real), dimensions and raw values."""

    kind: int
    dimensions: tuple[int, ...]
    raw: bytes

    @property
    def count(self) -> int:
        """Number of values."""
        return prod(self.dimensions)

    @property
    def is_text(self) -> bool:
        """Whether the values are texts."""
        return self.kind == _TEXT


@dataclass(frozen=True)
class C3dLayout:
    """Layout of a C3D file.

    Attributes:
        file: Its path, for messages.
        samples: Samples of each channel per frame.
        first_frame: Number of the first frame, counted from 1.
        processor: Kind of processor whose numbers these are: 84 Intel, 85 DEC, 86 MIPS.
        header_rate: Frames per second by the header [Hz].
        begin: First byte of the frames.
        real_frames: Whether the frames hold reals, else whole numbers to be scaled.
        parameters: By group and name, both in upper case.
    """

    file: str
    points: int
    channels: int
    samples: int
    first_frame: int
    frames: int
    processor: int
    parameters: Mapping[tuple[str, str], Parameter]
    header_rate: float
    begin: int
    real_frames: bool

    @property
    def rate(self) -> float:
        """Frames per second [Hz]: ``POINT:RATE``, or the header's where that is missing."""
        return self.real("POINT", "RATE") if ("POINT", "RATE") in self.parameters else self.header_rate

    @property
    def without_analog_rate(self) -> bool:
        """Whether the file has channels and ``ANALOG:RATE`` is missing or 0; the header has the samples."""
        return bool(self.channels) and self.real("ANALOG", "RATE") == 0.0

    def integers(self, group: str, name: str) -> NDArray[np.int64]:
        """(n,) values of a whole-numbered parameter, none where it is missing; InputError for other types."""
        parameter = self.parameters.get((group, name))
        if parameter is None:
            return np.zeros(0, dtype=np.int64)
        if parameter.kind not in _INTEGERS:
            raise self.error(f"{group}:{name} is no whole number", "whole numbers")
        kind = "u1" if parameter.kind == 1 else (">u2" if self.processor == _MIPS else "<u2")
        return np.frombuffer(parameter.raw, kind).astype(np.int64)

    def reals(self, group: str, name: str) -> FloatArray:
        """(n,) values of a real parameter, none where it is missing; InputError for other types."""
        parameter = self.parameters.get((group, name))
        if parameter is None:
            return np.zeros(0)
        if parameter.kind != _REAL:
            raise self.error(f"{group}:{name} is no real number", "real numbers")
        return _reals(parameter.raw, self.processor)

    def numbers(self, group: str, name: str) -> FloatArray:
        """(n,) values of a parameter of any numeric type; InputError for texts."""
        whole = (group, name) in self.parameters and self.parameters[group, name].kind in _INTEGERS
        return self.integers(group, name).astype(np.float64) if whole else self.reals(group, name)

    def real(self, group: str, name: str) -> float:
        """First value of a parameter, 0 where it is missing; InputError for texts."""
        return float(next(iter(self.numbers(group, name)), 0.0))

    def texts(self, group: str, name: str) -> list[str]:
        """Texts of a parameter, without what pads them; none where it is missing or a number."""
        parameter = self.parameters.get((group, name))
        if parameter is None or parameter.kind != _TEXT:
            return []
        width = parameter.dimensions[0]
        return [
            _text(parameter.raw[place * width : (place + 1) * width])
            for place in range(prod(parameter.dimensions[1:]))
        ]

    def count(self, group: str, name: str) -> int:
        """Number of values of a parameter, 0 where it is missing."""
        parameter = self.parameters.get((group, name))
        return parameter.count if parameter else 0

    def size(self, name: str) -> tuple[int, ...]:
        """Dimensions of a parameter of the force plates; none where it is missing."""
        parameter = self.parameters.get(("FORCE_PLATFORM", name))
        return parameter.dimensions if parameter else ()

    def error(self, wrong: str, valid: str) -> InputError:
        """What is wrong with the file, as one line."""
        return InputError(f"{self.file}: {wrong}; valid: {valid}")


def _text(raw: bytes) -> str:
    """Text in UTF-8, or else in Latin-1, as older programs write."""
    try:
        return raw.split(b"\0", 1)[0].decode().strip()
    except UnicodeDecodeError:
        return raw.split(b"\0", 1)[0].decode("latin-1").strip()


def _reals(raw: bytes, processor: int) -> FloatArray:
    """(n,) real numbers of four bytes each."""
    if processor == _DEC:  # the halves exchanged, the exponent greater by two
        halves = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1]
        return np.frombuffer(halves.tobytes(), "<f4").astype(np.float64) / 4.0
    return np.frombuffer(raw, ">f4" if processor == _MIPS else "<f4").astype(np.float64)


def c3d_frames(content: bytes, layout: C3dLayout) -> tuple[FloatArray, FloatArray]:
    """Points (n, m, 3) in the file's unit, NaN where not seen, and channels (c, n s), scaled."""
    points, each = layout.points, 4 * layout.points + layout.channels * layout.samples
    content = content[layout.begin : layout.begin + (4 if layout.real_frames else 2) * layout.frames * each]
    unsigned = layout.texts("ANALOG", "FORMAT") == ["UNSIGNED"]
    if layout.real_frames:
        factor, numbers = 1.0, _reals(content, layout.processor).reshape(layout.frames, each)
        samples = numbers[:, 4 * points :]
    else:
        whole = np.frombuffer(content, ">i2" if layout.processor == _MIPS else "<i2")
        factor, numbers = abs(layout.real("POINT", "SCALE")), whole.reshape(layout.frames, each)
        samples = _signed(numbers[:, 4 * points :], unsigned)
    places = numbers[:, : 4 * points].astype(np.float64).reshape(layout.frames, points, 4)
    places = np.where(places[..., 3:] < 0.0, np.nan, factor * places[..., :3])
    if not layout.channels:
        return places, np.zeros((0, layout.frames))
    scale = layout.real("ANALOG", "GEN_SCALE") * layout.reals("ANALOG", "SCALE")[: layout.channels, None]
    offset = _signed(layout.integers("ANALOG", "OFFSET")[: layout.channels, None], unsigned)
    return places, scale * (samples.reshape(-1, layout.channels).T - offset)


def _signed(numbers: NDArray[np.integer[Any]], unsigned: bool) -> FloatArray:
    """Whole numbers of two bytes, from 0 on or on both sides of it."""
    return numbers.astype(np.uint16 if unsigned else np.int16).astype(np.float64)


def c3d_layout(content: bytes, file: str) -> C3dLayout:
    """Check header, parameters and size of a C3D file, ``file`` in messages.

    Raises:
        InputError: If it is no C3D file, cut short, or its counts contradict each other.
    """
    start = (content[0] - 1) * BLOCK if content else 0
    if len(content) < 2 * BLOCK or content[1] != 0x50 or start < BLOCK or start + BLOCK > len(content):
        raise InputError(f"{file}: is no C3D file; valid: a header, the parameters, the frames")
    blocks, processor = content[start + 2], content[start + 3]
    if processor not in (_INTEL, _DEC, _MIPS):
        raise InputError(f"{file}: kind of processor is {processor}; valid: {_INTEL}, {_DEC}, {_MIPS}")
    end = start + blocks * BLOCK
    if not blocks or end > len(content):
        raise InputError(f"{file}: {blocks} blocks of parameters; valid: as many as the file has")
    big_endian = processor == _MIPS
    words = np.frombuffer(content[:20], ">u2" if big_endian else "<u2").astype(int)
    points, measured, first, last, samples = (int(words[k]) for k in (1, 2, 3, 4, 9))
    begin = (int(words[8]) - 1) * BLOCK
    # The sign of the scale says whether data are whole numbers or reals.
    negative = bool(content[{_INTEL: 15, _DEC: 13, _MIPS: 12}[processor]] & 0x80)
    layout = C3dLayout(
        file, points, measured // max(samples, 1), samples, max(first, 1), last - first + 1, processor,
        MappingProxyType(_parameters(content[:end], start + 4, big_endian, file)),
        float(_reals(content[20:24], processor)[0]), begin, negative,
    )  # fmt: skip
    layout = of_long_trial(layout, last)
    _check_counts(layout, measured)
    wanted = layout.frames * (4 * points + measured) * (4 if negative else 2)
    if begin < end:
        raise layout.error(f"frames begin at byte {begin}, within the parameters", f"at least {end}")
    if begin + wanted > len(content):
        raise layout.error(
            f"{len(content)} bytes for {layout.frames} frames of {points} points that begin at byte {begin}",
            f"{begin + wanted} bytes (is it cut short?)",
        )
    return layout


def of_long_trial(layout: C3dLayout, last: int) -> C3dLayout:
    """The layout with the frames that parameters tell where the header has no room for their number."""
    if last < _LAST:
        return layout
    first, end = (
        layout.integers("TRIAL", f"ACTUAL_{name}_FIELD") @ [1, _LAST + 1]
        if layout.count("TRIAL", f"ACTUAL_{name}_FIELD") == 2 else 0
        for name in ("START", "END")
    )  # fmt: skip
    if 0 < first <= end:
        return replace(layout, first_frame=int(first), frames=int(end - first + 1))
    told = layout.real("POINT", "FRAMES")
    return replace(layout, frames=int(told)) if layout.frames < told < _MOST_FRAMES else layout


def _check_counts(layout: C3dLayout, measured: int) -> None:
    """Header and parameters have to say the same; reals need no scale, and rates may be the header's."""
    if layout.points < 1 or layout.frames < 1:
        raise layout.error(f"{layout.points} points in {layout.frames} frames", "at least one of each")
    if layout.channels * layout.samples != measured:
        raise layout.error(f"{measured} samples for {layout.samples} instants", "a multiple of the instants")
    for group, count in (("POINT", layout.points), ("ANALOG", layout.channels)):
        used = layout.integers(group, "USED")
        if (used[0] if len(used) else 0) != count:
            raise layout.error(f"{group}:USED is {used[:1].tolist()} where the header has {count}", "equal")
    for name in ("SCALE", "OFFSET"):
        if layout.count("ANALOG", name) < layout.channels:
            raise layout.error(f"ANALOG:{name} has too few values", f"{layout.channels}, one per channel")
    rate, analog_rate = layout.rate, layout.real("ANALOG", "RATE")
    if not 0.0 < rate < _FASTEST:
        raise layout.error(f"POINT:RATE is {rate:g} Hz", f"> 0 and < {_FASTEST:g}")
    agrees = abs(analog_rate / rate - layout.samples) < 0.5
    if layout.channels and not layout.without_analog_rate and not agrees:
        raise layout.error(f"ANALOG:RATE is {analog_rate:g} Hz", f"{rate * layout.samples:g}")
    if not layout.real_frames and not layout.count("POINT", "SCALE"):
        raise layout.error("no POINT:SCALE of whole numbers", "a complete file")
    if np.any(layout.numbers("ROTATION", "USED")):
        raise layout.error("holds rotations of segments", "markers")


def _parameters(content: bytes, place: int, big_endian: bool, file: str) -> dict[tuple[str, str], Parameter]:
    """Parameters by group and name; ``content`` ends where their section does."""
    groups, found = dict[int, str](), list[tuple[int, str, Parameter]]()
    while True:
        here = _Reader(content, place, file)
        letters = abs(here.signed())
        if not letters:
            break
        group = here.signed()
        name = here.take(letters).decode("latin-1").upper()
        after = here.place
        step = int.from_bytes(here.take(2), "big" if big_endian else "little")
        if group < 0:
            if -group in groups:
                raise here.error(f"group {-group} occurs twice")
            groups[-group] = name
        elif group > 0:
            found.append((group, name, _parameter(here)))
        else:
            raise here.error("group 0")
        here.take(here.unsigned())
        if not step:
            break
        place = after + step
        if place < here.place:
            raise here.error(f"record {name[:40]!r} overlaps the next one")
    for name in (name for group, name, _ in found if group not in groups):
        raise InputError(f"{file}: parameter {name[:40]!r} has no group; valid: a complete file")
    names = list(groups.values())
    for name in (name for name in _READ if names.count(name) > 1):
        raise InputError(f"{file}: parameters of {name} occur twice; valid: once")
    return {(groups[group], name): parameter for group, name, parameter in found}


def _parameter(here: "_Reader") -> Parameter:
    kind = here.signed()
    if kind not in _SIZES:
        raise here.error(f"type {kind}")
    dimensions = tuple(here.take(here.unsigned()))
    if len(dimensions) > _DIMENSIONS or prod(size for size in dimensions if size) > _ENTRIES:
        raise here.error(f"{len(dimensions)} dimensions, {' x '.join(map(str, dimensions[:7]))}")
    if kind == _TEXT and not dimensions:
        raise here.error("text without a length")
    return Parameter(kind, dimensions, here.take(prod(dimensions) * _SIZES[kind]))


class _Reader:
    """Bytes of the parameters, one after the other."""

    def __init__(self, content: bytes, place: int, file: str) -> None:
        self.place, self._content, self._file = place, content, file

    def take(self, count: int) -> bytes:
        if self.place + count > len(self._content):
            raise self.error("a record that goes beyond their end")
        self.place += count
        return self._content[self.place - count : self.place]

    def unsigned(self) -> int:
        return self.take(1)[0]

    def signed(self) -> int:
        return int.from_bytes(self.take(1), "big", signed=True)

    def error(self, wrong: str) -> InputError:
        return InputError(f"{self._file}: {wrong} in the parameters; valid: a complete C3D file")
