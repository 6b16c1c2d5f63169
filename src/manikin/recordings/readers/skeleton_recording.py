"""Recorded skeletons: names, lengths and rotations of joints at an even rate, and measures of the person."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.runtime.display import Displayed


@dataclass(frozen=True)
class Subject:
    """Measures of a person; None where the file does not say.

    Attributes:
        mass: Of the body [kg].
        stature: Sole to vertex [m].
        knee_width: Between the epicondyles of a knee [m].
        ankle_width: Between the malleoli [m].
        elbow_width: Between the epicondyles of an elbow [m].
        shoulder_offset: From the marker on the acromion down to the joint's centre [m].
        marker_radius: Of a marker [m].
    """

    mass: float | None = None
    stature: float | None = None
    knee_width: float | None = None
    ankle_width: float | None = None
    elbow_width: float | None = None
    shoulder_offset: float | None = None
    marker_radius: float | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and finite_number(value, f"subject {field.name}") <= 0.0:
                raise InputError(f"subject {field.name} is {value!r}; valid: above 0, or None")


UNKNOWN = Subject()

Y_UP_TO_Z_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Rotation of the files' axes (X left, Y up, Z forward) to ours (x forward, y left, z up)."""


FARTHEST = 100.0
"""Nothing recorded is farther away than this [m]: what is, is damage or in another unit."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Displayed):
    """Joints of a skeleton at n instants; the world is z up.

    A joint's frame turns with the bone that begins there. With every rotation the identity the
    skeleton has its *rest pose*, in which all frames are parallel to the world. What the rest pose
    looks like differs from file to file.

    Attributes:
        joint_names: (j,) names, parents first; the first is the root.
        parents: (j,) index of each joint's parent, -1 for the root.
        offsets: (j, 3) place of each joint in its parent's frame [m]; zero for the root.
        ends: Ends of the last bones in the frames of their joints (3,) [m], by joint name.
        rotations: (n, j, 3, 3) from each joint's frame to its parent's; the root's to the world's.
        root_positions: (n, 3) [m].
        rate: Frames per second [Hz].
    """

    name: str
    joint_names: tuple[str, ...]
    parents: NDArray[np.int64]
    offsets: FloatArray
    ends: Mapping[str, FloatArray]
    rotations: FloatArray
    root_positions: FloatArray
    rate: float

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        frames, joints = str(len(self)), str(len(self.joint_names))
        return {"name": self.name, "frames": frames, "rate": f"{self.rate:g} Hz", "joints": joints}

    def __post_init__(self) -> None:
        where, joints = f"recording {self.name!r}", len(self.joint_names)
        finite_number(self.rate, f"{where} rate [Hz]", above=0.0)
        parents = np.array(self.parents, dtype=np.int64)
        if parents.shape != (joints,) or not joints or parents[0] != -1:
            raise InputError(f"{where} has {parents.shape} parents; valid: one per joint, -1 for the first")
        if np.any(parents[1:] < 0) or np.any(parents[1:] >= np.arange(1, joints)):
            raise InputError(f"{where} has a joint before its parent; valid: parents first")
        if len(set(self.joint_names)) != joints:
            raise InputError(f"{where} has a joint name twice; valid: unique names")
        parents.setflags(write=False)
        object.__setattr__(self, "parents", parents)
        frames = len(self.root_positions)
        shapes = {"offsets": (joints, 3), "rotations": (frames, joints, 3, 3), "root_positions": (frames, 3)}
        for name, shape in shapes.items():
            array = frozen_array(getattr(self, name), f"{where} {name}", shape)
            if np.abs(array).max(initial=0.0) > FARTHEST:
                told = f"{where} {name} has {float(array.flat[np.abs(array).argmax()]):.4g} m"
                raise InputError(f"{told}; valid: at most {FARTHEST:g} m, in the unit of the file")
            object.__setattr__(self, name, array)
        if not frames:
            raise InputError(f"{where} has no frame; valid: at least one")
        ends = {key: frozen_array(end, f"{where} end of {key!r}", (3,)) for key, end in self.ends.items()}
        object.__setattr__(self, "ends", MappingProxyType(ends))

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.root_positions)

    @property
    def duration(self) -> float:
        """From the first frame to the last [s]."""
        return (len(self) - 1) / self.rate

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants, 0 at the first frame [s]."""
        return frozen_array(np.arange(len(self)) / self.rate, "time")

    @cached_property
    def world_rotations(self) -> FloatArray:
        """(n, j, 3, 3) from each joint's frame to the world's."""
        turns = np.array(self.rotations)
        for joint, parent in enumerate(self.parents[1:], start=1):
            turns[:, joint] = turns[:, parent] @ turns[:, joint]
        turns.setflags(write=False)
        return turns

    @cached_property
    def positions(self) -> FloatArray:
        """(n, j, 3) places of the joints in the world [m]."""
        places = np.empty((len(self), len(self.joint_names), 3))
        places[:, 0] = self.root_positions
        for joint, parent in enumerate(self.parents[1:], start=1):
            places[:, joint] = places[:, parent] + self.world_rotations[:, parent] @ self.offsets[joint]
        places.setflags(write=False)
        return places

    def cut(self, start: int, stop: int) -> "Recording":
        """Recording of the frames from ``start`` up to, not with, ``stop``; InputError if none is left."""
        rows = slice(start, stop)
        return replace(self, rotations=self.rotations[rows], root_positions=self.root_positions[rows])


def z_up(
    name: str, joint_names: tuple[str, ...], parents: NDArray[np.int64], offsets: FloatArray,
    ends: Mapping[str, FloatArray], rotations: FloatArray, root_positions: FloatArray, rate: float,
) -> Recording:  # fmt: skip
    """Recording from values whose world is y up; the arguments are those of :class:`Recording`."""
    turn = Y_UP_TO_Z_UP
    return Recording(
        name, joint_names, parents, offsets @ turn.T, {key: turn @ end for key, end in ends.items()},
        turn @ rotations @ turn.T, root_positions @ turn.T, rate,
    )  # fmt: skip
