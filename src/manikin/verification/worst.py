"""The worst of many measurements of one quantity, as one requirement of a table."""

from dataclasses import dataclass, field

from manikin.runtime.requirement import Requirement, Sense


@dataclass
class Worst:
    """Takes measurements of one quantity and keeps the worst one.

    Attributes:
        key: Name of the quantity in results.
        name: The quantity in words.
        unit: Of the values.
        sense: What a value has to be relative to the limit.
        limit: The value allowed.
        tolerance: Rounding up to which the limit counts as kept.
        value: The worst value so far, or None.
        where: Where it was measured.
    """

    key: str
    name: str
    unit: str
    sense: Sense
    limit: float
    tolerance: float = 0.0
    value: float | None = field(default=None, init=False)
    where: str = field(default="", init=False)

    def take(self, value: float, where: str) -> None:
        """Take one measurement; a NaN is worse than any number."""
        worse = self.value is None or value != value
        if not worse and self.value is not None:
            worse = value > self.value if self.sense == "<=" else value < self.value
        if worse:
            self.value, self.where = float(value), where

    @property
    def row(self) -> Requirement | None:
        """The requirement; None if nothing was measured."""
        if self.value is None:
            return None
        return Requirement(
            self.key, self.name, self.unit, self.value, self.sense, self.limit, where=self.where,
            tolerance=self.tolerance,
        )  # fmt: skip
