"""Postures of our human that follow a recording."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.body import BodyModel
from manikin.display import Displayed
from manikin.errors import InputError
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(Displayed):
    """Postures of a body that follow recorded points.

    Attributes:
        body: The body used, with the person's lengths.
        time: (n,) instants, 0 at the first [s].
        q: (n, nq) postures, every hinge within its limits.
        targets: The j points followed: joint centres of a skeleton, named after the segments that begin
            there, or markers.
        residual: (n, j) distance of each from where it was recorded [m]; NaN where it was not seen.
        first_frame: Frame of the recording that is the first instant.
        others: Markers that are not followed, for their names say nothing or they are never seen with others.
        neutral: Segments about which the recording says nothing; their joints are as in standing.
    """

    body: BodyModel
    time: FloatArray
    q: FloatArray
    targets: Targets
    residual: FloatArray
    first_frame: int = 0
    others: tuple[str, ...] = ()
    neutral: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.time)
        for name, shape in (("time", (n,)), ("q", (n, self.body.nq))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"reconstruction {name}", shape))
        if len(self.targets) != n:
            raise InputError(
                f"reconstruction of {n} instants with {len(self.targets)} of targets; valid: as many"
            )
        residual = np.array(self.residual, dtype=np.float64)
        if residual.shape != (n, len(self.joints)):
            raise InputError(
                f"reconstruction residual has shape {residual.shape}; valid: {(n, len(self.joints))}"
            )
        residual.setflags(write=False)
        object.__setattr__(self, "residual", residual)

    @property
    def joints(self) -> tuple[str, ...]:
        """(j,) names of the points followed."""
        return self.targets.names

    @cached_property
    def median(self) -> float:
        """Of all residuals [m]."""
        return float(np.nanmedian(self.residual))

    @cached_property
    def worst(self) -> float:
        """The largest residual [m]."""
        return float(np.nanmax(self.residual))

    @cached_property
    def by_frame(self) -> FloatArray:
        """(n,) root mean square of the residuals of each frame [m]; NaN where nothing was seen."""
        seen = ~np.isnan(self.residual)
        squares = np.where(seen, self.residual, 0.0) ** 2
        counts = np.where(seen.any(axis=1), seen.sum(axis=1), np.nan)
        return np.sqrt(squares.sum(axis=1) / counts)
