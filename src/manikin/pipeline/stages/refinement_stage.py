"""Refinement stage: a motion of all joints through postures at the changes of contact."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

from manikin.contact import ContactSchedule
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.context import Report, RunContext
from manikin.pipeline.stages.whole_body_stage import certificate_summary, report_whole_body
from manikin.planning.contacts import ContactPlan
from manikin.planning.contacts.contact_plan import Paces
from manikin.planning.contacts.footsteps import HIGHEST
from manikin.planning.whole_body import FREE_HANDS, RefineResult, RefineScales, RefineSettings, refine_motion
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.swing_planner import with_mid_flights
from manikin.scenarios.found_supports import STATURE


def refine_contacts(
    context: RunContext, report: Report, schedule: ContactSchedule, time: FloatArray, q: FloatArray
) -> RefineResult:
    """Refine the motion through key postures, and others between with lifted feet, at the scenario's pace.

    Args:
        report: Takes the ``wholebody`` block.
        time: (n,) key times [s].
        q: (n, nq) postures at them.
    """
    report.progress("wholebody", 0.0)
    body, scene, padded = context.body, context.scene, context.padded
    options = context.scenario.file.wholebody
    schedule = ContactSchedule(schedule.sequence, schedule.instants / options.pace)
    rests = _rests(context, schedule)
    keys = KeyPath(time / options.pace, q)
    path = with_mid_flights(body, scene, schedule, keys, padded, dense=bool(rests))
    kept = {
        "contact_variables": options.contact_variables, "speed_share": options.speed_share,
        "deadline": context.settings.deadline,
    }  # fmt: skip
    result = refine_motion(
        body, scene, path.time, path.q, schedule, padded=padded, rests=rests, fitted=context.fitted,
        settings=RefineSettings(scales=RefineScales.of(body), **kept),
        progress=lambda share: report.progress("wholebody", share),
    )  # fmt: skip
    block = refined_summary(result) | {"seed_matters": context.plan is not None}
    report_whole_body(context, report, result.schedule, result, block)
    return result


HANDS = ("hand", "wrist")
"""How the names of contacts of hands end: of what they hold, and of their heels, which push."""

HOLDING_PACE, HOLDING_ACCELERATION = 1.0, 1.0
"""Mean speed of hinges [rad/s] and largest acceleration of the CoM [m/s^2] of who holds on; our choice."""


def from_rest_to_rest(context: RunContext) -> RunContext | None:
    """The task of a person on whole soles and hands with time to rest at every change of them, or None."""
    plan, scenario = context.plan, context.scenario
    if context.handling is not FREE_HANDS:  # the refinement knows nothing of hands that hold something
        return None
    if plan is None or context.body.stature is None or scenario.contacts.forefoot_m is not None:
        return None
    names = set[str]().union(*(stage.contacts for stage in plan.stages))
    moving = any(stage.momentum is not None for stage in plan.stages)
    if moving or scenario.file.task.act is not None or not all(x.endswith(("foot", *HANDS)) for x in names):
        return None
    paces = Paces(hinge_pace=HOLDING_PACE, com_acceleration=HOLDING_ACCELERATION)
    return replace(context, plan=ContactPlan.of(context.body, plan.stages, plan.goal, paces))


def is_hard(context: RunContext) -> bool:
    """Whether hands carry on the way, or a step is higher than feet alone are to make."""
    stages = () if context.plan is None else context.plan.stages
    if any(name.endswith(HANDS) for stage in stages for name in stage.contacts):
        return True
    heights = [[float(contact.position[2]) for contact in stage.contacts.values()] for stage in stages]
    rises = [max(a + b) - min(a + b) for a, b in pairwise(heights)]
    return max(rises, default=0.0) > HIGHEST * (context.body.stature or 0.0) / STATURE


def _rests(context: RunContext, schedule: ContactSchedule) -> list[int]:
    """Key instants at which such a person rests, as another limb has come to its contact."""
    if from_rest_to_rest(context) is None:
        return []
    held = [set(phase.stance.effectors) for phase in schedule.sequence]
    return [k for k, (before, after) in enumerate(pairwise(held), 1) if after > before]


def refined_summary(result: RefineResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary of a refined motion."""
    certificate, before, after = result.certificate, result.before, result.after
    variables = (value for phase in result.variables for value in phase.values())
    refinement = {
        "min_contact_slack": result.contact_slack,
        "max_physics_violation_N": certificate.value("max_physics_violation"),
        "physics_violation_falls": _fall(before.physics_violation, after.physics_violation),
        "squared_accelerations_fall": _fall(before.squared_accelerations, after.squared_accelerations),
        "before": before.as_dict(), "smoothed": result.smoothed.as_dict(), "after": after.as_dict(),
        "least_contact_variable": min(variables, default=None),
        "released_contacts": [{"phase": phase, "effector": name} for phase, name in result.released],
        "stretch": result.stretch, "iterations": result.iterations,
    }  # fmt: skip
    return {
        "method": "refine", "duration_s": after.duration_s, **certificate_summary(certificate),
        "max_meeting_error_m": None, "max_com_error_m": None,
        "max_scuff_m": certificate.value("max_penetration_m"), "impacts": [],
        "min_margin": certificate.value("min_margin"), "swings": None, "refinement": refinement,
        "wall_s": result.wall_time,
    }  # fmt: skip


def _fall(before: float, after: float) -> float | None:
    """Ratio of the values before and after; None if nothing is left."""
    return before / after if after > 0.0 else None
