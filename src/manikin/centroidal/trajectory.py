"""The CoM trajectory: a clamped B-spline over normalised time with its contact schedule."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule, StanceSequence
from manikin.errors import InputError, SplineError
from manikin.spatial import FloatArray, finite_number
from manikin.spline import BSpline


@dataclass(frozen=True, eq=False)
class CentroidalTrajectory:
    """``p(t) = p_s(sigma t)`` with ``sigma = 1 / T`` ([Qiu2012]_ 5.2-5.6).

    Before the start and after the end the body rests: the position is held and all
    derivatives are zero.

    Attributes:
        mass: [kg].
        spline: B-spline on [0, 1] in three dimensions [m].
        schedule: Stances with their key instants [s]; the motion starts at 0.
    """

    mass: float
    spline: BSpline
    schedule: ContactSchedule

    def __post_init__(self) -> None:
        finite_number(self.mass, "centroidal trajectory mass [kg]", above=0.0)
        if self.spline.domain != (0.0, 1.0) or self.spline.control_points.shape[1] != 3:
            raise SplineError(
                "centroidal trajectory needs a spline over [0, 1]; valid: with (n, 3) control points"
            )
        if self.schedule.instants[0] != 0.0:
            raise InputError(f"centroidal trajectory starts at {self.schedule.instants[0]:g} s; valid: 0")

    @property
    def duration(self) -> float:
        """Length of the motion [s]."""
        return float(self.schedule.instants[-1])

    def position(self, time: ArrayLike) -> FloatArray:
        """(..., 3) CoM at each time [m] ([Qiu2012]_ 5.5)."""
        return self._derivative(time, 0)

    def velocity(self, time: ArrayLike) -> FloatArray:
        """(..., 3) velocity at each time [m/s] ([Qiu2012]_ 5.6)."""
        return self._derivative(time, 1)

    def acceleration(self, time: ArrayLike) -> FloatArray:
        """(..., 3) acceleration at each time [m/s^2] ([Qiu2012]_ 5.6)."""
        return self._derivative(time, 2)

    def jerk(self, time: ArrayLike) -> FloatArray:
        """(..., 3) third derivative at each time [m/s^3] ([Qiu2012]_ 5.6)."""
        return self._derivative(time, 3)

    def pseudo_wrench(self, time: ArrayLike) -> FloatArray:
        """(..., 6) ``[m (a - g); p x m (a - g)]`` about the world origin [N, N.m] ([Qiu2012]_ 4.6)."""
        return pseudo_wrench(self.mass, self.position(time), self.acceleration(time))

    def to_dict(self) -> dict[str, Any]:
        """Mass, degree, normalised knots, control points and key instants as plain lists and numbers."""
        return {
            "mass_kg": float(self.mass),
            "degree": int(self.spline.degree),
            "knots": self.spline.knots.tolist(),
            "control_points_m": self.spline.control_points.tolist(),
            "key_instants_s": self.schedule.instants.tolist(),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], sequence: StanceSequence) -> Self:
        """Rebuild a trajectory written by :meth:`to_dict`.

        Args:
            data: The dictionary.
            sequence: The stances, which the dictionary does not hold.

        Raises:
            InputError: If a key is missing.
            SplineError: If knots and control points do not make a clamped spline.
        """
        wanted = ("mass_kg", "degree", "knots", "control_points_m", "key_instants_s")
        missing = [key for key in wanted if key not in data]
        if missing:
            raise InputError(f"centroidal trajectory lacks {missing[0]!r}; valid keys: {', '.join(wanted)}")
        spline = BSpline(data["degree"], data["knots"], data["control_points_m"])
        return cls(float(data["mass_kg"]), spline, ContactSchedule(sequence, data["key_instants_s"]))

    def _derivative(self, time: ArrayLike, order: int) -> FloatArray:
        t = np.asarray(time, dtype=np.float64)
        values = self.spline(np.clip(t / self.duration, 0.0, 1.0), order) / self.duration**order
        if order > 0:
            values = np.where(((t >= 0.0) & (t <= self.duration))[..., None], values, 0.0)
        return values
