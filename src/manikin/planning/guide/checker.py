"""Whether poses satisfy the reachability condition, and motions between them.

The collision queries run in Coal. A pose of a plan is checked with a skin around the trunk and with the
limbs' volumes drawn in; a motion of which nothing moves farther than that between checked poses then
satisfies the plain condition everywhere.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body.model import coal_shape
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.planning.guide.abstraction import Abstraction, LimbReach, TrunkShape
from manikin.planning.guide.condition import Condition, SceneTriangles, UsableSurface, endless
from manikin.planning.guide.root_pose import tilt
from manikin.scene.collision import CollisionPart, collision_parts, convex_geometry
from manikin.scene.scene import Scene
from manikin.scene.triangles import triangle_geometry

TRUNK_MARGIN = 0.02
"""Skin around the trunk while planning [m]; our choice."""

REACH_MARGIN = 0.03
"""By how much a limb's volume is drawn in while planning [m]; our choice."""

DIRECTIONS = 128
"""Directions whose outermost corners stand for a limb's volume while planning; a human's lose 3 %."""


@dataclass(frozen=True)
class Margins:
    """Reserves of planning: skin around the trunk's shapes, and what limbs' volumes are drawn in by [m]."""

    trunk: float = TRUNK_MARGIN
    reach: float = REACH_MARGIN

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            finite_number(value, f"margins {name} [m]", at_least=0.0)


NO_MARGINS = Margins(0.0, 0.0)
"""The plain condition, for certificates."""


class ReachabilityChecker:
    """Checks poses of one abstraction in one scene; use one instance per thread, as it has its own buffers.

    Attributes:
        margins: What is kept in hand.
        reach_radius: Distance from the root's origin beyond which no limb reaches [m].
    """

    def __init__(
        self, abstraction: Abstraction, scene: Scene, condition: Condition | None = None,
        margins: Margins | None = None,
    ) -> None:  # fmt: skip
        """Prepare the queries.

        Raises:
            InputError: If the condition names a limb that the abstraction lacks.
        """
        self.abstraction, self.scene = abstraction, scene
        self.condition = condition or Condition()
        self.condition.check_names(abstraction.limb_names)
        self.margins = margins or Margins()
        self._parts = tuple(part for item in scene for part in collision_parts(item))
        trunk = [shape.enlarged(1.0, self.margins.trunk) for shape in abstraction.trunk]
        self._trunk = _Queries(
            [(coal_shape(item), _place(item)) for item in trunk],
            [[(part.geometry, _place(part)) for part in self._parts]] * len(abstraction.trunk),
        )
        triangles = SceneTriangles.of(scene)
        surfaces = [self.condition.surface(name) for name in abstraction.limb_names]
        targets = {x.key: _targets(scene, triangles, x) for x in {x.key: x for x in surfaces}.values()}
        self._limbs = _Queries(
            [_volume_object(limb, self.margins.reach) for limb in abstraction.limbs],
            [targets[surface.key] for surface in surfaces],
        )
        self._trunk_radius = max(shape.radius_about_root for shape in abstraction.trunk)
        self.reach_radius = float(max(np.linalg.norm(x.vertices, axis=1).max() for x in abstraction.limbs))
        self._reach_margin = min(min(self.margins.reach, 0.5 * limb.radius) for limb in abstraction.limbs)
        # By how much the tilt may differ between a checked pose and its neighbours [rad].
        self._tilt_slack = 2.0 * self.margins.trunk / self._trunk_radius if self.margins.trunk > 0.0 else 0.0

    def holds(self, pose: FloatArray) -> bool:
        """Whether a pose (7,) keeps the trunk free and the limbs within reach of the scene.

        A closed mesh that is not convex is hollow to Coal: see :meth:`inside_solid`.
        """
        return self.trunk_is_free(pose) and self.limbs_reach(pose)

    def admits(self, pose: FloatArray) -> bool:
        """Whether a pose satisfies the condition and is not inside something hollow to Coal."""
        return self.holds(pose) and not self.inside_solid(pose)

    def trunk_is_free(self, pose: FloatArray) -> bool:
        """Whether no trunk shape meets an obstacle."""
        return not self._trunk.any(pose)

    def limbs_reach(self, pose: FloatArray) -> bool:
        """Whether every rule about the limbs holds."""
        lean = tilt(pose)
        self._limbs.place(pose)
        reaches = cache(self._limbs.meets)
        limbs = self.abstraction.limb_names
        for rule in self.condition.rules:
            if rule.holds_at(lean, self._tilt_slack):
                optional = (row for row, name in enumerate(limbs) if name not in rule.required)
                wanted = max(rule.at_least - len(rule.required), 0)
                if not all(reaches(limbs.index(name)) for name in rule.required) or (
                    len(list(islice(filter(reaches, optional), wanted))) < wanted
                ):
                    return False
        return True

    def reaching(self, pose: FloatArray) -> tuple[str, ...]:
        """Names of the limbs whose volume meets a surface that counts for them."""
        self._limbs.place(pose)
        return tuple(name for row, name in enumerate(self.abstraction.limb_names) if self._limbs.meets(row))

    def blocking(self, pose: FloatArray) -> tuple[str, str] | None:
        """(trunk shape, obstacle) of the first pair that meets, or None."""
        pair = self._trunk.first(pose)
        return None if pair is None else (self.abstraction.trunk[pair[0]].name, self._parts[pair[1]].obstacle)

    def inside_solid(self, pose: FloatArray) -> str | None:
        """Name of a closed, non-convex mesh in which a trunk shape's centre lies, or None."""
        rotation, origin = pin.XYZQUATToSE3(pose).rotation, pose[:3]
        for part, shape in itertools.product(self._parts, self.abstraction.trunk):
            if part.surface is not None:
                point = part.rotation.T @ (origin + rotation @ shape.translation - part.translation)
                inside = np.all(point > part.low) and np.all(point < part.high)
                if inside and part.surface.signed(point)[0] < 0.0:
                    return part.obstacle
        return None

    def explain(self, pose: FloatArray) -> str | None:
        """Say in words why a pose does not satisfy the condition, or None if it does."""
        pair = self.blocking(pose)
        if pair is not None:
            skin = f" (with a skin of {self.margins.trunk:g} m)" if self.margins.trunk > 0.0 else ""
            return f"the trunk's {pair[0]!r} meets {pair[1]!r}{skin}"
        solid = self.inside_solid(pose)
        if solid is not None:
            return f"the trunk is inside {solid!r}"
        lean, reached = tilt(pose), self.reaching(pose)
        have = f"within reach: {', '.join(reached) or 'none'}"
        for rule in self.condition.rules:
            if not rule.holds_at(lean, self._tilt_slack):
                continue
            missing = [name for name in rule.required if name not in reached]
            if missing:
                return f"limb {missing[0]!r} reaches no usable surface ({have})"
            if len(reached) < rule.at_least:
                return f"{len(reached)} limbs reach a usable surface and {rule.at_least} are wanted ({have})"
        return None

    def steps(self, way: float, angle: float) -> int:
        """Number of steps into which a motion is cut so that nothing is missed between checked poses.

        Between two poses, whose origins are a ``way`` [m] and an ``angle`` [rad] apart, a point is never
        farther from where it was checked than half of ``way + radius angle``. The margins must not be zero.
        """
        trunk = (way + self._trunk_radius * angle) / (2.0 * self.margins.trunk)
        reach = (way + self.reach_radius * angle) / (2.0 * self._reach_margin)
        return max(1, int(np.ceil(max(trunk, reach))))

    def triangle_in_reach(self, pose: FloatArray, corners: FloatArray) -> bool:
        """Whether some limb's volume meets one triangle (3, 3) [m]."""
        triangle = coal.TriangleP(*corners)
        place = coal.Transform3s(pin.XYZQUATToSE3(pose).rotation, pose[:3])
        for geometry in self._limbs.moving:
            result = coal.CollisionResult()
            coal.collide(geometry, place, triangle, _HERE, _REQUEST, result)
            if result.isCollision():
                return True
        return False


_Target = tuple[coal.CollisionGeometry, pin.SE3]
_HERE = coal.Transform3s.Identity()
_REQUEST = coal.CollisionRequest()
_FEW_PAIRS = 100  # up to this many, asking all is quicker than a tree of bounding boxes


class _Queries:
    """Rigid group of geometries on a free root against fixed targets, a list for each."""

    def __init__(self, moving: Sequence[_Target], targets: Sequence[Sequence[_Target]]) -> None:
        self.moving = [geometry for geometry, _ in moving]
        self._model = pin.Model()
        root = self._model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
        self._shapes = pin.GeometryModel()
        for row, (geometry, place) in enumerate(moving):
            self._shapes.addGeometryObject(pin.GeometryObject(f"moving/{row}", root, 0, place, geometry))
        known: dict[int, int] = {}
        self.rows: list[range] = []
        self._pairs: list[tuple[int, int]] = []
        for row, fixed in enumerate(targets):
            self.rows.append(range(len(self._pairs), len(self._pairs) + len(fixed)))
            for number, (geometry, place) in enumerate(fixed):
                index = known.setdefault(id(geometry), len(moving) + len(known))
                if index == len(self._shapes.geometryObjects):
                    item = pin.GeometryObject(f"fixed/{index}", 0, 0, place, geometry)
                    self._shapes.addGeometryObject(item)
                self._pairs.append((row, number))
                self._shapes.addCollisionPair(pin.CollisionPair(row, index))
        self._data = self._model.createData()
        self._found = pin.GeometryData(self._shapes)
        self._tree = None
        if len(self._pairs) > _FEW_PAIRS:
            tree = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager
            self._tree = tree(self._model, self._shapes, self._found)

    def any(self, pose: FloatArray) -> bool:
        """Whether any pair meets at a pose (7,)."""
        if not self._pairs:
            return False
        asked = (self._shapes, self._found) if self._tree is None else (self._tree,)
        return pin.computeCollisions(self._model, self._data, *asked, pose, True)

    def first(self, pose: FloatArray) -> tuple[int, int] | None:
        """First pair (row, number of the target) that meets, or None."""
        self.place(pose)
        for index, pair in enumerate(self._pairs):
            if pin.computeCollision(self._shapes, self._found, index):
                return pair
        return None

    def place(self, pose: FloatArray) -> None:
        """Move the group to a pose (7,)."""
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._found, pose)

    def meets(self, row: int) -> bool:
        """Whether one of the group meets one of its targets where it was placed."""
        return any(pin.computeCollision(self._shapes, self._found, index) for index in self.rows[row])


def _volume_object(limb: LimbReach, margin: float) -> _Target:
    """A limb's volume; drawn in for planning, and then with fewer corners, which lie inside it."""
    vertices = limb.shrunk(margin, limb.coarse(DIRECTIONS)) if margin > 0.0 else limb.vertices
    return convex_geometry(vertices), pin.SE3.Identity()


def _targets(scene: Scene, triangles: SceneTriangles, surface: UsableSurface) -> list[_Target]:
    """What counts for a limb: endless shapes one by one, all triangles as one mesh."""
    targets = []
    for item in scene:
        if endless(item) and surface.allows_obstacle(item.name):
            (part,) = collision_parts(item)
            two_sided = isinstance(part.geometry, coal.Plane)
            if surface.allows_normal(item.world_plane[0], two_sided=two_sided):
                targets.append((part.geometry, _place(part)))
    kept: NDArray[np.bool_] = triangles.usable(scene, surface)
    if kept.any():
        corners = triangles.corners[kept].reshape(-1, 3)
        vertices, inverse = np.unique(corners, axis=0, return_inverse=True)
        mesh = triangle_geometry(vertices, inverse.reshape(-1, 3).astype(np.int64))
        targets.append((mesh, pin.SE3.Identity()))
    return targets


def _place(part: CollisionPart | TrunkShape) -> pin.SE3:
    return pin.SE3(np.array(part.rotation), np.array(part.translation))
