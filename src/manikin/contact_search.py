"""From start and goal to supports: guide, contacts, and the scenario with what was found.

The first stage of the pipeline for a scenario that lists no supports ([Tonneau2015]_ chapters 6 and 7).
"""

import time as clock
from dataclasses import replace
from typing import Any

import numpy as np

from manikin.act_stage import act_of
from manikin.acting import Brace, BraceSettings, arrival, find_brace, with_hands
from manikin.body import BodyModel, limbs_of, reach_volume
from manikin.contact_planning import (
    ContactPlan,
    Endpoints,
    ExtendSettings,
    GuideLine,
    Habit,
    Stage,
    extend,
    heading_of,
    sample_limbs,
)
from manikin.found_contacts import ContactSearch
from manikin.limb_contact_search import find_limb_contacts
from manikin.reachability import (
    Abstraction,
    Condition,
    GuideTask,
    LimbRule,
    LocalPlanner,
    SamplingRegion,
    UsableSurface,
    World,
    abstraction_of,
    nearest_fit,
    plan_guide,
    relax,
)
from manikin.scenarios import Scenario
from manikin.scenarios.planned import with_supports
from manikin.scene import Scene
from manikin.spatial import FloatArray
from manikin.wholebody.manner import manner_of

LEGS = ("left_leg", "right_leg")

AROUND = 1.2
"""Room around start and goal in which the root is led [m]."""

PITCH = (-0.2, 1.0)
ROLL = (-0.1, 0.1)
"""How the root may lean [rad]; our choice for a body on its feet."""

TURN = float(np.deg2rad(75.0))
"""How far the root may turn from the headings of start and goal, where these are that close [rad]."""

SEARCHES_AGAIN = 60
"""Postures that are looked for along every guide after the first."""

GUIDE_POSES = 200
"""Poses by which the contact planner knows a guide."""


def find_supports(
    scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator
) -> ContactSearch:
    """Plan the contacts of a scenario that gives start and goal alone.

    Args:
        scenario: Without supports.
        body: Its body.
        scene: Its scene.
        rng: Source of all randomness.
    """
    if scenario.contact_limbs is not None:
        return find_limb_contacts(scenario, body, scene, rng)
    return _Search(scenario, body, scene, rng).run()


class _Search:
    def __init__(self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator) -> None:
        self._began = clock.perf_counter()
        self._scenario, self._body, self._scene, self._rng = scenario, body, scene, rng
        self._reference = manner_of(scenario.manner).posture(body)
        self._endpoints = Endpoints(body, scene, scenario.contacts.friction, self._reference)
        self._brace: Brace | None = None
        self._summary: dict[str, Any] = {
            "attempts": 0, "steps": None, "phases": None, "guide_length_m": None, "guide_samples": 0,
            "postures": 0, "backtracks": 0, "guide_wall_s": 0.0, "wall_s": 0.0,
        }  # fmt: skip

    def run(self) -> ContactSearch:
        start = self._end("start")
        if isinstance(start, str):
            return self._failed(start, "start")
        goal = self._end("goal") if self._scenario.act is None else self._place_to_act(start)
        if isinstance(goal, str):
            return self._failed(goal, "goal")
        standing = self._endpoints.risen(start) if "buttocks" in start.contacts else None
        if standing is not None and standing.stage is None:
            return self._failed(standing.failure or "", "start")
        first = start if standing is None or standing.stage is None else standing.stage
        for number in range(self._scenario.contacts.attempts):
            self._summary["attempts"] += 1
            line, reason = self._guide(first, goal)
            if line is None:
                return self._failed(reason, "guide")
            settings = self._settings(again=number > 0)
            extension = extend(self._body, self._scene, line, start, goal, settings, self._reference)
            self._summary["postures"] += extension.searches
            self._summary["backtracks"] += extension.backtracks
            if extension.plan is not None:
                return self._found(self._acting(extension.plan), line)
            reason = extension.failure or ""
        return self._failed(reason, "contacts")

    def _settings(self, *, again: bool) -> ExtendSettings:
        """How contacts are looked for; along another guide, which is much like the first, not as long."""
        options = self._scenario.contacts
        settings = ExtendSettings(stride=options.stride_m, friction=options.friction)
        return replace(settings, searches=SEARCHES_AGAIN) if again else settings

    def _end(self, end: str) -> Stage | str:
        """Start or goal, or why there is none."""
        state = getattr(self._scenario.file.task, end)
        found = self._endpoints.find(
            np.array(state.at), np.deg2rad(state.heading_deg or 0.0), Habit(state.posture or "standing"),
            state.height_m,
        )  # fmt: skip
        return found.stage or f"the {end}: {found.failure}"

    def _place_to_act(self, start: Stage) -> Stage | str:
        """Where to stand for the act, on the level of the start, or why it cannot be done."""
        act = act_of(self._scenario)
        if act is None:
            return "there is no act"
        samples = sample_limbs(self._body, self._rng)
        friction = self._scenario.contacts.friction
        found = find_brace(
            self._body, self._scene, samples, act, start.com[:2],
            level=min(contact.position[2] for contact in start.contacts.values()),
            settings=BraceSettings(friction=friction), reference=self._reference,
        )  # fmt: skip
        self._summary["act_places"] = found.tried
        if found.brace is None:
            return found.failure or ""
        self._brace = found.brace
        return arrival(self._body, found.brace)

    def _acting(self, way: ContactPlan) -> ContactPlan:
        """The way, and the hands on the object where there is an act."""
        return way if self._brace is None else with_hands(self._body, way, self._brace)

    def _guide(self, start: Stage, goal: Stage) -> tuple[GuideLine | None, str]:
        began = clock.perf_counter()
        ends = np.array([start.q[:7], goal.q[:7]])
        world = World(self._scene, self._abstraction(), _region(ends), _condition())
        checker = world.checker()
        fits = [nearest_fit(pose, checker) for pose in ends]
        ends = np.array([pose if fit is None else fit for pose, fit in zip(ends, fits, strict=True)])
        result = plan_guide(world, GuideTask(*ends), self._rng)
        self._summary["guide_samples"] += result.statistics.samples
        if result.path is None:
            return None, result.failure or "no guide"
        planner = LocalPlanner(checker, tuple(ends))
        poses = relax(result.path.poses(np.linspace(0.0, 1.0, GUIDE_POSES)), planner, self._rng)
        line = GuideLine.through(poses)
        self._summary["guide_length_m"] = line.length
        self._summary["guide_wall_s"] += clock.perf_counter() - began
        return line, ""

    def _abstraction(self) -> Abstraction:
        volumes = [
            reach_volume(self._body, limb, np.random.default_rng(0))
            for limb in limbs_of(self._body)
            if limb.name in LEGS
        ]
        return abstraction_of(self._body, volumes)

    def _found(self, plan: ContactPlan, line: GuideLine) -> ContactSearch:
        self._summary.update(steps=plan.steps, phases=len(plan.stages))
        return ContactSearch(with_supports(self._scenario, plan), plan, line, self._done())

    def _failed(self, reason: str, where: str) -> ContactSearch:
        return ContactSearch(None, None, None, self._done(), reason, where)

    def _done(self) -> dict[str, Any]:
        return self._summary | {"wall_s": clock.perf_counter() - self._began}


def _region(ends: FloatArray) -> SamplingRegion:
    """Box around start and goal; headings between theirs, and a little beyond."""
    low, high = ends[:, :3].min(axis=0) - AROUND, ends[:, :3].max(axis=0) + AROUND
    low[2], high[2] = ends[:, 2].min() - 0.7, ends[:, 2].max() + 0.1
    headings = np.unwrap([heading_of(pose) for pose in ends])
    yaw = (headings.min() - TURN, headings.max() + TURN) if np.ptp(headings) <= TURN else None
    return SamplingRegion(low, high, yaw=yaw, pitch=PITCH, roll=ROLL)


def _condition() -> Condition:
    """Both legs reach something to stand on."""
    ground = UsableSurface((0.0, 0.0, 1.0), float(np.deg2rad(35.0)))
    return Condition((LimbRule(LEGS, len(LEGS)),), dict.fromkeys(LEGS, ground))
