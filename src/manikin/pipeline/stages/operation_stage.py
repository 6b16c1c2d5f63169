"""Operations stage: what a person does one after the other, each planned from where the one before ended.

An operation is one or several motions from rest to rest, which the road of every scenario plans: contacts,
centre of mass, whole body. What the hands hold is a mass in them meanwhile, and no obstacle. All motions
together are one, which is measured as one, executed as one and reported as one.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.segments import HANDS
from manikin.kinematics import Placement
from manikin.numerics.spatial import FloatArray, frozen_array, rotation_from_yaw
from manikin.pipeline.stages.contact_guides import stage_at
from manikin.pipeline.stages.context import Report, RunContext, RunResult
from manikin.pipeline.stages.execution_stage import ExecutionRequirements, append_act, execute_motion
from manikin.pipeline.stages.operation_report import (
    OperationMotion,
    PlacedObject,
    joined,
    report_operations,
)
from manikin.planning.contacts import (
    ContactPlan,
    Endpoints,
    PostureFinder,
    PostureFinderSettings,
    Stage,
    heading_of,
)
from manikin.planning.whole_body import HandCourse, Handling, HeldObject, WholeBodyResult
from manikin.planning.whole_body.handling import CourseKind, held_arms
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.planning.whole_body.swing_path import Pose
from manikin.scenarios import Scenario
from manikin.scenarios.found_supports import with_supports
from manikin.scenarios.sections.operation_sections import (
    CarrySection,
    ForceSection,
    GraspSection,
    LiftSection,
    OperationSection,
    PlaceSection,
    ReachSection,
    SitSection,
    StandUpSection,
    WalkToSection,
)
from manikin.scene import Scene

CLOSE_AHEAD, TRUNK, CARRIED_HEIGHTS = 0.36, 0.2, (0.95, 1.25)
"""Where what is carried is, of a body of 1.75 m: its middle at least so far ahead of the pelvis, its rear
face so far, and between such heights above the soles, the nearest to that of its lift [m]; our choice."""
PLACED_AHEAD = 0.45
"""Distance ahead of the pelvis at which an object is set down where no place is given [m]; our choice."""
WISHED_TURN = 20.0
"""Weight of the orientation of palms in postures [1/rad^2]; our choice."""
HAND_TIME = 1.2
"""Shortest time of a motion of the hands [s]; our choice."""
RESTING = 0.35
"""Shortest time for which contacts are held before a way begins [s]."""

Follow = Callable[[RunContext, Report, ExecutionRequirements], RunResult]
"""The road of a scenario from its contacts on."""


class _Refused(Exception):  # no error: it ends the planning, and becomes the run's failure
    """What cannot be planned: the stage, the reason, the time in the whole motion [s], and where."""

    def __init__(self, stage: str, reason: str, time: float = 0.0, where: str = "") -> None:
        super().__init__(stage, reason, time, where)


def run_operations(
    context: RunContext, report: Report, requirements: ExecutionRequirements, follow: Follow
) -> RunResult:
    """Plan the operations of a scenario one after the other, and execute them as one motion.

    Args:
        context: The scenario in the frame of its task.
        report: Of the whole run.
        requirements: What the execution must keep.
        follow: The road of a scenario, which plans each motion.
    """
    job = _Operations(context, report, lambda part, parts: follow(part, parts, requirements))
    try:
        job.plan()
    except _Refused as refused:
        report.fail(*refused.args)
    if not job.parts:
        return RunResult.of(report)
    planned, executed = joined(context.body, job.parts), context.scenario.execution_required
    report_operations(report, context.body, job.parts, planned.motion, job.places)
    report.planned = report.failure is None
    report.keep_motions(planned.schedule, planned.motion)
    report.judge_requirements()
    # The engine has what is taken up as masses in the hands alone.
    context = replace(job.acting or context, scene=job.fixed_scene())
    if report.failure is None and job.acting is not None:
        planned = append_act(context, report, planned)
    if report.failure is not None or not executed:
        return RunResult.of(report, planned=planned.motion)
    execution = execute_motion(context, report, planned, requirements)
    report.judge()
    return RunResult.of(report, execution=execution, planned=planned.motion)


class _Operations:
    """The operations of one scenario, planned in turn.

    Attributes:
        parts: Motions so far.
        acting: The job of the act with which they end, or None.
        places: Objects that were taken up, where they are at the end of each operation.
    """

    def __init__(
        self, context: RunContext, report: Report, follow: Callable[[RunContext, Report], RunResult]
    ) -> None:
        self._context, self._report, self._follow = context, report, follow
        self._scale = context.scenario.file.body.stature_m / 1.75
        self._held: PlacedObject | None = None
        self._placed: dict[str, PlacedObject] = {}
        self._number, self._name = 0, ""
        self.parts, self.acting = list[OperationMotion](), None
        self.places = list[list[PlacedObject]]()

    def fixed_scene(self) -> Scene:
        """The scene without anything that is taken up."""
        scenario = self._context.scenario
        taken = {item.content.object for item in scenario.file.task.operations or [] if item.grasp}
        rest = [
            item.model_dump(mode="json", exclude_none=True)
            for item in scenario.file.scene if item.name not in taken
        ]  # fmt: skip
        standing = {"start": self._standing, "goal": self._standing}
        return scenario.replaced(scene=rest, task=standing).build_scene()

    def plan(self) -> None:
        """Plan every operation; _Refused at the first that cannot be done."""
        operations = self._context.scenario.file.task.operations or []
        self._stage = self._start()
        for number, operation in enumerate(operations):
            self._number, self._name = number, _name(operation)
            self._report.progress(operation.name, number / len(operations))
            getattr(self, f"_{operation.name}")(operation.content)
            held = {} if self._held is None else {self._held.thing.name: self._held}
            self.places.append(list((self._placed | held).values()))

    # Operations, by their names in the file

    def _walk_to(self, content: WalkToSection) -> None:
        self._go({"at": list(content.position), "heading_deg": content.heading_deg})

    def _reach(self, content: ReachSection) -> None:
        holds, place = (
            {f"{content.hand}_hand": Pose(np.zeros(3), np.eye(3))},
            np.append(content.position, 0.0),
        )
        self._move_hands(HandCourse(CourseKind.TAKE, holds, place, place, turns=False))

    def _grasp(self, content: GraspSection) -> None:
        thing = self._thing(content.object)
        course = HandCourse(CourseKind.TAKE, thing.holds, thing.place, thing.place)
        self._move_hands(course, touched=content.object)
        self._held = thing

    def _lift(self, content: LiftSection) -> None:
        self._take(self._in_hands.place[:3] + np.array([0.0, 0.0, content.height_m]))

    def _carry(self, content: CarrySection) -> None:
        held = self._in_hands
        ahead = max(CLOSE_AHEAD * self._scale, TRUNK * self._scale + 0.5 * float(held.sizes[0]))
        low, high = (self._floor + height * self._scale for height in CARRIED_HEIGHTS)
        self._take(self._ahead(ahead, min(max(float(held.place[2]), low), high)), turns=True)
        if content.position is not None:
            yaw = math.degrees(self._heading) if content.heading_deg is None else content.heading_deg
            self._go({"at": list(content.position), "heading_deg": yaw})

    def _place(self, content: PlaceSection) -> None:
        there = self._on_top(content.on, self._in_hands, content.at)
        self._take(there, turns=True, rises_first=False)
        put = self._in_hands
        course = HandCourse(CourseKind.LEAVE, self._holds(put), put.place, put.place)
        self._held, self._placed[content.object] = None, put
        self._move_hands(course, touched=content.object)

    def _sit(self, content: SitSection) -> None:
        seat = next(item for item in self._context.scenario.file.scene if item.name == content.on)
        yaw = math.degrees(self._heading) if content.heading_deg is None else content.heading_deg
        self._go({"at": list(seat.position[:2]), "heading_deg": yaw, "posture": "seated"})

    def _stand(self, content: StandUpSection) -> None:
        del content
        self._go(self._standing)

    def _push(self, content: ForceSection) -> None:
        self._act("push", content)

    def _pull(self, content: ForceSection) -> None:
        self._act("pull", content)

    def _act(self, kind: str, content: ForceSection) -> None:
        """Step to where both hands act, and take hold; the act itself comes at the end of the whole."""
        act = {"kind": kind, **content.model_dump(mode="json")}
        self._go(self._standing, act)
        context = self._prepared()
        task = {"start": self._standing, "act": act}
        plan = ContactPlan.of(context.body, [self._stage], self._stage.q)
        scenario = with_supports(context.scenario.replaced(task=task), plan)
        self.acting = replace(self._context, scenario=scenario)

    # Motions

    def _take(self, there: FloatArray, *, turns: bool = False, rises_first: bool = True) -> None:
        """Move what is held to a place (3,) [m], or turn it to face the body, too."""
        held = self._in_hands
        turn = math.remainder(self._heading - float(held.place[3]), 2.0 * math.pi) if turns else 0.0
        end = np.append(there, float(held.place[3]) + turn)
        self._move_hands(HandCourse(CourseKind.MOVE, self._holds(held), held.place, end, rises_first))
        self._held = replace(held, place=end)

    def _move_hands(self, course: HandCourse, touched: str = "") -> None:
        """One motion of the hands, the other contacts as they are; ``touched`` is what they take or leave."""
        context, before = self._prepared(), self._stage
        scenario, body, placements = context.scenario, context.body, {}
        # Palms and forearms touch what they take: it is no obstacle for the posture in which they do.
        poser = _poser(scenario, body, self._prepared(without=touched).scene)
        if course.kind is not CourseKind.LEAVE:
            placements = {
                hand: Placement(target.position[0], target.rotation[0] if course.turns else None, WISHED_TURN)
                for hand, target in course.targets(np.ones(1)).items()
            }
        # Hands that have let go hang as the manner wants; others move the body no more than they have to.
        leaves, contacts = course.kind is CourseKind.LEAVE, before.contacts
        first, guide = (poser.standing_at(before.q), None) if leaves else (before.q, before.q)
        posed = poser.pose(contacts, contacts, first, guide, placements=placements, restarts=True)
        if posed.q is None:
            raise self._refused("contacts", f"no posture: {posed.reason}")
        if weak := poser.strained(posed.q, contacts, 1.0):
            raise self._refused("contacts", weak)
        plan = ContactPlan.of(body, [Stage.of(body, contacts, before.q, HAND_TIME)], posed.q)
        hands = [body.segment(body.effector(hand).segment) for hand in course.holds]
        arms = [name for hand in hands for name in (hand.name, hand.parent) if name is not None]
        touches = frozenset(product(arms, [touched])) if touched else frozenset()
        handling = replace(context.handling, course=course, held={}, touches=touches)
        supported = context.with_supports(with_supports(scenario, plan))
        self._add(replace(supported, plan=plan, handling=handling), course)

    def _go(self, goal: Mapping[str, Any], act: Mapping[str, Any] | None = None) -> None:
        """One motion on the feet to a goal of the scenario's task, or to where an act is done."""
        context, task = self._prepared(), {"start": self._standing, "goal": {**goal}}
        if act is not None:
            task["act"] = {**act}
        scenario = context.scenario.replaced(task=task)
        # The centre of mass at the start is that of the body with what it holds.
        start = Stage.of(context.body, self._stage.contacts, self._stage.q, RESTING)
        self._add(replace(context, scenario=scenario, start=start), None)
        if self._held is not None:
            self._held = replace(self._held, place=self._between_hands(self._held))

    def _prepared(self, without: str = "") -> RunContext:
        """A job that begins as the last one ended, with what is held in the hands, and not in the scene.

        Args:
            without: Another object that is left out of the scene.
        """
        context, held = self._context, self._held
        body = context.scenario.file.body.model_dump(mode="json", exclude_none=True)
        if held is not None:
            body["load"] = {"mass_kg": held.thing.mass}
        scene, gone = [], (without, "" if held is None else held.thing.name)
        for item in context.scenario.file.scene:
            data = item.model_dump(mode="json", exclude_none=True)
            if item.name in self._placed:
                put = self._placed[item.name]
                data["position"], data["rpy_deg"] = put.place[:3].tolist(), [0.0, 0.0, math.degrees(put.yaw)]
            if item.name not in gone:
                scene.append(data)
        task = {"start": self._standing, "goal": self._standing}
        scenario = context.scenario.replaced(body=body, scene=scene, task=task, execution={"required": False})
        loaded = scenario.build_body()
        handling = Handling(
            begin=self._stage.q if self.parts else None, settles=True,
            held={} if held is None else held_arms(loaded, self._stage.q),
        )  # fmt: skip
        return replace(
            context, scenario=scenario, body=loaded, scene=scenario.build_scene(), handling=handling
        )

    def _add(self, context: RunContext, course: HandCourse | None) -> None:
        """Plan one motion and rest in its last posture; _Refused where it cannot be done."""
        report = Report(context, None, None, 0.0)
        found = self._follow(context, report).wholebody
        if (failure := report.failure) is not None:
            raise self._refused(failure.stage, failure.reason, failure.time_s, failure.where)
        if not isinstance(found, WholeBodyResult):
            raise self._refused("wholebody", "there is no motion")
        schedule, motion = found.trajectory.schedule, found.motion
        rows = motion.time <= schedule.instants[-1] + 1e-9  # of an act the way to it
        time = motion.time[rows] - schedule.instants[0]
        states = time, motion.q[rows], motion.v[rows], motion.a[rows]
        self.parts.append(
            OperationMotion(self._number, self._name, states, schedule, report, course, self._held)
        )
        contacts = {contact.effector: contact for contact in schedule.sequence[-1].stance}
        self._stage = Stage.of(self._context.body, contacts, states[1][-1], RESTING)

    def _refused(self, stage: str, reason: str, time: float = 0.0, where: str = "") -> _Refused:
        """Why an operation cannot be done, at a time of its last motion [s]."""
        done = sum(part.duration for part in self.parts)
        return _Refused(stage, f"{self._name}: {reason}", done + time, where)

    # Places

    def _start(self) -> Stage:
        """Contacts and posture at the start."""
        scenario = self._context.scenario
        poser = _poser(scenario, self._context.body, self._context.scene)
        found = stage_at(Endpoints(poser, scenario.contacts.friction, rolls=True), scenario, "start")
        if isinstance(found, str):
            raise _Refused("contacts", found)
        return found

    @property
    def _in_hands(self) -> PlacedObject:
        assert self._held is not None  # the file is checked for it
        return self._held

    @property
    def _heading(self) -> float:
        """[rad]."""
        return heading_of(self._stage.q[:7])

    @property
    def _feet(self) -> FloatArray:
        """(2, 3) places of the soles [m]."""
        held = self._stage.contacts.items()
        return np.array([contact.position for name, contact in held if name.endswith("foot")])

    @property
    def _floor(self) -> float:
        """Height of the lower foot [m]."""
        return float(self._feet[:, 2].min())

    @property
    def _standing(self) -> dict[str, Any]:
        """Where the body stands, as a state of a task."""
        return {"at": self._feet[:, :2].mean(axis=0).tolist(), "heading_deg": math.degrees(self._heading)}

    def _ahead(self, distance: float, height: float) -> FloatArray:
        """(3,) place ahead of the pelvis [m]."""
        q, yaw = self._stage.q, self._heading
        return np.array([q[0] + distance * math.cos(yaw), q[1] + distance * math.sin(yaw), height])

    def _thing(self, name: str) -> PlacedObject:
        """An object where it rests, as it faces the body."""
        item = next(item for item in self._context.scenario.file.scene if item.name == name)
        size, mass = frozen_array(item.box or (), "size [m]", (3,)), item.mass_kg or 0.0
        thing, position, yaw = (
            HeldObject(name, size, mass),
            np.array(item.position),
            math.radians(item.rpy_deg[2]),
        )
        if name in self._placed:
            position, yaw = self._placed[name].place[:3], self._placed[name].yaw
        ahead, sizes = thing.facing(yaw, self._heading)
        return PlacedObject(thing, sizes, np.append(position, ahead), yaw - ahead)

    def _on_top(self, name: str, held: PlacedObject, at: Any) -> FloatArray:
        """(3,) where an object rests on another one: at a place, or ahead as near as its top allows [m]."""
        near = max(PLACED_AHEAD * self._scale, TRUNK * self._scale + 0.5 * float(held.sizes[0]))
        wanted = self._ahead(near, 0.0)
        wanted[:2] = wanted[:2] if at is None else at
        room, best, least = 0.5 * float(held.sizes[:2].max()), None, math.inf
        for surface in self._prepared().scene.surfaces_facing((0.0, 0.0, 1.0), 0.02):
            wanted[2] = surface.polygon[0, 2]
            place = surface.nearest_inside(wanted, room) if name in surface.obstacles else None
            away = math.inf if place is None else float(np.linalg.norm(place - wanted))
            if away < least:
                best, least = place, away
        if best is None:
            raise self._refused("contacts", f"{name} has no level top with room for it")
        if at is not None and least > 1e-3:
            raise self._refused(
                "contacts", f"at {[round(x, 3) for x in at]} it would hang over the edge of {name}"
            )
        return best + np.array([0.0, 0.0, 0.5 * float(held.sizes[2])])

    def _holds(self, held: PlacedObject) -> dict[str, Pose]:
        """Places of both palms in the frame of what they hold, as they are."""
        turn, found = rotation_from_yaw(float(held.place[3])), {}
        state = Configuration(self._context.body, self._stage.q)
        for hand in held.holds:
            rotation, position = state.effector_placement(hand)
            found[hand] = Pose(turn.T @ (position - held.place[:3]), turn.T @ rotation)
        return found

    def _between_hands(self, held: PlacedObject) -> FloatArray:
        """(4,) place of what is held, as the palms are."""
        state = Configuration(self._context.body, self._stage.q)
        left, right = (state.effector_placement(hand)[1] for hand in HANDS)
        across = left - right
        yaw = math.atan2(-across[0], across[1])
        hold = held.holds["left_hand"].position[0]
        return np.append(0.5 * (left + right) - hold * np.array([math.cos(yaw), math.sin(yaw), 0.0]), yaw)


def _name(operation: OperationSection) -> str:
    """Name of an operation with its object."""
    things = (getattr(operation.content, key, None) for key in ("object", "on"))
    return " ".join([operation.name, *(thing for thing in things if thing is not None)][:2])


def _poser(scenario: Scenario, body: BodyModel, scene: Scene) -> PostureFinder:
    settings = PostureFinderSettings(friction_model=scenario.contact_model.friction)
    return PostureFinder(body, scene, posture_style_of(scenario.file.manner).posture(body), settings)
