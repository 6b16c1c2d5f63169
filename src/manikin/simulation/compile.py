"""The body and the scene as a MuJoCo model, and the translation of states.

The model is built from the same neutral description as the Pinocchio one. It has one MuJoCo body per segment,
a free joint on the root, the segment's hinges in the same order, one torque motor per hinge, one geometry
``"segment/shape"`` per shape, one site ``"effector/<name>"`` per effector. Obstacles are static geometries.

The engines describe the free root differently. With ``R`` the rotation from the root's axes to the
world's and ``v = (v_l, w)``, ``a = (a_l, w')`` in the root's axes as in Pinocchio:

* MuJoCo's quaternion is wxyz, ours xyzw;
* its velocity is ``(R v_l, w)``: the linear part in world axes, the angular part in the root's;
* its acceleration is ``(R (a_l + w x v_l), w')``, the time derivative of that;
* its generalised force is ``(R f, m)`` for our ``(f, m)``, so that the power is the same.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Hinge, Segment, Shape, ShapeKind
from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray, cross, finite_number, rotation_from_normal
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere
from manikin.scene.mesh import MeshPiece


@dataclass(frozen=True)
class PhysicsOptions:
    """Settings of the compiled physics model.

    Attributes:
        timestep: [s]; 1 ms as in [Qiu2012]_ 6.1.
        friction: Coulomb coefficient between the body and the scene and of the body with itself.
        contact_friction: Pairs of a segment and a larger coefficient between it and the scene.
        segment_friction: Pairs of a segment and its coefficient to whatever it touches; such a one is soft.
        contact_time_constant: How fast a contact pushes penetration out [s]; at least two time steps.
        soft_time_constant: The same for segments with their own friction: flesh on a cushion [s].
        joint_damping: Passive torque per speed on each hinge [N.m.s/rad].
        least_inertia: Least inertia about a hinge of all that it moves [kg.m^2]; what lacks is added. 0 keeps
            the planning model's mass matrix.
        joint_limits: Whether hinges stop at the ends of their ranges.
        crossed: Boxes that soles lie across, see :func:`is_narrow`; they are convex meshes.
        self_collision: Whether :attr:`~manikin.body.BodyModel.collision_pairs` may touch.
    """

    timestep: float = 1e-3
    friction: float = 0.7
    contact_friction: tuple[tuple[str, float], ...] = ()
    segment_friction: tuple[tuple[str, float], ...] = ()
    contact_time_constant: float = 5e-3
    soft_time_constant: float = 0.012
    joint_damping: float = 0.0
    least_inertia: float = 0.0
    joint_limits: bool = True
    self_collision: bool = True
    crossed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("timestep", "friction", "contact_time_constant", "soft_time_constant"):
            finite_number(getattr(self, name), f"physics {name}", above=0.0)
        for segment, value in (*self.contact_friction, *self.segment_friction):
            finite_number(value, f"physics friction of {segment}", above=0.0)
        for name in ("joint_damping", "least_inertia"):
            finite_number(getattr(self, name), f"physics {name}", at_least=0.0)

    def with_friction(self, factor: float) -> "PhysicsOptions":
        """The same with all friction by a factor."""
        contact, segment = (
            tuple((name, factor * value) for name, value in pairs)
            for pairs in (self.contact_friction, self.segment_friction)
        )
        friction = factor * self.friction
        return replace(self, friction=friction, contact_friction=contact, segment_friction=segment)


_TURNING_FRICTION = (0.005, 0.0001)
"""The engine's own torsional and rolling friction, of no effect at contacts of three dimensions [m]."""

PREFIX = "scene/"
"""Geometries of obstacles are named ``scene/<obstacle>`` or ``scene/<obstacle>/<number>``."""

PLANE_THICKNESS = 2e-3
"""Thickness given to a two-sided plane, half on each side [m]."""
PLANE_HALF_SIZE = 50.0
"""Half the side of the square that stands for a two-sided plane [m]."""
SHEET_THICKNESS = 5e-3
"""Thickness given to each triangle of a mesh that is not convex, inwards [m]."""
MAX_SHEETS = 3000
"""More triangles than this in pieces that are not convex are refused."""

NARROW = 0.15
"""Largest side but one of a box that a sole lies across [m]; our choice."""

_GEOM = mujoco.mjtGeom


def add_scene(spec: Any, scene: Scene, contact: dict[str, Any], crossed: tuple[str, ...] = ()) -> None:
    """Add every obstacle to the world body of a ``mujoco.MjSpec``, with the same contact settings.

    A convex mesh piece becomes one convex geometry. One that is not, of which MuJoCo would take the hull,
    becomes a prism per triangle, :data:`SHEET_THICKNESS` thick towards its inside; too many are refused.
    Boxes that are ``crossed`` by soles are convex meshes as well, see :func:`is_narrow`.
    """
    for obstacle in scene:
        shape = obstacle.shape
        if isinstance(shape, Mesh):
            _add_mesh(spec, obstacle, shape, contact)
        elif isinstance(shape, Box) and obstacle.name in crossed:
            corners = 0.5 * shape.size * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
            _add_convex(spec, obstacle, f"{PREFIX}{obstacle.name}", corners, contact)
        else:
            kind, size, rotation, translation = _primitive(obstacle)
            spec.worldbody.add_geom(
                name=PREFIX + obstacle.name, type=kind, size=size, pos=translation,
                quat=quaternion(rotation), **contact,
            )  # fmt: skip


def obstacle_of(geom_name: str) -> str | None:
    """Name of the obstacle a geometry belongs to, or None for one of the body's."""
    if not geom_name.startswith(PREFIX):
        return None
    return geom_name.removeprefix(PREFIX).split("/")[0]


def quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) wxyz quaternion of a rotation matrix."""
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, np.ascontiguousarray(rotation, dtype=np.float64).ravel())
    return result


def _primitive(obstacle: Obstacle) -> tuple[Any, list[float], FloatArray, FloatArray]:
    """Kind, MuJoCo size (half lengths), rotation and translation."""
    shape, rotation, translation = obstacle.shape, obstacle.rotation, obstacle.translation
    if isinstance(shape, Box):
        return _GEOM.mjGEOM_BOX, list(shape.size / 2), rotation, translation
    if isinstance(shape, Sphere):
        return _GEOM.mjGEOM_SPHERE, [shape.radius, 0.0, 0.0], rotation, translation
    if isinstance(shape, Cylinder | Capsule):
        kind = _GEOM.mjGEOM_CYLINDER if isinstance(shape, Cylinder) else _GEOM.mjGEOM_CAPSULE
        return kind, [shape.radius, shape.length / 2, 0.0], rotation, translation
    assert isinstance(shape, (Plane, HalfSpace))
    normal, offset = obstacle.world_plane
    turned, place = rotation_from_normal(normal), normal * offset
    if isinstance(shape, HalfSpace):
        return _GEOM.mjGEOM_PLANE, [0.0, 0.0, 1.0], turned, place
    return _GEOM.mjGEOM_BOX, [PLANE_HALF_SIZE, PLANE_HALF_SIZE, PLANE_THICKNESS / 2], turned, place


def _add_mesh(spec: Any, obstacle: Obstacle, mesh: Mesh, contact: dict[str, Any]) -> None:
    sheets = sum(len(piece.faces) for piece in mesh.pieces if not piece.convex)
    if sheets > MAX_SHEETS:
        raise SceneError(
            f"obstacle {obstacle.name!r} has {sheets} triangles in pieces that are not convex; "
            f"valid: at most {MAX_SHEETS} to simulate, so decimate it or set convex to 'parts'"
        )
    for number, vertices in enumerate(body for piece in mesh.pieces for body in _convex_bodies(piece)):
        _add_convex(spec, obstacle, f"{PREFIX}{obstacle.name}/{number}", vertices, contact)


def _add_convex(
    spec: Any, obstacle: Obstacle, name: str, vertices: FloatArray, contact: dict[str, Any]
) -> None:
    """Add the hull of points (n, 3) of an obstacle's frame [m]."""
    item = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    item.uservert = (vertices @ obstacle.rotation.T + obstacle.translation).ravel()
    spec.worldbody.add_geom(name=name, type=_GEOM.mjGEOM_MESH, meshname=name, **contact)


def is_narrow(obstacle: Obstacle) -> bool:
    """Whether an obstacle is a box with two sides of at most :data:`NARROW`, such as a rung.

    A sole that lies across its edges touches it at four points.  The engine's own test of two boxes takes the
    crossing of two edges instead, a single point, as soon as their faces are not quite parallel: a foot on a
    rung rocks between the two and creeps off by millimetres a second.  Convex meshes have all the points.
    """
    return isinstance(obstacle.shape, Box) and float(np.sort(obstacle.shape.size)[1]) <= NARROW


def _convex_bodies(piece: MeshPiece) -> list[FloatArray]:
    """Vertices of the convex bodies that stand for a piece."""
    if piece.convex:
        return [piece.vertices]
    corners = piece.vertices[piece.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return list(np.concatenate([corners, corners - SHEET_THICKNESS * normals[:, None, :]], axis=1))


@dataclass(frozen=True, eq=False)
class SimulationModel:
    """A compiled body and scene with the translation of states from and to Pinocchio's.

    ``mujoco`` is the ``mujoco.MjModel``; make a ``MjData`` of it for each simulation.
    """

    body: BodyModel
    scene: Scene | None
    options: PhysicsOptions
    mujoco: Any = field(repr=False)

    def q_from_mujoco(self, qpos: ArrayLike) -> FloatArray:
        """(nq,) configuration of ``qpos``; its quaternion is normalised."""
        q = np.array(qpos, dtype=np.float64)
        q[6], q[3:6] = q[3], q[4:7].copy()
        q[3:7] /= math.sqrt(q[3:7].dot(q[3:7]))
        return q

    def v_to_mujoco(self, q: ArrayLike, v: ArrayLike) -> FloatArray:
        """(nv,) ``qvel`` of a velocity at configuration ``q``."""
        return _turned(root_rotation(q), v)

    def v_from_mujoco(self, qpos: ArrayLike, qvel: ArrayLike) -> FloatArray:
        """(nv,) velocity of ``qvel`` at ``qpos``."""
        return _turned(root_rotation(self.q_from_mujoco(qpos)).T, qvel)

    def a_from_mujoco(self, qpos: ArrayLike, qvel: ArrayLike, qacc: ArrayLike) -> FloatArray:
        """(nv,) acceleration of ``qacc`` at ``(qpos, qvel)``."""
        to_root = root_rotation(self.q_from_mujoco(qpos)).T
        speed, acceleration = _turned(to_root, qvel), _turned(to_root, qacc)
        acceleration[:3] -= cross(speed[3:6], speed[:3])
        return acceleration

    def set_state(self, data: Any, q: ArrayLike, v: ArrayLike | None = None) -> None:
        """Write a state into a ``MjData`` and bring its kinematics up to date."""
        data.qpos[:], (x, y, z, w) = q, np.asarray(q)[3:7]
        data.qpos[3:7] = w, x, y, z
        data.qvel[:] = 0.0 if v is None else self.v_to_mujoco(q, v)
        mujoco.mj_forward(self.mujoco, data)

    @cached_property
    def geom_names(self) -> tuple[str, ...]:
        """Name of each geometry: ``"segment/shape"`` or ``"scene/obstacle[/number]"``."""
        return tuple(self.mujoco.geom(number).name for number in range(self.mujoco.ngeom))

    def body_id(self, segment: str) -> int:
        """MuJoCo body id of a segment."""
        return self.mujoco.body(self.body.segment(segment).name).id

    def site_id(self, effector: str) -> int:
        """MuJoCo site id of an effector."""
        return self.mujoco.site(f"effector/{self.body.effector(effector).name}").id


def root_rotation(q: ArrayLike) -> FloatArray:
    """(3, 3) rotation from the root's axes to the world's of a configuration."""
    x, y, z, w = np.asarray(q, dtype=np.float64)[3:7].tolist()
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def _turned(rotation: FloatArray, vector: ArrayLike) -> FloatArray:
    """Copy of a velocity-like vector with its first three entries turned."""
    result = np.array(vector, dtype=np.float64)
    result[:3] = rotation @ result[:3]
    return result


def compile_model(
    body: BodyModel, scene: Scene | None = None, options: PhysicsOptions | None = None,
    held: Mapping[str, tuple[FloatArray, FloatArray]] | None = None,
) -> SimulationModel:  # fmt: skip
    """Compile a body and a scene to MuJoCo.

    By default (no damping, no least inertia) the mass matrix and the bias forces are those of Pinocchio.
    The pairs that may touch are :attr:`BodyModel.segment_pairs`; MuJoCo's filter of parents is off.

    Args:
        scene: Obstacles and floor; None for an empty world without a floor.
        options: Settings; defaults when None.
        held: Effectors welded to the world, by rotation (3, 3) and position (3,) [m], which pass through it.

    Raises:
        SceneError: If a mesh is too large to simulate.
    """
    options = options or PhysicsOptions()
    return SimulationModel(body, scene, options, model_spec(body, scene, options, held).compile())


def model_spec(
    body: BodyModel, scene: Scene | None, options: PhysicsOptions,
    held: Mapping[str, tuple[FloatArray, FloatArray]] | None = None,
) -> Any:  # fmt: skip
    """The ``mujoco.MjSpec`` that :func:`compile_model` compiles, of the same arguments."""
    spec = mujoco.MjSpec()
    spec.modelname = body.name
    spec.compiler.degree = False
    spec.compiler.balanceinertia = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.timestep = options.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0  # friction that stiff, against the normal direction, holds loaded feet still
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    _add_body(spec, body, options)
    allowed = {frozenset(pair) for pair in body.segment_pairs}
    for first, second in itertools.combinations([segment.name for segment in body.segments], 2):
        if frozenset((first, second)) not in allowed:
            spec.add_exclude(bodyname1=first, bodyname2=second)
    if scene is not None:
        add_scene(spec, scene, _contact(options, scenery=True), options.crossed)
    for name, (rotation, position) in (held or {}).items():
        _hold(spec, body, name, rotation, position)
    return spec


def _contact(options: PhysicsOptions, *, scenery: bool) -> dict[str, Any]:
    """Contact settings of a geometry; bits let body and scene touch, and body and body if wanted."""
    return {
        "friction": [options.friction, *_TURNING_FRICTION], "condim": 3,
        "solref": [options.contact_time_constant, 1.0],  # critically damped
        "contype": 2 if scenery else 1,
        "conaffinity": 1 if scenery else (3 if options.self_collision else 2),
    }  # fmt: skip


def _add_body(spec: Any, body: BodyModel, options: PhysicsOptions) -> None:
    made: dict[str, Any] = {}
    contact, lacking = _contact(options, scenery=False), lacking_inertia(body, options.least_inertia)
    for segment in body.segments:
        parent = spec.worldbody if segment.parent is None else made[segment.parent]
        item = parent.add_body(name=segment.name, pos=segment.origin)
        made[segment.name] = item
        item.explicitinertial, item.mass, item.ipos = True, segment.mass, segment.com
        item.fullinertia = segment.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        if segment.parent is None:
            item.add_freejoint(name="root", align=mujoco.mjtAlignFree.mjALIGNFREE_FALSE)
        for hinge in segment.hinges:
            _add_hinge(spec, item, hinge, options, lacking[hinge.name])
        friction = dict(options.contact_friction).get(segment.name)
        soft = dict(options.segment_friction).get(segment.name)
        # Of two geometries the engine takes the larger friction.
        special = {} if friction is None else {"friction": [friction, *_TURNING_FRICTION]}
        if soft is not None:  # soft flesh, whose settings count before those of what it touches
            special = {
                "friction": [soft, *_TURNING_FRICTION], "solref": [options.soft_time_constant, 1.0],
                "priority": 1, "solimp": [*SOFT_IMPEDANCE, 0.5, 2.0],
            }  # fmt: skip
        for shape in segment.shapes:
            _add_shape(item, segment, shape, contact | special)
    for effector in body.effectors.values():
        made[effector.segment].add_site(
            name=f"effector/{effector.name}", pos=effector.translation, quat=quaternion(effector.rotation)
        )


SOFT_IMPEDANCE = (0.3, 0.8, 0.005)
"""Impedance of soft flesh in the engine at first touch and at a depth, the third value [m]. Low ones give way
under load, so that a body slides on a cushion instead of bouncing along it."""


def lacking_inertia(body: BodyModel, least: float) -> dict[str, float]:
    """Inertia that what each hinge moves has less than the least, standing [kg.m^2], by the hinge's name."""
    model = body.pinocchio
    own = np.diag(pin.crba(model, model.createData(), body.standing_posture()))[6:]
    return dict(zip(body.joint_names, np.maximum(least - own, 0.0).tolist(), strict=True))


def _add_hinge(spec: Any, item: Any, hinge: Hinge, options: PhysicsOptions, armature: float) -> None:
    item.add_joint(
        name=hinge.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=hinge.axis, pos=[0.0, 0.0, 0.0],
        limited=options.joint_limits, range=[hinge.lower, hinge.upper],
        damping=[options.joint_damping, 0.0, 0.0], armature=armature,
    )  # fmt: skip
    motor = spec.add_actuator(
        name=hinge.name, target=hinge.name, trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrllimited=True, ctrlrange=[hinge.torque_lower, hinge.torque_upper],
    )  # fmt: skip
    motor.set_to_motor()


def _add_shape(item: Any, segment: Segment, shape: Shape, contact: dict[str, Any]) -> None:
    size = np.zeros(3)
    size[: len(shape.size)] = shape.size
    if shape.kind == ShapeKind.CAPSULE:
        size[1] /= 2.0
    elif shape.kind == ShapeKind.BOX:
        size /= 2.0
    item.add_geom(
        name=f"{segment.name}/{shape.name}", type=getattr(_GEOM, f"mjGEOM_{shape.kind.name}"), size=size,
        mass=0.0, pos=shape.translation, quat=quaternion(shape.rotation), **contact,
    )  # fmt: skip


def _hold(spec: Any, body: BodyModel, name: str, rotation: FloatArray, position: FloatArray) -> None:
    """Weld an effector to a place of the world, stiffly, in place of its contacts with the scene."""
    spec.worldbody.add_site(name=f"held/{name}", pos=position, quat=quaternion(rotation))
    spec.add_equality(
        name=f"held/{name}", type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=f"effector/{name}", name2=f"held/{name}", solref=[2.0 * spec.option.timestep, 1.0],
        solimp=[0.999, 0.9999, 0.001, 0.5, 2.0],
    )  # fmt: skip
    spec.add_exclude(bodyname1=body.effector(name).segment, bodyname2="world")
