"""Places on which a sole can lie: candidates of a footstep search, snapped to the surfaces of a scene.

A candidate is a place and a heading seen from above.  It is put onto every surface below it; where a part
of the sole would hang over an edge, or something stands in its way, it is shifted by up to :data:`SHIFT` to
where more of it lies.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import coal
import numpy as np
from numpy.typing import NDArray

from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.contact_plan import onto_normal
from manikin.scene import Scene, Surface
from manikin.scene.collision import collision_parts

LEAST_SHARE = 0.999
"""Share of a sole that has to lie on a surface."""

SHIFT = 0.08
"""Longest shift of a candidate along each axis of the sole [m]; our choice."""

STEEPEST = math.radians(30.0)
"""Largest slope of a surface to stand on [rad]; our choice."""

FOOT_HEIGHT = 0.10
"""Height above a sole that has to be free for the foot [m]; our choice."""

FOOT_CLEARANCE = 0.015
"""Distance of the foot to what stands beside it [m]; our choice."""

ON_PLANE = 0.02
"""Height up to which a neighbouring surface is no hindrance to a foot [m]; the foot has a test of its own."""

_REQUEST = coal.CollisionRequest()
_ALONG, _ACROSS = 8, 3  # points of a sole that stand for its area
_SHIFTS = np.array([[0.0, 0.0], *((x, y) for x in (-1.0, -0.5, 0.5, 1.0) for y in (0.0,)), *(
    (x, y) for x in (-0.5, 0.0, 0.5) for y in (-0.5, 0.5))])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Foothold:
    """Place of a sole.

    Attributes:
        position: (3,) of the sole's middle in the world [m].
        yaw: Heading of the toes [rad].
        normal: (3,) unit normal of the surface.
        share: Share of the sole's area that lies on the surface.
        surface: Number of the surface; -1 for one that was given.
    """

    position: FloatArray
    yaw: float
    normal: FloatArray
    share: float = 1.0
    surface: int = -1

    @cached_property
    def rotation(self) -> FloatArray:
        """(3, 3) sole-to-world; z along the normal."""
        return onto_normal(rotation_from_yaw(self.yaw), self.normal)


@dataclass(frozen=True, eq=False)
class Holds:
    """Footholds as arrays: positions (k, 3) [m], yaws (k,) [rad], shares (k,) and surfaces (k,)."""

    positions: FloatArray
    yaws: FloatArray
    shares: FloatArray
    surfaces: NDArray[np.int64]

    @classmethod
    def joined(cls, parts: "Sequence[Holds]") -> "Holds":
        """All of several."""
        return cls(*(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("positions", "yaws", "shares", "surfaces")
        ))  # fmt: skip


_NONE = Holds(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))


@dataclass
class Footing:
    """Finds places of soles in one scene; one instance works on buffers of its own.

    Attributes:
        scene: The scene.
        size: Length and width of the sole [m].
        steepest: Largest slope of a surface to stand on [rad].
    """

    scene: Scene
    size: tuple[float, float]
    steepest: float = STEEPEST
    _grounds: "list[_Ground]" = field(init=False, repr=False)
    _parts: list[tuple[coal.CollisionGeometry, coal.Transform3s]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        surfaces = self.scene.surfaces_facing((0.0, 0.0, 1.0), self.steepest)
        self._grounds = [_Ground.of(surface) for surface in surfaces]
        self._parts = [
            (part.geometry, coal.Transform3s(part.rotation, part.translation))
            for item in self.scene
            for part in collision_parts(item)
        ]
        length, width = self.size
        gap = 2.0 * FOOT_CLEARANCE
        self._foot = coal.Box(length + gap, width + gap, FOOT_HEIGHT)
        along, across = np.linspace(-0.5, 0.5, _ALONG), np.linspace(-0.5, 0.5, _ACROSS)
        self._print = np.stack(np.meshgrid(along * length, across * width, indexing="ij"), -1).reshape(-1, 2)
        # The middle third carries the pressure of a foot at rest.
        self._middle: NDArray[np.bool_] = np.abs(self._print[:, 0]) < length / 6.0

    def levels(self, places: FloatArray) -> list[tuple[NDArray[np.int64], FloatArray]]:
        """Of each surface, the rows of places (k, 2) [m] over it and its heights there [m]."""
        found = []
        for ground in self._grounds:
            rows = np.flatnonzero(ground.covers(places))
            found.append((rows, ground.height(places[rows])))
        return found

    def lay(self, places: FloatArray, yaws: FloatArray, level: float, rise: float) -> Holds:
        """Footholds at or near candidates.

        Args:
            places: (k, 2) middles of soles seen from above [m].
            yaws: (k,) headings of the toes [rad].
            level: Height from which the foot comes [m].
            rise: Largest difference in height to there [m].
        """
        found = [_NONE]
        near = [
            (number, ground)
            for number, ground in enumerate(self._grounds)
            if ground.is_near(places, 0.5 * self.size[0] + SHIFT)
        ]
        for number, ground in near:
            heights = ground.height(places)
            rows = np.flatnonzero(np.abs(heights - level) <= rise)
            if len(rows):
                others = [other for index, other in near if index != number]
                found.append(self._on(number, others, places[rows], yaws[rows]))
        return Holds.joined(found)

    def hold(self, holds: Holds, row: int) -> Foothold:
        """One of several footholds."""
        surface = int(holds.surfaces[row])
        normal = self._grounds[surface].normal
        return Foothold(
            holds.positions[row], float(holds.yaws[row]), normal, float(holds.shares[row]), surface
        )

    def is_free(self, hold: Foothold) -> bool:
        """Whether nothing of the scene stands where the foot would be."""
        pose = coal.Transform3s(
            hold.rotation, hold.position + (0.5 * FOOT_HEIGHT + 2e-3) * hold.rotation[:, 2]
        )
        for geometry, place in self._parts:
            result = coal.CollisionResult()
            coal.collide(self._foot, pose, geometry, place, _REQUEST, result)
            if result.isCollision():
                return False
        return True

    def _on(self, number: int, others: "list[_Ground]", places: FloatArray, yaws: FloatArray) -> Holds:
        """Footholds on one surface."""
        ground = self._grounds[number]
        share, clear = self._lies(ground, others, places, yaws)
        best, chosen = places.copy(), np.where(clear, share, 0.0)
        partly = np.flatnonzero((share > 0.0) & ((share < 1.0) | ~clear))
        if len(partly):
            turn = np.stack([np.cos(yaws[partly]), np.sin(yaws[partly])], axis=-1)
            side = np.stack([-turn[:, 1], turn[:, 0]], axis=-1)
            moved = (
                places[partly, None]
                + SHIFT * (_SHIFTS[None, :, :1] * turn[:, None] + _SHIFTS[None, :, 1:] * side[:, None])
            ).reshape(-1, 2)
            lies, free = self._lies(ground, others, moved, np.repeat(yaws[partly], len(_SHIFTS)))
            value = np.where(free, lies, 0.0).reshape(len(partly), -1)
            # A shift has to gain something.
            value -= 0.5 * np.linalg.norm(_SHIFTS, axis=1) * SHIFT
            pick = np.argmax(value, axis=1)
            rows = np.arange(len(partly)) * len(_SHIFTS) + pick
            best[partly], chosen[partly] = moved[rows], np.where(free, lies, 0.0)[rows]
        rows = np.flatnonzero(chosen >= LEAST_SHARE)
        positions = np.column_stack([best[rows], ground.height(best[rows])])
        return Holds(positions, yaws[rows], chosen[rows], np.full(len(rows), number))

    def _lies(
        self, ground: "_Ground", others: "list[_Ground]", places: FloatArray, yaws: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Share of each sole on a surface, and whether its middle is on it and nothing rises in its way."""
        turn = np.stack([np.cos(yaws), np.sin(yaws)], axis=-1)
        side = np.stack([-turn[:, 1], turn[:, 0]], axis=-1)
        points = (
            places[:, None] + self._print[:, :1] * turn[:, None] + self._print[:, 1:] * side[:, None]
        ).reshape(-1, 2)
        on = ground.covers(points).reshape(len(places), -1)
        low = ground.height(points)
        hit = np.zeros(len(points), dtype=bool)
        for other in others:
            above = other.height(points) - low
            rising = (above > ON_PLANE) & (above < 2.0 * FOOT_HEIGHT)
            if rising.any():
                hit |= rising & other.covers(points)
        clear = on[:, self._middle].all(axis=1)
        clear &= ~hit.reshape(len(places), -1).any(axis=1)
        return on.mean(axis=1), np.asarray(clear)


@dataclass(frozen=True, eq=False)
class _Ground:
    """A surface as its plane and the outline seen from above."""

    surface: Surface
    normal: FloatArray
    low: FloatArray
    high: FloatArray
    walls: tuple[FloatArray, FloatArray] | None

    @classmethod
    def of(cls, surface: Surface) -> "_Ground":
        outline = surface.polygon[:, :2]
        edges = np.roll(outline, -1, axis=0) - outline
        out = np.stack([edges[:, 1], -edges[:, 0]], axis=-1)
        offsets = np.einsum("ei,ei->e", out, outline)
        reach = 1e-9 * (1.0 + np.abs(outline).max())
        convex = bool((outline @ out.T <= offsets + reach).all()) and not getattr(surface, "holes", ())
        walls = (out, offsets + reach) if convex else None
        return cls(surface, np.array(surface.normal), outline.min(axis=0), outline.max(axis=0), walls)

    def is_near(self, places: FloatArray, room: float) -> bool:
        return bool(
            (places.max(axis=0) >= self.low - room).all() and (places.min(axis=0) <= self.high + room).all()
        )

    def height(self, places: FloatArray) -> FloatArray:
        base, normal = self.surface.polygon[0], self.normal
        return base[2] - (places - base[:2]) @ normal[:2] / normal[2]

    def covers(self, places: FloatArray) -> NDArray[np.bool_]:
        if self.walls is not None:
            out, offsets = self.walls
            return np.asarray((places @ out.T <= offsets).all(axis=1))
        flat = np.column_stack([places, self.height(places)])
        return self.surface.outside(flat) <= 1e-9
