"""A family of random scenes: how one is drawn from the name of the family and a seed.

A scene is a plain scenario: a body, obstacles, a start and a goal. Nothing in it helps a planner. Lengths are
drawn in the ranges that the family states and are rounded to millimetres, as people write them. Half of the
scenes are then moved: by up to 10 m along x and y, and turned by any yaw.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from manikin.numerics.spatial import PlanarTransform
from manikin.runtime.files import atomic_path, make_directory, writing
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate

STATURES = (1.50, 1.95)
"""Range of the statures of people [m]."""

BODY_MASS_INDICES = (19.0, 32.0)
"""Range of their body mass over their squared stature [kg/m^2]."""

FARTHEST = 10.0
"""Largest distance along x and y by which a scene is moved [m]."""

Range = tuple[float, float]


class Sketch:
    """A scene while it is drawn, in a frame of its own: z up, the body starts near the origin.

    The body is that of a person, whose sex, stature and body mass index are independent and evenly
    distributed, unless a family says something else.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        sex = ("female", "male")[int(rng.integers(2))]
        self.stature = round(float(rng.uniform(*STATURES)), 2)
        mass = round(float(rng.uniform(*BODY_MASS_INDICES)) * self.stature**2, 1)
        self.body = {"model": "human", "stature_m": self.stature, "mass_kg": mass, "sex": sex}
        self.floor: float | None = 0.0  # its height [m], None for none
        self.keys: dict[str, Any] = {}  # further ones of the scenario
        self.meshes: dict[str, trimesh.Trimesh] = {}  # by the file that is written beside the scenario
        self._scene: list[dict[str, Any]] = []
        self._ends = {"start": self._end(0.0, 0.0, 0.0, {})}

    def between(self, low: float, high: float, digits: int = 3) -> float:
        """A number of a range, evenly distributed."""
        return round(float(self.rng.uniform(low, high)), digits)

    def whole(self, low: int, high: int) -> int:
        """A whole number of a range, both ends included."""
        return int(self.rng.integers(low, high + 1))

    def coin(self) -> bool:
        """True in half of the draws."""
        return bool(self.rng.integers(2))

    def side(self) -> float:
        """1 or -1."""
        return 1.0 if self.coin() else -1.0

    def box(
        self, name: str, x: Range, y: Range, z: Range, *, yaw_deg: float = 0.0,
        about: tuple[float, float] | None = None, tilt_deg: tuple[float, float] = (0.0, 0.0), **keys: Any,
    ) -> None:  # fmt: skip
        """Add a box by its extents, either end first, before it is turned [m, deg].

        First by roll and pitch about its middle, then by a yaw about the vertical, there or at ``about``.
        """
        size = [round(abs(high - low), 4) for low, high in (x, y, z)]
        middle = np.array([0.5 * (low + high) for low, high in (x, y, z)])
        if about is not None:
            turn = PlanarTransform(0.0, 0.0, yaw_deg)
            middle[:2] = np.array(about) + turn.directions(middle[:2] - np.array(about))
        self.add(name, box=size, position=middle, rpy_deg=(*tilt_deg, yaw_deg), **keys)

    def rod(self, name: str, ends: tuple[ArrayLike, ArrayLike], radius: float) -> None:
        """Add a cylinder between two points (3,) [m], level or upright or in the plane of x and z."""
        low, high = (np.asarray(end, dtype=np.float64) for end in ends)
        way = high - low
        along = way / np.linalg.norm(way)
        level = abs(along[1]) > 0.5
        roll, pitch = (90.0, 0.0) if level else (0.0, np.degrees(np.arctan2(along[0], along[2])))
        shape = {"radius_m": radius, "length_m": round(float(np.linalg.norm(way)), 4)}
        self.add(name, cylinder=shape, position=0.5 * (low + high), rpy_deg=(roll, round(pitch, 2), 0.0))

    def add(self, name: str, *, position: ArrayLike, rpy_deg: Sequence[float] = (), **keys: Any) -> None:
        """Add an obstacle by the keys of its section [m, deg]."""
        place = [round(float(value), 4) + 0.0 for value in np.asarray(position)]
        turn = {"rpy_deg": [round(float(angle), 2) + 0.0 for angle in rpy_deg]} if any(rpy_deg) else {}
        self._scene.append({"name": name, **keys, "position": place, **turn})

    def mesh(self, name: str, mesh: trimesh.Trimesh, ending: str, position: ArrayLike, **keys: Any) -> None:
        """Add a mesh, which is written beside the scenario."""
        file = f"{name}.{ending}"
        self.meshes[file] = mesh
        self.add(name, mesh=file, position=position, **keys)

    def start(self, x: float, y: float, heading_deg: float = 0.0, **keys: Any) -> None:
        """Set the start [m, deg], elsewhere than at the origin."""
        self._ends["start"] = self._end(x, y, heading_deg, keys)

    def goal(self, x: float, y: float, heading_deg: float = 0.0, **keys: Any) -> None:
        """Set the goal [m, deg]."""
        self._ends["goal"] = self._end(x, y, heading_deg, keys)

    def exchange(self) -> None:
        """Let the way lead from goal to start, facing as before."""
        self._ends = {"start": self._ends["goal"], "goal": self._ends["start"]}

    def maybe_turn_back(self) -> None:
        """In half of the draws, let the way lead from goal to start, facing the other way."""
        if self.coin():
            self.exchange()
            for end in self._ends.values():
                end["heading_deg"] = _angle(end["heading_deg"] + 180.0)

    def data(self, name: str, description: str) -> dict[str, Any]:
        """Content of the scenario's file."""
        floor = {} if self.floor == 0.0 else {"floor_height_m": self.floor}
        meshes = ({"mesh": f"{name}-{item['mesh']}"} if "mesh" in item else {} for item in self._scene)
        scene = [item | mesh for item, mesh in zip(self._scene, meshes, strict=True)]
        return {
            "name": name, "description": description, "body": self.body, **floor, "scene": scene, **self.keys,
            "task": self._ends,
        }  # fmt: skip

    @staticmethod
    def _end(x: float, y: float, heading_deg: float, keys: Mapping[str, Any]) -> dict[str, Any]:
        return {"at": [round(x, 3), round(y, 3)], "heading_deg": _angle(heading_deg), **keys}


def _angle(degrees: float) -> float:
    """Above -180 and up to 180, to a tenth of a degree; never a negative zero."""
    return round(180.0 - (180.0 - degrees) % 360.0, 1) + 0.0


@dataclass(frozen=True)
class Family:
    """Random scenes of one kind; the docstring of ``draw`` says what is drawn, and why a person can do it."""

    name: str
    draw: Callable[[Sketch], None]

    @property
    def description(self) -> str:
        """What a scene of this kind is, in one line."""
        return (self.draw.__doc__ or "").strip().splitlines()[0].rstrip(".")


def draw_scene(family: Family, seed: int, folder: Path | None = None) -> Scenario:
    """Draw a scene of a family; the same for the same family and seed, whatever else was drawn.

    The meshes of the scene are written into the folder, which is made where needed; MotionFileError if that
    fails. Without one the scenario cannot build them.
    """
    rng = np.random.default_rng([*family.name.encode(), seed])
    sketch = Sketch(rng)
    family.draw(sketch)
    name = f"{family.name}-{seed}"
    if folder is not None and sketch.meshes:
        make_directory(folder)
        for file, mesh in sketch.meshes.items():
            with writing(folder / name), atomic_path(folder / f"{name}-{file}") as temporary:
                mesh.export(temporary, file_type=file.rpartition(".")[2])
    data = sketch.data(name, family.description)
    scenario = Scenario(validate(ScenarioFile, data, name), name, folder or Path(), {})
    if not sketch.coin():
        return scenario
    x, y = sketch.between(-FARTHEST, FARTHEST), sketch.between(-FARTHEST, FARTHEST)
    return scenario.moved(x, y, sketch.between(-180.0, 180.0, 1))
