"""Contacts of feet from start and goal: guide, contacts, and the scenario with what was found.

For a scenario without supports whose body goes on its feet ([Tonneau2015]_ chapters 6 and 7); the hands
join in where it ends with an act.
"""

from dataclasses import replace

import numpy as np

from manikin.acting import Brace, BraceSettings, arrival, find_brace, with_hands
from manikin.body import BodyModel, limbs_of, reach_volume
from manikin.contact_planning import (
    ContactPlan,
    Endpoints,
    ExtendSettings,
    Extension,
    GuideLine,
    Stage,
    extend,
    heading_of,
    sample_limbs,
)
from manikin.reachability import (
    Abstraction,
    Condition,
    LimbRule,
    SamplingRegion,
    UsableSurface,
    World,
    abstraction_of,
)
from manikin.scenarios import Scenario
from manikin.scenarios.planned import with_supports
from manikin.scene import Scene
from manikin.spatial import FloatArray
from manikin.stages.act import act_of
from manikin.stages.along_guides import SearchTally
from manikin.stages.ends import stage_at
from manikin.stages.found_contacts import ContactSearch
from manikin.stages.root_guide import RootGuide, guide_root
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


def find_foot_contacts(
    scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator
) -> ContactSearch:
    """Plan the supports of a body that goes on its feet.

    Args:
        scenario: Without supports.
        body: A human.
        scene: Its scene.
        rng: Source of all randomness.
    """
    return _FootSearch(scenario, body, scene, rng).run()


class _FootSearch:
    def __init__(self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator) -> None:
        self._tally = SearchTally()
        self._scenario, self._body, self._scene, self._rng = scenario, body, scene, rng
        self._reference = manner_of(scenario.manner).posture(body)
        self._natural = scenario.contacts.ranges == "learnt"
        self._endpoints = Endpoints(
            body, scene, scenario.contacts.friction, self._reference,
            natural=self._natural, friction_model=scenario.contact_model.friction,
        )  # fmt: skip
        self._brace: Brace | None = None

    def run(self) -> ContactSearch:
        start = stage_at(self._endpoints, self._scenario, "start")
        if isinstance(start, str):
            return self._tally.failed(start, "start")
        goal = self._goal(start)
        if isinstance(goal, str):
            return self._tally.failed(goal, "goal")
        standing = self._endpoints.risen(start) if "buttocks" in start.contacts else None
        if standing is not None and standing.stage is None:
            return self._tally.failed(standing.failure or "", "start")
        first = start if standing is None or standing.stage is None else standing.stage
        found = self._tally.along_guides(
            self._scenario.contacts.attempts,
            lambda: self._guide(first, goal),
            lambda line, number: self._follow(line, start, goal, again=number > 0),
        )
        if found.plan is None:
            return found
        return replace(found, scenario=with_supports(self._scenario, found.plan))

    def _follow(self, line: GuideLine, start: Stage, goal: Stage, *, again: bool) -> Extension:
        """Contacts along a guide, with the hands on the object where there is an act."""
        settings = self._settings(again=again)
        found = extend(self._body, self._scene, line, start, goal, settings, self._reference)
        return found if found.plan is None else replace(found, plan=self._acting(found.plan))

    def _settings(self, *, again: bool) -> ExtendSettings:
        """How contacts are looked for; along another guide, which is much like the first, not as long."""
        options = self._scenario.contacts
        settings = ExtendSettings(
            stride=options.stride_m, friction=options.friction, natural=self._natural,
            friction_model=self._scenario.contact_model.friction,
        )  # fmt: skip
        return replace(settings, searches=SEARCHES_AGAIN) if again else settings

    def _goal(self, start: Stage) -> Stage | str:
        """Where to go, or why there is no such place; for an act, on the level of the start."""
        act = act_of(self._scenario)
        if act is None:
            return stage_at(self._endpoints, self._scenario, "goal")
        samples = sample_limbs(self._body, self._rng, natural=self._natural)
        friction, model = self._scenario.contacts.friction, self._scenario.contact_model.friction
        found = find_brace(
            self._body, self._scene, samples, act, start.com[:2],
            level=min(contact.position[2] for contact in start.contacts.values()),
            settings=BraceSettings(friction=friction, friction_model=model), reference=self._reference,
        )  # fmt: skip
        self._tally.summary["act_places"] = found.tried
        if found.brace is None:
            return found.failure or ""
        self._brace = found.brace
        return arrival(self._body, found.brace)

    def _acting(self, way: ContactPlan) -> ContactPlan:
        """The way, and the hands on the object where there is an act."""
        return way if self._brace is None else with_hands(self._body, way, self._brace)

    def _guide(self, start: Stage, goal: Stage) -> RootGuide:
        ends = np.array([start.q[:7], goal.q[:7]])
        world = World(self._scene, self._abstraction(), _region(ends), _condition())
        return guide_root(world, ends, self._rng)

    def _abstraction(self) -> Abstraction:
        volumes = [
            reach_volume(self._body, limb, np.random.default_rng(0), natural=self._natural)
            for limb in limbs_of(self._body)
            if limb.name in LEGS
        ]
        return abstraction_of(self._body, volumes)


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
