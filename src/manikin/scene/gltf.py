"""Triangles of a glTF 2.0 file, GLB or JSON with buffers beside it, with the transforms of its nodes.

Only geometry is read: pictures, materials and animations are not looked at. Meshes with a skin are people and
animals that move; they are left out. Every count and offset of the file is checked before memory is taken.
"""

import base64
import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray
from manikin.scene.triangles import IntArray

MAX_JSON_BYTES = 50_000_000
"""Largest description that is parsed; buffers are not part of it in a GLB file."""

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_HARMLESS = (
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_mesh_quantization",
)
"""How the names of extensions begin without which the triangles are the same, or that are understood."""
_INSTANCING = "EXT_mesh_gpu_instancing"


def read_gltf(file: Path, *, max_faces: int, max_bytes: int) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) [m], y up as in the file, and triangles (m, 3) of all meshes of the scene.

    Args:
        file: A regular file; buffers beside it have to be in its folder.
        max_faces: Most triangles, each as often as its mesh is placed.
        max_bytes: Of each buffer beside the file.

    Raises:
        SceneError: If the file needs what is not understood or has too much; other exceptions of Python if it
            is no glTF file.
    """
    header, binary = _split(file.read_bytes())
    version = str(header.get("asset", {}).get("version", ""))
    if not version.startswith("2."):
        raise SceneError(f"mesh file '{file}' is of glTF {version[:20] or 'without version'}; valid: 2.0")
    for name in header.get("extensionsRequired", []):
        if not str(name).startswith(_HARMLESS):
            problem = f"mesh file '{file}' needs the extension '{str(name)[:60]}'"
            raise SceneError(f"{problem}; valid: a file without it, as one exported without compression")
    if _INSTANCING in header.get("extensionsUsed", []):
        raise SceneError(
            f"mesh file '{file}' uses the extension '{_INSTANCING}'; valid: a node for each mesh"
        )
    content = _Content(file, header, binary, max_bytes)
    places = _places(file, header)
    often = Counter(mesh for mesh, _ in places)
    count = sum(content.corner_count(mesh) * times for mesh, times in often.items()) // 3
    if count > max_faces:
        problem = f"mesh file '{file}' has {count} triangles or as many vertices"
        raise SceneError(f"{problem}; valid: at most {max_faces}, so decimate it")
    vertices, faces, start = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for mesh, to_world in places:
        mirrored = np.linalg.det(to_world[:3, :3]) < 0.0
        for points, triangles in content.primitives(mesh):
            vertices.append(points @ to_world[:3, :3].T + to_world[:3, 3])
            faces.append((triangles[:, ::-1] if mirrored else triangles) + start)
            start += len(points)
    return np.vstack(vertices), np.vstack(faces)


def _split(content: bytes) -> tuple[dict[str, Any], bytes]:
    """The description and the binary chunk, which is empty in a JSON file."""
    text, binary = content, b""
    if content[:4] == b"glTF":
        if int.from_bytes(content[8:12], "little") > len(content):
            raise ValueError("it is cut off")
        chunks, at = dict[bytes, bytes](), 12
        while at + 8 <= len(content):
            size = int.from_bytes(content[at : at + 4], "little")
            chunks.setdefault(content[at + 4 : at + 8], content[at + 8 : at + 8 + size])
            at += 8 + size
        text, binary = chunks[b"JSON"], chunks.get(b"BIN\0", b"")
    if len(text) > MAX_JSON_BYTES:
        raise ValueError(f"its description has {len(text)} bytes, more than {MAX_JSON_BYTES}")
    header = json.loads(text)
    if not isinstance(header, dict):
        raise ValueError("it is no JSON object")
    return header, binary


def _places(file: Path, header: dict[str, Any]) -> list[tuple[int, FloatArray]]:
    """Mesh and (4, 4) transform to the world of every node of the scene that has a mesh and no skin."""
    nodes, scenes = header.get("nodes", []), header.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [number for number in range(len(nodes)) if number not in children]
    if scenes:
        roots = scenes[_whole(header, "scene")].get("nodes", [])
    waiting = [(number, np.eye(4)) for number in reversed(roots)]
    result, seen = [], set[int]()
    while waiting:
        number, above = waiting.pop()
        if number in seen:
            raise SceneError(f"mesh file '{file}' has node {number} twice in its scene; valid: a tree")
        seen.add(number)
        node = nodes[number]
        to_world = above @ _transform(node)
        if "mesh" in node and "skin" not in node:
            result.append((_whole(node, "mesh"), to_world))
        waiting += [(child, to_world) for child in reversed(node.get("children", []))]
    return result


def _transform(node: dict[str, Any]) -> FloatArray:
    """(4, 4) transform of a node to its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    result = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    result[:3, :3] = turn * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64).reshape(3)
    result[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return result


def _whole(item: dict[str, Any], key: str, default: int | None = 0) -> int:
    """A count, offset or index."""
    value = item.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 40:
        raise ValueError(f"{key} is {str(value)[:40]}, no count")
    return value


@dataclass(eq=False)
class _Content:
    """Meshes of a file; arrays are read once."""

    file: Path
    header: dict[str, Any]
    binary: bytes
    max_bytes: int
    buffers: dict[int, bytes] = field(default_factory=dict)
    arrays: dict[int, np.ndarray] = field(default_factory=dict)

    def corner_count(self, mesh: int) -> int:
        """Vertices of a mesh or corners of its triangles, what is more."""
        return sum(
            max(_whole(self.header["accessors"][number], "count") for number in numbers)
            * (1 if mode == 4 else 3)
            for numbers, mode in map(self._parts, self._triangular(mesh))
        )

    def primitives(self, mesh: int) -> list[tuple[FloatArray, IntArray]]:
        """Vertices (n, 3) and triangles (m, 3) of each primitive of a mesh, in its frame."""
        result = []
        for (place, *index), mode in map(self._parts, self._triangular(mesh)):
            points = self._array(place, "VEC3").astype(np.float64)
            corners = self._array(index[0], "SCALAR")[:, 0] if index else np.arange(len(points))
            result.append((points, _triangles(corners.astype(np.int64), mode)))
        return result

    def _triangular(self, mesh: int) -> list[dict[str, Any]]:
        primitives = self.header["meshes"][mesh]["primitives"]
        kept = (_TRIANGLES, _STRIP, _FAN)
        return [item for item in primitives if _whole(item, "mode", _TRIANGLES) in kept]

    @staticmethod
    def _parts(primitive: dict[str, Any]) -> tuple[list[int], int]:
        """Accessors of the places and of the indices if there are any, and the mode."""
        numbers = [_whole(primitive["attributes"], "POSITION", None)]
        if "indices" in primitive:
            numbers.append(_whole(primitive, "indices"))
        return numbers, _whole(primitive, "mode", _TRIANGLES)

    def _array(self, number: int, kind: str) -> np.ndarray:
        """(n, 1) or (n, 3) values of an accessor."""
        if number not in self.arrays:
            self.arrays[number] = self._read(self.header["accessors"][number], kind)
        return self.arrays[number]

    def _read(self, accessor: dict[str, Any], kind: str) -> np.ndarray:
        if "sparse" in accessor or "bufferView" not in accessor:
            raise SceneError(f"mesh file '{self.file}' has sparse or empty accessors; valid: dense ones")
        if accessor["type"] != kind:
            raise ValueError(f"an accessor is {str(accessor['type'])[:20]} where {kind} is needed")
        view = self.header["bufferViews"][_whole(accessor, "bufferView")]
        dtype, width = np.dtype(_TYPES[accessor["componentType"]]), _WIDTHS[kind]
        count, row = _whole(accessor, "count"), dtype.itemsize * width
        stride = _whole(view, "byteStride", row)
        first, size = _whole(view, "byteOffset"), _whole(view, "byteLength")
        data = self._buffer(_whole(view, "buffer"))[first : first + size]
        start = _whole(accessor, "byteOffset")
        if stride < row or count < 1 or start + (count - 1) * stride + row > len(data):
            raise ValueError("an accessor reaches beyond its buffer")
        values = np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))
        if kind == "VEC3" and accessor.get("normalized") and dtype.kind != "f":
            return np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values

    def _buffer(self, number: int) -> bytes:
        if number not in self.buffers:
            self.buffers[number] = self._loaded(self.header["buffers"][number])
        return self.buffers[number]

    def _loaded(self, buffer: dict[str, Any]) -> bytes:
        place = buffer.get("uri")
        if place is None:
            return self.binary
        head, comma, rest = str(place).partition(",")
        if head.startswith("data:"):
            if not comma or not head.endswith(";base64"):
                raise ValueError("a buffer's data is not base64")
            return base64.b64decode(rest, validate=True)
        folder = self.file.parent.resolve()
        file = (folder / unquote(str(place))).resolve()
        if not file.is_relative_to(folder) or not file.is_file():
            problem = f"mesh file '{self.file}' needs the buffer {str(place)[:100]!r}"
            raise SceneError(f"{problem}; valid: a file in its folder")
        if (size := file.stat().st_size) > self.max_bytes:
            raise SceneError(f"mesh file '{file}' has {size} bytes; valid: at most {self.max_bytes}")
        return file.read_bytes()


def _triangles(corners: IntArray, mode: int) -> IntArray:
    """(m, 3) triangles of a list, strip or fan of vertex numbers (k,)."""
    if mode == _TRIANGLES:
        return corners.reshape(-1, 3)
    first, second, third = corners[:-2].copy(), corners[1:-1].copy(), corners[2:]
    if mode == _FAN:
        first[:] = corners[:1]
    else:  # every other triangle of a strip is turned round
        first[1::2], second[1::2] = second[1::2].copy(), first[1::2].copy()
    return np.column_stack([first, second, third])
