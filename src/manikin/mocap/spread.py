"""Mean, deviation and range of a measure over several motions."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError


@dataclass(frozen=True)
class Spread:
    """How a measure is spread.

    Attributes:
        count: Of the values.
        mean: Of the values.
        deviation: Standard deviation of a sample, with count - 1; NaN for one value.
        smallest: Of the values.
        largest: Of the values.
    """

    count: int
    mean: float
    deviation: float
    smallest: float
    largest: float

    @classmethod
    def of(cls, values: Iterable[float]) -> "Spread":
        """Spread of values.

        Raises:
            InputError: If there is none.
        """
        known = np.array(list(values), dtype=np.float64)
        if not known.size:
            raise InputError("spread of no value; valid: at least one")
        deviation = float(known.std(ddof=1)) if known.size > 1 else float("nan")
        return cls(known.size, float(known.mean()), deviation, float(known.min()), float(known.max()))

    @property
    def variation(self) -> float:
        """Coefficient of variation: deviation per mean."""
        return self.deviation / self.mean if self.mean else float("nan")

    def as_dict(self, unit: str) -> dict[str, float | int]:
        """For JSON, with the unit in the keys."""
        return {
            "count": self.count, f"mean_{unit}": self.mean, f"deviation_{unit}": self.deviation,
            "variation": self.variation, f"min_{unit}": self.smallest, f"max_{unit}": self.largest,
        }  # fmt: skip
