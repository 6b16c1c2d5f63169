"""Contact-plan file: the contacts of a way from start to goal, by whichever planner, in JSON.

The file names its scenario or holds it, and lists the stages in order: the contacts of each and, where the
planner has them, posture and centre of mass with which it begins. All coordinates are in the world.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

import numpy as np
import yaml
from pydantic import Discriminator, Field, Tag, model_validator

from manikin.body import BodyModel
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.body.limbs import hinge_line
from manikin.contact import Contact, ContactKind
from manikin.errors import ContactError, InputError, ScenarioError
from manikin.numerics.spatial import FloatArray, check_rotation
from manikin.runtime import __version__
from manikin.runtime.files import read_json
from manikin.scenarios import Scenario, ScenarioFile, load_scenario, validation
from manikin.scenarios.sections.planning_sections import BodySection
from manikin.scenarios.sections.support_sections import ContactSection, SoleSection, contact_tag
from manikin.scenarios.validation import Duration, Number, Section, Text, Vector3, optional, preset, required
from manikin.scenarios.world import build_contact, friction_of

FORMAT = "manikin-contact-plan-1"
"""Value of the key ``format``."""

SAME_PLACE = 1e-6
"""Difference up to which a contact of two stages is one that is kept [m] and [1]."""

Matrix3 = tuple[Vector3, Vector3, Vector3]
Quaternion = tuple[Number, Number, Number, Number]


class PlannedContactSection(ContactSection):
    """A contact as in a scenario's supports, with its exact frame."""

    rotation: Matrix3 | None = optional(
        "rows of the rotation from the contact's axes to the world's, instead of yaw_deg, normal and "
        "rpy_deg: x to the toes, z out of the scene into the body"
    )

    @model_validator(mode="after")
    def _frame(self) -> Self:
        given = [key for key in ("yaw_deg", "normal", "rpy_deg") if getattr(self, key)]
        if self.rotation is not None and given:
            raise validation.refuse(given[0], "is given beside rotation; valid: one of both")
        return self


PlannedContactEntry = Annotated[
    Annotated[Literal["same"], Tag("same")] | Annotated[PlannedContactSection, Tag("contact")],
    Discriminator(contact_tag),
]
"""A contact, or the word ``same`` for the one of the stage before."""


class PostureSection(Section):
    """A posture: where the root is, and the angles of the hinges."""

    position: Vector3 = required("of the root segment in the world [m]")
    quaternion_xyzw: Quaternion = required("rotation from the root segment's axes to the world's")
    angles_rad: dict[str, Number] = required("angle of each hinge by name [rad]; 0 where left out")


class StageSection(Section):
    """The contacts of one stage and how it begins."""

    contacts: dict[Text, PlannedContactEntry] = required(
        "contacts by effector; 'same' for the one of the stage before"
    )
    posture: PostureSection | None = optional(
        "with which the stage begins: it holds the contacts of this stage and of the one before"
    )
    com: Vector3 | None = optional("centre of mass then [m] (default: that of the posture)")
    com_velocity_m_s: Vector3 = preset(
        (0.0, 0.0, 0.0), "velocity of the centre of mass then; only where a dynamic stage begins or ends"
    )
    via: PostureSection | None = optional("posture in the middle of the stage")
    dynamic: Annotated[bool, Field(strict=True)] = preset(
        False, "whether the body moves through the stage without a place at which it could rest"
    )
    duration_s: Duration | None = optional("how long it lasts [s]; of a dynamic stage required")
    on_toes: list[Text] = preset(
        [], "feet that leave or land as the stage begins and are on their toes in the posture, the heel up"
    )

    @model_validator(mode="after")
    def _timed(self) -> Self:
        missing = self.dynamic and self.duration_s is None
        validation.refuse_if(missing, "duration_s", "is missing; valid: a number > 0 [s] for a dynamic stage")
        return self


class GoalSection(Section):
    """How the last stage ends."""

    posture: PostureSection | None = optional("posture at rest on the contacts of the last stage")
    com: Vector3 | None = optional("centre of mass then [m] (default: that of the posture)")


class ContactPlanFile(Section):
    """A whole contact-plan file."""

    format: Literal["manikin-contact-plan-1"] = required(f"{FORMAT!r}")
    planner: str = preset("", "who made it")
    scenario: Text | dict[str, Any] | None = optional(
        "name of a built-in scenario, path of a scenario file relative to this one, or the content of one: "
        "body, scene, contacts and task (default: the one that the plan is checked against)"
    )
    body: BodySection | None = optional("body of the plan; has to be that of the scenario")
    stages: Annotated[list[StageSection], Field(min_length=1)] = required("stages in order")
    goal: GoalSection = preset(GoalSection(), "how the last stage ends")

    @model_validator(mode="after")
    def _same_exists(self) -> Self:
        before: set[str] = set()
        for number, stage in enumerate(self.stages):
            for effector, entry in stage.contacts.items():
                key = f"stages[{number}].contacts.{effector}"
                if isinstance(entry, str):
                    problem = "is 'same' but the stage before has no such contact; valid: a contact"
                    validation.refuse_if(effector not in before, key, problem)
                else:
                    entry.check_for(effector, f"{key}.")
            before = set(stage.contacts)
        return self


@dataclass(frozen=True, eq=False)
class PlannedStage:
    """Contacts of one stage and how it begins, in the world.

    Attributes:
        contacts: By effector; one that is kept from the stage before is the same value.
        posture: (nq,) with which it begins, or None.
        com: (3,) centre of mass then [m]; None leaves it to the posture.
        com_velocity: (3,) its velocity [m/s].
        via: (nq,) posture in its middle, or None.
        dynamic: Whether the body moves through it without a place of rest.
        duration: How long it lasts [s], or None.
        on_toes: Feet that leave or land as it begins, on their toes in the posture.
    """

    contacts: Mapping[str, Contact]
    posture: FloatArray | None = None
    com: FloatArray | None = None
    com_velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    via: FloatArray | None = None
    dynamic: bool = False
    duration: float | None = None
    on_toes: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False)
class PlannedContacts:
    """Contacts of a way from start to goal, in the world.

    Attributes:
        stages: At least one.
        goal: (nq,) posture with which the last one ends, or None.
        goal_com: (3,) centre of mass then [m]; None leaves it to the posture.
        planner: Who made it.

    Raises:
        ContactError: If a number is not finite.
    """

    stages: tuple[PlannedStage, ...]
    goal: FloatArray | None = None
    goal_com: FloatArray | None = None
    planner: str = f"manikin {__version__}"

    def __post_init__(self) -> None:
        """Make contacts that are kept one value, and refuse numbers that are none."""
        stages, kept = [], dict[str, Contact]()
        _check_finite(self.goal, "goal.posture")
        _check_finite(self.goal_com, "goal.com")
        for number, stage in enumerate(self.stages):
            for key in ("posture", "com", "com_velocity", "via"):
                _check_finite(getattr(stage, key), f"stages[{number}].{key}")
            contacts = dict(stage.contacts)
            for name, contact in stage.contacts.items():
                for values in (contact.position, contact.rotation_contact_to_world, contact.points):
                    _check_finite(values, f"stages[{number}].contacts.{name}")
                if name in kept and _is_kept(contact, kept[name]):
                    contacts[name] = kept[name]
            kept = contacts
            stages.append(replace(stage, contacts=MappingProxyType(contacts)))
        object.__setattr__(self, "stages", tuple(stages))

    def to_dict(self, body: BodyModel, scenario: Scenario | None = None) -> dict[str, Any]:
        """Content of a contact-plan file for a body, with the whole scenario where one is given."""
        content: dict[str, Any] = {"format": FORMAT, "planner": self.planner}
        if scenario is not None:
            content["scenario"] = yaml.safe_load(scenario.to_yaml())
        before = [{}, *(stage.contacts for stage in self.stages)]
        stages = [_stage_dict(body, stage, kept) for stage, kept in zip(self.stages, before, strict=False)]
        goal = {"posture": _posture_dict(body, self.goal), "com": _listed(self.goal_com)}
        return content | {"stages": stages, "goal": {k: v for k, v in goal.items() if v is not None}}


def _check_finite(values: FloatArray | None, where: str) -> None:
    if values is not None and not np.all(np.isfinite(values)):
        raise ContactError(f"contact plan: {where} is {values.tolist()}; valid: finite numbers")


def _is_kept(contact: Contact, before: Contact) -> bool:
    alike = contact.same_place(before, SAME_PLACE) and contact.points.shape == before.points.shape
    return alike and bool(np.abs(contact.points - before.points).max() <= SAME_PLACE)


def load_contact_plan(path: str | Path, scenario: Scenario | None = None) -> tuple[Scenario, PlannedContacts]:
    """Read a contact-plan file, and the scenario that it is for.

    Args:
        scenario: What the plan is for; the file's own when omitted.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    try:
        content = read_json(Path(path), "a contact-plan file (.json)")
    except InputError as error:
        raise ScenarioError(str(error)) from None
    return parse_contact_plan(content, str(Path(path)), scenario, Path(path).parent)


def parse_contact_plan(
    content: Mapping[str, Any], source: str, scenario: Scenario | None = None, folder: Path | None = None
) -> tuple[Scenario, PlannedContacts]:
    """The same as :func:`load_contact_plan` from the content of a file.

    Args:
        content: Plain values, as of :meth:`PlannedContacts.to_dict`.
        source: Name of the file, for messages.
        folder: Folder that relative paths start from; the current one when omitted.
    """
    file = validation.validate(ContactPlanFile, json.loads(json.dumps(content)), source)
    scenario = scenario or _own_scenario(file, source, folder or Path())
    if file.body is not None and file.body != scenario.file.body:
        own = scenario.name
        raise ScenarioError(f"{source}: body is not that of scenario {own!r}; valid: the same, or none")
    body = scenario.build_body()
    stages, before = [], {}
    for number, section in enumerate(file.stages):
        where = f"{source}: stages[{number}]"
        contacts = {
            name: before[name] if isinstance(entry, str) else _contact(name, entry, scenario, body, where)
            for name, entry in section.contacts.items()
        }
        posture = _posture(section.posture, body, f"{where}.posture")
        com, velocity = _array(section.com), np.array(section.com_velocity_m_s)
        via, dynamic = _posture(section.via, body, f"{where}.via"), section.dynamic
        on_toes = frozenset(section.on_toes)
        feet = {name for name in before.keys() ^ contacts.keys() if hinge_line(body, name) is not None}
        if unknown := sorted(on_toes - feet):
            valid = ", ".join(sorted(feet)) or "none here"
            raise ScenarioError(
                f"{where}.on_toes names {unknown[0]!r}; valid: feet that leave or land, {valid}"
            )
        stages.append(
            PlannedStage(contacts, posture, com, velocity, via, dynamic, section.duration_s, on_toes)
        )
        before = contacts
    goal = _posture(file.goal.posture, body, f"{source}: goal.posture")
    return scenario, PlannedContacts(tuple(stages), goal, _array(file.goal.com), file.planner)


def _own_scenario(file: ContactPlanFile, source: str, folder: Path) -> Scenario:
    if file.scenario is None:
        problem = "scenario is missing; valid: a name, a file, or what a scenario file holds"
        raise ScenarioError(f"{source}: {problem}")
    if isinstance(file.scenario, str):
        beside = folder / file.scenario
        return load_scenario(str(beside) if beside.is_file() else file.scenario)
    name = f"{source}: scenario"
    return Scenario(validation.validate(ScenarioFile, file.scenario, name), name, folder)


def _contact(
    effector: str, entry: PlannedContactSection, scenario: Scenario, body: BodyModel, where: str
) -> Contact:
    if effector not in body.effectors:
        valid = ", ".join(body.effectors) or "none, the body has no effectors"
        raise ScenarioError(f"{where}.contacts.{effector} is no effector of the body; valid: {valid}")
    try:
        length, width = nominal_size(body, effector) or (0.01, 0.01)
        whole = SoleSection(length_m=length, width_m=width)
        contact = build_contact(effector, entry, friction_of(scenario), whole)
        if entry.rotation is None:
            return contact
        rotation, grasps = check_rotation(entry.rotation, "rotation"), contact.kind is ContactKind.GRASP
        return replace(contact, rotation_contact_to_world=rotation, oriented=grasps)
    except InputError as error:
        raise ScenarioError(f"{where}.contacts.{effector}: {error}") from None


def nominal_size(body: BodyModel, effector: str) -> tuple[float, float] | None:
    """Length and width of the flat part of an effector with which it can touch [m]; None of one without."""
    if effector == "buttocks" and body.stature is not None:
        return SEAT_LENGTH * body.stature, SEAT_WIDTH * body.stature
    limb = next((limb for limb in body.limbs if limb.effector == effector), None)
    if limb is not None and limb.patch is not None:
        return limb.patch
    if limb is None or limb.kind is not ContactKind.SOLE or not body.sole_length or not body.sole_width:
        return None
    return body.sole_length, body.sole_width


def _posture(section: PostureSection | None, body: BodyModel, where: str) -> FloatArray | None:
    if section is None:
        return None
    turn = np.array(section.quaternion_xyzw)
    if abs(np.linalg.norm(turn) - 1.0) > 1e-3:
        raise ScenarioError(f"{where}.quaternion_xyzw is {turn.tolist()}; valid: four numbers of length 1")
    unknown = sorted(set(section.angles_rad) - set(body.joint_names))
    if unknown:
        valid = ", ".join(body.joint_names)
        raise ScenarioError(f"{where}.angles_rad.{unknown[0]} is no hinge of the body; valid: {valid}")
    q = body.posture(section.angles_rad)
    q[:3], q[3:7] = section.position, turn / np.linalg.norm(turn)
    return q


def _array(value: Sequence[float] | None) -> FloatArray | None:
    return None if value is None else np.array(value, dtype=np.float64)


def _listed(value: FloatArray | None) -> list[float] | None:
    return None if value is None else value.tolist()


def _stage_dict(body: BodyModel, stage: PlannedStage, before: Mapping[str, Contact]) -> dict[str, Any]:
    contacts = {
        name: "same" if before.get(name) is contact else _contact_dict(contact)
        for name, contact in stage.contacts.items()
    }
    result: dict[str, Any] = {
        "contacts": contacts, "posture": _posture_dict(body, stage.posture), "com": _listed(stage.com),
        "via": _posture_dict(body, stage.via), "duration_s": stage.duration,
    }  # fmt: skip
    if np.any(stage.com_velocity):
        result["com_velocity_m_s"] = stage.com_velocity.tolist()
    if stage.dynamic:
        result["dynamic"] = True
    if stage.on_toes:
        result["on_toes"] = sorted(stage.on_toes)
    return {key: value for key, value in result.items() if value is not None}


def _contact_dict(contact: Contact) -> dict[str, Any]:
    common: dict[str, Any] = {"kind": str(contact.kind), "position": contact.position.tolist()}
    if contact.kind is not ContactKind.GRASP or contact.oriented:
        common["rotation"] = contact.rotation_contact_to_world.tolist()
    if contact.kind is ContactKind.GRASP:
        return common | {"max_force_N": contact.max_force, "max_moment_Nm": contact.max_moment}
    limits = {"normal_force_cap_N": contact.normal_force_cap, "torsion_limit_Nm": contact.torsion_limit}
    if contact.rolls:
        common["edge_radius_m"] = contact.edge_radius
    elif contact.kind is ContactKind.SOLE:
        common["polygon"] = contact.points[:, :2].tolist()
    common["friction"] = contact.friction
    return common | {key: value for key, value in limits.items() if value is not None}


def _posture_dict(body: BodyModel, q: FloatArray | None) -> dict[str, Any] | None:
    if q is None:
        return None
    angles = dict(zip(body.joint_names, q[7:].tolist(), strict=True))
    return {"position": q[:3].tolist(), "quaternion_xyzw": q[3:7].tolist(), "angles_rad": angles}
