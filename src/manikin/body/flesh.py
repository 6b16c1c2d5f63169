"""Flesh and clothes of a human: sections along the limbs and the trunk, blended to one implicit surface.

A part of the flesh is a :class:`Loft`: elliptic sections at stations along an axis, rounded off at both
ends. The parts of a body are joined by a smooth union, the logarithm of a sum of exponentials, which does not
depend on their order. Lengths between joints come from the body's segments, so joints lie where the body has
them; depths and breadths are our choice for a clothed man of 1.75 m and 79 kg and a woman of 1.63 m and 62
kg, round numbers near the means of large surveys. They scale with the stature, and by one factor of thickness
that is found so that the volume is that of the body's mass; head, hands and feet follow it less than the
waist.

Density of a body: 0.69 + 0.9 c kg/l of the ponderal index c = stature / mass^(1/3) in m/kg^(1/3), Drillis and
Contini (1966) as reprinted in Winter, "Biomechanics and Motor Control of Human Movement", 4th ed. 2009,
4.1.1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from manikin.body.anthropometry import ANKLE_FROM_HEEL, TOE_HINGE_FROM_HEEL
from manikin.body.model import BodyModel
from manikin.numerics.spatial import FloatArray, rotation_from_rpy

ARM_SPREAD, LEG_SPREAD = np.deg2rad(42.0), np.deg2rad(9.0)
"""How far arms and legs are spread in the posture in which the surface is made [rad]."""
FAR = 0.30
"""Distance to all flesh that is farther away than a loft's margin [m]."""
_FINE = 40


class Material(StrEnum):
    """What a part of the surface is made of."""

    SKIN = "skin"
    HAIR = "hair"
    SHIRT = "shirt"
    TROUSERS = "trousers"
    SHOES = "shoes"


MATERIALS = tuple(Material)
_BLEND = {"trunk": 0.012, "head": 0.006, "left_hand": 0.0025, "right_hand": 0.0025, "left_shoe": 0.006,
          "right_shoe": 0.006}  # fmt: skip
_JOIN = 0.006


def body_density(stature: float, mass: float) -> float:
    """Mean density of a body of a stature [m] and a mass [kg], in kg/m^3."""
    return 1000.0 * (0.69 + 0.9 * stature / mass ** (1.0 / 3.0))


@dataclass(frozen=True, eq=False)
class FleshFrame:
    """Rotation (3, 3) and origin (3,) [m] of a segment's frame in the posture of the surface."""

    rotation: FloatArray
    origin: FloatArray


def spread_posture(body: BodyModel) -> dict[str, FleshFrame]:
    """Frames of the segments with arms and legs spread, the root's frame being that of the surface."""
    placements: dict[str, FleshFrame] = {}
    spread = {"upper_arm": ARM_SPREAD, "thigh": LEG_SPREAD}
    for segment in body.segments:
        if segment.parent is None:
            placements[segment.name] = FleshFrame(np.eye(3), np.zeros(3))
            continue
        side, _, part = segment.name.partition("_")
        sign = {"left": 1.0, "right": -1.0}.get(side, 0.0)
        turn = rotation_from_rpy(sign * spread.get(part, 0.0), 0.0, 0.0)
        base = placements[segment.parent]
        origin = base.origin + base.rotation @ segment.origin
        placements[segment.name] = FleshFrame(base.rotation @ turn, origin)
    return placements


@dataclass(frozen=True, eq=False)
class Loft:
    """Elliptic sections along a straight axis, in the frame of a segment.

    Attributes:
        segment: Name of the segment.
        group: Parts of a group are blended first.
        material: Of its surface.
        start: (3,) of the axis [m].
        axis: (3,) to its end [m].
        sides: (2, 3) unit directions of the two half widths, orthogonal to the axis.
        stations: (k,) along the axis, 0 to 1.
        halves: (k, 2) half widths [m].
        shifts: (k, 2) centres beside the axis [m].
        power: Of the superellipse, 2 for an ellipse.
        caps: Height of the rounded ends per their mean half width.
    """

    segment: str
    group: str
    material: Material
    start: FloatArray
    axis: FloatArray
    sides: FloatArray
    stations: FloatArray
    halves: FloatArray
    shifts: FloatArray
    power: float = 2.0
    caps: float = 1.0

    @cached_property
    def _fine(self) -> tuple[FloatArray, FloatArray]:
        where = np.linspace(0.0, 1.0, _FINE)
        values = np.hstack([self.halves, self.shifts])
        if len(self.stations) == 1:
            return where, np.repeat(values, _FINE, axis=0)
        return where, PchipInterpolator(self.stations, values)(where)

    @cached_property
    def ball(self) -> tuple[FloatArray, float]:
        """Centre (3,) and radius of a ball around it, in the segment's frame [m]."""
        _, values = self._fine
        thickest = float((np.abs(values[:, 2:]) + values[:, :2]).max()) * 1.2
        return self.start + 0.5 * self.axis, 0.5 * float(np.linalg.norm(self.axis)) + thickest

    def distance(self, points: FloatArray) -> FloatArray:
        """(n,) distance of points (n, 3) of the segment's frame, to first order near the surface [m]."""
        away = points - self.start
        length = float(np.linalg.norm(self.axis))
        along = away @ (self.axis / length)
        share = np.clip(along / length, 0.0, 1.0)
        where, values = self._fine
        half_a, half_b, shift_a, shift_b = (np.interp(share, where, column) for column in values.T)
        a, b = away @ self.sides[0] - shift_a, away @ self.sides[1] - shift_b
        beyond, cap = along - share * length, self.caps * 0.5 * (half_a + half_b)
        p = self.power
        ratios = np.abs(np.stack([a / half_a, b / half_b, beyond / cap]))
        norm = np.maximum((ratios**p).sum(axis=0) ** (1.0 / p), 1e-3)
        slopes = (ratios / norm) ** (p - 1.0) / np.stack([half_a, half_b, cap])
        return (norm - 1.0) / np.sqrt((slopes**2).sum(axis=0))

    def mirrored(self) -> "Loft":
        """The same on the right side."""
        flip = np.array([1.0, -1.0, 1.0])
        segment, group = (name.replace("left", "right") for name in (self.segment, self.group))
        return replace(
            self, segment=segment, group=group, start=self.start * flip, axis=self.axis * flip,
            sides=self.sides * flip,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances of n points to the flesh [m].

    Attributes:
        whole: (n,) to the blended surface, negative inside.
        segments: (n, s) to the flesh of each segment.
        materials: (n, m) to the parts of each of :data:`MATERIALS`.
    """

    whole: FloatArray
    segments: FloatArray
    materials: FloatArray


class Flesh:
    """Implicit surface of a human in the spread posture.

    Attributes:
        placements: Frames of the segments by name.
        names: Of the segments.
    """

    def __init__(self, body: BodyModel, thickness: float) -> None:
        """Place the flesh of a body with the 19 segments of :func:`manikin.body.human`."""
        self.names = tuple(segment.name for segment in body.segments)
        self.placements = spread_posture(body)
        self._scale = float(body.stature or 1.75) / 1.75
        self._joints = {name: place.origin for name, place in self.placements.items()}
        left = _Sections(body, thickness).lofts()
        pairs = [loft.mirrored() for loft in left if loft.segment.startswith("left") or loft.start[1] > 0.01]
        self.lofts = (*left, *pairs)
        self._soles = {
            f"{side}_shoe": (self.placements[f"{side}_foot"], body.effector(f"{side}_foot").translation[2])
            for side in ("left", "right")
        }
        self._trunk = [self._joints[name][2] for name in ("lumbar", "thorax", "neck")]
        self._belt = 0.55 * self._trunk[0]

    def distances(self, points: FloatArray, margin: float = 0.07, *, parts: bool = False) -> Distances:
        """Distances of points (n, 3) of the root's frame [m]; of ``parts`` as well if wanted."""
        count = len(points)
        sums = {group: np.zeros(count) for group in _BLEND}
        segments = np.full((count, len(self.names)), FAR)
        materials = np.full((count, len(MATERIALS)), FAR)
        low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
        for loft in self.lofts:
            place = self.placements[loft.segment]
            centre, radius = loft.ball
            centre = place.origin + place.rotation @ centre
            if np.any(centre + radius < low) or np.any(centre - radius > high):
                continue
            offset = points - centre
            near = np.flatnonzero(np.einsum("ij,ij->i", offset, offset) < (radius + margin) ** 2)
            if not len(near):
                continue
            distance = loft.distance((points[near] - place.origin) @ place.rotation)
            sums[loft.group][near] += np.exp(-distance / (_BLEND[loft.group] * self._scale))
            if parts:
                self._note(loft, near, points[near], distance, segments, materials)
        return Distances(self._joined(points, sums), segments, materials)

    def _joined(self, points: FloatArray, sums: Mapping[str, FloatArray]) -> FloatArray:
        total, k = np.zeros(len(points)), _JOIN * self._scale
        for group, value in sums.items():
            near = np.flatnonzero(value > 1e-60)
            distance = -_BLEND[group] * self._scale * np.log(value[near])
            if group in self._soles:  # nothing of a shoe is below its sole
                place, height = self._soles[group]
                below = height - (points[near] - place.origin) @ place.rotation[:, 2]
                soft = 0.003 * self._scale
                distance = np.logaddexp(distance / soft, below / soft) * soft
            total[near] += np.exp(-np.clip(distance, -0.5, 0.5) / k)
        with np.errstate(divide="ignore"):
            return np.clip(-k * np.log(total), -FAR, FAR)

    def _note(
        self, loft: Loft, near: np.ndarray, points: FloatArray, distance: FloatArray, segments: FloatArray,
        materials: FloatArray,
    ) -> None:  # fmt: skip
        def lower(table: FloatArray, column: int, values: FloatArray) -> None:
            table[near, column] = np.minimum(table[near, column], values)

        if loft.group != "trunk" or loft.segment != "pelvis" or loft.power == 2.0:
            lower(segments, self.names.index(loft.segment), distance)
            lower(materials, MATERIALS.index(loft.material), distance)
            return
        # The trunk is one loft of three segments, a shirt above the belt and trousers below.
        height, ends = points[:, 2], (-np.inf, *self._trunk[:2], np.inf)
        for name, low, high in zip(("pelvis", "lumbar", "thorax"), ends[:-1], ends[1:], strict=True):
            outside = np.maximum(np.maximum(low - height, height - high), 0.0)
            lower(segments, self.names.index(name), distance + outside**2 / (0.22 * self._scale))
        belt = height - self._belt
        lower(materials, MATERIALS.index(Material.SHIRT), distance + np.maximum(-belt, 0.0))
        lower(materials, MATERIALS.index(Material.TROUSERS), distance + np.maximum(belt, 0.0))


_X, _Y, _Z = np.eye(3)
_ROUND: Mapping[str, float] = {"head": 0.1, "neck": 0.5, "trunk": 1.0, "waist": 1.25, "arm": 0.9,
                               "hand": 0.15, "leg": 0.95, "shank": 0.75, "foot": 0.0}  # fmt: skip
"""How much of the thickness each part follows."""


class _Sections:
    """The sections of the middle and the left side; numbers are metres at 1.75 m."""

    def __init__(self, body: BodyModel, thickness: float) -> None:
        self.body, self.thickness, self.size = body, thickness, float(body.stature or 1.75) / 1.75
        self.female = body.sex == "female"

    def lofts(self) -> list[Loft]:
        return [*self._trunk(), *self._head(), *self._arm(), *self._hand(), *self._leg(), *self._shoe()]

    def _fat(self, part: str) -> float:
        return self.size * (1.0 + _ROUND[part] * (self.thickness - 1.0))

    def _loft(
        self, segment: str, group: str, material: Material, part: str, ends: Sequence[ArrayLike],
        rows: Sequence[Sequence[float]], sides: tuple[FloatArray, FloatArray] = (_X, _Y), *,
        power: float = 2.0, caps: float = 1.0,
    ) -> Loft:  # fmt: skip
        """Sections of rows ``(station, half, half[, shift, shift])`` between two ends [m]."""
        start, end = (np.asarray(end, dtype=np.float64) for end in ends)
        axis = end - start
        if not np.any(axis):
            axis = 1e-4 * np.cross(*sides)
        first = sides[0] - axis * (sides[0] @ axis) / (axis @ axis)
        first /= np.linalg.norm(first)
        second = np.cross(axis, first)
        second *= np.sign(second @ sides[1]) / np.linalg.norm(second)
        table = np.array([[*row, 0.0, 0.0][:5] for row in rows])
        return Loft(
            segment, group, material, start, axis, np.array([first, second]), table[:, 0],
            self._fat(part) * table[:, 1:3], self.size * table[:, 3:5], power, caps,
        )  # fmt: skip

    def _ball(
        self, segment: str, group: str, material: Material, part: str, centre: Sequence[float],
        halves: Sequence[float],
    ) -> Loft:  # fmt: skip
        """Ellipsoid of half axes along x, y and z."""
        x, y, z = halves
        place = self.size * np.asarray(centre)
        return self._loft(
            segment, group, material, part, (place, place), [(0.0, x, y)], caps=2.0 * z / (x + y)
        )  # fmt: skip

    def _trunk(self) -> list[Loft]:
        body, woman = self.body, self.female
        lower, middle, upper = (body.segment(name).origin[2] for name in ("lumbar", "thorax", "neck"))
        marks = np.cumsum([0.0, lower, middle, upper])
        # Share of the way from mark to mark (hips, navel, xiphoid, C7), half depth, half breadth, forward.
        if woman:
            rows = [
                (-0.55, 0.085, 0.125, -0.012), (-0.10, 0.117, 0.183, -0.016), (0.35, 0.112, 0.177, -0.013),
                (1.0, 0.100, 0.150, -0.004), (1.4, 0.094, 0.134, -0.002), (2.0, 0.102, 0.143, 0.0),
                (2.3, 0.104, 0.150, -0.004), (2.60, 0.095, 0.148, -0.014), (2.78, 0.072, 0.122, -0.022),
                (2.90, 0.056, 0.080, -0.024), (3.0, 0.050, 0.056, -0.020),
            ]  # fmt: skip
        else:
            rows = [
                (-0.55, 0.085, 0.122, -0.012), (-0.10, 0.116, 0.170, -0.016), (0.35, 0.112, 0.168, -0.012),
                (1.0, 0.112, 0.156, -0.002), (1.4, 0.109, 0.152, 0.0), (2.0, 0.119, 0.164, 0.0),
                (2.3, 0.121, 0.172, -0.004), (2.60, 0.106, 0.168, -0.014), (2.78, 0.078, 0.138, -0.024),
                (2.90, 0.062, 0.088, -0.026), (3.0, 0.056, 0.060, -0.022),
            ]  # fmt: skip
        heights = [
            float(np.interp(row[0], range(4), marks)) if row[0] >= 0.0 else row[0] * lower for row in rows
        ]
        span = heights[-1] - heights[0]
        stations = [
            ((height - heights[0]) / span, *row[1:]) for height, row in zip(heights, rows, strict=True)
        ]
        ends = ((0.0, 0.0, heights[0]), (0.0, 0.0, heights[-1]))
        shoulder = body.segment("left_upper_arm").origin
        inner = np.array([-0.020 * self.size, 0.035 * self.size, shoulder[2] + 0.040 * self.size])
        outer = shoulder + self.size * np.array([-0.006, -0.015, 0.006])
        shirt, group = Material.SHIRT, "trunk"
        parts = [
            self._loft(
                "pelvis", group, Material.TROUSERS, "waist", ends, stations, power=2.3, caps=0.4
            ),
            self._loft("thorax", group, shirt, "arm", (inner, outer), [(0, 0.040, 0.036), (1, 0.042, 0.038)],
                       (_X, _Z)),
            self._ball("pelvis", group, Material.TROUSERS, "leg", (-0.060, 0.076, -0.030),
                       (0.072, 0.078, 0.086)),
        ]  # fmt: skip
        if not woman:
            return parts
        # The chest of a slim trunk lies farther back.
        deep, height = self._fat("trunk") / self.size, (shoulder[2] - 0.115 * self.size) / self.size
        chest, halves = (0.085 * deep, 0.080, height), (0.058, 0.064, 0.062)
        return [*parts, self._ball("thorax", group, shirt, "trunk", chest, halves)]

    def _head(self) -> list[Loft]:
        skin, hair, size = Material.SKIN, Material.HAIR, self.size
        neck = float(self.body.segment("head").origin[2])
        thick = 0.88 if self.female else 1.0
        parts = [
            self._loft("neck", "head", skin, "neck",
                       ((-0.020 * size, 0, -0.03 * size), (0, 0, neck + 0.02 * size)),
                       [(0, 0.064 * thick, 0.064 * thick), (0.5, 0.060 * thick, 0.059 * thick),
                        (1, 0.060 * thick, 0.056 * thick)]),
        ]  # fmt: skip
        top = float(self.body.effector("head").translation[2]) / size
        face: list[tuple[Material, Sequence[float], Sequence[float]]] = [
            (skin, (0.004, 0.0, top - 0.093), (0.096, 0.074, 0.088)),  # skull
            (skin, (0.073, 0.0, -0.050), (0.019, 0.021, 0.017)),  # chin
            (skin, (0.086, 0.022, 0.046), (0.010, 0.026, 0.010)),  # brow
            (skin, (0.066, 0.038, 0.004), (0.016, 0.018, 0.024)),  # cheek
            (skin, (0.084, 0.0, -0.017), (0.009, 0.021, 0.008)),  # lips
            (skin, (0.002, 0.076, 0.020), (0.017, 0.008, 0.030)),  # ear
            (hair, (-0.008, 0.0, top - 0.086), (0.104, 0.081, 0.086)),
        ]
        if self.female:
            face.append((hair, (-0.052, 0.0, 0.010), (0.056, 0.072, 0.080)))
        else:
            face.append((hair, (-0.056, 0.0, 0.030), (0.046, 0.064, 0.060)))
        parts += [self._ball("head", "head", each[0], "head", each[1], each[2]) for each in face]
        jaw = size * np.array([[0.036, 0.0, 0.050], [0.048, 0.0, -0.040]])
        nose = size * np.array([[0.098, 0.0, 0.040], [0.113, 0.0, 0.004]])
        return [
            *parts,
            self._loft("head", "head", skin, "head", (jaw[0], jaw[1]),
                       [(0, 0.056, 0.064), (0.6, 0.046, 0.056), (1, 0.036, 0.040)], caps=0.6),
            self._loft("head", "head", skin, "head", (nose[0], nose[1]),
                       [(0, 0.008, 0.007), (1, 0.011, 0.013)]),
        ]  # fmt: skip

    def _arm(self) -> list[Loft]:
        upper = float(self.body.segment("left_forearm").origin[2])
        lower = float(self.body.segment("left_hand").origin[2])
        slim = 0.88 if self.female else 1.0
        rows = [(0, 0.054, 0.052), (0.2, 0.058, 0.055), (0.5, 0.054, 0.050), (0.85, 0.046, 0.044),
                (1, 0.039, 0.037)]  # fmt: skip
        below = [(0, 0.039, 0.037), (0.2, 0.047, 0.044), (0.5, 0.042, 0.040), (0.85, 0.036, 0.032),
                 (0.97, 0.035, 0.030)]  # fmt: skip
        end = lower + 0.004 * self.size
        rows, below = ([(u, slim * a, slim * b) for u, a, b in table] for table in (rows, below))
        below[-1] = (1.0, *below[-1][1:])
        return [
            self._loft("left_upper_arm", "trunk", Material.SHIRT, "arm", ((0, 0, 0), (0, 0, upper)), rows),
            self._loft("left_forearm", "trunk", Material.SHIRT, "arm", ((0, 0, 0), (0, 0, end)), below,
                       caps=0.3),
        ]  # fmt: skip

    def _hand(self) -> list[Loft]:
        size, slim = self.size, 0.90 if self.female else 1.0
        length = -float(self.body.segment("left_hand").shapes[0].size[2])
        palm_end = 0.459 * length  # the third knuckle, de Leva's MET3
        skin, hand = Material.SKIN, "left_hand"

        def part(ends: FloatArray, rows: Sequence[Sequence[float]]) -> Loft:
            thin = [(row[0], slim * row[1], slim * row[2], *row[3:]) for row in rows]
            return self._loft(hand, hand, skin, "hand", (ends[0], ends[1]), thin)

        lofts = [
            part(np.array([[0, 0, 0.02 * size], [0, 0, palm_end + 0.006 * size]]),
                 [(0, 0.026, 0.021), (0.35, 0.029, 0.019), (0.7, 0.037, 0.015), (1, 0.038, 0.012)]),
            part(np.array([[0.018, -0.004, -0.020], [0.040, -0.012, -0.058]]) * size,
                 [(0, 0.017, 0.013), (1, 0.013, 0.012)]),
            part(np.array([[0.040, -0.012, -0.058], [0.058, -0.017, -0.105]]) * size,
                 [(0, 0.012, 0.0115), (0.6, 0.0105, 0.010), (1, 0.0085, 0.008)]),
        ]  # fmt: skip
        fingers = ((0.031, 0.96, 0.86, 0.10), (0.0105, 1.0, 0.97, 0.03), (-0.0105, 0.98, 0.90, -0.05),
                   (-0.030, 0.92, 0.70, -0.14))  # fmt: skip
        for across, knuckle, share, fan in fingers:
            start = np.array([slim * across * size, 0.0, palm_end * knuckle])
            reach = (length - palm_end) * share
            end = start + np.array([-fan * reach, 0.0, reach - 0.008 * size])
            thin = 0.9 if share < 0.8 else 1.0
            rows = [(0, 0.0098 * thin, 0.0105 * thin), (0.5, 0.0088 * thin, 0.0088 * thin, 0.0, -0.005),
                    (1, 0.0072 * thin, 0.0068 * thin, 0.0, -0.017)]  # fmt: skip
            lofts.append(part(np.array([start, end]), rows))
        return lofts

    def _leg(self) -> list[Loft]:
        thigh = float(self.body.segment("left_leg").origin[2])
        shank = float(self.body.segment("left_foot").origin[2])
        cloth = Material.TROUSERS
        wide = 1.03 if self.female else 1.0
        above = [(0, 0.090 * wide, 0.088 * wide, -0.004, 0.0), (0.2, 0.088 * wide, 0.083 * wide),
                 (0.5, 0.075, 0.072), (0.8, 0.062, 0.060), (1, 0.053, 0.051)]  # fmt: skip
        below = [(0, 0.053, 0.050), (0.15, 0.058, 0.055), (0.35, 0.061, 0.057, -0.010),
                 (0.65, 0.053, 0.051, -0.008), (1, 0.051, 0.050, -0.004)]  # fmt: skip
        hem = shank + 0.008 * self.size
        return [
            self._loft("left_thigh", "trunk", cloth, "leg", ((0, 0, 0), (0, 0, thigh)), above),
            self._loft("left_leg", "trunk", cloth, "shank", ((0, 0, 0), (0, 0, hem)), below, caps=0.25),
        ]

    def _shoe(self) -> list[Loft]:
        body, size = self.body, self.size
        length, width = float(body.sole_length or 0.28), float(body.sole_width or 0.12)
        sole = float(body.effector("left_foot").translation[2])
        heel, tip = -ANKLE_FROM_HEEL * length, (1.0 - ANKLE_FROM_HEEL) * length
        hinge = heel + TOE_HINGE_FROM_HEEL * length
        black, half = Material.SHOES, 0.5 * width / size  # half widths in metres at 1.75 m
        toes = body.segment("left_toes").origin
        shoe = "left_shoe"
        return [
            # Half of an ellipse above the sole: half width, height.
            self._loft("left_foot", shoe, black, "foot",
                       ((heel + 0.62 * half * size, 0, sole), (hinge, 0, sole)),
                       [(0, 0.62 * half, 0.074), (0.3, 0.62 * half, 0.080), (0.6, 0.78 * half, 0.066),
                        (1, 0.92 * half, 0.046)], (_Y, _Z), power=2.6, caps=0.95),
            self._loft("left_toes", shoe, black, "foot",
                       ((0, 0, sole - toes[2]), (tip - hinge - 0.55 * half * size, 0, sole - toes[2])),
                       [(0, 0.92 * half, 0.046), (1, 0.74 * half, 0.036)], (_Y, _Z), power=2.6, caps=1.0),
            self._loft("left_foot", shoe, black, "foot", ((0, 0, 0.02 * size), (0, 0, -0.02 * size)),
                       [(0, 0.040, 0.036), (1, 0.044, 0.038)]),
        ]  # fmt: skip
