"""A walk on footprints: the way over the floor first, then supports along it, for the stages that follow."""

from dataclasses import replace

import numpy as np

from manikin.errors import InputError
from manikin.locomotion import (
    Footprints,
    StepRule,
    WalkingPath,
    place_footprints,
    walk_along,
    walked_footprints,
)
from manikin.locomotion.footprints import FEET
from manikin.scenarios import Scenario
from manikin.scenarios.sequence import flat_sequence
from manikin.scenarios.walked import walk_before, walking_supports
from manikin.spatial import FloatArray
from manikin.stages.context import RunContext
from manikin.stages.report import Report
from manikin.stages.walking import STAGE, end_of, keep_paths, path_block, place_of, plan_walks


def walk_on_footprints(context: RunContext, report: Report) -> RunContext | None:
    """Put footprints along the way of a walking scenario; None where there is no way.

    With supports the walk leads from ``walking.start`` to the feet of their first phase, without them from
    start to goal.

    Args:
        context: Of a scenario with a planned walk.
        report: Takes the ``walk`` block and the scenario with the supports, and the failure where there is
            no way.

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
    rule = StepRule().scaled(context.body.stature or 1.75)
    height = context.scene.floor_height or 0.0
    try:
        if stance is None:
            footprints = _along(path, rule, height, context)
            walked = walking_supports(footprints, bare)
        else:
            rule = replace(rule, standing_width=_apart(stance))
            footprints = _ending_for(scenario, [
                place_footprints(path, rule, first=first, height=height) for first in FEET
            ])  # fmt: skip
            walked = walk_before(footprints, bare)
    except InputError as error:
        raise scenario.refused(("walking",), error) from None
    report.finish(STAGE, path_block(plan) | {"steps": footprints.count})
    report.keep_scenario(walked)
    return replace(context, body=walked.build_body()).with_supports(walked)


def _along(path: WalkingPath, rule: StepRule, height: float, context: RunContext) -> Footprints:
    """By the rule, or where the feet of the library's walk stand."""
    section = context.scenario.walking
    if section is None or section.footprints == "stepper":
        return place_footprints(path, rule, height=height)
    return walked_footprints(walk_along(path, context.body, height=height), rule, height=height)


def _ends(scenario: Scenario, stance: dict[str, tuple[FloatArray, float]] | None) -> tuple[FloatArray, ...]:
    """(3,) places from where to where the body walks."""
    section = scenario.walking
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
        raise scenario.error(
            ("supports", "phases", 0), f"has no {missing[0]}; valid for a walk to it: both feet"
        )
    return {foot: (held[foot].position, held[foot].yaw) for foot in FEET}


def _apart(stance: dict[str, tuple[FloatArray, float]]) -> float:
    (left, _), (right, _) = (stance[foot] for foot in FEET)
    return float(np.hypot(*(left - right)[:2]))


def _ending_for(scenario: Scenario, choices: list[Footprints]) -> Footprints:
    """The walk whose last step is that of the foot that stays when the plan goes on; the shorter of two."""
    phases = scenario.explicit_supports().resolved_phases()
    stays = [foot for foot in FEET if len(phases) > 1 and phases[1].get(foot) == phases[0][foot]]
    fitting = [one for one in choices if one.steps[-1].effector in stays] or choices
    return min(fitting, key=lambda one: one.duration)
