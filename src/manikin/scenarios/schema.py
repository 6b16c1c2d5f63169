"""Schema of a scenario file: its sections and the rules between them; lengths are metres, angles degrees."""

from collections.abc import Sequence
from operator import attrgetter
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from manikin.scenarios.sections.operation_sections import TaskSection, refused_operations
from manikin.scenarios.sections.planning_sections import (
    CLIMBING_LIMBS,
    WORDS,
    BodySection,
    ComConstraintSection,
    ContactsSection,
    PlanningSection,
    WholebodySection,
)
from manikin.scenarios.sections.support_sections import EFFECTORS, MASSLESS_FEET, SupportsSection
from manikin.scenarios.sections.task_sections import (
    ExecutionSection,
    Expectation,
    ExpectSection,
    ObstacleSection,
    PushSection,
    RecoverySection,
    WalkingSection,
)
from manikin.scenarios.validation import (
    Name,
    Number,
    Positive,
    Section,
    Text,
    optional,
    preset,
    refuse,
    refuse_if,
    refuse_repeated,
    required,
    rule_error,
)


def _words_of_execution(value: Any) -> Any:
    """The mapping that the word "required" or "none" stands for."""
    if isinstance(value, str):
        if value not in ("required", "none"):
            raise rule_error("required, none, or a mapping with trials")
        return {"required": value == "required"}
    return value


Execution = Annotated[
    ExecutionSection,
    BeforeValidator(
        _words_of_execution, json_schema_input_type=ExecutionSection | Literal["required", "none"]
    ),
]


class ScenarioFile(Section):
    """A whole scenario file.

    ``extends`` and ``variants`` are resolved before the file is checked against this section, so a
    scenario that was loaded has neither.
    """

    extends: Text | None = Field(
        default=None, exclude=True,
        description="first key of the file: a built-in scenario or a file that this one is laid over",
    )  # fmt: skip
    name: Name = required("short name, also that of the run directory")
    description: str = preset("", "one line for the list of scenarios")
    body: BodySection = preset(BodySection(), "whose motion it is")
    reference_stature_m: Positive | None = optional(
        "stature that the task's heights and distances were measured for [m] "
        "(default: the body's own); they are scaled to the actual body"
    )
    reference_mass_kg: Positive | None = optional(
        "mass that planning.min_margin was chosen for [kg] (default: the body's own); the "
        "margin is scaled with mass and stature"
    )
    floor_height_m: Number | None = preset(0.0, "height of the floor [m], null for none")
    scene: list[ObstacleSection] = Field(default_factory=list, description="obstacles")
    supports: SupportsSection | None = optional(
        "explicit sequence of supports; left out, contacts are planned"
    )
    contacts: ContactsSection | None = optional("how contacts are planned where no supports are given")
    task: TaskSection = required("start and goal")
    com_constraints: list[ComConstraintSection] = Field(
        default_factory=list, description="constraints on the centre of mass"
    )
    planning: PlanningSection = preset(PlanningSection(), "options of the planner")
    wholebody: WholebodySection = preset(WholebodySection(), "how the whole body's motion is found")
    execution: Execution = preset(
        ExecutionSection(),
        "required, none (not executed), or a mapping: how the planned motion is executed, and tried",
    )
    manner: Literal["ready", "walking", "close", "hanging", "climbing"] = preset(
        "ready",
        "how the body carries itself where the task leaves freedom: ready, hanging arms that "
        "come up where balance asks for it; walking, upright with arms that swing against the legs; close, "
        "arms bent close to the body; hanging, arms that stay down; climbing, arms raised and legs bent and "
        "spread",
    )
    push: PushSection | None = optional("disturbance during the execution")
    recovery: RecoverySection | None = optional(
        "instead of a way to go: the body stands where it is, is pushed and keeps its balance; "
        "task may be left out then"
    )
    walking: WalkingSection | None = optional(
        "the body walks from start to goal over the floor as people do, around what stands there"
    )
    seed: Annotated[int, Field(strict=True, ge=0)] = preset(0, "seed of every random choice")
    expect: Expectation = preset(
        ExpectSection(outcome="success"),
        "how a run should end, success or failure, or a mapping with the stage and the reason of "
        "an expected failure; 'manikin run all' counts an explained failure as right where one is expected",
    )
    variants: dict[str, dict[str, Any]] | None = Field(
        default=None, exclude=True, description="named changes of this scenario: what each lays over it"
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _implied(cls, data: Any) -> Any:
        """What goes without saying: keys that others leave no choice about.

        A body that recovers from a push ends where it starts; what cannot be executed is only planned; who
        climbs does so on hands and feet; a motion on contacts of any limbs is refined.
        """
        if not isinstance(data, dict):
            return data
        if _is_planned(data):
            data = _on_limbs(data)
        if data.get("recovery") is not None and "task" not in data:
            data = {**data, "task": {"start": {"at": [0.0, 0.0]}, "goal": {"at": [0.0, 0.0]}}}
        return {**data, "execution": "none"} if "execution" not in data and _only_planned(data) else data

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [obstacle.name for obstacle in self.scene]
        refuse_repeated(names, "scene[{}].name")
        one_of = f"the name of an obstacle of the scene ({', '.join(names) or 'it has none'})"
        for index, constraint in enumerate(self.com_constraints):
            wanted = constraint.overhead if isinstance(constraint.overhead, list) else []
            for number, name in enumerate(wanted):
                key = f"com_constraints[{index}].overhead[{number}]"
                refuse_if(name not in names, key, f"is {name!r}; valid: automatic, or {one_of}")
        if self.task.act is not None:
            act, limbs = self.task.act, self.contacts is not None and self.contacts.limbs
            refuse_if(act.on not in names, "task.act.on", f"is {act.on!r}; valid: {one_of}")
            refuse_if(limbs, "contacts.limbs", "are given beside task.act; valid: one of them")
        self._check_operations()
        self._check_execution()
        self._check_recovery()
        self._check_walking()
        self._check_body()
        self._check_load()
        self._check_wholebody()
        if self.supports is None:
            self._check_planned()
        else:
            refuse_if(self.contacts is not None, "contacts", "is given beside supports; valid: one of them")
            own = "is given beside supports, whose phases have their durations; valid: without supports"
            refuse_if(self.task.pace != "comfortable", "task.pace", own)
        for key in type(self.com_constraints[0])._keys() if self.com_constraints else ():
            count = sum(getattr(c, key) is not None for c in self.com_constraints)
            refuse_if(count > 1, "com_constraints", f"holds {key} twice; valid: at most once")
        for end in ("start", "goal") if self.supports is not None else ():
            missing = "is missing; valid: [x, y, z] in metres when supports are given"
            refuse_if(getattr(self.task, end).com is None, f"task.{end}.com", missing)
            problem = "has no meaning beside explicit supports; valid: only com, [x, y, z]"
            self._refuse_given(("at", "heading_deg", "height_m", "posture"), problem, f"task.{end}.")
        return self

    def _inapplicable(self, key: str) -> PydanticCustomError:
        return refuse(key, f"does not apply to {WORDS[self.body.model]}; valid: leave it out")

    def _refuse_given(self, keys: Sequence[str], problem: str, parent: str = "") -> None:
        for key in (parent + key for key in keys):
            refuse_if(attrgetter(key)(self) is not None, key, problem)

    def _check_operations(self) -> None:
        """Refuse operations in a wrong order, on what is not there, or beside another way to go."""
        operations = self.task.operations
        if operations is None:
            return
        if self.body.model != "human":
            raise self._inapplicable("task.operations")
        given = "is given beside task.operations; valid: one of them"
        self._refuse_given(("supports", "walking", "recovery", "push", "task.act", "body.load"), given)
        limbs = self.contacts is not None and self.contacts.limbs
        refuse_if(limbs, "contacts.limbs", "are given beside task.operations; valid: leave them out")
        refuse_if(
            self.wholebody.method == "refine", "wholebody.method", "is refine; valid: follow, for operations"
        )
        refuse_if(self.execution.trials > 0, "execution.trials", "are asked for beside operations; valid: 0")
        seated = self.task.start.posture == "seated"
        for key, problem in refused_operations(operations, self.scene, seated):
            raise refuse(f"task.{key}", problem)

    def _check_execution(self) -> None:
        """Refuse an execution of what cannot be executed, and none of what is nothing else."""
        if self.execution.required:
            recorded = self.walking is not None and self.walking.whole_body == "recorded"
            problem = "is required; valid: none for"
            point_mass = self.body.model == "point_mass"
            refuse_if(point_mass, "execution", f"{problem} a point mass, which has no joints")
            refuse_if(recorded, "execution", f"{problem} a recorded walk, or walking.whole_body: balanced")
        elif self.recovery is not None:
            raise refuse("execution", "is none; valid: required beside recovery, which is an execution")

    def _check_recovery(self) -> None:
        """Refuse a recovery without a push, or with what belongs to a way."""
        recovery, kudoh = self.recovery, self.body.model == "kudoh"
        if recovery is None:
            refuse_if(kudoh, "recovery", "is missing; valid: a recovery, for the body of Kudoh")
            return
        if self.push is None:
            raise refuse("push", "is missing; valid: force_N, direction_deg, duration_s, at_s")
        if self.body.model not in ("human", "kudoh"):
            raise self._inapplicable("recovery")
        self._refuse_given(("supports", "contacts"), "is given beside recovery; valid: one of them")
        for key in ("posture", "height_m"):
            value = getattr(self.task.start, key)
            given = value not in (None, 0.0, "standing")
            refuse_if(given, f"task.start.{key}", f"is {value}; valid in a recovery: leave it out")
        self._refuse_given(("task.act",), "is given beside recovery; valid: one of them")
        refuse_if(self.execution.trials > 0, "execution.trials", "are asked for beside recovery; valid: 0")
        floor, steps, apart = self.floor_height_m, recovery.steps, recovery.feet_apart_m
        refuse_if(floor != 0.0, "floor_height_m", f"is {floor}; valid in a recovery: 0")
        held, single = recovery.feet == "held", recovery.support != "both"
        refuse_if(steps and held, "recovery.steps", f"is {steps} of held feet; valid: 0, or free feet")
        refuse_if(steps and single, "recovery.steps", f"is {steps} on one foot; valid: 0, or both feet")
        if apart is not None and single:
            problem = f"is {apart:g} on one foot; valid: leave it out, or both feet"
            raise refuse("recovery.feet_apart_m", problem)
        begins, ends = self.push.at_s, recovery.duration_s
        refuse_if(begins >= ends, "push.at_s", f"is {begins:g}; valid: before the run ends at {ends:g} s")

    def _check_walking(self) -> None:
        """Refuse a walk beside other ways to go, or of a body that has no recorded walks."""
        walking, floor = self.walking, self.floor_height_m
        if walking is None:
            return
        if self.body.model != "human":
            raise self._inapplicable("walking")
        if floor is None:
            raise refuse("floor_height_m", "is null; valid in a walk: the height of a floor")
        recorded, alone = walking.whole_body == "recorded", self.supports is None
        others = ("contacts", "recovery", *(("push",) if recorded else ()))
        self._refuse_given(others, "is given beside walking; valid: one of them")
        problem = "goes with supports, which it leads to; valid: both or neither"
        refuse_if(alone != (walking.start is None), "walking.start", problem)
        problem = "is recorded; valid before supports: balanced, or leave it out"
        refuse_if(recorded and not alone, "walking.whole_body", problem)
        if not alone:
            return
        refuse_if(self.task.act is not None, "task.act", "is given beside walking; valid: one of them")
        for end in ("start", "goal"):
            state = getattr(self.task, end)
            sits = state.posture not in (None, "standing")
            refuse_if(sits, f"task.{end}.posture", f"is {state.posture}; valid in a walk: standing")
            if state.height_m not in (None, floor):
                problem = f"is {state.height_m:g}; valid in a walk: that of the floor, {floor:g}"
                raise refuse(f"task.{end}.height_m", problem)

    def _check_load(self) -> None:
        """Refuse a load of some phases where there are none, or that a planner would not feel."""
        load = self.body.load
        if load is None or load.lasts:
            return
        key = f"body.load.{'until' if load.from_phase is None else 'from'}_phase"
        lasting = "valid: a load of the whole motion"
        alone = self.supports is None
        refuse_if(alone, key, f"is given without supports; {lasting}, or phases of supports")
        kind = WORDS[self.body.model]
        refuse_if(self.body.model != "human", key, f"does not apply to {kind}; {lasting}")
        unfelt = self.wholebody.method == "refine" or self.planning.method == "keyframes"
        refuse_if(unfelt, key, f"is given for a refined or recorded motion; {lasting}")

    def _check_wholebody(self) -> None:
        """Refuse what cannot be refined."""
        if self.wholebody.method != "refine":
            return
        point_mass, follow = self.body.model == "point_mass", "is refine; valid: follow for"
        rolls = self.supports is not None and self.supports.foot == "rolling"
        refuse_if(point_mass, "wholebody.method", f"{follow} a point mass, which has no joints")
        refuse_if(rolls, "wholebody.method", f"{follow} feet that roll, or flat ones")
        refuse_if(self.task.act is not None, "wholebody.method", f"{follow} a task with an act")

    def _check_planned(self) -> None:
        """Refuse what contacts cannot be planned for."""
        point_mass = self.body.model == "point_mass"
        refuse_if(point_mass, "supports", "is missing; valid: explicit supports for a point mass")
        for end in ("start", "goal"):
            problem = "has no meaning without explicit supports; valid: at, heading_deg, height_m, posture"
            self._refuse_given(("com", "velocity_m_s"), problem, f"task.{end}.")
        seated = self.task.goal.posture == "seated" and self.wholebody.method == "refine"
        problem = "is seated; valid: standing or crouched for a refined motion"
        refuse_if(seated, "task.goal.posture", problem)

    def _check_body(self) -> None:
        if self.body.model == "human":
            problem = f"is no part of a human; valid: {', '.join(EFFECTORS)}, or a point_mass"
            for number, phase in enumerate(self.supports.phases if self.supports is not None else ()):
                for name in phase.entries():
                    refuse_if(name in MASSLESS_FEET, f"supports.phases[{number}].{name}", problem)
            return
        if self.task.act is not None:
            raise self._inapplicable("task.act")
        for key in ("reference_stature_m", "push"):
            if getattr(self, key) is not None and not (key == "push" and self.recovery is not None):
                raise self._inapplicable(key)
        if self.body.model != "point_mass" and self.supports is not None:
            raise refuse("supports", f"do not apply to {WORDS[self.body.model]} yet; valid: leave them out")


def _is_planned(data: dict[str, Any]) -> bool:
    """Whether an unchecked file leaves its contacts to be planned."""
    return not any(data.get(key) is not None for key in ("supports", "recovery", "walking"))


def _on_limbs(data: dict[str, Any]) -> dict[str, Any]:
    """An unchecked file with the limbs of one who climbs, and the method of contacts of any limbs."""
    body, contacts, task, wholebody = (
        _mapping(data, key) for key in ("body", "contacts", "task", "wholebody")
    )
    human = "urdf" not in body and body.get("model", "human") == "human"
    if human and any(_mapping(task, end).get("posture") == "climbing" for end in ("start", "goal")):
        contacts = {"limbs": list(CLIMBING_LIMBS), **contacts}
        data = {**data, "contacts": contacts}
    on_feet = human and contacts.get("limbs") is None
    if on_feet or body.get("model") == "point_mass" or "method" in wholebody:
        return data
    return {**data, "wholebody": {**wholebody, "method": "refine"}}


def _mapping(data: dict[str, Any], key: str) -> dict[str, Any]:
    """A section of an unchecked file; empty where it is missing or none."""
    section = data.get(key)
    return section if isinstance(section, dict) else {}


def _only_planned(data: dict[str, Any]) -> bool:
    """Whether an unchecked file has a point mass or a recorded walk, which cannot be executed."""
    body, walking = data.get("body"), data.get("walking")
    if isinstance(body, dict) and body.get("model") == "point_mass":
        return True
    return isinstance(walking, dict) and walking.get("whole_body") == "recorded"


def json_schema() -> dict[str, Any]:
    """JSON schema of a scenario file, for editors and the documentation."""
    schema = ScenarioFile.model_json_schema(by_alias=True)
    # A file that extends another one may leave out what that one gives.
    wanted = schema.pop("required")
    standing = [key for key in wanted if key != "task"] + ["recovery"]
    schema["anyOf"] = [{"required": keys} for keys in (["extends"], wanted, standing)]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
