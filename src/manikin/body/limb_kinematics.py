"""Forward kinematics of one limb at many joint angles at once."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body.limbs import limb_hinges, limb_slots
from manikin.body.model import BodyModel
from manikin.body.segments import Limb
from manikin.errors import BodyError
from manikin.spatial import FloatArray, frozen_array, skew

_IDENTITY = np.eye(3)
_BLOCK = 1024  # samples whose temporary arrays fit in the cache


@dataclass(frozen=True, eq=False)
class EffectorPlacements:
    """The effector of a limb at n samples, in the limb's frame.

    Attributes:
        positions: (n, 3) [m].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        jacobians: (n, 3, k) velocity of the effector per joint speed [m/rad].
        axes: (n, 3, k) unit axes of the joints: its angular velocity per joint speed.
    """

    positions: FloatArray
    rotations: FloatArray
    jacobians: FloatArray
    axes: FloatArray


class LimbKinematics:
    """A limb as a chain of hinges on fixed offsets, in the limb's frame.

    Attributes:
        limb: The limb.
        slots: (k,) places of its hinges in the configuration vector.
        lower: (k,) smallest angles [rad].
        upper: (k,) largest angles [rad].
        torque_lower: (k,) most negative torques [N.m].
        torque_upper: (k,) largest torques [N.m].
        axes: (k, 3) unit axes of the hinges, each in the axes of the one before it.
        offsets: (k, 3) translations before each hinge [m].
        tip: (3,) translation from the last hinge to the effector [m]; from the limb's origin without any.
        tip_rotation: (3, 3) from the effector's axes to those of the last hinge.
    """

    def __init__(self, body: BodyModel, limb: Limb) -> None:
        self.limb = limb
        self.slots = limb_slots(body, limb)
        hinges = limb_hinges(body, limb)
        self._hinges = [(name, len(body.segment(name).hinges)) for name in limb.segments]
        self.lower = frozen_array([hinge.lower for hinge in hinges], "lower")
        self.upper = frozen_array([hinge.upper for hinge in hinges], "upper")
        self.torque_lower = frozen_array([hinge.torque_lower for hinge in hinges], "torque_lower")
        self.torque_upper = frozen_array([hinge.torque_upper for hinge in hinges], "torque_upper")
        self.axes = frozen_array(np.reshape([hinge.axis for hinge in hinges], (-1, 3)), "axes")
        offsets, tip = _offsets(body, limb)
        self.offsets, self.tip = frozen_array(offsets, "offsets"), frozen_array(tip, "tip")
        self.tip_rotation = frozen_array(body.effector(limb.effector).rotation, "tip_rotation")
        self._crosses = skew(self.axes)
        self._squares = self._crosses @ self._crosses

    def __len__(self) -> int:
        """Number of hinges."""
        return len(self.axes)

    def random_angles(self, rng: np.random.Generator, count: int) -> FloatArray:
        """(count, k) angles, uniform within the joint ranges [rad]."""
        return rng.uniform(self.lower, self.upper, (count, len(self)))

    def place(self, angles: ArrayLike) -> EffectorPlacements:
        """Place the effector at many joint angles.

        Args:
            angles: (n, k) [rad].

        Raises:
            BodyError: If the angles are not (n, k).
        """
        q = np.asarray(angles, dtype=np.float64)
        if q.ndim != 2 or q.shape[1] != len(self):
            raise BodyError(f"limb {self.limb.name!r} angles have shape {q.shape}; valid: (n, {len(self)})")
        count = len(q)
        shape = (count, 3, len(self))
        found = EffectorPlacements(
            np.empty((count, 3)), np.empty((count, 3, 3)), np.empty(shape), np.empty(shape)
        )
        for rows in _blocks(count):
            self._place_block(q[rows], found, rows)
        return found

    def segment_placements(self, angles: FloatArray) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Name, axes (n, 3, 3) and origin (n, 3) of moving segments in the frame of the limb."""
        if not len(self):
            return
        frames, places = self._frames(np.asarray(angles, dtype=np.float64))
        last = 0
        for name, count in self._hinges:
            yield name, frames[:, last + count], places[:, last]
            last += count

    def _frames(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Axes before each hinge and after the last (n, k + 1, 3, 3), and places of the hinges (n, k, 3).

        Turn by turn: ``I + sin a [k] + (1 - cos a) [k]^2`` about each unit axis ``k``.
        """
        turns = np.sin(q)[..., None, None] * self._crosses
        turns += (1.0 - np.cos(q))[..., None, None] * self._squares
        turns += _IDENTITY
        frames = np.empty((len(q), len(self) + 1, 3, 3))
        frames[:, 0] = _IDENTITY
        for hinge in range(len(self)):
            np.matmul(frames[:, hinge], turns[:, hinge], out=frames[:, hinge + 1])
        return frames, np.cumsum((frames[:, :-1] @ self.offsets[..., None])[..., 0], axis=1)

    def _place_block(self, q: FloatArray, out: EffectorPlacements, rows: slice) -> None:
        frames, places = self._frames(q)
        turn, before = frames[:, -1], frames[:, :-1]
        axes = (before @ self.axes[..., None])[..., 0]
        point = turn @ self.tip
        if len(self):
            point += places[:, -1]
        out.positions[rows] = point
        out.rotations[rows] = turn @ self.tip_rotation
        out.axes[rows] = axes.transpose(0, 2, 1)
        out.jacobians[rows] = _cross(axes, point[:, None] - places).transpose(0, 2, 1)


def _offsets(body: BodyModel, limb: Limb) -> tuple[FloatArray, FloatArray]:
    """Translations before each hinge (k, 3), and from the last hinge to the effector (3,) [m]."""
    found: list[FloatArray] = []
    offset = np.zeros(3)
    for number, name in enumerate(limb.segments):
        segment = body.segment(name)
        # The limb's frame is at the origin of its first segment.
        offset = offset + (segment.origin if number else 0.0)
        for _ in segment.hinges:
            found.append(offset)
            offset = np.zeros(3)
    return np.reshape(found, (-1, 3)), offset + body.effector(limb.effector).translation


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of (..., 3) by (..., 3), without the overhead of ``np.cross``."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _BLOCK) for start in range(0, count, _BLOCK))
