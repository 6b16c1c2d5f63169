"""Shaded pictures of solids with hidden surfaces removed, computed with NumPy alone.

Each pixel shows the nearest triangle on its line of sight (z-buffer, Catmull 1974), lit by the sky and by one
lamp whose shadows come from a z-buffer as seen from the lamp (Williams 1978). Pictures are computed with
:data:`FINER` times the pixels in both directions and averaged.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.numerics.spatial import FloatArray, area_normals, unit
from manikin.reports.solids import DrawnSolid

FINER = 2
"""Computed points of a pixel along each side, of a figure."""
CLEAR = 0.22
"""Opacity of what is seen through."""
HIDING = 0.08
"""Share of a body from which an obstacle before it is seen through."""
TILE = 0.5
"""Distance of the lines on the floor [m]."""
FLOOR = "floor"
_LARGE = 1500
_PAPER = np.array([1.0, 1.0, 1.0])
_GROUND, _LINES = np.array([0.915, 0.925, 0.935]), np.array([0.80, 0.82, 0.845])
_SHADOW_POINTS, _BIAS = 900, 0.015
_SKY, _LAMP = 0.30, 0.42

Window = tuple[float, float, float, float]
"""Left, right, bottom and top of what is shown in the plane of the picture [m]."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A projection of the world on the plane of a picture.

    Attributes:
        axes: (3, 3) rows: unit vectors to the right, upward and towards the eye, in the world.
        target: (3,) point in the middle of the plane [m].
        distance: Of the eye from the target [m]; infinite for parallel rays.
    """

    axes: FloatArray
    target: FloatArray
    distance: float = np.inf

    @staticmethod
    def at(azimuth: float, elevation: float, target: FloatArray, distance: float = np.inf) -> "Camera":
        """A camera whose eye is in a direction from the target: about the vertical, and above level [rad]."""
        c, s, e, z = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
        return Camera(np.array([[-s, c, 0.0], [-c * z, -s * z, e], [c * e, s * e, z]]), target, distance)

    def project(self, points: FloatArray) -> FloatArray:
        """(..., 2) places in the plane of the picture [m] of points (..., 3)."""
        return self.seen(points)[..., :2]

    def seen(self, points: FloatArray) -> FloatArray:
        """(..., 3) places in the picture [m] and how near points (..., 3) are; the latter is linear there."""
        local = (np.asarray(points, dtype=np.float64) - self.target) @ self.axes.T
        if np.isinf(self.distance):
            return local
        depth = np.maximum(self.distance - local[..., 2:], 1e-3 * self.distance)
        return np.concatenate([local[..., :2] * self.distance / depth, 1.0 / depth], axis=-1)

    def world(self, seen: FloatArray) -> FloatArray:
        """(..., 3) points of what :meth:`seen` returned for them."""
        if np.isinf(self.distance):
            return seen @ self.axes + self.target
        depth = 1.0 / seen[..., 2:]
        local = np.concatenate([seen[..., :2] * depth / self.distance, self.distance - depth], axis=-1)
        return local @ self.axes + self.target

    @property
    def towards(self) -> FloatArray:
        """(3,) unit vector from the target towards the eye."""
        return self.axes[2]


@dataclass(frozen=True, eq=False)
class _Triangles:
    """All triangles of some solids.

    Attributes:
        vertices: (n, 3) [m].
        normals: (n, 3) of smooth surfaces, zero elsewhere.
        faces: (m, 3) corners.
        flat: (m, 3) unit normals of the triangles.
        smooth: (m,) whether the normals of the corners are theirs.
        colours: (m, 3) from 0 to 1.
        owners: (m,) numbers of the solids.
    """

    vertices: FloatArray
    normals: FloatArray
    faces: np.ndarray
    flat: FloatArray
    smooth: np.ndarray
    colours: FloatArray
    owners: np.ndarray

    @staticmethod
    def of(solids: Sequence[DrawnSolid]) -> "_Triangles":
        counts = [len(solid.faces) for solid in solids]
        starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
        vertices = np.concatenate([np.zeros((0, 3)), *(solid.vertices for solid in solids)])
        normals = np.concatenate([np.zeros((0, 3)), *(
            np.zeros_like(solid.vertices) if solid.normals is None else solid.normals for solid in solids
        )])  # fmt: skip
        faces = np.concatenate([
            np.zeros((0, 3), dtype=int),
            *(solid.faces + start for solid, start in zip(solids, starts[:-1], strict=True)),
        ])  # fmt: skip
        return _Triangles(
            vertices, normals, faces, unit(area_normals(vertices[faces]), 1e-15),
            np.repeat([solid.normals is not None for solid in solids], counts).astype(bool),
            np.concatenate([np.zeros((0, 3)), *(solid.colours for solid in solids)]),
            np.repeat(np.arange(len(solids)), counts),
        )  # fmt: skip


class _Layer:
    """The nearest triangle at each point of a picture.

    Attributes:
        near: (h, w) how near it is; minus infinity where there is none.
        face: (h, w) its number; -1 where there is none.
    """

    def __init__(self, triangles: _Triangles, camera: Camera, window: Window, scale: float) -> None:
        left, right, bottom, top = window
        self.shape = (max(1, round((top - bottom) * scale)), max(1, round((right - left) * scale)))
        self.near = np.full(self.shape, -np.inf, dtype=np.float32)
        self.face = np.full(self.shape, -1, dtype=np.int32)
        self._triangles, self._camera, self._window, self._scale = triangles, camera, window, scale
        seen = camera.seen(triangles.vertices)
        flat = np.column_stack([(seen[:, 0] - left) * scale, (top - seen[:, 1]) * scale])
        self._draw(flat[triangles.faces], seen[:, 2][triangles.faces])

    def _draw(self, corners: FloatArray, depth: FloatArray) -> None:
        height, width = self.shape
        (ax, ay), (bx, by), (cx, cy) = corners.transpose(1, 2, 0)
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        # The picture's y runs downward: what faces the eye is clockwise. Closed surfaces hide their back.
        shown = (np.abs(area) > 1e-9) & ((area < 0.0) | ~self._triangles.smooth)
        first = np.ceil(corners.min(axis=1) - 0.5).clip(0, 2**30).astype(np.int32)
        last = np.floor(corners.max(axis=1) - 0.5).clip(-1, [width - 1, height - 1]).astype(np.int32)
        sides = np.maximum(last - first + 1, 0)
        kept = np.flatnonzero(shown & (sides[:, 0] > 0) & (sides[:, 1] > 0))
        self._row = np.full(len(corners), -1)
        self._row[kept] = np.arange(len(kept))
        (ax, ay), (bx, by), (cx, cy) = corners[kept].transpose(1, 2, 0)
        area, depth, first, sides = area[kept], depth[kept], first[kept], sides[kept]
        # Shares of the second and third corner are linear in x and y from the first corner's pixel.
        slopes = np.stack([cy - ay, ax - cx, ay - by, bx - ax], axis=1) / area[:, None]
        self._planes = np.column_stack([ax - 0.5, ay - 0.5, slopes]).astype(np.float32)
        # Of coplanar faces of two solids always the same one is in front.
        metre = 1.0 if np.isinf(self._camera.distance) else self._camera.distance**-2
        lean = 2e-5 * metre * self._triangles.owners[kept]
        self._depths = np.column_stack(
            [depth[:, 0] + lean, depth[:, 1] - depth[:, 0], depth[:, 2] - depth[:, 0]]
        ).astype(np.float32)
        counts = sides.prod(axis=1)
        self._draw_small(np.flatnonzero(counts <= _LARGE), kept, first, sides)
        for number in np.flatnonzero(counts > _LARGE).tolist():
            (x, y), (w, h) = first[number], sides[number]
            columns, rows = np.arange(x, x + w)[None, :], np.arange(y, y + h)[:, None]
            second, third = self._shares(number, columns, rows)
            start, ahead, aside = self._depths[number]
            near = (start + ahead * second) + aside * third
            block = np.s_[y : y + h, x : x + w]
            better = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0) & (near > self.near[block])
            np.copyto(self.near[block], near, where=better)
            self.face[block][better] = kept[number]

    def _draw_small(
        self, numbers: np.ndarray, kept: np.ndarray, first: np.ndarray, sides: np.ndarray
    ) -> None:
        counts = sides[numbers].prod(axis=1)
        face = np.repeat(numbers, counts)
        place = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
        y, x = np.divmod(place, sides[face, 0])
        x, y = x + first[face, 0], y + first[face, 1]
        second, third = self._shares(face, x, y)
        inside = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0)
        face, pixel = face[inside], (y * self.shape[1] + x)[inside]
        start, ahead, aside = self._depths[face].T
        near = start + ahead * second[inside] + aside * third[inside]
        flat, flat_face = self.near.reshape(-1), self.face.reshape(-1)
        before = flat[pixel]
        np.maximum.at(flat, pixel, near)
        best = (near == flat[pixel]) & (near > before)
        flat_face[pixel[best]] = kept[face[best]]

    def _shares(self, row: np.ndarray | int, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Barycentric coordinates in drawn triangles: shares of the second and the third corner."""
        x0, y0, bx, by, cx, cy = np.moveaxis(self._planes[row], -1, 0)
        u, v = (x - x0).astype(np.float32), (y - y0).astype(np.float32)
        return bx * u + by * v, cx * u + cy * v

    def normals(self, rows: np.ndarray, columns: np.ndarray) -> FloatArray:
        """(n, 3) unit normals towards the eye at points of the picture that show a triangle."""
        face, triangles = self.face[rows, columns], self._triangles
        normals = triangles.flat[face]
        normals[normals @ self._camera.towards < 0.0] *= -1.0
        smooth = np.flatnonzero(triangles.smooth[face])
        face = face[smooth]
        second, third = self._shares(self._row[face], columns[smooth], rows[smooth])
        shares = np.stack([1.0 - second - third, second, third], axis=-1)
        curved = np.einsum("nk,nki->ni", shares, triangles.normals[triangles.faces[face]])
        normals[smooth] = unit(curved)
        return normals

    def world(self, rows: np.ndarray, columns: np.ndarray) -> FloatArray:
        """(n, 3) points in the world at points of the picture."""
        left, _, _, top = self._window
        x, y = left + (columns + 0.5) / self._scale, top - (rows + 0.5) / self._scale
        return self._camera.world(np.column_stack([x, y, self.near[rows, columns].astype(np.float64)]))

    @property
    def owners(self) -> np.ndarray:
        """(h, w) numbers of the solids shown; -1 where there is none."""
        return np.append(self._triangles.owners, -1)[self.face]


class _Shadows:
    """What the lamp does not reach."""

    def __init__(self, triangles: _Triangles, camera: Camera, points: float) -> None:
        places = triangles.vertices
        azimuth = float(np.arctan2(camera.towards[1], camera.towards[0])) - 0.75
        self.lamp = Camera.at(azimuth, 0.95, places.mean(axis=0) if len(places) else np.zeros(3))
        self._layer = None
        if len(places):
            seen = self.lamp.project(places)
            (left, bottom), (right, top) = seen.min(axis=0) - 0.02, seen.max(axis=0) + 0.02
            self._scale = min(points, _SHADOW_POINTS) / max(right - left, top - bottom)
            self._corner = left, top
            self._layer = _Layer(triangles, self.lamp, (left, right, bottom, top), self._scale)

    def lit(self, points: FloatArray) -> FloatArray:
        """(n,) 1 where the lamp reaches points (n, 3), 0 where it does not."""
        if self._layer is None:
            return np.ones(len(points))
        seen, (height, width) = self.lamp.seen(points), self._layer.shape
        column = ((seen[:, 0] - self._corner[0]) * self._scale).astype(int)
        row = ((self._corner[1] - seen[:, 1]) * self._scale).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        before = self._layer.near[row.clip(0, height - 1), column.clip(0, width - 1)]
        return 1.0 - (inside & (before > seen[:, 2] + _BIAS))


def nearness(solids: Sequence[DrawnSolid], camera: Camera, window: Window, scale: float) -> np.ndarray:
    """(h, w) how near the nearest of solids is, with so many points in a metre; minus infinity for none."""
    return _Layer(_Triangles.of(solids), camera, window, scale).near


def hiding(
    bodies: Sequence[DrawnSolid],
    obstacles: Sequence[DrawnSolid],
    camera: Camera,
    window: Window,
    points: int = 160,
) -> set[str]:
    """Names of the obstacles before more than :data:`HIDING` of one of the bodies.

    Args:
        points: Of the picture that is tried, along its longer side.
    """
    left, right, bottom, top = window
    scale = points / max(right - left, top - bottom)
    persons = [nearness([body], camera, window, scale) for body in bodies]
    farthest = min((float(camera.seen(body.vertices)[:, 2].min()) for body in bodies), default=np.inf)
    result = set()
    for obstacle in obstacles:
        if camera.seen(obstacle.vertices)[:, 2].max() < farthest:
            continue
        near = nearness([obstacle], camera, window, scale)
        for person in persons:
            there = person > -np.inf
            if np.count_nonzero(there & (near > person)) > HIDING * max(np.count_nonzero(there), 1):
                result.add(obstacle.name)
    return result


def picture(
    solids: Sequence[DrawnSolid], camera: Camera, window: Window, pixels: float, *,
    clear: Collection[str] = (), floor: float | None = None, shadows: bool = True, finer: int | None = None,
) -> np.ndarray:  # fmt: skip
    """(h, w, 3) picture, 8 bits a colour, of solids on white.

    Args:
        solids: What is shown.
        camera: How it is projected.
        window: What of its plane is shown.
        pixels: In a metre of that plane.
        clear: Names of solids that are seen through, and cast no shadow.
        floor: Height of the floor [m]; None for none.
        shadows: Whether the lamp casts shadows.
        finer: Computed points of a pixel along each side; :data:`FINER` if it is left out.
    """
    finer = FINER if finer is None else finer
    scale = finer * pixels
    opaque = [solid for solid in solids if solid.name not in clear]
    casting = _Triangles.of(opaque) if shadows else _Triangles.of([])
    left, right, bottom, top = window
    lamp = _Shadows(casting, camera, 1.2 * scale * max(right - left, top - bottom))
    middle, reach = _extent(solids)
    shown = [*opaque, *([] if floor is None else [_ground(middle, reach, floor)])]
    image, near = _shaded(shown, camera, window, scale, lamp, middle, reach, finer)
    glass = [solid for solid in solids if solid.name in clear]
    if glass:
        triangles = _Triangles.of(glass)
        layer = _Layer(triangles, camera, window, scale)
        layer.face[layer.near <= near] = -1
        rows, columns = np.nonzero(layer.face >= 0)
        tint = _lit_colours(layer, triangles, rows, columns, lamp, None)
        image[rows, columns] += CLEAR * (tint - image[rows, columns])
        _draw_edges(image, layer, triangles, 0.55)
    height, width = (side // finer * finer for side in image.shape[:2])
    blocks = image[:height, :width].reshape(height // finer, finer, width // finer, finer, 3)
    return np.round(255.0 * blocks.mean(axis=(1, 3)).clip(0.0, 1.0)).astype(np.uint8)


def _extent(solids: Sequence[DrawnSolid]) -> tuple[FloatArray, float]:
    """Middle (3,) of solids and how far they reach from there [m]."""
    if not solids:
        return np.zeros(3), 1.0
    low = np.min([solid.vertices.min(axis=0) for solid in solids], axis=0)
    high = np.max([solid.vertices.max(axis=0) for solid in solids], axis=0)
    return (low + high) / 2.0, float(np.linalg.norm(high[:2] - low[:2])) / 2.0


def _ground(middle: FloatArray, reach: float, height: float) -> DrawnSolid:
    side = 2.2 * reach + 1.0
    corners = np.array([[-side, -side, 0.0], [side, -side, 0.0], [side, side, 0.0], [-side, side, 0.0]])
    corners += [middle[0], middle[1], height]
    return DrawnSolid(FLOOR, corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(_GROUND, (2, 1)))


def _shaded(
    solids: Sequence[DrawnSolid], camera: Camera, window: Window, scale: float, lamp: _Shadows,
    middle: FloatArray, reach: float, finer: int,
) -> tuple[FloatArray, np.ndarray]:  # fmt: skip
    triangles = _Triangles.of(solids)
    layer = _Layer(triangles, camera, window, scale)
    image = np.tile(_PAPER, (*layer.shape, 1))
    owners = layer.owners
    ground = len(solids) - 1 if solids and solids[-1].name == FLOOR else -2
    rows, columns = np.nonzero((owners >= 0) & (owners != ground))
    image[rows, columns] = _lit_colours(layer, triangles, rows, columns, lamp, layer.world(rows, columns))
    rows, columns = np.nonzero(owners == ground)
    if len(rows):
        image[rows, columns] = _floor_colours(layer.world(rows, columns), lamp, middle, reach, scale / finer)
    _draw_edges(image, layer, triangles, 0.45, ground)
    return image, layer.near


def _lit_colours(
    layer: _Layer, triangles: _Triangles, rows: np.ndarray, columns: np.ndarray, lamp: _Shadows,
    places: FloatArray | None,
) -> FloatArray:  # fmt: skip
    """(n, 3) colours at points of the picture, with shadows if their places (n, 3) in the world are given."""
    normals = layer.normals(rows, columns)
    direct = np.maximum(normals @ lamp.lamp.towards, 0.0)
    if places is not None:
        facing = np.flatnonzero(direct > 0.0)
        direct[facing] *= lamp.lit(places[facing] + _BIAS * normals[facing])
    bright = 0.46 + _SKY * 0.5 * (1.0 + normals[:, 2]) + _LAMP * direct
    return triangles.colours[layer.face[rows, columns]] * bright[:, None]


def _floor_colours(
    places: FloatArray, lamp: _Shadows, middle: FloatArray, reach: float, pixels: float
) -> FloatArray:
    """Colours of the floor with its lines, a pixel wide, and shadows, which fades into the paper."""
    away = np.abs(places[:, :2] / TILE - np.round(places[:, :2] / TILE)) * TILE
    line = np.clip(1.6 - away.min(axis=1) * pixels, 0.0, 1.0)[:, None]
    colours = _GROUND + line * (_LINES - _GROUND)
    colours *= (0.80 + 0.20 * lamp.lit(places))[:, None]
    far = np.linalg.norm(places[:, :2] - middle[:2], axis=1) / (1.6 * reach + 0.6)
    fade = np.clip(2.0 * (1.0 - far), 0.0, 1.0)[:, None]
    return _PAPER + fade * (colours - _PAPER)


def _draw_edges(
    image: FloatArray, layer: _Layer, triangles: _Triangles, strength: float, ground: int = -2
) -> None:
    """Darken the edges of solids with flat faces, and where one thing ends before another."""
    edge, owners = np.zeros(layer.shape, dtype=bool), np.append(triangles.owners, -1)
    for axis in (0, 1):
        faces = np.moveaxis(layer.face, axis, 0)
        changes = np.nonzero(faces[1:] != faces[:-1])
        first, second = faces[:-1][changes], faces[1:][changes]
        bend = np.einsum("ni,ni->n", triangles.flat[first], triangles.flat[second])
        sharp = ~triangles.smooth[first] & (np.abs(bend) < 0.85)
        drawn = (owners[first] != owners[second]) | sharp
        fading = ((first < 0) & (owners[second] == ground)) | ((second < 0) & (owners[first] == ground))
        drawn &= ~fading
        np.moveaxis(edge, axis, 0)[:-1][tuple(index[drawn] for index in changes)] = True
    image[edge] *= 1.0 - strength
