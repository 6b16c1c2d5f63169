"""Sections of a scenario file about its task, and the operations in it, one after the other."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from manikin.scenarios.sections.task_sections import ActSection, ObstacleSection, StateSection
from manikin.scenarios.validation import (
    FrameMoves,
    Number,
    OneOf,
    Positive,
    Section,
    Text,
    Vector2,
    Vector3,
    optional,
    preset,
    required,
)


class WalkToSection(Section):
    """Walk to a place, with what the hands hold."""

    position: Annotated[Vector2, FrameMoves.POINT] = required("where to stand, x and y [m]")
    heading_deg: Annotated[Number, FrameMoves.HEADING] = preset(0.0, "where to face [deg]")


class ReachSection(Section):
    """Bring a hand to a point, the feet where they are."""

    position: Annotated[Vector3, FrameMoves.POINT] = required("where the middle of the palm goes [m]")
    hand: Literal["left", "right"] = preset("right", "which hand")


class GraspSection(Section):
    """Lay both palms on the sides of an object, the feet where they are."""

    object: Text = required("name of an obstacle with mass_kg")


class LiftSection(Section):
    """Raise what is grasped, straight up."""

    object: Text = required("name of the object in the hands")
    height_m: Positive = preset(0.1, "by how much [m]")


class CarrySection(Section):
    """Draw what is lifted close before the trunk, and walk with it to a place where one is given."""

    object: Text = required("name of the object in the hands")
    position: Annotated[Vector2 | None, FrameMoves.POINT] = optional("where to walk then, x and y [m]")
    heading_deg: Annotated[Number | None, FrameMoves.HEADING] = optional("where to face there [deg]")


class PlaceSection(Section):
    """Set the object down on something and let go of it."""

    object: Text = required("name of the object in the hands")
    on: Text = required("name of an obstacle with a level top")
    at: Annotated[Vector2 | None, FrameMoves.POINT] = optional(
        "where on it, x and y [m] (default: straight ahead, as near as its top allows)"
    )


class ForceSection(Section):
    """Step before an object and exert a level force on it with both hands; it does not move."""

    on: Text = required("name of an obstacle")
    direction: Annotated[Vector3, FrameMoves.DIRECTION] = required(
        "where the force on the object points; level"
    )
    force_N: Positive = required("force on the object [N]")
    ramp_s: Positive = preset(1.0, "time in which the force rises from none [s]")


class SitSection(Section):
    """Walk to a seat and sit down on it."""

    on: Text = required("name of an obstacle to sit on")
    heading_deg: Annotated[Number | None, FrameMoves.HEADING] = optional(
        "where to face [deg] (default: as the body faces)"
    )


class StandUpSection(Section):
    """Rise from the seat."""


class OperationSection(OneOf):
    """One operation: exactly one of the keys."""

    walk_to: WalkToSection | None = optional("walk to a place, with what the hands hold")
    reach: ReachSection | None = optional("bring a hand to a point")
    grasp: GraspSection | None = optional("lay both palms on an object")
    lift: LiftSection | None = optional("raise what is grasped")
    carry: CarrySection | None = optional("draw what is lifted to the trunk, and walk with it")
    place: PlaceSection | None = optional("set the object down and let go")
    push: ForceSection | None = optional("press with both palms; the last operation")
    pull: ForceSection | None = optional("hold on with both hands and draw; the last operation")
    sit: SitSection | None = optional("walk to a seat and sit down")
    stand: StandUpSection | None = optional("rise from the seat")


class TaskSection(Section):
    """From where to where, and what is done there."""

    start: StateSection = required("state at the beginning, at rest")
    goal: StateSection = required(
        "state at the end, at rest; found, and may be left out, with an act or operations and no supports"
    )
    act: ActSection | None = optional(
        "what the hands do to an object at the end; where to stand for it is found"
    )
    operations: list[OperationSection] | None = Field(
        default=None, min_length=1,
        description="what a person does one after the other; the goal is found, and left out",
    )  # fmt: skip
    pace: Literal["slow", "comfortable", "brisk"] = preset(
        "comfortable", "how fast a body goes on its feet between contacts that are found"
    )

    @model_validator(mode="before")
    @classmethod
    def _goal_of_act(cls, data: Any) -> Any:
        """Leave the goal of an act, or of operations, to the planner."""
        found = isinstance(data, dict) and any(data.get(key) is not None for key in ("act", "operations"))
        if found and "goal" not in data and "start" in data:
            return {**data, "goal": data["start"]}
        return data


MOVABLE = ("grasp", "lift", "carry", "place")
"""Operations on an object in the hands, in the order in which they follow one another."""


def refused_operations(
    operations: Sequence[OperationSection], scene: Sequence[ObstacleSection], seated: bool
) -> Iterator[tuple[str, str]]:
    """What is wrong with a list of operations: the key within ``task`` and the problem, in order.

    Args:
        operations: One after the other.
        scene: What there is.
        seated: Whether the body sits at the start.
    """
    things = {item.name: item for item in scene}
    held, done = None, ""  # the object in the hands, and the last operation on it
    for number, operation in enumerate(operations):
        name, content, key = operation.name, operation.content, f"operations[{number}].{operation.name}"
        for field in ("object", "on"):
            thing = getattr(content, field, None)
            if thing is not None and thing not in things:
                known = ", ".join(things) or "it has none"
                yield f"{key}.{field}", f"is {thing!r}; valid: the name of an obstacle of the scene ({known})"
                return
        if seated and name != "stand":
            yield key, "follows a seat; valid: stand first"
        if not seated and name == "stand":
            yield key, "is asked of a body that stands; valid: after sit, or with a start that is seated"
        if name in MOVABLE:
            thing = things[content.object]
            if thing.box is None or thing.mass_kg is None or any(thing.rpy_deg[:2]):
                yield f"{key}.object", f"is {thing.name!r}; valid: an upright box with mass_kg"
            before = {"grasp": ("",), "lift": ("grasp",), "carry": ("lift", "carry"), "place": MOVABLE[1:3]}
            if done not in before[name] or (held is not None and held != content.object):
                hands = f"holds {held!r} after {done}" if held else "has empty hands"
                yield key, f"is asked of a body that {hands}; valid: grasp, lift, carry, place in that order"
            held, done = (None, "") if name == "place" else (content.object, name)
        elif held is not None and (name != "walk_to" or done == "grasp"):
            yield key, f"comes while the hands hold {held!r}; valid: place it before"
        if name in ("push", "pull") and number < len(operations) - 1:
            yield key, "is followed by another operation; valid: the last one"
        seated = name == "sit"
    if held is not None:
        yield "operations", f"end with {held!r} in the hands; valid: place it at last"
