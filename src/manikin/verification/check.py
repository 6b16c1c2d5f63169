"""Independent check of a contact plan: contacts, reach, collisions, balance, order, start and goal.

Nothing of the planner takes part: solids, distances, friction cones and linear programs are this room's own;
the body gives its plain sizes, and Pinocchio the forward kinematics.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.contact import Contact
from manikin.numerics.spatial import FloatArray, rotation_from_quaternion
from manikin.runtime.display import Displayed
from manikin.runtime.requirement import Requirement, RequirementTable, Worst, requirement_table
from manikin.scenarios import Scenario
from manikin.scenarios.sections.task_sections import StateSection
from manikin.scenarios.world import friction_of
from manikin.verification.equilibrium import CentreState, HandForce, dynamic_shortfall, rest, torque_share
from manikin.verification.holding import REACHED, HeldPosture, HoldingRows, PostureSearch, ReachBounds
from manikin.verification.plan_file import PlannedContacts, PlannedStage, load_contact_plan
from manikin.verification.solids import Solid
from manikin.verification.touching import ContactRows, Rules

BALANCE = 1e-3
"""Distance of the centre of mass from where it could rest up to which a body counts as balanced [m]."""

SHORTFALL = 1e-4
"""Share of the weight that may be missing on the way of a dynamic stage."""


@dataclass(frozen=True, eq=False, repr=False)
class ContactPlanCheck(Displayed):
    """Outcome of a check.

    Attributes:
        requirements: What was measured, with limits and where; :attr:`stages` and the like count.
        stages: Number of stages.
        postures: Number of postures that were given and measured.
        complete: Whether every change and the goal have a posture: reach and collisions are certified.
        room: Least distance that the centre of mass may move any way along the level at a change [m].
    """

    requirements: RequirementTable
    stages: int
    postures: int
    complete: bool
    room: float

    @property
    def held(self) -> bool:
        """Whether the plan keeps every requirement."""
        return self.requirements.held

    @property
    def verdict(self) -> str:
        """In one line: ``"certified"``, ``"certified without postures"``, or the first broken requirement."""
        broken = self.requirements.first_broken
        if broken is not None:
            return f"refused: {broken.reason}"
        alone = "" if self.complete else " without postures: contacts, reach, balance and order alone"
        return f"certified{alone}"

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {"stages": str(self.stages), "postures": str(self.postures), "verdict": self.verdict}

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "held": self.held, "verdict": self.verdict, "stages": self.stages, "postures": self.postures,
            "complete": self.complete, "room_m": self.room,
            "requirements": [row.as_dict("contacts") for row in self.requirements],
        }  # fmt: skip


def check_contact_plan(scenario: Scenario, plan: PlannedContacts | str | Path) -> ContactPlanCheck:
    """Certify a contact plan for a scenario, or say what is wrong with it.

    Args:
        scenario: Body, scene and task.
        plan: In the world, or the path of a contact-plan file.

    Raises:
        ScenarioError: If the file is malformed, or the scenario cannot be built.
    """
    if not isinstance(plan, PlannedContacts):
        _, plan = load_contact_plan(plan, scenario)
    return _Check(scenario, plan).run()


@dataclass(frozen=True, eq=False)
class _Change:
    """Two stages and what is between them; the first stage has none before, the goal none after."""

    before: PlannedStage | None
    after: PlannedStage | None
    q: FloatArray | None
    com: FloatArray | None
    where: str

    @property
    def held(self) -> tuple[Contact, ...]:
        """Contacts on both sides, which the posture has to hold."""
        stages = [stage for stage in (self.before, self.after) if stage is not None]
        return tuple({id(c): c for stage in stages for c in stage.contacts.values()}.values())

    @property
    def carrying(self) -> tuple[Contact, ...]:
        """Contacts that stay, which alone may carry."""
        if self.before is None or self.after is None:
            return self.held
        return tuple(c for name, c in self.after.contacts.items() if self.before.contacts.get(name) is c)

    @property
    def dynamic(self) -> bool:
        """Whether a stage beside it is dynamic, so that there need not be rest."""
        return any(stage is not None and stage.dynamic for stage in (self.before, self.after))


class _Check:
    """One check."""

    def __init__(self, scenario: Scenario, plan: PlannedContacts) -> None:
        self._scenario, self._plan = scenario, plan
        self._body: BodyModel = scenario.build_body()
        self._mass = self._body.mass
        self._cap = scenario.contact_model.normal_force_cap
        self._solids = [Solid(item, item.name in scenario.padded) for item in scenario.build_scene()]
        self._holding = HoldingRows(self._body, self._solids)
        self._changes = list(self._at_changes())
        self._reach = ReachBounds(self._body)
        act = scenario.file.task.act
        self._act = act and HandForce(np.array(act.direction) / np.linalg.norm(act.direction), act.force_N)

    def run(self) -> ContactPlanCheck:
        touching, postures, holding = self._contacts(), list(self._postures()), self._holding
        contacts = {id(c): c for change in self._changes for c in change.held}
        holding.measure(postures, {key: touching.touched(contact) for key, contact in contacts.items()})
        balance, room = self._balance()
        rows: list[Requirement | None] = [
            *self._order(), *touching.rows, self._within_reach(), *holding.rows, *balance, self._reached(),
            *task_rows(self._scenario, self._plan),
        ]  # fmt: skip
        complete, stages = all(change.q is not None for change in self._changes), len(self._plan.stages)
        return ContactPlanCheck(requirement_table(rows), stages, len(postures), complete, room)

    def _at_changes(self) -> Iterator[_Change]:
        stages, plan = self._plan.stages, self._plan
        for number, (before, after) in enumerate(pairwise((None, *stages, None))):
            q, com = (plan.goal, plan.goal_com) if after is None else (after.posture, after.com)
            com = com if q is None else self._holding.com(q)
            yield _Change(before, after, q, com, "goal" if after is None else f"stages[{number}]")

    def _contacts(self) -> ContactRows:
        values, task = self._scenario.contacts, self._scenario.file.task
        rungs = "climbing" in (task.start.posture, task.goal.posture)
        rules = Rules(friction_of(self._scenario), values.grasp_force_N, values.forefoot_m is not None, rungs)
        rows = ContactRows(self._body, self._solids, rules)
        for number, stage in enumerate(self._plan.stages):
            rows.measure(stage.contacts, f"stages[{number}]")
        return rows

    def _postures(self) -> Iterator[HeldPosture]:
        for change in self._changes:
            if change.q is not None:
                on_toes = change.after.on_toes if change.after is not None else frozenset[str]()
                yield HeldPosture(change.q, change.held, change.where, on_toes)
            if change.after is not None and change.after.via is not None:
                own = tuple(change.after.contacts.values())
                yield HeldPosture(change.after.via, own, f"{change.where}.via")

    def _order(self) -> list[Requirement | None]:
        """One contact is made or broken at each change, both hands at once for an act; one is there."""
        most = Worst("max_changes", "contacts made and broken at one change", 1.0)
        least = Worst("min_contacts", "contacts of a stage", 1.0)
        between = "difference between the centre of mass given and the posture's"
        said = Worst("max_com_difference_m", between, 1e-3)
        for number, (before, after) in enumerate(pairwise(self._plan.stages), start=1):
            kept = {name for name, c in after.contacts.items() if before.contacts.get(name) is c}
            changed = len(before.contacts) + len(after.contacts) - 2 * len(kept)
            names = sorted({*before.contacts, *after.contacts} - kept)
            if self._scenario.file.task.act is not None and all("hand" in name for name in names):
                changed = min(changed, 1)
            most.take(changed, f"{' and '.join(names)}, stages[{number}]" if names else f"stages[{number}]")
        given = [*(stage.com for stage in self._plan.stages), self._plan.goal_com]
        for com, change in zip(given, self._changes, strict=True):
            if change.q is not None and change.com is not None and com is not None:
                said.take(float(np.linalg.norm(change.com - com)), change.where)
        for number, stage in enumerate(self._plan.stages):
            least.take(len(stage.contacts), f"stages[{number}]")
        return [least.row, most.row, said.row]

    def _within_reach(self) -> Requirement | None:
        """Contacts that are held at once are no farther apart than the body's segments are long."""
        over = "distance of two contacts over the longest way through the body"
        farthest = Worst("max_reach_share", over, 1.0, 1e-6)
        for change in self._changes:
            for share, pair in self._shares(change):
                farthest.take(share, pair)
        return farthest.row

    def _shares(self, change: _Change) -> Iterator[tuple[float, str]]:
        for first, second in combinations(change.held, 2):
            if first.effector != second.effector:
                apart = float(np.linalg.norm(first.position - second.position))
                bound = self._reach.between(first.effector, second.effector)
                yield apart / max(bound, 1e-9), f"{first.effector} and {second.effector}, {change.where}"

    def _reached(self) -> Requirement | None:
        """Where no posture is given, one is looked for; not where lengths say that there is none."""
        missed = Worst("max_reach_gap_m", "miss of the nearest posture", REACHED, 1e-9)
        search = PostureSearch(self._body)
        for change in self._changes:
            single = len({contact.effector for contact in change.held}) == len(change.held) > 0
            if change.q is None and single and all(share <= 1.0 for share, _ in self._shares(change)):
                missed.take(search.gap(change.held, change.com), change.where)
        return missed.row

    def _balance(self) -> tuple[list[Requirement | None], float]:
        off = Worst("max_balance_shift_m", "distance of the centre of mass from a place of rest", BALANCE)
        lacking = Worst("max_dynamic_shortfall", "share of the weight missing on the way", SHORTFALL)
        effort = Worst("max_torque_share", "share of the strength that rest takes", 1.0, 1e-6)
        room = np.inf
        for change in self._changes:
            if change.dynamic:
                continue
            contacts, com, within = change.carrying, change.com, None
            if com is None:
                within = {number: self._reach.to_com(item.effector) for number, item in enumerate(contacts)}
            middle = np.mean([item.position for item in change.held], axis=0) if change.held else np.zeros(3)
            guess, act = middle if com is None else com, self._act
            result = rest(contacts, self._mass, self._cap, guess, within, None if change.after else act)
            names = ", ".join(contact.effector for contact in contacts) or "no contact"
            where = f"{change.where} on {names}"
            off.take(result.shift if com is not None or result.place is None else 0.0, where)
            if com is not None:
                room = min(room, result.room)
            if change.q is not None and result.shift <= BALANCE:
                effort.take(torque_share(self._body, change.q, contacts, self._cap), where)
        for number, stage in enumerate(self._plan.stages):
            if stage.dynamic:
                lacking.take(self._shortfall(number, stage), f"stages[{number}]")
        return [off.row, lacking.row, effort.row], room

    def _shortfall(self, number: int, stage: PlannedStage) -> float:
        """Of one dynamic stage; a whole weight where an end of it is not given."""
        start, end = self._changes[number], self._changes[number + 1]
        if start.com is None or end.com is None or stage.duration is None:
            return 1.0
        leaving = np.zeros(3) if end.after is None else end.after.com_velocity
        first, last = CentreState(start.com, stage.com_velocity), CentreState(end.com, leaving)
        contacts = tuple(stage.contacts.values())
        return dynamic_shortfall(contacts, self._mass, self._cap, first, last, stage.duration)


PLACE = 0.25
"""Largest level distance of the body from where the task has it start or end [m]."""

TURN_DEG = 30.0
"""Largest angle from the heading that the task gives [deg]."""

LEVEL = 0.05
"""Largest difference between the height of the contacts and that of the task [m]."""


def task_rows(scenario: Scenario, plan: PlannedContacts) -> list[Requirement | None]:
    """Requirements of both ends; of an act, whose end the planner chooses, that hands are on its object."""
    task, first, last = scenario.file.task, plan.stages[0], plan.stages[-1]
    rows = _end_rows("start", task.start, dict(first.contacts), first.posture)
    if task.act is None:
        return rows + _end_rows("goal", task.goal, dict(last.contacts), plan.goal)
    row = Worst("goal_hands", f"hands on {task.act.on}", 1.0, sense=">=")
    row.take(sum("hand" in name for name in last.contacts), "goal")
    return [*rows, row.row]


def _end_rows(
    end: str, state: StateSection, contacts: dict[str, Contact], q: FloatArray | None
) -> list[Requirement | None]:
    place = Worst(f"{end}_distance_m", f"distance from the place of the {end}", PLACE)
    turn = Worst(f"{end}_turn_deg", f"angle from the heading of the {end}", TURN_DEG)
    level = Worst(f"{end}_height_m", f"difference from the height of the {end}", LEVEL)
    seats = Worst(f"{end}_seats", f"seats of the {end}", 1.0, sense=">=")
    feet = {name: c for name, c in contacts.items() if name != "buttocks" and "hand" not in name} or contacts
    seat = contacts.get("buttocks") or contacts.get("pelvis")
    if state.posture == "seated":
        seats.take(float(seat is not None), end)
    target = state.at if state.at is not None else None if state.com is None else state.com[:2]
    if target is not None and contacts:
        place.take(min(float(np.linalg.norm(at - target)) for at in _places(seat, feet, q)), end)
    own = None if state.heading_deg is None and state.at is None else _heading(feet, q)
    if own is not None:
        off = np.angle(np.exp(1j * (own - np.deg2rad(state.heading_deg or 0.0))))
        turn.take(abs(float(np.rad2deg(off))), end)
    resting = [seat] if seat is not None else list(feet.values())
    if state.height_m is not None and state.posture != "climbing" and resting:
        level.take(abs(float(np.mean([contact.position[2] for contact in resting]) - state.height_m)), end)
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
