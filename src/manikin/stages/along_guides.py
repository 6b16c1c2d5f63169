"""Contacts along one guide after the other, until there are some, with what that costs."""

import time as clock
from collections.abc import Callable
from typing import Any

from manikin.contact_planning import ContactPlan, Extension, GuideLine
from manikin.stages.found_contacts import ContactSearch
from manikin.stages.root_guide import RootGuide


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

    def found(self, plan: ContactPlan, guide: GuideLine) -> ContactSearch:
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
