"""Small helpers on vectors, rotations and checked, read-only arrays.

Rotations are 3x3 matrices or xyzw quaternions; ``rotation_a_to_b`` maps
coordinates in frame *a* to coordinates in frame *b*.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from manikin.errors import InputError

FloatArray = NDArray[np.float64]

GRAVITY = 9.81
"""Standard gravity used throughout [m/s^2] ([Qiu2012]_ 4.2.8)."""

GRAVITY_VECTOR: FloatArray = np.array([0.0, 0.0, -GRAVITY])
GRAVITY_VECTOR.setflags(write=False)


def frozen_array(
    value: ArrayLike,
    name: str,
    shape: Sequence[int | None] | None = None,
    error: type[InputError] = InputError,
) -> FloatArray:
    """Copy ``value`` into a finite, read-only float array of the wanted shape.

    Args:
        value: Anything numpy can turn into an array of floats.
        name: How the message calls it, with its place (``"contact 'left_foot' position"``).
        shape: Expected shape; ``None`` entries are free. ``None`` accepts any shape.
        error: Exception class to raise.

    Raises:
        InputError: If the value is not numeric, not finite or of another shape.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise error(f"{name} is {value!r}; valid: numbers of shape {_shape_text(shape)}") from None
    if shape is not None and not _shape_matches(array.shape, shape):
        raise error(f"{name} has shape {array.shape}; valid: shape {_shape_text(shape)}")
    if not np.all(np.isfinite(array)):
        raise error(f"{name} is {array.tolist()}; valid: finite numbers")
    array.setflags(write=False)
    return array


def finite_number(
    value: object,
    name: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    error: type[InputError] = InputError,
) -> float:
    """Check one number against its bounds and return it as a float.

    Raises:
        InputError: If the value is not a finite number inside the bounds.
    """
    bounds = [
        f"> {above:g}" if above is not None else "",
        f">= {at_least:g}" if at_least is not None else "",
        f"<= {at_most:g}" if at_most is not None else "",
    ]
    valid = "a finite number " + " and ".join(bound for bound in bounds if bound)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise error(f"{name} is {value!r}; valid: {valid.strip()}")
    number = float(value)
    inside = (
        np.isfinite(number)
        and (above is None or number > above)
        and (at_least is None or number >= at_least)
        and (at_most is None or number <= at_most)
    )
    if not inside:
        raise error(f"{name} is {number:g}; valid: {valid.strip()}")
    return number


def _shape_matches(actual: tuple[int, ...], wanted: Sequence[int | None]) -> bool:
    return len(actual) == len(wanted) and all(
        w is None or a == w for a, w in zip(actual, wanted, strict=True)
    )


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


def skew(vector: ArrayLike) -> FloatArray:
    """Matrix of the cross product, ``skew(a) @ b == cross(a, b)`` ([Qiu2012]_ 2.10).

    Args:
        vector: (3,) or (..., 3).

    Returns:
        (..., 3, 3).
    """
    v = np.asarray(vector, dtype=np.float64)
    if v.ndim == 1:
        x, y, z = v.tolist()
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.zeros((*v.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix


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


def rotation_from_normal(normal: ArrayLike, yaw: float = 0.0) -> FloatArray:
    """Rotation whose z axis is ``normal``: the smallest tilt of the world, after a yaw about z.

    Args:
        normal: (3,) direction, not zero.
        yaw: Turn about the normal before tilting [rad].

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


def check_rotation(rotation: ArrayLike, name: str, error: type[InputError] = InputError) -> FloatArray:
    """Return ``rotation`` as a read-only (3, 3) array after checking that it is one.

    Raises:
        InputError: If it is not orthonormal with determinant +1 (to 1e-6).
    """
    matrix = frozen_array(rotation, name, (3, 3), error)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-6 or np.linalg.det(matrix) < 0:
        raise error(f"{name} is not a rotation matrix; valid: orthonormal rows, determinant +1")
    return matrix


def rotation_vector(rotations: FloatArray) -> FloatArray:
    """(n, 3) rotation vectors of rotations (n, 3, 3), not longer than pi [rad]."""
    return np.asarray(Rotation.from_matrix(rotations).as_rotvec(), dtype=np.float64)


def rotation_vector_jacobian(vectors: FloatArray) -> FloatArray:
    """Derivative of rotation vectors by a turn of the rotated frame about its own axes.

    ``I + [w] / 2 + (1 - (a / 2) cot(a / 2)) / a^2 [w]^2`` with ``a = |w|``, the inverse of the right
    Jacobian of SO(3).

    Args:
        vectors: (n, 3) rotation vectors ``w`` [rad].

    Returns:
        (n, 3, 3).
    """
    angle = np.linalg.norm(vectors, axis=-1)
    safe = np.where(angle < 0.02, 1.0, angle)
    exact = (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2
    # By the Taylor series near zero, where the difference above loses its digits.
    factor = np.where(angle < 0.02, 1.0 / 12.0 + angle**2 / 720.0, exact)
    cross = skew(vectors)
    return np.eye(3) + 0.5 * cross + factor[..., None, None] * (cross @ cross)
