"""Contacts of any limbs from start and goal: guide, then algorithm 7 ([Tonneau2015]_ chapters 6 and 7)."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from manikin.body import BodyModel, Limb, limb_named
from manikin.body.limbs import is_further
from manikin.contact import ContactKind
from manikin.contact_planning import (
    Endpoints,
    LimbExtendSettings,
    LimbPlaces,
    LimbStart,
    Poser,
    PoserSettings,
    extend_limbs,
    heading_of,
    sample_limbs,
    starts_on_limbs,
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
from manikin.scenarios.contact_rules import contact_rules
from manikin.scenarios.start import CLIMBING, carried_to
from manikin.scene import Scene
from manikin.spatial import FloatArray
from manikin.stages.along_guides import SearchTally
from manikin.stages.ends import stage_at
from manikin.stages.found_contacts import ContactSearch
from manikin.stages.root_guide import RootGuide, guide_root
from manikin.wholebody.manner import manner_of

STANDING_HEIGHT = 0.92
"""Height of the root of a standing person of 1.75 m, the unit in which bodies are compared [m]."""

SMALLEST = 0.3
"""Least factor on distances that are kept for safety, however small the body."""

STRIDE = 0.4
"""Stride of a creature as a share of the reach of its limbs; our choice."""

AROUND = 1.3
"""Room around start and goal in which the root is led, in heights of a standing root."""

STEEPEST = float(np.deg2rad(50.0))
"""Largest slope on which a limb that cannot hold on counts as within reach; our choice."""

LEAN = 0.35
"""How far the root may lean in any direction [rad]; our choice."""

NEAR_GOAL = 0.2
"""Distance from its goal at which a climber's root has arrived: holds are where they are [m]; our choice."""


def find_limb_contacts(
    scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator
) -> ContactSearch:
    """Plan contacts of the limbs that a scenario names, all limbs where it names none.

    Args:
        scenario: Without supports.
        body: Its body.
        scene: Its scene.
        rng: Source of all randomness.

    Raises:
        BodyError: If the body has no such limb.
    """
    return _LimbSearch(scenario, body, scene, rng).run()


class _LimbSearch:
    def __init__(self, scenario: Scenario, body: BodyModel, scene: Scene, rng: np.random.Generator) -> None:
        self._tally = SearchTally()
        self._scenario, self._body, self._scene, self._rng = scenario, body, scene, rng
        self._limbs = _limbs(body, scenario.contact_limbs or ())
        self._kinds = {limb.name: _kind(body, limb) for limb in self._limbs}
        self._size = float(body.standing_posture()[2]) / STANDING_HEIGHT
        safe = max(self._size, SMALLEST)
        self._reference = _as_climbing(body, scenario.manner)
        self._natural = scenario.contacts.ranges == "learnt"
        settings = PoserSettings(natural=self._natural, friction_model=scenario.contact_model.friction)
        self._poser = Poser(body, scene, self._reference, settings.scaled(safe))
        samples = sample_limbs(body, np.random.default_rng(0), natural=self._natural)
        self._places = LimbPlaces(
            body, scene, self._limbs, self._kinds, contact_rules(scenario, body), self._reference, samples
        )
        volumes = [samples[limb.name].reach for limb in self._limbs]
        self._abstraction: Abstraction = abstraction_of(body, volumes)

    def run(self) -> ContactSearch:
        goal, starts = self._goal(), self._starts()
        if isinstance(goal, str):
            return self._tally.failed(goal, "goal")
        first = next(starts)
        if first.stage is None:
            return self._tally.failed(first.reason, "start")
        # Another guide begins at another start, as long as there are some.
        stages = [first.stage]
        others = (item.stage for item in starts if item.stage is not None)

        def lead() -> RootGuide:
            if self._tally.summary["attempts"] > 0:
                stages.extend(islice(others, 1))
            return self._guide(stages[-1].q[:7], goal)

        settings = self._settings()
        return self._tally.along_guides(
            self._scenario.contacts.attempts,
            lead,
            lambda line, _: extend_limbs(self._poser, self._places, line, stages[-1], settings),
        )

    @property
    def _climbs(self) -> bool:
        return self._scenario.file.task.goal.posture == CLIMBING

    def _settings(self) -> LimbExtendSettings:
        """Lengths by the size of the body, times by how fast a body of that size moves."""
        options, plain = self._scenario.contacts, LimbExtendSettings()
        size, pace = self._size, float(np.sqrt(self._size))
        human = self._body.stature is not None
        return LimbExtendSettings(
            stride=options.stride_m * size if human else STRIDE * self._places.reach,
            same_place=plain.same_place * size,
            lift=plain.lift * max(size, SMALLEST),
            swing_duration=plain.swing_duration * pace,
            swing_speed=plain.swing_speed * pace,
            shift_duration=plain.shift_duration * pace,
            hinge_pace=plain.hinge_pace / pace,
            goal_distance=plain.goal_distance * max(size, SMALLEST) if not self._climbs else NEAR_GOAL,
        )

    def _starts(self) -> Iterator[LimbStart]:
        """Where the body is at the start, the best first, or why it cannot be there."""
        state = self._scenario.file.task.start
        if self._body.stature is not None and state.posture != CLIMBING:
            found = stage_at(self._endpoints(), self._scenario, "start")
            yield LimbStart(None, found) if isinstance(found, str) else LimbStart(found)
            return
        at, yaw = np.array(state.at), float(np.deg2rad(state.heading_deg or 0.0))
        q = self._standing(at, yaw, state.height_m)
        for found in starts_on_limbs(self._poser, self._places, q, self._settings().shift_duration):
            where = f"the start: no posture at {at.round(3).tolist()} m: "
            yield found if found.stage is not None else LimbStart(None, where + found.reason)

    def _endpoints(self) -> Endpoints:
        return Endpoints(
            self._body, self._scene, self._scenario.contacts.friction,
            natural=self._natural, friction_model=self._scenario.contact_model.friction,
        )  # fmt: skip

    def _goal(self) -> FloatArray | str:
        """(7,) pose of the root at the goal, or why there is none."""
        if self._body.stature is not None and not self._climbs:
            found = stage_at(self._endpoints(), self._scenario, "goal")
            return found if isinstance(found, str) else found.q[:7]
        state = self._scenario.file.task.goal
        yaw = float(np.deg2rad(state.heading_deg or 0.0))
        return self._standing(np.array(state.at), yaw, state.height_m)[:7]

    def _standing(self, at: FloatArray, yaw: float, height: float | None) -> FloatArray:
        """(nq,) reference posture at a place, as high as if it stood there."""
        level = height if height is not None else self._scenario.start_level
        return carried_to(self._reference, at, yaw, level)

    def _guide(self, start: FloatArray, goal: FloatArray) -> RootGuide:
        ends = np.array([start, goal])
        world = World(self._scene, self._abstraction, self._region(ends), self._condition())
        return guide_root(world, ends, self._rng)

    def _region(self, ends: FloatArray) -> SamplingRegion:
        """Box around start and goal; headings between theirs, and a little beyond."""
        room = AROUND * STANDING_HEIGHT * self._size
        headings = np.unwrap([heading_of(pose) for pose in ends])
        yaw = (headings.min() - LEAN, headings.max() + LEAN)
        lean = (-LEAN, LEAN)
        return SamplingRegion(
            ends[:, :3].min(axis=0) - room, ends[:, :3].max(axis=0) + room, yaw=yaw, pitch=lean, roll=lean
        )

    def _condition(self) -> Condition:
        """What cannot hold on reaches something to stand on: all but two of more than four such limbs."""
        bearing = [
            limb.name for limb in self._limbs
            if self._kinds[limb.name] is not ContactKind.GRASP and not is_further(self._body, limb)
        ]  # fmt: skip
        least = len(bearing) if len(bearing) <= 4 else len(bearing) - 2
        rule = LimbRule(tuple(bearing) if least == len(bearing) else (), least)
        return Condition((rule,), dict.fromkeys(bearing, UsableSurface((0.0, 0.0, 1.0), STEEPEST)))


def _limbs(body: BodyModel, names: tuple[str, ...]) -> tuple[Limb, ...]:
    return tuple(limb_named(body, name) for name in names) if names else body.limbs


def _kind(body: BodyModel, limb: Limb) -> ContactKind:
    """A person's hands hold on; all other limbs touch in their own way."""
    return ContactKind.GRASP if body.stature is not None and "hand" in limb.effector else limb.kind


def _as_climbing(body: BodyModel, manner: str) -> FloatArray:
    """(nq,) posture to be like: of a manner for a person, else standing."""
    if body.stature is None:
        return np.array(body.standing_posture())
    return manner_of(manner).posture(body)
