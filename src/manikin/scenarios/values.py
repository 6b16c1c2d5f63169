"""Values of a scenario file, scaled to its body, with their places in the file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import manikin.body as bodies
from manikin.body import BodyModel
from manikin.contact import ContactModel
from manikin.errors import InputError, ScenarioError
from manikin.numerics.spatial import IDENTITY, FloatArray, PlanarTransform, frozen_array
from manikin.scenarios.expressions import Expression, HeightBand, SupportLevel
from manikin.scenarios.placement import start_heading_deg, task_frame
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.sections.planning_sections import ContactsSection
from manikin.scenarios.sections.support_sections import ContactSection, SoleSection, SupportsSection
from manikin.scenarios.validation import KeyPath, place


@dataclass(frozen=True, eq=False)
class ScenarioValues:
    """A checked scenario file and the numbers in it, scaled to the body.

    Relative paths start from ``folder``; ``source`` and ``lines``, those of keys, are for messages.
    """

    file: ScenarioFile
    source: str = "scenario"
    folder: Path = Path()
    lines: Mapping[KeyPath, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._check_numbers_of_band()

    @property
    def name(self) -> str:
        """Short name."""
        return self.file.name

    @property
    def seed(self) -> int:
        """Seed of every random choice, unless the caller gives another."""
        return self.file.seed

    @property
    def mass(self) -> float:
        """Body mass, without a load [kg]."""
        if self.file.body.model in ("urdf", "mjcf", "kudoh"):
            return build_body(self).own_mass
        return self.file.body.mass_kg

    @property
    def moved_mass(self) -> float:
        """Body mass with what the hands carry during the whole motion [kg]."""
        load = self.file.body.load
        return self.mass if load is None or not load.lasts else self.mass + load.mass_kg

    @property
    def is_point_mass(self) -> bool:
        """Whether the body is a point mass, which is planned but has nothing to execute."""
        return self.file.body.model == "point_mass"

    @property
    def keeps_upright(self) -> bool:
        """Whether the body is a person whose file leaves the centre of mass free."""
        return self.file.body.model == "human" and not self.file.com_constraints

    @property
    def contact_model(self) -> ContactModel:
        """Friction model of the file and the default cap of the body, for every stance of every stage."""
        return ContactModel.of_body(self.moved_mass, self.file.planning.friction_model)

    @property
    def refines(self) -> bool:
        """Whether the whole body's motion is found by refinement."""
        return self.file.wholebody.method == "refine"

    @property
    def execution_required(self) -> bool:
        """Whether the planned motion has to be executed for the run to succeed."""
        return self.file.execution.required

    @property
    def stature_scale(self) -> float:
        """Stature over the reference stature of the task's heights."""
        reference = self.file.reference_stature_m
        return 1.0 if reference is None else self.file.body.stature_m / reference

    @property
    def start_com(self) -> FloatArray:
        """(3,) centre of mass at the start, scaled to the body [m]; an error where the file gives none."""
        return self._scaled_com("start")

    @property
    def goal_com(self) -> FloatArray:
        """(3,) centre of mass at the goal, scaled to the body [m]; an error where the file gives none."""
        return self._scaled_com("goal")

    @property
    def height_band(self) -> HeightBand | None:
        """Bounds of the CoM's height, scaled to the body, or None."""
        band = self.constraint("height_band")
        if band is None:
            return None
        frame = IDENTITY if band.frame is None else band.frame.transform_to_world()
        return HeightBand(
            Expression(band.lower), Expression(band.upper), self.support_level(), self.stature_scale, frame
        )

    @property
    def max_support_distance(self) -> float | None:
        """Largest distance from the CoM to every contact, scaled to the body [m], or None."""
        distance = self.constraint("max_support_distance_m")
        return None if distance is None else self.stature_scale * distance

    @property
    def required_margin(self) -> float:
        """Smallest margin allowed, scaled to the body like a weight times a length [N.m] or [N]."""
        reference = self.file.reference_mass_kg
        mass_scale = 1.0 if reference is None else self.mass / reference
        length_scale = self.stature_scale if self.file.planning.margin_space == "wrench" else 1.0
        return self.file.planning.min_margin * mass_scale * length_scale

    @property
    def contacts(self) -> ContactsSection:
        """Options of planned contacts, where no supports are given."""
        return self.file.contacts or ContactsSection()

    @property
    def contact_limbs(self) -> tuple[str, ...] | None:
        """Limbs that planned contacts are made with; an empty tuple means all, None a human's feet."""
        given = self.contacts.limbs
        if given is not None:
            return tuple(given)
        return None if self.file.body.model == "human" else ()

    @property
    def sole(self) -> SoleSection | None:
        """Size of the soles; None leaves it to the body."""
        if self.file.supports is not None:
            return self.file.supports.sole
        return None if self.file.contacts is None else self.file.contacts.sole

    @property
    def friction_share(self) -> float:
        """Share of the real friction for the controller: half way from planning's to all of it."""
        supports = self.file.supports
        if supports is None or supports.planning_friction is None:
            return 1.0
        return 0.5 * (1.0 + supports.planning_friction / supports.friction)

    @property
    def padded(self) -> tuple[str, ...]:
        """Names of the obstacles that any part of the body may lean on."""
        return tuple(obstacle.name for obstacle in self.file.scene if obstacle.padded)

    @property
    def seated_from(self) -> int | None:
        """First phase of those, up to the last, in which the body sits; None when it ends on its feet."""
        phases = self._phases
        on_feet = [number for number, held in enumerate(phases) if "buttocks" not in held]
        first = max(on_feet, default=-1) + 1
        return first if first < len(phases) else None

    def find_file(self, name: str) -> Path:
        """Path of a file that the scenario names: in its folder, or else from the current one."""
        inside = self.folder / name
        return inside if inside.exists() else Path(name)

    @property
    def start_level(self) -> float:
        """Height of the supports at the start, or of the floor; 0 without either [m]."""
        contacts = self._first_contacts
        return self.file.floor_height_m or 0.0 if contacts is None else _level(contacts)

    @property
    def start_heading_deg(self) -> float:
        """Heading at the start: the file's, or that of the feet of the first phase, or 0 [deg]."""
        return start_heading_deg(self.file.task.start, self._first_contacts)

    @property
    def transform_task_to_world(self) -> PlanarTransform:
        """Transform from the task's own frame to the world, see :mod:`manikin.scenarios.placement`."""
        return task_frame(self.file.task.start, self._first_contacts)

    @property
    def _phases(self) -> list[dict[str, ContactSection]]:
        return [] if self.file.supports is None else self.file.supports.resolved_phases()

    @property
    def _first_contacts(self) -> dict[str, ContactSection] | None:
        return next(iter(self._phases), None)

    def support_level(self) -> SupportLevel:
        """Height of the supports below the CoM, from the start to the goal."""
        start, goal = (np.array(self._com(end)[:2]) for end in ("start", "goal"))
        phases, level = self._phases, self.start_level
        return SupportLevel(start, goal, level, _level(phases[-1]) if phases else level)

    def explicit_supports(self) -> SupportsSection:
        """The sequence of supports that the file lists; ScenarioError if it lists none."""
        if self.file.supports is None:
            raise self.error(("supports",), "is missing; valid: an explicit sequence of phases")
        return self.file.supports

    def constraint(self, key: str) -> Any:
        """Value of the constraint on the centre of mass that has the key, or None."""
        given = (getattr(item, key) for item in self.file.com_constraints)
        return next((value for value in given if value is not None), None)

    @contextmanager
    def refusing(self, path: KeyPath) -> Iterator[None]:
        """Context in which the library's InputError becomes a ScenarioError with the place of the key."""
        try:
            yield
        except ScenarioError:
            raise
        except InputError as error:
            raise ScenarioError(f"{place(self.source, path, self.lines)}: {error}") from None

    def error(self, path: KeyPath, text: str) -> ScenarioError:
        """Error whose message is the place of the key and the text."""
        return ScenarioError(f"{place(self.source, path, self.lines)} {text}")

    def _com(self, end: str) -> tuple[float, float, float]:
        com = getattr(self.file.task, end).com
        if com is None:
            raise self.error(("task", end, "com"), "is missing; valid: [x, y, z] in metres")
        return com

    def _scaled_com(self, end: str) -> FloatArray:
        x, y, z = self._com(end)
        level = self.support_level()
        base = level.start_level if end == "start" else level.goal_level
        if self.stature_scale != 1.0:
            z = base + self.stature_scale * (z - base)
        return frozen_array([x, y, z], f"{end} com [m]", (3,))

    def _check_numbers_of_band(self) -> None:
        band = self.height_band if self.file.supports is not None else None
        if band is None:
            return
        index = [c.height_band is not None for c in self.file.com_constraints].index(True)
        path: KeyPath = ("com_constraints", index, "height_band")
        for end in ("start", "goal"):
            x, y, z = (np.float64(value) for value in self._scaled_com(end))
            with np.errstate(all="ignore"):
                low, high = float(band.lower(x, y, z)), float(band.upper(x, y, z))
            for key, value in (("lower", low), ("upper", high)):
                if not math.isfinite(value):
                    raise self.error((*path, key), f"is {value} at the {end} CoM; valid: a finite height [m]")
            if low > high:
                heights = f"has lower {low:.4g} above upper {high:.4g}"
                raise self.error(path, f"{heights} at the {end} CoM; valid: lower <= upper")


def _level(contacts: Mapping[str, ContactSection]) -> float:
    feet = [c.position[2] for name, c in contacts.items() if "foot" in name]
    return float(np.mean(feet or [c.position[2] for c in contacts.values()]))


@lru_cache(maxsize=32)
def _same_human(
    stature: float, mass: float, sex: str, *, dimensions: tuple[tuple[str, float], ...], **others: Any
) -> BodyModel:
    """One body for equal values, so that what is kept by it (folds, reach) serves every scenario of it."""
    return bodies.human(stature, mass, sex, dimensions=dict(dimensions), **others)


def build_body(values: ScenarioValues) -> BodyModel:
    """Build the body, its soles of the size that the supports give; ScenarioError if it is out of range."""
    data, sole = values.file.body, values.sole
    if data.model in ("insect", "quadruped", "urdf", "mjcf"):
        return _creature(values)
    load = data.load if data.load is not None and data.load.lasts else None
    if data.model == "kudoh":
        return bodies.kudoh() if load is None else bodies.carrying(bodies.kudoh(), load.mass_kg, load.hand)
    if values.is_point_mass:
        return bodies.point_mass(values.mass)
    length, width = (None, None) if sole is None else (sole.length_m, sole.width_m)
    try:
        body = _same_human(
            data.stature_m, data.mass_kg, data.sex, age=data.age, strength=data.strength,
            sole_length=length, sole_width=width, dimensions=tuple(data.dimensions.items()),
        )  # fmt: skip
        body = body if load is None else bodies.carrying(body, load.mass_kg, load.hand)
        return bodies.with_further_contacts(body, data.further_contacts) if data.further_contacts else body
    except InputError as error:
        with values.refusing(("supports", "sole") if "sole" in str(error) else ("body",)):
            raise


def _creature(values: ScenarioValues) -> BodyModel:
    """An insect, a quadruped, or the creature of a robot description."""
    data = values.file.body
    with values.refusing(("body",)):
        if data.model in ("insect", "quadruped"):
            make = bodies.insect if data.model == "insect" else bodies.quadruped
            return make(data.length_m, data.mass_kg)
        sole = data.sole
        options: dict[str, Any] = {
            "standing": {name: float(np.deg2rad(angle)) for name, angle in (data.standing_deg or {}).items()},
            "sole_length": None if sole is None else sole.length_m,
            "sole_width": None if sole is None else sole.width_m,
        }
        limbs = {name: limb.model_dump() for name, limb in (data.limbs or {}).items()}
        if data.model == "urdf":
            return bodies.creature_from_urdf(values.folder / str(data.urdf), limbs, **options)
        if data.joint_speed_deg_s is not None:
            options["joint_speed"] = float(np.deg2rad(data.joint_speed_deg_s))
        return bodies.creature_from_mjcf(values.folder / str(data.mjcf), limbs, **options)
