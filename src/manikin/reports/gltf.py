"""A motion as a binary glTF 2.0 file (GLB): the skinned body, its animation and the scene.

glTF is y up in metres, forward is z: a node turns our world (x forward, y left, z up) so. The segments are
joints of one skin, each with a rotation per sample; the root also has its places. A human has the surface of
:mod:`manikin.body.skin`, another body the shapes of its segments, each of which follows its segment alone.
"""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.flesh import MATERIALS, Material
from manikin.body.segments import segment_triangles
from manikin.body.skin import Skin, segment_frames, skin_of
from manikin.errors import MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, area_normals, unit
from manikin.scene import Scene
from manikin.scene.scene import FLOOR

TO_GLTF: FloatArray = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Rotation of our world's axes to those of glTF: X = y (left), Y = z (up), Z = x (forward)."""
TO_GLTF.setflags(write=False)

LINEAR_COLOURS: dict[str, tuple[float, float, float, float]] = {
    Material.SKIN: (0.72, 0.46, 0.33, 1.0), Material.HAIR: (0.06, 0.035, 0.02, 1.0),
    Material.SHIRT: (0.06, 0.19, 0.45, 1.0), Material.TROUSERS: (0.05, 0.06, 0.09, 1.0),
    Material.SHOES: (0.02, 0.02, 0.02, 1.0), "shapes": (0.35, 0.38, 0.42, 1.0), "scene": (0.6, 0.6, 0.6, 1.0),
}  # fmt: skip
"""Base colours of materials, bodies of shapes and obstacles: linear red, green, blue and opacity."""
_FLOAT, _SHORT, _INDEX = (5126, "<f4"), (5123, "<u2"), (5125, "<u4")
_VERTICES, _TRIANGLES = 34962, 34963


class _Buffer:
    """The binary part of the file and its accessors."""

    def __init__(self) -> None:
        self.data, self.views, self.accessors = bytearray(), list[dict[str, Any]](), list[dict[str, Any]]()

    def add(
        self, values: np.ndarray, shape: str, kind: tuple[int, str] = _FLOAT, *, target: int | None = None,
        bounds: bool = False,
    ) -> int:  # fmt: skip
        """Append an array and return the number of its accessor; with least and greatest values if wanted."""
        array = np.ascontiguousarray(values, dtype=kind[1])
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.views.append(view if target is None else view | {"target": target})
        entry: dict[str, Any] = {"bufferView": len(self.views) - 1, "componentType": kind[0]}
        entry |= {"count": len(array), "type": shape}
        if bounds:
            rows = array.reshape(len(array), -1)
            entry |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(entry)
        self.data += array.tobytes() + bytes(-array.nbytes % 4)
        return len(self.accessors) - 1


def to_glb(body: BodyModel, motion: Motion, scene: Scene | None = None) -> bytes:
    """Content of a GLB file of a motion, one key per sample, and its scene.

    Raises:
        MotionFileError: If the motion is not the body's, or the body has nothing to draw.
    """
    skin = moved_surface(body, motion)
    buffer, meshes = _Buffer(), list[dict[str, Any]]()
    materials = [
        {"name": str(name), "doubleSided": True,
         "pbrMetallicRoughness": {"baseColorFactor": list(colour), "metallicFactor": 0.0,
                                  "roughnessFactor": 0.9}}
        for name, colour in LINEAR_COLOURS.items()
    ]  # fmt: skip
    numbers = {name: number for number, name in enumerate(LINEAR_COLOURS)}
    names = skin.segments
    nodes: list[dict[str, Any]] = [{"name": name} for name in names]
    for segment in body.segments:
        if segment.parent is not None:
            nodes[names.index(segment.parent)].setdefault("children", []).append(names.index(segment.name))
    meshes.append({"name": body.name, "primitives": _skinned(skin, buffer, numbers)})
    matrices = np.tile(np.eye(4), (len(names), 1, 1))
    matrices[:, :3, :3] = skin.rotations.transpose(0, 2, 1)
    matrices[:, :3, 3] = -np.einsum("sji,sj->si", skin.rotations, skin.origins)
    inverse = buffer.add(matrices.transpose(0, 2, 1).reshape(-1, 16), "MAT4")  # column by column
    root = next(k for k, segment in enumerate(body.segments) if segment.parent is None)
    animation = _animation(body, motion, nodes, buffer)
    nodes.append({"name": "body", "mesh": 0, "skin": 0})
    skinned, tops = len(nodes) - 1, [root]
    for obstacle in scene or ():
        if obstacle.name == FLOOR:
            continue
        shape = obstacle.to_trimesh()
        meshes.append({"name": obstacle.name, "primitives": [_solid(shape, buffer, numbers["scene"])]})
        nodes.append({"name": obstacle.name, "mesh": len(meshes) - 1})
        tops.append(len(nodes) - 1)
    nodes.append({"name": "z_up_to_y_up", "rotation": _quaternion(TO_GLTF), "children": tops})
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    used = sorted({primitive["material"] for primitive in primitives})
    for primitive in primitives:
        primitive["material"] = used.index(primitive["material"])
    document = {
        "asset": {"version": "2.0", "generator": "manikin"}, "scene": 0,
        "scenes": [{"nodes": [len(nodes) - 1, skinned]}],
        "nodes": nodes, "meshes": meshes, "animations": [animation],
        "materials": [materials[number] for number in used],
        "skins": [{"joints": list(range(len(names))), "skeleton": root, "inverseBindMatrices": inverse}],
        "buffers": [{"byteLength": len(buffer.data)}], "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    }  # fmt: skip
    return _packed(document, bytes(buffer.data))


def moved_surface(body: BodyModel, motion: Motion) -> Skin:
    """Surface of a body whose motion this is, with the body's segments as bones.

    Raises:
        MotionFileError: If the motion is not the body's, or the body has nothing to draw.
    """
    if motion.joint_names != body.joint_names:
        raise MotionFileError("motion has other joints than the body; valid: the body's own motion")
    skin = surface_of(body)
    if [segment.name for segment in body.segments] != list(skin.segments):
        raise MotionFileError(f"body {body.name!r} has other segments than its surface; valid: the same ones")
    return skin


def surface_of(body: BodyModel) -> Skin:
    """Surface of a person, or the shapes of another body.

    Raises:
        MotionFileError: If the body has nothing to draw.
    """
    return skin_of(body) or _shapes(body)


def _shapes(body: BodyModel) -> Skin:
    """The shapes of a body's segments, each in the frame of its segment and bound to it."""
    places, faces, bones, count = list[FloatArray](), list[np.ndarray](), list[np.ndarray](), 0
    for number, segment in enumerate(body.segments):
        if (found := segment_triangles(segment)) is not None:
            places.append(found[0])
            faces.append(found[1] + count)
            bones.append(np.tile([number, 0, 0, 0], (len(found[0]), 1)))
            count += len(found[0])
    if not places:
        raise MotionFileError(f"body {body.name!r} has no shape; valid: a body with shapes for glb")
    vertices, triangles = np.concatenate(places), np.concatenate(faces)
    across, normals = area_normals(vertices[triangles]), np.zeros_like(vertices)
    for column in triangles.T:
        np.add.at(normals, column, across)
    weights = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    names, size = tuple(segment.name for segment in body.segments), len(body.segments)
    return Skin(
        vertices, unit(normals, 1e-12), triangles, np.full(len(triangles), -1), np.concatenate(bones),
        weights, names, np.tile(np.eye(3), (size, 1, 1)), np.zeros((size, 3)),
    )  # fmt: skip


def _skinned(skin: Skin, buffer: _Buffer, numbers: dict[str, int]) -> list[dict[str, Any]]:
    """Primitives of the skin, one for each material, on shared vertices."""
    weights = skin.weights.astype("<f4")
    weights /= weights.sum(axis=1, keepdims=True)
    attributes = {
        "POSITION": buffer.add(skin.vertices, "VEC3", target=_VERTICES, bounds=True),
        "NORMAL": buffer.add(skin.normals, "VEC3", target=_VERTICES),
        # glTF wants a joint without a weight to be zero.
        "JOINTS_0": buffer.add(np.where(weights > 0.0, skin.bones, 0), "VEC4", _SHORT, target=_VERTICES),
        "WEIGHTS_0": buffer.add(weights, "VEC4", target=_VERTICES),
    }
    found = []
    for number in np.unique(skin.materials).tolist():
        faces = skin.faces[skin.materials == number]
        index = buffer.add(faces.reshape(-1), "SCALAR", _INDEX, target=_TRIANGLES)
        name = "shapes" if number < 0 else MATERIALS[number]
        found.append({"attributes": attributes, "indices": index, "material": numbers[name]})
    return found


def _solid(shape: Any, buffer: _Buffer, material: int) -> dict[str, Any]:
    """One flat shaded solid of a scene, in the world."""
    corners = np.asarray(shape.vertices)[np.asarray(shape.faces)]
    across = area_normals(corners)
    size = np.linalg.norm(across, axis=1)
    corners, across = corners[size > 0.0], across[size > 0.0] / size[size > 0.0, None]
    places = buffer.add(corners.reshape(-1, 3), "VEC3", target=_VERTICES, bounds=True)
    normals = buffer.add(np.repeat(across, 3, axis=0), "VEC3", target=_VERTICES)
    return {"attributes": {"POSITION": places, "NORMAL": normals}, "material": material}


def _animation(
    body: BodyModel, motion: Motion, nodes: list[dict[str, Any]], buffer: _Buffer
) -> dict[str, Any]:
    """Rotations of all joints and places of the root over time; other joints get their fixed places."""
    time = buffer.add(motion.time - motion.time[0], "SCALAR", bounds=True)
    samplers, channels = list[dict[str, Any]](), list[dict[str, Any]]()
    for number, (keys, places) in enumerate(joint_tracks(body, motion)):
        nodes[number] |= {"translation": places[0].tolist(), "rotation": keys[0].tolist()}
        tracks = [("rotation", buffer.add(keys, "VEC4"))]
        if body.segments[number].parent is None:
            tracks.append(("translation", buffer.add(places, "VEC3")))
        for path, output in tracks:
            channels.append({"sampler": len(samplers), "target": {"node": number, "path": path}})
            samplers.append({"input": time, "output": output, "interpolation": "LINEAR"})
    return {"name": "motion", "samplers": samplers, "channels": channels}


def joint_tracks(body: BodyModel, motion: Motion) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Of each segment its continuous xyzw quaternions (n, 4) and places (n, 3) [m] in its parent's frame."""
    frames = [segment_frames(body, q) for q in motion.q]
    rotations = np.array([turn for turn, _ in frames])
    origins = np.array([place for _, place in frames])
    names = [segment.name for segment in body.segments]
    for number, segment in enumerate(body.segments):
        turns, places = rotations[:, number], origins[:, number]
        if segment.parent is not None:
            parent = names.index(segment.parent)
            inverse = rotations[:, parent].transpose(0, 2, 1)
            turns = inverse @ turns
            places = np.einsum("nij,nj->ni", inverse, places - origins[:, parent])
        yield continuous(Rotation.from_matrix(turns).as_quat()), places


def continuous(quaternions: FloatArray) -> FloatArray:
    """Quaternions (n, 4) with signs by which each is nearest to the one before."""
    jumps = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    signs = np.concatenate(([1.0], np.where(np.cumsum(jumps) % 2 == 1, -1.0, 1.0)))
    return quaternions * signs[:, None]


def _quaternion(rotation: FloatArray) -> list[float]:
    return Rotation.from_matrix(rotation).as_quat().tolist()


def _packed(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text
    chunks += len(binary).to_bytes(4, "little") + b"BIN\0" + binary
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks
