"""Sections of a scenario file: options of the centre-of-mass planner."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from manikin.contact import FrictionModel
from manikin.scenarios.sections.frame import FrameSection
from manikin.scenarios.validation import NonNegative, Positive, Section, Text, Weights3, refuse

FrictionModelName = Annotated[
    FrictionModel, BeforeValidator(lambda value: "outer" if value == "pyramid" else value)
]
"""Name of a friction model; ``pyramid`` is the older word for ``outer``."""

FRICTION_MODEL_TEXT = (
    "pyramid that stands for the friction cone: four sides around it, four inside it, or eight inside it"
)


class WeightsSection(Section):
    """Weights of the planner's objectives; what is left out has the planner's default."""

    margin: NonNegative | None = Field(default=None, description="of the smallest margin [1/(N.m)] or [1/N]")
    smoothness: NonNegative | None = Field(default=None, description="of the mean squared derivatives")
    duration: NonNegative | None = Field(default=None, description="of the duration [1/s]")
    velocity: Weights3 | None = Field(
        default=None,
        description="along x, y, z of the task frame, x being the heading at the start [s^2/m^2]",
    )
    acceleration: Weights3 | None = Field(default=None, description="along the same axes [s^4/m^2]")
    jerk: Weights3 | None = Field(default=None, description="along the same axes [s^6/m^2]")


class PlanningSection(Section):
    """Options of the centre-of-mass planner; what is left out has the planner's default."""

    method: Literal["timing-free", "keyframes"] = Field(
        default="timing-free",
        description="durations as unknowns, or a smooth path through the key frames of a recording",
    )
    recording: Text | None = Field(
        default=None,
        description="keyframes: run directory or motion file of the same supports, relative to this file's "
        "folder or else to the current one",
    )
    recording_frame: FrameSection | None = Field(
        default=None, description="keyframes: frame of the recording's coordinates (default: the world's)"
    )
    control_points: Annotated[int, Field(strict=True, ge=4, le=1000)] | None = Field(
        default=None, description="keyframes: of the B-spline (default: key frames plus 7)"
    )
    degree: Annotated[int, Field(strict=True, ge=3, le=9)] | None = Field(
        default=None, description="of the B-spline"
    )
    samples: Annotated[int, Field(strict=True, ge=2, le=200)] | None = Field(
        default=None, description="instants per phase at which balance is imposed, less one"
    )
    min_margin: NonNegative = Field(
        default=0.0,
        description="smallest stability margin allowed, moments about the CoM [N.m], or [N] in the force "
        "space",
    )
    margin_space: Literal["wrench", "force"] = Field(default="wrench", description="what the margin measures")
    friction_model: FrictionModelName = Field(default="outer", description=FRICTION_MODEL_TEXT)
    max_duration_s: Positive | None = Field(default=None, description="longest duration of the motion [s]")
    zero_end_accelerations: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="whether the CoM starts and ends without acceleration"
    )
    weights: WeightsSection = Field(default=WeightsSection(), description="of the objectives")

    def implied(self) -> dict[str, Any]:
        """The frame of a recording."""
        if self.recording is None or self.recording_frame is not None:
            return {}
        return {"recording_frame": FrameSection()}

    @model_validator(mode="after")
    def _recorded(self) -> Self:
        if self.method == "keyframes" and self.recording is None:
            raise refuse("recording", "is missing; valid: a run directory or motion file for keyframes")
        for key in ("recording", "recording_frame", "control_points"):
            if self.method != "keyframes" and getattr(self, key) is not None:
                raise refuse(key, f"is given for the method {self.method}; valid: only with keyframes")
        return self
