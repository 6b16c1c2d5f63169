"""Sections of a scenario file about its task: ends, act, push, walk, scene and expected outcome."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from manikin.numerics.spatial import PlanarTransform
from manikin.scenarios.validation import (
    Duration,
    FrameMoves,
    Name,
    NonNegative,
    Number,
    Positive,
    Section,
    Size3,
    Text,
    Vector2,
    Vector3,
    bounded,
    optional,
    preset,
    refuse,
    refuse_if,
    refuse_repeated,
    required,
    rule_error,
)

LARGEST_FORCE = 5000.0
"""Largest force of a push [N], some seven body weights; the same in ``manikin.simulation.push_force``."""
LARGEST_FREQUENCY = 100.0
"""Largest frequency of a sine [Hz]: ten steps of the physics for each period."""
Force = Annotated[float, bounded(gt=0, le=LARGEST_FORCE)]


LARGEST_SHARE, LARGEST_FACTOR = 0.9, 4.0
"""Largest uncertainty of a mass or of a friction, relative to it; and of all, relative to the defaults, with
which that of the friction is 0.8."""


class UncertaintySection(Section):
    """How far the worlds of trials are from the believed one; what is left out has its default."""

    factor: Annotated[NonNegative, Field(le=LARGEST_FACTOR)] = preset(
        1.0, "by which all of them that are left out are larger than by default"
    )
    mass_share: NonNegative | None = optional("largest deviation of each segment's mass (default: 0.05)")
    com_m: NonNegative | None = optional(
        "largest deviation of the centre of mass along each axis, standing [m] (default: 0.01)"
    )
    friction_share: NonNegative | None = optional("largest missing share of the friction (default: 0.2)")
    height_m: NonNegative | None = optional(
        "largest deviation of each obstacle's height [m] (default: 0.005)"
    )
    delay_s: NonNegative | None = optional("longest delay of the torques [s] (default: 0.015)")
    angle_noise_deg: NonNegative | None = optional(
        "standard deviation of the angles that control is told [deg] (default: 0.1)"
    )
    position_noise_m: NonNegative | None = optional("the same of the root's position [m] (default: 0.001)")
    velocity_noise_m_s: NonNegative | None = optional("the same of its velocity [m/s] (default: 0.005)")
    torque_noise_share: NonNegative | None = optional(
        "standard deviation of the joint torques that control feels, relative to the strength (default: 0.01)"
    )
    joints_deg: NonNegative | None = optional(
        "largest error of each hinge at the beginning [deg] (default: 1)"
    )
    push_N: NonNegative | None = optional(
        "force of a push on the trunk at any time [N] (default: 50; of a creature below 75 kg in proportion)"
    )
    push_s: NonNegative | None = optional("how long it lasts [s] (default: 0.1)")


class ExecutionSection(Section):
    """Execution of the planned motion in the physics engine, and trials of it in other worlds."""

    required: bool = preset(
        True,
        "true: a run succeeds only if the planned motion is also executed and keeps every requirement "
        "(proved); false: it is not executed, and succeeds if its plan keeps every requirement (planned), "
        "the default of a point mass and of a recorded walk, which cannot be executed",
    )
    trials: Annotated[int, Field(strict=True, ge=0, le=10_000)] = preset(
        0, "worlds, drawn from the uncertainty, in which a proved motion is executed as well"
    )
    uncertainty: UncertaintySection = preset(UncertaintySection(), "how far they are from the believed one")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for key in ("mass_share", "friction_share"):
            share = getattr(self.uncertainty, key)
            refuse_if(share is not None and share > LARGEST_SHARE, f"uncertainty.{key}",
                      f"is {share}; valid: 0 to {LARGEST_SHARE:g}")  # fmt: skip
        refuse_if(self.trials > 0 and not self.required, "trials", "are asked for; valid: with required true")
        return self


class PushSection(Section):
    """A push on the trunk: of the thorax during an execution, near the centre of mass in a recovery."""

    force_N: Force = required("size [N]; of a sine its amplitude")
    direction_deg: Number = required("of the force, counter-clockwise from the body's forward axis [deg]")
    duration_s: Duration = required("how long [s]")
    at_s: NonNegative = required("when it begins [s]")
    frequency_hz: Annotated[Positive, Field(le=LARGEST_FREQUENCY)] | None = optional(
        "of a sine that begins with the push [Hz] (default: a constant force)"
    )


class RecoverySection(Section):
    """A body that stands, is pushed, and keeps its balance without a motion given beforehand."""

    feet: Literal["held", "free"] = preset(
        "held", "held: welded to the ground, as in Kudoh (2002); free: in contact with friction"
    )
    support: Literal["both", "left", "right"] = preset(
        "both", "feet that the body stands on; beside a single one the other is raised"
    )
    feet_apart_m: Positive | None = optional(
        "distance between the middles of both soles, sideways [m] (default: as the body stands)"
    )
    delay_s: NonNegative = preset(0.2, "from the beginning of the push until the body reacts [s]")
    steps: Annotated[int, Field(ge=0, le=2)] = preset(0, "how many steps it may take, 0 to 2; free feet only")
    ankle_stiffness: NonNegative = preset(
        0.64,
        "stiffness of both ankles together before the body reacts, in m g h per radian "
        "(default: calf muscles at rest)",
    )
    sole_inset_m: NonNegative = preset(0.005, "how far inside the edge of the soles the ZMP is kept [m]")
    duration_s: Duration = preset(3.5, "of the run [s]")
    friction: Positive = preset(0.7, "of the soles")
    locked: list[Literal["arms", "hips"]] = Field(
        default_factory=list, description="joints that hold the posture: arms; hips, with the trunk"
    )
    posture_control_only: bool = preset(False, "whether the quadratic program is left out, for comparison")
    strength: Positive = preset(1.0, "torque and speed limits relative to those of the body")


OBSTACLE_SHAPES = ("box", "cylinder", "capsule", "sphere", "plane", "half_space", "mesh")


class RoundSection(Section):
    """A cylinder or capsule along its z axis."""

    radius_m: Positive = required("radius [m]")
    length_m: Positive = required("length [m]; of a capsule, without its round ends")


class SphereSection(Section):
    """A sphere."""

    radius_m: Positive = required("radius [m]")


class ObstacleSection(Section):
    """One thing in the scene: a name, one shape and a pose."""

    name: Text = required("unique name")
    box: Size3 | None = optional("sizes along x, y, z [m]")
    cylinder: RoundSection | None = optional("cylinder along z")
    capsule: RoundSection | None = optional("capsule along z")
    sphere: SphereSection | None = optional("sphere")
    plane: Vector3 | None = optional(
        "normal of an infinite two-sided plane through position, turned by rpy_deg"
    )
    half_space: Vector3 | None = optional(
        "outward normal of a solid half-space at position, turned by rpy_deg"
    )
    mesh: Text | None = optional(
        "STL, OBJ, PLY, DAE, GLB or glTF file, relative to this file's folder; or package://NAME/path of an "
        "installed Python distribution"
    )
    scale: Positive | None = optional("factor on the mesh's coordinates (default 1)")
    unit: Literal["m", "cm", "mm", "in"] | None = optional(
        "unit of the mesh (default: a DAE file's own, else m)"
    )
    convex: Literal["no", "hull", "parts"] | None = optional(
        "replace the mesh, or each connected part, by its convex hull"
    )
    padded: Annotated[bool, Field(strict=True)] = preset(
        False, "whether any part of the body may lean on it, as on a seat"
    )
    mass_kg: Positive | None = optional("mass of a box that operations may take up [kg]")
    position: Annotated[Vector3, FrameMoves.POINT] = preset((0.0, 0.0, 0.0), "origin in the world [m]")
    rpy_deg: Annotated[Vector3, FrameMoves.ORIENTATION] = preset(
        (0.0, 0.0, 0.0), "fixed-axis roll, pitch, yaw [deg]"
    )

    @property
    def shape(self) -> str:
        """Key of the shape that is given."""
        return next(name for name in OBSTACLE_SHAPES if getattr(self, name) is not None)

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        given = [name for name in OBSTACLE_SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            result = f"has {' and '.join(given)}" if given else "has no shape"
            raise refuse("", f"{result}; valid: exactly one of {', '.join(OBSTACLE_SHAPES)}")
        for key in ("scale", "unit", "convex"):
            other = getattr(self, key) is not None and given[0] != "mesh"
            refuse_if(other, key, f"is given for a {given[0]}; valid: only with mesh")
        for key in ("plane", "half_space"):
            normal = getattr(self, key)
            if normal is not None and not any(normal):
                raise refuse(key, f"is {list(normal)}; valid: a normal that is not zero")
        return self


LARGEST_WALKERS = 8
"""How many others may walk in a scenario."""
Speed = Annotated[float, bounded(ge=0.1, le=4.0)]


class StandSection(Section):
    """Where a walker stands at the beginning."""

    at: Annotated[Vector2, FrameMoves.POINT] = required("x and y [m]")
    heading_deg: Annotated[Number, FrameMoves.HEADING] = preset(0.0, "where to face [deg]")


class WaypointSection(StandSection):
    """Where a walker comes past, or stops."""

    speed_m_s: NonNegative = preset(
        0.0, "with which it is passed, towards the place after it; 0 for a stop [m/s]"
    )
    wait_s: NonNegative = preset(0.0, "how long the walker stands there [s]")


class WalkerSection(Section):
    """Somebody else who walks there, on a way that does not depend on whom the scenario is about."""

    name: Name = required("what messages and files call this walker")
    start: StandSection = required("where the walker stands at the beginning")
    via: list[WaypointSection] = Field(
        min_length=1, description="where the walker goes, in order; the last one is a stop"
    )
    wait_s: NonNegative = preset(0.0, "how long the walker stands at the start [s]")
    max_speed_m_s: Speed = preset(1.6, "limit of the speed over the floor [m/s]")


class WalkingSection(Section):
    """A walk from start to goal of the task: path by optimal control, whole body from recorded walks."""

    whole_body: Literal["balanced", "recorded"] = preset(
        "balanced",
        "balanced: as recorded people walk, in balance on footprints as far apart and as frequent as "
        "people's, on feet that roll, executed in the physics engine; recorded: as recorded people walk, "
        "without dynamics, to be watched",
    )
    start: StandSection | None = optional(
        "with supports: where the body walks from, to the feet of their first phase, where it comes to "
        "rest in the first posture of their motion"
    )
    via: list[WaypointSection] = Field(
        default_factory=list, description="where the way to the goal leads past, in order"
    )
    wait_s: NonNegative = preset(0.0, "how long the body stands at the start [s]")
    max_speed_m_s: Speed = preset(1.6, "limit of the speed over the floor [m/s]")
    room_m: NonNegative = preset(0.05, "distance to keep from obstacles and others [m]")
    weights: Literal["prose", "literal", "recorded", "recorded-turns"] = preset(
        "prose",
        "weights of the criterion: as the text of Truong (2010) 5.5.1 has them, as its "
        "equations (5.5) and (5.8) read literally, or as identified from recorded walks, all or turns only",
    )
    others: list[WalkerSection] = Field(
        default_factory=list, max_length=LARGEST_WALKERS,
        description="others who walk there; each keeps away from those before it in the list, and the "
        "scenario's body from all of them",
    )  # fmt: skip

    @model_validator(mode="after")
    def _check(self) -> Self:
        refuse_repeated([other.name for other in self.others], "others[{}].name")
        for index, other in enumerate(self.others):
            key = f"others[{index}].via[{len(other.via) - 1}].speed_m_s"
            refuse_if(other.via[-1].speed_m_s > 0.0, key, "is not 0; valid: the last one is a stop, 0")
        return self


class ExpectSection(Section):
    """Success, or a failure with the stage in which it is expected and its reason."""

    outcome: Literal["success", "failure"] = required("how a run should end")
    stage: Literal["walk", "contacts", "centroidal", "wholebody", "execution", "push"] | None = optional(
        "stage that should fail; a failure of another one is not as expected"
    )
    because: Text | None = optional("why it is expected to fail")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for key in ("stage", "because"):
            beside = self.outcome == "success" and getattr(self, key) is not None
            refuse_if(beside, key, "is given beside outcome: success; valid: beside outcome: failure")
        return self


Expectation = Annotated[
    ExpectSection,
    BeforeValidator(
        lambda value: {"outcome": value} if isinstance(value, str) else value,
        json_schema_input_type=Literal["success", "failure"] | ExpectSection,
    ),
]
"""``success``, ``failure``, or a mapping with the outcome, the stage and the reason."""


class FrameSection(Section):
    """A frame in the world, as high as that."""

    at: Annotated[Vector2, FrameMoves.POINT] = preset((0.0, 0.0), "where its origin is, x and y [m]")
    yaw_deg: Annotated[Number, FrameMoves.HEADING] = preset(
        0.0, "where its x axis points, counter-clockwise from world x [deg]"
    )

    def transform_to_world(self) -> PlanarTransform:
        """Transform from this frame to the world."""
        return PlanarTransform(*self.at, self.yaw_deg)


class StateSection(Section):
    """Where the body starts or ends."""

    com: Annotated[Vector3 | None, FrameMoves.POINT] = optional("centre of mass [m]")
    velocity_m_s: Annotated[Vector3 | None, FrameMoves.DIRECTION] = optional(
        "of the centre of mass when the body sits down at the goal (default: free)"
    )
    at: Annotated[Vector2 | None, FrameMoves.POINT] = optional("where to stand, x and y [m]")
    heading_deg: Annotated[Number | None, FrameMoves.HEADING] = optional("where to face [deg]")
    height_m: Number | None = optional(
        "height of the surface to stand or sit on there [m] (default: the lowest one on "
        "which the posture exists)"
    )
    posture: Literal["standing", "seated", "crouched", "climbing"] | None = optional(
        "how the body is at rest there (default: standing); climbing: on what its limbs "
        "hold, as high as if it stood on that height"
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

    kind: Literal["push", "pull"] = required("press with the palms, or hold on and draw")
    on: Text = required("name of an obstacle; it does not move")
    direction: Annotated[Vector3, FrameMoves.DIRECTION] = required(
        "where the force on the object points; level"
    )
    force_N: Positive = required("force on the object [N]")
    ramp_s: Positive = preset(1.0, "time in which the force rises from none [s]")
    hold_s: NonNegative = preset(2.0, "time for which it is held then [s]")

    @field_validator("direction")
    @classmethod
    def _level(cls, direction: Any) -> Any:
        if not any(direction) or direction[2] != 0.0:
            raise rule_error("a direction that is level (its z 0) and not zero")
        return direction
