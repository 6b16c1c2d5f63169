"""Sections of a scenario file: from where to where."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from manikin.scenarios.validation import (
    Moves,
    NonNegative,
    Number,
    Positive,
    Section,
    Text,
    Vector2,
    Vector3,
    refuse,
    rule_error,
)


class StateSection(Section):
    """Where the body starts or ends."""

    com: Annotated[Vector3 | None, Moves.POINT] = Field(default=None, description="centre of mass [m]")
    velocity_m_s: Annotated[Vector3 | None, Moves.DIRECTION] = Field(
        default=None, description="of the centre of mass when the body sits down at the goal (default: free)"
    )
    at: Annotated[Vector2 | None, Moves.POINT] = Field(
        default=None, description="where to stand, x and y [m]"
    )
    heading_deg: Annotated[Number | None, Moves.HEADING] = Field(
        default=None, description="where to face [deg]"
    )
    height_m: Number | None = Field(
        default=None,
        description="height of the surface to stand or sit on there [m] (default: the lowest one on "
        "which the posture exists)",
    )
    posture: Literal["standing", "seated", "crouched", "climbing"] | None = Field(
        default=None,
        description="how the body is at rest there (default: standing); climbing: on what its limbs "
        "hold, as high as if it stood on that height",
    )

    @model_validator(mode="after")
    def _placed(self) -> Self:
        if self.com is None and self.at is None:
            raise refuse("com", "is missing; valid: three numbers [x, y, z] in metres, or at: [x, y]")
        return self

    def implied(self) -> dict[str, Any]:
        """The heading of a body that stands at a place."""
        return {} if self.at is None or self.heading_deg is not None else {"heading_deg": 0.0}


class ActSection(Section):
    """What the hands do to an object where the way ends."""

    kind: Literal["push", "pull"] = Field(description="press with the palms, or hold on and draw")
    on: Text = Field(description="name of an obstacle; it does not move")
    direction: Annotated[Vector3, Moves.DIRECTION] = Field(
        description="where the force on the object points; level"
    )
    force_N: Positive = Field(description="force on the object [N]")
    ramp_s: Positive = Field(default=1.0, description="time in which the force rises from none [s]")
    hold_s: NonNegative = Field(default=2.0, description="time for which it is held then [s]")

    @field_validator("direction")
    @classmethod
    def _level(cls, direction: Any) -> Any:
        if not any(direction) or direction[2] != 0.0:
            raise rule_error("a direction that is level (its z 0) and not zero")
        return direction


class TaskSection(Section):
    """From where to where, and what is done there."""

    start: StateSection = Field(description="state at the beginning, at rest")
    goal: StateSection = Field(
        description="state at the end, at rest; found, and may be left out, with an act and no supports"
    )
    act: ActSection | None = Field(
        default=None, description="what the hands do to an object at the end; where to stand for it is found"
    )

    @model_validator(mode="before")
    @classmethod
    def _goal_of_act(cls, data: Any) -> Any:
        """Leave the goal of an act to the planner."""
        if isinstance(data, dict) and data.get("act") is not None and "goal" not in data and "start" in data:
            return {**data, "goal": data["start"]}
        return data
