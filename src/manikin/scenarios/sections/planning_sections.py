"""Sections of a scenario file about its body and the options of its planners."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from manikin.body.dimensions import DIMENSIONS
from manikin.body.strength import DEFAULT_AGE
from manikin.contact import FrictionModel
from manikin.errors import ScenarioError
from manikin.limits import AGE_RANGE
from manikin.scenarios.expressions import Expression
from manikin.scenarios.sections.support_sections import SOLE, SoleSection
from manikin.scenarios.sections.task_sections import FrameSection
from manikin.scenarios.validation import (
    NonNegative,
    Number,
    OneOf,
    Positive,
    Section,
    Text,
    Vector3,
    Weights3,
    optional,
    preset,
    refuse,
    refuse_if,
    required,
)


class HeightBandSection(Section):
    """Lower and upper bound of the CoM's height."""

    lower: Text = required("expression of the lowest height [m] in x, y, z of the CoM")
    upper: Text = required("expression of the greatest height [m] in x, y, z of the CoM")
    frame: FrameSection | None = optional("frame of the expressions' x and y (default: the world's)")

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


class ComConstraintSection(OneOf):
    """One constraint on the centre of mass: exactly one of the keys."""

    height_band: HeightBandSection | None = optional("bounds of the CoM's height")
    max_support_distance_m: Positive | None = optional(
        "largest distance from the CoM to every contact, hands included [m]"
    )
    overhead: Annotated[list[Text], Field(min_length=1)] | Literal["automatic"] | None = optional(
        "keep the CoM low enough for the body to fold below overhead obstacles: 'automatic' for "
        "all that hover over the way at least 0.3 m above the supports, or the names of those to pass below"
    )


CLIMBING_LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")
"""Limbs of a human that climbs, where none are named."""


class ContactsSection(Section):
    """How contacts are planned where no supports are given."""

    friction: Positive = preset(0.7, "Coulomb coefficient of the soles")
    sole: SoleSection = preset(SOLE, "size of the soles")
    stride_m: Positive = preset(0.4, "length of a step [m] of a body of 1.75 m, scaled to the actual one")
    limbs: list[Text] | None = optional(
        "names of the limbs that make contacts, hands as grasps (default: a human's feet, in "
        "steps on surfaces that carry the whole sole, and hands as well where it climbs; all limbs "
        "of other bodies)"
    )
    grasp_force_N: Positive = preset(400.0, "largest force of a grasp along each axis [N]")
    forefoot_m: Positive | None = optional(
        "length of the front of the soles that has to lie on a hold [m] (default: whole soles)"
    )
    ranges: Literal["limits", "learnt"] = preset(
        "limits",
        "what bounds a human's hips and shoulders: the intervals of their hinges alone, or the "
        "volumes learnt from recorded motion as well",
    )
    seat_hands: Literal["needed", "used"] = preset(
        "needed",
        "hands that push on armrests, a table or the seat as a seat is left or taken: where the "
        "feet alone cannot, or wherever there is a place for them",
    )
    attempts: Annotated[int, Field(strict=True, ge=1, le=20)] = preset(
        3, "contact plans, or starts of a body on any limbs, that are tried before giving up"
    )


class WholebodySection(Section):
    """How the whole body's motion is found."""

    method: Literal["follow", "refine"] = preset(
        "follow",
        "follow: contacts, swings and a planned centre of mass; refine: smooth the postures at "
        "the changes of contact into a motion that keeps to physics, with no centre of mass prescribed; "
        "it goes without saying where contacts of any limbs are planned",
    )
    pace: Positive = preset(
        1.0,
        "refine: speed relative to that of the contact plan, or of the planned centre of mass; "
        "below 1 every phase lasts longer",
    )
    speed_share: Annotated[float, Field(strict=True, gt=0.0, le=1.0)] | None = optional(
        "refine: share of the joints' velocity limits up to which phases are shortened, as far "
        "as balance, clearance and strength allow (default: phases last as long as they are given)"
    )
    contact_variables: Annotated[bool, Field(strict=True)] = preset(
        True,
        "refine: whether contacts are let go that the motion does not need and that are not "
        "made, else all of the sequence are held",
    )


_KEYS = {
    "human": (
        "stature_m",
        "mass_kg",
        "sex",
        "age",
        "strength",
        *(f"{name}_m" for name in DIMENSIONS),
        "load",
        "further_contacts",
    ),
    "point_mass": ("mass_kg",),
    "kudoh": ("load",),
    "insect": ("length_m", "mass_kg"),
    "quadruped": ("length_m", "mass_kg"),
    "urdf": ("urdf", "limbs", "standing_deg", "sole"),
    "mjcf": ("mjcf", "limbs", "standing_deg", "sole", "joint_speed_deg_s"),
}
"""What each kind of body may be given."""

WORDS = {
    "human": "a human", "point_mass": "a point mass", "kudoh": "the body of Kudoh, who has his own size",
    "insect": "an insect", "quadruped": "a quadruped", "urdf": "a creature from URDF",
    "mjcf": "a creature from MJCF",
}  # fmt: skip
"""Kinds of bodies in words."""

_FILES = ("urdf", "mjcf")
"""Kinds of bodies that come from a file, which is named by the key of the same name."""

_OWN_SIZES = {"insect": {"mass_kg": 2.0}, "quadruped": {"length_m": 0.8, "mass_kg": 32.0}}
"""Sizes of creatures where the file gives none."""


class LimbSection(Section):
    """A limb of a creature: where it ends and how it touches."""

    tip: Text = required("link that touches")
    root: Text | None = optional("first link of the limb (default: the one that the root carries)")
    contact: Literal["point", "sole", "grasp"] = preset("point", "how it touches")
    position: Vector3 = preset((0.0, 0.0, 0.0), "where it touches, in the frame of the tip [m]")
    normal: Vector3 | None = optional(
        "normal of the contact, into the body, in the frame of the tip (default: "
        "straight up in the standing posture)"
    )


class LoadSection(Section):
    """What the hands carry, during the whole motion or some of the phases of its supports."""

    mass_kg: Positive = required("mass of the load [kg], a point at the middle of the palms")
    hand: Literal["left", "right", "both"] = preset("both", "which hand carries it; both carry half each")
    from_phase: Annotated[int, Field(strict=True, ge=0)] | None = optional(
        "phase of the supports that begins as it is taken up (default: the first)"
    )
    until_phase: Annotated[int, Field(strict=True, ge=0)] | None = optional(
        "phase of the supports that ends as it is set down (default: the last)"
    )

    @property
    def lasts(self) -> bool:
        """Whether it is carried all the time, as a part of the hands."""
        return self.from_phase is None and self.until_phase is None


class BodySection(Section):
    """Whose motion it is."""

    model: Literal["human", "kudoh", "point_mass", "insect", "quadruped", "urdf", "mjcf"] = preset(
        "human",
        "built-in body: a person; kudoh, the 15 segments of Kudoh (2002), 1.72 m and 70 kg; "
        "a point mass on massless feet, planned but not executed; an insect; a quadruped; or urdf or mjcf, "
        "which goes without saying beside that key, for a creature from a file",
    )
    stature_m: Positive = preset(1.75, "standing height [m], of a human only")
    mass_kg: Positive = preset(
        79.0, "body mass [kg] (defaults: insect 2, quadruped 32); a creature from a file has its own"
    )
    sex: Literal["male", "female"] = preset("male", "which anthropometric table, of a human only")
    age: Annotated[Number, Field(ge=AGE_RANGE[0], le=AGE_RANGE[1])] = preset(
        DEFAULT_AGE, "age [years], of a human only; its strength depends on it, nothing else"
    )
    strength: Positive = preset(
        1.0, "torque limits relative to a healthy adult of that sex, size and age, of a human only"
    )
    sitting_height_m: Positive | None = optional(
        "seat to vertex [m], of a human only (default of this and the next four: scaled from the stature)"
    )
    leg_length_m: Positive | None = optional(
        "ground to hip joints of one who stands, as high as the trochanterion [m]"
    )
    arm_length_m: Positive | None = optional("acromion to radial styloid [m]")
    shoulder_breadth_m: Positive | None = optional("between the acromia [m]")
    hip_breadth_m: Positive | None = optional("over the flesh, standing [m]")
    load: LoadSection | None = optional("load in the hands during the whole motion, of a human or kudoh")
    further_contacts: list[Literal["knees", "elbows", "pelvis"]] | None = optional(
        "what of a human may touch beside hands and feet, as limbs left_knee, right_knee, "
        "left_elbow, right_elbow, pelvis"
    )
    length_m: Positive = preset(
        0.4, "length of the trunk [m], of an insect or a quadruped only (default of a quadruped: 0.8)"
    )
    urdf: Text | None = optional("robot description of a creature, relative to this file's folder")
    mjcf: Text | None = optional("the same as MuJoCo has it")
    joint_speed_deg_s: Positive | None = optional(
        "velocity limit of all joints of a creature from MJCF, which has none [deg/s] (default: 573)"
    )
    limbs: dict[str, LimbSection] | None = optional("limbs of a creature, by name")
    standing_deg: dict[str, Number] | None = optional("joint angles of a creature's standing posture [deg]")
    sole: SoleSection | None = optional("size of a creature's soles")

    @model_validator(mode="before")
    @classmethod
    def _implied(cls, data: Any) -> Any:
        """A file of a creature says which model it is; creatures do not weigh what a person does."""
        if not isinstance(data, Mapping):
            return data
        for kind in _FILES:
            if kind in data and "model" not in data:
                return {**data, "model": kind}
        return {**_OWN_SIZES.get(str(data.get("model")), {}), **data}

    @model_validator(mode="after")
    def _only_what_applies(self) -> Self:
        valid = _KEYS[self.model]
        for key in self.model_fields_set - {"model"}:
            if key not in valid and getattr(self, key) is not None:
                keys = ", ".join(("model", *valid))
                raise refuse(key, f"does not apply to {WORDS[self.model]}; valid: {keys}")
        for key in (self.model, "limbs") if self.model in _FILES else ():
            problem = f"is missing; valid: {self.model}: FILE and limbs: {{NAME: {{tip: LINK}}}}"
            refuse_if(not getattr(self, key), key, problem)
        return self

    @property
    def dimensions(self) -> dict[str, float]:
        """Outer dimensions that are given [m], by the names of :data:`manikin.body.dimensions.DIMENSIONS`."""
        values = {name: getattr(self, f"{name}_m") for name in DIMENSIONS}
        return {name: value for name, value in values.items() if value is not None}

    @model_serializer(mode="wrap")
    def _without_what_does_not_apply(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        kept = ("model", *_KEYS[self.model])
        return {key: value for key, value in write(self).items() if key in kept}


FrictionModelName = Annotated[
    FrictionModel, BeforeValidator(lambda value: "outer" if value == "pyramid" else value)
]
"""Name of a friction model; ``pyramid`` is the older word for ``outer``."""

FRICTION_MODEL_TEXT = (
    "pyramid that stands for the friction cone: four sides around it, four inside it, or eight inside it"
)


class WeightsSection(Section):
    """Weights of the planner's objectives; what is left out has the planner's default."""

    margin: NonNegative | None = optional("of the smallest margin [1/(N.m)] or [1/N]")
    smoothness: NonNegative | None = optional("of the mean squared derivatives")
    duration: NonNegative | None = optional("of the duration [1/s]")
    velocity: Weights3 | None = optional(
        "along x, y, z of the task frame, x being the heading at the start [s^2/m^2]"
    )
    acceleration: Weights3 | None = optional("along the same axes [s^4/m^2]")
    jerk: Weights3 | None = optional("along the same axes [s^6/m^2]")


class PlanningSection(Section):
    """Options of the centre-of-mass planner, with its defaults, and the time of the run."""

    method: Literal["timing-free", "keyframes"] = preset(
        "timing-free", "durations as unknowns, or a smooth path through the key frames of a recording"
    )
    recording: Text | None = optional(
        "keyframes: run directory or motion file of the same supports, relative to this file's "
        "folder or else to the current one"
    )
    recording_frame: FrameSection | None = optional(
        "keyframes: frame of the recording's coordinates (default: the world's)"
    )
    control_points: Annotated[int, Field(strict=True, ge=4, le=1000)] | None = optional(
        "keyframes: of the B-spline (default: key frames plus 7)"
    )
    degree: Annotated[int, Field(strict=True, ge=3, le=9)] | None = optional("of the B-spline")
    samples: Annotated[int, Field(strict=True, ge=2, le=200)] | None = optional(
        "instants per phase at which balance is imposed, less one"
    )
    min_margin: NonNegative = preset(
        0.0, "smallest stability margin allowed, moments about the CoM [N.m], or [N] in the force space"
    )
    margin_space: Literal["wrench", "force"] = preset("wrench", "what the margin measures")
    friction_model: FrictionModelName = preset("outer", FRICTION_MODEL_TEXT)
    max_duration_s: Positive | None = optional("longest duration of the motion [s]")
    time_limit_s: Positive = preset(
        600.0, "processor time after which nothing else is tried: a run ends with what failed until then [s]"
    )
    zero_end_accelerations: Annotated[bool, Field(strict=True)] = preset(
        True, "whether the CoM starts and ends without acceleration, as at rest"
    )
    weights: WeightsSection = preset(WeightsSection(), "of the objectives")

    def implied(self) -> dict[str, Any]:
        """The frame of a recording."""
        if self.recording is None or self.recording_frame is not None:
            return {}
        return {"recording_frame": FrameSection()}

    @model_validator(mode="after")
    def _recorded(self) -> Self:
        missing = self.method == "keyframes" and self.recording is None
        problem = "is missing; valid: a run directory or motion file for keyframes"
        refuse_if(missing, "recording", problem)
        problem = f"is given for the method {self.method}; valid: only with keyframes"
        for key in ("recording", "recording_frame", "control_points"):
            refuse_if(self.method != "keyframes" and getattr(self, key) is not None, key, problem)
        return self
