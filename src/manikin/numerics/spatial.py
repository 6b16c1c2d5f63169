"""Vectors, wrenches, rotations and frames, single or many at once, and checked, read-only arrays.

Rotations are 3x3 matrices or xyzw quaternions; ``rotation_a_to_b`` maps coordinates in *a* to those in *b*.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from operator import ge, gt, le

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation
from scipy.special import cosdg, sindg

from manikin.errors import InputError

FloatArray = NDArray[np.float64]

GRAVITY = 9.81
"""Standard gravity used throughout [m/s^2] ([Qiu2012]_ 4.2.8)."""

GRAVITY_VECTOR: FloatArray = np.array([0.0, 0.0, -GRAVITY])
GRAVITY_VECTOR.setflags(write=False)


def frozen_array(
    value: ArrayLike, name: str, shape: Sequence[int | None] | None = None,
    error: type[InputError] = InputError,
) -> FloatArray:  # fmt: skip
    """Copy ``value`` into a finite, read-only float array of the wanted shape.

    Args:
        value: Numbers.
        name: Name in the message, with its owner (``"contact 'left_foot' position"``).
        shape: Expected shape; ``None`` entries are free. ``None`` accepts any shape.
        error: Exception class to raise.

    Raises:
        InputError: If the value is not numeric, not finite or of another shape.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise error(f"{name} is {value!r}; valid: numbers of shape {_shape_text(shape)}") from None
    if shape is not None and not (
        array.ndim == len(shape)
        and all(wanted in (None, size) for size, wanted in zip(array.shape, shape, strict=True))
    ):
        raise error(f"{name} has shape {array.shape}; valid: shape {_shape_text(shape)}")
    if not np.all(np.isfinite(array)):
        raise error(f"{name} is {array.tolist()}; valid: finite numbers")
    array.setflags(write=False)
    return array


def finite_number(
    value: object, name: str, *, above: float | None = None, at_least: float | None = None,
    at_most: float | None = None, error: type[InputError] = InputError,
) -> float:  # fmt: skip
    """Check one number against its bounds and return it as a float.

    Raises:
        InputError: If the value is not a finite number inside the bounds.
    """
    all_bounds = ((">", above, gt), (">=", at_least, ge), ("<=", at_most, le))
    bounds = [(sign, limit, holds) for sign, limit, holds in all_bounds if limit is not None]
    valid = "a finite number " + " and ".join(f"{sign} {limit:g}" for sign, limit, _ in bounds)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise error(f"{name} is {value!r}; valid: {valid.strip()}")
    number = float(value)
    if not (math.isfinite(number) and all(holds(number, limit) for _, limit, holds in bounds)):
        raise error(f"{name} is {number:g}; valid: {valid.strip()}")
    return number


def _shape_text(shape: Sequence[int | None] | None) -> str:
    if shape is None:
        return "(any)"
    return "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the last axis; several times faster than numpy's on small arrays."""
    if a.ndim == b.ndim == 1:
        (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
        return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def unit(vectors: FloatArray, least: float = 1e-9) -> FloatArray:
    """(..., k) vectors as unit vectors; those that are shorter than ``least`` become shorter than 1."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), least)


def area_normals(corners: FloatArray) -> FloatArray:
    """(m, 3) normals of triangles (m, 3, 3), as long as twice their areas."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def skew(vector: ArrayLike) -> FloatArray:
    """(..., 3, 3) matrices of cross products by (..., 3): ``skew(a) @ b = cross(a, b)`` ([Qiu2012]_ 2.10)."""
    v = np.asarray(vector, dtype=np.float64)
    if v.ndim == 1:
        x, y, z = v.tolist()
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.zeros((*v.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix


def wrench_about(wrench: FloatArray, point: FloatArray) -> FloatArray:
    """(..., 6) wrenches about the world origin with moments about another point (..., 3) [N, N.m].

    The negative point takes moments about it to moments about the origin.
    """
    force = wrench[..., :3]
    return np.concatenate([force, wrench[..., 3:] - cross(point, force)], axis=-1)


def wrench_map(point: FloatArray) -> FloatArray:
    """(..., 6, 6) matrices of :func:`wrench_about` for points (..., 3)."""
    moved = np.broadcast_to(np.eye(6), (*np.shape(point)[:-1], 6, 6)).copy()
    moved[..., 3:, :3] = -skew(point)
    return moved


def rows_about(rows: FloatArray, shift: FloatArray) -> FloatArray:
    """(m, 6) rows on wrenches rewritten for wrenches about a point moved by ``shift`` (3,) [m].

    ``H1 f + H2 (tau + shift ^ f)`` with the moment ``tau`` about the new point.
    """
    return np.hstack([rows[:, :3] + cross(rows[:, 3:], np.broadcast_to(shift, (len(rows), 3))), rows[:, 3:]])


def rotation_from_yaw(yaw: float) -> FloatArray:
    """Rotation by ``yaw`` [rad] about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_from_quaternion(u: FloatArray) -> FloatArray:
    """(n, 3, 3) rotations of unit xyzw quaternions (n, 4)."""
    vector, scalar = u[:, :3], u[:, 3]
    cross = skew(vector)
    return np.eye(3) + 2.0 * scalar[:, None, None] * cross + 2.0 * cross @ cross


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Rotation ``Rz(yaw) Ry(pitch) Rx(roll)`` of fixed-axis angles [rad] (URDF convention)."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    return rotation_from_yaw(yaw) @ about_y @ about_x


def euler_angles(rotation: FloatArray, order: str) -> FloatArray:
    """(..., 3) angles [rad] of rotations (..., 3, 3) about three axes, named as in SciPy's ``as_euler``.

    At the singularity the third angle is zero, one of the right answers.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Gimbal lock", UserWarning)
        return Rotation.from_matrix(rotation).as_euler(order)


def continuous_angles(rotations: FloatArray, order: str) -> FloatArray:
    """(n, s, 3) angles [rad] of rotations (n, s, 3, 3), of both triples that nearer to the sample before.

    The order names three different axes, as in SciPy's ``as_euler``.
    """
    first = euler_angles(rotations, order)
    other = first * [1.0, -1.0, 1.0] + np.pi
    result = first.copy()
    for sample in range(1, len(result)):
        both = np.stack([first[sample], other[sample]])
        both += 2.0 * np.pi * np.round((result[sample - 1] - both) / (2.0 * np.pi))
        nearer = np.abs(both - result[sample - 1]).max(axis=2).argmin(axis=0)
        result[sample] = both[nearer, np.arange(both.shape[1])]
    return result


def rotation_from_normal(normal: ArrayLike, yaw: float = 0.0) -> FloatArray:
    """Rotation with z along ``normal`` (3,): the smallest tilt of the world, after a ``yaw`` [rad] about z.

    Raises:
        InputError: If the normal is zero or not finite.
    """
    n = frozen_array(normal, "normal", (3,))
    length = float(np.linalg.norm(n))
    if length < 1e-12:
        raise InputError(f"normal is {n.tolist()}; valid: a direction that is not zero")
    n = n / length
    axis = np.array([-n[1], n[0], 0.0])
    if n[2] < -1.0 + 1e-12:
        tilt = np.diag([1.0, -1.0, -1.0])
    else:
        k = skew(axis)
        tilt = np.eye(3) + k + k @ k / (1.0 + n[2])
    return tilt @ rotation_from_yaw(yaw)


def onto_normal(rotation: FloatArray, normal: FloatArray) -> FloatArray:
    """(3, 3) rotation turned by the shortest way so that its z axis is the unit normal exactly."""
    across = skew(normal) @ rotation[:, 0]
    length = math.sqrt(across @ across)
    if length < 1e-9:
        across, length = np.array(rotation[:, 1]), 1.0
    y = across / length
    turned = np.empty((3, 3))
    turned[:, 0], turned[:, 1], turned[:, 2] = skew(y) @ normal, y, normal
    return turned


def yaw_about_normal(rotation: FloatArray) -> float:
    """Yaw [rad] with which :func:`rotation_from_normal` gives a rotation (3, 3) for its z axis."""
    x, y, _ = rotation_from_normal(rotation[:, 2]).T @ rotation[:, 0]
    return float(np.arctan2(y, x))


def axes_of_normal(normal: FloatArray) -> FloatArray:
    """(3, 3) rotation with z along a unit ``normal`` (3,), x across the world axis farthest from it."""
    across = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(normal, across), normal])


def turned_root(q: ArrayLike, yaw: float) -> FloatArray:
    """(..., nq) configurations with the root turned about the vertical through itself by ``yaw`` [rad]."""
    turned = np.array(q, dtype=np.float64)
    _turn(turned[..., 3:7], np.sin(0.5 * yaw), np.cos(0.5 * yaw))
    return turned


def _turn(quaternions: FloatArray, s: float, c: float) -> None:
    """Turn xyzw quaternions (..., 4) in place about the vertical, by sine and cosine of half the angle."""
    x, y, z, w = np.moveaxis(quaternions.copy(), -1, 0)
    quaternions[...] = np.stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z], axis=-1)


def check_rotation(rotation: ArrayLike, name: str, error: type[InputError] = InputError) -> FloatArray:
    """Return ``rotation`` as a read-only (3, 3) array after checking that it is one.

    Raises:
        InputError: If it is not orthonormal with determinant +1 (to 1e-6).
    """
    matrix = frozen_array(rotation, name, (3, 3), error)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-6 or np.linalg.det(matrix) < 0:
        raise error(f"{name} is not a rotation matrix; valid: orthonormal rows, determinant +1")
    return matrix


@dataclass(frozen=True)
class PlanarTransform:
    """Change of frame that keeps heights: a turn about the vertical, then a horizontal shift.

    An instance named ``transform_a_to_b`` maps coordinates in frame *a* to coordinates in frame *b*.

    Attributes:
        x: Where the origin of *a* lies in *b* [m].
        y: The same [m].
        yaw_deg: Direction of the x axis of *a* in *b*, counter-clockwise from its x axis [deg].
    """

    x: float = 0.0
    y: float = 0.0
    yaw_deg: float = 0.0

    @property
    def yaw(self) -> float:
        """Turn about the vertical [rad]."""
        return math.radians(self.yaw_deg)

    @property
    def is_identity(self) -> bool:
        """Whether both frames are equal."""
        return self.x == 0.0 and self.y == 0.0 and self.yaw_deg == 0.0

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) rotation about the vertical, exact for quarter turns."""
        c, s = float(cosdg(self.yaw_deg)) + 0.0, float(sindg(self.yaw_deg)) + 0.0
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @property
    def inverse(self) -> "PlanarTransform":
        """The transform back."""
        x, y, _ = (-(self.rotation.T @ [self.x, self.y, 0.0]) + 0.0).tolist()
        return PlanarTransform(x, y, -self.yaw_deg + 0.0)

    def after(self, other: "PlanarTransform") -> "PlanarTransform":
        """Composition: ``other`` first, then this transform."""
        x, y = self.points([other.x, other.y]).tolist()
        return PlanarTransform(x, y, self.turned(other.yaw_deg))

    def points(self, points: ArrayLike) -> FloatArray:
        """(..., 2) or (..., 3) points, moved [m]; heights stay."""
        moved = self.directions(points)
        moved[..., :2] += self.x, self.y
        return moved

    def directions(self, vectors: ArrayLike) -> FloatArray:
        """(..., 2) or (..., 3) directions, velocities or forces, turned."""
        given = np.asarray(vectors, dtype=np.float64)
        size = given.shape[-1]
        return given @ self.rotation[:size, :size].T

    def rotations(self, rotations: ArrayLike) -> FloatArray:
        """(..., 3, 3) rotations from any frame to *a*, as rotations to *b*."""
        return np.asarray(self.rotation @ np.asarray(rotations, dtype=np.float64))

    def turned(self, heading_deg: float) -> float:
        """Heading after the turn, above -180 and up to 180 [deg]."""
        heading = math.remainder(heading_deg + self.yaw_deg, 360.0)
        return 180.0 if heading == -180.0 else heading

    def poses(self, poses: ArrayLike) -> FloatArray:
        """(..., k) poses that begin with a position [m] and an xyzw quaternion, moved; the rest stays.

        Configurations of a body with a free root are such poses.
        """
        moved = np.array(poses, dtype=np.float64)
        moved[..., :3] = self.points(moved[..., :3])
        half = 0.5 * self.yaw_deg
        _turn(moved[..., 3:7], float(sindg(half)), float(cosdg(half)))
        return moved


IDENTITY = PlanarTransform()
"""The transform between equal frames."""


def rotation_vector(rotations: FloatArray) -> FloatArray:
    """(n, 3) rotation vectors of rotations (n, 3, 3), not longer than pi [rad]."""
    return np.asarray(Rotation.from_matrix(rotations).as_rotvec(), dtype=np.float64)


def rotation_vector_jacobian(vectors: FloatArray) -> FloatArray:
    """(n, 3, 3) derivative of rotation vectors (n, 3) [rad] by a turn of the rotated frame in its own axes.

    ``I + [w] / 2 + (1 - (a / 2) cot(a / 2)) / a^2 [w]^2`` with ``a = |w|``: the right Jacobian's inverse.
    """
    angle = np.linalg.norm(vectors, axis=-1)
    safe = np.where(angle < 0.02, 1.0, angle)
    exact = (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2
    # By the Taylor series near zero, where the difference above loses its digits.
    factor = np.where(angle < 0.02, 1.0 / 12.0 + angle**2 / 720.0, exact)
    cross = skew(vectors)
    return np.eye(3) + 0.5 * cross + factor[..., None, None] * (cross @ cross)


def matrix(rows: list[list[FloatArray]]) -> FloatArray:
    """(..., 3, 3) of nine (...) entries."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotations(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(..., 3, 3) ``Rz(yaw) Ry(pitch) Rx(roll)`` of (...) angles [rad]."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    return matrix([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def quaternions(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(..., 4) xyzw quaternions of :func:`rotations`, continuous in the angles."""
    cy, sy, cp, sp = np.cos(0.5 * yaw), np.sin(0.5 * yaw), np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    cr, sr = np.cos(0.5 * roll), np.sin(0.5 * roll)
    return np.stack([
        cy * cp * sr - sy * sp * cr, cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr, cy * cp * cr + sy * sp * sr,
    ], axis=-1)  # fmt: skip


def dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """(...) products of (..., 3) vectors."""
    return np.einsum("...i,...i->...", first, second)
