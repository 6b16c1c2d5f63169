"""A few postures of a person's trunk and arms, and which of them are free of a scene at many places.

A search for footsteps asks at every step how the body can be there: upright with hanging arms, with the arms
close, with the trunk turned against the feet, or folded under something low.  The postures are found once
for each body by the posture generator, between two walls and under a ceiling that come nearer.  Sideways is
no posture of its own: it is a heading of feet and trunk across the way.

What of the body counts is all above its hips and its arms; legs step over and between obstacles, and have
tests of their own.

Costs are those of one metre of way, relative to upright walking.  Stooping costs what eight miners used at
80 % and 60 % of their stature, 1.2 and 1.66 times the energy (Moss 1935, in Bedford and Warner, "The energy
expended while walking in stooping postures", Brit. J. Industr. Med. 12, 1955); a quadratic goes through both.
Arms close and a turned trunk are our choice.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import mirrored, of_both_sides
from manikin.errors import BodyError
from manikin.kinematics.fold import level_feet
from manikin.kinematics.posture_problem import PostureProblem, com_target, touching_pairs
from manikin.kinematics.posture_search import SolverSettings, generate_posture
from manikin.numerics.spatial import FloatArray, frozen_array, rotation_from_yaw, turned_root
from manikin.scene import Box, Obstacle, Proximity, Scene
from manikin.scene.collision import Meter, collision_parts, local_box, part_meter, shape_of
from manikin.scene.covering import cover
from manikin.scene.scene import FLOOR

CEILINGS = (0.92, 0.84, 0.76, 0.68, 0.61, 0.55)  # over a folded body [statures]; a duck-walk is the last
RECORDED_COM = ((0.55, 0.63, 0.743, 0.83, 1.0), (0.31, 0.371, 0.457, 0.486, 0.56))
"""Ceilings and the heights of the CoM below them [statures] of people who pass beams of 1.10, 1.30 and 1.45 m
([Qiu2012]_ 3.2.3, taken for 1.75 m); the lowest is extrapolated."""

SKIN = 0.02  # distance of a posture to the walls and ceilings between which it is found [m]
ARMS_CLOSE_COST = 1.05
TURNED_COST = 1.3  # costs of arms held close and of a trunk turned against the feet; our choice
_WALL = 1.0  # thickness of the walls [m]
_SETTINGS = SolverSettings(tolerance=1e-4, clearance_tolerance=1e-3, restarts=False, explain=False)
_ARMS_CLOSE = {"shoulder_flexion": 0.35, "shoulder_abduction": 0.1, "elbow_flexion": 1.6,
               "shoulder_rotation": 0.9}  # fmt: skip
_TURNED = {"lumbar_rotation": 0.15, "thorax_rotation": 0.55, "left_hip_rotation": 0.45,
           "right_hip_rotation": -0.45}  # fmt: skip
_TURNED_YAW = 0.4


@dataclass(frozen=True, eq=False)
class TrunkPosture:
    """One posture of the trunk and arms.

    Attributes:
        name: What it is.
        q: (nq,) posture on feet about the origin of a level floor at z = 0, toes along x.
        cost: Cost of a metre of way in it, relative to upright walking.
        height: Height of its highest point above the ground [m].
        shapes: Shapes that count, of Coal.
        rotations: (n, 3, 3) shape to floor.
        translations: (n, 3) centres of the shapes [m].
    """

    name: str
    q: FloatArray
    cost: float
    height: float
    shapes: tuple[coal.CollisionGeometry, ...]
    rotations: FloatArray
    translations: FloatArray

    def at(self, place: FloatArray) -> FloatArray:
        """(nq,) the posture at a place (4,): x, y and height of the ground [m], heading of the feet [rad]."""
        out = turned_root(self.q, float(place[3]))
        out[:3] = rotation_from_yaw(float(place[3])) @ self.q[:3] + place[:3]
        return out

    @classmethod
    def of(cls, name: str, body: BodyModel, q: FloatArray, cost: float) -> "TrunkPosture":
        """Take the shapes of a body in a posture."""
        shapes, rotations, translations = _shapes_of_trunk(body, q)
        reach = [_half_extent(shape, turn) for shape, turn in zip(shapes, rotations, strict=True)]
        top = float((translations + reach).max(axis=0)[2])
        placed = frozen_array(rotations, "rotations"), frozen_array(translations, "translations [m]")
        return cls(name, frozen_array(q, "trunk posture"), cost, top, shapes, *placed)


class TrunkPostures:
    """The postures of one body, the cheapest first: upright, and further ones, found when they are asked for.

    Most places are free upright, and the further ones take longer to find than many a way.
    """

    def __init__(self, body: BodyModel) -> None:
        self._body = body
        self.upright = TrunkPosture.of("upright", body, body.standing_posture(), 1.0)

    @staticmethod
    @lru_cache(maxsize=64)
    def of(body: BodyModel) -> "TrunkPostures":
        """The postures of a person; kept by the body's identity.

        Raises:
            BodyError: If the body has no stature or no soles.
        """
        if body.stature is None or body.sole_length is None:
            raise BodyError(f"body {body.name!r} has no stature or soles; valid: a human body")
        return TrunkPostures(body)

    @cached_property
    def _all(self) -> tuple[TrunkPosture, ...]:
        narrow = list(_narrow(self._body))
        folded = _folded(self._body, narrow[0].q if narrow else self.upright.q)
        return self.upright, *sorted([*narrow, *folded], key=lambda item: item.cost)

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[TrunkPosture]:
        return iter(self._all)

    def __getitem__(self, row: int) -> TrunkPosture:
        return self._all[row] if row else self.upright

    @property
    def costs(self) -> FloatArray:
        """(m,) cost of each posture."""
        return np.array([item.cost for item in self])


def _narrow(body: BodyModel) -> Iterator[TrunkPosture]:
    """Arms close, and the trunk turned to either side as well."""
    close = _with(body, body.standing_posture(), _ARMS_CLOSE)
    arm = body.segment("left_upper_arm")
    width = 2.0 * float(arm.origin[1] + max(shape.size[0] for shape in arm.shapes)) + 2.0 * SKIN + 0.01
    found = _between(body, close, width=width)
    if found is None:
        return
    yield TrunkPosture.of("arms close", body, found, ARMS_CLOSE_COST)
    turned = _with(body, found, _TURNED)
    turned[3:7] = (0.0, 0.0, np.sin(0.5 * _TURNED_YAW), np.cos(0.5 * _TURNED_YAW))
    for narrower in (0.80, 0.85, 0.90):
        left = _between(body, turned, width=narrower * width)
        if left is not None:
            yield TrunkPosture.of("turned left", body, left, TURNED_COST)
            yield TrunkPosture.of("turned right", body, mirrored(body, left), TURNED_COST)
            return


def _folded(body: BodyModel, q: FloatArray) -> Iterator[TrunkPosture]:
    """Folded under ceilings with the arms close, each from the one before."""
    assert body.stature is not None
    for share in CEILINGS:
        height, com = share * body.stature, float(np.interp(share, *RECORDED_COM)) * body.stature
        found = _between(body, q, height=height, reference=q, com_height=com)
        if found is None:
            found = _between(body, q, height=height, reference=q, restarts=True)
        if found is None:
            return
        q, lost = found, 1.0 - share
        cost = 1.0 + 0.35 * lost + 3.25 * lost**2  # see the module
        yield TrunkPosture.of(f"bent to {round(100 * share)} % of stature", body, q, cost)


def _between(
    body: BodyModel, start: FloatArray, *, width: float | None = None, height: float | None = None,
    reference: FloatArray | None = None, com_height: float | None = None, restarts: bool = False,
) -> FloatArray | None:  # fmt: skip
    """(nq,) posture on two feet between walls ``width`` apart or under a ceiling [m], or None."""
    solids = []
    if width is not None:
        solids += [
            Obstacle(name, Box((4.0, _WALL, 8.0)), translation=(0.0, sign * 0.5 * (width + _WALL), 0.0))
            for name, sign in (("left", 1.0), ("right", -1.0))
        ]
    if height is not None:
        solids.append(Obstacle("top", Box((4.0, 4.0, _WALL)), translation=(0.0, 0.0, height + 0.5 * _WALL)))
    feet = level_feet(body)
    problem = PostureProblem(
        body, feet, com=com_target(0.0, 0.0, com_height), clearance=SKIN, self_clearance=0.014,
        proximity=Proximity(body, Scene(solids)), reference=reference, range_margin=0.05,
        ignore=touching_pairs(body, [(contact.effector, FLOOR) for contact in feet]),
    )  # fmt: skip
    result = generate_posture(problem, start, settings=replace(_SETTINGS, restarts=restarts))
    return result.q if result.succeeded else None


def _with(body: BodyModel, q: FloatArray, angles: dict[str, float]) -> FloatArray:
    """A posture with hinges at angles [rad], of both sides where the name has none."""
    out = np.array(q)
    for name, angle in of_both_sides(body, angles).items():
        out[7 + body.joint_index(name)] = angle
    return out


_LEG_PARTS = ("thigh", "leg", "foot", "toes")


def _shapes_of_trunk(
    body: BodyModel, q: FloatArray
) -> tuple[tuple[coal.CollisionGeometry, ...], FloatArray, FloatArray]:
    """Coal shapes of all but the legs, with rotations (n, 3, 3) and centres (n, 3) [m] in the world."""
    data, geometry = body.pinocchio.createData(), pin.GeometryData(body.geometry)
    pin.updateGeometryPlacements(body.pinocchio, data, body.geometry, geometry, np.asarray(q))
    rows = [
        row for row, item in enumerate(body.geometry.geometryObjects)
        if not item.name.split("/")[0].endswith(_LEG_PARTS)
    ]  # fmt: skip
    shapes = tuple(body.geometry.geometryObjects[row].geometry for row in rows)
    placed = [geometry.oMg[row] for row in rows]
    return shapes, np.array([m.rotation for m in placed]), np.array([m.translation for m in placed])


def _half_extent(shape: coal.CollisionGeometry, rotation: FloatArray) -> FloatArray:
    """(3,) half size of the axis-aligned box around a turned shape [m]."""
    if isinstance(shape, coal.Capsule):
        return float(shape.radius) + float(shape.halfLength) * np.abs(rotation[:, 2])
    if isinstance(shape, coal.Sphere):
        return np.full(3, float(shape.radius))
    low, high = local_box(shape)
    return np.abs(rotation) @ (0.5 * (high - low))


STANDING = 0.1  # way that standing at a place counts as, at least [m]; our choice
CHANGING = 0.3  # way at the cost of a change of posture in which body parts move 1 m; our choice [m]
BALLS = 4  # balls that cover each shape in the quick test
_TOGETHER = 32  # places that are tested at once: keeps temporary arrays in the cache


class TrunkClearance:
    """Which trunk postures are free of a scene at places; use one instance per thread.

    Attributes:
        postures: The postures, in the order of the answers.
        margin: Distance that they keep to the scene [m].
    """

    def __init__(self, postures: TrunkPostures, scene: Scene, margin: float = 0.015) -> None:
        self.postures, self.margin = postures, margin
        self._scene, self._upright = scene, _Clearance((postures.upright,), scene, margin)

    @cached_property
    def _any(self) -> "_Clearance":
        return _Clearance(tuple(self.postures), self._scene, self.margin)

    def free(self, places: FloatArray) -> NDArray[np.bool_]:
        """(k, m) whether each posture is free at each of (k, 4) places.

        They are x, y and height of the ground between the feet [m], and the heading of the feet [rad].
        """
        return self._any.free(places)

    def cheapest(self, places: FloatArray) -> NDArray[np.int64]:
        """(k,) index of the cheapest free posture at each place, -1 where there is none."""
        upright = self._upright.free(places)[:, 0]
        numbers, rest = np.zeros(len(upright), dtype=np.int64), np.flatnonzero(~upright)
        if len(rest):
            free = self.free(places[rest])
            numbers[rest] = np.where(free.any(axis=1), np.argmax(free, axis=1), -1)
        return numbers

    def along(self, places: FloatArray) -> NDArray[np.int64] | None:
        """(k,) postures at places (k, 4) one after the other that cost least together; None where none pass.

        The ends are in the cheapest one that is free there.  A posture costs what it does over the way to its
        neighbours, a change a share of the way that the body's parts move in it.  A change is made at one of
        its two places, where both postures and all of a height in between have to be free.
        """
        if self._upright.free(places).all():
            return np.zeros(len(places), dtype=np.int64)
        free, costs = self.free(places), self.postures.costs - 1.0
        ways = np.maximum(np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1), STANDING)
        share = np.append(ways, STANDING) + np.insert(ways, 0, STANDING)
        ends = self.cheapest(places[[0, -1]])
        total = np.where(np.arange(len(costs)) == ends[0], 0.0, np.inf)
        came_from: list[NDArray[np.int64]] = []
        for number in range(1, len(places)):
            after = free[number]
            possible = self._changeable(free[number - 1]) | self._changeable(after)
            through = np.where(possible, total[:, None] + CHANGING * self._changes, np.inf)
            came_from.append(np.argmin(through, axis=0))
            total = np.where(after, through.min(axis=0) + 0.5 * share[number] * costs, np.inf)
        if min(ends) < 0 or not np.isfinite(total[ends[1]]):
            return None
        chosen = [int(ends[1])]
        for back in reversed(came_from):
            chosen.append(int(back[chosen[-1]]))
        return np.array(chosen[::-1])

    def _changeable(self, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(m, m) which postures change into which where (m,) of them are free; all into themselves."""
        hindered = np.einsum("prb,b->pr", self._between, ~free)
        return (free[:, None] & free[None, :] & ~hindered) | np.eye(len(free), dtype=bool)

    @cached_property
    def _between(self) -> NDArray[np.bool_]:
        """(m, m, m) whether a height is between those of two postures."""
        height = np.array([item.height for item in self.postures])
        low, high = np.minimum(height[:, None], height), np.maximum(height[:, None], height)
        return (height > low[..., None] + SKIN) & (height < high[..., None] - SKIN)

    @cached_property
    def _changes(self) -> FloatArray:
        """(m, m) mean way of the parts of the body from one posture to another [m]."""
        middles = np.array([item.translations for item in self.postures])
        return np.linalg.norm(middles[:, None] - middles[None, :], axis=3).mean(axis=2)


class _Clearance:
    """Which of some postures are free of a scene at places.

    A quick test of balls around the shapes against the boxes around the obstacles' parts decides most pairs;
    Coal measures the rest exactly.  Answers are kept by place.
    """

    def __init__(self, postures: Sequence[TrunkPosture], scene: Scene, margin: float) -> None:
        self.postures, self.margin = postures, margin
        self._parts = parts = tuple(part for item in scene for part in collision_parts(item))
        self._placed = [coal.Transform3s(part.rotation, part.translation) for part in parts]
        self._axes = np.array([part.rotation for part in parts]).reshape(-1, 3, 3)
        origins = np.array([part.rotation.T @ part.translation for part in parts]).reshape(-1, 3)
        self._low = np.array([part.low for part in parts]).reshape(-1, 3) + origins
        self._high = np.array([part.high for part in parts]).reshape(-1, 3) + origins
        fills = [isinstance(part.geometry, (coal.Box, coal.Halfspace)) for part in parts]
        self._solid = np.array(fills, dtype=bool)  # which are all of the box around them
        shapes = [(row, n) for row, item in enumerate(postures) for n in range(len(item.shapes))]
        self._shapes = np.array(shapes, dtype=np.int64)
        self._meters: dict[tuple[int, int], Meter] = {}
        centres, outer, inner = zip(*(_balls(postures[p], n) for p, n in shapes), strict=True)
        self._centres = np.array(centres)  # (shapes, balls, 3)
        self._outer, self._inner = np.array(outer), np.array(inner)  # (shapes,) [m]
        self._middles = self._centres.mean(axis=1)
        apart = np.linalg.norm(self._centres - self._middles[:, None], axis=2).max(axis=1)
        self._around = apart + self._outer
        out = float((np.linalg.norm(self._middles[:, :2], axis=1) + self._around).max()) + margin
        top = float((self._middles[:, 2] + self._around).max()) + margin
        bottom = float((self._middles[:, 2] - self._around).min()) - margin
        self._middle = np.array([0.0, 0.0, 0.5 * (top + bottom)])
        self._reach = np.array([out, out, 0.5 * (top - bottom)])
        self._known: dict[bytes, NDArray[np.bool_]] = {}

    def free(self, places: FloatArray) -> NDArray[np.bool_]:
        """(k, m) whether each posture is free at each of (k, 4) places."""
        rows = np.ascontiguousarray(places, dtype=np.float64).reshape(-1, 4)
        keys = [row.tobytes() for row in rows]
        new = [number for number, key in enumerate(keys) if key not in self._known]
        if new:
            for number, answer in zip(new, self._free(rows[new]), strict=True):
                self._known[keys[number]] = answer
        return np.array([self._known[key] for key in keys]).reshape(-1, len(self.postures))

    def _free(self, places: FloatArray) -> NDArray[np.bool_]:
        free, near = np.ones((len(places), len(self.postures)), dtype=bool), self._near(places)
        for first in range(0, len(places) if len(near) else 0, _TOGETHER):
            some = slice(first, first + _TOGETHER)
            self._block(places[some], near, free[some])
        return free

    def _block(self, places: FloatArray, near: NDArray[np.int64], free: NDArray[np.bool_]) -> None:
        """Clear the postures that meet one of some parts."""
        turns = _turns(places[:, 3])
        middles = np.swapaxes(turns @ self._middles.T, 1, 2) + places[:, None, :3]
        coarse = self._gaps(middles[:, :, None], near[None, None, :]) - self._around[:, None]
        place, shape, column = np.nonzero(coarse < self.margin)
        part, posture = near[column], self._shapes[shape, 0]
        centres = np.einsum("nij,nbj->nbi", turns[place], self._centres[shape]) + places[place, None, :3]
        nearest = self._gaps(centres, part[:, None]).min(axis=1)
        hit = self._solid[part] & (nearest - self._inner[shape] < self.margin)
        free[place[hit], posture[hit]] = False
        doubtful = (nearest - self._outer[shape] < self.margin) & free[place, posture]
        for row in np.flatnonzero(doubtful).tolist():
            k = int(place[row])
            if free[k, posture[row]] and self._meets(places[k], turns[k], int(shape[row]), int(part[row])):
                free[k, posture[row]] = False

    def _near(self, places: FloatArray) -> NDArray[np.int64]:
        """Parts whose box comes near the postures at any of the places."""
        low, high = places[:, :3].min(axis=0), places[:, :3].max(axis=0)
        middle = 0.5 * (low + high) + self._middle
        half = 0.5 * (high - low) + self._reach
        local = np.einsum("pji,j->pi", self._axes, middle)
        spread = np.einsum("pji,j->pi", np.abs(self._axes), half)
        apart = np.maximum(self._low - local, local - self._high) - spread
        return np.flatnonzero((apart <= 0.0).all(axis=1))

    def _gaps(self, points: FloatArray, part: NDArray[np.int64]) -> FloatArray:
        """Distance of points (..., 3) to the boxes around parts (...), negative inside [m]."""
        local = np.einsum("...i,...ij->...j", points, self._axes[part])
        beyond = np.maximum(self._low[part] - local, local - self._high[part])
        outside = np.maximum(beyond, 0.0)
        return np.sqrt(np.einsum("...i,...i->...", outside, outside)) + np.minimum(beyond.max(axis=-1), 0.0)

    def _meets(self, place: FloatArray, turn: FloatArray, row: int, part: int) -> bool:
        """Whether a shape is nearer to a part than the margin, measured by Coal."""
        posture, number = self._shapes[row].tolist()
        item = self.postures[posture]
        if (row, part) not in self._meters:
            self._meters[row, part] = part_meter(item.shapes[number], self._parts[part])
        where = coal.Transform3s(turn @ item.rotations[number], turn @ item.translations[number] + place[:3])
        return self._meters[row, part](where, self._placed[part], self.margin)[0] < self.margin


def _turns(headings: FloatArray) -> FloatArray:
    """(k, 3, 3) turns about the vertical."""
    out = np.zeros((len(headings), 3, 3))
    cosine, sine = np.cos(headings), np.sin(headings)
    out[:, 0, 0], out[:, 0, 1], out[:, 1, 0], out[:, 1, 1] = cosine, -sine, sine, cosine
    out[:, 2, 2] = 1.0
    return out


def _balls(posture: TrunkPosture, number: int) -> tuple[FloatArray, float, float]:
    """Balls of one shape: centres (BALLS, 3) on the floor's axes [m], radius that covers, one inside it."""
    solid, centre = shape_of(posture.shapes[number])
    balls = cover(solid, count=BALLS)
    rows = np.arange(BALLS) % len(balls)
    inside = float(0.5 * solid.size.min()) if isinstance(solid, Box) else float(getattr(solid, "radius", 0.0))
    local = (balls.centres[rows] + centre) @ posture.rotations[number].T + posture.translations[number]
    return local, float(balls.radii.max()), inside
