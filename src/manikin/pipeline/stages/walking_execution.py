"""Walking stage of walks that are executed: on people's footprints, in balance, in the physics engine."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from manikin import walking
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.context import Report, RunContext
from manikin.pipeline.stages.execution_stage import ExecutionRequirements, PlannedMotion, execute_motion
from manikin.pipeline.stages.walking_stage import (
    FRICTION,
    STAGE,
    PlannedWalks,
    keep_paths,
    path_block,
    place_of,
    plan_walks,
    room_requirement,
    walk_others,
    ways_found,
)
from manikin.runtime.requirement import Requirement, requirement_table
from manikin.scenarios.world import flat_sequence
from manikin.scene import Scene
from manikin.scene.distance import Proximity, segment_of
from manikin.simulation import Execution
from manikin.walking.foot_room import FootRoom
from manikin.walking.footprints import FEET, Footprints
from manikin.walking.gait.balanced_walk import BalancedWalk, balanced_walk
from manikin.walking.path.walk_obstacles import in_the_way
from manikin.walking.stepper import SteppedPath

REACHED = 2e-3
"""A foot is where it should be when its ankle is this near to its place [m]."""

BEYOND = float(np.radians(1.0))
"""Most that a hinge of the plan may be beyond its range, where it is cut off [rad]."""

CLEAR = 0.01
"""Least distance of any part of the body from what stands there [m], for what the execution differs."""

AGAIN, SPARE = 2, 0.02
"""How often a walk that comes too near to something is tried again with more room, and with how much more
room than it lacked [m]."""

PLACES = {"missed_m": "legs", "beyond_range_rad": "legs", "min_room_m": "way of the body"}
"""What the requirements of a walk are about."""


@dataclass(frozen=True, eq=False)
class ExecutedWalk:
    """A walk as planned and as executed; None of what there was not."""

    planned: Motion | None = None
    execution: Execution | None = None


def walk_in_balance(context: RunContext, report: Report, requirements: ExecutionRequirements) -> ExecutedWalk:
    """Find the way of a walking scenario, walk it on people's footprints in balance, and execute that."""
    found = _walked(context, report, lambda further: (plan_walks(context, further=further), None))
    if found is None:
        return ExecutedWalk()
    walk = found.walk
    report.keep_motions(walk.schedule, walk.motion)
    report.planned = report.failure is None
    if report.failure is not None or not context.scenario.execution_required:
        return ExecutedWalk(walk.motion)
    execution = execute_motion(context, report, found.planned, requirements)
    report.judge()
    return ExecutedWalk(walk.motion, execution)


def way_before(context: RunContext, further: float = 0.0) -> tuple[PlannedWalks, dict[str, FloatArray]]:
    """The way to the first phase of a scenario's supports, and (3,) x, y [m], yaw [rad] of its feet.

    ``further`` is that of :func:`plan_walks`.

    Raises:
        ScenarioError: If the way cannot be asked for, or the supports do not begin on both feet.
    """
    scenario, section = context.scenario, context.scenario.file.walking
    stance = {contact.effector: contact for contact in flat_sequence(scenario)[0].stance}
    if missing := [foot for foot in FEET if foot not in stance]:
        lacks = f"has no {missing[0]}; valid for a walk to it: both feet"
        raise scenario.error(("supports", "phases", 0), lacks)
    ends = {foot: np.append(stance[foot].position[:2], stance[foot].yaw) for foot in FEET}
    places = np.array(list(ends.values()))
    goal = np.append(places[:, :2].mean(axis=0), np.angle(np.exp(1j * places[:, 2]).sum()))
    start = None if section is None or section.start is None else place_of(section.start)
    return plan_walks(context, start, goal, further=further), ends


def walk_before(context: RunContext, report: Report, planned: PlannedMotion) -> PlannedMotion:
    """The walk to a motion on supports, and the motion; this alone where the scenario has no walk.

    The walk comes to rest in the first posture of the motion.
    """
    if context.scenario.file.walking is None or report.failure is not None:
        return planned
    found = _walked(context, report, partial(way_before, context), planned.motion.q[0])
    if found is None or report.failure is not None:
        report.planned = False
        return planned
    for stage in ("centroidal", "wholebody"):
        report.require(stage, report.table(stage).later(found.walk.motion.duration))
    whole = found.planned.then(planned)
    report.keep_motions(whole.schedule, whole.motion)
    return whole


@dataclass(frozen=True, eq=False)
class _TriedWalk:
    """A walk on a planned way, and that it meets nothing that stands there, or None where nothing does."""

    plan: PlannedWalks
    stepped: SteppedPath
    walk: BalancedWalk
    beside: Requirement | None
    room: FootRoom

    @property
    def planned(self) -> PlannedMotion:
        """The walk, ready to be executed."""
        motion = self.walk.motion
        return PlannedMotion(self.walk.schedule, motion, walked=float(motion.time[-1]), room=self.room)

    @property
    def lack(self) -> float:
        """How much nearer it comes to something than it may [m]."""
        return 0.0 if self.beside is None else max(self.beside.limit - self.beside.measured, 0.0)


def _walked(
    context: RunContext, report: Report,
    find: Callable[[float], tuple[PlannedWalks, Mapping[str, FloatArray] | None]],
    last: FloatArray | None = None,
) -> _TriedWalk | None:  # fmt: skip
    """The walk in balance on a way, reported; None where there is none.

    A walk that comes too near to something is tried again on ways with so much more room, while there are
    some, and :data:`AGAIN` times at most.

    Args:
        find: Gives the way, and (3,) x, y [m], yaw [rad] where each foot stands at the end, or None for
            beside the goal, by the further room of the way [m].
        last: (nq,) posture in which it ends; standing if omitted.
    """
    plan, ends = find(0.0)
    if not ways_found(report, plan):
        return None
    best, further = _attempt(context, plan, ends, last), 0.0
    lack = best.lack
    for _ in range(AGAIN):
        if lack <= 0.0 or not plan.whole:
            break
        further += lack + SPARE
        plan, ends = find(further)
        if not plan.whole:
            break
        tried = _attempt(context, plan, ends, last)
        lack = tried.lack
        best = tried if lack < best.lack else best
    report.progress(STAGE, 0.6)
    keep_paths(report, best.plan, best.stepped)
    _report(context, report, best)
    walk_others(context, report, best.plan)
    return best


def _attempt(
    context: RunContext, plan: PlannedWalks, ends: Mapping[str, FloatArray] | None, last: FloatArray | None
) -> _TriedWalk:
    """Walk on a way, and look what the body meets."""
    height, rule = context.scene.floor_height or 0.0, walking.StepRule().scaled(context.body.stature or 1.75)
    with context.scenario.refusing(("walking",)):
        others = Scene(in_the_way(context.scene, context.body.stature or 2.0), None)
        stepped = walking.step_along(plan.route, rule, ends=ends, height=height, obstacles=plan.obstacles)
        walk = balanced_walk(context.body, stepped, friction=FRICTION, end=last, scene=others)
    room = FootRoom(plan.obstacles, rule.sole_length, rule.sole_width)
    return _TriedWalk(plan, stepped, walk, _clearance(walk, others), room)


def _report(context: RunContext, report: Report, attempt: _TriedWalk) -> None:
    """Tell what was measured of a walk, what it has to keep, and the first that it does not."""
    walk, beside, block = attempt.walk, attempt.beside, path_block(attempt.plan, attempt.stepped)
    block["min_clearance_m"] = None if beside is None else beside.measured
    report.finish(STAGE, block | _measures(walk, attempt.stepped.footprints))
    table = requirement_table([
        Requirement("missed_m", "distance of a foot from its place, out of reach", "m", walk.missed, "<=",
                    REACHED),
        Requirement("beyond_range_rad", "angle of a hinge beyond its range", "rad", walk.excess,
                    "<=", BEYOND),
        None if block["min_room_m"] is None else room_requirement(context, block["min_room_m"]),
        beside,
    ])  # fmt: skip
    report.require(STAGE, table)
    if (broken := table.first_broken) is not None:
        report.fail(STAGE, broken.reason, broken.time_s or 0.0, PLACES.get(broken.key, broken.where))


def _clearance(walk: BalancedWalk, scene: Scene) -> Requirement | None:
    """That no part of the body meets what stands there, at any sample; None where nothing does."""
    if not len(scene):
        return None
    motion = walk.motion
    found = Proximity(walk.body, scene, self_collision=False).minimum_over(motion.q, tolerance=1e-4)
    pair = found.pair or ("", "")
    return Requirement("min_clearance_m", "distance", "m", found.distance, ">=", CLEAR,
                       float(motion.time[found.sample]), f"{segment_of(pair[0])} from {pair[1]}")  # fmt: skip


def _measures(walk: BalancedWalk, footprints: Footprints) -> dict[str, Any]:
    """Of the planned walk: what may be out of reach of its torques, and how well its parts agree."""
    share = walk.torque_share
    row, joint = (int(k) for k in np.unravel_index(np.argmax(share), share.shape))
    return {
        "motion_s": footprints.end, "steps": footprints.count,
        "max_torque_share": float(share[row, joint]), "tightest_joint": walk.body.joint_names[joint],
        "max_zmp_error_m": float(walk.zmp_error.max()),
    }  # fmt: skip
