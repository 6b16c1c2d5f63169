"""Section of a scenario file: a disturbance."""

from pydantic import Field

from manikin.scenarios.validation import Duration, NonNegative, Number, Positive, Section


class PushSection(Section):
    """A push on the trunk during the execution."""

    force_N: Positive = Field(description="size [N]")
    direction_deg: Number = Field(
        description="of the force, counter-clockwise from the body's forward axis [deg]"
    )
    duration_s: Duration = Field(description="how long [s]")
    at_s: NonNegative = Field(description="when it begins [s]")
