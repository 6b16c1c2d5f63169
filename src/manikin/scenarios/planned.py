"""A scenario with supports that were planned for it."""

import math
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.contact import Contact, ContactKind
from manikin.contact_planning import ContactPlan
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.values import ScenarioValues

MAX_SUPPORT_DISTANCE = 1.08
"""Largest distance from the centre of mass to a support ([Qiu2012]_ 7.2.2), of a body of 1.75 m [m]."""

ABOVE = 0.01
"""How far above that of its posture the centre of mass of a rising body may be [m]; our choice."""

LOWEST = 0.1
"""How far below those of its postures the centre of mass may go on the way to an act [m]; our choice."""

PLANNING_SHARE = (0.8, 0.7)
"""Size of the soles that planning balances on, relative to the real ones ([Qiu2012]_ Fig. 7.6); ours."""

PLANNING = {
    "degree": 5,
    "zero_end_accelerations": True,
    "weights": {"margin": 1.0, "smoothness": 10.0, "duration": 2.0, "acceleration": [1.0, 1.0, 1.0]},
}
"""Options of the planner of a body on its feet, where the file keeps the defaults; our choice.

A body that leaves a seat keeps the defaults: its trunk cannot follow a path that is planned for ease alone.
"""


def with_supports(scenario: Scenario, plan: ContactPlan) -> Scenario:
    """Return the scenario with the supports of a contact plan, which can be kept and run again.

    The centre of mass starts and ends where it is in the plan's first and last posture, and is near that of
    each posture in between when its phase begins. Constraints that the file gives are kept.

    Args:
        scenario: Without supports.
        plan: For its body and scene.
    """
    friction = scenario.contacts.friction
    # Rising legs are soon at full length: there is less room above such postures than below them.
    rises = "buttocks" in plan.stages[0].contacts
    before: dict[str, Contact] = {}
    phases: list[dict[str, Any]] = []
    for number, stage in enumerate(plan.stages):
        phase: dict[str, Any] = {
            name: "same" if before.get(name) is contact else _entry(contact, friction)
            for name, contact in stage.contacts.items()
        }
        phase["min_duration_s"] = stage.min_duration
        if number:
            x, y, z = (float(value) for value in stage.com)
            drop = max(0.0, stage.com_room[2] - ABOVE) if rises else 0.0
            phase["com_near"] = [x, y, z - drop]
            phase["com_within_m"] = list(stage.com_room)
        before = dict(stage.contacts)
        phases.append(phase)
    feet = next(c for stage in plan.stages for name, c in stage.contacts.items() if name.endswith("foot"))
    supports = {
        "friction": friction,
        "sole": {"length_m": feet.length, "width_m": feet.width},
        "planning_sole": {
            "length_m": PLANNING_SHARE[0] * feet.length,
            "width_m": PLANNING_SHARE[1] * feet.width,
        },
        "phases": phases,
    }
    task = {
        "start": {"com": [float(x) for x in plan.stages[0].com]},
        "goal": {"com": [float(x) for x in plan.goal_com]},
    }
    if scenario.act is not None:
        task["act"] = scenario.act.model_dump(mode="json")
    planning = scenario.planning.model_dump(mode="json", exclude_none=True)
    if scenario.planning == type(scenario.planning)() and not rises:
        planning = PLANNING
    return scenario.replaced(
        supports=supports,
        contacts=None,
        task=task,
        com_constraints=_constraints(scenario, plan),
        planning=planning,
    )


def _entry(contact: Contact, friction: float) -> dict[str, Any]:
    if contact.kind is ContactKind.GRASP:
        return _grasp_entry(contact)
    entry: dict[str, Any] = {
        "position": [float(x) for x in contact.position],
        "yaw_deg": math.degrees(contact.yaw),
    }
    if abs(contact.normal[2] - 1.0) > 1e-12:
        entry["normal"] = [float(x) for x in contact.normal]
    if contact.friction != friction:
        entry["friction"] = contact.friction
    return entry


def _grasp_entry(contact: Contact) -> dict[str, Any]:
    turn = np.rad2deg(pin.rpy.matrixToRpy(contact.rotation_contact_to_world))
    return {
        "position": [float(x) for x in contact.position],
        "rpy_deg": [float(x) for x in turn],
        "max_force_N": contact.max_force,
    }


def _constraints(values: ScenarioValues, plan: ContactPlan) -> list[dict[str, Any]]:
    """The file's constraints, and those that a body on its feet keeps to."""
    given = [item.model_dump(mode="json", exclude_none=True) for item in values.file.com_constraints]
    keys = {key for item in given for key in item}
    if "max_support_distance_m" not in keys:
        given.append({"max_support_distance_m": MAX_SUPPORT_DISTANCE * values.file.body.stature_m / 1.75})
    if values.act is not None and "height_band" not in keys:
        given.append({"height_band": _below_postures(plan)})
    return given


def _below_postures(plan: ContactPlan) -> dict[str, str]:
    """Band up to a line from start to end, just above the centres of mass of all postures.

    Who goes down to an act and rises in between would have to lift the arms for it.
    """
    coms = np.array([*(stage.com for stage in plan.stages), plan.goal_com])
    way = coms[-1, :2] - coms[0, :2]
    along = way / max(float(way @ way), 1e-6)
    drop = coms[-1, 2] - coms[0, 2]
    shares = (coms[:, :2] - coms[0, :2]) @ along
    level = float((coms[:, 2] - drop * shares).max()) + ABOVE
    x, y = (float(value) for value in drop * along)
    start = float(level - coms[0, 0] * x - coms[0, 1] * y)
    line = f"{start:.4f} + {x:.4f}*x + {y:.4f}*y"
    return {"lower": f"{float(coms[:, 2].min()) - LOWEST:.4f}", "upper": line.replace("+ -", "- ")}
