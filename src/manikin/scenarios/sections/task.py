"""Sections of a scenario file: from where to where."""

from typing import Literal, Self

from pydantic import Field, model_validator

from manikin.scenarios.validation import Number, Section, Vector2, Vector3, refuse


class StateSection(Section):
    """Where the body starts or ends."""

    com: Vector3 | None = Field(default=None, description="centre of mass [m]")
    velocity_m_s: Vector3 | None = Field(
        default=None, description="of the centre of mass when the body sits down at the goal (default: free)"
    )
    at: Vector2 | None = Field(default=None, description="where to stand, x and y [m]")
    heading_deg: Number | None = Field(default=None, description="where to face [deg]")
    height_m: Number | None = Field(
        default=None,
        description="height of the surface to stand or sit on there [m] (default: the lowest one on "
        "which the posture exists)",
    )
    posture: Literal["standing", "seated", "crouched", "climbing"] | None = Field(
        default=None,
        description="how the body is at rest there (default: standing); climbing, of a goal only: on what "
        "its limbs hold, as high as if it stood on that height",
    )

    @model_validator(mode="after")
    def _placed(self) -> Self:
        if self.com is None and self.at is None:
            raise refuse("com", "is missing; valid: three numbers [x, y, z] in metres, or at: [x, y]")
        return self


class TaskSection(Section):
    """From where to where."""

    start: StateSection = Field(description="state at the beginning, at rest")
    goal: StateSection = Field(description="state at the end, at rest")
