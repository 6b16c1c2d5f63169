"""Recordings in Biovision hierarchy (BVH) files.

Y is up, angles are degrees, the rotation of a joint is the product of its channels from left to right.
The format has no unit of length: it is the one in which the skeleton's longest chain through the root,
from the toes to the fingers, fits a person, unless it is given.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.recordings.readers.skeleton_recording import Recording, z_up
from manikin.recordings.readers.text_files import numbers, read_text, rotations_of, whole_number

UNITS = {
    "metres": 1.0, "CMU units": 0.0254 / 0.45, "inches": 0.0254, "centimetres": 0.01, "millimetres": 0.001,
}  # fmt: skip
"""Units of length that occur [m]. Those of CMU are inches divided by 0.45."""

PERSON = (1.6, 3.5)
"""Longest chains, fingers to toes, that may be people's [m]; so narrow that no two units fit one skeleton."""

_POSITIONS = ("Xposition", "Yposition", "Zposition")
_ROTATIONS = ("Xrotation", "Yrotation", "Zrotation")


def read_bvh(path: str | Path, metres_per_unit: float | None = None) -> Recording:
    """Read a BVH file.

    Args:
        metres_per_unit: Unit of length [m], > 0; None to find it from the size of the skeleton.

    Raises:
        InputError: If the file is missing, damaged, cut short or holds what is no number; if a joint
            other than the root has channels of position; or if no unit fits.
    """
    if metres_per_unit is not None:
        finite_number(metres_per_unit, "metres_per_unit", above=0.0)
    file = str(path)
    head, mark, motion = read_text(path, "BVH").partition("MOTION")
    words = head.split()
    if not words or words[0] != "HIERARCHY" or not mark:
        raise InputError(f"{file}: is no BVH file; valid: HIERARCHY, the joints, MOTION, the frames")
    joints = _Hierarchy(words[1:], file).joints
    rate, values = _motion(motion, sum(len(joint.channels) for joint in joints), file)
    unit = metres_per_unit or _unit(joints, file)
    offsets = unit * np.array([joint.offset if joint.parent >= 0 else np.zeros(3) for joint in joints])
    ends = {joint.name: unit * joint.end for joint in joints if joint.end is not None}
    root = unit * values[:, [joints[0].channels.index(name) for name in _POSITIONS]]
    names, parents = tuple(joint.name for joint in joints), np.array([joint.parent for joint in joints])
    return z_up(Path(path).name, names, parents, offsets, ends, _rotations(joints, values), root, rate)


@dataclass
class _Joint:
    """A joint as the file describes it, in its unit."""

    name: str
    parent: int
    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()
    end: FloatArray | None = None


class _Hierarchy:
    """Joints of the first half of a file, read word by word."""

    def __init__(self, words: list[str], file: str) -> None:
        self.file, self._words, self._next = file, words, 0
        self.joints: list[_Joint] = []
        self._expect("ROOT")
        open_joints = [self._begin(-1)]
        while open_joints:
            self._item(open_joints)
        if self._next < len(words):
            raise self._error(f"{words[self._next][:40]!r} after the root", "MOTION")
        if any(not joint.channels for joint in self.joints):
            raise self._error("a joint has no channels", "CHANNELS in each joint")

    def _item(self, open_joints: list[int]) -> None:
        """Read one entry of the innermost open joint."""
        joint, word = open_joints[-1], self._word()
        if word == "OFFSET":
            self.joints[joint].offset = self._vector()
        elif word == "CHANNELS":
            self.joints[joint].channels = self._channels(joint)
        elif word == "JOINT":
            open_joints.append(self._begin(joint))
        elif word == "End":
            for expected in ("Site", "{", "OFFSET"):
                self._expect(expected)
            self.joints[joint].end = self._vector()
            self._expect("}")
        elif word == "}":
            open_joints.pop()
        else:
            raise self._error(repr(word[:40]), "OFFSET, CHANNELS, JOINT, End Site or }")

    def _begin(self, parent: int) -> int:
        name = self._word()
        if any(name == joint.name for joint in self.joints):
            raise self._error(f"joint {name[:40]!r} occurs twice", "unique names")
        self._expect("{")
        self.joints.append(_Joint(name, parent))
        return len(self.joints) - 1

    def _channels(self, joint: int) -> tuple[str, ...]:
        where = f"{self.file}: channels of {self.joints[joint].name[:40]!r}"
        count = whole_number(self._word(), where)
        channels = tuple(self._word() for _ in range(min(count, 7)))
        unknown = [name for name in channels if name not in _POSITIONS + _ROTATIONS]
        if unknown or not 0 < count <= 6:
            wrong = repr(unknown[0][:40]) if unknown else str(count)
            raise InputError(f"{where}: {wrong}; valid: 1 to 6 of {', '.join(_POSITIONS + _ROTATIONS)}")
        placed = [name for name in channels if name in _POSITIONS]
        if sorted(placed) != ([] if joint else list(_POSITIONS)):
            raise InputError(f"{where}: {placed}; valid: three positions of the root, none of other joints")
        return channels

    def _vector(self) -> FloatArray:
        return numbers([self._word() for _ in range(3)], f"{self.file}: OFFSET")

    def _expect(self, wanted: str) -> None:
        word = self._word()
        if word != wanted:
            raise self._error(repr(word[:40]), wanted)

    def _word(self) -> str:
        if self._next >= len(self._words):
            raise self._error("ends inside the hierarchy", "a complete file")
        self._next += 1
        return self._words[self._next - 1]

    def _error(self, wrong: str, valid: str) -> InputError:
        return InputError(f"{self.file}: {wrong} in the hierarchy; valid: {valid}")


def _motion(text: str, channels: int, file: str) -> tuple[float, FloatArray]:
    """Frames per second and the values (n, channels) of all frames."""
    words = text.split()
    if len(words) < 5 or words[0] != "Frames:" or words[2:4] != ["Frame", "Time:"]:
        raise InputError(f"{file}: MOTION has no frame count and time; valid: Frames: N, Frame Time: SECONDS")
    frames = whole_number(words[1], f"{file}: Frames")
    step = float(numbers(words[4:5], f"{file}: Frame Time")[0])
    if not frames or not step > 0.0:
        raise InputError(f"{file}: {frames} frames of {step:g} s; valid: at least one, of more than 0 s")
    values = words[5:]
    if len(values) != frames * channels:
        wrong = f"{len(values)} values for {frames} frames of {channels} channels"
        raise InputError(f"{file}: {wrong}; valid: {frames * channels} (is the file cut short?)")
    return 1.0 / step, numbers(values, f"{file}: MOTION").reshape(frames, channels)


def _unit(joints: list[_Joint], file: str) -> float:
    """Unit of length [m] in which the two longest chains of bones that leave the root are a person's."""
    lengths, owner, branches = list[float](), list[int](), dict[int, float]()
    for number, joint in enumerate(joints):
        before = lengths[joint.parent] + float(np.linalg.norm(joint.offset)) if joint.parent >= 0 else 0.0
        lengths.append(before)
        owner.append(number if joint.parent <= 0 else owner[joint.parent])
        tip = before + (0.0 if joint.end is None else float(np.linalg.norm(joint.end)))
        branches[owner[-1]] = max(branches.get(owner[-1], 0.0), tip)
    size = sum(sorted(branches.values())[-2:])
    for metres in UNITS.values():
        if PERSON[0] <= metres * size <= PERSON[1]:
            return metres
    raise InputError(
        f"{file}: the skeleton is {size:g} units long, a person in none of {', '.join(UNITS)}; "
        "valid: a file for which metres_per_unit is given"
    )


def _rotations(joints: list[_Joint], values: FloatArray) -> FloatArray:
    """(n, j, 3, 3) products of each joint's channels from left to right."""
    found = np.empty((len(values), len(joints), 3, 3))
    column = 0
    for number, joint in enumerate(joints):
        turning = [k for k, name in enumerate(joint.channels) if name in _ROTATIONS]
        axes = "".join(joint.channels[k][0] for k in turning)
        found[:, number] = rotations_of(np.deg2rad(values[:, [column + k for k in turning]]), axes)
        column += len(joint.channels)
    return found
