"""Random poses near obstacles: Algorithm 3 of [Tonneau2015]_, corrected.

The root is put on a random point of a random triangle of the scene and moved off in a random direction, step
by step, turning at random, until the condition holds or the triangle is out of the limbs' reach.
Corrections: the inner counter starts anew for every triangle, and the first step is taken before the limbs'
reach is asked. Our own: from the surface of something solid the root moves to the free side.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, area_normals, axes_of_normal, finite_number, frozen_array
from manikin.planning.guide.checker import ReachabilityChecker
from manikin.planning.guide.condition import SceneTriangles, endless
from manikin.scene.obstacle import HalfSpace, Obstacle

TRIANGLES = 20
"""LIMIT1 of Algorithm 3, triangles tried for one pose; our choice, as the other numbers left open."""

TURNS = 8
"""LIMIT2, tries per triangle."""

UNIFORM_SHARE = 0.5
"""Share s of triangles drawn uniformly; the others by their area."""

STEP = 0.6
"""Largest step away from the triangle [m]; the thesis has 1."""


@dataclass(frozen=True, eq=False)
class SamplingRegion:
    """Box with corners (3,) [m] in which roots are drawn, and how they may be turned.

    The turn is ``Rz(yaw) Ry(pitch) Rx(roll)``, each with a smallest and largest angle or None [rad], a
    positive pitch leaning forward; without any bounds, it is uniform over all turns.
    """

    lower: FloatArray
    upper: FloatArray
    yaw: tuple[float, float] | None
    pitch: tuple[float, float] | None
    roll: tuple[float, float] | None

    def __init__(
        self, lower: ArrayLike, upper: ArrayLike, yaw: Sequence[float] | None = None,
        pitch: Sequence[float] | None = None, roll: Sequence[float] | None = None,
    ) -> None:  # fmt: skip
        low = frozen_array(lower, "sampling region lower [m]", (3,))
        high = frozen_array(upper, "sampling region upper [m]", (3,))
        if not np.all(low < high):
            raise InputError(f"sampling region spans {low.tolist()} to {high.tolist()}; valid: lower < upper")
        vars(self).update(lower=low, upper=high)
        for name, pair in (("yaw", yaw), ("pitch", pitch), ("roll", roll)):
            if pair is not None:
                least = finite_number(pair[0], f"sampling region {name}[0] [rad]")
                pair = least, finite_number(pair[1], f"sampling region {name}[1] [rad]", at_least=least)
            object.__setattr__(self, name, pair)

    def turns(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 4) random quaternions xyzw within the bounds."""
        pairs = self.yaw, self.pitch, self.roll
        if pairs == (None, None, None):
            raw = rng.normal(size=(count, 4))
            return raw / np.linalg.norm(raw, axis=1, keepdims=True)
        angles = [rng.uniform(*(pair or (-np.pi, np.pi)), count) for pair in pairs]
        return Rotation.from_euler("ZYX", np.column_stack(angles)).as_quat()

    def holds(self, position: FloatArray) -> bool:
        """Whether a (3,) position lies in the box."""
        return bool(np.all(position >= self.lower) and np.all(position <= self.upper))


class PoseSampler:
    """Draws poses for one checker and region (GENERATECONFIGURATION) from ``corners`` (n, 3, 3) [m]."""

    def __init__(
        self, checker: ReachabilityChecker, region: SamplingRegion, uniform_share: float = UNIFORM_SHARE
    ) -> None:
        """Collect the triangles of the scene; planes are cut to the region.

        Raises:
            InputError: If no triangle lies in the region.
        """
        self._checker, self._region, self._uniform_share = checker, region, uniform_share
        finite = SceneTriangles.of(checker.scene)
        parts = [(finite.corners, finite.normals, finite.closed)]
        parts += [_cut_plane(item, region) for item in checker.scene if endless(item)]
        corners, normals, closed = (np.concatenate([part[row] for part in parts]) for row in range(3))
        reach = checker.reach_radius
        near = np.all(corners.min(axis=1) <= region.upper + reach, axis=1) & np.all(
            corners.max(axis=1) >= region.lower - reach, axis=1
        )
        if not near.any():
            raise InputError("sampling region holds no surface within reach; valid: a region near the scene")
        self.corners: FloatArray = corners[near]
        self._normals, self._closed = normals[near], closed[near]
        area = np.linalg.norm(area_normals(self.corners), axis=1)
        self._cumulative = np.cumsum(area) / area.sum()

    def pick(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(count,) indices of triangles, a share of them uniform and the others by area."""
        uniform = rng.uniform(size=count) < self._uniform_share
        by_area = np.searchsorted(self._cumulative, rng.uniform(size=count), side="right")
        anyone = rng.integers(0, len(self.corners), count)
        return np.where(uniform, anyone, np.minimum(by_area, len(self.corners) - 1))

    def draw(self, rng: np.random.Generator) -> FloatArray | None:
        """Draw one pose (7,) that satisfies the condition, or None after so many triangles."""
        for triangle in self.pick(TRIANGLES, rng):
            pose = self._search(int(triangle), rng)
            if pose is not None:
                return pose
        return None

    def _search(self, triangle: int, rng: np.random.Generator) -> FloatArray | None:
        """Inner loops of Algorithm 3 over one triangle."""
        points, directions = self._departures(triangle, rng)
        turns = self._region.turns(TURNS, rng)
        steps = STEP * (1.0 - rng.uniform(size=(TURNS, TURNS)))
        tries = 0
        while tries < len(points):
            position, direction = points[tries], directions[tries]
            for step in steps[tries, : len(points) - tries]:
                position = position + step * direction
                pose = np.concatenate([position, turns[tries]])
                tries += 1
                if self._region.holds(position) and self._checker.admits(pose):
                    return pose
                if not self._checker.triangle_in_reach(pose, self.corners[triangle]):
                    break
        return None

    def _departures(self, triangle: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Random points of a triangle and directions away from it, (TURNS, 3) each."""
        a, b, c = self.corners[triangle]
        u, v = rng.uniform(size=(2, TURNS, 1))
        root = np.sqrt(u)
        points = (1.0 - root) * a + root * (1.0 - v) * b + root * v * c
        directions = rng.normal(size=(TURNS, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        if self._closed[triangle]:
            height = directions @ self._normals[triangle]
            directions -= 2.0 * np.minimum(height, 0.0)[:, None] * self._normals[triangle]
        return points, directions


def _cut_plane(item: Obstacle, region: SamplingRegion) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Two triangles of a plane that cover the region's shadow on it, normals, and whether solid."""
    normal, offset = item.world_plane
    axes = np.ascontiguousarray(axes_of_normal(normal)[:, :2].T)
    corners = np.array(np.meshgrid(*np.stack([region.lower, region.upper]).T)).reshape(3, -1).T
    flat = corners @ axes.T
    (left, low), (right, high) = flat.min(axis=0), flat.max(axis=0)
    square = np.array([(left, low), (right, low), (right, high), (left, high)]) @ axes + offset * normal
    triangles = square[[[0, 1, 2], [0, 2, 3]]]
    return triangles, np.stack([normal, normal]), np.full(2, isinstance(item.shape, HalfSpace))
