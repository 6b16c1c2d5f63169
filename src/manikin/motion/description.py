"""Bodies, scenes and contact schedules as plain JSON values, and back.

A motion file carries these so that it can be drawn and measured without the scenario it
came from.  Numbers are written with Python's shortest exact form: what is read back is
bit for bit what was written.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from manikin.body import BodyModel, Effector, Hinge, Limb, Segment, Shape
from manikin.contact import (
    CarriedLoad,
    Contact,
    ContactKind,
    ContactSchedule,
    Phase,
    SolePart,
    Stance,
    StanceSequence,
)
from manikin.numerics.spatial import frozen_array
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere

Json = dict[str, Any]


def describe_body(body: BodyModel) -> Json:
    """Everything that makes a body: segments, hinges, inertias, shapes, effectors, limbs [SI]."""
    return {
        "name": body.name,
        "stature_m": body.stature,
        "mass_kg": body.own_mass,
        "sex": body.sex,
        "age": body.age,
        "strength": body.strength,
        "loads_kg": dict(body.loads),
        "sole_length_m": body.sole_length,
        "sole_width_m": body.sole_width,
        "segments": [_describe_segment(segment) for segment in body.segments],
        "effectors": [
            {"name": e.name, "segment": e.segment, "translation": e.translation.tolist(),
             "rotation": e.rotation.tolist()}
            for e in body.effectors.values()
        ],
        "standing_angles": dict(body.standing_angles),
        "soft_pairs": sorted(sorted(pair) for pair in body.soft_pairs),
        "limbs": [
            {"name": limb.name, "effector": limb.effector, "segments": list(limb.segments),
             "kind": str(limb.kind), "mirror": limb.mirror}
            | ({} if limb.patch is None else {"patch_m": list(limb.patch)})
            for limb in body.limbs
        ],
    }  # fmt: skip


def body_from(description: Mapping[str, Any]) -> BodyModel:
    """Body of a description; the inverse of :func:`describe_body`.

    Raises:
        KeyError: If a value is missing.
        BodyError: If a value is not usable.
    """
    effectors = [
        Effector(e["name"], e["segment"], np.array(e["translation"]), np.array(e["rotation"]))
        for e in description["effectors"]
    ]
    return BodyModel(
        name=description["name"],
        segments=tuple(_segment_from(segment) for segment in description["segments"]),
        effectors={effector.name: effector for effector in effectors},
        standing_angles=description["standing_angles"],
        soft_pairs=frozenset(frozenset(pair) for pair in description["soft_pairs"]),
        stature=description["stature_m"],
        sex=description["sex"],
        age=description["age"],
        strength=description["strength"],
        loads=description.get("loads_kg", {}),
        sole_length=description["sole_length_m"],
        sole_width=description["sole_width_m"],
        limbs=tuple(_limb_from(limb) for limb in description.get("limbs", ())),
    )


def body_key(body: BodyModel) -> str:
    """Digest of everything that makes a body, to tell whether a file is about the same one."""
    return hashlib.sha256(json.dumps(describe_body(body), sort_keys=True).encode()).hexdigest()


def _limb_from(data: Mapping[str, Any]) -> Limb:
    kind = ContactKind(data["kind"])
    patch = data.get("patch_m")
    return Limb(
        data["name"], data["effector"], tuple(data["segments"]), kind, data["mirror"],
        None if patch is None else (patch[0], patch[1]),
    )  # fmt: skip


def _describe_segment(segment: Segment) -> Json:
    return {
        "name": segment.name,
        "parent": segment.parent,
        "origin": segment.origin.tolist(),
        "mass": segment.mass,
        "com": segment.com.tolist(),
        "inertia": segment.inertia.tolist(),
        "hinges": [
            {"name": h.name, "axis": h.axis.tolist(), "lower": h.lower, "upper": h.upper,
             "velocity_limit": h.velocity_limit, "torque_lower": h.torque_lower,
             "torque_upper": h.torque_upper}
            for h in segment.hinges
        ],
        "shapes": [
            {"name": s.name, "kind": str(s.kind), "size": s.size.tolist(),
             "translation": s.translation.tolist(), "rotation": s.rotation.tolist()}
            for s in segment.shapes
        ],
    }  # fmt: skip


def _segment_from(data: Mapping[str, Any]) -> Segment:
    return Segment(
        name=data["name"],
        parent=data["parent"],
        origin=np.array(data["origin"]),
        hinges=tuple(Hinge(**{**hinge, "axis": np.array(hinge["axis"])}) for hinge in data["hinges"]),
        mass=data["mass"],
        com=np.array(data["com"]),
        inertia=np.array(data["inertia"]),
        shapes=tuple(Shape(**shape) for shape in data["shapes"]),
    )


def describe_scene(scene: Scene) -> Json:
    """Obstacles and floor of a scene [m]; meshes with all their triangles."""
    floor = ("floor",) if scene.floor_height is not None else ()
    return {
        "floor_height": scene.floor_height,
        "obstacles": [
            {"name": o.name, **_describe_shape(o), "rotation": o.rotation.tolist(),
             "translation": o.translation.tolist()}
            for o in scene
            if o.name not in floor
        ],
    }  # fmt: skip


def scene_from(description: Mapping[str, Any]) -> Scene:
    """Scene of a description; the inverse of :func:`describe_scene`.

    Raises:
        KeyError: If a value is missing.
        SceneError: If a value is not usable.
    """
    obstacles = [
        Obstacle(o["name"], _shape_from(o), np.array(o["rotation"]), np.array(o["translation"]))
        for o in description["obstacles"]
    ]
    return Scene(obstacles, description["floor_height"])


def _describe_shape(obstacle: Obstacle) -> Json:
    shape = obstacle.shape
    if isinstance(shape, Box):
        return {"kind": "box", "size": shape.size.tolist()}
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius}
    if isinstance(shape, (Cylinder, Capsule)):
        kind = "cylinder" if isinstance(shape, Cylinder) else "capsule"
        return {"kind": kind, "radius": shape.radius, "length": shape.length}
    if isinstance(shape, (Plane, HalfSpace)):
        kind = "plane" if isinstance(shape, Plane) else "half_space"
        return {"kind": kind, "normal": shape.normal.tolist(), "offset": shape.offset}
    return {"kind": "mesh", "source": shape.source, "vertices": shape.vertices.tolist(),
            "faces": shape.faces.tolist()}  # fmt: skip


def _shape_from(data: Mapping[str, Any]) -> Box | Sphere | Cylinder | Capsule | Plane | HalfSpace | Mesh:
    kind = data["kind"]
    if kind == "mesh":
        return Mesh(data["vertices"], data["faces"], data["source"])
    if kind == "box":
        return Box(data["size"])
    if kind == "sphere":
        return Sphere(data["radius"])
    if kind in ("cylinder", "capsule"):
        return (Cylinder if kind == "cylinder" else Capsule)(data["radius"], data["length"])
    return {"plane": Plane, "half_space": HalfSpace}[kind](data["normal"], data["offset"])


def describe_schedule(schedule: ContactSchedule) -> Json:
    """Stances and key instants of a schedule [m, s, N]."""
    return {
        "instants": schedule.instants.tolist(),
        "phases": [
            {
                "min_duration": phase.min_duration,
                "max_duration": phase.max_duration,
                "normal_force_cap": phase.stance.normal_force_cap,
                "friction_model": phase.stance.friction_model,
                "contacts": [_describe_contact(contact) for contact in phase.stance],
                **({} if phase.load is None else {"load": _describe_load(phase.load)}),
            }
            for phase in schedule.sequence
        ],
    }


def schedule_from(description: Mapping[str, Any]) -> ContactSchedule:
    """Schedule of a description; the inverse of :func:`describe_schedule`.

    Raises:
        KeyError: If a value is missing.
        ContactError: If a value is not usable.
    """
    phases = [
        Phase(
            Stance(
                [_contact_from(contact) for contact in phase["contacts"]],
                phase["normal_force_cap"],
                phase.get("friction_model", "outer"),
            ),
            phase["min_duration"],
            phase["max_duration"],
            _load_from(phase["load"]) if "load" in phase else None,
        )
        for phase in description["phases"]
    ]
    return ContactSchedule(StanceSequence(phases), description["instants"])


def _describe_load(load: CarriedLoad) -> Json:
    return {"masses_kg": dict(load.masses), "offset": load.offset.tolist()}


def _load_from(description: Mapping[str, Any]) -> CarriedLoad:
    return CarriedLoad(
        description["masses_kg"], frozen_array(description["offset"], "offset of the load [m]", (3,))
    )


def _describe_contact(contact: Contact) -> Json:
    return {
        "effector": contact.effector,
        "kind": str(contact.kind),
        "position": contact.position.tolist(),
        "rotation": contact.rotation_contact_to_world.tolist(),
        "points": contact.points.tolist(),
        "friction": contact.friction,
        "normal_force_cap": contact.normal_force_cap,
        "torsion_limit": contact.torsion_limit,
        "max_force": contact.max_force,
        "max_moment": contact.max_moment,
        "part": str(contact.part),
        "oriented": contact.oriented,
        "settle": contact.settle,
    }


def _contact_from(data: Mapping[str, Any]) -> Contact:
    return Contact(
        effector=data["effector"],
        kind=ContactKind(data["kind"]),
        position=frozen_array(data["position"], "contact position", (3,)),
        rotation_contact_to_world=frozen_array(data["rotation"], "contact rotation", (3, 3)),
        points=frozen_array(data["points"], "contact points", (None, 3)),
        friction=data["friction"],
        normal_force_cap=data["normal_force_cap"],
        torsion_limit=data["torsion_limit"],
        max_force=data["max_force"],
        max_moment=data["max_moment"],
        part=SolePart(data.get("part", SolePart.FULL)),
        oriented=data.get("oriented", False),
        settle=data.get("settle", 0.0),
    )
