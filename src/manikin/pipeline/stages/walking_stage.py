"""Walking stage: ways over the floor, then recorded people's motion along them, with its forces and margins.

Walks that are executed are those of :mod:`~manikin.pipeline.stages.walking_execution`.
"""

import math
import time as clock
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin import walking
from manikin.balance import wrench_polytopes
from manikin.balance.motion_forces import full_motion
from manikin.contact import Contact, ContactSchedule, default_normal_force_cap, sole
from manikin.contact.from_motion import schedule_of_support
from manikin.errors import BodyError, InputError, ScenarioError
from manikin.motion import Motion
from manikin.numerics.signals import low_passed
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import BODY, WALK_PATHS, other_motion
from manikin.pipeline.stages.context import Report, RunContext
from manikin.recordings.dynamics.recorded_dynamics import MOTION_CUTOFF
from manikin.runtime.requirement import Requirement, RequirementTable, requirement_table
from manikin.scenarios import Scenario
from manikin.scenarios.sections.task_sections import StandSection, WalkerSection, WalkingSection
from manikin.scenarios.validation import KeyPath
from manikin.walking import Walk, WalkRoute, Waypoint
from manikin.walking.path.walk_obstacles import clearance
from manikin.walking.path.walking_path import TOLERANCE, SampledWalk

FRICTION = 0.8
"""Coefficient of friction of the soles of a walker."""


def walked_motion(walk: Walk, height: float) -> tuple[ContactSchedule, Motion]:
    """Supports of a walk in time, and its motion with what the ground, at a height [m], has to do for it.

    The motion is that of recorded people, carried over to another body, so that its margin may be negative
    and its torques may leave a rest on the pelvis: both say how far this body is from walking like that.
    Velocities are low-passed as those of recordings are, since accelerations follow from them.
    """
    schedule, motion = walked_schedule(walk, height), walk.motion
    polytopes = wrench_polytopes([phase.stance for phase in schedule.sequence])
    rate = (len(motion.time) - 1) / motion.duration
    v = low_passed(motion.v, MOTION_CUTOFF, rate, padding=9)
    a = np.gradient(v, 1.0 / rate, axis=0)
    full, _ = full_motion(walk.body, schedule, polytopes, motion.time, motion.q, v, a)
    return schedule, full


def walked_schedule(walk: Walk, height: float) -> ContactSchedule:
    """Whole soles where the feet are in the middle of each support, level on a floor of a height [m]."""
    body = walk.body
    if body.sole_length is None or body.sole_width is None:
        raise BodyError(f"body {body.name!r} has no soles; valid: a human")
    contacts: dict[tuple[int, int], Contact] = {}
    for foot, name in enumerate(walk.feet):
        for item in walk.supports(foot):
            size = {"length": body.sole_length, "width": body.sole_width}
            made = sole(name, (item.x, item.y, height), item.yaw, **size, friction=FRICTION)
            contacts |= dict.fromkeys(((foot, row) for row in range(item.first, item.stop)), made)
    cap = default_normal_force_cap(body.mass)
    return schedule_of_support(walk.time, walk.support, lambda *touching: contacts[touching], cap)


WHOLE = walking.Walker(depth=0.4, width=0.66)
"""Extent of a body that is executed: its trunk, swaying, with its arms drawn in, and its feet. Where it has
no way, the extent of the shoulders alone is kept, and what the body meets is measured."""

STAGE = "walk"
PATH_EVERY = 5
"""Instants of a route for each one that is kept."""
CLOCK = 0.01
"""Step of the common clock on which distances of walkers are measured [s]."""
ROOM_TOLERANCE = 1e-3
"""The path keeps its room at the instants of its optimisation; between them it may miss this much [m]."""
STANCE_SLIDE = 1e-3
"""A foot on the ground moves by at most this, as a planned support does [m]."""
OBJECTIVES = {
    "prose": walking.PROSE_ORDER, "literal": walking.LITERAL_ORDER,
    "recorded": walking.RECORDED_WALKS, "recorded-turns": walking.RECORDED_TURNS,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PlannedWalks:
    """Routes of the body and, by name, of the others who walk in a scenario.

    Attributes:
        obstacles: What stands there, and the others.
        wall_s: Time in which the body's own route was found [s].
        whole: Whether that route keeps room for the whole of the body, see :data:`WHOLE`.
    """

    route: WalkRoute
    others: dict[str, WalkRoute]
    obstacles: tuple[walking.WalkObstacle, ...]
    wall_s: float
    whole: bool = False


def walk_to_goal(context: RunContext, report: Report) -> Motion | None:
    """Find the routes of all walkers of a scenario, and walk them; None where there is none."""
    plan = plan_walks(context)
    if not ways_found(report, plan):
        return None
    height, block = context.scene.floor_height or 0.0, path_block(plan)
    began = clock.perf_counter()
    walk = walking.walk_along(plan.route, context.body, height=height)
    block |= {
        "motion_s": float(walk.time[-1]),
        "steps": int(np.sum(np.diff(walk.support.astype(np.int64), axis=0) == 1)),
        "max_stance_slide_m": float(walk.slides.max(initial=0.0)),
        "max_stance_slide_before_m": float(walk.slides_before.max(initial=0.0)),
        "outside_library_share": float(np.mean(walk.outside)),
        "motion_wall_ms": 1e3 * (clock.perf_counter() - began),
    }
    schedule, motion = walked_motion(walk, height)
    balanced = float(np.mean(motion.margin >= 0.0))
    block |= {"min_margin": float(motion.margin.min()), "margin_unit": motion.margin_unit}
    report.finish(STAGE, block | {"balanced_share": balanced})
    report.require(STAGE, _requirements(context, plan, walk))
    report.planned = True
    report.keep_motions(schedule, motion)
    walk_others(context, report, plan)
    return motion


def ways_found(report: Report, plan: PlannedWalks) -> bool:
    """Keep the ways of all walkers; whether everybody has one, else the run has failed."""
    keep_paths(report, plan, plan.route)
    report.progress(STAGE, 0.5)
    for name, route in plan.others.items():
        if not route.succeeded:
            report.fail(STAGE, f"way of {name}: {route.failure}", where=name)
    if not plan.route.succeeded:
        report.fail(STAGE, plan.route.failure or "", plan.route.begins[-1], "way of the body")
    if report.failure is not None:
        report.finish(STAGE, path_block(plan))
    return report.failure is None


def walk_others(context: RunContext, report: Report, plan: PlannedWalks) -> None:
    """Keep the motions of all others who walk there: recorded people's, to be watched."""
    height = context.scene.floor_height or 0.0
    for number, (name, route) in enumerate(plan.others.items(), 1):
        walked = walked_motion(walking.walk_along(route, context.body, height=height), height)
        report.keep_motions(*walked, file=other_motion(name))
        report.progress(STAGE, 0.6 + 0.4 * number / len(plan.others))
    report.progress(STAGE, 1.0)


def plan_walks(
    context: RunContext, start: FloatArray | None = None, goal: FloatArray | None = None, *,
    further: float = 0.0,
) -> PlannedWalks:  # fmt: skip
    """Find a route for every walker, each around those before.

    That of a body that is executed keeps room for the whole of it where it can, see :data:`WHOLE`.

    Args:
        start: (3,) x, y [m], heading [rad] of the body; that of the task if omitted.
        goal: The same at the end.
        further: Room for the whole of a body that is executed, beyond that of the scenario [m].

    Raises:
        ScenarioError: If a route is impossible: no floor, a start in an obstacle, a useless waypoint.
    """
    scenario, section = context.scenario, _section(context.scenario)
    with scenario.refusing(("scene",)):
        standing = walking.floor_plan(context.scene, context.body.stature or 2.0)
    objective, radius = OBJECTIVES[section.weights], walking.Walker().width / 2
    obstacles, others = list(standing), {}

    def route_of(
        key: KeyPath, who: WalkingSection | WalkerSection, begin: FloatArray, *goal: Waypoint,
        walker: walking.Walker | None = None, further: float = 0.0,
    ) -> WalkRoute:  # fmt: skip
        stops = [*(Waypoint(place_of(stop), stop.speed_m_s, stop.wait_s) for stop in who.via), *goal]
        with scenario.refusing(key):
            return walking.walking_route(
                begin, stops, objective, obstacles=obstacles, walker=walker,
                room=section.room_m + further, max_speed=who.max_speed_m_s, wait=who.wait_s,
            )  # fmt: skip

    for number, other in enumerate(section.others):
        other_route = route_of(("walking", "others", number), other, place_of(other.start))
        others[other.name] = other_route
        if other_route.succeeded:
            obstacles.append(other_route.as_obstacle(other.name, radius))
    began = clock.perf_counter()
    start = end_of(scenario, "start") if start is None else start
    goal = end_of(scenario, "goal") if goal is None else goal
    route = None
    if section.whole_body == "balanced":
        with suppress(ScenarioError):  # an end leaves no room for it
            route = route_of(("walking",), section, start, Waypoint(goal), walker=WHOLE, further=further)
    whole = route is not None and route.succeeded
    if route is None or not whole:
        route = route_of(("walking",), section, start, Waypoint(goal))
    return PlannedWalks(route, others, tuple(obstacles), clock.perf_counter() - began, whole)


def _section(scenario: Scenario) -> WalkingSection:
    if scenario.file.walking is None:
        raise InputError(f"scenario {scenario.name!r} has no walk; valid: one with walking")
    return scenario.file.walking


def keep_paths(report: Report, plan: PlannedWalks, walk: SampledWalk) -> None:
    """Keep the routes of all walkers among the files of the run: instants [s], x, y [m], headings [rad].

    Args:
        walk: The body's own, in the time in which it is walked.
    """
    kept, transform = {}, report.transform
    for name, route in {BODY: walk, **plan.others}.items():
        place = route.place[::PATH_EVERY]
        place = np.column_stack([transform.points(place[:, :2]), place[:, 2] + transform.yaw])
        kept[name] = {"time_s": route.time[::PATH_EVERY], "place": place}
    report.keep(WALK_PATHS, kept)


def end_of(scenario: Scenario, end: str) -> FloatArray:
    """(3,) x, y [m], heading [rad] of an end of the task."""
    state = getattr(scenario.file.task, end)
    return np.array([*state.at, math.radians(state.heading_deg or 0.0)])


def place_of(stand: StandSection) -> FloatArray:
    """(3,) x, y [m], heading [rad] of a place in a file."""
    return np.array([*stand.at, math.radians(stand.heading_deg)])


def path_block(plan: PlannedWalks, walk: SampledWalk | None = None) -> dict[str, Any]:
    """Block of the summary about the route itself, and how near others come to it.

    Args:
        walk: The route in the time in which it is walked; its own if omitted.
    """
    walk = plan.route if walk is None else walk
    route, forward, left = plan.route, *np.abs(plan.route.velocity[:, :2]).max(axis=0)
    parts = route.segments().segments
    others = {
        name: {"duration_s": other.duration, "path_length_m": other.length} | _closest(walk, other)
        for name, other in plan.others.items()
    }
    return {
        "duration_s": route.duration, "path_length_m": route.length, "cost": route.cost,
        "max_forward_mps": float(forward), "max_left_mps": float(left),
        "segments": [{"kind": item.kind, "start_s": item.start, "end_s": item.end} for item in parts],
        "min_room_m": room_of(plan, walk), "others": others, "path_wall_ms": 1e3 * plan.wall_s,
    }  # fmt: skip


def _closest(route: SampledWalk, other: WalkRoute) -> dict[str, float]:
    """Least distance of two ways' middles on the common clock [m], and when it is reached first [s]."""
    time = np.arange(0.0, max(route.duration, other.duration) + CLOCK, CLOCK)
    away = np.linalg.norm((route.place_at(time) - other.place_at(time))[:, :2], axis=1)
    nearest = int(np.argmin(away))
    return {"closest_m": float(away[nearest]), "closest_at_s": float(time[nearest])}


def room_of(plan: PlannedWalks, walk: SampledWalk) -> float | None:
    """Least distance of the walker's discs from anything [m], measured densely; None where nothing is.

    Args:
        walk: On the plan's route, in its own time.
    """
    room = clearance(plan.obstacles, walking.Walker(), walk.place, walk.time)
    return float(room.min()) if room.size else None


def room_requirement(context: RunContext, room: float) -> Requirement:
    """That a walk keeps its room to all who walk and what stands there."""
    return Requirement("min_room_m", "room to obstacles and others", "m", room, ">=",
                       _section(context.scenario).room_m, tolerance=ROOM_TOLERANCE)  # fmt: skip


def _requirements(context: RunContext, plan: PlannedWalks, walk: Walk) -> RequirementTable:
    """Requirements of a walk that is not executed: its ends, speed, clearance, and feet that stand still."""
    section, route = _section(context.scenario), plan.route
    ends = np.abs(route.place[[0, -1]] - [end_of(context.scenario, end) for end in ("start", "goal")])
    ends[:, 2] = np.abs(np.angle(np.exp(1j * ends[:, 2])))
    speed = np.hypot(*route.velocity[:, :2].T)
    fastest, room = int(np.argmax(speed)), room_of(plan, route)
    return requirement_table([
        Requirement("end_error", "distance of the path from start and goal", "m, rad", float(ends.max()),
                    "<=", 0.0, tolerance=TOLERANCE),
        Requirement("max_speed_mps", "speed of the path", "m/s", float(speed[fastest]), "<=",
                    section.max_speed_m_s, float(route.time[fastest]), tolerance=TOLERANCE),
        None if room is None else room_requirement(context, room),
        Requirement("max_stance_slide_m", "slide of a foot on the ground", "m",
                    float(walk.slides.max(initial=0.0)), "<=", STANCE_SLIDE),
    ])  # fmt: skip
