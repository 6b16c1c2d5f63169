"""A scenario: the checked file, and the builders that turn it into the library's values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from manikin.body.anthropometry import TOE_HINGE_FROM_HEEL
from manikin.contact import (
    Contact,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    point,
    roll_feet,
    sole,
    soles_overlap,
)
from manikin.errors import InputError, ScenarioError
from manikin.scenarios.expressions import Expression
from manikin.scenarios.heights import HeightBand, SupportLevel
from manikin.scenarios.overrides import override
from manikin.scenarios.schema import (
    ComConstraintSection,
    ContactSection,
    PlanningSection,
    PushSection,
    ScenarioFile,
    SoleSection,
    SupportsSection,
)
from manikin.scenarios.tree import Tree
from manikin.scenarios.validation import Path as KeyPath
from manikin.scenarios.validation import place, validate
from manikin.spatial import GRAVITY, FloatArray, frozen_array, rotation_from_rpy

if TYPE_CHECKING:
    from manikin.body import BodyModel
    from manikin.centroidal import CentroidalProblem, GeometricConstraint, KeyframeProblem
    from manikin.scene import Scene

BODY_WEIGHTS_CAP = 3.0
"""Cap on the sum of normal forces when the file gives none [body weights]."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """One job for the pipeline.

    Attributes:
        file: The checked content of the scenario file.
        source: Name of the file, for messages.
        folder: Folder that relative paths start from.
        lines: Place (file and line) of each key, for messages.
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
    def description(self) -> str:
        """One line about it."""
        return self.file.description

    @property
    def seed(self) -> int:
        """Seed of every random choice, unless the caller gives another."""
        return self.file.seed

    @property
    def mass(self) -> float:
        """Body mass [kg]."""
        return self.file.body.mass_kg

    @property
    def is_point_mass(self) -> bool:
        """Whether the body is a point mass, which is planned but has nothing to execute."""
        return self.file.body.model == "point_mass"

    @property
    def planning(self) -> PlanningSection:
        """Options of the centre-of-mass planner."""
        return self.file.planning

    @property
    def manner(self) -> str:
        """How the body carries itself where the task leaves freedom."""
        return self.file.manner

    @property
    def push(self) -> PushSection | None:
        """Disturbance during the execution, or None."""
        return self.file.push

    @property
    def stature_scale(self) -> float:
        """Stature over the reference stature of the task's heights."""
        reference = self.file.reference_stature_m
        return 1.0 if reference is None else self.file.body.stature_m / reference

    @property
    def start_com(self) -> FloatArray:
        """(3,) centre of mass at the start, scaled to the body [m].

        Raises:
            ScenarioError: If the file gives no CoM.
        """
        return self._scaled_com("start")

    @property
    def goal_com(self) -> FloatArray:
        """(3,) centre of mass at the goal, scaled to the body [m].

        Raises:
            ScenarioError: If the file gives no CoM.
        """
        return self._scaled_com("goal")

    @property
    def height_band(self) -> HeightBand | None:
        """Bounds of the CoM's height, scaled to the body, or None."""
        constraint = self._constraint("height_band")
        if constraint is None or constraint.height_band is None:
            return None
        band = constraint.height_band
        return HeightBand(
            Expression(band.lower), Expression(band.upper), self.support_level(), self.stature_scale
        )

    @property
    def max_support_distance(self) -> float | None:
        """Largest distance from the CoM to every foot in contact, scaled to the body [m], or None."""
        constraint = self._constraint("max_support_distance_m")
        if constraint is None or constraint.max_support_distance_m is None:
            return None
        return self.stature_scale * constraint.max_support_distance_m

    @property
    def required_margin(self) -> float:
        """Smallest margin allowed, scaled to the body like a weight times a length [N.m] or [N]."""
        reference = self.file.reference_mass_kg
        mass_scale = 1.0 if reference is None else self.mass / reference
        length_scale = self.stature_scale if self.planning.margin_space == "wrench" else 1.0
        return self.planning.min_margin * mass_scale * length_scale

    def with_body(
        self, stature_m: float | None = None, mass_kg: float | None = None, sex: str | None = None
    ) -> Scenario:
        """Return the same scenario for another body; what is None stays.

        Raises:
            ScenarioError: If a value is out of its range.
        """
        given = {"stature_m": stature_m, "mass_kg": mass_kg, "sex": sex}
        return self._changed(body={k: v for k, v in given.items() if v is not None})

    def with_seed(self, seed: int) -> Scenario:
        """Return the same scenario with another seed.

        Raises:
            ScenarioError: If the seed is negative.
        """
        return self._changed(seed=seed)

    def with_overrides(self, settings: Sequence[str]) -> Scenario:
        """Return the same scenario with single values set.

        Args:
            settings: ``"supports.friction=0.5"`` each; see :func:`manikin.scenarios.overrides.override`.

        Raises:
            ScenarioError: One line, if a key is not known or a value is not valid.
        """
        if not settings:
            return self
        changed = override(Tree(self._data(), self.lines), settings)
        file = validate(ScenarioFile, changed.data, self.source, changed.lines)
        return Scenario(file, self.source, self.folder, changed.lines)

    def build_body(self) -> BodyModel:
        """Build the body; its soles have the size that the supports give.

        Raises:
            ScenarioError: If the body's data are out of range.
        """
        from manikin.body import human, point_mass

        if self.is_point_mass:
            return point_mass(self.mass)
        data, supports = self.file.body, self.file.supports
        soles = (
            {"sole_length": supports.sole.length_m, "sole_width": supports.sole.width_m} if supports else {}
        )
        try:
            return human(data.stature_m, data.mass_kg, data.sex, **soles)
        except InputError as error:
            path: KeyPath = ("supports", "sole") if "sole" in str(error) else ("body",)
            raise self._refused(path, error) from None

    def build_scene(self) -> Scene:
        """Build the obstacles and the floor.

        Raises:
            ScenarioError: If a mesh cannot be read or a shape is degenerate.
        """
        from manikin.scenarios.obstacles import build_obstacle
        from manikin.scene import Scene

        obstacles = []
        for index, entry in enumerate(self.file.scene):
            try:
                obstacles.append(build_obstacle(entry, self.folder))
            except InputError as error:
                raise self._refused(("scene", index), error) from None
        return Scene(obstacles, floor_height=self.file.floor_height_m)

    def build_sequence(self, *, planning: bool = False) -> StanceSequence:
        """Build the stances of the explicit supports.

        Args:
            planning: With the smaller soles that planning balances on, where given.

        Raises:
            ScenarioError: If there are no supports, or a contact slides between phases.
        """
        sequence, supports = self._flat_sequence(planning), self._supports()
        if supports.foot == "flat":
            return sequence
        try:
            return roll_feet(sequence, (TOE_HINGE_FROM_HEEL - 0.5) * supports.sole.length_m)
        except InputError as error:
            raise self._refused(("supports", "foot"), error) from None

    def _flat_sequence(self, planning: bool = False) -> StanceSequence:
        """The stances as the file lists them, with full soles."""
        supports = self._supports()
        default_sole, friction, cap = supports.sole, supports.friction, supports.normal_force_cap_N
        if planning:
            default_sole = supports.planning_sole or default_sole
            friction = supports.planning_friction or friction
            cap = supports.planning_normal_force_cap_N or cap
        cap = cap or BODY_WEIGHTS_CAP * self.mass * GRAVITY
        seat = self._seat_patch()
        phases = []
        try:
            for section, contacts in zip(supports.phases, supports.resolved_phases(), strict=True):
                stance = Stance(
                    [
                        build_contact(
                            effector,
                            entry,
                            friction,
                            seat if effector == "buttocks" else default_sole,
                            planning=planning,
                            force_cap=supports.contact_normal_force_cap_N,
                        )
                        for effector, entry in contacts.items()
                    ],
                    cap,
                )
                phases.append(Phase(stance, section.min_duration_s, section.max_duration_s))
            return StanceSequence(phases)
        except InputError as error:
            raise self._refused(("supports", "phases"), error) from None

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
        if self.file.supports is None:
            return None
        sits = ["buttocks" in contacts for contacts in self.file.supports.resolved_phases()]
        if not sits[-1]:
            return None
        return len(sits) - next((k for k, held in enumerate(reversed(sits)) if not held), len(sits))

    def build_centroidal_problem(self) -> CentroidalProblem:
        """Build the problem of the centre-of-mass planner, with every height scaled to the body.

        The phases at the end in which the body sits are left out: there the centre of mass is
        not what keeps the balance ([Qiu2012]_ 7.2.2).

        Raises:
            ScenarioError: If the supports or a centre of mass are missing, or a value is out of range.
        """
        from manikin.centroidal import CentroidalProblem, Weights

        options, seat = self.planning, self.seated_from
        sequence = self.build_sequence(planning=True)
        rest = (0.0, 0.0, 0.0) if options.zero_end_accelerations else None
        given = {"degree": options.degree, "samples": options.samples}
        try:
            return CentroidalProblem(
                self.mass,
                sequence if seat is None else StanceSequence(sequence.phases[:seat]),
                self.start_com,
                self.goal_com,
                goal_velocity=self.file.task.goal.velocity_m_s if seat is not None else (0.0, 0.0, 0.0),
                start_acceleration=rest,
                goal_acceleration=rest if seat is None else None,
                margin_space=options.margin_space,
                required_margin=self.required_margin,
                support_distance=self.max_support_distance,
                geometric=self._height_constraints(),
                key_planes=(),
                max_duration=options.max_duration_s,
                weights=Weights(**options.weights.model_dump(exclude_none=True)),
                friction_model=options.friction_model,
                **{key: value for key, value in given.items() if value is not None},
            )
        except ScenarioError:
            raise
        except InputError as error:
            raise self._refused(("planning",), error) from None

    def build_keyframe_problem(self) -> KeyframeProblem | None:
        """Build the problem of the keyframe-based planner; None when the file asks for another one.

        Raises:
            ScenarioError: If the recording cannot be read or was made on other supports.
        """
        from manikin.centroidal import KeyframeProblem
        from manikin.scenarios.recordings import load_recording

        options = self.planning
        if options.method != "keyframes" or options.recording is None:
            return None
        try:
            recording = load_recording(
                self.find_file(options.recording), self.build_sequence(planning=True),
                self.file.body.stature_m, self.support_level(),
            )  # fmt: skip
            return KeyframeProblem.of(self.build_centroidal_problem(), recording, options.control_points)
        except ScenarioError:
            raise
        except InputError as error:
            raise self._refused(("planning", "recording"), error) from None

    def find_file(self, name: str) -> Path:
        """Path of a file that the scenario names: in its folder, or else from the current one."""
        inside = self.folder / name
        return inside if inside.exists() else Path(name)

    def _height_constraints(self) -> tuple[GeometricConstraint, ...]:
        from manikin.centroidal import height_band
        from manikin.scenarios.overhead import overhead_constraints

        band, entry = self.height_band, self._constraint("overhead")
        found = () if band is None else height_band(band.lower, band.upper)
        if entry is None or entry.overhead is None:
            return found
        names = None if entry.overhead == "automatic" else tuple(entry.overhead)
        overhead = overhead_constraints(
            self.build_body(),
            self.build_scene(),
            self.build_sequence(),
            (self.start_com, self.goal_com),
            names,
        )
        return (*found, *overhead)

    def check_contacts(self, scene: Scene, tolerance: float = 0.005) -> None:
        """Check that every contact of the supports lies on a surface of the scene.

        Args:
            scene: The built scene.
            tolerance: Largest gap and overhang of a contact point [m].

        Raises:
            ScenarioError: For the first contact that is off every surface or overlaps another.
        """
        for number, stance in enumerate(phase.stance for phase in self._flat_sequence()):
            for first, second in combinations(stance, 2):
                if soles_overlap(first, second):
                    raise self._error(
                        ("supports", "phases", number, second.effector),
                        f"overlaps {first.effector}; valid: soles that lie side by side",
                    )
            for contact in stance:
                try:
                    scene.touched_obstacle(contact, tolerance)
                except InputError as error:
                    path: KeyPath = ("supports", "phases", number, contact.effector)
                    raise self._refused(path, error) from None

    def check_push(self, duration: float) -> None:
        """Check that the push begins during the motion.

        Args:
            duration: Of the planned motion [s].

        Raises:
            ScenarioError: If it begins later.
        """
        if self.push is not None and self.push.at_s >= duration:
            raise self._error(
                ("push", "at_s"), f"is {self.push.at_s:g}; valid: before the motion ends at {duration:.3f} s"
            )

    def support_level(self) -> SupportLevel:
        """Height of the supports below the CoM, from the start to the goal."""
        ends = [np.array(self._com(end)[:2]) for end in ("start", "goal")]
        if self.file.supports is None:
            floor = self.file.floor_height_m or 0.0
            return SupportLevel(ends[0], ends[1], floor, floor)
        phases = self._supports().resolved_phases()
        return SupportLevel(ends[0], ends[1], _level(phases[0]), _level(phases[-1]))

    def to_yaml(self) -> str:
        """Return the scenario with every default and override written out, ready to run again.

        Paths of meshes and recordings become absolute, so that the file can be kept elsewhere.
        """
        data = self._data()
        for obstacle in data["scene"]:
            if "mesh" in obstacle:
                obstacle["mesh"] = str((self.folder / obstacle["mesh"]).resolve())
        if "recording" in data["planning"]:
            data["planning"]["recording"] = str(self.find_file(data["planning"]["recording"]).resolve())
        return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100, default_flow_style=None)

    def _seat_patch(self) -> SoleSection:
        """Rectangle of the body's buttocks that presses on a seat."""
        from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH

        stature = self.file.body.stature_m
        return SoleSection(length_m=SEAT_LENGTH * stature, width_m=SEAT_WIDTH * stature)

    def _changed(self, **changes: Any) -> Scenario:
        data = self._data()
        for key, change in changes.items():
            data[key] = {**data[key], **change} if isinstance(change, dict) else change
        file = validate(ScenarioFile, data, self.source)
        return Scenario(file, self.source, self.folder, self.lines)

    def _data(self) -> dict[str, Any]:
        """Content of the file in plain values, with every default."""
        data = self.file.model_dump(mode="json", exclude_none=True)
        if self.file.floor_height_m is None:
            data["floor_height_m"] = None
        return data

    def _supports(self) -> SupportsSection:
        if self.file.supports is None:
            raise self._error(
                ("supports",),
                "is missing; valid: an explicit sequence of phases, contacts are not planned yet",
            )
        return self.file.supports

    def _constraint(self, key: str) -> ComConstraintSection | None:
        return next((c for c in self.file.com_constraints if getattr(c, key) is not None), None)

    def _com(self, end: str) -> tuple[float, float, float]:
        com = getattr(self.file.task, end).com
        if com is None:
            raise self._error(("task", end, "com"), "is missing; valid: [x, y, z] in metres")
        return com

    def _scaled_com(self, end: str) -> FloatArray:
        x, y, z = self._com(end)
        level = self.support_level()
        base = level.start_level if end == "start" else level.goal_level
        if self.stature_scale != 1.0:
            z = base + self.stature_scale * (z - base)
        return frozen_array([x, y, z], f"{end} com [m]", (3,))

    def _check_numbers_of_band(self) -> None:
        index = next((i for i, c in enumerate(self.file.com_constraints) if c.height_band is not None), None)
        if index is None or self.file.supports is None:
            return
        band = self.height_band
        if band is None:
            return
        path: KeyPath = ("com_constraints", index, "height_band")
        for end in ("start", "goal"):
            x, y, z = (np.float64(value) for value in self._scaled_com(end))
            with np.errstate(all="ignore"):
                low, high = float(band.lower(x, y, z)), float(band.upper(x, y, z))
            for key, value in (("lower", low), ("upper", high)):
                if not math.isfinite(value):
                    raise self._error(
                        (*path, key), f"is {value} at the {end} CoM; valid: a finite height [m]"
                    )
            if low > high:
                raise self._error(
                    path,
                    f"has lower {low:.4g} above upper {high:.4g} at the {end} CoM; valid: lower <= upper",
                )

    def _refused(self, path: KeyPath, error: InputError) -> ScenarioError:
        return ScenarioError(f"{place(self.source, path, self.lines)}: {error}")

    def _error(self, path: KeyPath, text: str) -> ScenarioError:
        return ScenarioError(f"{place(self.source, path, self.lines)} {text}")


def build_contact(
    effector: str,
    entry: ContactSection,
    friction: float,
    default_sole: SoleSection,
    *,
    planning: bool = False,
    force_cap: float | None = None,
) -> Contact:
    """Build one contact from its section and the defaults around it.

    Args:
        effector: Name of the effector.
        entry: The contact's section.
        friction: Coulomb coefficient where the contact gives none.
        default_sole: Sole size where the contact gives none.
        planning: Let ``default_sole`` shrink a sole the contact gives itself.
        force_cap: Cap on the normal force where the contact gives none [N].

    Raises:
        ContactError: If a value is out of its range.
    """
    kind = entry.kind_for(effector)
    if kind == "grasp":
        rpy = None if entry.rpy_deg is None else np.radians(entry.rpy_deg)
        return grasp(
            effector,
            entry.position,
            max_force=(planning and entry.planning_max_force_N) or entry.max_force_N or 0.0,
            max_moment=entry.max_moment_Nm or 0.0,
            rotation=None if rpy is None else rotation_from_rpy(*rpy),
        )
    friction = entry.friction or friction
    force_cap = entry.normal_force_cap_N or force_cap
    if kind == "point":
        return point(
            effector, entry.position, friction=friction, normal=entry.normal,
            normal_force_cap=force_cap,
        )  # fmt: skip
    own = entry.sole or default_sole
    shrink = planning and entry.sole is not None
    return sole(
        effector,
        entry.position,
        math.radians(entry.yaw_deg),
        length=min(own.length_m, default_sole.length_m) if shrink else own.length_m,
        width=min(own.width_m, default_sole.width_m) if shrink else own.width_m,
        friction=friction,
        normal=entry.normal,
        normal_force_cap=force_cap,
        torsion_limit=entry.torsion_limit_Nm,
        settle=entry.settle_s or 0.0,
    )


def _level(contacts: Mapping[str, ContactSection]) -> float:
    feet = [c.position[2] for name, c in contacts.items() if "foot" in name]
    return float(np.mean(feet or [c.position[2] for c in contacts.values()]))
