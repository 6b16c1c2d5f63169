"""The body: one neutral description and the engine models built from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from itertools import combinations
from math import fsum
from types import MappingProxyType
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

import manikin.runtime.coal_workarounds  # noqa: F401  (before the first distance)
from manikin.body.segments import (
    FEET,
    Effector,
    Hinge,
    Limb,
    Segment,
    Shape,
    ShapeKind,
    check_limbs,
    segments_by_name,
)
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.runtime.display import Displayed

OFF_AXIS = "off axis"
"""Value of ``masses`` in a signature of :attr:`BodyModel.off_axis_masses`."""

_MAPPINGS = ("effectors", "standing_angles", "lengths", "loads")


def _of_hinges(name: str) -> cached_property[FloatArray]:
    """Attribute of a body with one value of every hinge."""
    return cached_property(lambda body: frozen_array([getattr(hinge, name) for hinge in body.hinges], name))


@dataclass(frozen=True, eq=False, repr=False)
class BodyModel(Displayed):
    """A floating tree of rigid segments on hinges.

    The configuration vector is ``q = [root position (3), root quaternion xyzw (4), hinge angles]`` and the
    velocity ``v = [root linear (3), root angular (3), hinge rates]`` with the root's parts in the *root
    segment's* axes, as in Pinocchio. Make a human with :func:`manikin.body.human`.

    Attributes:
        name: What the body is.
        segments: The segments, parents first; the first is the free root.
        effectors: Effectors by name.
        standing_angles: Hinge angles of the standing posture [rad]; hinges left out are 0.
        soft_pairs: Pairs of segments, not adjacent, that are not checked for collision, because a short link
            or soft flesh lies between them.
        stature: Sole to vertex [m], or None for another creature.
        sex: ``"male"``, ``"female"`` or None.
        sole_length: Length of the sole rectangles [m], or None.
        sole_width: Width of the sole rectangles [m], or None.
        nominal_mass: The mass that was asked for [kg]; the segments must add up to it.
        limbs: The limbs with which it makes contacts, see :mod:`manikin.body.limbs`.
        age: Of a human [years], or None.
        strength: Torque limits relative to those of a healthy human of that sex, size and age.
        lengths: Lengths of a human that were measured instead of scaled [m].
        off_axis_masses: Whether a human's centres of mass lie off the lines between joints.
        loads: What each hand carries [kg], by the name of its effector, as part of the hand's segment, see
            :func:`manikin.body.strength.carrying`.
    """

    name: str
    segments: tuple[Segment, ...]
    effectors: Mapping[str, Effector]
    standing_angles: Mapping[str, float] = field(default_factory=dict)
    soft_pairs: frozenset[frozenset[str]] = frozenset()
    stature: float | None = None
    sex: str | None = None
    sole_length: float | None = None
    sole_width: float | None = None
    nominal_mass: float | None = None
    limbs: tuple[Limb, ...] = ()
    age: float | None = None
    strength: float = 1.0
    lengths: Mapping[str, float] = field(default_factory=dict)
    off_axis_masses: bool = False
    loads: Mapping[str, float] = field(default_factory=dict)

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        stature = {} if self.stature is None else {"stature": f"{self.stature:.2f} m"}
        return {
            "name": self.name, **stature, "mass": f"{self.mass:.1f} kg", "segments": str(len(self.segments)),
            "hinges": str(len(self.joint_names)), "limbs": str(len(self.limbs)),
        }  # fmt: skip

    def __post_init__(self) -> None:
        index = segments_by_name(self.segments)
        for effector in self.effectors.values():
            if effector.segment not in index:
                raise BodyError(
                    f"effector {effector.name!r} is on {effector.segment!r}; valid: one of {list(index)}"
                )
        check_limbs(self.limbs, index, self.effectors)
        unknown = set(self.standing_angles) - set(self.joint_names)
        if unknown:
            raise BodyError(f"standing angle of {min(unknown)!r}; valid: one of {list(self.joint_names)}")
        total = fsum(segment.mass for segment in self.segments)
        if self.nominal_mass is not None and abs(total - self.nominal_mass) > 1e-12 * total:
            raise BodyError(f"segments weigh {total!r} kg; valid: {self.nominal_mass!r} kg")
        for name in _MAPPINGS:
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what describes the body, for other processes; what was computed from it is left out."""
        given = {each.name: getattr(self, each.name) for each in fields(self)}
        plain = {name: dict(given[name]) for name in _MAPPINGS}
        return partial(BodyModel, **(given | plain)), ()

    @cached_property
    def mass(self) -> float:
        """Total mass, with what the hands carry [kg]."""
        nominal = self.nominal_mass
        return fsum(segment.mass for segment in self.segments) if nominal is None else nominal

    @property
    def own_mass(self) -> float:
        """Mass without what the hands carry [kg]."""
        return self.mass - fsum(self.loads.values())

    @cached_property
    def hinges(self) -> tuple[Hinge, ...]:
        """Every hinge, in the order of ``q[7:]``."""
        return tuple(hinge for segment in self.segments for hinge in segment.hinges)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """(nv - 6) hinge names, in the order of ``q[7:]``."""
        return tuple(hinge.name for hinge in self.hinges)

    @property
    def is_point_mass(self) -> bool:
        """Whether it is one ball without joints, on massless feet."""
        return len(self.segments) == 1 and not self.effectors

    @property
    def nv(self) -> int:
        """Size of the velocity vector."""
        return 6 + len(self.hinges)

    @property
    def nq(self) -> int:
        """Size of the configuration vector."""
        return 7 + len(self.hinges)

    lower = _of_hinges("lower")
    """(nv - 6,) smallest hinge angles [rad]."""
    upper = _of_hinges("upper")
    """(nv - 6,) largest hinge angles [rad]."""
    velocity_limit = _of_hinges("velocity_limit")
    """(nv - 6,) largest hinge speeds [rad/s]."""
    torque_lower = _of_hinges("torque_lower")
    """(nv - 6,) most negative hinge torques [N.m]."""
    torque_upper = _of_hinges("torque_upper")
    """(nv - 6,) largest hinge torques [N.m]."""

    def torque_share(self, torque: ArrayLike) -> FloatArray:
        """(..., nv - 6) hinge torques [N.m] over the limits in their directions: at least 0, 1 at a limit."""
        given = np.asarray(torque, dtype=np.float64)
        return np.maximum(given / self.torque_upper, given / self.torque_lower)

    @cached_property
    def _segment_index(self) -> Mapping[str, Segment]:
        return segments_by_name(self.segments)

    def segment(self, name: str) -> Segment:
        """Segment by name; BodyError if there is none."""
        return look_up(self._segment_index, name, "segment")

    def effector(self, name: str) -> Effector:
        """Effector by name; BodyError if there is none."""
        return look_up(self.effectors, name, "effector")

    def joint_index(self, name: str) -> int:
        """Position of a hinge among the ``nv - 6`` hinges; add 7 for ``q`` and 6 for ``v``."""
        return look_up(self._joint_index, name, "hinge")

    @cached_property
    def _joint_index(self) -> Mapping[str, int]:
        return {name: number for number, name in enumerate(self.joint_names)}

    @cached_property
    def pinocchio(self) -> Any:
        """The ``pin.Model``; shared by everyone, so never change it.

        Joint ``"root"`` is the free flyer, then one revolute joint per hinge with the hinge's name. Every
        segment and effector has a frame ``"segment/<name>"`` or ``"effector/<name>"``.
        """
        return _build_pinocchio(self)

    @cached_property
    def geometry(self) -> Any:
        """The ``pin.GeometryModel`` of shapes ``"segment/shape"``, with its pairs; never change it."""
        return _build_geometry(self)

    @cached_property
    def _effector_frames(self) -> Mapping[str, int]:
        return {name: self.pinocchio.getFrameId(f"effector/{name}") for name in self.effectors}

    @cached_property
    def _segment_frames(self) -> Mapping[str, int]:
        return {s.name: self.pinocchio.getFrameId(f"segment/{s.name}") for s in self.segments}

    def effector_frame(self, name: str) -> int:
        """Pinocchio frame id of an effector; BodyError if there is none."""
        return look_up(self._effector_frames, name, "effector")

    def segment_frame(self, name: str) -> int:
        """Pinocchio frame id of a segment; BodyError if there is none."""
        return look_up(self._segment_frames, name, "segment")

    @cached_property
    def segment_pairs(self) -> tuple[tuple[str, str], ...]:
        """Segments that must not touch: all but those that overlap at a joint, and :attr:`soft_pairs`."""
        skipped = {frozenset((s.name, s.parent)) for s in self.segments} | self.soft_pairs
        names = (segment.name for segment in self.segments)
        return tuple((a, b) for a, b in combinations(names, 2) if frozenset((a, b)) not in skipped)

    @cached_property
    def collision_pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs of shapes ``("segment/shape", "segment/shape")`` that must not touch."""
        return tuple(
            (f"{a}/{first.name}", f"{b}/{second.name}")
            for a, b in self.segment_pairs
            for first in self.segment(a).shapes
            for second in self.segment(b).shapes
        )

    def zero_posture(self) -> FloatArray:
        """(nq,) root at the world's origin, every hinge at 0."""
        q = np.zeros(self.nq)
        q[6] = 1.0
        return q

    def posture(self, angles: Mapping[str, float]) -> FloatArray:
        """(nq,) root at the world's origin, the named hinges at the given angles [rad], others 0."""
        q = self.zero_posture()
        for name, angle in angles.items():
            q[7 + self.joint_index(name)] = angle
        return q

    def standing_posture(self) -> FloatArray:
        """(nq,) standing upright: soles flat on z = 0, root at x = y = 0, heading along x.

        A creature without soles has the ends of its limbs at that height on average.
        """
        q = self.posture(self.standing_angles)
        soles = [name for name in FEET if name in self.effectors]
        soles = soles or [limb.effector for limb in self.limbs]
        if soles:
            data = self.pinocchio.createData()
            pin.framesForwardKinematics(self.pinocchio, data, q)
            q[2] -= float(np.mean([data.oMf[self.effector_frame(name)].translation[2] for name in soles]))
        return q

    def signature(self) -> dict[str, str | float]:
        """Name of the body and the arguments of its maker, from which a file builds it again."""
        values = {
            "model": self.name, "stature": self.stature, "mass": self.own_mass, "sex": self.sex,
            "sole_length": self.sole_length, "sole_width": self.sole_width,
        }  # fmt: skip
        values |= {"age": self.age} | ({} if self.strength == 1.0 else {"strength": self.strength})
        values |= {f"{name}_length": value for name, value in self.lengths.items()}
        values |= {f"{name}_load": value for name, value in self.loads.items()}
        if self.off_axis_masses:
            values["masses"] = OFF_AXIS
        return {key: value for key, value in values.items() if value is not None}


def look_up(index: Mapping[str, Any], name: str, kind: str) -> Any:
    """Item by name; BodyError with the valid names of its kind if there is none."""
    try:
        return index[name]
    except KeyError:
        raise BodyError(f"no {kind} {name!r}; valid: {', '.join(index) or 'none'}") from None


def _build_pinocchio(body: BodyModel) -> Any:
    model = pin.Model()
    model.name = body.name
    joint_of: dict[str, int] = {}
    frame_of: dict[str, int] = {}
    for segment in body.segments:
        attachment = pin.SE3(np.eye(3), np.array(segment.origin))
        if segment.parent is not None:  # in the joint that carries the parent
            attachment = model.frames[frame_of[segment.parent]].placement * attachment
        joint, placement = _add_joints(model, segment, attachment, joint_of)
        inertia = pin.Inertia(segment.mass, np.array(segment.com), np.array(segment.inertia))
        model.appendBodyToJoint(joint, inertia, placement)
        joint_of[segment.name] = joint
        parent_frame = frame_of.get(segment.parent or "", 0)
        frame = pin.Frame(f"segment/{segment.name}", joint, parent_frame, placement, pin.FrameType.BODY)
        frame_of[segment.name] = model.addFrame(frame, False)
    for effector in body.effectors.values():
        carrier = model.frames[frame_of[effector.segment]]
        placement = carrier.placement * pin.SE3(np.array(effector.rotation), np.array(effector.translation))
        name, parent_frame = f"effector/{effector.name}", frame_of[effector.segment]
        model.addFrame(pin.Frame(name, carrier.parentJoint, parent_frame, placement, pin.FrameType.OP_FRAME))
    model.lowerPositionLimit[:7], model.upperPositionLimit[:7] = -np.inf, np.inf
    return model


def _add_joints(
    model: Any, segment: Segment, attachment: Any, joint_of: Mapping[str, int]
) -> tuple[int, Any]:
    """Add the segment's hinges as a chain of massless links; its carrying joint and placement in that."""
    if segment.parent is None:
        return model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root"), pin.SE3.Identity()
    joint = joint_of[segment.parent]
    for hinge in segment.hinges:
        joint = model.addJoint(
            joint, _revolute(hinge.axis), attachment, hinge.name, np.array([hinge.torque_upper]),
            np.array([hinge.velocity_limit]), np.array([hinge.lower]), np.array([hinge.upper]),
        )  # fmt: skip
        model.lowerEffortLimit[model.joints[joint].idx_v] = hinge.torque_lower
        attachment = pin.SE3.Identity()
    return joint, attachment


def _revolute(axis: FloatArray) -> Any:
    aligned = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
    for direction, joint in zip(np.eye(3), aligned, strict=True):
        if np.array_equal(axis, direction):
            return joint()
    return pin.JointModelRevoluteUnaligned(np.array(axis))


def _build_geometry(body: BodyModel) -> Any:
    geometry = pin.GeometryModel()
    for segment in body.segments:
        frame_id = body.segment_frame(segment.name)
        frame = body.pinocchio.frames[frame_id]
        for shape in segment.shapes:
            placement = frame.placement * pin.SE3(np.array(shape.rotation), np.array(shape.translation))
            name, solid = f"{segment.name}/{shape.name}", coal_shape(shape)
            geometry.addGeometryObject(
                pin.GeometryObject(name, frame.parentJoint, frame_id, placement, solid)
            )
    for pair in body.collision_pairs:
        geometry.addCollisionPair(pin.CollisionPair(*(geometry.getGeometryId(name) for name in pair)))
    return geometry


def coal_shape(shape: Shape) -> Any:
    """The Coal shape of a neutral one; capsules lie along their local z axis."""
    kinds = {ShapeKind.SPHERE: coal.Sphere, ShapeKind.CAPSULE: coal.Capsule, ShapeKind.BOX: coal.Box}
    return kinds[shape.kind](*shape.size.tolist())
