"""Surfaces of a whole scene: coplanar faces joined to one, what other solids hide cut away.

A face says what one obstacle is like; where a foot can be put is a matter of all of them. Two boxes side by
side, or the ground as a box whose top is at the floor, are one surface, and the floor under a box is none.
Joining and cutting of polygons is that of GEOS (shapely).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Geometry

from manikin.numerics.spatial import FloatArray
from manikin.scene.mesh import Mesh, as_trimesh
from manikin.scene.obstacle import Box, Cylinder, HalfSpace, Obstacle
from manikin.scene.surface import (
    CAP_CORNERS,
    ENDLESS_HALF_SIZE,
    GRID,
    SMALLEST_AREA,
    PlaneFrame,
    Surface,
    faces_of,
)

COPLANAR = 1e-3
"""Largest distance of a face from the plane of the surface it is part of, and from the next part [m]."""
PARALLEL = float(np.cos(np.deg2rad(0.5)))
"""Cosine of the largest angle between the normals of the parts of a surface."""
BELOW = 0.02
"""What is as close below a surface cannot be kept clear of by what lies on it, and is touched with it [m]."""
_ABOVE = 1.05 * COPLANAR  # [m]; what is inside a solid so far above a face is hidden


def merged_surfaces(obstacles: Sequence[Obstacle]) -> tuple[Surface, ...]:
    """Surfaces of a scene, in the order of the obstacles.

    Faces within :data:`COPLANAR` and :data:`PARALLEL` that touch or overlap are one surface, in the plane of
    the largest. Where a box, cylinder, half-space or closed mesh covers a face, the face is cut; balls and
    capsules touch a face in a point or line and cover nothing. A face that is neither joined nor cut is
    given as it is. What lies close below a face, as the floor below a mat, is touched with it.
    """
    faces = [face for item in obstacles for face in faces_of(item)]
    solids = [solid for item in obstacles for solid in _solids(item)]
    bounds = np.array([solid.bounds for solid in solids]).reshape(-1, 2, 3)
    found: list[tuple[int, Surface]] = []
    for group in _coplanar(faces):
        members = [faces[number] for number in group]
        corners = np.concatenate([face.polygon for face in members])
        near = np.all(bounds[:, 0] <= corners.max(axis=0) + _ABOVE, axis=1)
        near &= np.all(bounds[:, 1] >= corners.min(axis=0) - BELOW, axis=1)
        around = [solids[number] for number in np.flatnonzero(near).tolist()]
        for first, surface in _joined(members, around):
            below = _below(surface, [solid for solid in around if solid.name not in surface.obstacles])
            found.append((group[first], replace(surface, obstacles=(*surface.obstacles, *below))))
    return tuple(surface for _, surface in sorted(found, key=lambda item: item[0]))


def _coplanar(faces: Sequence[Surface]) -> Iterator[list[int]]:
    """Numbers of the faces of each plane; each plane is that of its largest face."""
    if not faces:
        return
    normals = np.array([face.normal for face in faces])
    corner = np.array([face.polygon[0] for face in faces])
    left = np.ones(len(faces), dtype=bool)
    for seed in np.argsort([-face.area for face in faces], kind="stable").tolist():
        if not left[seed]:
            continue
        normal, base = normals[seed], faces[seed].polygon[0]
        near = left & (normals @ normal >= PARALLEL) & (np.abs((corner - base) @ normal) <= COPLANAR)
        near[seed] = False
        close = np.flatnonzero(near).tolist()
        own = [n for n in close if np.abs((faces[n].polygon - base) @ normal).max() <= COPLANAR]
        left[[seed, *own]] = False
        yield [seed, *own]


def _joined(members: Sequence[Surface], solids: "Sequence[_Solid]") -> list[tuple[int, Surface]]:
    """Surfaces that coplanar faces make, each with the first of the faces that it is made of."""
    frame = _frame(members)
    flat = np.concatenate([(face.polygon - frame.origin) @ frame.rotation[:, :2] for face in members])
    around = [solid for solid in solids if solid.meets(frame, flat.min(axis=0), flat.max(axis=0))]
    if len(members) == 1 and not around:
        return [(0, members[0])]
    shapes = [frame.flat(face.polygon, face.holes) for face in members]
    hidden = shapely.union_all([solid.slice(frame) for solid in around], grid_size=GRID)
    found: list[tuple[int, Surface]] = []
    for group in _touching(shapes):
        names = tuple(dict.fromkeys(members[number].obstacles[0] for number in sorted(group)))
        whole = shapes[group[0]] if len(group) == 1 else _union([shapes[number] for number in group])
        cut = not hidden.is_empty and whole.intersection(hidden, grid_size=GRID).area >= SMALLEST_AREA
        free = whole.difference(hidden, grid_size=GRID) if cut else whole
        if cut or len(group) > 1:
            parts = frame.surfaces(free, names)
            found += [_of_members(part, frame, members, shapes, group) for part in parts]
        else:
            found.append((group[0], members[group[0]]))
    return found


def _below(surface: Surface, solids: "Sequence[_Solid]") -> tuple[str, ...]:
    """Names of the obstacles that are within :data:`BELOW` below a surface."""
    frame = PlaneFrame.of(surface.normal, surface.polygon)
    sunk = PlaneFrame(frame.origin - (BELOW + _ABOVE) * surface.normal, frame.rotation)
    corners = (surface.polygon - frame.origin) @ frame.rotation[:, :2]
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = [solid for solid in solids if solid.meets(sunk, low, high)]
    if not near:
        return ()
    flat = frame.flat(surface.polygon, surface.holes)
    found = (solid.name for solid in near if solid.slice(sunk).intersection(flat).area >= SMALLEST_AREA)
    return tuple(dict.fromkeys(found))


def _of_members(
    part: Surface, frame: PlaneFrame, members: Sequence[Surface], shapes: Sequence[Geometry],
    group: Sequence[int],
) -> tuple[int, Surface]:  # fmt: skip
    """A polygon with the obstacles whose faces it is made of, and the first of these faces."""
    flat = frame.flat(part.polygon, part.holes)
    own = sorted(number for number in group if flat.intersection(shapes[number]).area > 0.0) or sorted(group)
    names = tuple(dict.fromkeys(members[number].obstacles[0] for number in own))
    return own[0], Surface(names, part.polygon, part.normal, part.holes)


def _frame(members: Sequence[Surface]) -> PlaneFrame:
    """Plane of the first face; its coordinates are those of a face with an end, wherever the origin is."""
    seed = members[0]
    own = next((face for face in members if face.area < ENDLESS_HALF_SIZE**2), seed)
    frame = PlaneFrame.of(seed.normal, own.polygon)
    height = (seed.polygon[0] - frame.origin) @ seed.normal
    return PlaneFrame(frame.origin + height * seed.normal, frame.rotation)


def _touching(shapes: Sequence[shapely.Polygon]) -> list[list[int]]:
    """Numbers of the shapes of each component of those that are at most :data:`COPLANAR` apart."""
    owner = list(range(len(shapes)))
    if len(shapes) > 1:
        tree = shapely.STRtree(shapes)
        pairs: NDArray[np.int64] = tree.query(shapes, predicate="dwithin", distance=COPLANAR)
        for first, second in pairs.T.tolist():
            low, high = sorted((owner[first], owner[second]))
            owner = [low if item == high else item for item in owner]
    return [[n for n, item in enumerate(owner) if item == label] for label in dict.fromkeys(owner)]


def _union(shapes: Sequence[Geometry]) -> Geometry:
    """One shape of several; slits narrower than :data:`COPLANAR` that would part it are closed."""
    union = shapely.union_all(shapes, grid_size=GRID)
    if len(shapely.get_parts(union)) == 1:
        return union
    wider = union.buffer(0.51 * COPLANAR, join_style="mitre")
    return shapely.union_all([union, wider.buffer(-0.51 * COPLANAR, join_style="mitre")], grid_size=GRID)


@dataclass(frozen=True, eq=False)
class _Solid:
    """A closed body that hides what is inside."""

    name: str  # of its obstacle
    vertices: FloatArray  # (n, 3) in the world [m]
    edges: NDArray[np.int64]  # (e, 2) vertex indices of a convex body's edges
    faces: NDArray[np.int64]  # (m, 3) those of the triangles of one that is not convex, otherwise none
    endless: FloatArray | None = None  # (4,) normal and offset of a half-space, which has no vertices

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the box around it in the world [m]."""
        if self.endless is not None:
            return np.full(3, -np.inf), np.full(3, np.inf)
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def meets(self, frame: PlaneFrame, low: FloatArray, high: FloatArray) -> bool:
        """Whether its box in the plane's coordinates meets the plane between two corners (2,) [m]."""
        if self.endless is not None:
            slope = frame.rotation[:, :2].T @ self.endless[:3]
            lowest = float(np.minimum(slope * low, slope * high).sum())
            middle = frame.origin + _ABOVE * frame.rotation[:, 2]
            return float(middle @ self.endless[:3]) + lowest < self.endless[3]
        local = (self.vertices - frame.origin) @ frame.rotation
        least, most = local.min(axis=0), local.max(axis=0)
        level = least[2] < _ABOVE < most[2]
        return bool(level and np.all(least[:2] < high) and np.all(most[:2] > low))

    def slice(self, frame: PlaneFrame) -> Geometry:
        """What of a plane, lifted by a hair, is inside."""
        if self.endless is not None:
            return _half_plane(frame, self.endless)
        local = (self.vertices - frame.origin) @ frame.rotation
        if len(self.faces):
            return _area_inside(local, self.faces)
        return shapely.MultiPoint(_crossings(local, self.edges)).convex_hull


def _solids(obstacle: Obstacle) -> Iterator[_Solid]:
    shape = obstacle.shape
    none = np.zeros((0, 3), dtype=np.int64)
    if isinstance(shape, HalfSpace):
        normal, offset = obstacle.world_plane
        yield _Solid(obstacle.name, np.zeros((0, 3)), none[:, :2], none, np.array([*normal, offset]))
    elif isinstance(shape, (Box, Cylinder)):
        vertices, edges = _prism(shape)
        yield _Solid(obstacle.name, obstacle.to_world(vertices), edges, none)
    elif isinstance(shape, Mesh):
        for piece in shape.pieces:
            if piece.closed:
                vertices = obstacle.to_world(piece.vertices)
                edges = np.asarray(as_trimesh(piece.vertices, piece.faces).edges_unique)
                yield _Solid(obstacle.name, vertices, edges, none if piece.convex else piece.faces)


def _prism(shape: Box | Cylinder) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices and edges of a box, or of the prism inside a cylinder that its caps are drawn with."""
    if isinstance(shape, Box):
        x, y, z = shape.size / 2
        ring = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    else:
        angle, z = np.arange(CAP_CORNERS) * 2 * np.pi / CAP_CORNERS, shape.length / 2
        ring = shape.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    count = len(ring)
    own, after = np.arange(count), np.roll(np.arange(count), -1)
    vertices = np.concatenate([np.column_stack([ring, np.full(count, sign * z)]) for sign in (1.0, -1.0)])
    pairs = ((own, after), (own + count, after + count), (own, own + count))
    return vertices, np.concatenate([np.column_stack(pair) for pair in pairs])


def _crossings(local: FloatArray, edges: NDArray[np.int64]) -> FloatArray:
    """(k, 2) where edges cross the lifted plane, in its coordinates."""
    start, end = local[edges[:, 0]], local[edges[:, 1]]
    crosses = (start[:, 2] > _ABOVE) != (end[:, 2] > _ABOVE)
    start, end = start[crosses], end[crosses]
    share = (_ABOVE - start[:, 2]) / (end[:, 2] - start[:, 2])
    return (start + share[:, None] * (end - start))[:, :2]


def _area_inside(local: FloatArray, faces: NDArray[np.int64]) -> Geometry:
    """What of the lifted plane is inside a closed body of triangles."""
    over = local[:, 2] > _ABOVE
    crossed = faces[over[faces].any(axis=1) & ~over[faces].all(axis=1)]
    if not len(crossed):
        return shapely.Polygon()
    edges = crossed[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = edges[over[edges[:, 0]] != over[edges[:, 1]]]  # two of each triangle
    ends = _crossings(local, np.sort(edges, axis=1)).reshape(-1, 2, 2)
    return shapely.build_area(shapely.union_all(shapely.linestrings(ends), grid_size=GRID))


def _half_plane(frame: PlaneFrame, endless: FloatArray) -> Geometry:
    """What of the lifted plane is inside a half-space."""
    normal, offset = endless[:3], float(endless[3])
    slope = frame.rotation[:, :2].T @ normal
    room = offset - float(normal @ (frame.origin + _ABOVE * frame.rotation[:, 2]))
    steep = float(np.linalg.norm(slope))
    far = 4.0 * ENDLESS_HALF_SIZE
    if steep < 1e-9:
        return shapely.box(-far, -far, far, far) if room > 0.0 else shapely.Polygon()
    inward = -slope / steep
    along = np.array([-inward[1], inward[0]]) * far
    edge = -inward * room / steep
    rear = far * inward
    return shapely.Polygon([edge + along, edge - along, edge - along + rear, edge + along + rear])
