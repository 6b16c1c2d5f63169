"""The study file of ``manikin study``: bodies, swept keys and seeds on a scenario."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from manikin.body.anthropometry import Sex
from manikin.body.population import (
    MEASURES_OF_A_PERSON,
    PersonOfPopulation,
    boundary_people,
    percentile_person,
    random_people,
)
from manikin.errors import InputError, ScenarioError
from manikin.scenarios.load import find_scenario, load_scenario
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.validation import (
    Name,
    Number,
    Section,
    Text,
    optional,
    place,
    preset,
    refuse,
    refuse_if,
    refuse_repeated,
    required,
    rule_error,
    validate,
)
from manikin.scenarios.yaml_reader import read_yaml

MOST_JOBS = 20_000
"""Most jobs of a study."""
MOST_DRAWS = 10_000
"""Most people, values or seeds of one entry."""
_KINDS = ("percentiles", "boundary", "random", "body")


def _counted(value: Any) -> Any:
    """The first seeds, of which there are so many."""
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= MOST_DRAWS:
            raise rule_error(f"a list of seeds, or how many, from 1 to {MOST_DRAWS}")
        return list(range(value))
    return value


Whole = Annotated[int, Field(strict=True, ge=0)]
Seeds = Annotated[
    list[Whole],
    Field(min_length=1, max_length=MOST_DRAWS),
    BeforeValidator(_counted, json_schema_input_type=list[Whole] | Whole),
]
Measure = Literal["stature", "mass", "sitting_height", "arm_length", "shoulder_breadth", "hip_breadth"]


class PeopleSection(Section):
    """Some of the bodies: one of ``percentiles``, ``boundary``, ``random`` and ``body``."""

    sex: Literal["female", "male", "both"] = preset(
        "both", "of the people of the survey; of a body, its own key sex says it"
    )
    percentiles: Annotated[list[Number], Field(min_length=1, max_length=100)] | None = optional(
        "people whose stature and mass are at each of these percentiles, and who are average for these else"
    )
    boundary: Annotated[Number, Field(gt=0, le=0.999)] | None = optional(
        "people on the ellipsoid that holds this share of a sex: the two ends of each axis"
    )
    corners: bool = preset(False, "boundary: the points between the axes as well")
    measures: Annotated[list[Measure], Field(min_length=1)] = preset(
        list(MEASURES_OF_A_PERSON), "boundary: what varies; the rest is average for it"
    )
    random: Annotated[int, Field(strict=True, ge=1, le=MOST_DRAWS)] | None = optional(
        "how many people to draw of each sex"
    )
    seed: Whole = preset(0, "random: of the draws; the first people are the same however many are drawn")
    name: Name | None = optional("body: its name")
    body: dict[str, Any] | None = optional("keys of the scenario's body, such as stature_m and mass_kg")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        kinds = [kind for kind in _KINDS if getattr(self, kind) is not None]
        if len(kinds) != 1:
            raise rule_error(f"a mapping with one of {', '.join(_KINDS)}")
        applies = {"boundary": ("corners", "measures"), "random": ("seed",), "body": ("name",)}
        for kind, keys in applies.items():
            for key in keys if kind != kinds[0] else ():
                refuse_if(key in self.model_fields_set, key, f"is given without {kind}; valid: beside it")
        if self.body is not None:
            if self.name is None:
                raise refuse("name", "is missing; valid: a name for the body")
            problem = "is given beside body; valid: the key sex of the body"
            refuse_if("sex" in self.model_fields_set, "sex", problem)
        return self

    @property
    def kind(self) -> str:
        """Which of the four it is."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    def people(self) -> list[StudyBody]:
        """The bodies, in order; BodyError if a percentile is out of range."""
        if self.body is not None:
            return [StudyBody(str(self.name), "body", dict(self.body), drawn=False)]
        sexes = [Sex.FEMALE, Sex.MALE] if self.sex == "both" else [Sex(self.sex)]
        return [StudyBody.of(person, self.kind) for sex in sexes for person in self._of_sex(sex)]

    def _of_sex(self, sex: Sex) -> tuple[PersonOfPopulation, ...]:
        if self.percentiles is not None:
            return tuple(percentile_person(sex, percent) for percent in self.percentiles)
        if self.boundary is not None:
            return boundary_people(sex, self.boundary, self.measures, corners=self.corners)
        return random_people(sex, self.random or 0, self.seed)


class SweepSection(Section):
    """A value that varies: of one key, or of several that vary together."""

    name: Text | None = optional("column of the value in the table (default: the key)")
    key: Text | None = optional("dotted path of the scenario, as of run --set, such as supports.friction")
    keys: dict[str, Number] | None = optional("keys that vary together: each is the value times this factor")
    values: Annotated[list[Any], Field(min_length=1, max_length=MOST_DRAWS)] | None = optional("the values")
    range: tuple[Number, Number, Whole] | None = optional("instead: first and last value, and how many")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.key is None) == (not self.keys):
            raise rule_error("a mapping with key, or else keys {KEY: FACTOR}")
        if (self.values is None) == (self.range is None):
            raise rule_error("a mapping with values, or else range [FIRST, LAST, COUNT]")
        if self.range is not None and not 2 <= self.range[2] <= MOST_DRAWS:
            raise refuse("range[2]", f"is {self.range[2]}; valid: a count from 2 to {MOST_DRAWS}")
        for number, value in enumerate((self.values or ()) if self.keys else ()):
            wrong = isinstance(value, bool) or not isinstance(value, int | float)
            refuse_if(wrong, f"values[{number}]", f"is {value!r}; valid: a number, which factors multiply")
        for path in self.paths:
            own = "is swept; valid: seeds, beside sweeps"
            refuse_if(path == "seed", "key" if self.key else "keys", own)
        return self

    @property
    def label(self) -> str:
        """What the value is called."""
        return self.name or self.key or " and ".join(self.keys or ())

    @property
    def paths(self) -> tuple[str, ...]:
        """Dotted paths that are set."""
        return tuple(self.keys) if self.keys else (str(self.key),)

    def all_values(self) -> list[Any]:
        """The values in order."""
        if self.range is None:
            return list(self.values or ())
        return [_short(value) for value in np.linspace(*self.range[:2], self.range[2]).tolist()]

    def overrides(self, value: Any) -> tuple[str, ...]:
        """What sets a value, ``KEY=VALUE`` each."""
        if self.keys:
            return tuple(f"{key}={json.dumps(_short(factor * value))}" for key, factor in self.keys.items())
        return (f"{self.key}={json.dumps(value)}",)


class StudyFile(Section):
    """A whole study file."""

    name: Name | None = optional("short name, also that of the directory (default: that of the scenario)")
    description: str = preset("", "one line")
    scenario: Text = required("a built-in scenario, with @VARIANT if need be, or a file beside this one")
    stage: Literal["contacts", "all"] = preset(
        "contacts", "contacts alone, of a scenario without supports: the cheap stage; or whole runs"
    )
    bodies: list[PeopleSection] = Field(
        default_factory=list, description="whose motion it is (default: the scenario's body)"
    )
    sweeps: list[SweepSection] = Field(default_factory=list, description="values that vary, each with each")
    seeds: Seeds = preset([0], "seeds of each body at each value: a list, or how many from 0")
    time_limit_s: Annotated[Number, Field(ge=1)] = preset(
        600.0, "processor time after which a job is ended [s]"
    )
    confidence: Annotated[Number, Field(gt=0, lt=1)] = preset(0.95, "of the intervals of shares")

    @model_validator(mode="after")
    def _check(self) -> Self:
        refuse_repeated([sweep.label for sweep in self.sweeps], "sweeps[{}].name")
        refuse_if(len({*self.seeds}) < len(self.seeds), "seeds", "hold one twice; valid: each seed once")
        taken = {f"body.{key}" for key in ("model", "sex", "mass_kg")} if self.bodies else set()
        taken |= {f"body.{name}_m" for name in MEASURES_OF_A_PERSON if name != "mass" and self.bodies}
        for number, sweep in enumerate(self.sweeps):
            for path in sweep.paths:
                key = f"sweeps[{number}].{'keys' if sweep.keys else 'key'}"
                refuse_if(path in taken, key, f"is {path}, which bodies give; valid: one of them")
        return self


@dataclass(frozen=True, eq=False)
class StudyBody:
    """One body of a study.

    Attributes:
        name: Unique in the study.
        family: Which kind of ``bodies`` it is of, or ``"scenario"``.
        keys: Keys of the scenario's body that it sets.
        drawn: Whether it is a random draw from the population.
    """

    name: str
    family: str
    keys: Mapping[str, Any]
    drawn: bool

    @classmethod
    def of(cls, person: PersonOfPopulation, family: str) -> StudyBody:
        """A person of the population."""
        return cls(person.name, family, person.body_keys(), person.drawn)

    @property
    def overrides(self) -> tuple[str, ...]:
        """What sets the body, ``KEY=VALUE`` each."""
        return tuple(f"body.{key}={json.dumps(value)}" for key, value in self.keys.items())


@dataclass(frozen=True, eq=False)
class StudySetting:
    """Values of the swept keys.

    Attributes:
        values: By the names of the sweeps; empty without sweeps.
        overrides: What sets them, ``KEY=VALUE`` each.
    """

    values: Mapping[str, Any]
    overrides: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Study:
    """A study that was read.

    Attributes:
        file: What the file holds.
        scenario: What it is about.
        bodies: In the order of the file.
        settings: Each value of a sweep with each of the others; one without values where nothing is swept.
    """

    file: StudyFile
    scenario: Scenario
    bodies: tuple[StudyBody, ...]
    settings: tuple[StudySetting, ...]

    @property
    def name(self) -> str:
        """Its name, or that of the scenario."""
        return self.file.name or f"study-{self.scenario.name}"


def load_study(path: Path) -> Study:
    """Read a study file and what it is about.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    data, lines = read_yaml(path, "study")
    file = validate(StudyFile, data, str(path), lines)

    def error(key: str | int, text: str, *more: str | int) -> ScenarioError:
        return ScenarioError(f"{place(str(path), (key, *more), lines)} {text}")

    try:
        found, variant = find_scenario(file.scenario, path.parent)
        scenario = load_scenario(found, variant)
    except ScenarioError as problem:
        raise error("scenario", f"cannot be used: {problem}") from None
    if file.stage == "contacts" and not _plans_contacts(scenario):
        raise error("stage", f"is contacts, but {scenario.name} has no contacts to plan; valid: all")
    if file.bodies and scenario.file.body.model != "human":
        raise error("bodies", f"are given for the body {scenario.file.body.model}; valid: leave them out")
    bodies: dict[str, StudyBody] = {}
    for number, people in enumerate(file.bodies):
        try:
            made = people.people()
        except InputError as problem:
            raise error("bodies", f"cannot be made: {problem}", number) from None
        for body in made:
            if body.name in bodies:
                raise error("bodies", f"makes {body.name!r} again; valid: each body once", number)
            if body.family == "body" and (wrong := _refused(scenario, body)):
                raise error("bodies", f"cannot be made: {wrong}", number)
            bodies[body.name] = body
    bodies = bodies or {"scenario": StudyBody("scenario", "scenario", {}, drawn=False)}
    settings = tuple(_settings(file))
    count = len(bodies) * len(settings) * len(file.seeds)
    if count > MOST_JOBS:
        raise ScenarioError(f"{path}: makes {count} jobs; valid: at most {MOST_JOBS}")
    return Study(file, scenario, tuple(bodies.values()), settings)


def _refused(scenario: Scenario, body: StudyBody) -> str | None:
    """What is wrong with a body in a scenario; all of its jobs would end by it."""
    try:
        scenario.with_overrides(body.overrides).build_body()
    except InputError as problem:
        return str(problem)
    return None


def _plans_contacts(scenario: Scenario) -> bool:
    file = scenario.file
    return file.supports is None and file.recovery is None and file.walking is None


def _settings(file: StudyFile) -> list[StudySetting]:
    """Each value of a sweep with each of the others, the last sweep fastest."""
    names = [sweep.label for sweep in file.sweeps]
    settings = []
    for chosen in product(*(sweep.all_values() for sweep in file.sweeps)):
        pairs = list(zip(file.sweeps, chosen, strict=True))
        overrides = tuple(text for sweep, value in pairs for text in sweep.overrides(value))
        settings.append(StudySetting(dict(zip(names, chosen, strict=True)), overrides))
    return settings


def _short(value: float) -> float:
    """A number without the last bits of rounding, which would be written out."""
    return float(f"{value:.12g}")


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file, for editors and the documentation."""
    schema = StudyFile.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
