"""Walking stage: ways over the floor, then the whole body along them.

A recorded walk follows the way with its supports, forces and margins. A planned walk puts footprints along
it, for the stages that follow.
"""

import math
import time as clock
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin import walking
from manikin.balance import wrench_polytopes
from manikin.balance.motion_forces import full_motion
from manikin.contact import Contact, ContactSchedule, default_normal_force_cap, sole
from manikin.contact.from_motion import schedule_of_support
from manikin.errors import BodyError, InputError
from manikin.motion import Motion
from manikin.numerics.signals import low_passed
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import BODY, WALK_PATHS, other_motion
from manikin.pipeline.stages.context import Report, RunContext
from manikin.recordings.dynamics.recorded_dynamics import MOTION_CUTOFF
from manikin.runtime.requirement import Requirement, RequirementTable, requirement_table
from manikin.scenarios import Scenario
from manikin.scenarios.planned import walk_before, walking_supports
from manikin.scenarios.sections.task_sections import StandSection, WalkerSection, WalkingSection
from manikin.scenarios.validation import KeyPath
from manikin.scenarios.world import flat_sequence
from manikin.walking import Walk, WalkRoute, Waypoint
from manikin.walking.footprints import FEET
from manikin.walking.path.walk_obstacles import clearance
from manikin.walking.path.walking_path import TOLERANCE
from manikin.walking.stepper import walked_supports

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
        for item in walked_supports(walk, foot):
            size = {"length": body.sole_length, "width": body.sole_width}
            made = sole(name, (item.x, item.y, height), item.yaw, **size, friction=FRICTION)
            contacts |= dict.fromkeys(((foot, row) for row in range(item.first, item.stop)), made)
    cap = default_normal_force_cap(body.mass)
    return schedule_of_support(walk.time, walk.support, lambda *touching: contacts[touching], cap)


def walk_on_footprints(context: RunContext, report: Report) -> RunContext | None:
    """Put footprints along the way of a walking scenario; None where there is no way.

    With supports the walk leads from ``walking.start`` to the feet of their first phase, without them from
    start to goal.

    Raises:
        ScenarioError: If the way cannot be asked for, or its end does not fit the first phase.
    """
    scenario = context.scenario
    stance = None if scenario.file.supports is None else _first_stance(scenario)
    start, goal = _ends(scenario, stance)
    plan = plan_walks(context, start, goal)
    keep_paths(report, plan)
    if not plan.route.succeeded:
        report.fail(STAGE, plan.route.failure or "", where="way of the body")
        report.finish(STAGE, path_block(plan))
        return None
    path, bare = plan.route.legs[0], scenario.replaced(walking=None)
    rule = walking.StepRule().scaled(context.body.stature or 1.75)
    height = context.scene.floor_height or 0.0
    with scenario.refusing(("walking",)):
        if stance is not None:
            (left, _), (right, _) = (stance[foot] for foot in FEET)
            rule = replace(rule, standing_width=float(np.hypot(*(left - right)[:2])))
            choices = [walking.place_footprints(path, rule, first=first, height=height) for first in FEET]
            walked = walk_before(footprints := _ending_for(scenario, choices), bare)
        else:
            footprints = walking.place_footprints(path, rule, height=height)
            if _section(scenario).footprints == "library":  # where the feet of the library's walk stand
                walk = walking.walk_along(path, context.body, height=height)
                footprints = walking.walked_footprints(walk, rule, height=height)
            walked = walking_supports(footprints, bare)
    report.finish(STAGE, path_block(plan) | {"steps": footprints.count})
    report.keep_scenario(walked)
    return replace(context, body=walked.build_body()).with_supports(walked)


def _ends(scenario: Scenario, stance: dict[str, tuple[FloatArray, float]] | None) -> tuple[FloatArray, ...]:
    """(3,) places from where to where the body walks."""
    section = scenario.file.walking
    if stance is None or section is None or section.start is None:
        return end_of(scenario, "start"), end_of(scenario, "goal")
    middle = np.mean([position[:2] for position, _ in stance.values()], axis=0)
    turns = np.exp(1j * np.array([yaw for _, yaw in stance.values()]))
    return place_of(section.start), np.append(middle, np.angle(turns.sum()))


def _first_stance(scenario: Scenario) -> dict[str, tuple[FloatArray, float]]:
    """Position [m] and yaw [rad] of each foot in the first phase of the supports."""
    held = {contact.effector: contact for contact in flat_sequence(scenario)[0].stance}
    missing = [foot for foot in FEET if foot not in held]
    if missing:
        lacks = f"has no {missing[0]}; valid for a walk to it: both feet"
        raise scenario.error(("supports", "phases", 0), lacks)
    return {foot: (held[foot].position, held[foot].yaw) for foot in FEET}


def _ending_for(scenario: Scenario, choices: list[walking.Footprints]) -> walking.Footprints:
    """Walk whose last step is that of the foot that stays in the next phase; the shorter of two."""
    phases = scenario.explicit_supports().resolved_phases()
    stays = [foot for foot in FEET if len(phases) > 1 and phases[1].get(foot) == phases[0][foot]]
    fitting = [one for one in choices if one.steps[-1].effector in stays] or choices
    return min(fitting, key=lambda one: one.end - one.start)


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
    """

    route: WalkRoute
    others: dict[str, WalkRoute]
    obstacles: tuple[walking.WalkObstacle, ...]
    wall_s: float


def walk_to_goal(context: RunContext, report: Report) -> Motion | None:
    """Find the routes of all walkers of a scenario, and walk them; None where there is none."""
    plan = plan_walks(context)
    keep_paths(report, plan)
    report.progress(STAGE, 0.5)
    height, block = context.scene.floor_height or 0.0, path_block(plan)
    for name, route in plan.others.items():
        if not route.succeeded:
            report.fail(STAGE, f"way of {name}: {route.failure}", where=name)
    if not plan.route.succeeded:
        report.fail(STAGE, plan.route.failure or "", plan.route.begins[-1], "way of the body")
    if report.failure is not None:
        report.finish(STAGE, block)
        return None
    began = clock.perf_counter()
    walk = walking.walk_along(plan.route, context.body, height=height)
    block |= {
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
    for number, (name, route) in enumerate(plan.others.items(), 1):
        walked = walked_motion(walking.walk_along(route, context.body, height=height), height)
        report.keep_motions(*walked, file=other_motion(name))
        report.progress(STAGE, 0.6 + 0.4 * number / len(plan.others))
    report.progress(STAGE, 1.0)
    return motion


def plan_walks(
    context: RunContext, start: FloatArray | None = None, goal: FloatArray | None = None
) -> PlannedWalks:
    """Find a route for every walker, each around those before.

    Args:
        start: (3,) x, y [m], heading [rad] of the body; that of the task if omitted.
        goal: The same at the end.

    Raises:
        ScenarioError: If a route is impossible: no floor, a start in an obstacle, a useless waypoint.
    """
    scenario, section = context.scenario, _section(context.scenario)
    with scenario.refusing(("scene",)):
        standing = walking.floor_plan(context.scene, context.body.stature or 2.0)
    objective, radius = OBJECTIVES[section.weights], walking.Walker().width / 2
    obstacles, others = list(standing), {}

    def route_of(
        key: KeyPath, who: WalkingSection | WalkerSection, begin: FloatArray, *goal: Waypoint
    ) -> WalkRoute:
        stops = [*(Waypoint(place_of(stop), stop.speed_m_s, stop.wait_s) for stop in who.via), *goal]
        with scenario.refusing(key):
            return walking.walking_route(
                begin, stops, objective, obstacles=obstacles, room=section.room_m,
                max_speed=who.max_speed_m_s, wait=who.wait_s,
            )  # fmt: skip

    for number, other in enumerate(section.others):
        other_route = route_of(("walking", "others", number), other, place_of(other.start))
        others[other.name] = other_route
        if other_route.succeeded:
            obstacles.append(other_route.as_obstacle(other.name, radius))
    began = clock.perf_counter()
    start = end_of(scenario, "start") if start is None else start
    goal = end_of(scenario, "goal") if goal is None else goal
    route = route_of(("walking",), section, start, Waypoint(goal))
    return PlannedWalks(route, others, tuple(obstacles), clock.perf_counter() - began)


def _section(scenario: Scenario) -> WalkingSection:
    if scenario.file.walking is None:
        raise InputError(f"scenario {scenario.name!r} has no walk; valid: one with walking")
    return scenario.file.walking


def keep_paths(report: Report, plan: PlannedWalks) -> None:
    """Keep the routes of all walkers among the files of the run: instants [s], x, y [m], headings [rad]."""
    kept, transform = {}, report.transform
    for name, route in {BODY: plan.route, **plan.others}.items():
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


def path_block(plan: PlannedWalks) -> dict[str, Any]:
    """Block of the summary about the route itself."""
    route, forward, left = plan.route, *np.abs(plan.route.velocity[:, :2]).max(axis=0)
    parts = route.segments().segments
    others = {
        name: {"duration_s": other.duration, "path_length_m": other.length} | _closest(route, other)
        for name, other in plan.others.items()
    }
    return {
        "duration_s": route.duration, "path_length_m": route.length, "cost": route.cost,
        "max_forward_mps": float(forward), "max_left_mps": float(left),
        "segments": [{"kind": item.kind, "start_s": item.start, "end_s": item.end} for item in parts],
        "min_room_m": _room(plan), "others": others, "path_wall_ms": 1e3 * plan.wall_s,
    }  # fmt: skip


def _closest(route: WalkRoute, other: WalkRoute) -> dict[str, float]:
    """Least distance of two ways' middles on the common clock [m], and when it is reached first [s]."""
    time = np.arange(0.0, max(route.duration, other.duration) + CLOCK, CLOCK)
    away = np.linalg.norm((route.place_at(time) - other.place_at(time))[:, :2], axis=1)
    nearest = int(np.argmin(away))
    return {"closest_m": float(away[nearest]), "closest_at_s": float(time[nearest])}


def _room(plan: PlannedWalks) -> float | None:
    """Least distance of the walker's discs from anything [m], measured densely; None where nothing is."""
    room = clearance(plan.obstacles, walking.Walker(), plan.route.place, plan.route.time)
    return float(room.min()) if room.size else None


def _requirements(context: RunContext, plan: PlannedWalks, walk: Walk) -> RequirementTable:
    """Requirements of a walk that is not executed: its ends, speed, clearance, and feet that stand still."""
    section, route = _section(context.scenario), plan.route
    ends = np.abs(route.place[[0, -1]] - [end_of(context.scenario, end) for end in ("start", "goal")])
    ends[:, 2] = np.abs(np.angle(np.exp(1j * ends[:, 2])))
    speed = np.hypot(*route.velocity[:, :2].T)
    fastest, room = int(np.argmax(speed)), _room(plan)
    return requirement_table([
        Requirement("end_error", "distance of the path from start and goal", "m, rad", float(ends.max()),
                    "<=", 0.0, tolerance=TOLERANCE),
        Requirement("max_speed_mps", "speed of the path", "m/s", float(speed[fastest]), "<=",
                    section.max_speed_m_s, float(route.time[fastest]), tolerance=TOLERANCE),
        None if room is None
        else Requirement("min_room_m", "room to obstacles and others", "m", room, ">=", section.room_m,
                         tolerance=ROOM_TOLERANCE),
        Requirement("max_stance_slide_m", "slide of a foot on the ground", "m",
                    float(walk.slides.max(initial=0.0)), "<=", STANCE_SLIDE),
    ])  # fmt: skip
