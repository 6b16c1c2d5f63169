"""MuJoCo's robot descriptions (MJCF) as the links and joints that URDF would have for them.

MuJoCo's compiler resolves defaults, angles, frames and the inertia of geometries. Before, all that says
nothing of the robot is taken out of the file, and what would read other files or multiply elements is
refused; meshes are read here, so that the compiler opens no file. A body with several hinges is a chain of
links without mass, ``BODY/HINGE``, as many as there are hinges less one; a hinge that is not at the origin
of its body has a link of its own above the body.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body.segments import ShapeKind
from manikin.body.urdf import (
    CONTINUOUS,
    FARTHEST,
    HEAVIEST,
    MAX_LINKS,
    MAX_MESH_BYTES,
    Urdf,
    UrdfJoint,
    UrdfLink,
    UrdfShape,
    check_unique,
    parsed_file,
    rounded_cylinder,
    shape_around,
)
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray
from manikin.runtime.quiet_engine import quiet_engine

MAX_ELEMENTS = 20_000
"""Most elements of a file; humanoids with hands have about a thousand."""

_MOTORS = frozenset({"general", "motor", "position", "velocity", "intvelocity", "damper"})
_KEPT = {
    "mujoco": frozenset({"compiler", "default", "asset", "worldbody", "actuator"}),
    "default": frozenset({"default", "mesh", "geom", "joint", *_MOTORS}),
    "asset": frozenset({"mesh"}),
    "worldbody": frozenset({"body", "frame"}),
    "body": frozenset({"body", "frame", "geom", "joint", "freejoint", "inertial"}),
    "frame": frozenset({"body", "frame", "geom", "joint", "freejoint", "inertial"}),
    "actuator": _MOTORS,
}
"""Elements that say something of a robot, by what they are in; others are passed over."""
_REFUSED = ("include", "attach", "replicate", "composite", "flexcomp", "plugin")
"""Elements that read other files or make many of one."""
_TIES = ("equality", "deformable")
"""Sections of the file that tie bodies or joints together."""
_FILE_PLACES = ("meshdir", "texturedir", "assetdir", "strippath")
_MESH_ENDINGS = (".stl", ".obj", ".msh")


def read_mjcf(path: str | Path, speed: float) -> Urdf:
    """Read the one robot of an MJCF file; what else is fixed to the world is left out.

    Torque limits are those of ``actuatorfrcrange`` and of the actuators: ``forcerange``, or ``ctrlrange``
    times gain of a motor. Geometries that cannot touch anything, reflected inertia, damping, friction,
    tendons and contact settings are left out.

    Args:
        path: The file. Meshes are looked for where it says, in its folder or one below.
        speed: Velocity limit of all joints, of which MJCF has none [rad/s].

    Raises:
        BodyError: If the file is missing, no MJCF, holds no or several robots, or has what is not understood.
    """
    import mujoco  # here, so that bodies from elsewhere do not wait for it

    file = Path(path)
    root = parsed_file(file, "mujoco", "an MJCF file")
    assets = _prepare(root, file)
    try:
        with quiet_engine():
            model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"), assets)
    except Exception as error:  # ValueError, or FatalError of the engine
        reason = " ".join(str(error).split("Element '")[0].split())[:200]
        raise BodyError(f"{file}: cannot be compiled ({reason}); valid: an MJCF file") from None
    robot = _Robot(model, str(file), speed)
    links = list(robot.links())
    check_unique([link.name for link, _ in links], "body", str(file))
    joints = {joint.child: joint for _, joint in links if joint is not None}
    return Urdf(root.get("model") or file.stem, {link.name: link for link, _ in links}, joints)


# --- The file ----------------------------------------------------------------------------------


def _prepare(root: Element, file: Path) -> dict[str, bytes]:
    """Take out of a parsed file what is not needed, and return its meshes by new names."""
    elements = list(root.iter())
    if len(elements) > MAX_ELEMENTS:
        raise BodyError(f"{file}: {len(elements)} elements; valid: at most {MAX_ELEMENTS}")
    refused = [element for element in elements if element.tag in _REFUSED]
    for element in (*refused, *(element for tag in _TIES for element in root.findall(tag) if len(element))):
        raise BodyError(f"{file}: has <{element.tag}>; valid: one file, joints that move on their own")
    if (count := sum(element.tag == "body" for element in elements)) > MAX_LINKS:
        raise BodyError(f"{file}: {count} bodies; valid: at most {MAX_LINKS}")
    for element in elements:  # the compiler takes negative ones for 0
        for key in ("mass", "density", "diaginertia"):
            if (text := element.get(key)) is not None and "-" in text.replace("e-", "").replace("E-", ""):
                raise BodyError(f"{file}: <{element.tag}> has {key} {text[:40]!r}; valid: not below 0")
    places = [element.attrib for element in root.iter("compiler")]
    folder = next((item[key] for key in ("meshdir", "assetdir") for item in places if key in item), "")
    waiting = [root]
    while waiting:
        element = waiting.pop()
        kept = _KEPT.get(element.tag, frozenset())
        for child in list(element):
            if child.tag not in kept or (
                child.tag in _MOTORS and element.tag == "actuator" and "joint" not in child.attrib
            ):
                element.remove(child)
        for key in ("material", "hfield", *_FILE_PLACES):
            element.attrib.pop(key, None)
        waiting += element
    return _meshes(root, file, folder)


def _meshes(root: Element, file: Path, folder: str) -> dict[str, bytes]:
    """Contents of the mesh files of a robot by the names that its meshes have then."""
    assets = dict[str, bytes]()
    for number, mesh in enumerate(item for asset in root.findall("asset") for item in asset):
        if "builtin" in mesh.attrib:
            raise BodyError(f"{file}: a mesh is built in; valid: a file or vertices")
        place = mesh.get("file")
        if place is None:
            continue
        name = mesh.get("name") or Path(place).stem
        found = next((at for at in (file.parent / folder / place, file.parent / place) if at.is_file()), None)
        if found is None or found.suffix.lower() not in _MESH_ENDINGS:
            problem = f"{file}: mesh {place[:200]!r} " + (
                "is not found" if found is None else "has this ending"
            )
            raise BodyError(f"{problem}; valid: a file of {', '.join(_MESH_ENDINGS)}")
        if (size := found.stat().st_size) > MAX_MESH_BYTES:
            raise BodyError(f"mesh '{found}' has {size} bytes; valid: at most {MAX_MESH_BYTES}")
        key = f"{number}{found.suffix.lower()}"
        assets[key] = found.read_bytes()
        mesh.attrib |= {"name": name, "file": key}
    return assets


# --- The compiled model ------------------------------------------------------------------------


class _Robot:
    """The links of the robot of a compiled model."""

    def __init__(self, model: Any, where: str, speed: float) -> None:
        self.model, self.where, self.speed = model, where, speed
        self.hulls = dict[int, UrdfShape]()
        self.root = self._only_robot()

    def _only_robot(self) -> int:
        """Number of the body that the robot hangs on, the one of the world's that moves or carries joints."""
        model = self.model
        tops = [k for k in range(1, model.nbody) if model.body_parentid[k] == 0 and model.body_mocapid[k] < 0]
        jointed = {int(model.body_rootid[k]) for k in model.jnt_bodyid}
        robots = [k for k in tops if k in jointed] or tops
        if len(robots) != 1:
            names = [model.body(k).name for k in robots][:20]
            raise BodyError(f"{self.where}: robots are {names}; valid: one body of the world with joints")
        return robots[0]

    def links(self) -> Iterator[tuple[UrdfLink, UrdfJoint | None]]:
        """Links, parents first, each with the joint above it."""
        model = self.model
        for number in range(1, model.nbody):
            if model.body_rootid[number] == self.root:
                name = model.body(number).name
                if not name:
                    raise BodyError(f"{self.where}: a body has no name; valid: a name")
                yield from self._links_of(number, name, f"{self.where}: body {name!r}")

    def _links_of(self, number: int, name: str, where: str) -> Iterator[tuple[UrdfLink, UrdfJoint | None]]:
        model, first = self.model, int(self.model.body_jntadr[number])
        joints = [model.joint(first + k) for k in range(int(model.body_jntnum[number]))]
        link = self._link(number, name, where)
        if number == self.root:
            if any(joint.type[0] != 0 for joint in joints):
                raise BodyError(f"{where} turns on the world; valid: a free joint, or none")
            yield link, None
            return
        turn = _rotation(model.body_quat[number], where)
        parent, place = model.body(int(model.body_parentid[number])).name, np.array(model.body_pos[number])
        _check_place(place, where)
        if not joints:
            yield link, _fixed(name, parent, turn, place)
            return
        here = np.zeros(3)  # origin of the link above in the body's axes at angles zero
        for joint in joints:
            at = np.array(joint.pos)
            last = joint is joints[-1] and not np.any(at)
            child = name if last else f"{name}/{joint.name}"
            made = self._hinge(joint, parent, child, turn, place + turn @ (at - here), where)
            yield (link if last else _empty(child)), made
            parent, turn, place, here = child, np.eye(3), np.zeros(3), at
        if np.any(here):
            yield link, _fixed(name, parent, np.eye(3), -here)

    def _link(self, number: int, name: str, where: str) -> UrdfLink:
        model = self.model
        mass, com = float(model.body_mass[number]), np.array(model.body_ipos[number])
        turn = _rotation(model.body_iquat[number], f"{where} inertia")
        inertia = turn @ np.diag(model.body_inertia[number]) @ turn.T
        if not 0.0 <= mass <= HEAVIEST:
            raise BodyError(f"{where} mass is {mass:g}; valid: 0 to {HEAVIEST:g} kg")
        if not np.abs(inertia).max() <= HEAVIEST * FARTHEST**2:
            raise BodyError(f"{where} inertia is too large; valid: at most {HEAVIEST * FARTHEST**2:g} kg.m^2")
        _check_place(com, where)
        first, count = int(model.body_geomadr[number]), int(model.body_geomnum[number])
        shapes = tuple(
            self._shape(k, where)
            for k in range(first, first + count)
            if model.geom_contype[k] or model.geom_conaffinity[k]
        )
        return UrdfLink(name, mass, com, 0.5 * (inertia + inertia.T), shapes)

    def _shape(self, geom: int, where: str) -> UrdfShape:
        """A geometry as a sphere, capsule or box."""
        item = self.model.geom(geom)
        size = np.array(item.size)
        kind = str(_type_name(int(item.type[0])))
        if kind == "mesh":
            own = self._hull(int(item.dataid[0]))
        elif kind == "sphere":
            own = UrdfShape(ShapeKind.SPHERE, size[:1])
        elif kind == "capsule":
            own = UrdfShape(ShapeKind.CAPSULE, size[:2] * (1.0, 2.0))
        elif kind == "cylinder":
            own = rounded_cylinder(size[0], 2.0 * size[1])
        elif kind in ("box", "ellipsoid"):
            own = UrdfShape(ShapeKind.BOX, 2.0 * size)
        else:
            valid = "sphere, capsule, cylinder, box, ellipsoid, mesh"
            raise BodyError(f"{where} has a geometry of type {kind}; valid: {valid}")
        if not (np.all(own.size > 0.0) and np.all(own.size <= FARTHEST)):
            raise BodyError(
                f"{where} has a size of {own.size.tolist()}; valid: > 0 and at most {FARTHEST:g} m"
            )
        turn, place = _rotation(item.quat, where), np.array(item.pos)
        _check_place(place, where)
        return UrdfShape(own.kind, own.size, turn @ own.rotation, place + turn @ own.translation)

    def _hull(self, mesh: int) -> UrdfShape:
        """The shape around a mesh; limbs often have one in common."""
        if mesh not in self.hulls:
            first, count = int(self.model.mesh_vertadr[mesh]), int(self.model.mesh_vertnum[mesh])
            points = np.array(self.model.mesh_vert[first : first + count], dtype=np.float64)
            self.hulls[mesh] = shape_around(points)
        return self.hulls[mesh]

    def _hinge(
        self, joint: Any, parent: str, child: str, turn: FloatArray, place: FloatArray, where: str
    ) -> UrdfJoint:
        kind = _JOINT_TYPES[int(joint.type[0])]
        if not joint.name:
            raise BodyError(f"{where} has a joint without a name; valid: a name")
        where = f"{self.where}: joint {joint.name!r}"
        if kind != "hinge":
            raise BodyError(f"{where} type is {kind}; valid: hinge, and free for the root")
        limited = bool(self.model.jnt_limited[joint.id])
        lower, upper = np.array(joint.range) if limited else (-CONTINUOUS, CONTINUOUS)
        if not lower < upper:
            raise BodyError(f"{where} has range {lower:g} to {upper:g}; valid: lower < upper")
        weakest, strongest = self._torques(joint.id)
        if not -np.inf < weakest < 0.0 < strongest < np.inf:
            raise BodyError(
                f"{where} has torques from {weakest:g} to {strongest:g}; valid: limits below and above 0, by "
                "actuatorfrcrange, or the forcerange of an actuator or the ctrlrange of a motor"
            )
        axis = np.array(joint.axis)
        back = Rotation.from_rotvec(-float(self.model.qpos0[joint.qposadr[0]]) * axis).as_matrix()
        return UrdfJoint(
            joint.name, "revolute" if limited else "continuous", parent, child, turn @ back, place, axis,
            float(lower), float(upper), weakest, strongest, self.speed,
        )  # fmt: skip

    def _torques(self, joint: int) -> tuple[float, float]:
        """Least and largest torque on a joint [N.m], infinite where nothing bounds it."""
        model, total, driven = self.model, np.zeros(2), False
        for k in range(model.nu):
            if model.actuator_trntype[k] == 0 and model.actuator_trnid[k, 0] == joint:
                total += np.sort(self._forces(k) * model.actuator_gear[k, 0])
                driven = True
        total = total if driven else np.array([-np.inf, np.inf])
        if model.jnt_actfrclimited[joint]:
            total = np.clip(total, *model.jnt_actfrcrange[joint])
        return float(total[0]), float(total[1])

    def _forces(self, actuator: int) -> FloatArray:
        """(2,) range of an actuator's force before its gear."""
        model = self.model
        if model.actuator_forcelimited[actuator]:
            return np.array(model.actuator_forcerange[actuator])
        plain = model.actuator_gaintype[actuator] == 0 and model.actuator_biastype[actuator] == 0
        if plain and model.actuator_ctrllimited[actuator]:
            return model.actuator_gainprm[actuator, 0] * np.array(model.actuator_ctrlrange[actuator])
        return np.array([-np.inf, np.inf])


_JOINT_TYPES = ("free", "ball", "slide", "hinge")


def _type_name(geom_type: int) -> str:
    import mujoco

    return mujoco.mjtGeom(geom_type).name.removeprefix("mjGEOM_").lower()


def _rotation(quaternion: FloatArray, where: str) -> FloatArray:
    if not np.linalg.norm(quaternion) > 0.0:
        raise BodyError(f"{where} has axes without directions; valid: a quaternion that is not zero")
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def _check_place(place: FloatArray, where: str) -> None:
    if not np.abs(place).max() <= FARTHEST:
        raise BodyError(f"{where} has a place {place.tolist()}; valid: at most {FARTHEST:g} m away")


def _empty(name: str) -> UrdfLink:
    return UrdfLink(name, 0.0, np.zeros(3), np.zeros((3, 3)), ())


def _fixed(child: str, parent: str, turn: FloatArray, place: FloatArray) -> UrdfJoint:
    x = np.array([1.0, 0.0, 0.0])
    return UrdfJoint(f"{child}/fixed", "fixed", parent, child, turn, place, x, 0.0, 0.0, 0.0, 0.0, 0.0)
