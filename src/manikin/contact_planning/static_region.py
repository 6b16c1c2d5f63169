"""Where the centre of mass may stand still on a stance."""

from dataclasses import dataclass

import numpy as np

from manikin.balance import admissible_com_polygon, polygon_of_halfplanes, signed_distance, wrench_polytope
from manikin.contact import Stance
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class StaticRegion:
    """Ground below the places of the centre of mass at which a stance carries the body at rest.

    Attributes:
        polygon: (k, 2) vertices counter-clockwise [m]; none when the stance cannot carry the body.
    """

    polygon: FloatArray

    @classmethod
    def of(cls, stance: Stance, mass: float) -> "StaticRegion":
        """Region of a stance ([Qiu2012]_ 4.41); a stance without caps has the default one of the body.

        Args:
            stance: The contacts, with their contact model.
            mass: Of the body [kg].
        """
        return cls(admissible_com_polygon(wrench_polytope(stance.bounded(mass)), mass))

    @property
    def is_empty(self) -> bool:
        """Whether the body can stand still nowhere on this stance."""
        return len(self.polygon) < 3

    def nearest(self, point: FloatArray, inset: float) -> FloatArray | None:
        """(2,) nearest place to a (2,) point that keeps a distance to the region's edges, or None.

        Args:
            point: [m].
            inset: Distance to keep [m]; half of what is possible where the region is too narrow for it.
        """
        for distance in (inset, 0.5 * inset, 0.25 * inset):
            inner = self._inset(distance)
            if len(inner) >= 3:
                return _onto(inner, point)
        return None

    def _inset(self, distance: float) -> FloatArray:
        if self.is_empty:
            return self.polygon
        edges = np.roll(self.polygon, -1, axis=0) - self.polygon
        lengths = np.linalg.norm(edges, axis=1)
        edges, start = edges[lengths > 1e-9], self.polygon[lengths > 1e-9]
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[lengths > 1e-9, None]
        return polygon_of_halfplanes(normals, np.einsum("ni,ni->n", normals, start) - distance)


def _onto(polygon: FloatArray, point: FloatArray) -> FloatArray:
    """Nearest point of a convex polygon."""
    if signed_distance(point, polygon) >= 0.0:
        return np.array(point, dtype=np.float64)
    edges = np.roll(polygon, -1, axis=0) - polygon
    shares = np.einsum("ni,ni->n", point - polygon, edges) / np.maximum(
        np.einsum("ni,ni->n", edges, edges), 1e-18
    )
    places = polygon + np.clip(shares, 0.0, 1.0)[:, None] * edges
    return places[int(np.argmin(np.linalg.norm(places - point, axis=1)))]
