"""A way to stand, and the mechanics of a body whose feet are held ([Kudoh2002]_ 2.2).

With both feet on the ground the generalised acceleration is ``a = basis phi'' + drift``: ``basis`` spans the
accelerations that leave the feet where they are, ``drift`` is what their centripetal accelerations ask for.
The thesis finds the maps by evaluating the inverse dynamics at unit vectors of coordinates ``phi`` of the
loops (Fig. 2.6); an orthonormal basis gives the same maps at once, and any basis the same torques.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import end_segments
from manikin.contact import Contact, ContactKind, sole
from manikin.control.dynamics import DynamicsState
from manikin.errors import BodyError, InputError
from manikin.numerics.polytope import convex_polygon, signed_distance
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array, skew


@dataclass(frozen=True, eq=False)
class JointGroups:
    """Parts of a body that stands on two soles; each hinge and each segment is in one group.

    Attributes:
        feet: Effectors of the two legs, the left one first.
        joints: Hinge indices of ``"ankle"`` (with the toes), ``"knee"``, ``"hip"``, ``"trunk"``, ``"arm"``.
        segments: Segment names of ``"arms"``, ``"trunk"`` and ``"legs"``.
    """

    feet: tuple[str, str]
    joints: dict[str, NDArray[np.int64]]
    segments: dict[str, tuple[str, ...]]

    def locked(self, names: tuple[str, ...]) -> NDArray[np.int64]:
        """Hinge indices of ``"arms"`` and of ``"hips"``, which are hips and trunk together."""
        chosen = {"arms": ("arm",), "hips": ("hip", "trunk")}
        parts = [self.joints[group] for name in names for group in chosen[name]]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, dtype=np.int64)


def joint_groups(body: BodyModel) -> JointGroups:
    """Sort the joints and segments of a body with two legs.

    Raises:
        BodyError: If it has not two legs of three segments that end in soles.
    """
    legs = [limb for limb in body.limbs if limb.kind is ContactKind.SOLE]
    if len(legs) != 2 or any(len(leg.segments) != 3 for leg in legs) or body.sole_length is None:
        raise BodyError(f"body {body.name!r} does not stand on two legs; valid: human, kudoh")
    arms = [limb for limb in body.limbs if limb.kind is not ContactKind.SOLE]
    toes = {leg.effector: end_segments(body, leg.effector)[1:] for leg in legs}
    parts = {
        "ankle": [name for leg in legs for name in (leg.segments[2], *toes[leg.effector])],
        "knee": [leg.segments[1] for leg in legs],
        "hip": [leg.segments[0] for leg in legs],
        "arm": [name for arm in arms for name in arm.segments],
    }
    sorted_out = {name for names in parts.values() for name in names}
    parts["trunk"] = [segment.name for segment in body.segments if segment.name not in sorted_out]
    hinges = {
        group: [body.joint_index(hinge.name) for name in names for hinge in body.segment(name).hinges]
        for group, names in parts.items()
    }
    joints = {group: np.array(numbers, dtype=np.int64) for group, numbers in hinges.items()}
    legs_down = (*parts["hip"], *parts["knee"], *parts["ankle"])
    segments = {"arms": tuple(parts["arm"]), "trunk": tuple(parts["trunk"]), "legs": legs_down}
    return JointGroups((legs[0].effector, legs[1].effector), joints, segments)


@dataclass(frozen=True, eq=False)
class LinearMap:
    """A value ``matrix @ phi'' + offset``.

    Attributes:
        matrix: (m, k).
        offset: (m,).
    """

    matrix: FloatArray
    offset: FloatArray

    @classmethod
    def none(cls, size: int) -> "LinearMap":
        """No value at all, of ``size`` accelerations."""
        return cls(np.zeros((0, size)), np.zeros(0))

    def joined(self, other: "LinearMap") -> "LinearMap":
        """Both values, one after the other."""
        matrix = np.concatenate((self.matrix, other.matrix))
        return LinearMap(matrix, np.concatenate((self.offset, other.offset)))

    def __call__(self, phi: FloatArray) -> FloatArray:
        """(m,) value at the accelerations (k,)."""
        return self.matrix @ phi + self.offset


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """Linear maps of the accelerations ``phi''`` (k,) at one state ([Kudoh2002]_ 2.4-2.6).

    Attributes:
        acceleration: (nv,) generalised acceleration.
        joints: (nv - 6,) joint accelerations, ``J phi'' + k``.
        com: (3,) acceleration of the centre of mass [m/s^2].
        force: (3,) force of the ground, ``C_f phi'' + d_f`` [N].
        moment: (3,) moment of the ground about the centre of mass, ``C_n phi'' + d_n`` [N.m].
    """

    acceleration: LinearMap
    joints: LinearMap
    com: LinearMap
    force: LinearMap
    moment: LinearMap

    @property
    def size(self) -> int:
        """Number k of degrees of freedom."""
        return self.acceleration.matrix.shape[1]


@dataclass(frozen=True, eq=False)
class FeltPush:
    """What pushes the body besides the ground.

    Attributes:
        wrench: (6,) force [N] and moment about the world's origin [N.m].
        generalised: (nv,) the same on the generalised coordinates.
    """

    wrench: FloatArray
    generalised: FloatArray

    @classmethod
    def none(cls, nv: int) -> "FeltPush":
        """Nothing pushes."""
        return cls(np.zeros(6), np.zeros(nv))


def close_loop(
    state: DynamicsState, feet: tuple[str, ...], push: FeltPush, *, settling: float = 0.0
) -> ClosedLoop:
    """Find the linear maps of the accelerations at a state with a frame for each foot.

    The feet do not move; what they move all the same is damped at the rate ``settling`` [1/s].
    """
    frames = [state.frames[name] for name in feet]
    jacobian = np.concatenate([frame.jacobian for frame in frames])
    wanted = np.concatenate([-frame.drift - settling * frame.twist for frame in frames])
    held, factors = len(wanted), np.linalg.qr(jacobian.T, mode="complete")
    unmoved: FloatArray = np.asarray(np.linalg.solve(factors.R[:held].T, wanted), dtype=np.float64)
    drift: FloatArray = factors.Q[:, :held] @ unmoved
    basis = factors.Q[:, held:]
    rate: FloatArray = state.centroidal_map @ basis
    offset: FloatArray = state.centroidal_map @ drift + state.momentum_drift
    weight, push_force = np.array([0.0, 0.0, state.mass * GRAVITY]), push.wrench[:3]
    return ClosedLoop(
        LinearMap(basis, drift), LinearMap(basis[6:], drift[6:]),
        com=LinearMap(rate[:3] / state.mass, offset[:3] / state.mass),
        force=LinearMap(rate[:3], offset[:3] + weight - push_force),
        moment=LinearMap(rate[3:], offset[3:] - (push.wrench[3:] - skew(state.com) @ push_force)),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class SupportArea:
    """A convex area of the ground.

    Attributes:
        corners: (k, 2) counter-clockwise [m].
        height: Of the ground [m].
    """

    corners: FloatArray
    height: float

    @classmethod
    def of(cls, soles: Sequence[Contact]) -> "SupportArea":
        """Hull of soles that lie on one level plane.

        Raises:
            InputError: If they do not.
        """
        points = np.concatenate([contact.points_in_world for contact in soles])
        heights = points[:, 2]
        if np.ptp(heights) > 1e-6:
            told = f"soles lie at heights from {heights.min():.3g} to {heights.max():.3g} m"
            raise InputError(f"{told}; valid: both on one level plane")
        return cls(convex_polygon(points[:, :2]), float(heights.mean()))

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) mean of the corners [m]."""
        return frozen_array(self.corners.mean(axis=0), "centre")

    def reach(self, point: FloatArray) -> float:
        """How far out a point (2,) is: 0 in the centre, 1 on the edge, more outside."""
        return float(np.max((self._edges[0] @ (point - self.centre)) / self._room))

    def inside(self, points: FloatArray) -> FloatArray:
        """Distance of points (..., 2) to the edge, negative outside [m]."""
        return signed_distance(points, self.corners)

    def shrunk(self, share: float) -> "SupportArea":
        """Share of the area about its centre."""
        return SupportArea(self.centre + share * (self.corners - self.centre), self.height)

    def nearest(self, point: FloatArray, inset: float) -> FloatArray:
        """Point (2,) drawn towards the centre until it is inside by ``inset`` [m]."""
        normals, offsets = self.half_planes(inset)
        along, room = normals @ (point - self.centre), offsets - normals @ self.centre
        return self.centre + (point - self.centre) / max(1.0, float(np.max(along / room)))

    def closest(self, point: FloatArray, inset: float = 0.0) -> FloatArray:
        """Point (2,) of the area, less ``inset`` [m] along its edge, that is nearest to a point (2,)."""
        normals, offsets = self.half_planes(inset)
        if np.all(normals @ point <= offsets):
            return point.copy()
        # Corner i of the smaller area is where the edges that meet in corner i of the area come to.
        before = np.roll(normals, 1, axis=0), np.roll(offsets, 1)
        corners = np.linalg.solve(
            np.stack((before[0], normals), axis=1), np.stack((before[1], offsets), axis=1)[..., None]
        )[..., 0]
        edges = np.roll(corners, -1, axis=0) - corners
        along = np.sum((point - corners) * edges, axis=1) / np.sum(edges**2, axis=1)
        nearest = corners + np.clip(along, 0.0, 1.0)[:, None] * edges
        return nearest[np.argmin(np.linalg.norm(nearest - point, axis=1))]

    def half_planes(self, inset: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Unit outward normals (k, 2) and offsets (k,) with ``normals @ p <= offsets`` inside."""
        normals, offsets = self._edges
        return normals, offsets - inset

    @cached_property
    def _edges(self) -> tuple[FloatArray, FloatArray]:
        """Normals (k, 2) and offsets (k,) of the edges."""
        along = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.column_stack((along[:, 1], -along[:, 0]))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        offsets = np.sum(normals * self.corners, axis=1)
        return frozen_array(normals, "normals"), frozen_array(offsets, "offsets")

    @cached_property
    def _room(self) -> FloatArray:
        """(k,) distances of the edges from the centre [m]."""
        normals, offsets = self._edges
        return offsets - normals @ self.centre


def zmp_rows(area: SupportArea, loop: ClosedLoop, com: FloatArray, inset: float) -> LinearMap:
    """Rows that are not positive when the ZMP is inside ([Kudoh2002]_ 2.39-2.44, z up).

    With the force ``f`` of the ground and its moment ``n`` about the centre of mass ``s``, the ZMP ``p`` at
    the height ``z`` has ``p_x f_z = s_x f_z + (z - s_z) f_x - n_y`` and
    ``p_y f_z = s_y f_z + (z - s_z) f_y + n_x``; the rows are ``normal . p f_z - offset f_z``, right where
    ``f_z > 0``, with the ZMP ``inset`` [m] from the edge.
    """
    normals, offsets = area.half_planes(inset)
    moments = _turned(loop.force.matrix, loop.moment.matrix, com, area.height)
    constant = _turned(loop.force.offset, loop.moment.offset, com, area.height)
    matrix = normals @ moments - offsets[:, None] * loop.force.matrix[2]
    return LinearMap(matrix, normals @ constant - offsets * loop.force.offset[2])


def zmp_of(force: FloatArray, moment: FloatArray, com: FloatArray, height: float) -> FloatArray:
    """(2,) ZMP of a force (3,) and its moment (3,) about the centre of mass [m]; NaN without load."""
    if force[2] <= 0.0:
        return np.full(2, np.nan)
    return _turned(force, moment, com, height) / force[2]


def _turned(force: FloatArray, moment: FloatArray, com: FloatArray, height: float) -> FloatArray:
    """(2, ...) ``p f_z`` for the ZMP ``p``."""
    drop = height - com[2]
    x, y = com[0] * force[2] + drop * force[0] - moment[1], com[1] * force[2] + drop * force[1] + moment[0]
    return np.stack((x, y))


@dataclass(frozen=True, eq=False)
class Standing:
    """A way to stand.

    Attributes:
        soles: The soles that carry; their effectors are the feet on the ground.
        area: Their hull, in which the ZMP may be.
        posture: (nv - 6,) joint angles to come back to [rad].
        com: (3,) centre of mass of that posture [m].
    """

    soles: tuple[Contact, ...]
    area: SupportArea
    posture: FloatArray
    com: FloatArray

    @classmethod
    def of(cls, body: BodyModel, q: ArrayLike, feet: Sequence[str], friction: float) -> "Standing":
        """Stand as in a posture ``q`` (nq,) on the soles of ``feet``, all on one level plane.

        Raises:
            InputError: If no foot carries or the soles are not level.
        """
        if not feet:
            raise InputError("no foot is on the ground; valid: one foot or two")
        state = Configuration(body, np.array(q, dtype=np.float64))
        soles = tuple(sole_at(body, name, *state.effector_placement(name), friction) for name in feet)
        return cls(soles, SupportArea.of(soles), state.q[7:].copy(), state.com.copy())

    @property
    def feet(self) -> tuple[str, ...]:
        """Effectors of the feet that carry."""
        return tuple(contact.effector for contact in self.soles)

    @property
    def height(self) -> float:
        """Of the centre of mass above the ground [m]."""
        return float(self.com[2] - self.area.height)


def sole_at(
    body: BodyModel, effector: str, rotation: FloatArray, position: FloatArray, friction: float
) -> Contact:
    """Whole sole of a foot, from its rotation (3, 3) to the world and its middle (3,) [m]."""
    length, width = float(body.sole_length or 0.0), float(body.sole_width or 0.0)
    return sole(effector, position, rotation=rotation, length=length, width=width, friction=friction)
