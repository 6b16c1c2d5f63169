"""Scenario: a checked file, changed by ``--set KEY=VALUE``, and the builders of what it describes."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from manikin.errors import ScenarioError, SceneError
from manikin.numerics.spatial import PlanarTransform, finite_number
from manikin.runtime.display import Displayed
from manikin.scenarios.placement import FILE_GRID, TASK_GRID, moved_data
from manikin.scenarios.problems import centroidal_problem, keyframe_problem
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import KeyPath, validate
from manikin.scenarios.values import ScenarioValues, build_body
from manikin.scenarios.world import build_scene, check_contacts, stance_sequence
from manikin.scenarios.yaml_reader import NULL_IS_A_VALUE, VARIANTS, Tree, parse_value
from manikin.scene import PACKAGE, mesh_place, package_file


def override(tree: Tree, settings: Sequence[str]) -> Tree:
    """Content of a scenario, not yet checked, with single values set by ``KEY=VALUE`` in order.

    A key is a dotted path; an entry of a list is meant by its number from 0, an obstacle also by
    its name: ``scene.roof.position.2=0.4``.  The value is YAML; ``null`` removes the key or entry.

    Raises:
        ScenarioError: One line, if a key leads nowhere or a value is not YAML.
    """
    tree = Tree(copy.deepcopy(tree.data), dict(tree.lines))
    for setting in settings:
        tree = _set(tree, setting)
    return tree


def _set(tree: Tree, setting: str) -> Tree:
    key, equals, text = setting.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise ScenarioError(f"--set {setting}: is not KEY=VALUE; valid: such as supports.friction=0.5")
    source = f"--set {key.strip()}"
    if parts[0] in ("extends", VARIANTS):  # which a loaded scenario no longer has
        raise ScenarioError(f"{source}: {parts[0]} cannot be set; valid: the keys of one scenario")
    value = parse_value(text, source)
    holder: Any = tree.data
    path: KeyPath = ()
    made: dict[KeyPath, str] = {}
    for depth, part in enumerate(parts[:-1]):
        step = _step(holder, part, parts[:depth], source)
        path = (*path, step)
        if isinstance(holder, dict) and step not in holder:
            holder[step], made[path] = {}, source
        holder = holder[step]
    step = _step(holder, parts[-1], parts[:-1], source)
    if value is not None or (*path, step) in NULL_IS_A_VALUE:
        holder[step] = value
        changed = (*path, step)
    elif isinstance(holder, list):
        holder.pop(int(step))
        changed = path  # the entries behind it have moved
    else:
        holder.pop(step, None)
        changed = (*path, step)
    lines = {p: where for p, where in tree.lines.items() if p[: len(changed)] != changed}
    return Tree(tree.data, {**lines, **made, changed: source})


def _step(place: Any, part: str, before: Sequence[str], source: str) -> str | int:
    """Key or index that ``part`` means in ``place``."""
    if isinstance(place, dict):
        return part
    where = ".".join(before)
    if not isinstance(place, list):
        raise ScenarioError(f"{source}: {where} is {place!r}, which holds no {part!r}; valid: {where}=VALUE")
    if part.isdigit() and int(part) < len(place):
        return int(part)
    names = [entry["name"] for entry in place if isinstance(entry, dict) and "name" in entry]
    if part in names:
        return names.index(part)
    numbers = f"an entry from 0 to {len(place) - 1}" if place else "nothing, the list is empty"
    valid = f"{numbers}, or {', '.join(names)}" if names else numbers
    raise ScenarioError(f"{source}: {where} has no entry {part!r}; valid: {valid}")


@dataclass(frozen=True, eq=False, repr=False)
class Scenario(Displayed, ScenarioValues):
    """One job for the pipeline: the values of a scenario file and what is built from them."""

    build_body = build_body
    build_scene = build_scene
    build_sequence = stance_sequence
    build_centroidal_problem = centroidal_problem
    build_keyframe_problem = keyframe_problem
    check_contacts = check_contacts

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        model, mass = self.file.body.model, f"{self.mass:.1f} kg"
        return {"name": self.name, "body": model, "mass": mass, "seed": str(self.seed)}

    def with_body(
        self, stature_m: float | None = None, mass_kg: float | None = None, sex: str | None = None,
        age: float | None = None, strength: float | None = None,
        load: Mapping[str, float | str] | None = None,
    ) -> Scenario:  # fmt: skip
        """The same scenario for another body, None as it is; ScenarioError if a value is out of range."""
        given = {
            "stature_m": stature_m, "mass_kg": mass_kg, "sex": sex, "age": age, "strength": strength,
            "load": load,
        }  # fmt: skip
        data = self._data()
        data["body"] |= {key: value for key, value in given.items() if value is not None}
        return self._with(data, self.lines)

    def with_seed(self, seed: int) -> Scenario:
        """The same scenario with another seed; ScenarioError if it is negative."""
        return self._with(self._data() | {"seed": seed}, self.lines)

    def with_overrides(self, settings: Sequence[str]) -> Scenario:
        """The same scenario with single values set, ``"supports.friction=0.5"`` each.

        See :func:`manikin.scenarios.scenario.override`; ScenarioError if a key or a value is not valid.
        """
        if not settings:
            return self
        changed = override(Tree(self._data(), self.lines), settings)
        return self._with(changed.data, changed.lines, changed.lines)

    def moved(self, x: float, y: float, yaw_deg: float) -> Scenario:
        """The same scenario at another place in the world, with its coordinates there.

        Args:
            x: Where the origin of this scenario comes to lie [m].
            y: The same [m].
            yaw_deg: Turn about the vertical through it, counter-clockwise [deg].

        Raises:
            InputError: If a number is not finite, or a coordinate becomes larger than a file may hold.
        """
        x, y = finite_number(x, "moved x [m]"), finite_number(y, "moved y [m]")
        yaw_deg = finite_number(yaw_deg, "moved yaw [deg]")
        return self._in_frame(PlanarTransform(x, y, yaw_deg), FILE_GRID)

    def in_task_frame(self) -> Scenario:
        """The same scenario with its coordinates in the frame of its task, rounded.

        The frame depends on the task alone (:attr:`transform_task_to_world`): a scenario and the same one
        :meth:`moved` have the same coordinates there, to the last bit.
        """
        return self._in_frame(self.transform_task_to_world.inverse, TASK_GRID)

    def from_task_frame(self, transform_task_to_world: PlanarTransform) -> Scenario:
        """A scenario with coordinates in the frame of a task as one in the world."""
        return self._in_frame(transform_task_to_world, FILE_GRID)

    def replaced(self, **sections: Any) -> Scenario:
        """The same scenario with whole sections replaced, or taken out by None; ScenarioError if unfit."""
        data = {key: value for key, value in {**self._data(), **sections}.items() if value is not None}
        if self.file.floor_height_m is None:
            data["floor_height_m"] = None
        return self._with(data, {})

    def check_push(self, duration: float) -> None:
        """Raise a ScenarioError if the push begins after a motion of that duration [s]."""
        push = self.file.push
        if push is not None and push.at_s >= duration:
            problem = f"is {push.at_s:g}; valid: before the motion ends at {duration:.3f} s"
            raise self.error(("push", "at_s"), problem)

    def missing_mesh(self) -> str | None:
        """Why a mesh of an installed distribution is not there; None where none is missing."""
        for item in self.file.scene:
            if item.mesh is not None and item.mesh.startswith(PACKAGE):
                try:
                    package_file(item.mesh)
                except SceneError as error:
                    return str(error)
        return None

    def to_yaml(self) -> str:
        """Return the scenario with every default and override written out, ready to run again.

        Paths of meshes, robots and recordings become absolute, so that the file can be kept elsewhere.
        """
        data = self._data()
        for obstacle in data["scene"]:
            if "mesh" in obstacle:
                obstacle["mesh"] = mesh_place(obstacle["mesh"], self.folder)
        for key in {"urdf", "mjcf"} & set(data["body"]):
            data["body"][key] = str((self.folder / data["body"][key]).resolve())
        if "recording" in data["planning"]:
            data["planning"]["recording"] = str(self.find_file(data["planning"]["recording"]).resolve())
        return _yaml(data)

    def to_short_yaml(self) -> str:
        """Return the scenario as people write it: without defaults, files by the names that were given."""
        return _yaml(self.file.model_dump(mode="json", exclude_defaults=True))

    def _in_frame(self, transform: PlanarTransform, decimals: int) -> Scenario:
        return self._with(moved_data(self.file, self._data(), transform, decimals), self.lines)

    def _with(
        self, data: Any, lines: Mapping[KeyPath, str], named: Mapping[KeyPath, str] | None = None
    ) -> Scenario:
        """The scenario of other content; messages name the places ``named`` of its keys."""
        file = validate(ScenarioFile, data, self.source, named)
        return Scenario(file, self.source, self.folder, lines)

    def _data(self) -> dict[str, Any]:
        """Content of the file in plain values, with every default."""
        data = self.file.model_dump(mode="json", exclude_none=True)
        if self.file.floor_height_m is None:
            data["floor_height_m"] = None
        return data


def _yaml(data: Mapping[str, Any]) -> str:
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100, default_flow_style=None)
