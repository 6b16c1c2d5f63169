"""The area in which the ZMP may be: the hull of the soles, a rectangle for parallel feet."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.balance.polygon import convex_polygon, signed_distance
from manikin.contact import Contact
from manikin.control.balance_recovery.closed_loop import ClosedLoop, LinearMap
from manikin.errors import InputError
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False)
class SupportArea:
    """A convex area of the ground.

    Attributes:
        corners: (k, 2) counter-clockwise [m].
        height: Of the ground [m].
    """

    corners: FloatArray
    height: float

    @classmethod
    def of(cls, soles: Sequence[Contact]) -> "SupportArea":
        """Hull of soles that lie on one level plane.

        Raises:
            InputError: If they do not.
        """
        points = np.concatenate([contact.points_in_world for contact in soles])
        if np.ptp(points[:, 2]) > 1e-6:
            raise InputError(
                f"soles lie at heights from {points[:, 2].min():.3g} to {points[:, 2].max():.3g} m; "
                "valid: both on one level plane"
            )
        return cls(convex_polygon(points[:, :2]), float(points[:, 2].mean()))

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) mean of the corners [m]."""
        return frozen_array(self.corners.mean(axis=0), "centre")

    def reach(self, point: FloatArray) -> float:
        """How far out a point (2,) is: 0 in the centre, 1 on the edge, more outside."""
        normals, _ = self._edges
        return float(np.max((normals @ (point - self.centre)) / self._room))

    def inside(self, points: FloatArray) -> FloatArray:
        """Distance of points (..., 2) to the edge, negative outside [m]."""
        return signed_distance(points, self.corners)

    def shrunk(self, share: float) -> "SupportArea":
        """Share of the area about its centre."""
        return SupportArea(self.centre + share * (self.corners - self.centre), self.height)

    def nearest(self, point: FloatArray, inset: float) -> FloatArray:
        """Point (2,) drawn towards the centre until it is inside by ``inset`` [m]."""
        normals, offsets = self.half_planes(inset)
        along = normals @ (point - self.centre)
        room = offsets - normals @ self.centre
        return self.centre + (point - self.centre) / max(1.0, float(np.max(along / room)))

    def closest(self, point: FloatArray, inset: float = 0.0) -> FloatArray:
        """Point (2,) of the area, less ``inset`` [m] along its edge, that is nearest to a point (2,)."""
        normals, offsets = self.half_planes(inset)
        if np.all(normals @ point <= offsets):
            return point.copy()
        # Corner i of the smaller area is where the edges that meet in corner i of the area come to.
        before = np.roll(normals, 1, axis=0), np.roll(offsets, 1)
        corners = np.linalg.solve(
            np.stack((before[0], normals), axis=1), np.stack((before[1], offsets), axis=1)[..., None]
        )[..., 0]
        edges = np.roll(corners, -1, axis=0) - corners
        along = np.sum((point - corners) * edges, axis=1) / np.sum(edges**2, axis=1)
        nearest = corners + np.clip(along, 0.0, 1.0)[:, None] * edges
        return nearest[np.argmin(np.linalg.norm(nearest - point, axis=1))]

    def half_planes(self, inset: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Unit outward normals (k, 2) and offsets (k,) with ``normals @ p <= offsets`` inside."""
        normals, offsets = self._edges
        return normals, offsets - inset

    @cached_property
    def _edges(self) -> tuple[FloatArray, FloatArray]:
        """Normals (k, 2) and offsets (k,) of the edges."""
        along = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.column_stack((along[:, 1], -along[:, 0]))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return frozen_array(normals, "normals"), frozen_array(
            np.sum(normals * self.corners, axis=1), "offsets"
        )

    @cached_property
    def _room(self) -> FloatArray:
        """(k,) distances of the edges from the centre [m]."""
        normals, offsets = self._edges
        return offsets - normals @ self.centre


def zmp_rows(area: SupportArea, loop: ClosedLoop, com: FloatArray, inset: float) -> LinearMap:
    """Rows that are not positive when the ZMP is inside ([Kudoh2002]_ 2.39-2.44, z up).

    With the force ``f`` of the ground and its moment ``n`` about the centre of mass ``s``, the ZMP ``p`` on
    the ground at the height ``z`` has ``p_x f_z = s_x f_z + (z - s_z) f_x - n_y`` and
    ``p_y f_z = s_y f_z + (z - s_z) f_y + n_x``; the rows are ``normal . p f_z - offset f_z``, which is right
    where ``f_z > 0``.

    Args:
        area: Where it may be.
        loop: Maps of the force and the moment.
        com: (3,) [m].
        inset: Kept from the edge [m].
    """
    normals, offsets = area.half_planes(inset)
    moments = _turned(loop.force.matrix, loop.moment.matrix, com, area.height)
    constant = _turned(loop.force.offset, loop.moment.offset, com, area.height)
    return LinearMap(
        normals @ moments - offsets[:, None] * loop.force.matrix[2],
        normals @ constant - offsets * loop.force.offset[2],
    )


def load_row(loop: ClosedLoop, least: float) -> LinearMap:
    """Row that is not positive when the ground carries at least a force; the thesis has no such limit.

    Args:
        loop: Maps of the force.
        least: Vertical force [N].
    """
    return LinearMap(-loop.force.matrix[2:], least - loop.force.offset[2:])


def zmp_of(force: FloatArray, moment: FloatArray, com: FloatArray, height: float) -> FloatArray:
    """(2,) ZMP of a force (3,) and its moment (3,) about the centre of mass [m]; NaN without load."""
    if force[2] <= 0.0:
        return np.full(2, np.nan)
    return _turned(force, moment, com, height) / force[2]


def _turned(force: FloatArray, moment: FloatArray, com: FloatArray, height: float) -> FloatArray:
    """(2, ...) ``p f_z`` for the ZMP ``p``."""
    drop = height - com[2]
    turned: FloatArray = np.stack((
        com[0] * force[2] + drop * force[0] - moment[1],
        com[1] * force[2] + drop * force[1] + moment[0],
    ))  # fmt: skip
    return turned
