"""Goals for which the best paths are found: places on a grid, and final headings."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.locomotion.words.solve import FARTHEST, NEAREST
from manikin.spatial import FloatArray, finite_number

HEADING_STEP = 10
"""Between slices [deg] ([Truong2010]_ 3.3)."""

HEADINGS = tuple(range(0, 360, HEADING_STEP))
"""Of the 36 slices [deg]."""


@dataclass(frozen=True)
class WordGrid:
    """Places of the goals of every slice; the thesis' by default ([Truong2010]_ 3.3).

    Attributes:
        x: Smallest and largest x, to the right of the start [m].
        y: Smallest and largest y, ahead of the start [m].
        step: Between neighbours [m].
    """

    x: tuple[float, float] = (-2.0, 2.0)
    y: tuple[float, float] = (3.0, 9.0)
    step: float = 0.2

    def __post_init__(self) -> None:
        finite_number(self.step, "step of the grid of words [m]", at_least=0.05, at_most=10.0)
        for name in ("x", "y"):
            low, high = (
                finite_number(end, f"{name} of the grid of words [m]") for end in getattr(self, name)
            )
            if not -20.0 <= low <= high <= 20.0:
                raise InputError(
                    f"{name} of the grid of words is {low:g} to {high:g} m; valid: -20 to 20, ascending"
                )
        distances = np.hypot(self.columns[None], self.rows[:, None])
        nearest, farthest = float(distances.min()), float(distances.max())
        if nearest < NEAREST or farthest > FARTHEST:
            raise InputError(
                f"goals of the grid of words are {nearest:g} to {farthest:g} m from the start; "
                f"valid: {NEAREST:g} to {FARTHEST:g} m"
            )

    @property
    def columns(self) -> FloatArray:
        """(nx,) x of the nodes [m]."""
        return self._nodes(*self.x)

    @property
    def rows(self) -> FloatArray:
        """(ny,) y of the nodes [m]."""
        return self._nodes(*self.y)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return len(self.rows), len(self.columns)

    def goals(self, heading_deg: float) -> FloatArray:
        """(ny nx, 3) x, y [m], heading [rad] of a slice, row by row."""
        x, y = np.meshgrid(self.columns, self.rows)
        return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, np.radians(heading_deg))])

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"x_m": list(self.x), "y_m": list(self.y), "step_m": self.step}

    def _nodes(self, low: float, high: float) -> FloatArray:
        count = int(np.floor((high - low) / self.step + 1e-9)) + 1
        return np.round(low + self.step * np.arange(float(count)), 9)


THESIS_GRID = WordGrid()
