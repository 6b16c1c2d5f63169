"""Whether the lengths of a scenario fit its body, and whether start and goal are on something.

Files hold metres. Lengths in another unit pass every other check and end, after minutes, in a failure that
does not name them, or in a step of a tenth of a millimetre that succeeds. The limits are ours, and generous:
what is refused is far from anything that a body could use.
"""

from collections.abc import Iterator

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.numerics.spatial import FloatArray
from manikin.scenarios.sections.task_sections import StateSection
from manikin.scenarios.values import ScenarioValues
from manikin.scene import Mesh, Obstacle, Scene
from manikin.scene.obstacle import extents
from manikin.scene.scene import FLOOR

THICKEST = 30.0
"""An obstacle that is larger than this in all directions is a mistake [sizes of the body]."""
SMALLEST = 0.02
"""So is a scene whose obstacles, all together, are smaller than this in all directions."""
FARTHEST = 1.5
"""Distance of the centre of mass from the nearest contact of the phase that it is in [sizes of the body]."""
AROUND = 0.5
"""Distance from a place within which there is a surface to stand or sit on [sizes of the body]."""
STEEPEST = np.deg2rad(60.0)
"""Largest slope of such a surface."""
TRUNK = (0.35, 0.45, 0.55)
"""Heights above the lowest surface at a place at which no obstacle may be [sizes of the body]."""
STEP = 0.5
"""Height below the top of an obstacle within which a surface is a way onto it [sizes of the body]."""
_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "kilometres": 1e3}


def check_plausible(values: ScenarioValues, body: BodyModel, scene: Scene) -> None:
    """Refuse lengths that cannot be metres, and a start or goal on nothing or inside of an obstacle.

    Args:
        scene: That of the scenario, in the frame of its file.

    Raises:
        ScenarioError: One line that names the key, with its unit guessed.
    """
    size = size_of(values, body)
    _check_sizes(values, scene, size)
    if values.file.supports is not None:
        _check_reach(values, size)
        return
    for end in ("start", "goal"):
        _check_place(values, scene, end, size)


def size_of(values: ScenarioValues, body: BodyModel) -> float:
    """Stature, or the largest distance between two effectors of the standing body [m]."""
    if body.stature is not None or not body.effectors:
        return float(values.file.body.stature_m)
    state = Configuration(body, body.standing_posture())
    places = np.array([state.effector_placement(name)[1] for name in body.effectors])
    return float(np.linalg.norm(places[:, None] - places[None], axis=2).max())


def _check_sizes(values: ScenarioValues, scene: Scene, size: float) -> None:
    names = [entry.name for entry in values.file.scene]
    finite = [scene[name] for name in names if np.all(np.isfinite(scene[name].bounds))]
    for obstacle in finite:
        lower, upper = extents(obstacle.shape)
        if float((upper - lower).min()) > THICKEST * size:
            problem = f"measures {_sides(upper - lower)} m, {_beside(upper - lower, size)}"
            raise values.error(("scene", names.index(obstacle.name)), f"{problem}; valid: metres")
    if not finite:
        return
    bounds = np.array([obstacle.bounds for obstacle in finite])
    whole = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    if float(whole.max()) < SMALLEST * size:
        together = f"has obstacles that together measure {_sides(whole)} m"
        raise values.error(("scene",), f"{together}, {_beside(whole, size)}; valid: metres")


def _check_reach(values: ScenarioValues, size: float) -> None:
    """The centre of mass at the start and the goal is near the contacts there."""
    phases = values.explicit_supports().resolved_phases()
    for end, contacts in (("start", phases[0]), ("goal", phases[-1])):
        com = getattr(values.file.task, end).com
        if com is None or not contacts:
            continue
        places = np.array([contact.position for contact in contacts.values()])
        away = np.linalg.norm(places - com, axis=1).min()
        if away > FARTHEST * size:
            problem = (
                f"is {away:.3g} m from the nearest contact of its phase, {_beside(np.array([away]), size)}"
            )
            raise values.error(("task", end, "com"), f"{problem}; valid: within {FARTHEST * size:.3g} m")


def _check_place(values: ScenarioValues, scene: Scene, end: str, size: float) -> None:
    state: StateSection = getattr(values.file.task, end)
    given = state.at or (None if state.com is None else state.com[:2])
    if given is None or state.posture == "climbing":
        return
    place, path = np.array(given), ("task", end, "com" if state.at is None else "at")
    where = f"{np.round(place, 3).tolist()} m"
    levels = sorted(_levels(values, scene, place, AROUND * size))
    if (height := state.height_m) is not None:
        nearest = min(levels, key=lambda level: abs(level - height), default=None)
        if nearest is None or abs(nearest - height) > AROUND * size:
            found = "nothing" if nearest is None else f"the nearest surface, at {nearest:.3g} m,"
            problem = f"is {height:g} m, but {found} is near that height around {where}"
            raise values.error(("task", end, "height_m"), f"{problem}; valid: the height of a surface there")
        levels = [height]
    if not levels:
        problem = f"is {where}, where nothing is below the body: the scene has no floor and no surface there"
        raise values.error(path, f"{problem}; valid: a place on the floor or on an obstacle")
    if end == "start" and height is None:
        _check_room(values, scene, place, levels, size)


def _check_room(
    values: ScenarioValues, scene: Scene, place: FloatArray, levels: list[float], size: float
) -> None:
    """A body inside of a tall obstacle to which nothing leads up is not meant to start on top of it."""
    inside = _inside(scene, place, levels[0], size)
    if inside is None:
        return
    top = float(inside.bounds[1][2])
    if top - levels[0] > size and not _is_stepped_onto(scene, top, STEP * size):
        problem = f"is {np.round(place, 3).tolist()} m, which is inside of '{inside.name}', {top:.3g} m high"
        path = ("task", "start", "com" if values.file.task.start.at is None else "at")
        raise values.error(path, f"{problem}; valid: a place beside it, or height_m to start on it")


def _is_stepped_onto(scene: Scene, top: float, step: float) -> bool:
    """Whether a surface of the scene is less than a step below the height ``top`` [m]."""
    heights = [surface.polygon[:, 2].max() for surface in scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)]
    return any(0.0 < top - height < step for height in heights)


def _levels(values: ScenarioValues, scene: Scene, place: FloatArray, around: float) -> Iterator[float]:
    """Heights of what carries at a place (2,), the floor among them; surfaces may be beside it [m]."""
    if values.file.floor_height_m is not None:
        yield values.file.floor_height_m
    for surface in scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST):
        base, normal = surface.polygon[0], surface.normal
        level = float(base[2] - (place - base[:2]) @ normal[:2] / normal[2])
        if float(surface.outside(np.array([[*place, level]]))[0]) <= around:
            yield level


def _inside(scene: Scene, place: FloatArray, level: float, size: float) -> Obstacle | None:
    """Obstacle, other than a mesh, which may be hollow, that holds a body's trunk at a place and a level."""
    solid = Scene([item for item in scene if item.name != FLOOR and not isinstance(item.shape, Mesh)], None)
    if len(solid) == 0:
        return None
    found = [solid.nearest([*place, level + share * size]) for share in TRUNK]
    deep = all(distance < -SMALLEST * size for _, distance in found)
    return solid[found[0][0]] if deep and len({name for name, _ in found}) == 1 else None


def _sides(lengths: FloatArray) -> str:
    return " x ".join(f"{length:.3g}" for length in lengths)


def _beside(lengths: FloatArray, size: float) -> str:
    """The size of the body, and the unit in which lengths would be of its order."""
    largest = float(lengths.max())
    guessed = min(_UNITS, key=lambda unit: abs(np.log(largest * _UNITS[unit] / size)))
    return f"with a body of {size:.3g} m; is that in {guessed}?"
