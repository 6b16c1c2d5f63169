"""Section of a scenario file: how contacts are planned where no supports are given."""

from typing import Annotated

from pydantic import Field

from manikin.scenarios.sections.contact import SoleSection
from manikin.scenarios.validation import Positive, Section


class ContactsSection(Section):
    """How contacts are planned where no supports are given."""

    friction: Positive = Field(default=0.7, description="Coulomb coefficient of the soles")
    sole: SoleSection = Field(
        default=SoleSection(length_m=0.28, width_m=0.12), description="size of the soles"
    )
    stride_m: Positive = Field(
        default=0.36, description="length of a step [m] of a body of 1.75 m, scaled to the actual one"
    )
    attempts: Annotated[int, Field(strict=True, ge=1, le=20)] = Field(
        default=3, description="guides that are tried before giving up"
    )
