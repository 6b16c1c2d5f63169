"""Sections of a scenario file: a walk over the floor, and who else walks there."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from manikin.scenarios.validation import Moves, Name, NonNegative, Number, Section, Vector2, refuse

LARGEST_WALKERS = 8
"""How many others may walk in a scenario."""

Speed = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.1, le=4.0)]


class StandSection(Section):
    """Where a walker stands at the beginning."""

    at: Annotated[Vector2, Moves.POINT] = Field(description="x and y [m]")
    heading_deg: Annotated[Number, Moves.HEADING] = Field(default=0.0, description="where to face [deg]")


class WaypointSection(StandSection):
    """Where a walker comes past, or stops."""

    speed_m_s: NonNegative = Field(
        default=0.0, description="with which it is passed, towards the place after it; 0 for a stop [m/s]"
    )
    wait_s: NonNegative = Field(default=0.0, description="how long the walker stands there [s]")


class WalkerSection(Section):
    """Somebody else who walks there, on a way that does not depend on whom the scenario is about."""

    name: Name = Field(description="what messages and files call this walker")
    start: StandSection = Field(description="where the walker stands at the beginning")
    via: list[WaypointSection] = Field(
        min_length=1, description="where the walker goes, in order; the last one is a stop"
    )
    wait_s: NonNegative = Field(default=0.0, description="how long the walker stands at the start [s]")
    max_speed_m_s: Speed = Field(default=1.6, description="limit of the speed over the floor [m/s]")


class WalkingSection(Section):
    """A walk from start to goal of the task: path by optimal control, whole body from recorded walks."""

    whole_body: Literal["recorded", "planned"] = Field(
        default="recorded",
        description="recorded: as recorded people walk, along the path; planned: on footprints along the "
        "path, balanced and executed in the physics engine",
    )
    footprints: Literal["stepper", "library"] = Field(
        default="stepper",
        description="of a planned walk from start to goal: stepper, by rules along the path; library, where "
        "recorded people's feet stand on the same path, and no faster than they go",
    )
    start: StandSection | None = Field(
        default=None,
        description="with supports: where the body walks from, to the feet of their first phase; the plan "
        "goes on from there",
    )
    via: list[WaypointSection] = Field(
        default_factory=list, description="where the way to the goal leads past, in order"
    )
    wait_s: NonNegative = Field(default=0.0, description="how long the body stands at the start [s]")
    max_speed_m_s: Speed = Field(default=1.6, description="limit of the speed over the floor [m/s]")
    room_m: NonNegative = Field(default=0.05, description="distance to keep from obstacles and others [m]")
    weights: Literal["prose", "literal", "recorded", "recorded-turns"] = Field(
        default="prose",
        description="weights of the criterion: as the text of Truong (2010) 5.5.1 has them, as its "
        "equations (5.5) and (5.8) read literally, or as identified from recorded walks, all or turns only",
    )
    others: list[WalkerSection] = Field(
        default_factory=list, max_length=LARGEST_WALKERS,
        description="others who walk there; each keeps away from those before it in the list, and the "
        "scenario's body from all of them",
    )  # fmt: skip

    def is_planned(self, supports: object) -> bool:
        """Whether footprints are planned and executed, as they always are before supports."""
        return self.whole_body == "planned" or supports is not None

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [other.name for other in self.others]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise refuse(f"others[{index}].name", f"is {name!r} again; valid: a unique name")
            if self.others[index].via[-1].speed_m_s > 0.0:
                raise refuse(
                    f"others[{index}].via[{len(self.others[index].via) - 1}].speed_m_s",
                    "is not 0; valid: the last one is a stop, 0",
                )
        return self
