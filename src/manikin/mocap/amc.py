"""Recordings in Acclaim files: a skeleton (ASF) and the motion (AMC) of it.

Y is up. With a bone's own axes ``C`` in the rest pose and the turns ``R = Rz Ry Rx`` of its degrees of
freedom its rotation to its parent is ``C R C^T``, the identity in the rest pose. Our joint of a bone's name
is where the bone begins.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from manikin.errors import InputError
from manikin.mocap.asf import ROOT, TURNS, Skeleton, read_asf
from manikin.mocap.recording import Recording, z_up
from manikin.mocap.text import fixed_turns, numbers, read_text, whole_number
from manikin.spatial import FloatArray, finite_number

RATE = 120.0
"""Frames per second when nothing else is said; the files do not hold it [Hz]."""


def read_amc(
    path: str | Path, skeleton: str | Path | Skeleton | None = None, rate: float = RATE
) -> Recording:
    """Read an AMC file and its skeleton.

    Args:
        path: The motion.
        skeleton: The skeleton or its file; None for the one beside the motion whose name is the
            beginning of the motion's up to the first underscore (``16_08.amc``: ``16.asf``).
        rate: Frames per second [Hz].

    Raises:
        InputError: If a file is missing, damaged, cut short or holds what is no number.
    """
    finite_number(rate, "rate [Hz]", above=0.0)
    if not isinstance(skeleton, Skeleton):
        skeleton = read_asf(skeleton or _beside(Path(path)))
    frames, radians = _frames(read_text(path, "AMC"), skeleton, str(path))
    return _recording(Path(path).name, skeleton, frames, radians, rate)


def _beside(motion: Path) -> Path:
    file = motion.with_name(motion.stem.split("_")[0] + ".asf")
    if not file.is_file():
        raise InputError(f"{motion}: no skeleton {file.name!r} beside it; valid: skeleton, an ASF file")
    return file


def _frames(text: str, skeleton: Skeleton, file: str) -> tuple[FloatArray, bool]:
    """Values of every degree of freedom (n, k) in the skeleton's order, and whether angles are radians."""
    slots = _slots(skeleton)
    width = sum(len(turns) for turns in skeleton.turns)
    words: list[list[str]] = []
    radians, number, seen = skeleton.radians, None, width
    for line, entry in _lines(text):
        where = f"{file}: line {line}"
        if len(entry) == 1 and entry[0].startswith(":"):
            radians = {":DEGREES": False, ":RADIANS": True}.get(entry[0].upper(), radians)
        elif len(entry) == 1:
            number = _frame_number(entry[0], number, where)
            _complete(seen, width, where)
            words.append([""] * width)
            seen = 0
        elif not words:
            raise InputError(f"{where}: {entry[0][:40]!r} before the first frame; valid: a frame number")
        else:
            seen += _take(entry, slots, words[-1], where)
    if not words:
        raise InputError(f"{file}: no frame; valid: an AMC file")
    _complete(seen, width, f"{file}: the end")
    flat = [word for frame in words for word in frame]
    return numbers(flat, f"{file}: a frame").reshape(len(words), width), radians


def _lines(text: str) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(text.splitlines(), start=1):
        entry = line.split("#")[0].split()
        if entry:
            yield number, entry


def _slots(skeleton: Skeleton) -> dict[str, slice]:
    found, start = {}, 0
    for bone, turns in zip(skeleton.bones, skeleton.turns, strict=True):
        found[bone] = slice(start, start + len(turns))
        start += len(turns)
    return found


def _frame_number(word: str, last: int | None, where: str) -> int:
    number = whole_number(word, where)
    if last is not None and number != last + 1:
        raise InputError(f"{where}: frame {number} after {last}; valid: {last + 1}")
    return number


def _complete(seen: int, width: int, where: str) -> None:
    if seen != width:
        raise InputError(
            f"{where}: {seen} of {width} values in the frame before; valid: all (is it cut short?)"
        )


def _take(entry: list[str], slots: dict[str, slice], frame: list[str], where: str) -> int:
    """Put the values of one bone into the frame; returns how many."""
    name, values = entry[0], entry[1:]
    slot = slots.get(name)
    if slot is None:
        raise InputError(f"{where}: {name[:40]!r} is no bone; valid: {', '.join(slots)}")
    if not values or slot.stop - slot.start != len(values):
        wanted = slot.stop - slot.start
        raise InputError(f"{where}: {name!r} has {len(values)} values; valid: {wanted} (is it cut short?)")
    if frame[slot.start]:
        raise InputError(f"{where}: {name!r} twice in one frame; valid: once")
    frame[slot] = values
    return len(values)


def _recording(name: str, skeleton: Skeleton, frames: FloatArray, radians: bool, rate: float) -> Recording:
    slots = _slots(skeleton)
    rotations = np.empty((len(frames), len(skeleton.bones), 3, 3))
    for number, bone in enumerate(skeleton.bones):
        values = _by_turn(frames[:, slots[bone]], skeleton.turns[number])
        angles = values if radians else np.deg2rad(values)
        axes, order = skeleton.axes[number], skeleton.root_order if number == 0 else "XYZ"
        rotations[:, number] = axes @ fixed_turns(angles, order) @ axes.T
    return z_up(
        name, skeleton.bones, np.array(skeleton.parents), _offsets(skeleton), _ends(skeleton), rotations,
        skeleton.metres_per_unit * _root_places(frames[:, slots[ROOT]], skeleton.turns[0]), rate,
    )  # fmt: skip


def _by_turn(values: FloatArray, turns: tuple[str, ...]) -> FloatArray:
    """(n, 3) angles about x, y and z, zero where the bone does not turn."""
    angles = np.zeros((len(values), 3))
    for column, turn in enumerate(turns):
        if turn in TURNS:
            angles[:, TURNS.index(turn)] = values[:, column]
    return angles


def _root_places(values: FloatArray, order: tuple[str, ...]) -> FloatArray:
    return values[:, [order.index(name) for name in ("tx", "ty", "tz")]]


def _offsets(skeleton: Skeleton) -> FloatArray:
    """(j, 3) begin of each bone in its parent's frame: the parent's end."""
    return np.array([
        np.zeros(3) if parent < 0 else skeleton.vectors[parent] for parent in skeleton.parents
    ])  # fmt: skip


def _ends(skeleton: Skeleton) -> dict[str, FloatArray]:
    """Ends of the bones that have no children."""
    parents = set(skeleton.parents)
    return {
        bone: skeleton.vectors[number] for number, bone in enumerate(skeleton.bones) if number not in parents
    }
