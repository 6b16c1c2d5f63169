"""Obstacles of a walker: discs and convex polygons on the floor, at rest or on given tracks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, PlanarTransform, finite_number, frozen_array
from manikin.scene import Capsule, Cylinder, HalfSpace, Obstacle, Plane, Scene, Sphere


@dataclass(frozen=True)
class Walker:
    """The walker seen from above: three discs side by side, one in the middle and one under each shoulder.

    Attributes:
        depth: Diameter of the discs [m].
        width: From the left edge to the right edge [m], at least the depth.
    """

    depth: float = 0.3
    width: float = 0.5

    def __post_init__(self) -> None:
        finite_number(self.depth, "walker depth [m]", above=0.0)
        finite_number(self.width, "walker width [m]", at_least=self.depth)

    @property
    def offsets(self) -> tuple[float, ...]:
        """Coordinates of the discs' centres along the body's y [m]."""
        side = (self.width - self.depth) / 2
        return (0.0,) if side == 0.0 else (-side, 0.0, side)

    def centres(self, place: FloatArray) -> FloatArray:
        """(n, k, 2) centres of the discs at (n, 3) places [m]."""
        left = np.column_stack([-np.sin(place[:, 2]), np.cos(place[:, 2])])
        return place[:, None, :2] + np.array(self.offsets)[None, :, None] * left[:, None, :]


@dataclass(frozen=True, eq=False)
class WalkObstacle:
    """A convex polygon grown by a radius; a disc is a single corner with a radius.

    Attributes:
        name: Name in messages.
        corners: (v, 2) counter-clockwise, in the world at rest [m].
        radius: Distance by which it is grown [m].
        times: (k,) instants of its track, increasing [s]; the walk starts at 0.
        displacements: (k, 2) displacements then [m]; uniform motion in between, rest before and after.
    """

    name: str
    corners: FloatArray
    radius: float
    times: FloatArray
    displacements: FloatArray

    def __init__(
        self, name: str, corners: ArrayLike, radius: float = 0.0, *, times: ArrayLike = (0.0,),
        displacements: ArrayLike = ((0.0, 0.0),),
    ) -> None:  # fmt: skip
        where = f"obstacle {name!r}"
        instants = frozen_array(times, f"{where} times [s]", (None,))
        moved = frozen_array(displacements, f"{where} displacements [m]", (len(instants), 2))
        if len(instants) == 0 or np.any(np.diff(instants) <= 0):
            raise InputError(f"{where} times are {instants.tolist()}; valid: at least one, increasing")
        hull = _convex(frozen_array(corners, f"{where} corners [m]", (None, 2)), where)
        size = finite_number(radius, f"{where} radius [m]", at_least=0.0)
        vars(self).update(name=name, corners=hull, radius=size, times=instants, displacements=moved)

    @classmethod
    def disc(cls, name: str, centre: ArrayLike, radius: float) -> Self:
        """A disc at rest about ``centre`` (2,) [m]."""
        finite_number(radius, f"obstacle {name!r} radius [m]", above=0.0)
        return cls(name, frozen_array(centre, f"obstacle {name!r} centre [m]", (2,))[None], radius)

    @classmethod
    def moving_disc(cls, name: str, times: ArrayLike, centres: ArrayLike, radius: float) -> Self:
        """A disc, such as another person, that is at (k, 2) ``centres`` [m] at (k,) ``times`` [s]."""
        path = frozen_array(centres, f"obstacle {name!r} centres [m]", (None, 2))
        finite_number(radius, f"obstacle {name!r} radius [m]", above=0.0)
        if len(path) == 0:
            raise InputError(f"obstacle {name!r} has no centres; valid: at least one")
        return cls(name, path[:1], radius, times=times, displacements=path - path[0])

    def moved(self, transform: PlanarTransform, decimals: int) -> Self:
        """The obstacle in another frame of the floor, its coordinates rounded to some decimals [m].

        Its first corner is that of least x, and of least y among those.
        """
        corners = transform.points(self.corners).round(decimals)
        displacements = transform.directions(self.displacements).round(decimals)
        moved = type(self)(self.name, corners, self.radius, times=self.times, displacements=displacements)
        first = int(np.lexsort(moved.corners.T[::-1])[0])
        object.__setattr__(moved, "corners", frozen_array(np.roll(moved.corners, -first, axis=0), "corners"))
        return moved

    @property
    def moves(self) -> bool:
        """Whether it is ever displaced from where it first was."""
        return bool(np.any(self.displacements != self.displacements[0]))

    @property
    def reach(self) -> float:
        """Radius of a circle about the mean of its corners that holds it [m]."""
        spread = np.linalg.norm(self.corners - self.corners.mean(axis=0), axis=1)
        return float(spread.max()) + self.radius

    def displacement(self, time: ArrayLike) -> FloatArray:
        """(..., 2) displacement at (...) times [m]."""
        t = np.asarray(time, dtype=np.float64)
        return np.stack([np.interp(t, self.times, self.displacements[:, i]) for i in range(2)], axis=-1)

    def distance(self, points: FloatArray, time: FloatArray) -> FloatArray:
        """(n, k) signed distances of points (n, k, 2) at (n,) times [s], negative inside [m]."""
        p = points - self.displacement(time)[:, None, :]
        squares, inside = [], []
        for start, edge, normal in zip(self.corners, *self._edges, strict=True):
            offset = p - start
            along = np.clip(offset @ edge / max(float(edge @ edge), 1e-300), 0.0, 1.0)
            squares.append(np.sum((offset - along[..., None] * edge) ** 2, axis=-1))
            inside.append(offset @ normal)
        outside, depth = np.sqrt(np.min(squares, axis=0)), np.max(inside, axis=0)
        enclosed = (depth < 0.0) & (len(self.corners) > 1)
        return np.where(enclosed, depth, outside) - self.radius

    @property
    def _edges(self) -> tuple[FloatArray, FloatArray]:
        """(v, 2) edges [m] and their outward unit normals."""
        edges = np.roll(self.corners, -1, axis=0) - self.corners
        lengths = np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-300)
        return edges, np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths


def clearance(
    obstacles: Sequence[WalkObstacle], walker: Walker, place: FloatArray, time: FloatArray
) -> FloatArray:
    """(n, m) distance of the walker at (n, 3) places and (n,) times to each obstacle [m]."""
    centres = walker.centres(place)
    if not obstacles:
        return np.zeros((len(place), 0))
    return np.column_stack([
        item.distance(centres, time).min(axis=1) - walker.depth / 2 for item in obstacles
    ])  # fmt: skip


def _convex(corners: FloatArray, where: str) -> FloatArray:
    """The corners of the convex hull, counter-clockwise."""
    if len(corners) == 1:
        return corners
    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError):
        message = f"{where} has {len(corners)} corners without area; valid: one, or a polygon"
        raise InputError(message) from None
    return frozen_array(corners[hull.vertices], where)


STEPPED_ON = 0.02
"""Height above the floor up to which obstacles are stepped over [m]."""

CORNERS = 12
"""Most corners of an outline; rounder ones are enclosed in one of so many, since every corner costs time."""


def floor_plan(scene: Scene, height: float) -> tuple[WalkObstacle, ...]:
    """Discs and convex polygons that a body of a height [m] has to walk around, on a level floor.

    Each is the convex hull of an obstacle seen from above, even where only a part of the obstacle is in the
    way. What hangs above the head and what lies flat on the floor are left out. Raises as
    :func:`in_the_way`.
    """
    return tuple(_outline(item) for item in in_the_way(scene, height))


def in_the_way(scene: Scene, height: float) -> tuple[Obstacle, ...]:
    """Obstacles that a body of a height [m] has to walk around, on a level floor.

    Raises:
        InputError: If the scene has no floor, or an endless obstacle other than a level one below it.
    """
    if scene.floor_height is None:
        raise InputError("scene has no floor; valid: floor_height_m, to walk on")
    low, high = scene.floor_height + STEPPED_ON, scene.floor_height + height
    return tuple(
        item
        for item in scene
        if not _is_floor(item, low) and item.bounds[1][2] > low and item.bounds[0][2] < high
    )


def _is_floor(obstacle: Obstacle, low: float) -> bool:
    """Whether it is an endless level surface below the walker."""
    if not isinstance(obstacle.shape, Plane | HalfSpace):
        return False
    normal, offset = obstacle.world_plane
    if normal[2] > 1.0 - 1e-9 and offset <= low:
        return True
    raise InputError(
        f"obstacle {obstacle.name!r} is endless and no floor; valid for a walk: boxes, round bodies, meshes"
    )


def _outline(obstacle: Obstacle) -> WalkObstacle:
    name, shape = obstacle.name, obstacle.shape
    upright = abs(obstacle.rotation[2, 2]) > 1.0 - 1e-9
    if isinstance(shape, Sphere) or (isinstance(shape, Cylinder | Capsule) and upright):
        return WalkObstacle.disc(name, obstacle.translation[:2], shape.radius)
    points = np.asarray(obstacle.to_trimesh().vertices)[:, :2]
    outline = WalkObstacle(name, np.unique(np.round(points, 9), axis=0))
    return outline if len(outline.corners) <= CORNERS else WalkObstacle(name, _around(outline.corners))


def _around(corners: FloatArray) -> FloatArray:
    """(:data:`CORNERS`, 2) where neighbouring tangents of a polygon meet, those in even directions.

    One of them is along the longest chord, so that long outlines stay narrow.
    """
    chords = (corners[:, None] - corners).reshape(-1, 2)
    longest = chords[np.hypot(*chords.T).argmax()]
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False) + np.arctan2(longest[1], longest[0])
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    offset = (corners @ normal.T).max(axis=0)
    pairs = np.stack([normal, np.roll(normal, -1, axis=0)], axis=1)
    return np.linalg.solve(pairs, np.stack([offset, np.roll(offset, -1)], axis=1)[..., None])[..., 0]
