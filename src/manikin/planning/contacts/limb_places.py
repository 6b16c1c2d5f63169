"""Places on which limbs can make contacts: what is level, edges of it and bars for hands."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel, Configuration, Limb
from manikin.contact import Contact, ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.best_first import heading_of
from manikin.planning.contacts.contact_plan import ContactRules, footprint, make_contact, onto_normal
from manikin.planning.contacts.limb_search import LimbHolds
from manikin.planning.contacts.samples import LimbSamples
from manikin.scene import Scene, Surface


def stature_of(body: BodyModel) -> float:
    """Stature of a body that stands on feet [m].

    Raises:
        BodyError: If the body has none, as creatures have.
    """
    if body.stature is None:
        raise BodyError(f"body {body.name!r} has no stature; valid: a human")
    return body.stature


TOE_ROOM = 0.02
"""Distance of the toes to the end of the hold that carries them [m]; our choice."""

TURN_OUT = float(np.deg2rad(25.0))
"""Angle by which a foot may stand turned out [rad]; our choice."""

STEEPEST = float(np.deg2rad(40.0))
"""Largest slope of a surface on which such a place may be [rad]; our choice."""

FINGERS = (0.005, 0.02)
"""Distances of a palm from the edge around which its fingers go [m]; our choice."""

BEYOND = 0.03
"""Room beyond such an edge [m]; our choice."""

INSET = 0.06
"""Distance of tips to the edges of what they stand on, by their reach: shanks lean; our choice."""

SPACING = 0.1
"""Distance of neighbouring places of a limb, by its reach, twice that of soles; our choice."""

_SQUARE = np.array([[1.0, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])


def limb_holds(
    body: BodyModel, scene: Scene, limbs: Sequence[Limb], kinds: Mapping[str, ContactKind],
    rules: ContactRules, reference: FloatArray, samples: Mapping[str, LimbSamples], ends: FloatArray,
    size: float,
) -> list[LimbHolds]:  # fmt: skip
    """Places of limbs around a start and a goal.

    Args:
        kinds: How each touches, by name of the limb.
        reference: (nq,) posture in which every limb is where it should be relative to the root.
        ends: (2, 7) poses of the root at start and goal.
        size: Mean distance that the limbs reach [m].
    """
    state, root = Configuration(body, reference), pin.XYZQUATToSE3(reference[:7])
    low, high = ends[:, :3].min(axis=0) - 2.0 * size, ends[:, :3].max(axis=0) + 2.0 * size
    surfaces = [
        item
        for item in scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        if (item.polygon.min(axis=0) <= high).all() and (item.polygon.max(axis=0) >= low).all()
    ]
    grid = _Grid(scene, surfaces, (low, high), SPACING * size)
    heading = heading_of(ends[1])
    known: dict[tuple[object, ...], tuple[FloatArray, list[FloatArray]]] = {}
    found: list[LimbHolds] = []
    for limb in limbs:
        kind, item = kinds[limb.name], samples[limb.name]
        there = root.actInv(pin.SE3(*state.segment_placement(item.segment)))
        wanted = np.asarray(root.actInv(state.effector_placement(limb.effector)[1]))
        sole = kind is ContactKind.SOLE
        outward = (0.0, float(np.sign(wanted[1])) * TURN_OUT) if sole else (0.0,)
        points = _sole(body, limb, rules) if sole else INSET * size * _SQUARE
        key = kind, points.tobytes(), outward
        if key not in known:
            known[key] = grid.places(points, [rotation_from_yaw(heading + turn) for turn in outward], kind)
        places, turns = known[key]
        found.append(LimbHolds(
            places, partial(_contact_at, body, limb, kind, rules, places, turns),
            partial(_has_room, scene, size, places, turns), item, (there.rotation, there.translation), wanted,
        ))  # fmt: skip
    return found


def _sole(body: BodyModel, limb: Limb, rules: ContactRules) -> FloatArray:
    """(c, 3) points that have to be on a hold; the toes of a climber keep off what stands behind it."""
    points = footprint(body, limb, ContactKind.SOLE, rules)
    if rules.patch is None or limb.patch is not None:
        return points
    toes = 0.5 * (body.sole_length or 0.0) + TOE_ROOM
    return np.column_stack([np.where(points[:, 0] > points[:, 0].mean(), toes, points[:, 0]), points[:, 1:]])


def _contact_at(
    body: BodyModel, limb: Limb, kind: ContactKind, rules: ContactRules, places: FloatArray,
    turns: Sequence[FloatArray], row: int,
) -> Contact:  # fmt: skip
    return make_contact(body, limb, kind, places[row], turns[row], rules)


def _has_room(scene: Scene, size: float, places: FloatArray, turns: Sequence[FloatArray], row: int) -> bool:
    """Whether a ball just above a place is free."""
    return scene.nearest(places[row] + 0.06 * size * turns[row][:, 2])[1] > 0.035 * size


class _Grid:
    """Grid of places on surfaces in a box (low, high), its spacing [m]."""

    def __init__(
        self, scene: Scene, surfaces: Sequence[Surface], box: tuple[FloatArray, FloatArray], spacing: float
    ) -> None:
        self._scene, self._surfaces, self._box, self._spacing = scene, surfaces, box, spacing

    def places(
        self, points: FloatArray, turns: Sequence[FloatArray], kind: ContactKind
    ) -> tuple[FloatArray, list[FloatArray]]:
        """Places (m, 3) [m] with rotations (3, 3) of contacts of one shape: of hands along edges and bars."""
        holds, spacing = kind is ContactKind.GRASP, (1.0 + (kind is ContactKind.SOLE)) * self._spacing
        pairs = [pair for surface in self._surfaces for pair in self._along(surface)] if holds else [
            (place, upright)
            for surface in self._surfaces
            for upright in (onto_normal(turn, surface.normal) for turn in turns)
            for place in self._on(surface, points @ upright.T, spacing)
        ]  # fmt: skip
        for bar in self._scene.grasp_lines if holds else ():
            for share in np.linspace(0.0, 1.0, 1 + int(bar.length / self._spacing)):
                place = (1.0 - share) * bar.start + share * bar.end + [0.0, 0.0, bar.radius]
                if self._inside(place[None])[0]:
                    pairs.append((place, turns[0]))
        return np.array([place for place, _ in pairs]).reshape(-1, 3), [turn for _, turn in pairs]

    def _inside(self, places: FloatArray) -> NDArray[np.bool_]:
        low, high = self._box
        return np.asarray(((places >= low) & (places <= high)).all(axis=1), dtype=np.bool_)

    def _along(self, surface: Surface) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Places along the edges of a surface beyond which there is room, fingers pointing inward."""
        for start, end in zip(*surface.edges, strict=True):
            length = float(np.linalg.norm(end - start))
            along = (end - start) / max(length, 1e-9)
            out = np.cross(along, surface.normal)
            turn = np.column_stack([-out, np.cross(surface.normal, -out), surface.normal])
            for share in np.linspace(0.0, 1.0, 2 + int(length / self._spacing))[1:-1]:
                edge = (1.0 - share) * start + share * end
                room = self._scene.nearest(edge + BEYOND * out)[1] > 0.5 * BEYOND
                if room and self._inside(edge[None])[0]:
                    yield from ((edge - inset * out, turn) for inset in FINGERS)

    def _on(self, surface: Surface, points: FloatArray, spacing: float) -> FloatArray:
        """(m, 3) places on one surface of what touches with points (c, 3) about it, in the world's axes."""
        low, high = self._box
        corners = np.clip(surface.polygon, low - 1.0, high + 1.0)
        middle, axes = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), surface.rotation[:, :2]
        half = np.abs((corners - middle) @ axes).max(axis=0)
        # At least two steps each way on what is small.
        gaps = np.minimum(spacing, 0.5 * half)
        steps = [np.arange(-np.ceil(side / gap), np.ceil(side / gap) + 1) * gap
                 for side, gap in zip(half, gaps, strict=True)]  # fmt: skip
        grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        middle = middle - ((middle - surface.polygon[0]) @ surface.normal) * surface.normal
        places = middle + grid @ axes.T - points.mean(axis=0)
        places = places[self._inside(places)]
        outside = surface.outside((places[:, None] + points).reshape(-1, 3)).reshape(len(places), -1)
        on = (outside <= 0.0).all(axis=1)
        return places[on]
