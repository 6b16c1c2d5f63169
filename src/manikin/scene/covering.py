"""Spheres that together contain a shape ([Qiu2012]_ 6.2.2, automatic sampling)."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import trimesh

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.scene.mesh import Mesh, MeshPiece
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Plane, Shape, Sphere


@dataclass(frozen=True, eq=False)
class SphereCover:
    """Spheres in the frame of the shape they contain ([Qiu2012]_ eq. 6.3).

    They have centres (k, 3) and radii (k,) [m]; ``overshoot`` bounds how far they reach beyond the shape [m].
    """

    centres: FloatArray
    radii: FloatArray
    overshoot: float

    def __len__(self) -> int:
        return len(self.radii)


def cover(shape: Shape, *, count: int = 8) -> SphereCover:
    """Cover a shape, or the surface of a mesh that is not closed, with at most so many spheres.

    SceneError if the shape is endless, as planes and half-spaces are, or the count no positive integer.
    """
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise SceneError(f"cover count is {count!r}; valid: a whole number >= 1")
    if isinstance(shape, (Plane, HalfSpace)):
        raise SceneError(f"a {type(shape).__name__} cannot be covered by spheres; valid: a shape with an end")
    if isinstance(shape, Sphere):
        return _made(np.zeros((1, 3)), np.array([shape.radius]), 0.0)
    if isinstance(shape, Capsule):
        return _capsule_cover(shape, count)
    if isinstance(shape, Box):
        return _box_cover(shape, count)
    return _cylinder_cover(shape, count) if isinstance(shape, Cylinder) else _mesh_cover(shape, count)


def _made(centres: FloatArray, radii: FloatArray, overshoot: float) -> SphereCover:
    return SphereCover(frozen_array(centres, "centres"), frozen_array(radii, "radii"), overshoot)


def _capsule_cover(capsule: Capsule, count: int) -> SphereCover:
    """Equal spheres along the axis, the outer two at its ends: R^2 = r^2 + (spacing/2)^2."""
    if count == 1:
        reach = capsule.radius + capsule.length / 2
        return _made(np.zeros((1, 3)), np.array([reach]), reach - capsule.radius)
    heights = np.linspace(-0.5, 0.5, count) * capsule.length
    radius = float(np.hypot(capsule.radius, (heights[1] - heights[0]) / 2))
    centres = np.column_stack([np.zeros(count), np.zeros(count), heights])
    return _made(centres, np.full(count, radius), radius - capsule.radius)


def _box_cover(box: Box, count: int) -> SphereCover:
    """Equal cells, one circumscribed sphere each, divided where it shrinks the spheres most."""
    cells = _divisions(box.size, count)
    centres = [_cell_centres(size, n) for size, n in zip(box.size, cells, strict=True)]
    grid = np.array(list(product(*centres)), dtype=np.float64)
    side = box.size / cells
    radius = float(np.linalg.norm(side) / 2)
    return _made(grid, np.full(len(grid), radius), radius - float(side.min()) / 2)


def _divisions(size: FloatArray, count: int) -> np.ndarray:
    """Numbers of cells along each axis, product at most ``count``, with the smallest diagonal."""
    best, shortest = np.ones(3, dtype=np.int64), float(np.linalg.norm(size))
    for first in range(1, count + 1):
        for second in range(1, count // first + 1):
            cells = np.array([first, second, count // (first * second)])
            diagonal = float(np.linalg.norm(size / cells))
            if diagonal < shortest - 1e-12:
                best, shortest = cells, diagonal
    return best


def _cell_centres(size: float, number: int) -> FloatArray:
    return ((np.arange(number) + 0.5) / number - 0.5) * size


def _cylinder_cover(cylinder: Cylinder, count: int) -> SphereCover:
    """The better of slabs along the axis and the cells of the box around it that touch it."""
    slab = cylinder.length / count
    radius = float(np.hypot(cylinder.radius, slab / 2))
    centres = np.column_stack([np.zeros((count, 2)), _cell_centres(cylinder.length, count)])
    best = _made(centres, np.full(count, radius), radius - min(cylinder.radius, slab / 2))
    around = Box((2 * cylinder.radius, 2 * cylinder.radius, cylinder.length))
    for number in range(count, 2 * count + 1):  # culled corner cells make room for finer cells
        cells = _box_cover(around, number)
        divisions = _divisions(around.size, number)
        half = around.size[:2] / divisions[:2] / 2
        nearest = np.maximum(np.abs(cells.centres[:, :2]) - half, 0.0)
        touching = np.hypot(nearest[:, 0], nearest[:, 1]) <= cylinder.radius
        if touching.sum() <= count and cells.radii[0] < best.radii[0]:
            best = _made(cells.centres[touching], cells.radii[touching], float(cells.radii[0]))
    return best


def _mesh_cover(mesh: Mesh, count: int) -> SphereCover:
    """Clusters of small triangles (and of inner cells where closed), one sphere around each."""
    items = np.concatenate([_items(piece, mesh, count) for piece in mesh.pieces])
    centroids = items.mean(axis=1)
    seeds = _farthest_points(centroids, min(count, len(items)))
    label = _nearest_seed(centroids, seeds)
    balls = [_ball(items[label == number]) for number in range(len(seeds))]
    for _ in range(8):  # Lloyd's iteration settles well before this
        moved = _nearest_seed(centroids, np.array([centre for centre, _ in balls]))
        if np.array_equal(moved, label) or len(np.unique(moved)) < len(seeds):
            break
        label = moved
        balls = [_ball(items[label == number]) for number in range(len(seeds))]
    radii = np.array([radius for _, radius in balls])
    return _made(np.array([centre for centre, _ in balls]), radii, float(2 * radii.max()))


def _items(piece: MeshPiece, mesh: Mesh, count: int) -> FloatArray:
    """(m, 8, 3) corners of convex items that together make up the piece."""
    grain = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) / (4.0 * np.cbrt(count) + 8.0)
    vertices, faces = trimesh.remesh.subdivide_to_size(piece.vertices, piece.faces, grain)[:2]
    corners = vertices[faces][:, [0, 1, 2, 0, 1, 2, 0, 1]]
    return np.concatenate([corners, _inner_cells(piece, grain)]) if piece.closed else corners


def _inner_cells(piece: MeshPiece, grain: float) -> FloatArray:
    """(m, 8, 3) grid cells that may meet the inside: their centre is inside or near the surface."""
    low, high = piece.vertices.min(axis=0), piece.vertices.max(axis=0)
    number = np.maximum(np.ceil((high - low) / grain).astype(int), 1)
    side = (high - low) / number
    axes = [low[i] + (np.arange(number[i]) + 0.5) * side[i] for i in range(3)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = winding_inside(piece.vertices[piece.faces], centres)
    # A cell whose centre is outside can still hold solid, within half a diagonal of the
    # surface; such solid is in the convex hull of no item, so cells keep a margin.
    near = _near_surface(piece, centres, float(np.linalg.norm(side)) / 2)
    signs = np.array(list(product((-0.5, 0.5), repeat=3)))
    kept = centres[inside | near]
    return np.clip(kept[:, None] + signs * side, low, high)


def winding_inside(corners: FloatArray, points: FloatArray) -> np.ndarray:
    """(k,) whether points are inside the closed surface of (m, 3, 3) triangles, by solid angles.

    The sum of the signed solid angles is 4 pi inside and 0 outside a watertight surface.
    """
    chunk = max(1, 200_000 // len(corners))
    parts = [_winding(corners, points[start : start + chunk]) for start in range(0, len(points), chunk)]
    return np.concatenate([np.zeros(0, dtype=bool), *parts])


def _winding(corners: FloatArray, points: FloatArray) -> np.ndarray:
    a, b, c = (corners[None, :, i] - points[:, None] for i in range(3))
    la, lb, lc = (np.linalg.norm(edge, axis=2) for edge in (a, b, c))
    volume = np.einsum("kmi,kmi->km", a, np.cross(b, c))
    spread = (
        la * lb * lc
        + np.einsum("kmi,kmi->km", a, b) * lc
        + np.einsum("kmi,kmi->km", b, c) * la
        + np.einsum("kmi,kmi->km", c, a) * lb
    )
    return np.abs(np.arctan2(volume, spread).sum(axis=1)) > np.pi


def _near_surface(piece: MeshPiece, points: FloatArray, reach: float) -> np.ndarray:
    near = np.zeros(len(points), dtype=bool)
    for triangle in piece.vertices[piece.faces]:
        low, high = triangle.min(axis=0) - reach, triangle.max(axis=0) + reach
        candidates = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1) & ~near)
        if len(candidates):
            copies = np.broadcast_to(triangle, (len(candidates), 3, 3))
            closest = trimesh.triangles.closest_point(copies, points[candidates])
            gap = np.linalg.norm(closest - points[candidates], axis=1)
            near[candidates[gap <= reach]] = True
    return near


def _farthest_points(points: FloatArray, number: int) -> FloatArray:
    """Start at the point farthest from the middle, then always the one farthest from the chosen."""
    gap = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = [int(np.argmax(gap))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < number:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def _nearest_seed(points: FloatArray, seeds: FloatArray) -> np.ndarray:
    return np.argmin(np.sum(seeds**2, axis=1) - 2.0 * points @ seeds.T, axis=1)


def _ball(items: FloatArray) -> tuple[FloatArray, float]:
    """A nearly smallest ball around the corners (Badoiu and Clarkson's iteration)."""
    corners = items.reshape(-1, 3)
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    for step in range(1, 40):
        farthest = corners[np.argmax(np.sum((corners - centre) ** 2, axis=1))]
        centre = centre + (farthest - centre) / (step + 1)
    return centre, float(np.linalg.norm(corners - centre, axis=1).max())
