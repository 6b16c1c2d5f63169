"""Bars, rails and rungs that a hand can close round: where along them, and as surfaces for a palm.

What a hand can close round is a matter of the cross-section. For handrails the ADA Standards (2010, 505.5 and
505.7) ask for a perimeter of at most 160 mm, at most 57 mm across and 38 mm of free room for the fingers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.numerics.spatial import FloatArray, axes_of_normal, frozen_array
from manikin.scene.obstacle import Box, Capsule, Cylinder, Obstacle
from manikin.scene.surface import Surface

LARGEST_PERIMETER = 0.160
"""Perimeter of the thickest cross-section that a hand closes round [m]."""
LARGEST_ACROSS = 0.057
"""Largest dimension of that cross-section [m]."""
LEAST_ACROSS = 0.010
"""What is thinner cuts into a hand that carries a body [m]; our choice."""
FINGER_ROOM = 0.038
"""Free room that fingers need around a bar [m]."""
HAND_BREADTH = 0.085
"""Length of a bar that a hand covers [m]; our choice."""
STRIP_WIDTH = 0.06
"""Width of the faces that stand for the sides of a round bar [m]; a palm over one is put onto its middle."""
_SPACING = 0.02  # [m]; between places along a bar that are tested for room
_SIDES = 8


@dataclass(frozen=True, eq=False)
class GraspLine:
    """A straight piece of a bar that a hand can close round anywhere.

    Attributes:
        obstacle: Name of the obstacle.
        start: (3,) middle of the first hand's place on the axis [m].
        end: (3,) middle of the last one's.
        radius: Distance of the bar's surface from its axis, the largest one of a box [m].
        round: Whether it is round, so that a palm may lie on it from any side.
    """

    obstacle: str
    start: FloatArray
    end: FloatArray
    radius: float
    round: bool

    @property
    def length(self) -> float:
        """[m]; 0 where there is room for one hand."""
        return float(np.linalg.norm(self.end - self.start))

    def nearest(self, points: FloatArray) -> FloatArray:
        """(..., 3) places on the axis nearest to points (..., 3) [m]."""
        along = self.end - self.start
        share = (points - self.start) @ along / max(float(along @ along), 1e-18)
        return self.start + np.clip(share, 0.0, 1.0)[..., None] * along

    def strips(self, axis: FloatArray) -> tuple[Surface, ...]:
        """Faces around a round bar of a direction (3,), in the middle of each of which a palm may lie."""
        reach = 0.5 * HAND_BREADTH * axis
        corners = np.array([self.start - reach, self.end + reach])
        sideways, upward, _ = axes_of_normal(axis).T
        half = 0.5 * STRIP_WIDTH
        found: list[Surface] = []
        for angle in 2.0 * np.pi * np.arange(_SIDES) / _SIDES:
            normal = np.cos(angle) * sideways + np.sin(angle) * upward
            across = np.cross(normal, axis)
            ring = [
                corners[end] + self.radius * normal + side * half * across
                for end, side in ((0, 1.0), (0, -1.0), (1, -1.0), (1, 1.0))
            ]
            polygon = frozen_array(np.array(ring), "polygon", (4, 3))
            found.append(Surface((self.obstacle,), polygon, frozen_array(normal, "normal", (3,))))
        return tuple(found)


def grasp_lines(
    obstacles: Sequence[Obstacle], distances: Callable[[FloatArray], Sequence[tuple[float, str]]]
) -> tuple[GraspLine, ...]:
    """Pieces of all bars of a scene around which fingers have room.

    Args:
        distances: Distance [m] of a (3,) world point to each obstacle, with its name.
    """
    found: list[GraspLine] = []
    for item in obstacles:
        bar = _bar(item)
        if bar is not None:
            first, last, radius, is_round = bar
            found += [
                GraspLine(item.name, frozen_array(start, "start"), frozen_array(end, "end"), radius, is_round)
                for start, end in _free(item.name, first, last, radius, distances)
            ]
    return tuple(found)


def grasp_strips(lines: Sequence[GraspLine], obstacles: Sequence[Obstacle]) -> tuple[Surface, ...]:
    """Faces around the round bars, for a palm; boxes have faces of their own."""
    axes = {item.name: item.rotation[:, 2] for item in obstacles}
    return tuple(strip for line in lines if line.round for strip in line.strips(axes[line.obstacle]))


def palm_places(lines: Sequence[GraspLine], numbers: NDArray[np.int64], points: FloatArray) -> FloatArray:
    """(n, 3) middles of palms' grips on the axes of round bars, nearest to points over their strips [m].

    Args:
        lines: Of the scene.
        numbers: (n,) index of each strip among those of :func:`grasp_strips`.
        points: (n, 3) in the planes of the strips.
    """
    bars = [line for line in lines if line.round]
    start, end = (
        np.array([getattr(bar, name) for bar in bars])[numbers // _SIDES] for name in ("start", "end")
    )
    axis = end - start
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-12)
    length = np.linalg.norm(end - start, axis=1)
    along = np.clip(np.einsum("ni,ni->n", points - start, axis), 0.0, length)
    return start + along[:, None] * axis


def _bar(obstacle: Obstacle) -> tuple[FloatArray, FloatArray, float, bool] | None:
    """Ends of the axis, radius and roundness of an obstacle that a hand can close round, or None."""
    shape = obstacle.shape
    if isinstance(shape, Box):
        order = np.argsort(shape.size)
        thin, thick, length = shape.size[order]
        perimeter, across, least = 2.0 * (thin + thick), float(np.hypot(thin, thick)), thin
        direction = np.eye(3)[order[2]]
    elif isinstance(shape, (Cylinder, Capsule)):
        across = least = 2.0 * shape.radius
        perimeter, length = np.pi * across, shape.length
        direction = np.array([0.0, 0.0, 1.0])
    else:
        return None
    closes_round = perimeter <= LARGEST_PERIMETER * (1 + 1e-9) and across <= LARGEST_ACROSS
    if not closes_round or least < LEAST_ACROSS or length < HAND_BREADTH:
        return None
    half = 0.5 * (length - HAND_BREADTH) * direction
    start, end = obstacle.to_world(np.array([-half, half]))
    return start, end, 0.5 * across, not isinstance(shape, Box)


def _free(
    name: str, start: FloatArray, end: FloatArray, radius: float,
    distances: Callable[[FloatArray], Sequence[tuple[float, str]]],
) -> list[tuple[FloatArray, FloatArray]]:  # fmt: skip
    """Pieces between two ends around whose places nothing else is in the fingers' way."""
    count = 1 + int(np.ceil(float(np.linalg.norm(end - start)) / _SPACING))
    places = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    free = [
        all(away >= radius + FINGER_ROOM for away, other in distances(place) if other != name)
        for place in places
    ]
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int8)))
    return [(places[first], places[stop - 1]) for first, stop in bounds.reshape(-1, 2).tolist()]
