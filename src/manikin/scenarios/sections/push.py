"""Section of a scenario file: a disturbance."""

from typing import Annotated, Literal

from pydantic import Field

from manikin.scenarios.validation import Duration, NonNegative, Number, Positive, Section

LARGEST_FORCE = 5000.0
"""Some seven body weights, far beyond what can be held [N]; ``manikin.simulation.recover`` has the same."""

LARGEST_FREQUENCY = 100.0
"""Of a sine: ten of the physics' steps are left for each period [Hz]."""

Force = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=LARGEST_FORCE)]


class PushSection(Section):
    """A push on the trunk: of the thorax during an execution, near the centre of mass in a recovery."""

    force_N: Force = Field(description="size [N]; of a sine its amplitude")
    direction_deg: Number = Field(
        description="of the force, counter-clockwise from the body's forward axis [deg]"
    )
    duration_s: Duration = Field(description="how long [s]")
    at_s: NonNegative = Field(description="when it begins [s]")
    frequency_hz: Positive | None = Field(
        default=None,
        le=LARGEST_FREQUENCY,
        description="of a sine that begins with the push [Hz] (default: a constant force)",
    )


class RecoverySection(Section):
    """A body that stands, is pushed, and keeps its balance without a motion given beforehand."""

    feet: Literal["held", "free"] = Field(
        default="held",
        description="held: welded to the ground, as in Kudoh (2002); free: in contact with friction",
    )
    support: Literal["both", "left", "right"] = Field(
        default="both", description="feet that the body stands on; beside a single one the other is raised"
    )
    feet_apart_m: Positive | None = Field(
        default=None,
        description="distance between the middles of both soles, sideways [m] (default: as the body stands)",
    )
    delay_s: NonNegative = Field(
        default=0.2, description="from the beginning of the push until the body reacts [s]"
    )
    steps: Annotated[int, Field(ge=0, le=2)] = Field(
        default=0, description="how many steps it may take, 0 to 2; free feet only"
    )
    ankle_stiffness: NonNegative = Field(
        default=0.64,
        description="stiffness of both ankles together before the body reacts, in m g h per radian "
        "(default: calf muscles at rest)",
    )
    sole_inset_m: NonNegative = Field(
        default=0.005, description="how far inside the edge of the soles the ZMP is kept [m]"
    )
    duration_s: Duration = Field(default=3.5, description="of the run [s]")
    friction: Positive = Field(default=0.7, description="of the soles")
    locked: list[Literal["arms", "hips"]] = Field(
        default_factory=list, description="joints that hold the posture: arms; hips, with the trunk"
    )
    posture_control_only: bool = Field(
        default=False, description="whether the quadratic program is left out, for comparison"
    )
    strength: Positive = Field(
        default=1.0, description="torque and speed limits relative to those of the body"
    )
