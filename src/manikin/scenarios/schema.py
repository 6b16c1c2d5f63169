"""What a scenario file may hold: one pydantic model per section.

Lengths are metres and angles degrees, as the keys say; the builders of
:class:`~manikin.scenarios.scenario.Scenario` turn them into the library's own values.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import (
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    field_validator,
    model_serializer,
    model_validator,
)

from manikin.errors import ScenarioError
from manikin.scenarios.expressions import Expression
from manikin.scenarios.validation import (
    Duration,
    Name,
    NonNegative,
    Number,
    Positive,
    Section,
    Size3,
    Text,
    Vector2,
    Vector3,
    Weights3,
    refuse,
    rule_error,
)

EFFECTORS = ("left_foot", "right_foot", "left_hand", "right_hand", "buttocks")
"""Effectors of a human that a phase may put in contact, in the order of the contact tables."""

MASSLESS_FEET = ("left_front_foot", "right_front_foot", "left_hind_foot", "right_hind_foot")
"""Feet that only a point mass has, besides those of a human."""

OBSTACLE_SHAPES = ("box", "cylinder", "capsule", "sphere", "plane", "half_space", "mesh")

_KIND_KEYS: dict[str, tuple[str, ...]] = {
    "sole": ("normal", "sole", "friction", "normal_force_cap_N", "torsion_limit_Nm", "settle_s"),
    "point": ("normal", "friction", "normal_force_cap_N"),
    "grasp": ("max_force_N", "planning_max_force_N", "max_moment_Nm", "rpy_deg"),
}
"""Keys of a contact that only some kinds have."""

_HUMAN_KEYS = ("stature_m", "sex")


class BodySection(Section):
    """Whose motion it is."""

    model: Literal["human", "point_mass"] = Field(
        default="human",
        description="built-in body: a person, or a point mass on massless feet, planned but not executed",
    )
    stature_m: Positive = Field(default=1.75, description="standing height [m], of a human only")
    mass_kg: Positive = Field(default=79.0, description="body mass [kg]")
    sex: Literal["male", "female"] = Field(
        default="male", description="which anthropometric table, of a human only"
    )

    @model_validator(mode="after")
    def _only_of_a_human(self) -> Self:
        for key in _HUMAN_KEYS if self.model != "human" else ():
            if key in self.model_fields_set:
                raise refuse(key, "does not apply to a point mass; valid: model, mass_kg")
        return self

    @model_serializer(mode="wrap")
    def _without_what_does_not_apply(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data = write(self)
        return data if self.model == "human" else {k: v for k, v in data.items() if k not in _HUMAN_KEYS}


class RoundSection(Section):
    """A cylinder or capsule along its z axis."""

    radius_m: Positive = Field(description="radius [m]")
    length_m: Positive = Field(description="length [m]; of a capsule, without its round ends")


class SphereSection(Section):
    """A sphere."""

    radius_m: Positive = Field(description="radius [m]")


class ObstacleSection(Section):
    """One thing in the scene: a name, one shape and a pose."""

    name: Text = Field(description="unique name")
    box: Size3 | None = Field(default=None, description="sizes along x, y, z [m]")
    cylinder: RoundSection | None = Field(default=None, description="cylinder along z")
    capsule: RoundSection | None = Field(default=None, description="capsule along z")
    sphere: SphereSection | None = Field(default=None, description="sphere")
    plane: Vector3 | None = Field(
        default=None, description="normal of an infinite two-sided plane through position"
    )
    half_space: Vector3 | None = Field(
        default=None, description="outward normal of a solid half-space at position"
    )
    mesh: Text | None = Field(
        default=None, description="STL, OBJ, PLY or DAE file, relative to this file's folder"
    )
    scale: Positive | None = Field(default=None, description="factor on the mesh's coordinates (default 1)")
    unit: Literal["m", "cm", "mm", "in"] | None = Field(
        default=None, description="unit of the mesh (default: a DAE file's own, else m)"
    )
    convex: Literal["no", "hull", "parts"] | None = Field(
        default=None, description="replace the mesh, or each connected part, by its convex hull"
    )
    padded: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="whether any part of the body may lean on it, as on a seat"
    )
    position: Vector3 = Field(default=(0.0, 0.0, 0.0), description="origin in the world [m]")
    rpy_deg: Vector3 = Field(default=(0.0, 0.0, 0.0), description="fixed-axis roll, pitch, yaw [deg]")

    @property
    def shape(self) -> str:
        """Key of the shape that is given."""
        return next(name for name in OBSTACLE_SHAPES if getattr(self, name) is not None)

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        given = [name for name in OBSTACLE_SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            found = f"has {' and '.join(given)}" if given else "has no shape"
            raise refuse("", f"{found}; valid: exactly one of {', '.join(OBSTACLE_SHAPES)}")
        for key in ("scale", "unit", "convex"):
            if getattr(self, key) is not None and given[0] != "mesh":
                raise refuse(key, f"is given for a {given[0]}; valid: only with mesh")
        for key in ("plane", "half_space"):
            normal = getattr(self, key)
            if normal is not None and not any(normal):
                raise refuse(key, f"is {list(normal)}; valid: a normal that is not zero")
        return self


class SoleSection(Section):
    """A rectangular sole."""

    length_m: Positive = Field(description="along the toes' direction [m]")
    width_m: Positive = Field(description="across it [m]")


class ContactSection(Section):
    """One contact; what it leaves out comes from the section around it."""

    kind: Literal["sole", "point", "grasp"] | None = Field(
        default=None, description="default: sole for a foot, grasp for a hand"
    )
    position: Vector3 = Field(description="of the contact (centre of a sole) in the world [m]")
    yaw_deg: Number = Field(
        default=0.0, description="heading of the toes, counter-clockwise from world x [deg]"
    )
    normal: Vector3 | None = Field(default=None, description="surface normal, into the body (default up)")
    rpy_deg: Vector3 | None = Field(default=None, description="orientation of a grasping hand [deg]")
    sole: SoleSection | None = Field(default=None, description="size of this sole")
    friction: Positive | None = Field(default=None, description="Coulomb coefficient")
    normal_force_cap_N: Positive | None = Field(
        default=None, description="largest normal force of this contact [N]"
    )
    torsion_limit_Nm: Positive | None = Field(
        default=None, description="largest moment about the normal [N.m]"
    )
    settle_s: NonNegative | None = Field(
        default=None, description="time after the touch-down in which it may still slide to its place [s]"
    )
    max_force_N: Positive | None = Field(
        default=None, description="grasp: largest force along each world axis [N]"
    )
    planning_max_force_N: Positive | None = Field(
        default=None, description="grasp: smaller limit that planning balances with (default: max_force_N)"
    )
    max_moment_Nm: NonNegative | None = Field(
        default=None, description="grasp: largest moment per axis [N.m]"
    )

    @field_validator("normal")
    @classmethod
    def _nonzero(cls, normal: Any) -> Any:
        if normal is not None and not any(normal):
            raise rule_error("a direction that is not zero")
        return normal

    def kind_for(self, effector: str) -> str:
        """Kind of the contact when ``effector`` makes it."""
        return self.kind or ("grasp" if "hand" in effector else "sole")

    def check_for(self, effector: str, path: str = "") -> None:
        """Refuse keys that the contact's kind does not have.

        Raises:
            PydanticCustomError: Naming the key under ``path``.
        """
        kind = self.kind_for(effector)
        for key in sorted({key for keys in _KIND_KEYS.values() for key in keys} - {*_KIND_KEYS[kind]}):
            if getattr(self, key) is not None:
                valid = ", ".join(("kind", "position", "yaw_deg", *_KIND_KEYS[kind]))
                raise refuse(f"{path}{key}", f"does not belong to a {kind}; valid: {valid}")
        if kind == "grasp" and self.max_force_N is None:
            raise refuse(f"{path}max_force_N", "is missing; valid: a number > 0 [N] for a grasp")


def _contact_tag(value: Any) -> str:
    return "same" if isinstance(value, str) else "contact"


ContactEntry = Annotated[
    Annotated[Literal["same"], Tag("same")] | Annotated[ContactSection, Tag("contact")],
    Discriminator(_contact_tag),
]
"""A contact, or the word ``same`` for the one of the phase before."""


class PhaseSection(Section):
    """The contacts of one phase and how long it may last; an effector left out is in the air."""

    left_foot: ContactEntry | None = Field(default=None, description="contact of the left foot, or 'same'")
    right_foot: ContactEntry | None = Field(default=None, description="contact of the right foot, or 'same'")
    left_hand: ContactEntry | None = Field(default=None, description="contact of the left hand, or 'same'")
    right_hand: ContactEntry | None = Field(default=None, description="contact of the right hand, or 'same'")
    left_front_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    right_front_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    left_hind_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    right_hind_foot: ContactEntry | None = Field(
        default=None, description="contact of that foot of a point mass, or 'same'"
    )
    buttocks: ContactEntry | None = Field(default=None, description="contact with a seat, or 'same'")
    min_duration_s: Duration = Field(default=0.1, description="shortest duration [s]")
    max_duration_s: Duration | None = Field(default=None, description="longest duration [s]")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.max_duration_s is not None and self.max_duration_s < self.min_duration_s:
            raise refuse(
                "max_duration_s", f"is {self.max_duration_s:g}; valid: at least min_duration_s = "
                f"{self.min_duration_s:g}"
            )  # fmt: skip
        if not self.entries():
            raise refuse("", f"has no contact; valid: at least one of {', '.join(EFFECTORS)}")
        for effector, entry in self.entries().items():
            if not isinstance(entry, str):
                entry.check_for(effector, f"{effector}.")
        return self

    def entries(self) -> dict[str, "ContactSection | Literal['same']"]:
        """Contacts by effector, those in the air left out."""
        found = {name: getattr(self, name) for name in (*EFFECTORS, *MASSLESS_FEET)}
        return {name: entry for name, entry in found.items() if entry is not None}


class SupportsSection(Section):
    """An explicit sequence of supports, with the defaults of its contacts."""

    friction: Positive = Field(default=0.7, description="Coulomb coefficient of soles and points")
    sole: SoleSection = Field(
        default=SoleSection(length_m=0.28, width_m=0.12), description="size of the real soles"
    )
    planning_sole: SoleSection | None = Field(
        default=None,
        description="smaller soles that planning balances on, for robustness (default: the real ones)",
    )
    foot: Literal["flat", "rolling"] = Field(
        default="flat",
        description="whether a foot lands and leaves with its whole sole, or lands on its heel and leaves "
        "from its toes while another foot stands",
    )
    planning_friction: Positive | None = Field(
        default=None, description="smaller friction that planning balances with (default: the real one)"
    )
    normal_force_cap_N: Positive | None = Field(
        default=None, description="largest sum of the normal forces of a stance [N] (default: 3 body weights)"
    )
    contact_normal_force_cap_N: Positive | None = Field(
        default=None, description="largest normal force of each sole or point that gives none itself [N]"
    )
    planning_normal_force_cap_N: Positive | None = Field(
        default=None, description="smaller cap that planning balances with (default: the real one)"
    )
    phases: Annotated[list[PhaseSection], Field(min_length=1)] = Field(description="phases in order")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.planning_sole is not None:
            for key in ("length_m", "width_m"):
                ours, real = getattr(self.planning_sole, key), getattr(self.sole, key)
                if ours > real:
                    raise refuse(f"planning_sole.{key}", f"is {ours:g}; valid: at most sole.{key} = {real:g}")
        for key, real in (
            ("planning_friction", "friction"),
            ("planning_normal_force_cap_N", "normal_force_cap_N"),
        ):
            ours, limit = getattr(self, key), getattr(self, real)
            if ours is not None and limit is not None and ours > limit:
                raise refuse(key, f"is {ours:g}; valid: at most {real} = {limit:g}")
        for number, phase in enumerate(self.phases):
            before = self.phases[number - 1].entries() if number else {}
            for effector, entry in phase.entries().items():
                if entry == "same" and effector not in before:
                    raise refuse(
                        f"phases[{number}].{effector}", "is 'same' but the phase before has no such contact; "
                        "valid: a contact with a position"
                    )  # fmt: skip
        return self

    def resolved_phases(self) -> list[dict[str, ContactSection]]:
        """Contacts of each phase with every ``same`` replaced by what it stands for."""
        phases: list[dict[str, ContactSection]] = []
        for phase in self.phases:
            contacts: dict[str, ContactSection] = {}
            for effector, entry in phase.entries().items():
                contacts[effector] = phases[-1][effector] if isinstance(entry, str) else entry
            phases.append(contacts)
        return phases


class StateSection(Section):
    """Where the body starts or ends."""

    com: Vector3 | None = Field(default=None, description="centre of mass [m]")
    velocity_m_s: Vector3 | None = Field(
        default=None, description="of the centre of mass when the body sits down at the goal (default: free)"
    )
    at: Vector2 | None = Field(default=None, description="where to stand, x and y [m]")
    heading_deg: Number | None = Field(default=None, description="where to face [deg]")
    posture: Text | None = Field(
        default=None, description="standing, seated, crouched, lying or a posture file"
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


class HeightBandSection(Section):
    """Lower and upper bound of the CoM's height."""

    lower: Text = Field(description="expression of the lowest height [m] in x, y, z of the CoM")
    upper: Text = Field(description="expression of the greatest height [m] in x, y, z of the CoM")

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
        default=None, description="largest distance from the CoM to every foot in contact [m]"
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


class WeightsSection(Section):
    """Weights of the planner's objectives; what is left out has the planner's default."""

    margin: NonNegative | None = Field(default=None, description="of the smallest margin [1/(N.m)] or [1/N]")
    smoothness: NonNegative | None = Field(default=None, description="of the mean squared derivatives")
    duration: NonNegative | None = Field(default=None, description="of the duration [1/s]")
    velocity: Weights3 | None = Field(default=None, description="along x, y, z [s^2/m^2]")
    acceleration: Weights3 | None = Field(default=None, description="along x, y, z [s^4/m^2]")
    jerk: Weights3 | None = Field(default=None, description="along x, y, z [s^6/m^2]")


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
        default=0.0, description="smallest stability margin allowed [N.m], or [N] in the force space"
    )
    margin_space: Literal["wrench", "force"] = Field(default="wrench", description="what the margin measures")
    friction_model: Literal["pyramid", "inner"] = Field(
        default="pyramid", description="pyramid around the friction cone, or inside it"
    )
    max_duration_s: Positive | None = Field(default=None, description="longest duration of the motion [s]")
    zero_end_accelerations: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="whether the CoM starts and ends without acceleration"
    )
    weights: WeightsSection = Field(default=WeightsSection(), description="of the objectives")

    @model_validator(mode="after")
    def _recorded(self) -> Self:
        if self.method == "keyframes" and self.recording is None:
            raise refuse("recording", "is missing; valid: a run directory or motion file for keyframes")
        for key in ("recording", "control_points"):
            if self.method != "keyframes" and getattr(self, key) is not None:
                raise refuse(key, f"is given for the method {self.method}; valid: only with keyframes")
        return self


class PushSection(Section):
    """A push on the trunk during the execution."""

    force_N: Positive = Field(description="size [N]")
    direction_deg: Number = Field(
        description="of the force, counter-clockwise from the body's forward axis [deg]"
    )
    duration_s: Duration = Field(description="how long [s]")
    at_s: NonNegative = Field(description="when it begins [s]")


class ScenarioFile(Section):
    """A whole scenario file.

    ``extends`` and ``variants`` are resolved before the file is checked against this section, so a
    scenario that was loaded has neither.
    """

    extends: Text | None = Field(
        default=None, exclude=True,
        description="first key of the file: a built-in scenario or a file that this one is laid over",
    )  # fmt: skip
    name: Name = Field(description="short name, also that of the run directory")
    description: str = Field(default="", description="one line for the list of scenarios")
    body: BodySection = Field(default=BodySection(), description="whose motion it is")
    reference_stature_m: Positive | None = Field(
        default=None, description="stature that the task's heights and distances were measured for [m] "
        "(default: the body's own); they are scaled to the actual body"
    )  # fmt: skip
    reference_mass_kg: Positive | None = Field(
        default=None,
        description="mass that planning.min_margin was chosen for [kg] (default: the body's own); the "
        "margin is scaled with mass and stature",
    )
    floor_height_m: Number | None = Field(default=0.0, description="height of the floor [m], null for none")
    scene: list[ObstacleSection] = Field(default_factory=list, description="obstacles")
    supports: SupportsSection | None = Field(default=None, description="explicit sequence of supports")
    task: TaskSection = Field(description="start and goal")
    com_constraints: list[ComConstraintSection] = Field(
        default_factory=list, description="constraints on the centre of mass"
    )
    planning: PlanningSection = Field(default=PlanningSection(), description="options of the planner")
    manner: Literal["ready", "walking", "close"] = Field(
        default="ready",
        description="how the body carries itself where the task leaves freedom: arms raised and bent, clear "
        "of the thighs, or an upright trunk and arms that swing against the legs",
    )
    push: PushSection | None = Field(default=None, description="disturbance during the execution")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(
        default=0, description="seed of every random choice"
    )
    expect: Literal["success", "failure"] = Field(
        default="success",
        description="how a run should end; 'manikin run all' counts an explained failure as right where one "
        "is expected",
    )
    variants: dict[str, dict[str, Any]] | None = Field(
        default=None, exclude=True, description="named changes of this scenario: what each lays over it"
    )  # fmt: skip

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [obstacle.name for obstacle in self.scene]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise refuse(f"scene[{index}].name", f"is {name!r} again; valid: a unique name")
        for index, constraint in enumerate(self.com_constraints):
            wanted = constraint.overhead if isinstance(constraint.overhead, list) else []
            for number, name in enumerate(wanted):
                if name not in names:
                    raise refuse(
                        f"com_constraints[{index}].overhead[{number}]",
                        f"is {name!r}; valid: automatic, or the name of an obstacle of the scene "
                        f"({', '.join(names) or 'it has none'})",
                    )
        self._check_body()
        for key in type(self.com_constraints[0])._keys() if self.com_constraints else ():
            if sum(getattr(c, key) is not None for c in self.com_constraints) > 1:
                raise refuse("com_constraints", f"holds {key} twice; valid: at most once")
        for end in ("start", "goal") if self.supports is not None else ():
            state = getattr(self.task, end)
            if state.com is None:
                raise refuse(
                    f"task.{end}.com", "is missing; valid: [x, y, z] in metres when supports are given"
                )
            for key in ("at", "heading_deg", "posture"):
                if getattr(state, key) is not None:
                    raise refuse(
                        f"task.{end}.{key}",
                        "has no meaning beside explicit supports; valid: only com, [x, y, z]",
                    )
        return self

    def _check_body(self) -> None:
        if self.body.model == "human":
            for number, phase in enumerate(self.supports.phases if self.supports is not None else ()):
                for name in phase.entries():
                    if name in MASSLESS_FEET:
                        raise refuse(
                            f"supports.phases[{number}].{name}",
                            f"is no part of a human; valid: {', '.join(EFFECTORS)}, or a point_mass",
                        )
            return
        for key in ("reference_stature_m", "push"):
            if getattr(self, key) is not None:
                raise refuse(key, "does not apply to a point mass; valid: leave it out")


def json_schema() -> dict[str, Any]:
    """JSON schema of a scenario file, for editors and the documentation."""
    schema = ScenarioFile.model_json_schema(by_alias=True)
    # A file that extends another one may leave out what that one gives.
    schema["anyOf"] = [{"required": ["extends"]}, {"required": schema.pop("required")}]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
