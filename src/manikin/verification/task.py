"""Requirements of start and goal: the plan begins and ends where the task says, and faces that way."""

import numpy as np

from manikin.contact import Contact
from manikin.numerics.spatial import FloatArray, rotation_from_quaternion
from manikin.runtime.requirement import Requirement
from manikin.scenarios import Scenario
from manikin.scenarios.sections import StateSection
from manikin.verification.plan_file import PlannedContacts
from manikin.verification.worst import Worst

PLACE = 0.25
"""Largest level distance of the body from where the task has it start or end [m]."""

TURN_DEG = 30.0
"""Largest angle from the heading that the task gives [deg]."""

LEVEL = 0.05
"""Largest difference between the height of the contacts and that of the task [m]."""


def task_rows(scenario: Scenario, plan: PlannedContacts) -> list[Requirement | None]:
    """Requirements of both ends; of an act, whose end the planner chooses, that the hands are on its object.

    Args:
        scenario: With a task.
        plan: In the world.
    """
    task, first, last = scenario.file.task, plan.stages[0], plan.stages[-1]
    rows = _end_rows("start", task.start, dict(first.contacts), first.posture)
    if task.act is None:
        return rows + _end_rows("goal", task.goal, dict(last.contacts), plan.goal)
    hands = sum("hand" in name for name in last.contacts)
    row = Worst("goal_hands", f"hands on {task.act.on}", "", ">=", 1.0)
    row.take(hands, "goal")
    return [*rows, row.row]


def _end_rows(
    end: str, state: StateSection, contacts: dict[str, Contact], q: FloatArray | None
) -> list[Requirement | None]:
    place = Worst(f"{end}_distance_m", f"distance from the place of the {end}", "m", "<=", PLACE)
    turn = Worst(f"{end}_turn_deg", f"angle from the heading of the {end}", "deg", "<=", TURN_DEG)
    level = Worst(f"{end}_height_m", f"difference from the height of the {end}", "m", "<=", LEVEL)
    seats = Worst(f"{end}_seats", f"seats of the {end}", "", ">=", 1.0)
    feet = {name: c for name, c in contacts.items() if name != "buttocks" and "hand" not in name} or contacts
    seat = contacts.get("buttocks") or contacts.get("pelvis")
    if state.posture == "seated":
        seats.take(float(seat is not None), end)
    target = state.at if state.at is not None else None if state.com is None else state.com[:2]
    if target is not None and contacts:
        place.take(min(float(np.linalg.norm(at - target)) for at in _places(seat, feet, q)), end)
    if state.heading_deg is not None or state.at is not None:
        heading = np.deg2rad(state.heading_deg or 0.0)
        if (own := _heading(feet, q)) is not None:
            off = np.angle(np.exp(1j * (own - heading)))
            turn.take(abs(float(np.rad2deg(off))), end)
    if state.height_m is not None and state.posture != "climbing":
        resting = [seat] if seat is not None else list(feet.values())
        if resting:
            mean = np.mean([contact.position[2] for contact in resting])
            level.take(abs(float(mean - state.height_m)), end)
    return [seats.row, place.row, turn.row, level.row]


def _places(seat: Contact | None, feet: dict[str, Contact], q: FloatArray | None) -> list[FloatArray]:
    """(2,) where the body may be said to be: on its seat, or between its feet and at its root [m]."""
    if seat is not None:
        return [seat.position[:2]]
    middle = np.mean([contact.position[:2] for contact in feet.values()], axis=0)
    return [middle] if q is None else [middle, q[:2]]


def _heading(feet: dict[str, Contact], q: FloatArray | None) -> float | None:
    """Heading of the root, or of the feet [rad]."""
    if q is not None:
        forward = rotation_from_quaternion(q[None, 3:7])[0, :, 0]
        return float(np.arctan2(forward[1], forward[0]))
    turns = [np.exp(1j * contact.yaw) for name, contact in feet.items() if "foot" in name]
    return float(np.angle(np.sum(turns))) if turns else None
