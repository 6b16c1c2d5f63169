"""The scaled body as an OpenSim model, its motion as coordinates, its contact forces as external loads.

One body for each segment, in OpenSim's axes (x forward, y up, z right). A segment with hinges is on a custom
joint whose rotations are the hinges, in their order; one without is welded. The root's coordinates are those
of OpenSim's gait models, ``pelvis_tilt``, ``pelvis_list``, ``pelvis_rotation``, ``pelvis_tx`` and so on.
Hinges keep their names, axes, signs and limits.
"""

from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Segment
from manikin.motion import Motion
from manikin.numerics.spatial import GRAVITY, FloatArray, continuous_angles
from manikin.recordings.virtual_markers import VirtualMarker
from manikin.reports.formats.recorded import TO_OPENSIM, storage_text
from manikin.reports.formats.robots import digits

ROOT_ROTATIONS = (("pelvis_tilt", 2), ("pelvis_list", 0), ("pelvis_rotation", 1))
"""Coordinates of the root and the axes about which they turn, one after the other."""
ROOT_PLACES = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
_ORDER = "ZXY"
_FARTHEST = 100.0


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8" ?>\n' + tostring(root, encoding="unicode") + "\n"


def _put(parent: Element, tag: str, text: str) -> None:
    SubElement(parent, tag).text = text


def to_osim(body: BodyModel, markers: tuple[VirtualMarker, ...] = ()) -> str:
    """Text of an OpenSim model of a body."""
    document = Element("OpenSimDocument", Version="40500")
    model = SubElement(document, "Model", name=body.name)
    _put(model, "gravity", digits([0.0, -GRAVITY, 0.0]))
    _put(model, "length_units", "meters")
    _put(model, "force_units", "N")
    bodies = SubElement(SubElement(model, "BodySet", name="bodyset"), "objects")
    joints = SubElement(SubElement(model, "JointSet", name="jointset"), "objects")
    for segment in body.segments:
        _add_body(bodies, segment)
        _add_joint(joints, segment)
    objects = SubElement(SubElement(model, "MarkerSet", name="markerset"), "objects")
    for marker in markers:
        item = SubElement(objects, "Marker", name=marker.name)
        _put(item, "socket_parent_frame", f"/bodyset/{marker.segment}")
        _put(item, "location", digits(TO_OPENSIM @ marker.place))
        _put(item, "fixed", "true")
    return _text(document)


def _add_body(bodies: Element, segment: Segment) -> None:
    item = SubElement(bodies, "Body", name=segment.name)
    inertia = TO_OPENSIM @ segment.inertia @ TO_OPENSIM.T
    _put(item, "mass", digits(segment.mass))
    _put(item, "mass_center", digits(TO_OPENSIM @ segment.com))
    _put(item, "inertia", digits(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]))


def _add_joint(joints: Element, segment: Segment) -> None:
    root = segment.parent is None
    kind = "CustomJoint" if root or segment.hinges else "WeldJoint"
    joint = SubElement(joints, kind, name=f"{segment.name}_joint")
    _put(joint, "socket_parent_frame", "place")
    _put(joint, "socket_child_frame", f"/bodyset/{segment.name}")
    if kind == "CustomJoint":
        coordinates = SubElement(joint, "coordinates")
        for name, low, high in _ranges(segment):
            item = SubElement(coordinates, "Coordinate", name=name)
            _put(item, "default_value", digits(0.0))
            _put(item, "range", digits([low, high]))
            _put(item, "clamped", "false")
    frame = SubElement(SubElement(joint, "frames"), "PhysicalOffsetFrame", name="place")
    _put(frame, "socket_parent", "/ground" if root else f"/bodyset/{segment.parent}")
    _put(frame, "translation", digits(TO_OPENSIM @ segment.origin if not root else np.zeros(3)))
    if kind == "CustomJoint":
        transform = SubElement(joint, "SpatialTransform")
        names, axes = _rotations(segment)
        for number, (name, axis) in enumerate(zip(names, axes, strict=True), start=1):
            _add_axis(transform, f"rotation{number}", name, axis)
        for number, (axis, place) in enumerate(zip(np.eye(3), ROOT_PLACES, strict=True), start=1):
            _add_axis(transform, f"translation{number}", place if root else "", axis)


def _ranges(segment: Segment) -> list[tuple[str, float, float]]:
    """Name, least and largest value of each coordinate of a segment [rad, m]."""
    if segment.parent is not None:
        return [(hinge.name, hinge.lower, hinge.upper) for hinge in segment.hinges]
    turns = [(name, -2.0 * np.pi, 2.0 * np.pi) for name, _ in ROOT_ROTATIONS]
    return turns + [(name, -_FARTHEST, _FARTHEST) for name in ROOT_PLACES]


def _rotations(segment: Segment) -> tuple[list[str], FloatArray]:
    """Names of the three rotations, empty where there is none, and their axes (3, 3), which span space."""
    if segment.parent is None:
        return [name for name, _ in ROOT_ROTATIONS], np.eye(3)[[axis for _, axis in ROOT_ROTATIONS]]
    names = [hinge.name for hinge in segment.hinges]
    axes = [TO_OPENSIM @ hinge.axis for hinge in segment.hinges]
    while len(axes) < 3:
        # The direction that is farthest from those there are.
        known = np.linalg.svd(np.array(axes))[2][: len(axes)]
        free = np.eye(3) - known.T @ known
        axes.append(free[int(np.argmax(np.diag(free)))] / np.sqrt(np.diag(free).max()))
        names.append("")
    return names, np.array(axes)


def _add_axis(transform: Element, label: str, coordinate: str, axis: FloatArray) -> None:
    item = SubElement(transform, "TransformAxis", name=label)
    _put(item, "coordinates", coordinate)
    _put(item, "axis", digits(axis))
    if coordinate:
        _put(SubElement(item, "LinearFunction", name="function"), "coefficients", "1 0")
    else:
        _put(SubElement(item, "Constant", name="function"), "value", "0")


def coordinates_mot(body: BodyModel, motion: Motion) -> str:
    """Text of a MOT file of a motion's coordinates; angles in degrees."""
    world = Rotation.from_quat(motion.q[:, 3:7]).as_matrix()
    turned = TO_OPENSIM @ world @ TO_OPENSIM.T
    angles = continuous_angles(turned[:, None], _ORDER)[:, 0]
    names = ["time", *(name for name, _ in ROOT_ROTATIONS), *ROOT_PLACES, *body.joint_names]
    table = np.column_stack(
        [motion.time, np.degrees(angles), motion.q[:, :3] @ TO_OPENSIM.T, np.degrees(motion.q[:, 7:])]
    )
    return storage_text("Coordinates", names, table, degrees=True)


def external_loads(body: BodyModel, motion: Motion, data_file: str) -> str:
    """Text of an OpenSim ExternalLoads file: which columns of a MOT file act on which body.

    Args:
        body: Whose motion it is.
        motion: With its contacts.
        data_file: Name of the MOT file, see :func:`~manikin.reports.formats.recorded.loads_mot`.
    """
    document = Element("OpenSimDocument", Version="40500")
    loads = SubElement(document, "ExternalLoads", name="externalloads")
    objects = SubElement(loads, "objects")
    for name in motion.contact_names:
        item = SubElement(objects, "ExternalForce", name=name)
        _put(item, "applied_to_body", body.effector(name).segment)
        _put(item, "force_expressed_in_body", "ground")
        _put(item, "point_expressed_in_body", "ground")
        _put(item, "force_identifier", f"{name}_force_v")
        _put(item, "point_identifier", f"{name}_force_p")
        _put(item, "torque_identifier", f"{name}_torque_")
        _put(item, "data_source_name", data_file)
    _put(loads, "datafile", data_file)
    return _text(document)
