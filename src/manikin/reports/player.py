"""Data of the player of a page: a skinned body, its motion and the scene, as small as the eye allows.

``templates/player.js`` shows them with WebGL and needs no other file. All numbers are little-endian and in
base64: vertices as shares of their bounds in 16 bits, normals and weights in 8 bits. The segments' places are
float32 at most :data:`RATE` times a second.
"""

import base64
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.flesh import MATERIALS
from manikin.body.skin import Skin, segment_frames
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, area_normals, unit
from manikin.reports.figures.views import distinct_contacts
from manikin.reports.gltf import continuous, surface_of
from manikin.reports.solids import DrawnSolid, contact_solids, rgb, scene_solids
from manikin.runtime.display import COLOURS, MATERIAL_COLOURS
from manikin.scene import Scene

RATE, MOST_FRAMES = 30.0, 900
"""Frames of a second [Hz] of motions that are short enough for it, and of any motion."""
MOST_TRIANGLES = 40_000
"""Triangles of a scene; obstacles that do not fit, the largest first, are shown by their bounds."""
AROUND = 2.0
"""Farther than this from the body obstacles are cut off [m]."""


def player_data(
    body: BodyModel, motion: Motion, scene: Scene | None = None, schedule: ContactSchedule | None = None,
    places: Callable[[NDArray[np.int64]], Mapping[str, FloatArray]] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """What ``player.js`` shows, ready for JSON.

    Args:
        places: Position [m] and yaw [rad], (n, 4), of obstacles that are moved, by name, at samples (n,) of
            the motion; none when omitted.

    Raises:
        MotionFileError: If the body has nothing to draw.
    """
    count = int(min(MOST_FRAMES, max(2, round(motion.duration * RATE) + 1)))
    wanted = np.linspace(motion.time[0], motion.time[-1], count)
    samples = np.searchsorted(motion.time, wanted - 1e-9).clip(0, len(motion.time) - 1)
    frames = [segment_frames(body, motion.q[sample]) for sample in samples]
    taken = {} if scene is None or places is None else places(samples)
    seen = np.array([origins for _, origins in frames]).reshape(-1, 3)
    low, high = seen.min(axis=0), seen.max(axis=0)
    contacts = [] if schedule is None else distinct_contacts(schedule)
    drawn = [] if scene is None else scene_solids(scene, low - AROUND, high + AROUND)
    shown = _limited([solid for solid in drawn if solid.name not in taken])
    skin, frames = _with_objects(surface_of(body), frames, [x for x in drawn if x.name in taken], taken)
    order = np.argsort(skin.materials, kind="stable")
    width = 2 if len(skin.vertices) <= 65536 else 4
    materials, counts = np.unique(skin.materials, return_counts=True)
    return {
        "skin": {
            "count": len(skin.vertices), **_places(skin.vertices), "normals": _signed(skin.normals),
            "bones": _encoded(skin.bones, "u1"), "weights": _weights(skin.weights),
            "faces": _encoded(skin.faces[order], f"<u{width}"), "width": width,
            "parts": [[int(n), _colour(number)] for number, n in zip(materials, counts, strict=True)],
        },
        "segments": len(skin.segments), "frames": count, "duration": motion.duration,
        "start": float(motion.time[0]),
        "tracks": _encoded(_tracks(frames, skin.rotations, skin.origins), "<f4"),
        "scene": _triangles([*shown, *contact_solids(contacts)]),
        "path": _encoded(motion.com[samples], "<f4"),
        "floor": None if scene is None else scene.floor_height,
        "middle": ((low + high) / 2.0).tolist(), "reach": float(np.linalg.norm(high - low)),
        "azimuth": _azimuth(motion.q[samples]),
    }  # fmt: skip


def _with_objects(
    skin: Skin, frames: list[tuple[FloatArray, FloatArray]], solids: list[DrawnSolid],
    places: Mapping[str, FloatArray],
) -> tuple[Skin, list[tuple[FloatArray, FloatArray]]]:  # fmt: skip
    """The surface and its frames with what moves in the scene, each as one more segment."""
    for solid in solids:
        place = places[solid.name]
        corners = solid.vertices[solid.faces]
        count, number = 3 * len(corners), len(skin.segments)
        skin = replace(
            skin,
            vertices=np.concatenate([skin.vertices, corners.reshape(-1, 3)]),
            normals=np.concatenate([skin.normals, _flat_normals(corners)]),
            faces=np.concatenate([skin.faces, len(skin.vertices) + np.arange(count).reshape(-1, 3)]),
            materials=np.append(skin.materials, np.full(len(corners), OBJECT)),
            bones=np.concatenate([skin.bones, np.full((count, 4), number)]),
            weights=np.concatenate([skin.weights, np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))]),
            segments=(*skin.segments, solid.name),
            rotations=np.concatenate([skin.rotations, np.eye(3)[None]]),
            origins=np.concatenate([skin.origins, place[:1, :3]]),
        )
        turns = Rotation.from_euler("z", (place[:, 3] - place[0, 3])[:, None]).as_matrix()
        frames = [
            (np.concatenate([turn, turns[k : k + 1]]), np.concatenate([origin, place[k : k + 1, :3]]))
            for k, (turn, origin) in enumerate(frames)
        ]
    return skin, frames


OBJECT = len(MATERIALS)
"""Number of the material of what moves in the scene."""


def _tracks(
    frames: list[tuple[FloatArray, FloatArray]], rotations: FloatArray, origins: FloatArray
) -> FloatArray:
    """(frames, s, 7) quaternion xyzw and shift of each segment from the posture of the surface."""
    turns = np.array([turn for turn, _ in frames]) @ rotations.transpose(0, 2, 1)
    shifts = np.array([place for _, place in frames]) - np.einsum("fsij,sj->fsi", turns, origins)
    turned = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(*turns.shape[:2], 4)
    kept = np.stack([continuous(turned[:, k]) for k in range(turned.shape[1])], axis=1)
    return np.concatenate([kept, shifts], axis=-1)


def _azimuth(q: FloatArray) -> float:
    """Direction of the eye [rad]: half from before, half from the right of where the pelvis looks at most."""
    ahead = Rotation.from_quat(q[:, 3:7]).as_matrix()[:, :2, 0].mean(axis=0)
    return float(np.arctan2(ahead[1], ahead[0]) - np.pi / 4.0)


def _limited(solids: list[DrawnSolid]) -> list[DrawnSolid]:
    total = sum(len(solid.faces) for solid in solids)
    result = list(solids)
    for number in sorted(range(len(solids)), key=lambda k: -len(solids[k].faces)):
        if total <= MOST_TRIANGLES:
            break
        total -= len(solids[number].faces) - 12
        result[number] = _bounds(solids[number])
    return result


def _bounds(solid: DrawnSolid) -> DrawnSolid:
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([(a, *pair) for a, b, c, d in quads for pair in ((b, c), (c, d))])
    return DrawnSolid(solid.name, np.where(corners, high, low), faces, np.tile(solid.colours[:1], (12, 1)))


def _triangles(solids: list[DrawnSolid]) -> dict[str, Any] | None:
    """Flat triangles of the scene, three vertices of their own for each."""
    if not solids:
        return None
    corners = np.concatenate([solid.vertices[solid.faces] for solid in solids])
    colours = np.repeat(np.concatenate([solid.colours for solid in solids]), 3, axis=0)
    padded = np.column_stack([np.round(255.0 * colours), np.full(len(colours), 255)])
    return {
        "count": 3 * len(corners), **_places(corners.reshape(-1, 3)),
        "normals": _signed(_flat_normals(corners)), "colours": _encoded(padded, "u1"),
    }  # fmt: skip


def _flat_normals(corners: FloatArray) -> FloatArray:
    """(3m, 3) unit normals of triangles (m, 3, 3) at each of their corners."""
    return np.repeat(unit(area_normals(corners), 1e-15), 3, axis=0)


def _places(points: FloatArray) -> dict[str, Any]:
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-9)
    padded = np.column_stack([np.round((points - low) / size * 65535.0), np.zeros(len(points))])
    return {"low": low.tolist(), "size": size.tolist(), "places": _encoded(padded, "<u2")}


def _signed(normals: FloatArray) -> str:
    return _encoded(np.column_stack([np.round(127.0 * normals), np.zeros(len(normals))]), "i1")


def _weights(weights: FloatArray) -> str:
    """Weights in 1/255, the largest of which takes what rounding leaves."""
    whole = np.round(255.0 * weights)
    rows = np.arange(len(whole))
    whole[rows, np.argmax(whole, axis=1)] += 255.0 - whole.sum(axis=1)
    return _encoded(whole, "u1")


def _colour(number: int) -> list[float]:
    if number == OBJECT:
        return rgb(COLOURS["obstacle"]).round(3).tolist()
    return rgb(COLOURS["trunk"] if number < 0 else MATERIAL_COLOURS[MATERIALS[number]]).round(3).tolist()


def _encoded(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
