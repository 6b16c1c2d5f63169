"""The stance file of ``manikin balance``: one stance, one centre-of-mass state."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from manikin.balance import BalanceReport, evaluate_balance
from manikin.contact import Stance, default_normal_force_cap
from manikin.errors import InputError, ScenarioError
from manikin.scenarios.sections.planning_sections import FRICTION_MODEL_TEXT, FrictionModelName
from manikin.scenarios.sections.support_sections import SOLE, ContactSection, SoleSection
from manikin.scenarios.validation import (
    Positive,
    Section,
    Text,
    Vector3,
    optional,
    place,
    preset,
    refuse_repeated,
    required,
    validate,
)
from manikin.scenarios.world import build_contact
from manikin.scenarios.yaml_reader import read_yaml


class NamedContactSection(ContactSection):
    """A contact and who makes it."""

    effector: Text = required("name, such as left_foot or right_hand")


class StanceFile(Section):
    """A whole stance file."""

    mass_kg: Positive = required("body mass [kg]")
    com: Vector3 = required("centre of mass [m]")
    acceleration: Vector3 = preset((0.0, 0.0, 0.0), "of the centre of mass [m/s^2]")
    angular_momentum_rate: Vector3 = preset((0.0, 0.0, 0.0), "about the centre of mass [N.m]")
    contacts: Annotated[list[NamedContactSection], Field(min_length=1)] = required("the contacts")
    friction: Positive = preset(0.7, "Coulomb coefficient where a contact gives none")
    sole: SoleSection = preset(SOLE, "sole size where a contact gives none")
    normal_force_cap_N: Positive | None = optional(
        "largest sum of normal forces [N] (default: 3 body weights)"
    )
    friction_model: FrictionModelName = preset("outer", FRICTION_MODEL_TEXT)
    reference: Vector3 = preset((0.0, 0.0, 0.0), "point of the moments [m]")

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [contact.effector for contact in self.contacts]
        refuse_repeated(names, "contacts[{}].effector", "one contact each")
        for index, contact in enumerate(self.contacts):
            contact.check_for(contact.effector, f"contacts[{index}].")
        return self


def judge_stance_file(path: Path) -> BalanceReport:
    """Judge the stance of a file by its wrench polytope and by the classical criteria.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    data, lines = read_yaml(path, "stance")
    file, where = validate(StanceFile, data, str(path), lines), place(str(path), ("contacts",), lines)
    try:
        contacts = [build_contact(entry.effector, entry, file.friction, file.sole) for entry in file.contacts]
        cap = file.normal_force_cap_N or default_normal_force_cap(file.mass_kg)
        stance, where = Stance(contacts, cap, file.friction_model), str(path)
        state = file.com, file.acceleration, file.angular_momentum_rate
        return evaluate_balance(stance, file.mass_kg, *state, reference=file.reference)
    except InputError as error:
        raise ScenarioError(f"{where}: {error}") from None
