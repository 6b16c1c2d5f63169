"""Section of a scenario file: the sequence of supports."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from manikin.scenarios.sections.contact import ContactSection, SoleSection
from manikin.scenarios.sections.phase import PhaseSection
from manikin.scenarios.validation import Positive, Section, refuse


class SupportsSection(Section):
    """An explicit sequence of supports, with the defaults of its contacts."""

    friction: Positive = Field(default=0.7, description="Coulomb coefficient of soles and points")
    sole: SoleSection = Field(
        default=SoleSection(length_m=0.28, width_m=0.12), description="size of the real soles"
    )
    planning_sole: SoleSection | None = Field(
        default=None,
        description="smaller soles that planning balances on, for robustness (default: the real ones)",
    )
    foot: Literal["flat", "rolling"] = Field(
        default="flat",
        description="whether a foot lands and leaves with its whole sole, or lands on its heel and leaves "
        "from its toes while another foot stands",
    )
    planning_friction: Positive | None = Field(
        default=None, description="smaller friction that planning balances with (default: the real one)"
    )
    normal_force_cap_N: Positive | None = Field(
        default=None, description="largest sum of the normal forces of a stance [N] (default: 3 body weights)"
    )
    contact_normal_force_cap_N: Positive | None = Field(
        default=None, description="largest normal force of each sole or point that gives none itself [N]"
    )
    planning_normal_force_cap_N: Positive | None = Field(
        default=None, description="smaller cap that planning balances with (default: the real one)"
    )
    phases: Annotated[list[PhaseSection], Field(min_length=1)] = Field(description="phases in order")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.planning_sole is not None:
            for key in ("length_m", "width_m"):
                ours, real = getattr(self.planning_sole, key), getattr(self.sole, key)
                if ours > real:
                    raise refuse(f"planning_sole.{key}", f"is {ours:g}; valid: at most sole.{key} = {real:g}")
        for key, real in (
            ("planning_friction", "friction"),
            ("planning_normal_force_cap_N", "normal_force_cap_N"),
        ):
            ours, limit = getattr(self, key), getattr(self, real)
            if ours is not None and limit is not None and ours > limit:
                raise refuse(key, f"is {ours:g}; valid: at most {real} = {limit:g}")
        if self.phases[0].com_near is not None:
            raise refuse("phases[0].com_near", "is given; valid: task.start.com says where the motion begins")
        if self.foot == "rolling" and any(phase.com_near is not None for phase in self.phases):
            raise refuse("foot", "is rolling beside a phase with com_near; valid: flat, or no com_near")
        for number, phase in enumerate(self.phases):
            before = self.phases[number - 1].entries() if number else {}
            for effector, entry in phase.entries().items():
                if entry == "same" and effector not in before:
                    raise refuse(
                        f"phases[{number}].{effector}", "is 'same' but the phase before has no such contact; "
                        "valid: a contact with a position"
                    )  # fmt: skip
        return self

    def resolved_phases(self) -> list[dict[str, ContactSection]]:
        """Contacts of each phase with every ``same`` replaced by what it stands for."""
        phases: list[dict[str, ContactSection]] = []
        for phase in self.phases:
            contacts: dict[str, ContactSection] = {}
            for effector, entry in phase.entries().items():
                contacts[effector] = phases[-1][effector] if isinstance(entry, str) else entry
            phases.append(contacts)
        return phases
