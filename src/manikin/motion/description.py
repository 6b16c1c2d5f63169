"""Bodies, scenes and contact schedules as plain JSON values, and back.

A motion file carries these so that it can be drawn and measured without the scenario it came from. Numbers
are written with Python's shortest exact form: what is read back is bit for bit what was written.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from manikin.body import BodyModel, Effector, Hinge, Limb, Segment
from manikin.body import Shape as BodyShape
from manikin.contact import (
    CarriedLoad,
    Contact,
    ContactKind,
    ContactSchedule,
    ExertedForce,
    Phase,
    SolePart,
    Stance,
    StanceSequence,
)
from manikin.numerics.spatial import frozen_array
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere
from manikin.scene.obstacle import Shape

Json = dict[str, Any]


def describe_body(body: BodyModel) -> Json:
    """Everything that makes a body: segments, hinges, inertias, shapes, effectors, limbs [SI]."""
    return {
        "name": body.name, "stature_m": body.stature, "mass_kg": body.own_mass, "sex": body.sex,
        "age": body.age, "strength": body.strength, "loads_kg": dict(body.loads),
        "sole_length_m": body.sole_length, "sole_width_m": body.sole_width,
        "segments": [
            _plain(segment, "hinges", "shapes")
            | {"hinges": _plain(segment.hinges), "shapes": _plain(segment.shapes)}
            for segment in body.segments
        ],
        "effectors": [_plain(effector) for effector in body.effectors.values()],
        "standing_angles": dict(body.standing_angles),
        "soft_pairs": sorted(sorted(pair) for pair in body.soft_pairs),
        "limbs": [
            _plain(limb, "patch") | ({} if limb.patch is None else {"patch_m": list(limb.patch)})
            for limb in body.limbs
        ],
    }  # fmt: skip


def _plain(value: Any, *without: str) -> Any:
    """A dataclass as a mapping of its fields but for some; arrays as lists, enumerations as text."""
    if is_dataclass(value):
        names = (item.name for item in fields(value) if item.name not in without)
        return {name: _plain(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, StrEnum) else value


def body_from(description: Mapping[str, Any]) -> BodyModel:
    """Body of a description; the inverse of :func:`describe_body`.

    Raises:
        KeyError: If a value is missing.
        BodyError: If a value is not usable.
    """
    return BodyModel(
        name=description["name"],
        segments=tuple(_segment_from(segment) for segment in description["segments"]),
        effectors={effector["name"]: Effector(**effector) for effector in description["effectors"]},
        standing_angles=description["standing_angles"],
        soft_pairs=frozenset(frozenset(pair) for pair in description["soft_pairs"]),
        stature=description["stature_m"], sex=description["sex"], age=description["age"],
        strength=description["strength"], loads=description.get("loads_kg", {}),
        sole_length=description["sole_length_m"], sole_width=description["sole_width_m"],
        limbs=tuple(
            Limb(
                limb["name"], limb["effector"], tuple(limb["segments"]), ContactKind(limb["kind"]),
                limb["mirror"], tuple(limb["patch_m"]) if "patch_m" in limb else None,
            )
            for limb in description.get("limbs", ())
        ),
    )  # fmt: skip


def _segment_from(data: Mapping[str, Any]) -> Segment:
    hinges = tuple(Hinge(**hinge) for hinge in data["hinges"])
    return Segment(**{**data, "hinges": hinges, "shapes": tuple(BodyShape(**one) for one in data["shapes"])})


def describe_scene(scene: Scene) -> Json:
    """Obstacles and floor of a scene [m]; meshes with all their triangles."""
    obstacles = [
        {"name": o.name, **_describe_shape(o.shape)} | _plain(o, "name", "shape")
        for o in scene
        if scene.floor_height is None or o.name != "floor"
    ]
    return {"floor_height": scene.floor_height, "obstacles": obstacles}


def scene_from(description: Mapping[str, Any]) -> Scene:
    """Scene of a description; the inverse of :func:`describe_scene`.

    Raises:
        KeyError: If a value is missing.
        SceneError: If a value is not usable.
    """
    given = description["obstacles"]
    obstacles = [Obstacle(o["name"], _shape_from(o), o["rotation"], o["translation"]) for o in given]
    return Scene(obstacles, description["floor_height"])


_KINDS: Mapping[str, type[Shape]] = {
    "box": Box, "sphere": Sphere, "cylinder": Cylinder, "capsule": Capsule, "plane": Plane,
    "half_space": HalfSpace, "mesh": Mesh,
}  # fmt: skip


def _describe_shape(shape: Shape) -> Json:
    kind = next(name for name, shape_type in _KINDS.items() if isinstance(shape, shape_type))
    if isinstance(shape, Mesh):
        return {"kind": kind, "source": shape.source} | _plain(shape, "source", "dropped_faces")
    return {"kind": kind} | _plain(shape)


def _shape_from(data: Mapping[str, Any]) -> Shape:
    shape_type = _KINDS[data["kind"]]
    names = [item.name for item in fields(shape_type) if item.name != "dropped_faces"]
    return shape_type(**{name: data[name] for name in names})


def describe_schedule(schedule: ContactSchedule) -> Json:
    """Stances and key instants of a schedule [m, s, N]."""
    phases: list[Json] = []
    for phase in schedule.sequence:
        phases.append({
            "min_duration": phase.min_duration, "max_duration": phase.max_duration,
            "normal_force_cap": phase.stance.normal_force_cap,
            "friction_model": phase.stance.friction_model,
            "contacts": [_describe_contact(contact) for contact in phase.stance],
        })  # fmt: skip
        if (load := phase.load) is not None:
            phases[-1]["load"] = {"masses_kg": dict(load.masses), "offset": load.offset.tolist()}
        if (force := phase.exerts) is not None:
            phases[-1]["exerts"] = {"kind": force.kind, "direction": force.direction.tolist()}
    return {"instants": schedule.instants.tolist(), "phases": phases}


def schedule_from(description: Mapping[str, Any]) -> ContactSchedule:
    """Schedule of a description; the inverse of :func:`describe_schedule`.

    Raises:
        KeyError: If a value is missing.
        ContactError: If a value is not usable.
    """
    phases = []
    for phase in description["phases"]:
        contacts = [_contact_from(contact) for contact in phase["contacts"]]
        stance = Stance(contacts, phase["normal_force_cap"], phase.get("friction_model", "outer"))
        load = _load_from(phase["load"]) if "load" in phase else None
        force = _exerted_from(phase["exerts"]) if "exerts" in phase else None
        phases.append(Phase(stance, phase["min_duration"], phase["max_duration"], load, exerts=force))
    return ContactSchedule(StanceSequence(phases), description["instants"])


def _load_from(description: Mapping[str, Any]) -> CarriedLoad:
    offset = frozen_array(description["offset"], "offset of the load [m]", (3,))
    return CarriedLoad(description["masses_kg"], offset)


def _exerted_from(description: Mapping[str, Any]) -> ExertedForce:
    direction = frozen_array(description["direction"], "direction of the exerted force", (3,))
    return ExertedForce(description["kind"], direction)


def _describe_contact(contact: Contact) -> Json:
    """In the order of the fields, the rotation under a shorter name."""
    return {key.removesuffix("_contact_to_world"): value for key, value in _plain(contact).items()}


def _contact_from(data: Mapping[str, Any]) -> Contact:
    values = dict(data)
    shapes = {"position": (3,), "rotation": (3, 3), "points": (None, 3)}
    given = ((values.pop(key), f"contact {key}", shape) for key, shape in shapes.items())
    position, rotation, points = (frozen_array(*item) for item in given)
    kinds = {"kind": ContactKind(values.pop("kind")), "part": SolePart(values.pop("part", SolePart.FULL))}
    return Contact(**values, position=position, rotation_contact_to_world=rotation, points=points, **kinds)
