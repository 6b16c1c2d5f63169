"""Search for contacts along guides of the root ([Tonneau2015]_ chapter 6), and what it found.

A guide is a way of the root from start to goal. One is followed after the other until there are contacts.
"""

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.numerics.spatial import FloatArray, PlanarTransform
from manikin.planning.contacts import ContactPlan, Endpoints, Extension, GuideLine, Habit, Stage
from manikin.planning.guide import GuideTask, GuideWorld, LocalPlanner, nearest_fit, plan_guide, relax
from manikin.scenarios import Scenario


def stage_at(endpoints: Endpoints, scenario: Scenario, end: str) -> Stage | str:
    """Contacts and posture at the start or the goal of a scenario, or the reason why there are none.

    Args:
        endpoints: Finds them.
        scenario: With start and goal.
        end: ``"start"`` or ``"goal"``.
    """
    state = getattr(scenario.file.task, end)
    heading, habit = float(np.deg2rad(state.heading_deg or 0.0)), Habit(state.posture or "standing")
    result = endpoints.find(np.array(state.at), heading, habit, state.height_m)
    return result.stage or f"the {end}: {result.failure}"


GUIDE_POSES = 200
"""Poses by which the contact planner knows a guide."""


@dataclass(frozen=True, eq=False)
class RootGuide:
    """A guide of the root, or the reason why there is none.

    Attributes:
        line: The way, or None.
        samples: Poses drawn in the search.
        wall_s: Wall time [s].
        failure: None, or the reason in one line.
    """

    line: GuideLine | None
    samples: int
    wall_s: float
    failure: str | None = None


def guide_root(world: GuideWorld, ends: FloatArray, rng: np.random.Generator) -> RootGuide:
    """Find a guide between two poses of the root.

    Args:
        world: Scene, abstraction of the body, region and condition of the way.
        ends: (2, 7) poses at start and goal; where they do not fit, the nearest that do are taken.
    """
    began = clock.perf_counter()
    checker = world.checker()
    fits = [nearest_fit(pose, checker) for pose in ends]
    ends = np.array([pose if fit is None else fit for pose, fit in zip(ends, fits, strict=True)])
    result = plan_guide(world, GuideTask(*ends), rng)
    samples = result.statistics.samples
    if result.path is None:
        return RootGuide(None, samples, clock.perf_counter() - began, result.failure or "no guide")
    poses = result.path.poses(np.linspace(0.0, 1.0, GUIDE_POSES))
    line = GuideLine.through(relax(poses, LocalPlanner(checker, tuple(ends)), rng))
    return RootGuide(line, samples, clock.perf_counter() - began)


@dataclass(frozen=True, eq=False)
class ContactSearch:
    """Supports for a scenario, or the reason why there are none.

    Attributes:
        scenario: The scenario with supports; None without a plan, and where a file cannot list such contacts.
        plan: The contacts with their postures, or None.
        guide: The root's way, or None.
        summary: The ``contacts`` block of the run's summary.
        failure: None, or the reason in one line.
        where: Stage of the search that failed.
        again: Searches on for a plan without the step of a phase, which failed for a reason; None where the
            search cannot.
    """

    scenario: Scenario | None
    plan: ContactPlan | None
    guide: GuideLine | None
    summary: Mapping[str, Any]
    failure: str | None = None
    where: str = ""
    again: "Callable[[int, str], ContactSearch] | None" = None

    def to_dict(self, transform_task_to_world: PlanarTransform) -> dict[str, Any]:
        """Guide and postures in plain values, in the world."""
        plan, transform = self.plan, transform_task_to_world
        return {
            **self.summary,
            "guide": None if self.guide is None else transform.poses(self.guide.poses).tolist(),
            "postures": None if plan is None else transform.poses(plan.postures).tolist(),
        }


class SearchTally:
    """Counts what a search for contacts does, and ends it.

    Attributes:
        summary: The ``contacts`` block of the run's summary so far.
    """

    def __init__(self) -> None:
        self._began = clock.perf_counter()
        self.summary: dict[str, Any] = {
            "attempts": 0, "steps": None, "phases": None, "guide_length_m": None, "guide_samples": 0,
            "postures": 0, "backtracks": 0, "guide_wall_s": 0.0, "wall_s": 0.0,
        }  # fmt: skip

    def along_guides(
        self, attempts: int, lead: Callable[[], RootGuide], follow: Callable[[GuideLine, int], Extension]
    ) -> ContactSearch:
        """Follow one guide after the other until contacts are found.

        Args:
            attempts: Most guides.
            lead: Finds a guide.
            follow: Finds contacts along it; told how many guides there were before.

        Returns:
            The plan, without a scenario, or why there is none.
        """
        reason = ""
        for number in range(attempts):
            guide = lead()
            self._count_guide(guide)
            if guide.line is None:
                return self.failed(guide.failure or "", "guide")
            extension = follow(guide.line, number)
            self.summary["postures"] += extension.searches
            self.summary["backtracks"] += extension.backtracks
            if extension.plan is not None:
                return self.found(extension.plan, guide.line)
            reason = extension.failure or ""
        return self.failed(reason, "contacts")

    def found(self, plan: ContactPlan, guide: GuideLine | None = None) -> ContactSearch:
        """A search that found contacts."""
        self.summary.update(steps=plan.steps, phases=len(plan.stages))
        return ContactSearch(None, plan, guide, self._done())

    def failed(self, reason: str, where: str) -> ContactSearch:
        """A search that found none."""
        return ContactSearch(None, None, None, self._done(), reason, where)

    def _count_guide(self, guide: RootGuide) -> None:
        self.summary["attempts"] += 1
        self.summary["guide_samples"] += guide.samples
        if guide.line is not None:
            self.summary["guide_length_m"] = guide.line.length
            self.summary["guide_wall_s"] += guide.wall_s

    def _done(self) -> dict[str, Any]:
        return self.summary | {"wall_s": clock.perf_counter() - self._began}
