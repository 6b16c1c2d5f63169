"""Closed, smooth surface of a human, skinned to its segments.

The implicit surface of :mod:`manikin.body.flesh` is made triangles by dual contouring of its sign on a grid
(surface nets, Gibson 1998), one half of the body, then each vertex is moved onto the surface by Newton steps;
the other half is its mirror image. The grid is drawn apart around head and hands, which have finer forms. A
vertex follows the segments near it with weights that sum to one (linear blend skinning).
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pinocchio as pin

from manikin.body.flesh import FAR, MATERIALS, Flesh, Material, body_density
from manikin.body.model import BodyModel
from manikin.numerics.spatial import FloatArray, unit

SEGMENTS = frozenset((
    "pelvis", "lumbar", "thorax", "neck", "head",
    *(f"{side}_{part}" for side in ("left", "right")
      for part in ("upper_arm", "forearm", "hand", "thigh", "leg", "foot", "toes")),
))  # fmt: skip
"""Segments of a body that has this surface."""
SPACING = 0.0115
"""Edge of the grid's cells at a stature of 1.75 m [m]."""
_COARSE = 3
_SOFTNESS = 0.010
_HEAD_ZOOM, _HAND_ZOOM = 1.6, 2.6


@dataclass(frozen=True, eq=False, repr=False)
class Skin:
    """Triangles around a body and how they follow its segments.

    Attributes:
        vertices: (n, 3) in the root's frame, in the posture of the surface [m].
        normals: (n, 3) outward unit normals there.
        faces: (m, 3) vertices of the triangles, counter-clockwise from outside.
        materials: (m,) number of each triangle's material in :data:`manikin.body.flesh.MATERIALS`.
        bones: (n, 4) numbers of the segments that a vertex follows.
        weights: (n, 4) their weights, which sum to one.
        segments: Names of the segments.
        rotations: (s, 3, 3) of the segments' frames in the posture of the surface.
        origins: (s, 3) of them [m].
    """

    vertices: FloatArray
    normals: FloatArray
    faces: np.ndarray
    materials: np.ndarray
    bones: np.ndarray
    weights: FloatArray
    segments: tuple[str, ...]
    rotations: FloatArray
    origins: FloatArray

    def __post_init__(self) -> None:
        for name in ("vertices", "normals", "faces", "materials", "bones", "weights", "rotations", "origins"):
            getattr(self, name).setflags(write=False)

    @property
    def volume(self) -> float:
        """Enclosed volume in the posture of the surface [m^3]."""
        return _volume(self.vertices, self.faces)

    def faces_of(self, material: Material) -> np.ndarray:
        """(k, 3) triangles of one material."""
        return self.faces[self.materials == MATERIALS.index(material)]

    @lru_cache(maxsize=4)  # noqa: B019  # skins are few, and kept anyway
    def coarser(self, cell: float) -> "Skin":
        """The same surface with one vertex for all in a cube that follow the same segment most.

        Args:
            cell: Edge of the cubes [m].
        """
        keys = np.column_stack([np.floor(self.vertices / cell).astype(int), self.bones[:, 0]])
        _, kept, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        faces = merged.reshape(-1)[self.faces]
        whole = np.all(faces != np.roll(faces, 1, axis=1), axis=1)
        return replace(
            self, vertices=self.vertices[kept], normals=self.normals[kept], faces=faces[whole],
            materials=self.materials[whole], bones=self.bones[kept], weights=self.weights[kept],
        )  # fmt: skip

    def posed(self, rotations: FloatArray, origins: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vertices (n, 3) [m] and unit normals (n, 3) with the segments' frames at other places in the world.

        Args:
            rotations: (s, 3, 3) segment to world.
            origins: (s, 3) of the segments' frames [m].
        """
        turns = rotations @ self.rotations.transpose(0, 2, 1)
        shifts = origins - np.einsum("sij,sj->si", turns, self.origins)
        blend = np.einsum("nk,nkij->nij", self.weights, turns[self.bones])
        places = np.einsum("nij,nj->ni", blend, self.vertices)
        places += np.einsum("nk,nki->ni", self.weights, shifts[self.bones])
        normals = np.einsum("nij,nj->ni", blend, self.normals)
        return places, unit(normals)


def has_skin(body: BodyModel) -> bool:
    """Whether a body is one of whose surface this module knows the sections."""
    return (
        body.stature is not None
        and {segment.name for segment in body.segments} == SEGMENTS
        and {"left_foot", "right_foot", "head"} <= set(body.effectors)
        and bool(body.segment("left_hand").shapes)
        and len(body.segment("left_hand").shapes[0].size) == 3
    )


def skin_of(body: BodyModel) -> Skin | None:
    """Surface of a human, or None of another body; kept for bodies of the same dimensions."""
    if not has_skin(body):
        return None
    return _built(_Dimensions(body))


def segment_frames(body: BodyModel, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (s, 3, 3) to the world and origins (s, 3) [m] of the segments in a configuration (nq,)."""
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, np.asarray(q, dtype=np.float64))
    places = [data.oMf[body.segment_frame(segment.name)] for segment in body.segments]
    return np.array([place.rotation for place in places]), np.array([place.translation for place in places])


class _Dimensions:
    """A body by what its surface depends on, for the cache."""

    def __init__(self, body: BodyModel) -> None:
        self.body = body
        origins = tuple(float(x) for segment in body.segments for x in segment.origin)
        size = (body.stature, body.own_mass, body.sex, body.sole_length, body.sole_width)
        self._key = (*size, *origins)

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Dimensions) and self._key == other._key


@lru_cache(maxsize=8)
def _built(dimensions: _Dimensions) -> Skin:
    body = dimensions.body
    flesh = _fleshed(body)
    spacing = SPACING * float(body.stature or 1.75) / 1.75
    zoom = _Zoom(flesh, spacing)
    vertices, quads, middle = _half_net(flesh, zoom, spacing)
    vertices, normals = _onto_surface(flesh, vertices, middle, spacing)
    vertices, normals, faces = _both_halves(vertices, normals, quads, middle)
    parts = flesh.distances(vertices, 0.25, parts=True)
    weights = _weights(parts.segments, body)
    table = np.hstack([vertices, normals, weights, parts.materials])
    table, faces, materials = _cut_at_materials(table, faces)
    vertices, normals, weights = table[:, :3], table[:, 3:6], table[:, 6 : 6 + len(flesh.names)]
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    strongest = np.take_along_axis(weights, bones, axis=1)
    frames = [flesh.placements[name] for name in flesh.names]
    return Skin(
        vertices.copy(), normals / np.linalg.norm(normals, axis=1, keepdims=True), faces, materials, bones,
        strongest / strongest.sum(axis=1, keepdims=True), flesh.names,
        np.array([frame.rotation for frame in frames]), np.array([frame.origin for frame in frames]),
    )  # fmt: skip


def _fleshed(body: BodyModel) -> Flesh:
    """Flesh of the thickness that gives the volume of the body's mass, by the secant rule."""
    wanted = body.own_mass / body_density(float(body.stature or 1.75), body.own_mass)

    def excess(thickness: float) -> float:
        return _grid_volume(Flesh(body, thickness), 0.024) / wanted - 1.0

    before, now = 1.0, 1.0 - 0.45 * (first := excess(1.0))
    error_before = first
    for _ in range(4):
        error = excess(now)
        if abs(error) < 2e-3 or error == error_before:
            break
        before, now, error_before = now, now - error * (now - before) / (error - error_before), error
        now = float(np.clip(now, 0.4, 2.5))
    return Flesh(body, now)


def _corners(flesh: Flesh) -> tuple[FloatArray, FloatArray]:
    """Box around the left half of the flesh [m]."""
    lows, highs = [], []
    for loft in flesh.lofts:
        place = flesh.placements[loft.segment]
        centre, radius = loft.ball
        centre = place.origin + place.rotation @ centre
        lows.append(centre - radius)
        highs.append(centre + radius)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    low[1] = 0.0
    return low - 0.02, high + 0.02


def _grid_volume(flesh: Flesh, cell: float) -> float:
    low, high = _corners(flesh)
    low[1] = 0.5 * cell
    points = _grid(low, high, cell)[1]
    distance = flesh.distances(points, 0.03).whole
    return 2.0 * cell**3 * float(np.clip(0.5 - distance / cell, 0.0, 1.0).sum())


def _grid(low: FloatArray, high: FloatArray, cell: float) -> tuple[tuple[int, ...], FloatArray]:
    counts = tuple((np.ceil((high - low) / cell).astype(int) + 1).tolist())
    axes = [low[k] + cell * np.arange(counts[k]) for k in range(3)]
    return counts, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


class _Zoom:
    """Map from the grid to the body that draws head and left hand apart, and is the identity elsewhere."""

    def __init__(self, flesh: Flesh, spacing: float) -> None:
        scale = spacing / SPACING
        hand, head = flesh.placements["left_hand"], flesh.placements["neck"]
        ramp, upward = 0.07 * scale, np.array([0.0, 0.0, 1.0])
        self._zones = (
            (hand.origin + hand.rotation[:, 2] * ramp, -hand.rotation[:, 2], _HAND_ZOOM, ramp, 0.26 * scale),
            (
                head.origin + 0.02 * scale * upward,
                upward,
                _HEAD_ZOOM,
                ramp,
                0.26 * scale,
            ),
        )
        self.reach = np.array([0.10, 0.30, 0.20]) * scale

    def __call__(self, points: FloatArray) -> FloatArray:
        """Places (n, 3) in the body of points of the grid."""
        places = points.copy()
        for start, axis, zoom, ramp, radius in self._zones:
            away = points - start
            along = away @ axis
            aside = away - along[:, None] * axis
            inside = (along > 0.0) & (np.einsum("ij,ij->i", aside, aside) < radius**2)
            u = along[inside]
            drop = (1.0 - 1.0 / zoom) / ramp
            slope = np.maximum(1.0 - drop * u, 1.0 / zoom)
            shift = np.where(u < ramp, u - 0.5 * drop * u**2, ramp - 0.5 * drop * ramp**2 + (u - ramp) / zoom)
            places[inside] = start + shift[:, None] * axis + slope[:, None] * aside[inside]
        return places


def _half_net(flesh: Flesh, zoom: _Zoom, spacing: float) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Vertices (n, 3) of the left half, its quads (m, 4), and which vertices are in the middle."""
    low, high = _corners(flesh)
    low, high = low - zoom.reach * [1, 0, 1], high + zoom.reach
    low[1] = -0.5 * spacing
    coarse = _COARSE * spacing
    counts, points = _grid(low, high, coarse)
    rough = flesh.distances(zoom(points), 0.08).whole.reshape(counts)
    cells = tuple(count - 1 for count in counts)
    # Cells farther from the surface than their diagonal are inside or outside as a whole.
    near = np.minimum.reduce([
        np.abs(rough)[i : i + cells[0], j : j + cells[1], k : k + cells[2]]
        for i in (0, 1) for j in (0, 1) for k in (0, 1)
    ]) < 1.3 * coarse  # fmt: skip
    fine = tuple(_COARSE * count + 1 for count in cells)
    values = np.full(fine, FAR)
    wanted = np.zeros(fine, dtype=bool)
    blocks = np.repeat(np.repeat(np.repeat(near, _COARSE, 0), _COARSE, 1), _COARSE, 2)
    for i in (0, 1):
        for j in (0, 1):
            for k in (0, 1):
                view = wanted[i : i + blocks.shape[0], j : j + blocks.shape[1], k : k + blocks.shape[2]]
                view |= blocks
    inside = np.repeat(np.repeat(np.repeat(rough[:-1, :-1, :-1] < 0, _COARSE, 0), _COARSE, 1), _COARSE, 2)
    values[:-1, :-1, :-1][inside] = -FAR
    chosen = np.argwhere(wanted)
    values[wanted] = flesh.distances(zoom(low + spacing * chosen), 0.05).whole
    vertices, quads, cell_of = _surface_net(_unambiguous(values))
    middle = cell_of[:, 1] == 0
    vertices[middle, 1] = 0.5
    return zoom(low + spacing * vertices), quads, middle


def _unambiguous(values: FloatArray) -> FloatArray:
    """Values with the grid's squares filled whose inside corners are only diagonal neighbours.

    Through such a square two sheets of a surface net would share an edge.
    """
    values = values.copy()
    while True:
        inside, filled = values < 0.0, np.zeros(values.shape, dtype=bool)
        for axis in range(3):
            a, b = (np.moveaxis(array, axis, 0) for array in (inside, filled))
            _, rows, columns = np.array(a.shape) - 1
            corners = [
                (slice(None), slice(i, i + rows), slice(j, j + columns)) for i in (0, 1) for j in (0, 1)
            ]
            square = [a[corner] for corner in corners]
            bad = (square[0] == square[3]) & (square[1] == square[2]) & (square[0] != square[1])
            for corner in corners:
                b[corner] |= bad
        filled &= ~inside
        if not np.any(filled):
            return values
        values[filled] = -1e-4


def _surface_net(values: FloatArray) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Surface net of the zero level of values on a grid, in its indices: vertices, quads, vertices' cells.

    Quads of edges on the grid's face ``y = 0`` belong to the mirrored half and are left out.
    """
    cells = tuple(count - 1 for count in values.shape)
    total, count = np.zeros((*cells, 3)), np.zeros(cells)
    crossings = []
    for axis in range(3):
        ahead = np.moveaxis(values, axis, 0)
        change = np.moveaxis((ahead[:-1] < 0) != (ahead[1:] < 0), 0, axis)
        where = np.argwhere(change)
        end = where.copy()
        end[:, axis] += 1
        first, last = values[tuple(where.T)], values[tuple(end.T)]
        places = where.astype(float)
        places[:, axis] += first / (first - last)
        others = [k for k in range(3) if k != axis]
        for i in (0, 1):
            for j in (0, 1):
                cell = where.copy()
                cell[:, others[0]] -= i
                cell[:, others[1]] -= j
                valid = np.all((cell >= 0) & (cell < cells), axis=1)
                np.add.at(total, tuple(cell[valid].T), places[valid])
                np.add.at(count, tuple(cell[valid].T), 1.0)
        crossings.append((where, first < 0, axis, others))
    active = np.argwhere(count > 0)
    number = np.full(cells, -1)
    number[tuple(active.T)] = np.arange(len(active))
    vertices = total[tuple(active.T)] / count[tuple(active.T)][:, None]
    quads = [_quads(number, *crossing) for crossing in crossings]
    return vertices, np.vstack(quads), active


def _quads(
    number: np.ndarray, where: np.ndarray, outward: np.ndarray, axis: int, others: list[int]
) -> np.ndarray:
    """(m, 4) vertices around the edges that cross the surface, counter-clockwise from outside."""
    kept = np.all((where[:, others] > 0) & (where[:, others] < np.array(number.shape)[others]), axis=1)
    where, outward = where[kept], outward[kept]
    ring = []
    for i, j in ((1, 1), (0, 1), (0, 0), (1, 0)):
        cell = where.copy()
        cell[:, others[0]] -= i
        cell[:, others[1]] -= j
        ring.append(number[tuple(cell.T)])
    quads = np.column_stack(ring)
    # (x, z) with y between them is a left-handed pair.
    flip = outward == (axis == 1)
    quads[flip] = quads[flip][:, ::-1]
    return quads


_TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])


def _onto_surface(
    flesh: Flesh, vertices: FloatArray, middle: np.ndarray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Move vertices onto the surface, and its normals there."""
    step, gradient = 2e-4, np.zeros_like(vertices)
    for last in (False, False, True):
        samples = (vertices[None] + step * _TETRAHEDRON[:, None]).reshape(-1, 3)
        values = flesh.distances(samples, 0.05).whole.reshape(4, -1)
        gradient = 0.25 * np.einsum("kn,ki->ni", values, _TETRAHEDRON) / step
        gradient[middle, 1] = 0.0
        square = np.maximum(np.einsum("ni,ni->n", gradient, gradient), 0.05)
        if not last:
            move = (values.mean(axis=0) / square)[:, None] * gradient
            longest = np.linalg.norm(move, axis=1, keepdims=True)
            vertices = vertices - move * np.minimum(1.0, 0.5 * spacing / np.maximum(longest, 1e-12))
    return vertices, unit(gradient)


def _both_halves(
    vertices: FloatArray, normals: FloatArray, quads: np.ndarray, middle: np.ndarray
) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Add the mirror image; the quads become triangles along their shorter diagonals."""
    straight = np.linalg.norm(vertices[quads[:, 0]] - vertices[quads[:, 2]], axis=1)
    other = np.linalg.norm(vertices[quads[:, 1]] - vertices[quads[:, 3]], axis=1)
    turned = np.where((straight > other)[:, None], np.roll(quads, -1, axis=1), quads)
    half = np.vstack([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    flip, twin = np.array([1.0, -1.0, 1.0]), np.arange(len(vertices))
    twin[~middle] = len(vertices) + np.arange(int((~middle).sum()))
    faces = np.vstack([half, twin[half][:, ::-1]])
    return (
        np.vstack([vertices, vertices[~middle] * flip]), np.vstack([normals, normals[~middle] * flip]), faces
    )  # fmt: skip


def _weights(distances: FloatArray, body: BodyModel) -> FloatArray:
    """(n, s) weights of the segment nearest to each vertex and of its neighbours in the tree."""
    names = [segment.name for segment in body.segments]
    linked = np.eye(len(names), dtype=bool)
    for segment in body.segments:
        if segment.parent is not None:
            pair = names.index(segment.name), names.index(segment.parent)
            linked[pair] = linked[pair[::-1]] = True
    softness = _SOFTNESS * float(body.stature or 1.75) / 1.75
    nearest = np.argmin(distances, axis=1)
    excess = np.maximum(distances - distances.min(axis=1, keepdims=True), 0.0)
    weights = np.exp(-excess / softness) * linked[nearest]
    weights[weights < 0.01] = 0.0
    return weights / weights.sum(axis=1, keepdims=True)


def _cut_at_materials(table: FloatArray, faces: np.ndarray) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Cut triangles where the material changes; columns of the table are cut with them.

    Returns:
        The longer table, the faces, and the number of the material of each face.
    """
    count = len(MATERIALS)
    for number in range(count):
        own = table[:, -count + number]
        others = np.delete(table[:, -count:], number, axis=1).min(axis=1)
        table, faces = _cut(table, faces, own - others)
    middles = table[:, -count:][faces].mean(axis=1)
    return table, faces, np.argmin(middles, axis=1)


def _cut(table: FloatArray, faces: np.ndarray, level: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Cut triangles along the zero level of a value of the vertices."""
    level = np.where(np.abs(level) < 1e-5, 0.0, level)
    sign = np.sign(level)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    keys, inverse = np.unique(edges[:, 0] * len(table) + edges[:, 1], return_inverse=True)
    edges = np.column_stack(np.divmod(keys, len(table)))
    split = sign[edges[:, 0]] * sign[edges[:, 1]] < 0
    new = np.full(len(edges), -1)
    new[split] = len(table) + np.arange(int(split.sum()))
    first, last = edges[split].T
    share = (level[first] / (level[first] - level[last]))[:, None]
    table = np.vstack([table, table[first] + share * (table[last] - table[first])])
    middle = new[inverse.reshape(3, -1).T]
    cuts = (middle >= 0).sum(axis=1)
    result = [faces[cuts == 0]]
    for corner in range(3):  # the corner opposite of the edge that is (not) cut
        order = [(corner + k) % 3 for k in range(3)]
        a, b, c = (faces[:, k] for k in order)
        ab, bc, ca = (middle[:, k] for k in order)
        one = (cuts == 1) & (bc >= 0)
        result += [np.column_stack(each)[one] for each in ((a, b, bc), (a, bc, c))]
        two = (cuts == 2) & (bc < 0)
        result += [np.column_stack(each)[two] for each in ((a, ab, ca), (ab, b, c), (ab, c, ca))]
    return table, np.vstack(result)


def _volume(vertices: FloatArray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
