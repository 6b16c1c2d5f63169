"""Supports of a contact plan, as a scenario lists them: of a body that rests at every change, or walks.

A body that rests is near its posture at every change of contact.  One that walks passes from foot to foot
where the ground is mild: its centre of mass may be wherever its postures reach, and phases last as long as
balance asks for, within bounds by people's step times.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.balance.capturability import MARGIN as RISING_MARGIN
from manikin.contact import Contact, ContactKind
from manikin.numerics.spatial import yaw_about_normal
from manikin.planning.contacts import ContactPlan, Stage, rising_times
from manikin.planning.contacts.footholds import STEEPEST
from manikin.planning.guide.ground import Ground
from manikin.scenarios.problems import overhead_constraints
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.values import ScenarioValues, build_body
from manikin.scenarios.world import build_scene
from manikin.walking.footprints import FEET

MAX_SUPPORT_DISTANCE = 1.08
"""Largest distance from the centre of mass to a support ([Qiu2012]_ 7.2.2), of a body of 1.75 m [m]."""
ABOVE = 0.01
"""Height that the CoM of a rising body may be above that of its posture [m]; our choice."""
LOWEST = 0.1
"""Depth that the CoM may be below those of its postures on the way to an act [m]; our choice."""
LEAD = 0.2
"""Time for which a CoM that leaves a seat at rest may go on at its velocity within its room there [s]: rising
earlier it would ask a trunk that leans to be thrown back; our choice."""
DIP = 0.001
"""Depth that the CoM of a rising body may be below those of its postures [m]; our choice."""
HIGHEST = 10.0
"""Height above the lowest posture that no centre of mass reaches [m]."""
PLANNING_SHARE = (0.8, 0.7)
"""Size of the soles that planning balances on, relative to the real ones ([Qiu2012]_ Fig. 7.6); ours."""
STATURE = 1.75
"""Stature of the body that the lengths here are for [m]."""
STANDING = 0.3
"""Least duration of the first and the last support [s]."""
WEIGHTS: Mapping[str, Any] = {
    "margin": 1.0, "smoothness": 10.0, "duration": 2.0, "acceleration": [1.0, 1.0, 1.0],
}  # fmt: skip
"""Of the planner of the centre of mass."""

PLANNING: Mapping[str, Any] = {"degree": 5, "weights": WEIGHTS}
"""Options of the planner of a body on its feet, where the file keeps the defaults; our choice."""
PLANNING_CRAWLING: Mapping[str, Any] = {"degree": 5, "weights": WEIGHTS | {"duration": 20.0}}
"""The same of a body that goes on hands and knees, as fast as its contacts let it; our choice."""
PLANNING_SITTING: Mapping[str, Any] = {"degree": 5, "zero_end_accelerations": False}
"""The same of a body that sits down: it is at the seat sooner if it may start with an acceleration."""
PLANNING_RISING: Mapping[str, Any] = {
    "degree": 5, "min_margin": RISING_MARGIN, "weights": WEIGHTS | {"margin": 0.2, "duration": 5.0},
}  # fmt: skip
"""Options of the planner of a body that leaves a seat, likewise: a seated trunk cannot follow any path."""
SEATED_LONGER = 1.5
"""Longest duration of the phases on a seat that is left, relative to their shortest one; our choice."""
EASY_RISE = 1.3
"""Least times of a rise after a quick one has failed, relative to its own; our choice."""


@dataclass(frozen=True)
class StepTimes:
    """Least times of steps of a body that does not rest in between; our choice.

    Attributes:
        swing: Of a flight [s].
        double: Of a support on both feet [s].
        rolled: The same, one landing on its heel, the other leaving from its toes [s].
        speed: Mean speed of a foot in a longer flight [m/s].
        climbing: Mean speed upwards or downwards in what a phase lasts longer for a rise [m/s].
    """

    swing: float
    double: float
    rolled: float
    speed: float
    climbing: float


QUICK = StepTimes(0.4, 0.15, 0.18, 3.0, 4.0)
"""As people's, whose steps take 0.78 s at 0.5 m/s and 0.51 s at 1.2 m/s, 0.4 s of both in flight (Fukuchi et
al., PeerJ 6:e4640, 2018)."""
EASY = StepTimes(0.45, 0.15, 0.3, 2.0, 1.2)
"""After a walk has failed at those."""
PASSED_OVER, PASSED_STEP = 0.5, 0.02
"""Greatest height above the higher end of a flight of what the foot passes over and not below, and distance
of the places that are asked for it [m]; our choice."""
LONGEST = 0.8
"""Longest duration of a phase, or 1.5 times its least: a person's step at 0.5 m/s; without it the programme
often diverges [s]."""
FLAT_WAY = 0.05
"""Largest difference in height of two feet on whose way arms swing, of a body of 1.75 m [m]; our choice."""
SLOPED = 0.1
"""Way of the centre of mass from which on a plane above it is inclined [m]; our choice."""
LEVEL = 0.94
"""Least upward part of the normal of a sole on which a body steps without rest; our choice."""
PACES: Mapping[str, float] = {"slow": 1.5, "comfortable": 1.0, "brisk": 0.85}
"""Factors on the least durations of phases at the paces of a task; our choice."""
MILD = 0.48
"""Largest difference in height of such soles, of a body of 1.75 m [m]: what feet alone make."""
WALKING_MARGIN = 6.0
"""Margin that the plan of such a body keeps on its smaller soles, of a person of 1.75 m and 70 kg [N.m]."""
WALKING_SHARE = (0.8, 0.5)
"""Size of the soles on which it balances: nearer to their edges an ankle's strength ends; our choice."""
PLANNING_WALKING: Mapping[str, Any] = {
    "degree": 4, "samples": 5, "weights": WEIGHTS | {"margin": 0.05, "duration": 10.0},
}  # fmt: skip
"""Options of the planner of such a body: margin beyond what is required is worth little time; our choice."""


def with_supports(scenario: Scenario, plan: ContactPlan) -> Scenario:
    """Return the scenario with the supports of a contact plan, which can be kept and run again.

    The centre of mass starts and ends where it is in the plan's first and last posture, and is near that of
    each posture in between when its phase begins. Constraints that the file gives are kept.
    """
    return _Supports(scenario, plan, [False] * (len(plan.stages) + 1)).listed()


class Pace(IntEnum):
    """How a body goes through a phase of its contacts."""

    PASSING = 0  # as fast as people step: QUICK
    UNHURRIED = 1  # passing on, too, but with more time: EASY
    RESTING = 2  # at rest when the phase begins, and when it ends


def without_rests(
    scenario: Scenario, plan: ContactPlan, paces: Sequence[Pace] | None = None, *, rolls: bool = True
) -> Scenario | None:
    """The same for a body that passes from foot to foot without a rest where the ground is mild.

    There the centre of mass may be wherever the body reaches, and phases last as long as balance asks for.
    None where the body rests at every change, where anything but feet carries, and before an act.

    Args:
        paces: One for each stage of the plan; as fast as people step when omitted.
        rolls: Whether feet roll over heels and toes.
    """
    rise = len(rising_times(plan.stages))
    # The last stage before a seat leads to its touch.
    walk = range(rise, len(plan.stages) - 2 if "buttocks" in plan.stages[-1].contacts else len(plan.stages))
    carriers = {name for number in walk for name in plan.stages[number].contacts}
    if scenario.file.task.act is not None or not carriers <= set(FEET):
        return None
    paces = paces or [Pace.PASSING] * len(plan.stages)
    moving = [pace is not Pace.RESTING for pace in paces]
    inner = range(1, len(plan.stages))
    passed = [
        rise < key < walk.stop and moving[key - 1] and moving[key]
        and _is_mild(plan.stages[key - 1 : key + 2], scenario)
        for key in inner
    ]  # fmt: skip
    if not any(passed) and not (rise and all(moving[: rise + 1])):
        return None
    return _Supports(scenario, plan, [moving[0], *passed, moving[-1]], paces, rolls).listed()


def _is_mild(stages: Sequence[Stage], scenario: Scenario) -> bool:
    """Whether a body steps from foot to foot at the change of the first two of some stages."""
    highest = MILD * scenario.file.body.stature_m / STATURE
    held = [tuple(stage.contacts.values()) for stage in stages]
    return all(stage.momentum is None for stage in stages) and all(
        contact.normal[2] > LEVEL and abs(contact.position[2] - stance[0].position[2]) <= highest
        for stance in held for contact in stance
    )  # fmt: skip


def _is_level(plan: ContactPlan, scenario: Scenario) -> bool:
    """Whether no step needs raised arms to keep clear of the thighs."""
    heights = [max(c.position[2] for c in stage.contacts.values()) for stage in plan.stages]
    return float(np.abs(np.diff(heights)).max()) <= FLAT_WAY * scenario.file.body.stature_m / STATURE


def _passes_below(plan: ContactPlan, scenario: Scenario) -> bool:
    """Whether something hangs so low over the way that a body bends below it."""
    stances, ends = plan.schedule(scenario.contact_model).sequence, (plan.stages[0].com, plan.goal_com)
    return bool(overhead_constraints(build_body(scenario), build_scene(scenario), stances, ends, None))


def _ceiling(plan: ContactPlan, number: int) -> dict[str, Any]:
    """Plane above the centres of mass of the two postures between which a phase is."""
    here = plan.stages[number].com
    there = plan.goal_com if number + 1 == len(plan.stages) else plan.stages[number + 1].com
    (x, y, rise), room = (float(value) for value in there - here), plan.stages[number].com_room[2]
    way, top = math.hypot(x, y), np.array(here)
    slope = rise / way**2 if way > SLOPED else 0.0
    top[2] += room + (0.0 if way > SLOPED else max(0.0, rise))
    return {"position": top.tolist(), "normal": [-slope * x, -slope * y, 1.0]}


def _walking_time(plan: ContactPlan, number: int, ground: Ground, times: StepTimes, *, rolls: bool) -> float:
    """Least duration of a phase of a body that does not rest before or after it [s].

    A foot climbs to the highest surface below its straight way, and from there.
    """
    held, last = plan.stages[number].contacts, len(plan.stages) - 1
    if len(held) > 1:
        both = STANDING if number in (0, last) else times.rolled if rolls else times.double
        return both + float(np.ptp([contact.position[2] for contact in held.values()])) / times.climbing
    before, after = plan.stages[number - 1].contacts, plan.stages[number + 1].contacts
    ends = np.array([[of[foot].position for of in (before, after)] for foot in set(before) & set(after)])
    start, end = ends[np.argmax(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))]
    way, higher = float(np.linalg.norm(end - start)), max(float(start[2]), float(end[2]))
    places = start + np.linspace(0.0, 1.0, max(2, math.ceil(way / PASSED_STEP)))[:, None] * (end - start)
    levels = ground.levels(places[:, :2])[1]
    top = float(levels[levels < higher + PASSED_OVER].max(initial=higher))
    climbed = 2.0 * top - float(start[2]) - float(end[2])
    return max(times.swing, way / times.speed) + climbed / times.climbing


@dataclass(frozen=True)
class _Supports:
    """The scenario with the supports of a plan, by how the body goes through its phases.

    Attributes:
        passed: For each key instant, start and goal included, whether the body passes it without a rest.
        paces: Of each stage; empty where the body rests at every change.
        rolls: Whether feet roll over heels and toes.
    """

    scenario: Scenario
    plan: ContactPlan
    passed: Sequence[bool]
    paces: Sequence[Pace] = ()
    rolls: bool = False

    def listed(self) -> Scenario:
        """The scenario with supports instead of contacts to be found."""
        file, walks = self.scenario.file, any(self.passed)
        long, wide = _sole_size(self.scenario, self.plan)
        share = WALKING_SHARE if walks else PLANNING_SHARE
        supports: dict[str, Any] = {
            "friction": self.scenario.contacts.friction,
            "sole": {"length_m": long, "width_m": wide},
            "planning_sole": {"length_m": share[0] * long, "width_m": share[1] * wide},
            "phases": [self._phase(number) for number in range(len(self.plan.stages))],
        }
        if self.rolls:
            supports["foot"] = "rolling"
        manner = file.manner
        if self.rolls and _is_level(self.plan, self.scenario):
            manner = "walking" if manner == type(file).model_fields["manner"].default else manner
        # Of a body that walks the region of its postures is known.
        constraints = _given_constraints(self.scenario) if walks else _constraints(self.scenario, self.plan)
        return self.scenario.replaced(
            supports=supports, contacts=None, task=self._task(), com_constraints=constraints,
            planning=self._planning(), manner=manner,
        )  # fmt: skip

    @cached_property
    def _rises(self) -> bool:
        return "buttocks" in self.plan.stages[0].contacts

    @cached_property
    def _sits(self) -> bool:
        return "buttocks" in self.plan.stages[-1].contacts

    @cached_property
    def _below(self) -> bool:
        return any(self.passed) and _passes_below(self.plan, self.scenario)

    @cached_property
    def _ground(self) -> Ground:
        return Ground(build_scene(self.scenario), STEEPEST)

    @cached_property
    def _rise(self) -> list[float]:
        """Least durations of the stages of a rise that is passed [s]; empty where there is none."""
        times = rising_times(self.plan.stages) if self.paces else []
        return [] if Pace.RESTING in self.paces[: len(times) + 1] else times

    def _phase(self, number: int) -> dict[str, Any]:
        before = self.plan.stages[number - 1].contacts if number else {}
        contacts, friction = self.plan.stages[number].contacts, self.scenario.contacts.friction
        phase: dict[str, Any] = {
            name: "same" if before.get(name) is contact else _entry(contact, friction)
            for name, contact in contacts.items()
        }
        phase["min_duration_s"], most = self._times(number)
        if most is not None:
            phase["max_duration_s"] = most
        if self._below:
            phase["com_below"] = _ceiling(self.plan, number)
        if number and not self.passed[number]:
            phase |= self._rest(number)
        return phase

    def _times(self, number: int) -> tuple[float, float | None]:
        """Least duration of a phase, and the longest where it has one [s]."""
        stage, rise = self.plan.stages[number], self._rise
        # Who rests on the way to or from a seat is as fast as that is met or left.
        hurries = bool(rise) or any(self.passed) or not (self._rises or self._sits)
        pace = PACES[self.scenario.file.task.pace] if hurries else 1.0
        least, most = pace * stage.min_duration, None
        if self.passed[number] and self.passed[number + 1] and any(self.passed):
            times = EASY if self.paces[number] is Pace.UNHURRIED else QUICK
            least = pace * _walking_time(self.plan, number, self._ground, times, rolls=self.rolls)
            most = max(LONGEST, 1.5 * least)
        elif number < len(rise):
            least = pace * rise[number] * (EASY_RISE if self.paces[number] else 1.0)
        elif 0 < number == len(rise) < len(self.plan.stages) - 1:
            least = pace * STANDING
        if self._rises and "buttocks" in stage.contacts:
            most = SEATED_LONGER * least
        return least, most

    def _rest(self, number: int) -> dict[str, Any]:
        """Where the centre of mass rests as a phase begins."""
        stage, before = self.plan.stages[number], self.plan.stages[number - 1]
        x, y, z = (float(value) for value in stage.com)
        drop = max(0.0, stage.com_room[2] - ABOVE) if self._rises else 0.0
        place: dict[str, Any] = {"com_near": [x, y, z - drop], "com_within_m": list(stage.com_room)}
        leaves = "buttocks" in before.contacts and "buttocks" not in stage.contacts
        if leaves and stage.momentum is None and not self._rise:
            place["com_lead_s"] = LEAD
        return place

    def _task(self) -> dict[str, Any]:
        """Start and goal; the centre of mass is planned up to where a seat is touched."""
        stages = self.plan.stages
        touch = next((one for one in stages if "buttocks" in one.contacts), None) if self._sits else None
        goal: dict[str, Any] = {"com": (self.plan.goal_com if touch is None else touch.com).tolist()}
        if touch is not None:
            speed = np.zeros(3) if touch.momentum is None else touch.momentum.velocity
            goal["velocity_m_s"] = [float(x) for x in speed]
        task: dict[str, Any] = {"start": {"com": stages[0].com.tolist()}, "goal": goal}
        if self.scenario.file.task.act is not None:
            task["act"] = self.scenario.file.task.act.model_dump(mode="json")
        return task

    def _planning(self) -> Mapping[str, Any]:
        """Options of the planner of the centre of mass: the file's, or those of the way of going."""
        given = self.scenario.file.planning
        if given != type(given)():
            return given.model_dump(mode="json", exclude_none=True)
        if any(self.passed):
            walking = {**PLANNING_WALKING, "min_margin": walk_margin(self.scenario)}
            return {**walking, **PLANNING_SITTING} if self._sits else walking
        if self._sits or self._rises:
            return PLANNING_SITTING if self._sits else PLANNING_RISING
        held = (contact for stage in self.plan.stages for contact in stage.contacts.values())
        return PLANNING_CRAWLING if any(one.kind is ContactKind.POINT for one in held) else PLANNING


def _entry(contact: Contact, friction: float) -> dict[str, Any]:
    position = [float(x) for x in contact.position]
    if contact.kind is ContactKind.GRASP:
        entry: dict[str, Any] = {"position": position, "max_force_N": contact.max_force}
        if contact.oriented:
            turn = np.rad2deg(pin.rpy.matrixToRpy(contact.rotation_contact_to_world))
            entry["rpy_deg"] = turn.tolist()
        return entry
    turn = contact.rotation_contact_to_world
    entry = {"position": position, "yaw_deg": math.degrees(yaw_about_normal(turn))}
    if contact.kind is ContactKind.POINT:
        entry["kind"] = "point"
    if abs(contact.normal[2] - 1.0) > 1e-12:
        entry["normal"] = [float(x) for x in contact.normal]
    if contact.friction != friction:
        entry["friction"] = contact.friction
    if contact.rolls:
        entry["edge_radius_m"] = contact.edge_radius
    if contact.hangs_over:
        entry["polygon"] = contact.points[:, :2].tolist()
    return entry


def _sole_size(scenario: Scenario, plan: ContactPlan) -> tuple[float, float]:
    """Length and width of a whole sole: one of the plan, or the body's where all hang over edges [m]."""
    feet = (c for stage in plan.stages for name, c in stage.contacts.items() if name.endswith("foot"))
    if (whole := next((contact for contact in feet if not contact.hangs_over), None)) is not None:
        return whole.length, whole.width
    body = build_body(scenario)
    return float(body.sole_length or 0.0), float(body.sole_width or 0.0)


def _given_constraints(values: ScenarioValues) -> list[dict[str, Any]]:
    return [item.model_dump(mode="json", exclude_none=True) for item in values.file.com_constraints]


def _constraints(values: ScenarioValues, plan: ContactPlan) -> list[dict[str, Any]]:
    """The file's constraints, and those that a body on its feet keeps to."""
    given = _given_constraints(values)
    keys = {key for item in given for key in item}
    if "max_support_distance_m" not in keys:
        given.append({"max_support_distance_m": MAX_SUPPORT_DISTANCE * values.file.body.stature_m / 1.75})
    if values.file.task.act is not None and "height_band" not in keys:
        given.append({"height_band": _below_postures(plan)})
    elif "buttocks" in plan.stages[0].contacts and "height_band" not in keys:
        # Who has left a seat does not go down again: the pelvis would meet it.
        lowest = min(float(stage.com[2]) for stage in plan.stages) - DIP
        given.append({"height_band": {"lower": f"{lowest:.4f}", "upper": f"{lowest + HIGHEST:.4f}"}})
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


def walk_margin(scenario: Scenario) -> float:
    """The margin of a body that walks, for the one that the scenario's own margin is for [N.m]."""
    mass = scenario.file.reference_mass_kg or scenario.mass
    stature = scenario.file.reference_stature_m or scenario.file.body.stature_m
    return WALKING_MARGIN * mass / 70.0 * stature / STATURE
