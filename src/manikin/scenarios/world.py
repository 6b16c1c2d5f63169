"""The body and the scene that a scenario describes."""

from manikin.body import BodyModel, human, point_mass
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
    if values.is_point_mass:
        return point_mass(values.mass)
    data, sole = values.file.body, values.sole
    soles = {} if sole is None else {"sole_length": sole.length_m, "sole_width": sole.width_m}
    try:
        return human(data.stature_m, data.mass_kg, data.sex, **soles)
    except InputError as error:
        path: KeyPath = ("supports", "sole") if "sole" in str(error) else ("body",)
        raise values.refused(path, error) from None


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
