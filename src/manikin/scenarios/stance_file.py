"""The stance file of ``manikin balance``: one stance, one centre-of-mass state."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from manikin.contact import Stance, default_normal_force_cap
from manikin.errors import InputError, ScenarioError
from manikin.scenarios.sections.planning_sections import FRICTION_MODEL_TEXT, FrictionModelName
from manikin.scenarios.sections.support_sections import ContactSection, SoleSection
from manikin.scenarios.validation import (
    Positive,
    Section,
    Text,
    Vector3,
    optional,
    place,
    preset,
    refuse,
    required,
    validate,
)
from manikin.scenarios.world import build_contact
from manikin.scenarios.yaml_reader import read_yaml

if TYPE_CHECKING:
    from manikin.balance import BalanceReport


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
    sole: SoleSection = preset(
        SoleSection(length_m=0.28, width_m=0.12), "sole size where a contact gives none"
    )
    normal_force_cap_N: Positive | None = optional(
        "largest sum of normal forces [N] (default: 3 body weights)"
    )
    friction_model: FrictionModelName = preset("outer", FRICTION_MODEL_TEXT)
    reference: Vector3 = preset((0.0, 0.0, 0.0), "point of the moments [m]")

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [contact.effector for contact in self.contacts]
        for index, contact in enumerate(self.contacts):
            if contact.effector in names[:index]:
                raise refuse(
                    f"contacts[{index}].effector", f"is {contact.effector!r} again; valid: one contact each"
                )
            contact.check_for(contact.effector, f"contacts[{index}].")
        return self

    def build_stance(self) -> Stance:
        """Build the stance.

        Raises:
            ContactError: If a contact is not usable.
        """
        contacts = [build_contact(entry.effector, entry, self.friction, self.sole) for entry in self.contacts]
        cap = self.normal_force_cap_N or default_normal_force_cap(self.mass_kg)
        return Stance(contacts, cap, self.friction_model)


@dataclass(frozen=True, eq=False)
class BalanceQuestion:
    """A checked stance file.

    Attributes:
        file: Its content.
        source: Its name, for messages.
    """

    file: StanceFile
    source: str

    def evaluate(self) -> BalanceReport:
        """Judge the stance by its wrench polytope and by the classical criteria.

        Raises:
            ScenarioError: If the contacts or the state are not usable.
        """
        from manikin.balance import evaluate_balance

        file = self.file
        try:
            return evaluate_balance(
                file.build_stance(), file.mass_kg, file.com, file.acceleration, file.angular_momentum_rate,
                reference=file.reference,
            )  # fmt: skip
        except InputError as error:
            raise ScenarioError(f"{self.source}: {error}") from None


def load_stance_file(path: str | Path) -> BalanceQuestion:
    """Read a stance file.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    file_path = Path(path)
    if file_path.is_dir():
        raise ScenarioError(f"{file_path}: is a directory; valid: a stance file (.yaml)")
    if not file_path.is_file():
        raise ScenarioError(f"{file_path}: there is no such file; valid: a stance file (.yaml)")
    data, lines = read_yaml(file_path)
    file = validate(StanceFile, data, str(file_path), lines)
    try:
        file.build_stance()
    except InputError as error:
        raise ScenarioError(f"{place(str(file_path), ('contacts',), lines)}: {error}") from None
    return BalanceQuestion(file, str(file_path))
