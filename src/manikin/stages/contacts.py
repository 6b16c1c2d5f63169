"""The contacts stage: supports for a scenario that gives start and goal alone."""

from dataclasses import replace

import numpy as np

from manikin.body import BodyModel
from manikin.scenarios import Scenario
from manikin.scene import Scene
from manikin.stages.context import RunContext
from manikin.stages.foot_contacts import find_foot_contacts
from manikin.stages.found_contacts import ContactSearch
from manikin.stages.limb_contacts import find_limb_contacts
from manikin.stages.report import Report


def find_supports(
    scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator
) -> ContactSearch:
    """Plan the contacts of a scenario that gives start and goal alone.

    Args:
        scenario: Without supports.
        body: Its body.
        scene: Its scene.
        rng: Source of all randomness.

    Raises:
        BodyError: If the scenario names a limb that the body has not.
    """
    find = find_foot_contacts if scenario.contact_limbs is None else find_limb_contacts
    return find(scenario, body, scene, rng)


def plan_contacts(context: RunContext, report: Report) -> RunContext | None:
    """Plan the supports of a scenario that lists none; None where there are none.

    Args:
        context: Of a scenario without supports.
        report: Takes the ``contacts`` block.

    Raises:
        ScenarioError: If contacts of any limbs are asked for without the refinement, which alone takes them.
    """
    scenario = context.scenario
    if scenario.contact_limbs is not None and not scenario.refines:
        raise scenario.error(("wholebody", "method"), "is follow; valid: refine, for contacts of any limbs")
    report.progress("contacts", 0.0)
    found = find_supports(scenario, context.body, context.scene, np.random.default_rng(scenario.seed))
    report.summary["contacts"] = dict(found.summary)
    report.keep("contacts", found.to_dict(report.transform))
    if found.plan is None:
        report.fail("contacts", found.failure or "", where=found.where)
        return None
    planned = replace(context, plan=found.plan)
    if not scenario.refines and found.scenario is not None:
        planned = planned.with_supports(found.scenario)
        report.keep_scenario(found.scenario)
    report.progress("contacts", 1.0)
    return planned
