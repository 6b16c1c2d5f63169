"""Walking stage of walks that are executed: on people's footprints, in balance, in the physics engine."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin import walking
from manikin.motion import Motion
from manikin.pipeline.stages.context import Report, RunContext
from manikin.pipeline.stages.execution_stage import ExecutionRequirements, PlannedMotion, execute_motion
from manikin.pipeline.stages.walking_stage import FRICTION, STAGE, keep_paths, path_block, plan_walks
from manikin.runtime.requirement import Requirement, requirement_table
from manikin.simulation import Execution
from manikin.walking.gait.balanced_walk import BalancedWalk, balanced_walk

REACHED = 2e-3
"""A foot is where it should be when its ankle is this near to its place [m]."""

BEYOND = float(np.radians(1.0))
"""Most that a hinge of the plan may be beyond its range, where it is cut off [rad]."""

BALANCED = 0.97
"""Least share of the control steps with a positive margin: in the others a foot just strikes or leaves."""


@dataclass(frozen=True, eq=False)
class ExecutedWalk:
    """A walk as planned and as executed; None of what there was not."""

    planned: Motion | None = None
    execution: Execution | None = None


def walk_in_balance(context: RunContext, report: Report, requirements: ExecutionRequirements) -> ExecutedWalk:
    """Find the way of a walking scenario, walk it on people's footprints in balance, and execute that."""
    plan = plan_walks(context)
    keep_paths(report, plan)
    report.progress(STAGE, 0.3)
    if not plan.route.succeeded:
        report.fail(STAGE, plan.route.failure or "", where="way of the body")
        report.finish(STAGE, path_block(plan))
        return ExecutedWalk()
    path = plan.route.legs[0]
    speed = float(np.hypot(*path.velocity[:, :2].T).max())
    rule = walking.StepRule.of_people(speed).scaled(context.body.stature or 1.75)
    with context.scenario.refusing(("walking",)):
        footprints = walking.place_footprints(path, rule, height=context.scene.floor_height or 0.0)
        walk = balanced_walk(context.body, footprints, path, friction=FRICTION)
    report.progress(STAGE, 1.0)
    report.finish(STAGE, path_block(plan) | {"steps": footprints.count} | _measures(walk))
    table = requirement_table([
        Requirement("missed_m", "distance of a foot from its place, out of reach", "m", walk.missed, "<=",
                    REACHED),
        Requirement("beyond_range_rad", "angle of a hinge beyond its range", "rad", walk.excess,
                    "<=", BEYOND),
    ])  # fmt: skip
    report.require(STAGE, table)
    report.keep_motions(walk.schedule, walk.motion)
    if (broken := table.first_broken) is not None:
        report.fail(STAGE, f"{broken.reason}; slower steps are shorter", where="legs")
        return ExecutedWalk(walk.motion)
    report.planned = True
    if not context.scenario.execution_required:
        return ExecutedWalk(walk.motion)
    planned = PlannedMotion(walk.schedule, walk.motion)
    execution = execute_motion(context, report, planned, replace(requirements, margin_share=BALANCED))
    report.judge()
    return ExecutedWalk(walk.motion, execution)


def _measures(walk: BalancedWalk) -> dict[str, Any]:
    """Of the planned walk: what may be out of reach of its torques, and how well its parts agree."""
    share = walk.torque_share
    row, joint = (int(k) for k in np.unravel_index(np.argmax(share), share.shape))
    return {
        "max_torque_share": float(share[row, joint]), "tightest_joint": walk.body.joint_names[joint],
        "max_zmp_error_m": float(walk.zmp_error.max()),
    }  # fmt: skip
