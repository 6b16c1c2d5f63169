"""The walking stage: ways over the floor, then the whole body along them."""

import math
import time as clock
from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError
from manikin.locomotion import (
    LITERAL_ORDER,
    PROSE_ORDER,
    Walker,
    WalkObjective,
    WalkObstacle,
    WalkRoute,
    Waypoint,
    floor_plan,
    walking_route,
)
from manikin.scenarios import Scenario
from manikin.scenarios.sections import StandSection, WalkingSection, WaypointSection
from manikin.scenarios.validation import Path as KeyPath
from manikin.spatial import FloatArray
from manikin.stages.context import RunContext

STAGE = "walk"

OBJECTIVES = {"prose": PROSE_ORDER, "literal": LITERAL_ORDER}


@dataclass(frozen=True, eq=False)
class PlannedWalks:
    """Ways of all who walk in a scenario.

    Attributes:
        route: Of the scenario's body.
        others: Of the others, by name.
        obstacles: What stands there, and the others.
        wall_s: Time in which the body's own route was found [s].
    """

    route: WalkRoute
    others: dict[str, WalkRoute]
    obstacles: tuple[WalkObstacle, ...]
    wall_s: float


def plan_walks(context: RunContext) -> PlannedWalks:
    """Find a way for everyone, each around those before.

    Args:
        context: Of a scenario with a ``walking`` section.

    Raises:
        ScenarioError: If a way cannot be asked for: no floor, a start in an obstacle, a waypoint in vain.
    """
    scenario, section = context.scenario, _section(context.scenario)
    try:
        standing = floor_plan(context.scene, context.body.stature)
    except InputError as error:
        raise scenario.refused(("scene",), error) from None
    objective, radius = OBJECTIVES[section.weights], Walker().width / 2
    obstacles, others = list(standing), {}
    for number, other in enumerate(section.others):
        key: KeyPath = ("walking", "others", number)
        stops = [_waypoint(one) for one in other.via]
        others[other.name] = _route(
            scenario, key, _place(other.start), stops, objective, obstacles, section.room_m,
            other.max_speed_m_s, other.wait_s,
        )  # fmt: skip
        obstacles.append(others[other.name].as_obstacle(other.name, radius))
    began = clock.perf_counter()
    start, goal = (_end(scenario, end) for end in ("start", "goal"))
    stops = [*map(_waypoint, section.via), Waypoint(goal)]
    route = _route(
        scenario, ("walking",), start, stops, objective, obstacles, section.room_m, section.max_speed_m_s,
        section.wait_s,
    )  # fmt: skip
    return PlannedWalks(route, others, tuple(obstacles), clock.perf_counter() - began)


def _section(scenario: Scenario) -> WalkingSection:
    if scenario.walking is None:
        raise InputError(f"scenario {scenario.name!r} has no walk; valid: one with walking")
    return scenario.walking


def _route(
    scenario: Scenario,
    key: KeyPath,
    start: FloatArray,
    stops: list[Waypoint],
    objective: WalkObjective,
    obstacles: list[WalkObstacle],
    room: float,
    max_speed: float,
    wait: float,
) -> WalkRoute:
    try:
        return walking_route(
            start, stops, objective, obstacles=obstacles, room=room, max_speed=max_speed, wait=wait
        )
    except InputError as error:
        raise scenario.refused(key, error) from None


def _end(scenario: Scenario, end: str) -> FloatArray:
    """(3,) place of an end of the task."""
    state = getattr(scenario.file.task, end)
    return np.array([*state.at, math.radians(state.heading_deg or 0.0)])


def _place(stand: StandSection) -> FloatArray:
    return np.array([*stand.at, math.radians(stand.heading_deg)])


def _waypoint(section: WaypointSection) -> Waypoint:
    return Waypoint(_place(section), section.speed_m_s, section.wait_s)
