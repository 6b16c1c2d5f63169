"""What the search for contacts found, or why it found nothing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from manikin.contact_planning import ContactPlan, GuideLine
from manikin.scenarios import Scenario
from manikin.spatial import PlanarTransform


@dataclass(frozen=True, eq=False)
class ContactSearch:
    """Supports for a scenario, or why there are none.

    Attributes:
        scenario: The scenario with supports; None without a plan, and where a file cannot list such contacts.
        plan: The contacts with their postures, or None.
        guide: The root's way, or None.
        summary: The ``contacts`` block of the run's summary.
        failure: None, or the reason in one line.
        where: Stage of the search that failed.
    """

    scenario: Scenario | None
    plan: ContactPlan | None
    guide: GuideLine | None
    summary: Mapping[str, Any]
    failure: str | None = None
    where: str = ""

    def to_dict(self, transform_task_to_world: PlanarTransform) -> dict[str, Any]:
        """Guide and postures in plain values, in the world."""
        plan, transform = self.plan, transform_task_to_world
        return {
            **self.summary,
            "guide": None if self.guide is None else transform.poses(self.guide.poses).tolist(),
            "postures": None if plan is None else transform.poses(plan.postures).tolist(),
        }
