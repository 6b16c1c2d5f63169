"""Range of motion of a ball joint as a volume of its three angles ([Tonneau2015]_ 4.3.3).

The angles of a hip or shoulder depend on each other: how far an arm turns inward depends on where it points.
The thesis therefore takes the non-convex hull of recorded angles, which it then treats as a polytope; a
polytope, though, is convex. We keep the hull as the signed distance to its surface, on a grid.

The hull: all points of angle space within ``closing`` of a recorded one, then drawn in by ``closing``
minus ``margin``. So gaps between recordings narrower than twice ``closing`` are filled, hollows that are
wider stay, and every recorded point is about ``margin`` inside. Only its largest connected part is kept.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import distance_transform_edt, label

from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array, skew


def ball_rotation(axes: ArrayLike, angles: ArrayLike) -> FloatArray:
    """(..., 3, 3) rotations of a segment to its parent: the product of its three hinges, the first leftmost.

    Args:
        axes: (3, 3) unit axes, one a row.
        angles: (..., 3) [rad].
    """
    q = np.asarray(angles, dtype=np.float64)
    total = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    for number, cross in enumerate(skew(axes)):
        sine, cosine = np.sin(q[..., number])[..., None, None], np.cos(q[..., number])[..., None, None]
        total = total @ (np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross)
    return np.array(total)


def ball_angles(axes: ArrayLike, rotations: ArrayLike, middle: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """(..., 3) angles of three hinges that give rotations [rad]; the inverse of :func:`ball_rotation`.

    The second angle is within 90 degrees of 0. At its ends only the sum or the difference of the
    others is defined, and nearby they are sensitive.

    Args:
        axes: (3, 3) unit axes, one a row, each perpendicular to the next; BodyError if they are not.
        rotations: (..., 3, 3).
        middle: (3,) the first and the third angle are within half a turn of these [rad].
    """
    first, second, third = np.asarray(axes, dtype=np.float64)
    basis = np.column_stack([first, second, np.cross(first, second)])
    sign = float(third @ basis[:, 2])
    if abs(first @ second) > 1e-9 or abs(abs(sign) - 1.0) > 1e-9:
        raise BodyError("hinges of a ball joint are oblique; valid: three perpendicular unit axes")
    turn = basis.T @ np.asarray(rotations, dtype=np.float64) @ basis
    angles = np.stack([
        np.arctan2(-turn[..., 1, 2], turn[..., 2, 2]),
        np.arcsin(np.clip(turn[..., 0, 2], -1.0, 1.0)),
        sign * np.arctan2(-turn[..., 0, 1], turn[..., 0, 0]),
    ], axis=-1)  # fmt: skip
    centre = np.asarray(middle, dtype=np.float64)
    return centre + (angles - centre + np.pi) % (2.0 * np.pi) - np.pi


STEP, CLOSING, MARGIN = (float(np.deg2rad(angle)) for angle in (5.0, 30.0, 10.0))
"""Defaults of :func:`volume_of` [rad]; our choice, for recordings of everyday movement.

Those of the thesis are of the largest movement that the subject could do."""

FEWEST = 2
"""Frames with which a cell of the fine grid counts as seen; our choice, against single wrong frames."""

_ROUNDING = 1e-12
_FINER = 2
_MOST_CELLS = 40_000_000


@dataclass(frozen=True, eq=False)
class JointVolume:
    """Signed distance to the surface of a volume of three angles, on a grid.

    Attributes:
        origin: (3,) angles of the grid's first point [rad].
        step: Spacing [rad].
        distances: (a, b, c) distance to the surface, negative outside [rad].
    """

    origin: FloatArray
    step: float
    distances: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", frozen_array(self.origin, "volume origin", (3,), BodyError))
        finite_number(self.step, "volume step [rad]", above=0.0, error=BodyError)
        table = frozen_array(self.distances, "volume distances", (None, None, None), BodyError)
        if min(table.shape) < 2 or table.max() <= 0.0:
            shape = table.shape
            raise BodyError(f"volume of shape {shape} holds nothing; valid: 2 points each way, one inside")
        object.__setattr__(self, "distances", table)

    @cached_property
    def points(self) -> FloatArray:
        """(a, b, c, 3) angles of the grid's points [rad]."""
        index = np.stack(np.meshgrid(*(np.arange(n) for n in self.distances.shape), indexing="ij"), axis=-1)
        return self.origin + self.step * index

    def distance(self, angles: ArrayLike) -> FloatArray:
        """(...) distance of (..., 3) angles to the surface, negative outside [rad].

        Linear between the grid's points; off the grid that of its nearest point, less the distance to it.
        """
        x, beyond = self._on_grid(angles)
        total = np.zeros(x.shape[:-1])
        for _, factors, value in self._corners(x):
            total += np.prod(factors, axis=-1) * value
        return total - beyond

    def gradient(self, angles: ArrayLike) -> FloatArray:
        """(..., 3) derivative of :meth:`distance`."""
        x, beyond = self._on_grid(angles)
        slope = np.zeros(x.shape)
        for corner, factors, value in self._corners(x):
            for axis in range(3):
                others = np.prod(np.delete(factors, axis, axis=-1), axis=-1)
                slope[..., axis] += (1.0 if corner[axis] else -1.0) * others * value
        # Off the grid, what is beyond it counts and no longer what is along it.
        over = np.asarray(angles, dtype=np.float64) - (self.origin + self.step * x)
        over[np.abs(over) <= _ROUNDING] = 0.0
        along = np.where(over == 0.0, slope / self.step, 0.0)
        return along - over / np.maximum(beyond, _ROUNDING)[..., None]

    def _on_grid(self, angles: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Points of the grid in steps, and the distance [rad] from the angles to them."""
        q = np.asarray(angles, dtype=np.float64)
        if q.shape[-1:] != (3,):
            raise BodyError(f"angles of a ball joint have shape {q.shape}; valid: (..., 3)")
        wanted = (q - self.origin) / self.step
        x = np.clip(wanted, 0.0, np.array(self.distances.shape) - 1.0)
        return x, self.step * np.linalg.norm(wanted - x, axis=-1)

    def _corners(self, x: FloatArray) -> Iterator[tuple[tuple[int, ...], FloatArray, FloatArray]]:
        """Corners of the cells of points (..., 3), the factors (..., 3) of their weights and their values."""
        cell = np.minimum(np.floor(x).astype(np.int64), np.array(self.distances.shape) - 2)
        share = x - cell
        for corner in np.ndindex(2, 2, 2):
            value = self.distances[tuple(cell[..., axis] + corner[axis] for axis in range(3))]
            yield corner, np.where(corner, share, 1.0 - share), value


def volume_of(
    angles: ArrayLike, closing: float = CLOSING, margin: float = MARGIN, step: float = STEP,
    fewest: int = FEWEST,
) -> JointVolume:  # fmt: skip
    """Volume that holds recorded angles, see the module.

    Args:
        angles: (n, 3) recorded angles [rad].
        closing: Half the width of gaps that are filled [rad], at least ``margin``.
        margin: How far the volume reaches beyond the recorded angles [rad], >= 0.
        step: Spacing of the grid [rad]; the hull is found on one twice as fine.
        fewest: Frames with which a cell of that one counts as seen.

    Raises:
        BodyError: If a value is out of its range, no cell is seen enough, or the angles are too far apart.
    """
    recorded = frozen_array(angles, "recorded angles", (None, 3), BodyError)
    margin = finite_number(margin, "margin [rad]", at_least=0.0, error=BodyError)
    closing = finite_number(closing, "closing [rad]", at_least=margin, error=BodyError)
    fine = finite_number(step, "step [rad]", above=0.0, error=BodyError) / _FINER
    origin, seen = _seen(recorded, fine, closing + 2.0 * step, fewest)
    parts = np.zeros(seen.shape, dtype=np.int32)
    label(fine * _distance_to_zeros(~seen) <= closing, output=parts)
    largest = 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    hull = fine * _distance_to_zeros(parts == largest) > closing - margin
    inside, outside = (fine * _distance_to_zeros(part) for part in (hull, ~hull))
    signed = np.where(hull, inside - 0.5 * fine, 0.5 * fine - outside)
    return _cropped(origin, _FINER * fine, signed[::_FINER, ::_FINER, ::_FINER])


def _seen(
    recorded: FloatArray, fine: float, border: float, fewest: int
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """First point of a fine grid, and which of its points are near enough recorded angles."""
    if not len(recorded):
        raise BodyError("no recorded angles; valid: at least one")
    origin = np.min(recorded, axis=0) - border
    shape = np.ceil((np.max(recorded, axis=0) + border - origin) / fine).astype(np.int64) + 1
    if float(np.prod(shape.astype(np.float64))) > _MOST_CELLS:
        raise BodyError(f"volume of {shape.tolist()} cells; valid: a larger step or angles less far apart")
    counts = np.zeros(shape, dtype=np.int64)
    np.add.at(counts, tuple(np.rint((recorded - origin) / fine).astype(np.int64).T), 1)
    seen = counts >= fewest
    if not seen.any():
        raise BodyError(f"no angles are seen in {fewest} frames; valid: more recorded angles")
    return origin, seen


def _distance_to_zeros(mask: NDArray[np.bool_]) -> FloatArray:
    """Distance of each point to the nearest one that is False, in points."""
    return np.asarray(distance_transform_edt(mask), dtype=np.float64)


def _cropped(origin: FloatArray, step: float, distances: FloatArray) -> JointVolume:
    """The grid without what is far outside."""
    inside = np.argwhere(distances > 0.0)
    if not len(inside):
        raise BodyError("the volume holds no point of its grid; valid: a smaller step or more angles")
    low = np.maximum(inside.min(axis=0) - 2, 0)
    high = np.minimum(inside.max(axis=0) + 3, distances.shape)
    part = distances[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    return JointVolume(origin + step * low, step, part)
