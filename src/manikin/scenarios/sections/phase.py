"""Section of a scenario file: the contacts of one phase."""

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from manikin.scenarios.sections.contact import ContactSection
from manikin.scenarios.validation import Duration, Moves, Section, Vector3, refuse

EFFECTORS = ("left_foot", "right_foot", "left_hand", "right_hand", "buttocks")
"""Effectors of a human that a phase may put in contact, in the order of the contact tables."""

MASSLESS_FEET = ("left_front_foot", "right_front_foot", "left_hind_foot", "right_hind_foot")
"""Feet that only a point mass has, besides those of a human."""


def _contact_tag(value: Any) -> str:
    return "same" if isinstance(value, str) else "contact"


ContactEntry = Annotated[
    Annotated[Literal["same"], Tag("same")] | Annotated[ContactSection, Tag("contact")],
    Discriminator(_contact_tag),
]
"""A contact, or the word ``same`` for the one of the phase before."""


class PhaseSection(Section):
    """The contacts of one phase and how long it may last; an effector left out is in the air."""

    left_foot: ContactEntry | None = Field(default=None, description="contact of the left foot, or 'same'")
    right_foot: ContactEntry | None = Field(default=None, description="contact of the right foot, or 'same'")
    left_hand: ContactEntry | None = Field(default=None, description="contact of the left hand, or 'same'")
    right_hand: ContactEntry | None = Field(default=None, description="contact of the right hand, or 'same'")
    left_front_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    right_front_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    left_hind_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    right_hind_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    buttocks: ContactEntry | None = Field(default=None, description="contact with a seat, or 'same'")
    min_duration_s: Duration = Field(default=0.1, description="shortest duration [s]")
    max_duration_s: Duration | None = Field(default=None, description="longest duration [s]")
    com_near: Annotated[Vector3 | None, Moves.POINT] = Field(
        default=None, description="where the centre of mass should be when the phase begins [m]"
    )
    com_within_m: Vector3 = Field(
        default=(0.05, 0.05, 0.05),
        description="how far it may be from there along x, y and z of the task frame, x being the heading "
        "at the start [m]",
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.max_duration_s is not None and self.max_duration_s < self.min_duration_s:
            raise refuse(
                "max_duration_s", f"is {self.max_duration_s:g}; valid: at least min_duration_s = "
                f"{self.min_duration_s:g}"
            )  # fmt: skip
        if min(self.com_within_m) <= 0.0:
            raise refuse("com_within_m", f"is {list(self.com_within_m)}; valid: three numbers > 0 [m]")
        if not self.entries():
            raise refuse("", f"has no contact; valid: at least one of {', '.join(EFFECTORS)}")
        for effector, entry in self.entries().items():
            if not isinstance(entry, str):
                entry.check_for(effector, f"{effector}.")
        return self

    def entries(self) -> dict[str, "ContactSection | Literal['same']"]:
        """Contacts by effector, those in the air left out."""
        found = {name: getattr(self, name) for name in (*EFFECTORS, *MASSLESS_FEET)}
        return {name: entry for name, entry in found.items() if entry is not None}
