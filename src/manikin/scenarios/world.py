"""The body and the scene that a scenario describes."""

import numpy as np

from manikin.body import (
    BodyModel,
    carrying,
    creature_from_urdf,
    human,
    insect,
    kudoh,
    point_mass,
    with_further_contacts,
)
from manikin.errors import InputError
from manikin.scenarios.obstacles import build_obstacle
from manikin.scenarios.validation import Path as KeyPath
from manikin.scenarios.values import ScenarioValues
from manikin.scene import Scene


def build_body(values: ScenarioValues) -> BodyModel:
    """Build the body; its soles have the size that the supports give.

    Raises:
        ScenarioError: If the body's data are out of range.
    """
    if values.file.body.model in ("insect", "urdf"):
        return _creature(values)
    load = values.file.body.load
    if values.file.body.model == "kudoh":
        return kudoh() if load is None else carrying(kudoh(), load.mass_kg, load.hand)
    if values.is_point_mass:
        return point_mass(values.mass)
    data, sole = values.file.body, values.sole
    length, width = (None, None) if sole is None else (sole.length_m, sole.width_m)
    try:
        body = human(
            data.stature_m, data.mass_kg, data.sex, age=data.age, strength=data.strength,
            sole_length=length, sole_width=width,
        )  # fmt: skip
        body = body if load is None else carrying(body, load.mass_kg, load.hand)
        return with_further_contacts(body, data.further_contacts) if data.further_contacts else body
    except InputError as error:
        path: KeyPath = ("supports", "sole") if "sole" in str(error) else ("body",)
        raise values.refused(path, error) from None


def _creature(values: ScenarioValues) -> BodyModel:
    """An insect, or the creature of a robot description."""
    data = values.file.body
    try:
        if data.model == "insect":
            return insect(data.length_m, data.mass_kg)
        sole = data.sole
        return creature_from_urdf(
            values.folder / str(data.urdf),
            {name: limb.model_dump() for name, limb in (data.limbs or {}).items()},
            standing={name: float(np.deg2rad(angle)) for name, angle in (data.standing_deg or {}).items()},
            sole_length=None if sole is None else sole.length_m,
            sole_width=None if sole is None else sole.width_m,
        )
    except InputError as error:
        raise values.refused(("body",), error) from None


def build_scene(values: ScenarioValues) -> Scene:
    """Build the obstacles and the floor.

    Raises:
        ScenarioError: If a mesh cannot be read or a shape is degenerate.
    """
    obstacles = []
    for index, entry in enumerate(values.file.scene):
        try:
            obstacles.append(build_obstacle(entry, values.folder))
        except InputError as error:
            raise values.refused(("scene", index), error) from None
    return Scene(obstacles, floor_height=values.file.floor_height_m)
