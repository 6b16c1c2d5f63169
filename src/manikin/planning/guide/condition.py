"""The reachability condition with its stricter variants, and usable surfaces ([Tonneau2015]_ 6.1, 6.4.2)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError, SceneError
from manikin.numerics.spatial import FloatArray, area_normals, finite_number, frozen_array
from manikin.scene.mesh import Mesh
from manikin.scene.obstacle import HalfSpace, Obstacle, Plane
from manikin.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class UsableSurface:
    """Surfaces that count as within reach of a limb ([Tonneau2015]_ 6.4.2).

    Attributes:
        direction: (3,) unit direction in the world that a normal should have, or None for any.
        max_angle: Largest angle between the two [rad].
        obstacles: Names of the only obstacles that count, or None for all.
        smallest_area: Triangles smaller than this do not count [m^2].
    """

    direction: FloatArray | None
    max_angle: float
    obstacles: tuple[str, ...] | None
    smallest_area: float

    def __init__(
        self, direction: ArrayLike | None = None, max_angle: float = 0.5 * np.pi,
        obstacles: Sequence[str] | None = None, smallest_area: float = 0.0,
    ) -> None:  # fmt: skip
        unit, name = None, "usable surface direction"
        if direction is not None:
            vector = frozen_array(direction, name, (3,), SceneError)
            if (length := float(np.linalg.norm(vector))) < 1e-9:
                raise SceneError("usable surface direction is zero; valid: a direction")
            unit = frozen_array(vector / length, name, (3,), SceneError)
        limits = {"at_least": 0.0, "error": SceneError}
        values = {
            "direction": unit,
            "max_angle": finite_number(max_angle, "usable surface max_angle [rad]", at_most=np.pi, **limits),
            "obstacles": None if obstacles is None else tuple(obstacles),
            "smallest_area": finite_number(smallest_area, "usable surface smallest_area [m^2]", **limits),
        }
        vars(self).update(values)

    @property
    def key(self) -> str:
        """Text that is equal for equal values."""
        direction = None if self.direction is None else self.direction.tolist()
        return repr((direction, self.max_angle, self.obstacles, self.smallest_area))

    def allows_normal(self, normal: FloatArray, *, two_sided: bool = False) -> bool:
        """Whether a surface with this (3,) unit normal counts, seen from both sides if asked."""
        if self.direction is None:
            return True
        cosine = float(normal @ self.direction)
        return (abs(cosine) if two_sided else cosine) >= np.cos(self.max_angle) - 1e-9

    def allows_obstacle(self, name: str) -> bool:
        """Whether surfaces of this obstacle count."""
        return self.obstacles is None or name in self.obstacles


@dataclass(frozen=True, eq=False)
class SceneTriangles:
    """Triangles of the finite obstacles of a scene, in the world.

    Attributes:
        corners: (n, 3, 3) three corners each [m].
        normals: (n, 3) unit normals, outward where the piece is closed.
        areas: (n,) [m^2].
        closed: (n,) whether the triangle belongs to the closed surface of something solid.
        obstacle: (n,) index of the obstacle in the scene.
    """

    corners: FloatArray
    normals: FloatArray
    areas: FloatArray
    closed: NDArray[np.bool_]
    obstacle: NDArray[np.int64]

    @classmethod
    def of(cls, scene: Scene) -> "SceneTriangles":
        """Triangles of every obstacle that is not endless; round shapes become many."""
        parts = [(index, *part) for index, item in enumerate(scene) for part in _triangles(item)]
        corners = np.vstack([np.empty((0, 3, 3)), *(part[1] for part in parts)])
        cross = area_normals(corners)
        length = np.linalg.norm(cross, axis=1)
        counts = np.array([len(part[1]) for part in parts], dtype=np.int64)
        closed = np.repeat(np.array([part[2] for part in parts], dtype=bool), counts)
        obstacle = np.repeat(np.array([part[0] for part in parts], dtype=np.int64), counts)
        return cls(corners, cross / length[:, None], 0.5 * length, closed, obstacle)

    def usable(self, scene: Scene, surface: UsableSurface) -> NDArray[np.bool_]:
        """(n,) which triangles count for a limb."""
        named = np.array([surface.allows_obstacle(name) for name in scene.names], dtype=bool)
        kept = named[self.obstacle] & (self.areas >= surface.smallest_area)
        if surface.direction is None:
            return kept
        cosine = self.normals @ surface.direction
        cosine = np.where(self.closed, cosine, np.abs(cosine))
        return kept & (cosine >= np.cos(surface.max_angle) - 1e-9)


def endless(item: Obstacle) -> bool:
    """Whether an obstacle is a plane or half-space."""
    return isinstance(item.shape, (Plane, HalfSpace))


def _triangles(item: Obstacle) -> list[tuple[FloatArray, bool]]:
    """Corners (n, 3, 3) in the world of each piece, and whether it is closed."""
    if endless(item):
        return []
    if isinstance(item.shape, Mesh):
        return [(item.to_world(piece.vertices[piece.faces]), piece.closed) for piece in item.shape.pieces]
    whole = item.to_trimesh()
    return [(np.asarray(whole.vertices)[np.asarray(whole.faces)], True)]


@dataclass(frozen=True)
class LimbRule:
    """Number and names of limbs that must reach the scene, for trunks of some tilt.

    Attributes:
        required: Names of limbs that must all reach.
        at_least: Number of limbs that must reach, the required ones included.
        tilt: Smallest and largest angle between the root's z axis and the vertical at which the
            rule holds [rad]: standing limbs for an upright trunk, all limbs for a bent one.
    """

    required: tuple[str, ...] = ()
    at_least: int = 1
    tilt: tuple[float, float] = (0.0, float(np.pi))

    def __post_init__(self) -> None:
        object.__setattr__(self, "required", tuple(self.required))
        if isinstance(self.at_least, bool) or not isinstance(self.at_least, int) or self.at_least < 0:
            raise InputError(f"limb rule at_least is {self.at_least!r}; valid: a whole number >= 0")
        low = finite_number(self.tilt[0], "limb rule tilt[0] [rad]", at_least=0.0)
        high = finite_number(self.tilt[1], "limb rule tilt[1] [rad]", at_least=low, at_most=np.pi)
        object.__setattr__(self, "tilt", (low, high))

    def holds_at(self, tilt: float, slack: float = 0.0) -> bool:
        """Whether the rule is about a trunk of this tilt, give or take ``slack`` [rad]."""
        return self.tilt[0] - slack <= tilt <= self.tilt[1] + slack


@dataclass(frozen=True)
class Condition:
    """Condition on the pose of the root beside a free trunk.

    The default is the condition of the thesis: at least one limb reaches some surface.

    Attributes:
        surfaces: Which surfaces count for a limb, by its name; any where left out.
    """

    rules: tuple[LimbRule, ...] = (LimbRule(),)
    surfaces: Mapping[str, UsableSurface] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rules", tuple(self.rules))
        object.__setattr__(self, "surfaces", dict(self.surfaces))

    @classmethod
    def limbs(cls, *required: str, at_least: int = 1) -> "Condition":
        """Condition that these limbs reach, and as many in all."""
        return cls((LimbRule(required, max(at_least, len(required))),))

    @classmethod
    def standing_or_bent(
        cls, standing: Sequence[str], bent: Sequence[str], upright: float = np.deg2rad(35.0)
    ) -> "Condition":
        """Condition that some limbs reach when upright and others when bent ([Tonneau2015]_ 6.4.2).

        The trunk is upright up to a tilt of ``upright`` [rad] and bent from there on; our choice.
        """
        upper = LimbRule(tuple(standing), len(standing), (0.0, upright))
        return cls((upper, LimbRule(tuple(bent), len(bent), (upright, float(np.pi)))))

    def surface(self, limb: str) -> UsableSurface:
        """Surfaces that count for a limb."""
        return self.surfaces.get(limb, UsableSurface())

    def check_names(self, limbs: Sequence[str]) -> None:
        """Raise an InputError if a name is none of these limbs, or more limbs are wanted than there are."""
        named = [name for rule in self.rules for name in rule.required] + list(self.surfaces)
        unknown = sorted(set(named) - set(limbs))
        if unknown:
            raise InputError(f"condition names limb {unknown[0]!r}; valid: {', '.join(limbs)}")
        most = max((rule.at_least for rule in self.rules), default=0)
        if most > len(limbs):
            raise InputError(f"condition wants {most} limbs; valid: at most {len(limbs)}")
