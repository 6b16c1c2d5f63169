"""Forward kinematics of one limb at many joint angles at once."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body.limbs import limb_hinges, limb_slots
from manikin.body.model import BodyModel
from manikin.body.segments import Limb
from manikin.errors import BodyError
from manikin.spatial import FloatArray, frozen_array, skew

_BLOCK = 4096  # samples whose temporary arrays fit in the cache


@dataclass(frozen=True, eq=False)
class EffectorPlacements:
    """The effector of a limb at n samples, in the limb's frame.

    Attributes:
        positions: (n, 3) [m].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        jacobians: (n, 3, k) velocity of the effector per joint speed [m/rad].
    """

    positions: FloatArray
    rotations: FloatArray
    jacobians: FloatArray


class LimbKinematics:
    """A limb as a chain of hinges on fixed offsets, in the limb's frame.

    Attributes:
        limb: The limb.
        slots: (k,) places of its hinges in the configuration vector.
        lower: (k,) smallest angles [rad].
        upper: (k,) largest angles [rad].
        torque_limit: (k,) largest torques [N.m].
    """

    def __init__(self, body: BodyModel, limb: Limb) -> None:
        self.limb = limb
        self.slots = limb_slots(body, limb)
        hinges = limb_hinges(body, limb)
        self.lower = frozen_array([hinge.lower for hinge in hinges], "lower")
        self.upper = frozen_array([hinge.upper for hinge in hinges], "upper")
        self.torque_limit = frozen_array([hinge.torque_limit for hinge in hinges], "torque_limit")
        self._axes = np.array([hinge.axis for hinge in hinges])
        self._offsets, self._tip = _offsets(body, limb)
        self._tip_rotation = np.array(body.effector(limb.effector).rotation)
        self._turns = [(skew(axis), skew(axis) @ skew(axis)) for axis in self._axes]

    def __len__(self) -> int:
        """Number of hinges."""
        return len(self._axes)

    def random_angles(self, rng: np.random.Generator, count: int) -> FloatArray:
        """(count, k) angles, uniform within the joint ranges [rad]."""
        return rng.uniform(self.lower, self.upper, (count, len(self)))

    def place(self, angles: ArrayLike) -> EffectorPlacements:
        """Place the effector at many joint angles.

        A turn by the angle ``a`` about the unit axis ``k`` is ``I + sin a [k] + (1 - cos a) [k]^2``;
        as the axes are fixed, each hinge costs two products with one constant matrix for all samples.

        Args:
            angles: (n, k) [rad].

        Raises:
            BodyError: If the angles are not (n, k).
        """
        q = np.asarray(angles, dtype=np.float64)
        if q.ndim != 2 or q.shape[1] != len(self):
            raise BodyError(f"limb {self.limb.name!r} angles have shape {q.shape}; valid: (n, {len(self)})")
        found = EffectorPlacements(
            np.empty((len(q), 3)), np.empty((len(q), 3, 3)), np.empty((len(q), 3, len(self)))
        )
        for rows in _blocks(len(q)):
            self._place_block(q[rows], found, rows)
        return found

    def _place_block(self, q: FloatArray, out: EffectorPlacements, rows: slice) -> None:
        turn = np.broadcast_to(np.eye(3), (len(q), 3, 3)).copy()
        point = np.zeros((len(q), 3))
        places, axes = [], []
        sine, rest = np.sin(q), 1.0 - np.cos(q)
        for hinge, (cross, square) in enumerate(self._turns):
            if self._offsets[hinge].any():
                point = point + turn @ self._offsets[hinge]
            places.append(point)
            axes.append(turn @ self._axes[hinge])
            flat = turn.reshape(-1, 3)
            turn = (
                turn
                + sine[:, hinge, None, None] * (flat @ cross).reshape(-1, 3, 3)
                + rest[:, hinge, None, None] * (flat @ square).reshape(-1, 3, 3)
            )
        point = point + turn @ self._tip
        out.positions[rows] = point
        out.rotations[rows] = (turn.reshape(-1, 3) @ self._tip_rotation).reshape(-1, 3, 3)
        for hinge, (place, axis) in enumerate(zip(places, axes, strict=True)):
            out.jacobians[rows, :, hinge] = _cross(axis, point - place)

    @cached_property
    def pinocchio(self) -> Any:
        """The limb alone as a ``pin.Model`` whose last frame is the effector; never change it."""
        model = pin.Model()
        joint = 0
        for axis, offset in zip(self._axes, self._offsets, strict=True):
            placement = pin.SE3(np.eye(3), offset)
            joint = model.addJoint(
                joint, pin.JointModelRevoluteUnaligned(axis), placement, f"hinge_{model.njoints}"
            )
        tip = pin.SE3(self._tip_rotation, self._tip)
        model.addFrame(pin.Frame("effector", joint, 0, tip, pin.FrameType.OP_FRAME))
        return model


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
    return np.array(found), offset + body.effector(limb.effector).translation


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of (n, 3) by (n, 3), without the overhead of ``np.cross``."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.column_stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _BLOCK) for start in range(0, count, _BLOCK))
