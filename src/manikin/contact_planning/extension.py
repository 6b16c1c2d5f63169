"""A plan of contacts along a guide: as far as it has come, and what became of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from manikin.contact_planning.stage import ContactPlan, Stage


@dataclass(frozen=True, eq=False)
class PartialPlan:
    """Stages from the start on, and how far along the guide each limb has come.

    Attributes:
        stages: At least the start.
        along: How far along the guide the contact of each limb is, by effector or limb [m].
    """

    stages: tuple[Stage, ...]
    along: Mapping[str, float]

    @property
    def last(self) -> Stage:
        """The stage that it has come to."""
        return self.stages[-1]

    @property
    def here(self) -> float:
        """How far along the guide the root is: the mean of the contacts that are held [m]."""
        held = [self.along[name] for name in self.last.contacts]
        return float(np.mean(held)) if held else 0.0


@dataclass(frozen=True, eq=False)
class Extension:
    """A contact plan, or why there is none.

    Attributes:
        plan: The plan, or None.
        searches: Postures looked for.
        backtracks: Changes taken back.
        failure: None, or the reason in one line.
        reached: Share of the guide that the farthest attempt got to.
    """

    plan: ContactPlan | None
    searches: int
    backtracks: int
    failure: str | None = None
    reached: float = 1.0

    @property
    def succeeded(self) -> bool:
        """Whether there is a plan."""
        return self.plan is not None
