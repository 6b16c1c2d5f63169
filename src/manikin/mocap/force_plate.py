"""One force plate of a recording: wrenches of the ground on the person."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.spatial import FloatArray, finite_number, frozen_array

LEAST_FORCE = 20.0
"""Normal force below which no centre of pressure is told; noise would place it [N]."""


@dataclass(frozen=True, eq=False)
class ForcePlate:
    """Wrenches that a plate applies to who stands on it, at an even rate; the world is z up.

    Attributes:
        name: How messages call it.
        wrenches: (n, 6) force [N] and moment about the world's origin [N.m], world axes.
        origin: (3,) a point of its surface [m].
        rate: Samples per second [Hz].
        start: Instant of the first sample on the recording's clock [s].
        normal: (3,) unit normal of its surface, upward.
        corners: (4, 3) [m], one after the other; None where the file does not hold them.
    """

    name: str
    wrenches: FloatArray
    origin: FloatArray
    rate: float
    start: float = 0.0
    normal: FloatArray = (0.0, 0.0, 1.0)  # pyright: ignore[reportAssignmentType]
    corners: FloatArray | None = None

    def __post_init__(self) -> None:
        where = f"force plate {self.name!r}"
        finite_number(self.rate, f"{where} rate [Hz]", above=0.0)
        finite_number(self.start, f"{where} start [s]")
        shapes = {"wrenches": (None, 6), "origin": (3,), "normal": (3,)}
        if self.corners is not None:
            shapes["corners"] = (4, 3)
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"{where} {name}", shape))
        if not len(self.wrenches):
            raise InputError(f"{where} has no sample; valid: at least one")
        if abs(np.linalg.norm(self.normal) - 1.0) > 1e-6:
            raise InputError(f"{where} normal is {self.normal.tolist()}; valid: a unit vector")

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.wrenches)

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants on the recording's clock [s]."""
        return frozen_array(self.start + np.arange(len(self)) / self.rate, "time")

    @property
    def force(self) -> FloatArray:
        """(n, 3) [N]."""
        return self.wrenches[:, :3]

    @cached_property
    def pressed(self) -> NDArray[np.bool_]:
        """(n,) whether the normal force reaches :data:`LEAST_FORCE`."""
        return self.force @ self.normal >= LEAST_FORCE

    @cached_property
    def cop(self) -> FloatArray:
        """(n, 3) centre of pressure, the point of the surface about which the moment is normal to it [m].

        ``c = o + n x M_o / (n . F)`` with the moment ``M_o`` about the origin ``o``; NaN where the plate
        is not :attr:`pressed`.
        """
        moment = self.wrenches[:, 3:] - np.cross(self.origin, self.force)
        along = np.where(self.pressed, self.force @ self.normal, np.nan)
        places = self.origin + np.cross(self.normal, moment) / along[:, None]
        places.setflags(write=False)
        return places

    def cut(self, begin: float, end: float) -> "ForcePlate":
        """Samples at instants from ``begin`` up to, not with, ``end`` [s].

        Raises:
            InputError: If no sample is left.
        """
        # A thousandth of a sample absorbs what is lost in dividing by the rate.
        first, last = (
            min(max(int(np.ceil((instant - self.start) * self.rate - 1e-3)), 0), len(self))
            for instant in (begin, end)
        )
        return replace(self, wrenches=self.wrenches[first:last], start=self.start + first / self.rate)
