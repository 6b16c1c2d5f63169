"""Recordings in Acclaim files: a skeleton (ASF) and the motion (AMC) of it.

Y is up. A bone has a direction and a length in the rest pose, in world axes. With its own axes ``C`` and the
turns ``R = Rz Ry Rx`` of its degrees of freedom its rotation to its parent is ``C R C^T``, the identity in
the rest pose. Our joint of a bone's name is where the bone begins.
"""

from dataclasses import dataclass
from itertools import accumulate, pairwise, starmap
from pathlib import Path
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.recordings.readers.skeleton_recording import Recording, z_up
from manikin.recordings.readers.text_files import fixed_turns, numbers, read_text, whole_number

INCH = 0.0254
ROOT = "root"
TURNS = ("rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A skeleton of an ASF file, y up.

    Attributes:
        bones: (j,) names, parents first; the first is ``"root"``.
        parents: (j,) index of each bone's parent, -1 for the root.
        vectors: (j, 3) from the begin of each bone to its end in the rest pose [m].
        axes: (j, 3, 3) rotations ``C`` of the axes about which the bones turn.
        turns: Degrees of freedom of each bone in the order of the motion file, such as ``("rx", "rz")``;
            of the root also ``tx``, ``ty``, ``tz``.
        root_order: Order in which the root turns about the fixed axes, such as ``"XYZ"``.
        radians: Whether angles of the motion are in radians unless it says so itself.
        metres_per_unit: Unit of the root's position [m].
    """

    name: str
    bones: tuple[str, ...]
    parents: tuple[int, ...]
    vectors: FloatArray
    axes: FloatArray
    turns: tuple[tuple[str, ...], ...]
    root_order: str
    radians: bool
    metres_per_unit: float


def read_asf(path: str | Path) -> Skeleton:
    """Read the skeleton of an ASF file; lengths are inches divided by the file's ``length``.

    Raises:
        InputError: If the file is missing, damaged, cut short or holds what is no number.
    """
    file = str(path)
    sections = _sections(read_text(path, "ASF"), file)
    units = {words[0]: words[1:] for words in sections["units"] if len(words) > 1}
    scale = numbers(units.get("length", ["1"])[:1], f"{file}: length")[0]
    if not scale > 0.0:
        raise InputError(f"{file}: length is {scale:g}; valid: > 0")
    angle = units.get("angle", ["deg"])[0]
    if angle not in ("deg", "rad"):
        raise InputError(f"{file}: angle is {angle[:40]!r}; valid: deg, rad")
    radians = angle == "rad"
    root = _root(sections["root"], file)
    bones = {ROOT: root, **_bones(sections["bonedata"], file)}
    order, parents = _tree(sections["hierarchy"], bones, file)
    unit = INCH / float(scale)
    factor = 1.0 if radians else np.pi / 180.0
    vectors = unit * np.array([bones[name]["vector"] for name in order])
    axes = np.array([fixed_turns(factor * bones[n]["axis"][None], bones[n]["order"])[0] for n in order])
    turns = tuple(bones[name]["dof"] for name in order)
    return Skeleton(Path(path).name, order, parents, vectors, axes, turns, root["order"], radians, unit)


def _sections(text: str, file: str) -> dict[str, list[list[str]]]:
    """Lines of each section as words, without comments."""
    found, current = dict[str, list[list[str]]](), list[list[str]]()
    for line in text.splitlines():
        words = line.split("#")[0].replace("(", " ( ").replace(")", " ) ").split()
        if words and words[0].startswith(":"):
            current = found.setdefault(words[0][1:].lower(), [])
        elif words:
            current.append(words)
    for name in (name for name in ("units", "root", "bonedata", "hierarchy") if name not in found):
        raise InputError(f"{file}: no section :{name}; valid: an ASF file (is it cut short?)")
    return found


def _root(lines: list[list[str]], file: str) -> dict[str, Any]:
    words = {line[0]: line[1:] for line in lines}
    order = tuple(word.lower() for word in words.get("order", ()))
    if sorted(order) != ["rx", "ry", "rz", "tx", "ty", "tz"]:
        raise InputError(f"{file}: order of the root is {order}; valid: TX TY TZ RX RY RZ in any order")
    for key in ("position", "orientation"):
        value = _three(words.get(key, []), f"{file}: {key} of the root")
        if np.any(value != 0.0):
            raise InputError(f"{file}: {key} of the root is {value.tolist()}; valid: 0 0 0")
    turns = _order((words.get("axis") or ["XYZ"])[0], f"{file}: axis of the root")
    return {"vector": np.zeros(3), "axis": np.zeros(3), "order": turns, "dof": order}


def _bones(lines: list[list[str]], file: str) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    current: dict[str, list[str]] | None = None
    for words in lines:
        if words[0] == "begin" and current is None:
            current = {}
        elif words[0] == "end" and current is not None:
            name, bone = _bone(current, file)
            if name in found or name == ROOT:
                raise InputError(f"{file}: bone {name!r} occurs twice; valid: unique names")
            found[name], current = bone, None
        elif current is not None:
            current.setdefault(words[0], words[1:])
        else:
            raise InputError(f"{file}: {words[0][:40]!r} outside a bone; valid: begin")
    if current is not None or not found:
        raise InputError(f"{file}: bonedata ends inside a bone; valid: a complete file")
    return found


def _bone(entry: dict[str, list[str]], file: str) -> tuple[str, dict[str, Any]]:
    name = " ".join(entry.get("name", ()))
    where = f"{file}: bone {name[:40]!r}"
    if not name:
        raise InputError(f"{file}: a bone has no name; valid: name, direction, length, axis")
    direction = _three(entry.get("direction", []), f"{where} direction")
    length = numbers(entry.get("length", [])[:1] or ["none"], f"{where} length")[0]
    size = float(np.linalg.norm(direction))
    if size < 1e-9:
        raise InputError(f"{where} direction is {direction.tolist()}; valid: not zero")
    axis = entry.get("axis", [])
    dof = tuple(word.lower() for word in entry.get("dof", ()))
    if not set(dof) <= set(TURNS) or len(set(dof)) != len(dof):
        raise InputError(f"{where} dof is {' '.join(dof)[:60]!r}; valid: some of rx, ry, rz")
    turn, order = _three(axis[:3], f"{where} axis"), _order((axis[3:] or ["XYZ"])[0], f"{where} axis")
    return name, {"vector": direction / size * length, "axis": turn, "order": order, "dof": dof}


def _three(words: list[str], where: str) -> FloatArray:
    if len(words) < 3:
        raise InputError(f"{where} has {len(words)} numbers; valid: 3")
    return numbers(words[:3], where)


def _order(word: str, where: str) -> str:
    if sorted(word.upper()) != ["X", "Y", "Z"]:
        raise InputError(f"{where} order is {word[:40]!r}; valid: XYZ in any order")
    return word.upper()


def _tree(
    lines: list[list[str]], bones: dict[str, dict[str, Any]], file: str
) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Bones, parents first, and the parent of each."""
    if len(lines) < 2 or lines[0] != ["begin"] or lines[-1] != ["end"]:
        raise InputError(f"{file}: hierarchy has no begin and end; valid: a complete file")
    order, parents = {ROOT: 0}, [-1]
    for parent, *children in lines[1:-1]:
        if parent not in order:
            raise InputError(f"{file}: bone {parent[:40]!r} before its parent; valid: parents first")
        for child in children:
            if child not in bones or child in order:
                raise InputError(f"{file}: child {child[:40]!r} in the hierarchy; valid: each bone once")
            order[child] = len(order)
            parents.append(order[parent])
    if len(order) != len(bones):
        raise InputError(f"{file}: {len(order)} of {len(bones)} bones in the hierarchy; valid: all of them")
    return tuple(order), tuple(parents)


RATE = 120.0
"""Frames per second when nothing else is said; the files do not hold it [Hz]."""


def read_amc(
    path: str | Path, skeleton: str | Path | Skeleton | None = None, rate: float = RATE
) -> Recording:
    """Read an AMC file and its skeleton.

    Args:
        skeleton: The skeleton or its file; None for the one beside the motion whose name is the
            beginning of the motion's up to the first underscore (``16_08.amc``: ``16.asf``).
        rate: Frames per second [Hz].

    Raises:
        InputError: If a file is missing, damaged, cut short or holds what is no number.
    """
    finite_number(rate, "rate [Hz]", above=0.0)
    if not skeleton:
        skeleton = Path(path).with_name(Path(path).stem.split("_")[0] + ".asf")
        if not skeleton.is_file():
            wrong = f"no skeleton {skeleton.name!r} beside it"
            raise InputError(f"{Path(path)}: {wrong}; valid: skeleton, an ASF file")
    if not isinstance(skeleton, Skeleton):
        skeleton = read_asf(skeleton)
    frames, radians = _frames(read_text(path, "AMC"), skeleton, str(path))
    return _recording(Path(path).name, skeleton, frames, radians, rate)


def _frames(text: str, skeleton: Skeleton, file: str) -> tuple[FloatArray, bool]:
    """Values of every degree of freedom (n, k) in the skeleton's order, and whether angles are radians."""
    slots = _slots(skeleton)
    width = sum(len(turns) for turns in skeleton.turns)
    words: list[list[str]] = []
    radians, number = skeleton.radians, None
    for line, content in enumerate(text.splitlines(), start=1):
        entry, where, last = content.split("#")[0].split(), f"{file}: line {line}", number
        if not entry:
            continue
        if len(entry) == 1 and entry[0].startswith(":"):
            radians = {":DEGREES": False, ":RADIANS": True}.get(entry[0].upper(), radians)
        elif len(entry) == 1:
            number = whole_number(entry[0], where)
            if last is not None and number != last + 1:
                raise InputError(f"{where}: frame {number} after {last}; valid: {last + 1}")
            _complete(words, where)
            words.append([""] * width)
        elif not words:
            raise InputError(f"{where}: {entry[0][:40]!r} before the first frame; valid: a frame number")
        else:
            _take(entry, slots, words[-1], where)
    if not words:
        raise InputError(f"{file}: no frame; valid: an AMC file")
    _complete(words, f"{file}: the end")
    flat = [word for frame in words for word in frame]
    return numbers(flat, f"{file}: a frame").reshape(len(words), width), radians


def _slots(skeleton: Skeleton) -> dict[str, slice]:
    ends = accumulate(map(len, skeleton.turns), initial=0)
    return dict(zip(skeleton.bones, starmap(slice, pairwise(ends)), strict=True))


def _complete(frames: list[list[str]], where: str) -> None:
    if frames and (missing := frames[-1].count("")):
        wrong = f"{len(frames[-1]) - missing} of {len(frames[-1])} values in the frame before"
        raise InputError(f"{where}: {wrong}; valid: all (is it cut short?)")


def _take(entry: list[str], slots: dict[str, slice], frame: list[str], where: str) -> None:
    """Put the values of one bone into the frame."""
    name, values = entry[0], entry[1:]
    slot = slots.get(name)
    if slot is None:
        raise InputError(f"{where}: {name[:40]!r} is no bone; valid: {', '.join(slots)}")
    wanted = slot.stop - slot.start
    if not values or wanted != len(values):
        raise InputError(f"{where}: {name!r} has {len(values)} values; valid: {wanted} (is it cut short?)")
    if frame[slot.start]:
        raise InputError(f"{where}: {name!r} twice in one frame; valid: once")
    frame[slot] = values


def _recording(name: str, skeleton: Skeleton, frames: FloatArray, radians: bool, rate: float) -> Recording:
    slots = _slots(skeleton)
    rotations = np.empty((len(frames), len(skeleton.bones), 3, 3))
    for number, bone in enumerate(skeleton.bones):
        angles = np.zeros((len(frames), 3))
        for column, turn in enumerate(skeleton.turns[number]):
            if turn in TURNS:
                angles[:, TURNS.index(turn)] = frames[:, slots[bone].start + column]
        if not radians:
            angles = np.deg2rad(angles)
        axes, order = skeleton.axes[number], skeleton.root_order if number == 0 else "XYZ"
        rotations[:, number] = axes @ fixed_turns(angles, order) @ axes.T
    # A bone begins where its parent ends.
    parents, vectors = skeleton.parents, skeleton.vectors
    offsets = np.array([np.zeros(3) if parent < 0 else vectors[parent] for parent in parents])
    ends = {bone: vectors[k] for k, bone in enumerate(skeleton.bones) if k not in parents}
    root = frames[:, slots[ROOT]][:, [skeleton.turns[0].index(axis) for axis in ("tx", "ty", "tz")]]
    root = skeleton.metres_per_unit * root
    return z_up(name, skeleton.bones, np.array(parents), offsets, ends, rotations, root, rate)
