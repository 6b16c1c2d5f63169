"""Contact stage: supports for a scenario that gives start and goal alone ([Tonneau2015]_ chapters 6 and 7).

A body goes on its feet, and the hands join in where they are needed and where it ends with an act; a creature
and a climber go on all their limbs, led round what is in their straight way by a guide of the root.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import islice

import numpy as np

from manikin.body import BodyModel, Configuration, Limb, limb_named
from manikin.body.limbs import is_further
from manikin.body.segments import FEET
from manikin.contact import ContactKind
from manikin.kinematics.limb_samples import sample_limbs
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.contact_guides import ContactSearch, SearchTally, guide_root, stage_at
from manikin.pipeline.stages.context import Passing, Report, RunContext
from manikin.pipeline.stages.execution_stage import act_of
from manikin.pipeline.stages.refinement_stage import HOLDING_ACCELERATION, HOLDING_PACE
from manikin.planning import contacts, guide
from manikin.planning.contacts import ContactPlan, Endpoint, Endpoints, Extension, Stage, WalkSearch
from manikin.planning.push_pull import Brace, BraceSettings, arrival, find_braced_posture, with_hands
from manikin.planning.whole_body import FREE_HANDS, Handling
from manikin.planning.whole_body.posture_style import LADDER, posture_style_of
from manikin.scenarios import Scenario
from manikin.scenarios.found_supports import Pace, with_supports, without_rests
from manikin.scenarios.sections.task_sections import StateSection
from manikin.scenarios.world import CLIMBING, carried_to, contact_rules
from manikin.scene import Scene


class _ContactSearch:
    """Search for contacts between start and goal of a scenario."""

    def __init__(self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator) -> None:
        self._tally = SearchTally()
        self._scenario, self._body, self._scene, self._rng = scenario, body, scene, rng
        self._natural = scenario.contacts.ranges == "learnt"
        self._search: WalkSearch | contacts.LimbSearch | contacts.CrawlSearch | None = None

    def _again(self, phase: int, reason: str) -> ContactSearch:
        """Another plan, without the change of contact of a phase of the last one."""
        if self._search is None or not self._search.refuse(phase):
            return self._tally.failed(reason, "contacts")
        return self._result(self._search.run())

    def _result(self, found: Extension) -> ContactSearch:
        summary = self._tally.summary
        summary.update(attempts=summary["attempts"] + 1, postures=found.searches, backtracks=found.backtracks)
        if found.plan is None:
            return self._tally.failed(found.failure or "", "contacts")
        whole = self._completed(found.plan)
        if isinstance(whole, str):
            return self._tally.failed(whole, "goal")
        return replace(self._tally.found(whole[0]), scenario=whole[1], again=self._again)

    def _completed(self, plan: ContactPlan) -> tuple[ContactPlan, Scenario | None] | str:
        """The plan with what ends it, or why it cannot; the scenario with supports that a file can list."""
        return plan, None

    def _asked(self) -> contacts.PostureFinderSettings:
        model = self._scenario.contact_model.friction
        return contacts.PostureFinderSettings(natural=self._natural, friction_model=model)

    def _endpoints(self, poser: contacts.PostureFinder) -> Endpoints:
        asked, rolls = self._scenario.contacts, not self._scenario.refines
        return Endpoints(poser, asked.friction, rolls=rolls, hands=asked.seat_hands == "used")


class _FootSearch(_ContactSearch):
    """Search for the contacts of a human on its feet."""

    def __init__(
        self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator,
        begin: Stage | None = None, handling: Handling = FREE_HANDS,
    ) -> None:  # fmt: skip
        super().__init__(scenario, body, scene, rng)
        self._begin = begin
        self._reference = handling.applied(body, posture_style_of(scenario.file.manner).posture(body))
        asked = replace(self._asked(), forearms_beside=False)
        self._poser = contacts.PostureFinder(body, scene, self._reference, asked)
        self._places = self._endpoints(self._poser)
        self._brace: Brace | None = None
        self._braces: list[Brace] = []
        self._start: Stage | None = None
        self._seat: Stage | None = None

    def run(self) -> ContactSearch:
        start = self._begin or stage_at(self._places, self._scenario, "start")
        if isinstance(start, str):
            return self._tally.failed(start, "start")
        goal = self._goal(start)
        if isinstance(goal, str):
            return self._tally.failed(goal, "goal")
        if "buttocks" in goal.contacts:
            self._seat, rising = goal, contacts.leave_seat(self._poser, goal, frozenset(FEET))
            if rising.failure is not None:
                return self._tally.failed(f"the goal: {rising.failure}", "goal")
            goal = rising.stages[-1]
        self._start, walk, crawl = start, self._searched(start, goal), None
        if walk.search.climbs() and self._brace is None:  # who can crawl below does not climb over
            crawl = self._crawl(walk, start, goal)
            if crawl.plan is not None:
                return self._result(crawl)
        found = self._walked(start, walk)
        walk = self._search
        if found.plan is None and isinstance(walk, WalkSearch) and walk.search.walled_off() is not None:
            crawl = crawl or self._crawl(walk, start, goal)
            found = replace(crawl, failure=f"{found.failure}; crawling: {crawl.failure}")
        return self._result(found)

    def _crawl(self, walk: WalkSearch, start: Stage, goal: Stage) -> Extension:
        """The way on hands and knees below what is too low to walk under."""
        self._search = contacts.CrawlSearch(
            self._poser, self._places, start, goal, self._scenario.contacts.friction,
            lambda first, last: self._searched(first, last).run(), walk.settings,
        )  # fmt: skip
        return self._search.run()

    def _completed(self, plan: ContactPlan) -> tuple[ContactPlan, Scenario | None] | str:
        whole = plan
        if self._seat is not None:
            whole = contacts.take_seat(self._poser, plan, self._seat)
        elif self._brace is not None:
            whole = with_hands(self._body, plan, self._brace)
        return whole if isinstance(whole, str) else (whole, with_supports(self._scenario, whole))

    def _searched(self, start: Stage, goal: Stage) -> WalkSearch:
        options = self._scenario.contacts
        settings = contacts.WalkSettings(stride=options.stride_m, grasp_force=options.grasp_force_N)
        return WalkSearch(self._poser, start, goal, options.friction, settings)

    def _goal(self, start: Stage) -> Stage | str:
        """Goal, or the reason why there is none; for an act, on the level of the start."""
        act = act_of(self._scenario)
        if act is None:
            return stage_at(self._places, self._scenario, "goal")
        samples = sample_limbs(self._body, self._rng, natural=self._natural)
        friction, model = self._scenario.contacts.friction, self._scenario.contact_model.friction
        result = find_braced_posture(
            self._body, self._scene, samples, act, start.com[:2],
            level=min(contact.position[2] for contact in start.contacts.values()),
            settings=BraceSettings(friction=friction, friction_model=model), reference=self._reference,
        )  # fmt: skip
        self._tally.summary["act_places"] = result.tried
        if result.brace is None:
            return result.failure or ""
        self._braces = [result.brace, *result.others]
        return self._next_act()

    def _next_act(self) -> Stage:
        """Goal of the way to the next best posture that acts."""
        self._brace = self._braces.pop(0)
        return arrival(self._brace)

    def _walked(self, start: Stage, walk: WalkSearch) -> Extension:
        """The way to a goal, at an act to the first posture that acts to which there is one."""
        while True:
            self._search = walk
            found = walk.run()
            if found.plan is not None or not self._braces:
                return found
            walk = self._searched(start, self._next_act())

    def _again(self, phase: int, reason: str) -> ContactSearch:
        """Another way, or another posture that acts where the phase comes after the way."""
        walked = self._search is not None and self._search.refuse(phase)
        if walked or not self._braces or self._start is None:
            return super()._again(phase, reason)
        return self._result(self._walked(self._start, self._searched(self._start, self._next_act())))


STANDING_HEIGHT = 0.92
"""Height of the root of a standing person of 1.75 m, the unit in which bodies are compared [m]."""
SMALLEST = 0.3
"""Least factor on distances that are kept for safety, however small the body."""
STRIDE = 0.4
"""Stride of a creature as a share of the reach of its limbs; our choice."""
AROUND_LIMBS = 1.3
"""Room around start and goal in which the root is led, in heights of a standing root."""
STEEPEST = float(np.deg2rad(50.0))
"""Largest slope on which a limb that cannot hold on counts as within reach; our choice."""
LEAN = 0.35
"""Largest lean of the root in any direction [rad]; our choice."""
RETREATS = (0.25, 0.45)
"""Distances from a climber's best place before its holds at which it is tried as well, by the reach."""
RUNG_GREED = ((6.0, 1500),)
"""Factor on the estimate on rungs, where every limb is away from its best place: less finds nothing."""
RUNG_STRIDES = 2.2
"""Longest way of a limb on rungs, in strides: past one rung and not past two; our choice."""
NEAR_GOAL = 0.2
"""Distance from its goal at which a climber's root has arrived: holds are where they are [m]; our choice."""

RESTED = 0.5
"""Share of the stages of a walk with rests up to which further ones are tried, before it rests at all."""


class _LimbSearch(_ContactSearch):
    """Search for contacts of the limbs that a scenario names, all limbs where it names none."""

    def __init__(self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(scenario, body, scene, rng)
        names = scenario.contact_limbs
        self._limbs = tuple(limb_named(body, name) for name in names) if names else body.limbs
        self._kinds = {limb.name: _kind(body, limb) for limb in self._limbs}
        self._size = float(body.standing_posture()[2]) / STANDING_HEIGHT
        safe = max(self._size, SMALLEST)
        self._reference = np.array(body.standing_posture() if body.stature is None else self._upright())
        self._poser = contacts.PostureFinder(body, scene, self._reference, self._asked().scaled(safe))
        self._samples = samples = sample_limbs(body, np.random.default_rng(0), natural=self._natural)
        ends = [limb for limb in self._limbs if not is_further(body, limb)] or self._limbs
        self._reach = float(np.mean([samples[limb.name].hull[1] for limb in ends]))

    def _upright(self) -> FloatArray:
        """(nq,) posture of a person who stands, on rungs with bent legs, soles on the ground."""
        body = self._body
        if not self._on_rungs:
            return posture_style_of(self._scenario.file.manner).posture(body)
        q = LADDER.posture(body)
        state, feet = Configuration(body, q), [x.effector for x in self._limbs if x.kind is ContactKind.SOLE]
        q[2] -= min((float(state.effector_placement(foot)[1][2]) for foot in feet), default=0.0)
        return q

    def run(self) -> ContactSearch:
        goal = self._goal()
        if isinstance(goal, str):
            return self._tally.failed(goal, "goal")
        result: ContactSearch | None = None
        for first in islice(self._starts(goal), self._scenario.contacts.attempts):
            if first.stage is None:
                return result or self._tally.failed(first.failure or "", "start")
            # Who climbs a ladder goes straight first: a guide's stiff trunk has no room before it.
            for guided in (False, True) if self._on_rungs else (True,):
                self._search = self._searched(first.stage, goal, guided=guided)
                result = self._result(self._search.run())
                if result.plan is not None:
                    return result
        return result or self._tally.failed("no start", "start")

    def _holds(self, start: FloatArray, goal: FloatArray) -> list[contacts.LimbHolds]:
        return contacts.limb_holds(
            self._body, self._scene, self._limbs, self._kinds, contact_rules(self._scenario, self._body),
            self._reference, self._samples, np.array([start, goal]), self._reach,
        )  # fmt: skip

    def _searched(self, start: Stage, goal: FloatArray, *, guided: bool) -> contacts.LimbSearch:
        holds = self._holds(start.q[:7], goal)
        led = (lambda: self._guided(start.q[:7], goal)) if guided else None
        return contacts.LimbSearch(self._poser, holds, start, goal, self._reach, self._settings(), led)

    @property
    def _climbs(self) -> bool:
        return self._scenario.file.task.goal.posture == CLIMBING

    @property
    def _hangs(self) -> bool:
        """Whether a person starts on holds."""
        return self._body.stature is not None and self._scenario.file.task.start.posture == CLIMBING

    @property
    def _on_rungs(self) -> bool:
        """Whether whole soles of a person carry, or what of them is on rungs; not their front alone."""
        return self._body.stature is not None and self._scenario.contacts.forefoot_m is None

    def _settings(self) -> contacts.LimbSettings:
        """Lengths by the size of the body, times by how fast a body of that size moves."""
        plain, pace, safe = contacts.LimbSettings(), float(np.sqrt(self._size)), max(self._size, SMALLEST)
        if self._body.stature is not None:
            plain = replace(
                plain, turns=False, around=1.5, beyond=0.1, price=1.0, brief=0.0, comfort=10.0, sway=0.3
            )  # fmt: skip
        if self._on_rungs:
            plain = replace(
                plain, retreats=RETREATS, farthest=RUNG_STRIDES, greeds=RUNG_GREED, hinge_pace=HOLDING_PACE,
                com_acceleration=HOLDING_ACCELERATION,
            )  # fmt: skip
        return replace(
            plain, stride=STRIDE * self._reach, lets_go=self._body.stature is not None and not self._climbs,
            lift=plain.lift * safe, swing_duration=plain.swing_duration * pace,
            swing_speed=plain.swing_speed * pace, shift_duration=plain.shift_duration * pace,
            hinge_pace=plain.hinge_pace / pace,
            goal_distance=NEAR_GOAL if self._climbs or self._hangs else plain.goal_distance * safe,
        )  # fmt: skip

    def _starts(self, goal: FloatArray) -> Iterator[Endpoint]:
        """Postures at the start, the best first, or the reason why there is none."""
        state = self._scenario.file.task.start
        if self._body.stature is not None and not self._hangs:
            result = stage_at(self._standing_places, self._scenario, "start")
            yield Endpoint(None, result) if isinstance(result, str) else Endpoint(result)
            return
        q = self._standing(state)
        holds = self._holds(q[:7], goal)
        for result in contacts.starts_on_limbs(self._poser, holds, q, self._settings().shift_duration):
            where = f"the start: no posture at {np.array(state.at).round(3).tolist()} m: "
            yield result if result.stage is not None else Endpoint(None, f"{where}{result.failure}")

    def _goal(self) -> FloatArray | str:
        """(7,) pose of the root at the goal, or why there is none."""
        if self._body.stature is not None and not self._climbs:
            result = stage_at(self._standing_places, self._scenario, "goal")
            return result if isinstance(result, str) else result.q[:7]
        return self._standing(self._scenario.file.task.goal)[:7]

    @cached_property
    def _standing_places(self) -> Endpoints:
        """Starts and goals on feet, in postures like standing."""
        return self._endpoints(contacts.PostureFinder(self._body, self._scene, settings=self._asked()))

    def _standing(self, state: StateSection) -> FloatArray:
        """(nq,) reference posture at a place, as high as if it stood there."""
        at, yaw = np.array(state.at), float(np.deg2rad(state.heading_deg or 0.0))
        level = self._level(at) if state.height_m is None else state.height_m
        return carried_to(self._reference, at, yaw, level)

    def _level(self, at: FloatArray) -> float:
        """Height of the lowest surface at a place [m]."""
        levels = [
            float(surface.polygon[0, 2])
            for surface in self._scene.surfaces_facing((0.0, 0.0, 1.0), 0.1)
            if surface.outside(np.array([[*at, surface.polygon[0, 2]]]))[0] <= 0.0
        ]
        return min(levels, default=self._scenario.start_level)

    def _guided(self, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """(n, 3) places of the root on a guide between two poses, where one is needed [m]."""
        ends, reaches = np.array([start, goal]), [self._samples[limb.name].reach for limb in self._limbs]
        abstraction = guide.abstraction_of(self._body, reaches)
        world = guide.GuideWorld(self._scene, abstraction, self._region(ends), self._condition())
        found = guide_root(world, ends, self._rng)
        self._tally.count_guide(found)
        return found.places

    def _region(self, ends: FloatArray) -> guide.SamplingRegion:
        """Box around start and goal; headings between theirs, and a little beyond."""
        room = AROUND_LIMBS * STANDING_HEIGHT * self._size
        headings = np.unwrap([contacts.heading_of(pose) for pose in ends])
        yaw, lean = (headings.min() - LEAN, headings.max() + LEAN), (-LEAN, LEAN)
        low, high = ends[:, :3].min(axis=0) - room, ends[:, :3].max(axis=0) + room
        return guide.SamplingRegion(low, high, yaw=yaw, pitch=lean, roll=lean)

    def _condition(self) -> guide.Condition:
        """Limbs that cannot hold on reach something to stand on: all but two of more than four of them."""
        bearing = [
            limb.name for limb in self._limbs
            if self._kinds[limb.name] is not ContactKind.GRASP and not is_further(self._body, limb)
        ]  # fmt: skip
        least = len(bearing) if len(bearing) <= 4 else len(bearing) - 2
        rule = guide.LimbRule(tuple(bearing) if least == len(bearing) else (), least)
        surface = guide.UsableSurface((0.0, 0.0, 1.0), STEEPEST)
        return guide.Condition((rule,), dict.fromkeys(bearing, surface))


def _kind(body: BodyModel, limb: Limb) -> ContactKind:
    """A person's hands hold on; all other limbs touch in their own way."""
    return ContactKind.GRASP if body.stature is not None and "hand" in limb.effector else limb.kind


def find_supports(
    scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator,
    begin: Stage | None = None, handling: Handling = FREE_HANDS,
) -> ContactSearch:  # fmt: skip
    """Plan the contacts of a scenario that gives start and goal alone.

    Args:
        begin: Contacts and posture at the start, of a body on its feet; found when omitted.
        handling: Joints that stay.

    Raises:
        BodyError: If the scenario names a limb that the body has not.
    """
    if scenario.contact_limbs is None:
        return _FootSearch(scenario, body, scene, rng, begin, handling).run()
    return _LimbSearch(scenario, body, scene, rng).run()


def plan_contacts(context: RunContext, report: Report) -> RunContext | None:
    """Plan the supports of a scenario that lists none; None where there are none.

    Raises:
        ScenarioError: If contacts of any limbs are asked for without the refinement, which alone takes them.
    """
    scenario = context.scenario
    if scenario.contact_limbs is not None and not scenario.refines:
        raise scenario.error(("wholebody", "method"), "is follow; valid: refine, for contacts of any limbs")
    report.progress("contacts", 0.0)
    rng = np.random.default_rng(scenario.seed)
    result = find_supports(scenario, context.body, context.scene, rng, context.start, context.handling)
    planned = _with_contacts(context, report, result)
    if planned is None or result.plan is None or scenario.contact_limbs is not None or scenario.refines:
        return planned
    paces = (Pace.PASSING,) * len(result.plan.stages)
    return _passed(report, planned, Passing(scenario, planned, paces)) or planned


def _passed(report: Report, context: RunContext, passing: Passing) -> RunContext | None:
    """The task of a body that passes changes of contact; None where it rests at all of them, or as before."""
    if context.plan is None:
        return None
    walking = without_rests(passing.asked, context.plan, passing.paces, rolls=passing.rolls)
    if walking is None or walking.file == context.scenario.file:
        return None
    report.keep_scenario(walking)
    return replace(passing.resting.with_supports(walking), passing=passing)


def slower(context: RunContext, report: Report, stage: int | None) -> RunContext | None:
    """The walk after a failure: with more time, then with rests around the stage of it, then everywhere.

    A body that bends below something, on feet that roll, walks on flat ones first.
    A plan of the centre of mass that fails has rests there at once, and one that fails again somewhere else
    has them there, too, up to :data:`RESTED` of the stages. A posture that is missing on feet that roll is
    sought on flat ones before. None where the body rests at all changes, and after a success.
    """
    passing, failure = context.passing, report.failure
    if failure is None or passing is None:
        return None
    unplanned, moved = failure.stage == "centroidal", report.summary["wholebody"] is not None
    report.try_again()
    paces, walking = passing.paces, None
    if passing.rolls and _bends(context):
        walking = _passed(report, context, replace(passing, rolls=False))
        if walking is not None:
            return walking
    if moved and Pace.PASSING in paces:
        paces = tuple(max(pace, Pace.UNHURRIED) for pace in paces)
    elif stage is not None and (
        (moved and Pace.RESTING not in paces)
        or (unplanned and paces.count(Pace.RESTING) <= RESTED * len(paces))
    ):
        there = range(stage - 1, stage + 2)
        paces = tuple(Pace.RESTING if k in there else pace for k, pace in enumerate(paces))
    if paces != passing.paces:
        walking = _passed(report, context, replace(passing, paces=paces))
    elif passing.rolls and not moved and not unplanned:
        walking = _passed(report, context, replace(passing, rolls=False))
    if walking is None:
        report.keep_scenario(passing.resting.scenario)
    return walking or passing.resting


def _bends(context: RunContext) -> bool:
    """Whether the body bends below something on its way."""
    supports = context.scenario.file.supports
    return supports is not None and any(phase.com_below is not None for phase in supports.phases)


def plan_contacts_again(context: RunContext, report: Report, phase: int) -> RunContext | None:
    """Plan the supports again without the step of a phase, for which a later stage failed.

    None where there is no other plan; the failure of the later stage stays then.
    """
    failure, again = report.failure, context.search_again
    if failure is None or again is None or context.plan is None:
        return None
    result = again(phase, failure.reason)
    if result.plan is None:
        return None
    report.try_again(phase)
    return _with_contacts(context, report, result)


def _with_contacts(context: RunContext, report: Report, result: ContactSearch) -> RunContext | None:
    report.summary["contacts"] = {**result.summary, "refused": report.refused}
    report.keep("contacts", result.to_dict(report.transform))
    if result.plan is None:
        report.fail("contacts", result.failure or "", where=result.where)
        return None
    report.keep_contact_plan(result.plan)
    planned = replace(context, plan=result.plan, search_again=result.again)
    if not context.scenario.refines and result.scenario is not None:
        planned = planned.with_supports(result.scenario)
        report.keep_scenario(result.scenario)
    report.progress("contacts", 1.0)
    return planned
