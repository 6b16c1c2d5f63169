"""Checked building blocks of the file formats, and their one-line error messages."""

import difflib
import re
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Annotated, Any, Self, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from manikin.errors import ScenarioError

KeyPath = tuple[str | int, ...]


class FrameMoves(Enum):
    """Change of a value with the frame of the world, as a mark in the annotation of its field."""

    POINT = "point"  # position in the world, x and y, or x, y and z [m]
    DIRECTION = "direction"  # vector in the world, such as a normal or a velocity
    HEADING = "heading"  # angle counter-clockwise from world x [deg]
    ORIENTATION = "orientation"  # fixed-axis roll, pitch and yaw in the world [deg]


class Section(BaseModel):
    """A mapping of a file: read-only, and every key must be known."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=False)

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, data: Any) -> Any:
        keys = cls._keys()
        if not isinstance(data, Mapping):
            raise rule_error(f"a mapping with the key{'s' if len(keys) > 1 else ''} {', '.join(keys)}")
        for key in data:
            if key not in keys:
                raise PydanticCustomError("unknown_key", "{rule}", _unknown_key(key, keys))
        return data

    def implied(self) -> dict[str, Any]:
        """Values that are left out and yet depend on the frame of the world, as a heading that is then 0."""
        return {}

    @classmethod
    def _keys(cls) -> list[str]:
        return [field.alias or name for name, field in cls.model_fields.items()]


class OneOf(Section):
    """A mapping with exactly one of its keys."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        keys = self._keys()
        if sum(getattr(self, key) is not None for key in keys) != 1:
            raise refuse("", f"holds none or several; valid: exactly one of {', '.join(keys)}")
        return self

    @property
    def name(self) -> str:
        """The key that is given."""
        return next(key for key in self._keys() if getattr(self, key) is not None)

    @property
    def content(self) -> Any:
        """Value of the key that is given."""
        return getattr(self, self.name)


def _unknown_key(key: Any, keys: Sequence[str]) -> dict[str, Any]:
    close = difflib.get_close_matches(str(key), keys, n=1, cutoff=0.6)
    if not close:  # "mass" for "mass_kg": too short for the ratio, yet plainly meant.
        close = [known for known in keys if known.startswith(str(key)) or str(key).startswith(known)][:1]
    hint = f"did you mean {close[0]!r}? " if close else ""
    return {"key": str(key), "rule": f"{hint}valid: {', '.join(keys)}"}


def _vector(length: int, meaning: str) -> BeforeValidator:
    def check(value: Any) -> Any:
        items = value if isinstance(value, list | tuple) else ()
        numbers = [item for item in items if isinstance(item, int | float) and not isinstance(item, bool)]
        if not len(items) == len(numbers) == length:
            raise rule_error(meaning)
        return value

    return BeforeValidator(check)


LARGEST = 1e6
"""Largest size of any number of a file; beyond it sums of squares and the solvers lose their digits."""
SMALLEST = 1e-6
"""Smallest number that has to be positive."""
LONGEST_PHASE = 60.0
"""Longest duration [s]; a motion has a thousand samples per second."""
LONGEST_NAME = 100
"""Longest name [characters]."""


def _not_tiny(value: float) -> float:
    if value < SMALLEST:
        raise rule_error(f"a number >= {SMALLEST:g}")
    return value


def _file_name(value: str) -> str:
    if len(value) > LONGEST_NAME or value.startswith(".") or not re.fullmatch(r"[\w .+@-]+", value):
        rule = "letters, digits, spaces and . _ + - @, not starting with a dot"
        raise rule_error(f"at most {LONGEST_NAME} {rule}")
    return value


def bounded(**limits: Any) -> Any:
    """Metadata of a finite number of a file that is within limits, such as ``ge`` and ``le``."""
    return Field(strict=True, allow_inf_nan=False, **limits)


Number = Annotated[float, bounded(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, bounded(gt=0, le=LARGEST), AfterValidator(_not_tiny)]
NonNegative = Annotated[float, bounded(ge=0, le=LARGEST)]
Duration = Annotated[float, bounded(gt=0, le=LONGEST_PHASE), AfterValidator(_not_tiny)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Name = Annotated[Text, AfterValidator(_file_name)]
"""A name that can also be that of a directory."""
Vector2 = Annotated[tuple[Number, Number], _vector(2, "two numbers [x, y]")]
Vector3 = Annotated[tuple[Number, Number, Number], _vector(3, "three numbers [x, y, z]")]
Size3 = Annotated[tuple[Positive, Positive, Positive], _vector(3, "three numbers > 0 [x, y, z]")]
Weights3 = Annotated[tuple[NonNegative, NonNegative, NonNegative], _vector(3, "three numbers >= 0 [x, y, z]")]


def required(meaning: str) -> Any:
    """Field of a section that has to be given."""
    return Field(description=meaning)


def preset(default: Any, meaning: str) -> Any:
    """Field of a section with a default."""
    return Field(default=default, description=meaning)


def optional(meaning: str) -> Any:
    """Field of a section that may be left out."""
    return Field(default=None, description=meaning)


def rule_error(rule: str) -> PydanticCustomError:
    """Make the error of a rule that pydantic does not know; ``rule`` says what is valid."""
    return PydanticCustomError("rule", "{rule}", {"rule": rule})


def refuse(key: str, problem: str) -> PydanticCustomError:
    """Make the error of one key of a section; ``problem`` says what is wrong and what is valid."""
    return PydanticCustomError("refused", "{problem}", {"key": key, "problem": problem})


def refuse_if(wrong: object, key: str, problem: str) -> None:
    """Refuse one key of a section if something is wrong with it, see :func:`refuse`."""
    if wrong:
        raise refuse(key, problem)


def refuse_repeated(names: Sequence[str], key: str, valid: str = "a unique name") -> None:
    """Refuse a name that stands twice in a list; ``key`` is that of an entry, with {} for its number."""
    for index, name in enumerate(names):
        refuse_if(name in names[:index], key.format(index), f"is {name!r} again; valid: {valid}")


S = TypeVar("S", bound=Section)


def validate(model: type[S], data: Any, source: str, lines: Mapping[KeyPath, str] | None = None) -> S:
    """Check what a YAML reader returned, with the place of each key, against the section of a whole file.

    Raises:
        ScenarioError: One line: file, key path, what was wrong, what is valid.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        problems = error.errors(include_url=False)
    path, text = _describe(problems[0], data, model)
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    raise ScenarioError(f"{place(source, path, lines or {})} {text}{more}".replace("\n", " "))


def place(source: str, path: KeyPath, lines: Mapping[KeyPath, str]) -> str:
    """Text ``file:line: key.path`` of a key; the file and line of the nearest known parent."""
    known = next((path[:n] for n in range(len(path), -1, -1) if path[:n] in lines), None)
    where = lines[known] if known is not None else source
    return f"{where}: {path_text(path)}" if path else f"{source}:"


def path_text(path: KeyPath) -> str:
    """Text of a key path, such as ``supports.phases[2].left_foot``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _describe(problem: ErrorDetails, data: Any, model: type[Section]) -> tuple[KeyPath, str]:
    path, context, kind = _real_path(problem["loc"], data), problem.get("ctx", {}), problem["type"]
    value = "empty" if problem["input"] is None else repr(problem["input"])
    value = value if len(value) <= 60 else value[:57] + "..."
    if kind == "unknown_key":
        return (*path, context["key"]), f"is not a known key; {context['rule']}"
    if kind == "missing":
        return (*path, str(problem["loc"][-1])), f"is missing; valid: {_meaning(model, problem['loc'])}"
    if kind == "refused":
        parts = re.findall(r"[^.\[\]]+", context["key"])  # the inverse of path_text
        return (*path, *(int(part) if part.isdigit() else part for part in parts)), context["problem"]
    if kind == "rule":
        return path, f"is {value}; valid: {context['rule']}"
    rule = _RULES[kind].format(**context) if kind in _RULES else problem["msg"]
    return path, f"is {value}; valid: {rule}"


def _meaning(model: type[Section], location: tuple[str | int, ...]) -> str:
    """Description of the field of a missing key."""
    for part in location[:-1]:
        if part in model.model_fields:
            model = _section_of(model.model_fields[str(part)].annotation) or model
    field = model.model_fields.get(str(location[-1]))
    return (field.description if field is not None else None) or f"the key {location[-1]}"


def _section_of(annotation: Any) -> Any:
    """The section inside an annotation such as ``list[X]`` or ``X | None``."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    return next((result for part in get_args(annotation) if (result := _section_of(part)) is not None), None)


def _real_path(location: tuple[str | int, ...], data: Any) -> KeyPath:
    """Keep the parts of pydantic's location that are in the file; it adds names of union members."""
    path: list[str | int] = []
    for part in location:
        listed = data if isinstance(data, list | tuple) else ()
        inside: Mapping[Any, Any] = data if isinstance(data, Mapping) else dict(enumerate(listed))
        if part in inside:
            data = inside[part]
            path.append(part)
    return tuple(path)


_RULES = {
    "greater_than": "a number > {gt:g}", "greater_than_equal": "a number >= {ge:g}",
    "less_than": "a number < {lt:g}", "less_than_equal": "a number <= {le:g}",
    "literal_error": "{expected}", "too_short": "at least {min_length} entries",
    "string_too_short": "a text that is not empty", "finite_number": "a finite number",
    "float_type": "a number", "int_type": "a whole number", "int_from_float": "a whole number",
    "string_type": "a text", "bool_type": "true or false", "list_type": "a list", "tuple_type": "a list",
    "dict_type": "a mapping",
}  # fmt: skip
"""What is valid, by the kind of pydantic's error."""
