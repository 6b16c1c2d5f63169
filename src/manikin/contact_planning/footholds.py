"""Places for a sole near a wanted one."""

from collections.abc import Iterator
from dataclasses import dataclass

import coal
import numpy as np

from manikin.body import BodyModel
from manikin.contact import Contact, sole
from manikin.contact_planning.touch import onto_normal
from manikin.errors import BodyError, ContactError
from manikin.scene import Scene, Surface
from manikin.scene.collision import collision_parts
from manikin.spatial import FloatArray, finite_number, rotation_from_yaw

_REQUEST = coal.CollisionRequest()


@dataclass(frozen=True)
class FootholdSettings:
    """Where footholds are looked for; the values are our choice.

    Attributes:
        reach: Farthest from the wanted place, along the heading and across it [m].
        spacing: Between places that are tried [m].
        edge: Distance of the sole to the edges of its surface [m].
        clearance: Distance of the foot to other obstacles [m].
        foot_height: Height of the foot above its sole that has to be free [m].
        steepest: Largest slope of a surface to stand on [rad].
        height_weight: What a difference in height counts beside one along the ground.
        apart: Distance between two places of the same surface that are both offered [m].
        offered: Most places of one surface that are offered.
    """

    reach: tuple[float, float] = (0.24, 0.06)
    spacing: float = 0.02
    edge: float = 0.005
    clearance: float = 0.015
    foot_height: float = 0.10
    steepest: float = float(np.deg2rad(30.0))
    height_weight: float = 0.7
    apart: float = 0.08
    offered: int = 2

    def __post_init__(self) -> None:
        for name in ("spacing", "foot_height", "apart"):
            finite_number(getattr(self, name), f"foothold settings {name}", above=0.0)


@dataclass(frozen=True, eq=False)
class Foothold:
    """A place for a sole.

    Attributes:
        position: (3,) of the middle of the sole [m].
        rotation: (3, 3) sole-to-world.
        obstacle: Name of the obstacle that carries it.
        cost: Weighted distance to the wanted place [m].
    """

    position: FloatArray
    rotation: FloatArray
    obstacle: str
    cost: float

    def contact(self, effector: str, length: float, width: float, friction: float) -> Contact:
        """The contact of a foot that stands there."""
        return sole(
            effector, self.position, length=length, width=width, friction=friction, rotation=self.rotation
        )


class Footholds:
    """Looks for footholds in one scene.

    A place is one where the whole sole lies on a surface and nothing else of the scene is in the way of
    the foot. One instance works on buffers of its own: use one per thread.
    """

    def __init__(self, body: BodyModel, scene: Scene, settings: FootholdSettings | None = None) -> None:
        """Prepare a scene.

        Raises:
            ContactError: If the body has no soles.
        """
        if body.sole_length is None or body.sole_width is None:
            raise ContactError(f"body {body.name!r} has no soles; valid: a body that stands on feet")
        self.length, self.width = body.sole_length, body.sole_width
        self.settings = settings or FootholdSettings()
        self._surfaces = scene.surfaces_facing((0.0, 0.0, 1.0), self.settings.steepest)
        self._parts = [(item.name, part) for item in scene for part in collision_parts(item)]
        gap = 2.0 * self.settings.clearance
        self._foot = coal.Box(self.length + gap, self.width + gap, self.settings.foot_height)

    def near(self, wanted: FloatArray, yaw: float) -> list[Foothold]:
        """Footholds around a place, the nearest first.

        Args:
            wanted: (3,) where the middle of the sole should be [m].
            yaw: Heading of the toes [rad].
        """
        found = [hold for surface in self._surfaces for hold in self._on(surface, wanted, yaw)]
        return sorted(found, key=lambda hold: hold.cost)

    def _on(self, surface: Surface, wanted: FloatArray, yaw: float) -> Iterator[Foothold]:
        rotation = onto_normal(rotation_from_yaw(yaw), surface.normal)
        places = self._places(surface, wanted, rotation)
        lifted = np.abs(places[:, 2] - wanted[2]) * self.settings.height_weight
        cost = np.hypot(np.linalg.norm(places[:, :2] - wanted[:2], axis=1), lifted)
        taken: list[FloatArray] = []
        for row in np.argsort(cost, kind="stable"):
            place = places[row]
            if any(np.linalg.norm(place - other) < self.settings.apart for other in taken):
                continue
            if self._is_free(place, rotation, surface):
                taken.append(place)
                yield Foothold(place, rotation, surface.obstacle, float(cost[row]))
                if len(taken) == self.settings.offered:
                    return

    def _places(self, surface: Surface, wanted: FloatArray, rotation: FloatArray) -> FloatArray:
        """(n, 3) places of a grid around the wanted one where the whole sole lies on the surface."""
        steps = [self.settings.spacing * np.arange(-n, n + 1) for n in self._counts()]
        along, across = (axis.ravel() for axis in np.meshgrid(*steps, indexing="ij"))
        heading = rotation[:2, 0] / np.linalg.norm(rotation[:2, 0])
        side = np.array([-heading[1], heading[0]])
        places = np.empty((len(along), 3))
        places[:, :2] = wanted[:2] + along[:, None] * heading + across[:, None] * side
        base = surface.polygon[0]
        places[:, 2] = base[2] - (places[:, :2] - base[:2]) @ surface.normal[:2] / surface.normal[2]
        half = np.array([0.5 * self.length, 0.5 * self.width]) + self.settings.edge
        corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * half @ rotation[:, :2].T
        outside = surface.outside((places[:, None] + corners).reshape(-1, 3)).reshape(-1, 4)
        return places[(outside <= 1e-9).all(axis=1)]

    def _counts(self) -> tuple[int, int]:
        along, across = (int(reach / self.settings.spacing) for reach in self.settings.reach)
        return along, across

    def _is_free(self, place: FloatArray, rotation: FloatArray, surface: Surface) -> bool:
        """Whether nothing but the surface's own obstacle is in the foot's way, nor that one above it."""
        lift = 0.5 * self.settings.foot_height + 2e-3
        pose = coal.Transform3s(rotation, place + lift * surface.normal)
        for _, part in self._parts:
            result = coal.CollisionResult()
            where = coal.Transform3s(part.rotation, part.translation)
            coal.collide(self._foot, pose, part.geometry, where, _REQUEST, result)
            if result.isCollision():
                return False
        return True


def stature_of(body: BodyModel) -> float:
    """Stature of a body that stands on feet [m].

    Raises:
        BodyError: If the body has none, as creatures have.
    """
    if body.stature is None:
        raise BodyError(f"body {body.name!r} has no stature; valid: a human")
    return body.stature
