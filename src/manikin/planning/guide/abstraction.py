"""The creature as its trunk and what its limbs can reach ([Tonneau2015]_ 4.3.4, 6.1).

``A = A_trunk U A_ROM`` is rigid: the trunk's shapes in one posture, slightly enlarged so that the limbs' own
roots have room, and for each limb the convex hull of the places its effector can take.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from manikin.body.model import BodyModel
from manikin.body.segments import Shape, ShapeKind
from manikin.errors import BodyError
from manikin.kinematics import ReachVolume
from manikin.kinematics.limb_kinematics import inscribed_ball
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array

TRUNK_SCALE = 1.1
"""Factor on the radii and sides of the trunk's shapes; our choice, the thesis gives none."""


class TrunkShape(Shape):
    """A shape of the trunk in the frame of the root instead of its segment's, named ``"segment/shape"``."""

    @property
    def radius_about_root(self) -> float:
        """Largest distance of a point of the shape from the root's origin, or more [m]."""
        if self.kind is ShapeKind.BOX:
            half = 0.5 * np.linalg.norm(self.size)
        else:
            half = self.size[0] + (0.5 * self.size[1] if self.kind is ShapeKind.CAPSULE else 0.0)
        return float(np.linalg.norm(self.translation) + half)

    def enlarged(self, factor: float, margin: float = 0.0) -> "TrunkShape":
        """The shape with radii or sides times ``factor`` and a skin of ``margin`` [m].

        The length between the ends of a capsule stays.
        """
        size = np.array(self.size)
        if self.kind is ShapeKind.BOX:
            size = size * factor + 2.0 * margin
        else:
            size[0] = size[0] * factor + margin
        return TrunkShape(self.name, self.kind, size, self.translation, self.rotation)


@dataclass(frozen=True, eq=False)
class LimbReach:
    """Convex volume of the places of one limb's effector, in the frame of the root.

    Attributes:
        vertices: (n, 3) corners of the hull [m].
        normals: (m, 3) unit normals of its faces, outward.
        offsets: (m,) so that the volume is ``normals x <= offsets`` [m].
        centre: (3,) centre of the largest ball inside ([Tonneau2015]_ 4.1.2) [m].
        radius: Radius of that ball [m].
    """

    name: str
    vertices: FloatArray
    normals: FloatArray
    offsets: FloatArray
    centre: FloatArray
    radius: float

    def __init__(self, name: str, vertices: ArrayLike) -> None:
        """Take the hull of (n, 3) points in the root's frame [m].

        Raises:
            BodyError: If the points have no volume.
        """
        points = frozen_array(vertices, f"reach of limb {name!r} [m]", (None, 3), BodyError)
        try:
            hull = ConvexHull(points)
        except (QhullError, ValueError):
            raise BodyError(
                f"reach of limb {name!r} has {len(points)} points without volume; "
                "valid: at least four that do not lie in one plane"
            ) from None
        rows = hull.equations
        centre, radius = inscribed_ball(rows[:, :3], -rows[:, 3])
        arrays = {"vertices": points[hull.vertices], "normals": rows[:, :3], "offsets": -rows[:, 3]}
        arrays = {key: frozen_array(value, key) for key, value in {**arrays, "centre": centre}.items()}
        vars(self).update(name=name, radius=radius, **arrays)

    def coarse(self, directions: int) -> FloatArray:
        """(k, 3) vertices that are outermost in evenly spread directions, k <= ``directions``."""
        height = (np.arange(directions) + 0.5) / directions * 2.0 - 1.0
        angle = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(directions)
        ring = np.sqrt(1.0 - height**2)
        spread = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])
        return self.vertices[np.unique(np.argmax(self.vertices @ spread.T, axis=0))]

    def shrunk(self, margin: float, vertices: FloatArray | None = None) -> FloatArray:
        """(n, 3) vertices drawn towards the centre so that each has ``margin`` [m] to every face.

        With the ball's radius r the factor is ``1 - margin / r``, at least 1/2.
        """
        factor = max(0.5, 1.0 - margin / self.radius)
        drawn = self.vertices if vertices is None else vertices
        return self.centre + factor * (drawn - self.centre)


@dataclass(frozen=True, eq=False)
class Abstraction:
    """Trunk, which must not meet the scene, and reach of a creature's limbs in the frame of its root."""

    trunk: tuple[TrunkShape, ...]
    limbs: tuple[LimbReach, ...]

    def __post_init__(self) -> None:
        for parts, what in ((self.trunk, "trunk shape"), (self.limbs, "limb")):
            if not parts:
                raise BodyError(f"abstraction has no {what}; valid: at least one")
        twice = sorted({name for name in self.limb_names if self.limb_names.count(name) > 1})
        if twice:
            raise BodyError(f"abstraction has limb {twice[0]!r} twice; valid: one volume per limb")

    @property
    def limb_names(self) -> tuple[str, ...]:
        """Names of the limbs, in order."""
        return tuple(limb.name for limb in self.limbs)


def abstraction_of(
    body: BodyModel, volumes: Sequence[ReachVolume], *, angles: Mapping[str, float] | None = None,
    trunk_scale: float = TRUNK_SCALE,
) -> Abstraction:  # fmt: skip
    """Abstraction of a body whose trunk is held in one posture.

    Args:
        volumes: Reach of each limb to be used.
        angles: Hinge angles of the trunk by name [rad]; the standing posture's where left out.
        trunk_scale: Factor on the radii and sides of the trunk's shapes, > 0.

    Raises:
        BodyError: If a name is unknown, or there is no volume or no shape.
    """
    factor = finite_number(trunk_scale, "trunk_scale", above=0.0, error=BodyError)
    frames = _segment_frames(body, angles)
    shapes = [
        TrunkShape(
            f"{name}/{shape.name}", shape.kind, shape.size, _moved(frames[name], shape.translation),
            frames[name].rotation @ shape.rotation,
        ).enlarged(factor)
        for name in _outside_limbs(body, volumes)
        for shape in body.segment(name).shapes
    ]  # fmt: skip
    limbs = [LimbReach(item.limb.name, _moved(frames[item.segment], item.vertices)) for item in volumes]
    return Abstraction(tuple(shapes), tuple(limbs))


def _moved(frame: pin.SE3, points: FloatArray) -> FloatArray:
    """Points (..., 3) of a segment's frame in the root's."""
    return points @ frame.rotation.T + frame.translation


def _segment_frames(body: BodyModel, angles: Mapping[str, float] | None) -> dict[str, pin.SE3]:
    """Frame of every segment in the root's frame in a posture."""
    wanted = {**body.standing_angles, **(angles or {})}
    checked = [finite_number(a, f"angle of {name!r} [rad]", error=BodyError) for name, a in wanted.items()]
    q = body.posture(dict(zip(wanted, checked, strict=True)))
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    root = data.oMf[body.segment_frame(body.segments[0].name)].inverse()
    return {s.name: root * data.oMf[body.segment_frame(s.name)] for s in body.segments}


def _outside_limbs(body: BodyModel, volumes: Sequence[ReachVolume]) -> list[str]:
    """Names of the segments that belong to no limb and hang on none, as toes do; the root always."""
    in_limbs = {name for volume in volumes for name in volume.limb.segments} - {body.segments[0].name}
    for segment in body.segments:
        if segment.parent in in_limbs:
            in_limbs.add(segment.name)
    return [segment.name for segment in body.segments if segment.name not in in_limbs]
