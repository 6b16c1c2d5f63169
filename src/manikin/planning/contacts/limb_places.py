"""Places on which limbs can make contacts: what is level, rungs, edges and bars for hands."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel, Configuration, Limb
from manikin.contact import Contact, ContactKind
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray, frozen_array, onto_normal, rotation_from_yaw
from manikin.planning.contacts.best_first import heading_of
from manikin.planning.contacts.contact_plan import ContactRules, footprint, make_contact
from manikin.planning.contacts.limb_search import LimbHolds
from manikin.scene import GraspLine, Scene, Surface

TOE_ROOM = 0.02  # distance of the toes to the end of the hold that carries them [m]; our choice
TURN_OUT = float(np.deg2rad(25.0))  # angle by which a foot may stand turned out [rad]; our choice
STEEPEST = float(np.deg2rad(40.0))  # largest slope of a surface with such a place [rad]; our choice
FINGERS = (0.005, 0.02)  # distances of a palm from the edge around which its fingers go [m]; our choice
BEYOND = 0.03  # room beyond such an edge [m]; our choice
INSET = 0.06  # distance of tips to the edges of what they stand on, by their reach: shanks lean; our choice
SPACING = 0.1  # distance of neighbouring places of a limb, by its reach, twice that of soles; our choice
PALM_DEPTH = 0.1  # depth behind an edge that a palm needs: boards are too narrow for a hand; our choice [m]
FAR_EDGE = 0.7  # cosine of the angle of the heading to the way out over an edge that is left out; our choice
RUNG_TURN = float(np.deg2rad(30.0))  # largest angle of a heading to the way across its rung; our choice [rad]
RUNG_SIDE = 0.025  # distance of a sole to the ends of its rung, where the stiles are [m]; our choice
RUNG_APART = 0.025  # distance on the sole between two places of a rung below it [m]; our choice
PALM_ROOM = 0.01  # distance of a palm's middle from the bar that its fingers close round [m]
STEEP_BAR = 0.85  # rise of a bar over its length from which on a hand takes it from the side; our choice
LARGE = 4.0  # half the width of a large surface, in steps of its grid; our choice
SHANK_UP, SHANK_ROOM = 0.35, 0.1
"""Height above the middle of a sole on the ground at which nothing may be nearer than the second, by the
reach: toes below the first rung of a ladder keep a shank from getting past it; our choice."""
RUNG_SPACING = 0.045  # largest distance of neighbouring places of a foot along a rung [m]; our choice
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
        item for item in scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        if (item.polygon.min(axis=0) <= high).all() and (item.polygon.max(axis=0) >= low).all()
    ]  # fmt: skip
    heading = heading_of(ends[1])
    goal = ends[1, :3], rotation_from_yaw(heading)
    grid = _Grid(scene, surfaces, (low, high), SPACING * size, goal)
    known: dict[tuple[object, ...], list[_Place]] = {}
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
            frames = [rotation_from_yaw(heading + turn) for turn in outward]
            stiff = rules.stiff if sole and rules.patch is None else None
            known[key] = grid.places(points, frames, kind, stiff)
        places, free = known[key], sole and rules.patch is None
        positions = np.array([place.position for place in places]).reshape(-1, 3)
        found.append(LimbHolds(
            positions, partial(_contact_at, body, limb, kind, rules, places),
            partial(_has_room, scene, size, places, free), item, (there.rotation, there.translation), wanted,
        ))  # fmt: skip
    return found


def _sole(body: BodyModel, limb: Limb, rules: ContactRules) -> FloatArray:
    """(c, 3) points that have to be on a hold; the toes of a climber keep off what stands behind it."""
    points = footprint(body, limb, ContactKind.SOLE, rules)
    if rules.patch is None or limb.patch is not None:
        return points
    toes = 0.5 * (body.sole_length or 0.0) + TOE_ROOM
    return np.column_stack([np.where(points[:, 0] > points[:, 0].mean(), toes, points[:, 0]), points[:, 1:]])


class _Place(NamedTuple):
    """Where an effector may touch: (3,) place [m], (3, 3) rotation, (k, 3) points on a rung [m] or None."""

    position: FloatArray
    rotation: FloatArray
    points: FloatArray | None = None


def _contact_at(
    body: BodyModel, limb: Limb, kind: ContactKind, rules: ContactRules, places: Sequence[_Place], row: int
) -> Contact:
    place = places[row]
    made = make_contact(body, limb, kind, place.position, place.rotation, rules)
    if place.points is None:
        return made
    return replace(made, points=frozen_array(place.points, "what of a sole is on a rung [m]", (4, 3)))


def _has_room(scene: Scene, size: float, places: Sequence[_Place], free: bool, row: int) -> bool:
    """Whether a ball just above a place is free, and, of a whole sole, one where its shank goes up again."""
    place = places[row]
    above = place.position + 0.06 * size * place.rotation[:, 2]
    if scene.nearest(above)[1] <= 0.035 * size:
        return False
    shank = place.position + SHANK_UP * size * place.rotation[:, 2]
    return not free or place.points is not None or scene.nearest(shank)[1] > SHANK_ROOM * size


class _Grid:
    """Grid of places on surfaces in a box (low, high), its spacing [m], and place and heading of the goal."""

    def __init__(
        self, scene: Scene, surfaces: Sequence[Surface], box: tuple[FloatArray, FloatArray], spacing: float,
        goal: tuple[FloatArray, FloatArray],
    ) -> None:  # fmt: skip
        self._scene, self._surfaces, self._box, self._spacing = scene, surfaces, box, spacing
        self._goal = goal

    def places(
        self, points: FloatArray, turns: Sequence[FloatArray], kind: ContactKind, stiff: float | None
    ) -> list[_Place]:
        """Places of contacts of one shape: of hands along edges and bars, of feet on rungs as well.

        A foot may stand on a rung up to ``stiff`` on its x axis [m]; on none where that is None.
        """
        if kind is ContactKind.GRASP:
            along = [place for surface in self._surfaces for place in self._along(surface, turns[0][:, 0])]
            return along + [place for bar in self._scene.grasp_lines for place in self._around(bar, turns[0])]
        spacing, found = (1.0 + (kind is ContactKind.SOLE)) * self._spacing, list[_Place]()
        for surface in self._surfaces:
            whole = [
                _Place(place, upright)
                for upright in (onto_normal(turn, surface.normal) for turn in turns)
                for place in self._on(surface, points @ upright.T, spacing, beside=stiff is not None)
            ]
            found += whole or ([] if stiff is None else self._across(surface, points, turns[0], stiff))
        for top in self._scene.bar_tops if stiff is not None else ():
            found += self._across(top, points, turns[0], stiff or 0.0)
        return found

    def _around(self, bar: GraspLine, turn: FloatArray) -> Iterator[_Place]:
        """Places of a hand along a bar: on top of it, or on the body's side of one that is steep."""
        axis = (bar.end - bar.start) / max(bar.length, 1e-9)
        steep = abs(float(axis[2])) >= STEEP_BAR
        out = -turn[:, 0] if steep else turn[:, 2]
        out = out - (out @ axis) * axis
        out = out / np.linalg.norm(out)
        up = axis if axis[2] > 0.0 else -axis
        frame = np.column_stack([up, np.cross(out, up), out]) if steep else turn
        parts = 2 + int(bar.length / self._spacing)
        # In the middle of equal parts: at the ends a hand that turns round its bar meets what stops it there.
        for share in (np.arange(parts) + 0.5) / parts:
            place = (1.0 - share) * bar.start + share * bar.end + (bar.radius + PALM_ROOM) * out
            if self._inside(place[None])[0]:
                yield _Place(place, frame)

    def _across(
        self, surface: Surface, points: FloatArray, turn: FloatArray, stiff: float
    ) -> Iterator[_Place]:
        """Places of a foot across a rung, which all of the sole's width and no bending part of it is on.

        The sole has corners (c, 3) [m]; the rotation (3, 3) is of a foot that goes straight on.
        """
        ring = surface.polygon
        if len(ring) != 4:
            return
        sides = np.roll(ring, -1, axis=0) - ring
        lengths = np.linalg.norm(sides, axis=1)
        along = sides[int(np.argmax(lengths))] / max(float(lengths.max()), 1e-9)
        ahead = np.cross(along, surface.normal)
        ahead = ahead * np.sign(ahead @ turn[:, 0])
        frame = np.column_stack([ahead, np.cross(surface.normal, ahead), surface.normal])
        across, room = float(lengths.min()), 0.5 * (float(lengths.max()) - np.ptp(points[:, 1])) - RUNG_SIDE
        if ahead @ turn[:, 0] < np.cos(RUNG_TURN) or room < 0.0 or across > stiff - float(points[:, 0].min()):
            return
        half, side = 0.5 * across, 0.5 * float(np.ptp(points[:, 1]))
        front = stiff - half
        for middle in (front, 0.0) if front > RUNG_APART else (front,):
            on = np.array([middle, 0.0, 0.0]) + np.array([half, side, 0.0]) * _SQUARE
            for share in np.linspace(-1.0, 1.0, 2 * int(np.ceil(room / RUNG_SPACING)) + 1):
                place = surface.centre - middle * ahead + share * room * frame[:, 1]
                if self._inside(place[None])[0]:
                    yield _Place(place, frame, on)

    def _inside(self, places: FloatArray) -> NDArray[np.bool_]:
        low, high = self._box
        return np.asarray(((places >= low) & (places <= high)).all(axis=1), dtype=np.bool_)

    def _along(self, surface: Surface, ahead: FloatArray) -> Iterator[_Place]:
        """Places along edges beyond which there is room, fingers inward, none back to the heading (3,)."""
        for start, end in zip(*surface.edges, strict=True):
            length = float(np.linalg.norm(end - start))
            along = (end - start) / max(length, 1e-9)
            out = np.cross(along, surface.normal)
            deep = float(np.max((surface.polygon - start) @ -out))
            if out @ ahead > FAR_EDGE or deep < PALM_DEPTH:
                continue
            turn = np.column_stack([-out, np.cross(surface.normal, -out), surface.normal])
            shares = np.linspace(0.0, 1.0, 2 + int(length / self._spacing))[1:-1, None]
            edges = (1.0 - shares) * start + shares * end
            for edge in edges[self._inside(edges)]:
                if self._scene.nearest(edge + BEYOND * out)[1] > 0.5 * BEYOND:
                    yield from (_Place(edge - inset * out, turn) for inset in FINGERS)

    def _on(self, surface: Surface, points: FloatArray, spacing: float, *, beside: bool) -> FloatArray:
        """(m, 3) places on one surface of what touches with points (c, 3) about it, in the world's axes.

        Feet that stand ``beside`` rungs, on what is large, have places on either side of the way to the goal:
        there is little room between the stiles of a ladder.
        """
        low, high = self._box
        corners = np.clip(surface.polygon, low - 1.0, high + 1.0)
        middle, axes = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), surface.rotation[:, :2]
        half = np.abs((corners - middle) @ axes).max(axis=0)
        if beside and half.min() > LARGE * spacing:
            axes = onto_normal(self._goal[1], surface.normal)[:, :2]
            middle, half = self._goal[0] + 0.5 * spacing * axes[:, 1], 2.0 * half
        # At least two steps each way on what is small.
        gaps = np.minimum(spacing, 0.5 * half)
        steps = [np.arange(-np.ceil(side / gap), np.ceil(side / gap) + 1) * gap
                 for side, gap in zip(half, gaps, strict=True)]  # fmt: skip
        grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        middle = middle - ((middle - surface.polygon[0]) @ surface.normal) * surface.normal
        places = middle + grid @ axes.T - points.mean(axis=0)
        places = places[self._inside(places)]
        outside = surface.outside((places[:, None] + points).reshape(-1, 3)).reshape(len(places), len(points))
        return places[(outside <= 0.0).all(axis=1)]
