"""A scene: named obstacles and a floor."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.contact import Contact, ContactKind
from manikin.errors import ContactError, SceneError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.runtime.display import Displayed
from manikin.scene.collision import Meter, collision_parts, part_meter
from manikin.scene.footing import FootingTable
from manikin.scene.merging import COPLANAR, merged_surfaces
from manikin.scene.obstacle import HalfSpace, Obstacle
from manikin.scene.surface import GraspLine, Surface, bar_tops, grasp_lines, grasp_strips, palm_places

FLOOR = "floor"
"""Name of the floor obstacle."""
GRASP_REACH = 0.06
"""Largest distance from the middle of a grasping palm to the surface that it holds on to [m]."""
_ALIGNED = float(np.cos(np.deg2rad(2.0)))


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Displayed):
    """Obstacles with unique names; the floor, of ``floor_height`` [m] unless None, comes first."""

    obstacles: tuple[Obstacle, ...]
    floor_height: float | None

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {"obstacles": str(len(self)), "names": " ".join(self.names)}

    def __init__(self, obstacles: Sequence[Obstacle] = (), floor_height: float | None = 0.0) -> None:
        for item in obstacles:
            if not isinstance(item, Obstacle):
                raise SceneError(f"scene contains {item!r}; valid: Obstacle values")
        everything = list(obstacles)
        if floor_height is not None:
            floor_height = finite_number(floor_height, "scene floor_height [m]", error=SceneError)
            everything.insert(0, Obstacle(FLOOR, HalfSpace((0.0, 0.0, 1.0), floor_height)))
        names = [item.name for item in everything]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise SceneError(
                f"scene has obstacle {twice[0]!r} twice; valid: one obstacle per name"
                + (f" ({FLOOR!r} is the scene's own floor)" if twice[0] == FLOOR else "")
            )
        object.__setattr__(self, "obstacles", tuple(everything))
        object.__setattr__(self, "floor_height", floor_height)

    def __len__(self) -> int:
        return len(self.obstacles)

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    def __contains__(self, name: object) -> bool:
        return any(item.name == name for item in self.obstacles)

    def __getitem__(self, name: str) -> Obstacle:
        for item in self.obstacles:
            if item.name == name:
                return item
        raise KeyError(f"no obstacle {name!r}; this scene has {list(self.names)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the obstacles, in order."""
        return tuple(item.name for item in self.obstacles)

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """Every flat place of the scene, see :func:`manikin.scene.merging.merged_surfaces`."""
        return merged_surfaces(self.obstacles)

    @cached_property
    def grasp_lines(self) -> tuple[GraspLine, ...]:
        """Pieces of rails, rungs and other bars that a hand can close round, in order."""
        return grasp_lines(self.obstacles, self._distances)

    @cached_property
    def bar_tops(self) -> tuple[Surface, ...]:
        """Strips along the tops of level round bars, on which only soles lie; no :attr:`surfaces`."""
        return bar_tops(self.obstacles)

    @cached_property
    def holds(self) -> tuple[Surface, ...]:
        """The surfaces, and after them faces around the round bars, on which only a palm can lie."""
        return (*self.surfaces, *grasp_strips(self.grasp_lines, self.obstacles))

    def palms(self, numbers: NDArray[np.int64], points: FloatArray) -> FloatArray:
        """(n, 3) places of palms over points (n, 3) of holds of (n,) indices: on bars in their middle [m]."""
        placed, strip = np.array(points), numbers - len(self.surfaces)
        rows = np.flatnonzero(strip >= 0)
        if len(rows):
            on_axis = palm_places(self.grasp_lines, strip[rows], placed[rows])
            normals = np.array([self.holds[number].normal for number in numbers[rows]])
            height = np.einsum("ni,ni->n", placed[rows] - on_axis, normals)
            placed[rows] = on_axis + height[:, None] * normals
        return placed

    def surfaces_facing(self, direction: Sequence[float], max_angle: float) -> tuple[Surface, ...]:
        """Surfaces whose normal is within ``max_angle`` [rad] of ``direction`` (3,)."""
        unit = np.asarray(direction, dtype=np.float64)
        unit = unit / np.linalg.norm(unit)
        limit = np.cos(max_angle)
        return tuple(surface for surface in self.surfaces if surface.normal @ unit >= limit)

    def supporting_surface(self, contact: Contact, tolerance: float = 0.005) -> Surface:
        """Closest surface on which every point of a contact rests.

        Each point must be within ``tolerance`` [m] of the surface, above or below it, and at most that far
        beyond its edge; normals may differ by 2 degrees. A grasp needs only a surface near its point,
        whatever its normal; round obstacles have none, see :meth:`nearest`. ContactError if there is none.
        """
        aligned = self._aligned(contact)
        points = contact.points_in_world
        worst = [_misfit(surface, points, tolerance) for surface in aligned]
        if worst and min(worst) <= tolerance:
            return aligned[int(np.argmin(worst))]
        raise ContactError(self._off_surface(contact, aligned, tolerance))

    def contact_polygon(self, contact: Contact, tolerance: float = 0.005) -> tuple[FloatArray, float]:
        """What of a sole lies on the scene, and the share of its area that this is.

        For many places use a :class:`~manikin.scene.footing.FootingTable`, which says the same. The middle of
        the sole is at most ``tolerance`` [m] above or below its surface.

        Returns:
            (k, 2) corners in the contact frame [m] on the surface that has most of it, none where it cannot
            stand there; the share.
        """
        place, turn, aligned = contact.position, contact.rotation_contact_to_world, self._aligned(contact)
        surfaces = [item for item in aligned if abs(float(item.height(place[None])[0])) <= tolerance]
        if not surfaces:
            return np.zeros((0, 2)), 0.0
        rows = np.arange(len(surfaces))
        table = FootingTable(surfaces, contact.outline)
        footing = table.place(rows, np.tile(place, (len(rows), 1)), np.tile(turn, (len(rows), 1, 1)))
        row = int(np.argmax(footing.share))
        share = float(footing.share[row])
        return (table.polygon(row, place, turn) if footing.stands[row] else np.zeros((0, 2))), share

    def nearest(self, point: ArrayLike) -> tuple[str, float]:
        """Nearest obstacle to a (3,) world point, and its signed distance [m]; SceneError without any."""
        if not self.obstacles:
            raise SceneError("scene is empty, so nothing is nearest; valid: at least one obstacle")
        distance, name = self._distances(point)[0]
        return name, distance

    def distance_beside(self, point: ArrayLike, obstacles: Collection[str]) -> float:
        """Signed distance of a (3,) world point to the nearest other obstacle; infinite without any [m]."""
        others = (distance for distance, name in self._distances(point) if name not in obstacles)
        return next(others, np.inf)

    def touched_obstacles(self, contact: Contact, tolerance: float = 0.005) -> tuple[str, ...]:
        """Names of the obstacles that a contact touches; ContactError if there is none.

        A sole or point lies on a surface, see :meth:`supporting_surface`, and touches all obstacles that the
        surface belongs to: what is coplanar beside it is never in its way. A grasp has the fingers around
        what is within :data:`GRASP_REACH` of its position, nearest to it, several where they meet there.
        """
        if contact.kind is not ContactKind.GRASP:
            return self.supporting_surface(contact, tolerance).obstacles
        near = self._distances(contact.position) if self.obstacles else [(np.inf, "")]
        distance, name = near[0]
        if distance > GRASP_REACH:
            place = np.round(contact.position, 4).tolist()
            away = f"the nearest, {name!r}, is {distance * 1000:.1f} mm away"
            nearest = away if name else "the scene is empty"
            raise ContactError(
                f"grasp '{contact.effector}' at {place} m holds on to nothing: {nearest}; "
                f"valid: within {GRASP_REACH * 1000:g} mm of an obstacle"
            )
        return tuple(other for away, other in near if away <= distance + COPLANAR)

    def _distances(self, point: ArrayLike) -> list[tuple[float, str]]:
        """Signed distance [m] of a (3,) world point to each obstacle, and its name; the nearest first."""
        place = coal.Transform3s(np.eye(3), frozen_array(point, "point [m]", (3,), SceneError))
        meters = self._point_meters.items()
        found = [(min(meter(place, at, np.inf)[0] for meter, at in parts), name) for name, parts in meters]
        return sorted(found, key=lambda item: item[0])

    @cached_property
    def _point_meters(self) -> dict[str, list[tuple[Meter, coal.Transform3s]]]:
        point = coal.Sphere(1e-9)
        return {
            item.name: [
                (part_meter(point, part), coal.Transform3s(part.rotation, part.translation))
                for part in collision_parts(item)
            ]
            for item in self.obstacles
        }

    def _aligned(self, contact: Contact) -> list[Surface]:
        if contact.kind is ContactKind.GRASP:
            return list(self.surfaces)
        tops = self.bar_tops if contact.kind is ContactKind.SOLE else ()
        return [item for item in (*self.surfaces, *tops) if item.normal @ contact.normal >= _ALIGNED]

    def _off_surface(self, contact: Contact, aligned: list[Surface], tolerance: float) -> str:
        where = f"contact '{contact.effector}' at {np.round(contact.position, 4).tolist()} m"
        remedy = f"valid: every contact point within {tolerance * 1000:g} mm of one surface"
        if not aligned:
            facing = np.round(contact.normal, 3).tolist()
            return f"{where} lies on no surface: none faces its normal {facing}; {remedy}"
        points = contact.points_in_world
        nearest = min(aligned, key=lambda surface: _misfit(surface, points, np.inf))
        height = nearest.height(points)
        over = float(nearest.outside(points).max())
        worst = float(height[np.argmax(np.abs(height))])
        side = "above" if worst >= 0 else "below"
        beside = f" and {over * 1000:.1f} mm beyond its edge" if over > tolerance else ""
        names = " and ".join(nearest.obstacles)
        if beside and abs(worst) <= tolerance and contact.kind is ContactKind.SOLE:
            polygon, share = self.contact_polygon(contact, tolerance)
            part = np.round(polygon, 4).tolist()
            remedy += f", or, with the {100 * share:.0f} % of it that does, polygon: {part}" if part else ""
        return (
            f"{where} lies on no surface: the nearest, of '{names}', has a contact point "
            f"{abs(worst) * 1000:.1f} mm {side} it{beside}; {remedy}"
        )


def _misfit(surface: Surface, points: FloatArray, tolerance: float) -> float:
    """Larger of the worst height and the worst overhang of the points [m].

    The height alone where it already exceeds ``tolerance`` [m]: the overhang takes longer.
    """
    height = float(np.abs(surface.height(points)).max())
    return height if height > tolerance else max(height, float(surface.outside(points).max()))
