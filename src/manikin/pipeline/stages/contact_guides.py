"""Search for contacts along guides of the root ([Tonneau2015]_ chapter 6), and what it found.

A guide is a way of the root from start to goal; it leads a search of limbs round what is in the straight way.
"""

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.numerics.spatial import FloatArray, PlanarTransform
from manikin.planning.contacts import ContactPlan, Endpoints, Habit, Stage
from manikin.planning.guide import GuideTask, GuideWorld, LocalPlanner, ReachabilityChecker, plan_guide
from manikin.scenarios import Scenario


def stage_at(endpoints: Endpoints, scenario: Scenario, end: str) -> Stage | str:
    """Contacts and posture at the ``"start"`` or ``"goal"`` of a scenario, or why there are none."""
    state = getattr(scenario.file.task, end)
    heading, habit = float(np.deg2rad(state.heading_deg or 0.0)), Habit(state.posture or "standing")
    result = endpoints.find(np.array(state.at), heading, habit, state.height_m)
    return result.stage or f"the {end}: {result.failure}"


@dataclass(frozen=True, eq=False)
class RootGuide:
    """Whether a guide of the root is needed, and it.

    Attributes:
        places: (n, 3) of the root on the way [m]; None where the straight way is free, or no way was found.
        samples: Poses drawn in the search.
        wall_s: Wall time [s].
    """

    places: FloatArray | None
    samples: int
    wall_s: float


SINKS = tuple(0.065 * np.arange(11))
"""Depths by which the root at an end of a guide may sink [m]; our choice."""
GUIDE_PLACES = 200
"""Places by which the contact planner knows a guide."""


def guide_root(world: GuideWorld, ends: FloatArray, rng: np.random.Generator) -> RootGuide:
    """Find a guide between two poses (2, 7) of the root, where the straight way is not free.

    A body may bend where the guide's stiff trunk has to sink: the nearest pose below that fits is taken.
    """
    began, checker = clock.perf_counter(), world.checker()
    fits = [_sunk(pose, checker) for pose in ends]
    ends = np.array([pose if fit is None else fit for pose, fit in zip(ends, fits, strict=True)])
    if any(fit is None for fit in fits) or LocalPlanner(checker, tuple(ends)).straight(*ends):
        return RootGuide(None, 0, clock.perf_counter() - began)
    result = plan_guide(world, GuideTask(*ends), rng)
    shares = np.linspace(0.0, 1.0, GUIDE_PLACES)
    places = None if result.path is None else result.path.poses(shares)[:, :3]
    return RootGuide(places, result.samples, clock.perf_counter() - began)


def _sunk(pose: FloatArray, checker: ReachabilityChecker) -> FloatArray | None:
    """The pose nearest below a (7,) one that satisfies the condition, or None."""
    down = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    return next((low for depth in SINKS if checker.holds(low := pose - depth * down)), None)


@dataclass(frozen=True, eq=False)
class ContactSearch:
    """Supports for a scenario, or the reason in one line why there are none.

    Attributes:
        scenario: The scenario with supports; None without a plan, and where a file cannot list such contacts.
        plan: The contacts with their postures, or None.
        guide: (n, 3) places of the root on a guide; None where the straight way is free [m].
        summary: The ``contacts`` block of the run's summary.
        where: Stage of the search that failed.
        again: Searches on for a plan without the step of a phase, which failed for a reason; None where the
            search cannot.
    """

    scenario: Scenario | None
    plan: ContactPlan | None
    guide: FloatArray | None
    summary: Mapping[str, Any]
    failure: str | None = None
    where: str = ""
    again: "Callable[[int, str], ContactSearch] | None" = None

    def to_dict(self, transform_task_to_world: PlanarTransform) -> dict[str, Any]:
        """Guide and postures in plain values, in the world."""
        plan, transform = self.plan, transform_task_to_world
        return {
            **self.summary,
            "guide": None if self.guide is None else transform.points(self.guide).tolist(),
            "postures": None if plan is None else transform.poses(plan.postures).tolist(),
        }


class SearchTally:
    """Counts what a search for contacts does, and ends it.

    Attributes:
        summary: The ``contacts`` block of the run's summary so far.
        guide: (n, 3) places of the root on its guide, if one is needed [m].
    """

    guide: FloatArray | None = None

    def __init__(self) -> None:
        self._began = clock.perf_counter()
        self.summary: dict[str, Any] = {
            "attempts": 0, "steps": None, "phases": None, "guide_length_m": None, "guide_samples": 0,
            "postures": 0, "backtracks": 0, "guide_wall_s": 0.0, "wall_s": 0.0,
        }  # fmt: skip

    def found(self, plan: ContactPlan) -> ContactSearch:
        """A search that found contacts."""
        self.summary.update(steps=plan.steps, phases=len(plan.stages))
        return self._ended(plan)

    def failed(self, reason: str, where: str) -> ContactSearch:
        """A search that found none."""
        return self._ended(None, reason, where)

    def count_guide(self, guide: RootGuide) -> None:
        """Take what a guide cost, and its length."""
        self.guide = guide.places
        self.summary["guide_samples"] += guide.samples
        self.summary["guide_wall_s"] += guide.wall_s
        if guide.places is not None:
            steps = np.linalg.norm(np.diff(guide.places, axis=0), axis=1)
            self.summary["guide_length_m"] = float(steps.sum())

    def _ended(self, plan: ContactPlan | None, reason: str | None = None, where: str = "") -> ContactSearch:
        summary = self.summary | {"wall_s": clock.perf_counter() - self._began}
        return ContactSearch(None, plan, self.guide, summary, reason, where)
