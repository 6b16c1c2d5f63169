"""Requirements of a result: what was measured, what is allowed, and whether it holds."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

Sense = Literal["<=", ">=", ">"]
"""Comparison of a measured value with its limit."""


@dataclass(frozen=True)
class Requirement:
    """One measured value with its limit.

    Attributes:
        key: Name of the measured quantity in results, such as ``"min_clearance_m"``.
        name: The quantity in words, such as ``"clearance"``.
        unit: Of ``measured`` and ``limit``; empty for a count or a share.
        measured: The worst value of all instants; NaN, which breaks any limit, if it could not be measured.
        sense: What ``measured`` has to be relative to ``limit``.
        limit: The value allowed.
        time_s: When the worst value was measured [s]; None if it belongs to no instant.
        where: Phase, contact, joint or pair of the worst value; empty if there is none.
        tolerance: Rounding up to which the limit counts as kept [unit of ``measured``].
    """

    key: str
    name: str
    unit: str
    measured: float
    sense: Sense
    limit: float
    time_s: float | None = None
    where: str = ""
    tolerance: float = 0.0

    @property
    def held(self) -> bool:
        """Whether the measured value is within its limit."""
        if self.sense == "<=":
            return self.measured <= self.limit + self.tolerance
        if self.sense == ">=":
            return self.measured >= self.limit - self.tolerance
        return self.measured > self.limit

    @property
    def reason(self) -> str:
        """The measured value beside its limit, in one line."""
        what = f"{self.name} of {self.where}" if self.where else self.name
        unit = f" {self.unit}" if self.unit else ""
        return f"{what} is {self.measured:.4g}{unit}; allowed {self.sense} {self.limit:.4g}{unit}"

    def as_dict(self, stage: str) -> dict[str, Any]:
        """Plain values for ``summary.json``, with the stage whose result was measured."""
        values = {name: value for name, value in asdict(self).items() if name != "tolerance"}
        return {"stage": stage, **values, "held": self.held}


@dataclass(frozen=True)
class RequirementTable:
    """All requirements of one result, in the order in which they are reported."""

    rows: tuple[Requirement, ...]

    def __iter__(self) -> Iterator[Requirement]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, key: str) -> Requirement:
        for row in self.rows:
            if row.key == key:
                return row
        raise KeyError(f"no requirement {key!r}; valid: {[row.key for row in self.rows]}")

    def value(self, key: str) -> float:
        """Measured value of a requirement [its unit]."""
        return self[key].measured

    def later(self, delay: float) -> "RequirementTable":
        """The same, of a result that begins later by ``delay`` [s]."""
        times = [None if row.time_s is None else row.time_s + delay for row in self.rows]
        return RequirementTable(
            tuple(replace(row, time_s=time) for row, time in zip(self.rows, times, strict=True))
        )

    @property
    def held(self) -> bool:
        """Whether every requirement holds."""
        return all(row.held for row in self.rows)

    @property
    def broken(self) -> frozenset[str]:
        """Keys of the requirements that do not hold."""
        return frozenset(row.key for row in self.rows if not row.held)

    @property
    def first_broken(self) -> Requirement | None:
        """The first requirement that does not hold; None if all do."""
        return next((row for row in self.rows if not row.held), None)


def requirement_table(rows: Iterable[Requirement | None]) -> RequirementTable:
    """Make a table, without the entries that are None or have an infinite limit."""
    return RequirementTable(tuple(row for row in rows if row is not None and math.isfinite(row.limit)))


@dataclass
class Worst:
    """Takes measurements of one quantity and keeps the worst one, ``value``, measured at ``where``.

    Its fields are those of a :class:`Requirement`; the key ends in the unit, ``_m``, ``_deg`` or ``_N``, if
    there is one. The sense of a ``min_...`` is always at least.
    """

    key: str
    name: str
    limit: float
    tolerance: float = 0.0
    sense: Sense = "<="
    value: float | None = field(default=None, init=False)
    where: str = field(default="", init=False)

    def __post_init__(self) -> None:
        if self.key.startswith("min_"):
            self.sense = ">="

    def take(self, value: float, where: str) -> None:
        """Take one measurement; a NaN is worse than any number."""
        sign = 1.0 if self.sense == "<=" else -1.0
        if self.value is None or value != value or sign * value > sign * self.value:
            self.value, self.where = float(value), where

    @property
    def row(self) -> Requirement | None:
        """The requirement; None if nothing was measured."""
        if self.value is None:
            return None
        ending = self.key.rpartition("_")[2]
        unit = ending if ending in ("m", "deg", "N") else ""
        limits = self.sense, self.limit, None, self.where, self.tolerance
        return Requirement(self.key, self.name, unit, self.value, *limits)
