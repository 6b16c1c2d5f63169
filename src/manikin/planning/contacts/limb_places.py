"""Places for one limb near where it should be: footholds of soles, and offers of the contact generator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel, Configuration, Limb
from manikin.body.limbs import is_further
from manikin.contact import Contact, ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.best_first import heading_of
from manikin.planning.contacts.candidates import Candidates, Situation
from manikin.planning.contacts.contact_plan import ContactRules, footprint, make_contact, onto_normal
from manikin.planning.contacts.efort import Task
from manikin.planning.contacts.generator import (
    ContactGenerator,
    GeneratedContact,
    GeneratorSettings,
    Hindrance,
)
from manikin.planning.contacts.heuristics import Efort, Heuristic
from manikin.planning.contacts.limb_search import LimbHolds
from manikin.planning.contacts.samples import LimbSamples, sample_limbs
from manikin.scene import Scene, Surface


def stature_of(body: BodyModel) -> float:
    """Stature of a body that stands on feet [m].

    Raises:
        BodyError: If the body has none, as creatures have.
    """
    if body.stature is None:
        raise BodyError(f"body {body.name!r} has no stature; valid: a human")
    return body.stature


FAR = 10.0
"""Score that is taken off what lies too far from where the limb should be."""

ROOM = 0.2
"""Distance from where a limb should be that counts as much as all of EFORT, by its reach; our choice."""

NEAREST = 3
"""Most places that are offered beside those of the generator."""

TOE_ROOM = 0.02
"""Distance of the toes to the end of the hold that carries them [m]; our choice."""

TURN_OUT = float(np.deg2rad(25.0))
"""Angle by which a foot may stand turned out [rad]; our choice."""

STEEPEST = float(np.deg2rad(40.0))
"""Largest slope of a surface on which such a place may be [rad]; our choice."""

FINGERS = 0.08
"""Distance from an edge at which a hand has its fingers around it [m]; our choice."""

TILTS = {ContactKind.GRASP: float(np.deg2rad(80.0)), ContactKind.POINT: float(np.deg2rad(35.0))}
"""Largest angle between an effector's normal and the surface's [rad]; our choice.

A hand has its fingers around an edge at any angle, a tip may lean."""


@dataclass(frozen=True)
class Near:
    """A heuristic for contacts near a place, and of those the one that another preference likes best; ours.

    Attributes:
        place: (3,) where the effector should be [m].
        room: Distance from there that counts as much as the whole other preference [m].
        edges: Where there are edges, for a hand that has to have its fingers around one; None for others.
    """

    place: tuple[float, float, float]
    room: float
    other: Heuristic
    edges: "Edges | None" = None

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        away = np.linalg.norm(candidates.points - np.array(self.place), axis=1) / self.room
        liked = self.other.score(situation, candidates)
        largest = np.abs(liked).max(initial=0.0)
        score = (liked / largest if largest > 0.0 else 0.0) - away - FAR * (away > 2.0)
        if self.edges is not None:
            score -= FAR * ~self.edges.near(candidates)
        return score


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a scene's surfaces.

    Attributes:
        polygons: (k, 3) corners of each surface [m].
        reach: Distance from an edge at which fingers get around it [m].
    """

    polygons: tuple[FloatArray, ...]
    reach: float

    def near(self, candidates: Candidates) -> NDArray[np.bool_]:
        """(n,) whether candidates lie near an edge of their surface."""
        near = np.zeros(len(candidates), dtype=bool)
        for number in np.unique(candidates.surfaces):
            rows = np.flatnonzero(candidates.surfaces == number)
            start = self.polygons[number]
            along = np.roll(start, -1, axis=0) - start
            away = candidates.points[rows, None] - start
            share = np.einsum("nei,ei->ne", away, along) / np.maximum(np.sum(along**2, axis=1), 1e-18)
            gap = away - np.clip(share, 0.0, 1.0)[..., None] * along
            near[rows] = np.linalg.norm(gap, axis=2).min(axis=1) <= self.reach
        return near


class LimbPlaces:
    """Offers contacts of limbs where they should be, in a body led along a guide.

    Attributes:
        limbs: Those that make contacts, by effector.
        reach: Mean distance that these limbs reach [m].
    """

    def __init__(
        self, body: BodyModel, scene: Scene, limbs: tuple[Limb, ...], kinds: Mapping[str, ContactKind],
        rules: ContactRules, reference: FloatArray, samples: Mapping[str, LimbSamples] | None = None,
    ) -> None:  # fmt: skip
        """Prepare a scene.

        Args:
            limbs: Limbs that make contacts.
            kinds: How each touches, by name of the limb.
            reference: (nq,) posture in which every limb is where it should be relative to the root.
            samples: Samples of the limbs; made when omitted.
        """
        self.limbs = {limb.effector: limb for limb in limbs}
        self._kinds = kinds
        known = samples or sample_limbs(body, np.random.default_rng(0))
        known = {limb.name: known[limb.name] for limb in limbs}
        self._generators = {
            kind: ContactGenerator(
                body, scene, {limb.name: known[limb.name] for limb in limbs if kinds[limb.name] is kind},
                GeneratorSettings(max_tilt=TILTS[kind], point_tilt=TILTS[kind]) if kind in TILTS else None,
                rules,
            )
            for kind in set(kinds.values())
        }  # fmt: skip
        self._body, self._rules = body, rules
        self._level = scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        self._edges = Edges(tuple(surface.polygon for surface in scene.holds), FINGERS)
        state = Configuration(body, reference)
        root = pin.XYZQUATToSE3(reference[:7])
        self._wanted = {
            name: np.asarray(root.actInv(state.effector_placement(name)[1])) for name in self.limbs
        }
        ends = [limb for limb in limbs if not is_further(body, limb)] or limbs
        self.reach = float(np.mean([known[limb.name].hull[1] for limb in ends]))
        steps = np.linspace(-2.0, 2.0, 33) * ROOM * self.reach
        grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        self._grid = grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")]

    def wanted(self, effector: str, root: FloatArray) -> FloatArray:
        """(3,) where an effector should be in a body whose root has a (7,) pose [m]."""
        return np.asarray(pin.XYZQUATToSE3(root).act(self._wanted[effector]))

    def find(
        self, effector: str, q: FloatArray, root: FloatArray, direction: FloatArray, most: int
    ) -> list[GeneratedContact]:
        """Contacts of one limb, the best first; one answer without a contact where there is none.

        Args:
            effector: Effector of the limb.
            q: (nq,) the body; all but the limb stays as it is.
            root: (7,) pose of the root at which the limb should be where it should be.
            direction: (3,) where the scene shall push the limb.
            most: Largest number of contacts.
        """
        limb = self.limbs[effector]
        kind = self._kinds[limb.name]
        place = self.wanted(effector, root)
        edges = self._edges if kind is ContactKind.GRASP else None
        heuristic = Near((place[0], place[1], place[2]), ROOM * self.reach, Efort(), edges)
        answers = self._generators[kind].request_several(
            q, limb.name, Task(direction), heuristic, kind=kind, most=most, apart=0.07 * self.reach
        )
        near = [item for item in answers if item.contact is not None and item.score > 1.0 - FAR]
        if len(near) < most and kind is not ContactKind.GRASP:
            near += self._nearest(limb, kind, q, place, heading_of(root), near)
        if near or not answers[0].found:
            return near or answers
        message = f"nothing for {limb.name} near {np.round(place, 2).tolist()} m"
        return [replace(answers[0], contact=None, q=None, failure=Hindrance.SURFACE, message=message)]

    def _nearest(
        self, limb: Limb, kind: ContactKind, q: FloatArray, wanted: FloatArray, heading: float,
        others: list[GeneratedContact],
    ) -> list[GeneratedContact]:  # fmt: skip
        """Places nearest to the wanted one, whether or not the limb alone can get there.

        The generator moves the limb alone; the whole body can often reach what it cannot.
        """
        points = footprint(self._body, limb, kind, self._rules)
        if kind is ContactKind.SOLE and self._rules.patch is not None and limb.patch is None:
            # The tip of the toes keeps off what stands behind the hold.
            toes = 0.5 * (self._body.sole_length or 0.0) + TOE_ROOM
            points = np.column_stack(
                [np.where(points[:, 0] > points[:, 0].mean(), toes, points[:, 0]), points[:, 1:]]
            )
        outward = float(np.sign(self._wanted[limb.effector][1])) * TURN_OUT
        offers: list[tuple[float, GeneratedContact]] = []
        taken = [item.contact.position for item in others if item.contact is not None]
        for surface in self._level:
            for turn in (0.0, outward) if kind is ContactKind.SOLE else (0.0,):
                rotation = onto_normal(rotation_from_yaw(heading + turn), surface.normal)
                spot = self._spot(surface, wanted, points @ rotation.T)
                if spot is None or any(np.linalg.norm(spot - other) < 0.07 * self.reach for other in taken):
                    continue
                contact = make_contact(self._body, limb, kind, spot, rotation, self._rules)
                score = -float(np.linalg.norm(spot - wanted)) / (ROOM * self.reach)
                item = GeneratedContact(limb.name, contact, q, surface.obstacles, score, 0, 0)
                offers.append((-score + (0.1 if turn else 0.0), item))
        return [item for cost, item in sorted(offers, key=lambda pair: pair[0])[:NEAREST] if cost < 2.0]

    def _spot(self, surface: Surface, wanted: FloatArray, corners: FloatArray) -> FloatArray | None:
        """(3,) place on a surface nearest to a wanted one, corners (c, 3) about it inside, or None."""
        normal = surface.normal
        flat = wanted - ((wanted - surface.polygon[0]) @ normal) * normal
        if np.linalg.norm(flat - wanted) > 2.0 * ROOM * self.reach:
            return None
        places = flat + self._grid @ surface.rotation[:, :2].T
        outside = surface.outside((places[:, None] + corners).reshape(-1, 3)).reshape(len(places), -1)
        inside = places[(outside <= 0.0).all(axis=1)]
        return inside[0] if len(inside) else None


INSET = 0.06
"""Distance of tips to the edges of what they stand on, by their reach: shanks lean; our choice."""

SPACING = 0.1
"""Distance of neighbouring places of a limb, by its reach; our choice."""


def limb_holds(
    body: BodyModel, scene: Scene, limbs: Sequence[Limb], kinds: Mapping[str, ContactKind],
    rules: ContactRules, reference: FloatArray, samples: Mapping[str, LimbSamples],
    ends: FloatArray,
) -> list[LimbHolds]:  # fmt: skip
    """Places of limbs around a start and a goal, on what is level.

    Args:
        kinds: How each touches, by name of the limb.
        reference: (nq,) posture in which every limb is where it should be relative to the root.
        ends: (2, 7) poses of the root at start and goal.
    """
    state, root = Configuration(body, reference), pin.XYZQUATToSE3(reference[:7])
    size = float(np.mean([samples[limb.name].hull[1] for limb in limbs]))
    turn = rotation_from_yaw(heading_of(ends[1]))
    low, high = ends[:, :3].min(axis=0) - 2.0 * size, ends[:, :3].max(axis=0) + 2.0 * size
    surfaces = [
        item
        for item in scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        if (item.polygon.min(axis=0) <= high).all() and (item.polygon.max(axis=0) >= low).all()
    ]
    known: dict[tuple[ContactKind, bytes], tuple[FloatArray, list[FloatArray]]] = {}
    found: list[LimbHolds] = []
    for limb in limbs:
        kind, reach = kinds[limb.name], samples[limb.name].reach
        points = footprint(body, limb, kind, rules) if kind is ContactKind.SOLE else INSET * size * _SQUARE
        key = kind, points.tobytes()
        if key not in known:
            known[key] = _grid_places(surfaces, points, turn, (low, high), SPACING * size)
        places, turns = known[key]
        there = root.actInv(pin.SE3(*state.segment_placement(reach.segment)))
        wanted = np.asarray(root.actInv(state.effector_placement(limb.effector)[1]))
        found.append(LimbHolds(
            limb.effector, places, partial(_contact_at, body, limb, kind, rules, places, turns),
            partial(_has_room, scene, size, places, turns), reach,
            (there.rotation, there.translation), wanted,
        ))  # fmt: skip
    return found


def _contact_at(
    body: BodyModel, limb: Limb, kind: ContactKind, rules: ContactRules, places: FloatArray,
    turns: Sequence[FloatArray], row: int,
) -> Contact:  # fmt: skip
    return make_contact(body, limb, kind, places[row], turns[row], rules)


def _has_room(scene: Scene, size: float, places: FloatArray, turns: Sequence[FloatArray], row: int) -> bool:
    """Whether a ball just above a place is free."""
    return scene.nearest(places[row] + 0.06 * size * turns[row][:, 2])[1] > 0.035 * size


_SQUARE = np.array([[1.0, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])


def _steps_of(half: FloatArray, spacing: float) -> list[tuple[int, float]]:
    """Number of steps each way, and their length [m]: at least two on what is small."""
    gaps = np.minimum(spacing, 0.5 * half)
    return [(int(np.ceil(extent / gap)), float(gap)) for extent, gap in zip(half, gaps, strict=True)]


def _grid_places(
    surfaces: Sequence[Surface], points: FloatArray, turn: FloatArray,
    box: tuple[FloatArray, FloatArray], spacing: float,
) -> tuple[FloatArray, list[FloatArray]]:  # fmt: skip
    """Places (m, 3) [m] with rotations (3, 3) of contacts of one shape on a grid."""
    low, high = box
    places: list[FloatArray] = []
    turns: list[FloatArray] = []
    for surface in surfaces:
        corners = np.clip(surface.polygon, low - 1.0, high + 1.0)
        middle, axes = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), surface.rotation[:, :2]
        half = np.abs((corners - middle) @ axes).max(axis=0)
        steps = [np.arange(-n, n + 1) * gap for n, gap in _steps_of(half, spacing)]
        grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        middle = middle - ((middle - surface.polygon[0]) @ surface.normal) * surface.normal
        at = middle + grid @ axes.T
        at = at[((at >= low) & (at <= high)).all(axis=1)]
        rotation = onto_normal(turn, surface.normal)
        outside = surface.outside((at[:, None] + points @ rotation.T).reshape(-1, 3)).reshape(len(at), -1)
        on = (outside <= 0.0).all(axis=1)
        places += list(at[on])
        turns += [rotation] * int(on.sum())
    return np.array(places).reshape(-1, 3), turns
