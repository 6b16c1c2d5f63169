"""Triangle meshes in metres: checked arrays, and reading STL, OBJ, PLY, DAE, GLB and glTF files."""

import re
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray, area_normals, finite_number, frozen_array
from manikin.scene.gltf import read_gltf
from manikin.scene.triangles import IntArray, decimated

Convexity = Literal["no", "hull", "parts"]

FORMATS = ("stl", "obj", "ply", "dae", "glb", "gltf")
_FORMATS_TEXT = ", ".join(f".{name}" for name in FORMATS)
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Units a mesh file may be said to be in, in metres."""

_UP_TO_Z = {
    "x": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}

MAX_FACES = 50_000
"""Meshes with more triangles are decimated, unless they are replaced by convex hulls."""
MAX_FILE_FACES = 2_000_000
"""Files with more triangles are refused before they are loaded."""
MAX_FILE_BYTES = 400_000_000
"""Larger files are refused before they are loaded."""
LARGEST_DEVIATION = 2e-3
"""Farthest that decimation may move the surface of a mesh [m]; motions keep more away from obstacles."""
LARGEST_EXTENT = 1000.0
"""Meshes larger than this [m] are taken for a mistaken unit."""
LARGEST_UNSAID = 25.0
"""So are files larger than this [m] whose unit is not said."""
SMALLEST_EXTENT = 5e-3
"""Meshes smaller than this [m] are taken for a mistaken unit."""
_DEGENERATE_HEIGHT = 1e-9  # [m]; a triangle flatter than this has no usable normal


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in its own frame.

    Coincident vertices are merged and degenerate triangles dropped on construction, so that connected pieces
    and closed surfaces can be recognised.

    Attributes:
        vertices: (n, 3) [m].
        faces: (m, 3) vertex indices, counter-clockwise seen from outside.
        source: Path or name, for messages.
        dropped_faces: Number of degenerate triangles dropped.
    """

    vertices: FloatArray
    faces: IntArray
    source: str
    dropped_faces: int

    def __init__(
        self, vertices: ArrayLike, faces: ArrayLike, source: str = "mesh", *, convex: Convexity = "no",
        max_faces: int = MAX_FACES,
    ) -> None:  # fmt: skip
        """Check and clean a mesh.

        Args:
            convex: ``"hull"`` replaces the mesh by its convex hull, ``"parts"`` each connected piece by its
                own; both are larger than the mesh, hence safe.
            max_faces: More triangles (after hulls) are refused by a SceneError, as is a mesh that is empty,
                not finite, badly indexed or of a suspicious size.
        """
        points = frozen_array(vertices, f"mesh {source!r} vertices", (None, 3), SceneError)
        triangles = _checked_faces(faces, len(points), source)
        points, triangles, dropped = _cleaned(points, triangles)
        if not len(triangles):
            raise SceneError(f"mesh {source!r} has no triangle with an area; valid: at least one")
        extent = float(np.ptp(points, axis=0).max())
        if not SMALLEST_EXTENT <= extent <= LARGEST_EXTENT:
            raise SceneError(
                f"mesh {source!r} extends over {extent:.4g} m, which suggests a mistaken unit; valid: "
                f"{SMALLEST_EXTENT:g} to {LARGEST_EXTENT:g} m, so set unit ({', '.join(UNITS)}) or scale"
            )
        if convex != "no":
            points, triangles = _hulls(points, triangles, convex, source)
        if len(triangles) > max_faces:
            raise SceneError(
                f"mesh {source!r} has {len(triangles)} triangles; valid: at most {max_faces}, so decimate it "
                "or set convex to 'parts' or 'hull'"
            )
        triangles.setflags(write=False)
        object.__setattr__(self, "vertices", frozen_array(points, f"mesh {source!r} vertices"))
        object.__setattr__(self, "faces", triangles)
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "dropped_faces", dropped)

    @cached_property
    def pieces(self) -> "tuple[MeshPiece, ...]":
        """Connected pieces, each with its own vertices."""
        groups = _connected(self.vertices, self.faces)
        return tuple(_piece(self.vertices, self.faces[group]) for group in groups)


@dataclass(frozen=True, eq=False)
class MeshPiece:
    """A connected piece of a mesh, of vertices (n, 3) [m] and their indices in each face (m, 3).

    One that is ``closed`` is watertight and has an inside, with faces outward; so is a ``convex`` one.
    """

    vertices: FloatArray
    faces: IntArray
    closed: bool
    convex: bool


PACKAGE = "package://"
"""How the place of a mesh begins that an installed distribution holds: ``package://NAME/path``."""


def mesh_place(place: str, folder: Path) -> str:
    """Where a mesh is, wherever it is asked from: relative to a folder, or in a distribution."""
    return place if place.startswith(PACKAGE) else str((folder / place).resolve())


def package_file(place: str) -> Path:
    """File of an installed distribution, below its folder ``NAME`` in ``share`` or beside the modules.

    Args:
        place: ``package://NAME/path``, as ROS and URDF files have it.

    Raises:
        SceneError: If the distribution is not installed or has no such file.
    """
    inside = place.removeprefix(PACKAGE)
    name = inside.partition("/")[0]
    try:
        files = metadata.files(name) or []
    except metadata.PackageNotFoundError:
        raise SceneError(
            f"mesh '{place}' is of the package '{name}', which is not installed; "
            f"valid: after pip install {name.replace('_', '-')}"
        ) from None
    for file in files:
        if f"/{file.as_posix()}".endswith(f"/{inside}"):
            return Path(str(file.locate()))
    raise SceneError(f"mesh '{place}' is not in the package '{name}'; valid: a file that it holds")


def load_mesh(
    path: str | Path, *, unit: str | None = None, up: str | None = None, scale: float = 1.0,
    convex: Convexity = "no",
) -> Mesh:  # fmt: skip
    """Read a mesh file of one of :data:`FORMATS`, as its extension says, into metres; SceneError if unusable.

    A file of more than :data:`MAX_FACES` triangles is decimated to so many, unless convex hulls take its
    place (:func:`manikin.scene.triangles.decimated`); its vertices are then :data:`LARGEST_DEVIATION` from
    the surface at most. GLB and glTF files are in metres and y up, which is turned to z up about x; all
    meshes of the scene are one, each where its nodes place it (:mod:`manikin.scene.gltf`).

    Args:
        path: The file, or ``package://NAME/path`` of an installed distribution.
        unit: ``"m"``, ``"cm"``, ``"mm"`` or ``"in"``; when omitted, that of a DAE or glTF file, else metres.
        up: Axis of the file that points up, ``"x"``, ``"y"`` or ``"z"``; the mesh is turned so that it is z.
            When omitted, that of a DAE file, y of a glTF file, else z.
        scale: Further factor on every coordinate, > 0.
        convex: As for :class:`Mesh`.
    """
    file = package_file(str(path)) if str(path).startswith(PACKAGE) else Path(path)
    extension = file.suffix.lower().lstrip(".")
    if extension not in FORMATS:
        raise SceneError(f"mesh file '{file}' has the extension '{file.suffix}'; valid: {_FORMATS_TEXT}")
    if not file.is_file():
        raise SceneError(f"mesh file '{file}' does not exist; valid: an existing {_FORMATS_TEXT} file")
    if unit is not None and unit not in UNITS:
        raise SceneError(f"mesh file '{file}' unit is {unit!r}; valid: {', '.join(UNITS)}")
    if up is not None and up not in _UP_TO_Z:
        raise SceneError(f"mesh file '{file}' up is {up!r}; valid: {', '.join(_UP_TO_Z)}")
    factor = finite_number(scale, f"mesh file '{file}' scale", above=0.0, error=SceneError)
    _check_size(file, extension)
    corners, faces = _read(file, extension)
    own_up, own_metres = _own_axis_and_unit(file, extension)
    metres = (own_metres or 1.0) if unit is None else UNITS[unit]
    vertices = frozen_array(corners, f"mesh file '{file}' vertices", (None, 3), SceneError)
    points = vertices @ _UP_TO_Z[up or own_up].T * (metres * factor)
    extent = float(np.ptp(points, axis=0).max())
    if unit is None and own_metres is None and extent > LARGEST_UNSAID:
        raise SceneError(
            f"mesh file '{file}' extends over {extent:.4g} m if its unit is the metre, and "
            f"{extent / 1e3:.4g} m if it is the millimetre; valid: at most {LARGEST_UNSAID:g} m, or say its "
            f"unit: {', '.join(UNITS)}"
        )
    if convex == "no" and len(faces) > MAX_FACES:
        points, faces = _decimated(points, faces, str(file))
    return Mesh(points, faces, str(file), convex=convex)


def as_trimesh(vertices: FloatArray, faces: IntArray) -> trimesh.Trimesh:
    """Wrap arrays in a trimesh without touching them."""
    return trimesh.Trimesh(vertices=vertices, faces=faces, process=False, validate=False)


def _read(file: Path, extension: str) -> tuple[FloatArray, IntArray]:
    """Vertices and triangles as they are in the file."""
    try:
        if extension in ("glb", "gltf"):
            vertices, faces = read_gltf(file, max_faces=MAX_FILE_FACES, max_bytes=MAX_FILE_BYTES)
        else:
            # As it is in the file: processing would drop vertices that are not finite without a word.
            scene: Any = trimesh.load_scene(str(file), file_type=extension, process=False)
            mesh = scene.to_mesh() if scene.geometry else trimesh.Trimesh()
            vertices, faces = mesh.vertices, mesh.faces
    except SceneError:
        raise
    except Exception as error:  # a reader may raise anything on a broken file
        reason = " ".join(str(error).split())[:120]
        raise SceneError(
            f"mesh file '{file}' cannot be read ({type(error).__name__}: {reason}); "
            f"valid: a well-formed {_FORMATS_TEXT} file"
        ) from None
    if not len(faces):
        raise SceneError(f"mesh file '{file}' holds no triangles; valid: at least one")
    return np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)


def _check_size(file: Path, extension: str) -> None:
    """Refuse a file that is cut off or too large, before it is loaded."""
    size = file.stat().st_size
    if size > MAX_FILE_BYTES:
        raise SceneError(f"mesh file '{file}' has {size} bytes; valid: at most {MAX_FILE_BYTES}")
    content = file.read_bytes()
    count = 0
    if extension == "stl":
        count = _stl_count(content, file)
    elif extension == "obj":
        count = content.count(b"\nf ")
    elif extension == "ply" and (told := re.search(rb"element face (\d{1,18})\s", content[:10_000])):
        count = int(told[1])
    if count > MAX_FILE_FACES:
        problem = f"mesh file '{file}' has {count} triangles"
        raise SceneError(f"{problem}; valid: at most {MAX_FILE_FACES}, so decimate it")


def _stl_count(content: bytes, file: Path) -> int:
    """Number of triangles of an STL file, which must be there to its end."""
    told = int.from_bytes(content[80:84], "little") if len(content) >= 84 else 0
    whole = 84 + 50 * told
    if len(content) == whole:
        return told
    if content[:5].lower() == b"solid" and b"facet" in content[:1000].lower():
        if b"endsolid" not in content[-1000:].lower():
            raise SceneError(f"mesh file '{file}' is cut off, it has no endsolid; valid: the whole file")
        return content.count(b"endfacet")
    if len(content) < whole and told:
        there = (len(content) - 84) // 50
        problem = f"mesh file '{file}' is cut off: {there} of {told} triangles are there"
        raise SceneError(f"{problem}; valid: the whole file")
    return told


def _decimated(points: FloatArray, faces: IntArray, source: str) -> tuple[FloatArray, IntArray]:
    """Vertices and faces of a mesh of :data:`MAX_FACES` triangles at nearly the same place."""
    merged, kept, _ = _cleaned(points, _checked_faces(faces, len(points), source))
    if len(kept) <= MAX_FACES:
        return merged, kept
    fewer, left, deviation = decimated(merged, kept, MAX_FACES)
    if len(left) > MAX_FACES or deviation > LARGEST_DEVIATION:
        raise SceneError(
            f"mesh '{source}' has {len(kept)} triangles, and with {len(left)} its surface is "
            f"{1e3 * deviation:.1f} mm off; valid: at most {1e3 * LARGEST_DEVIATION:g} mm, so cut out what "
            "is needed of it, or set convex to 'parts'"
        )
    return fewer, left


def _own_axis_and_unit(file: Path, extension: str) -> tuple[str, float | None]:
    """Axis of a file that points up and its unit [m], None where it has none."""
    if extension == "dae":
        return _collada_asset(file)
    return ("y", 1.0) if extension in ("glb", "gltf") else ("z", None)


def _collada_asset(file: Path) -> tuple[str, float]:
    """Up axis and unit [m] of a COLLADA file, from its asset element."""
    head = file.read_text(encoding="utf-8", errors="replace")
    unit = re.search(r"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)[\"']", head)
    up = re.search(r"<up_axis>\s*([XYZ])_UP\s*</up_axis>", head)
    try:
        metres = float(unit.group(1)) if unit else 1.0
    except ValueError:
        metres = np.nan
    # COLLADA's own default is y up, but exporters that leave the tag out mean z up in robotics.
    axis = up.group(1).lower() if up else "z"
    return axis, finite_number(metres, f"mesh file '{file}' unit [m]", above=0.0, error=SceneError)


def _checked_faces(faces: ArrayLike, vertex_count: int, source: str) -> IntArray:
    try:
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    except (TypeError, ValueError):
        raise SceneError(f"mesh {source!r} faces are not (m, 3) integers; valid: vertex indices") from None
    if not vertex_count or not len(triangles):
        raise SceneError(f"mesh {source!r} is empty; valid: at least one triangle")
    if triangles.min() < 0 or triangles.max() >= vertex_count:
        problem = f"mesh {source!r} faces name vertex {triangles.max()}"
        raise SceneError(f"{problem}; valid: 0 to {vertex_count - 1}")
    return triangles


def _cleaned(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray, int]:
    """Merge vertices closer than a millionth of the size; drop degenerate and repeated triangles."""
    grid = max(float(np.ptp(points, axis=0).max()) * 1e-6, 1e-12)
    cells = np.round((points - points.min(axis=0)) / grid).astype(np.int64)
    _, first, inverse = np.unique(_keys(cells), return_index=True, return_inverse=True)
    merged = points[first]
    faces = inverse.reshape(-1)[triangles]
    corners = merged[faces]
    edges = corners[:, [1, 2, 0]] - corners
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    good = doubled_area > _DEGENERATE_HEIGHT * np.maximum(longest, 1e-12)
    _, kept = np.unique(_keys(np.sort(faces[good], axis=1)), return_index=True)
    clean = faces[good][np.sort(kept)]
    used, renumbered = np.unique(clean, return_inverse=True)
    return merged[used], renumbered.reshape(-1, 3).astype(np.int64), len(triangles) - len(clean)


def _keys(rows: IntArray) -> IntArray:
    """(n,) numbers in the order of rows (n, 3) of numbers from 0 to two millions."""
    return (rows[:, 0] << 42) | (rows[:, 1] << 21) | rows[:, 2]


def _connected(vertices: FloatArray, faces: IntArray) -> list[IntArray]:
    """Indices of the faces of each connected piece, in the order of their first ones."""
    adjacency = as_trimesh(vertices, faces).face_adjacency
    groups = trimesh.graph.connected_components(adjacency, nodes=np.arange(len(faces)), min_len=1)
    return sorted((np.sort(group) for group in groups), key=lambda group: int(group[0]))


def _hulls(points: FloatArray, triangles: IntArray, convex: str, source: str) -> tuple[FloatArray, IntArray]:
    if convex not in ("hull", "parts"):
        raise SceneError(f"mesh {source!r} convex is {convex!r}; valid: no, hull, parts")
    groups = _connected(points, triangles) if convex == "parts" else [np.arange(len(triangles))]
    vertices, faces, start = [], [], 0
    for group in groups:
        try:
            hull = trimesh.convex.convex_hull(points[np.unique(triangles[group])])
        except Exception:  # Qhull raises its own error on flat input
            problem = f"mesh {source!r} has a flat piece, which has no convex hull"
            raise SceneError(f"{problem}; valid: convex 'no', or a solid") from None
        vertices.append(np.asarray(hull.vertices))
        faces.append(np.asarray(hull.faces, dtype=np.int64) + start)
        start += len(hull.vertices)
    return np.vstack(vertices), np.vstack(faces)


def _piece(vertices: FloatArray, faces: IntArray) -> MeshPiece:
    used, renumbered = np.unique(faces, return_inverse=True)
    local = as_trimesh(vertices[used], renumbered.reshape(-1, 3).astype(np.int64))
    closed = bool(local.is_watertight)
    if closed:
        trimesh.repair.fix_normals(local, multibody=False)
    corners = frozen_array(local.vertices, "vertices")
    triangles = np.array(local.faces, dtype=np.int64)
    triangles.setflags(write=False)
    return MeshPiece(corners, triangles, closed, closed and _is_convex(corners, triangles))


def _is_convex(vertices: FloatArray, faces: IntArray) -> bool:
    """Whether every vertex lies behind every face (to a hundred-thousandth of the size)."""
    corners = vertices[faces]
    normals = area_normals(corners)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("ij,ij->i", normals, corners[:, 0])
    tolerance = 1e-5 * float(np.ptp(vertices, axis=0).max())
    chunk = max(1, 2_000_000 // len(vertices))
    rows = [slice(start, start + chunk) for start in range(0, len(faces), chunk)]
    return all(bool((normals[r] @ vertices.T - offsets[r, None]).max() <= tolerance) for r in rows)
