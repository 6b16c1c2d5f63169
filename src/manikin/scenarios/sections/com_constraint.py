"""Sections of a scenario file: constraints on the centre of mass."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from manikin.errors import ScenarioError
from manikin.scenarios.expressions import Expression
from manikin.scenarios.sections.frame import FrameSection
from manikin.scenarios.validation import Positive, Section, Text, refuse


class HeightBandSection(Section):
    """Lower and upper bound of the CoM's height."""

    lower: Text = Field(description="expression of the lowest height [m] in x, y, z of the CoM")
    upper: Text = Field(description="expression of the greatest height [m] in x, y, z of the CoM")
    frame: FrameSection | None = Field(
        default=None, description="frame of the expressions' x and y (default: the world's)"
    )

    def implied(self) -> dict[str, Any]:
        """The frame of the expressions."""
        return {} if self.frame is not None else {"frame": FrameSection()}

    @field_validator("lower", "upper")
    @classmethod
    def _parses(cls, text: str) -> str:
        try:
            Expression(text)
        except ScenarioError as error:
            raise refuse("", str(error)) from None
        return text


class ComConstraintSection(Section):
    """One constraint on the centre of mass: exactly one of the keys."""

    height_band: HeightBandSection | None = Field(default=None, description="bounds of the CoM's height")
    max_support_distance_m: Positive | None = Field(
        default=None, description="largest distance from the CoM to every contact, hands included [m]"
    )
    overhead: Annotated[list[Text], Field(min_length=1)] | Literal["automatic"] | None = Field(
        default=None,
        description="keep the CoM low enough for the body to fold below overhead obstacles: 'automatic' for "
        "all that hover over the way at least 0.3 m above the supports, or the names of those to pass below",
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        keys = type(self)._keys()
        if sum(getattr(self, key) is not None for key in keys) != 1:
            raise refuse("", f"holds none or several; valid: exactly one of {', '.join(keys)}")
        return self
