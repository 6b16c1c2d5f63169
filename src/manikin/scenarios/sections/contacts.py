"""Section of a scenario file: how contacts are planned where no supports are given."""

from typing import Annotated, Literal

from pydantic import Field

from manikin.scenarios.sections.contact import SoleSection
from manikin.scenarios.validation import Positive, Section, Text


class ContactsSection(Section):
    """How contacts are planned where no supports are given."""

    friction: Positive = Field(default=0.7, description="Coulomb coefficient of the soles")
    sole: SoleSection = Field(
        default=SoleSection(length_m=0.28, width_m=0.12), description="size of the soles"
    )
    stride_m: Positive = Field(
        default=0.36, description="length of a step [m] of a body of 1.75 m, scaled to the actual one"
    )
    limbs: list[Text] | None = Field(
        default=None,
        description="names of the limbs that make contacts, hands as grasps (default: a human's feet, in "
        "steps on surfaces that carry the whole sole; all limbs of other bodies)",
    )
    grasp_force_N: Positive = Field(default=400.0, description="largest force of a grasp along each axis [N]")
    forefoot_m: Positive | None = Field(
        default=None,
        description="length of the front of the soles that has to lie on a hold [m] (default: whole soles)",
    )
    ranges: Literal["limits", "learnt"] = Field(
        default="limits",
        description="what bounds a human's hips and shoulders: the intervals of their hinges alone, or the "
        "volumes learnt from recorded motion as well",
    )
    attempts: Annotated[int, Field(strict=True, ge=1, le=20)] = Field(
        default=3, description="guides that are tried before giving up"
    )
