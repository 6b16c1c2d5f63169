"""The CoM trajectory: a clamped B-spline over normalised time with its contact schedule."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule, StanceSequence
from manikin.display import Displayed
from manikin.errors import InputError, SplineError
from manikin.spatial import FloatArray, finite_number
from manikin.spline import BSpline


@dataclass(frozen=True, eq=False, repr=False)
class CentroidalTrajectory(Displayed):
    """``p(t) = p_s(sigma t)`` with ``sigma = 1 / T`` ([Qiu2012]_ 5.2-5.6).

    Before the start and after the end the body rests: the position is held and all
    derivatives are zero.

    Attributes:
        mass: [kg].
        spline: B-spline on [0, 1] in three dimensions [m].
        schedule: Stances with their key instants [s]; the motion starts at 0.
        binding_until: A whole body must keep its CoM on the trajectory until then [s]; after
            that, safe on a seat, the trajectory only shows the way. None for the whole motion.
        turning: Rate of the angular momentum about the CoM, a B-spline on [0, 1] in three dimensions
            [N.m] ([Qiu2012]_ 4.51); None for that of a point mass, zero.
    """

    mass: float
    spline: BSpline
    schedule: ContactSchedule
    binding_until: float | None = None
    turning: BSpline | None = None

    def __post_init__(self) -> None:
        finite_number(self.mass, "centroidal trajectory mass [kg]", above=0.0)
        if self.spline.domain != (0.0, 1.0) or self.spline.control_points.shape[1] != 3:
            raise SplineError(
                "centroidal trajectory needs a spline over [0, 1]; valid: with (n, 3) control points"
            )
        if self.turning is not None and (
            self.turning.domain != (0.0, 1.0) or self.turning.control_points.shape[1] != 3
        ):
            raise SplineError(
                "centroidal trajectory has turning of another domain or dimension; valid: a spline over "
                "[0, 1] with (n, 3) control points"
            )
        if self.schedule.instants[0] != 0.0:
            raise InputError(f"centroidal trajectory starts at {self.schedule.instants[0]:g} s; valid: 0")

    @property
    def duration(self) -> float:
        """Length of the motion [s]."""
        return float(self.schedule.instants[-1])

    def binds(self, time: ArrayLike) -> NDArray[np.bool_]:
        """(...) whether the whole body must keep its CoM on the trajectory at each time."""
        last = np.inf if self.binding_until is None else self.binding_until
        return np.asarray(time, dtype=np.float64) <= last + 1e-9

    def followed_by(self, other: "CentroidalTrajectory") -> "CentroidalTrajectory":
        """Join a trajectory that starts where this one ends, at the same velocity and acceleration.

        Raises:
            SplineError: If end and start, or the degrees, differ, or one of them turns.
        """
        if self.turning is not None or other.turning is not None:
            raise SplineError("trajectories that turn cannot be joined; valid: those of point masses")
        k, here, there = self.spline.degree, self.spline, other.spline
        gaps = [
            float(np.abs(self._derivative(self.duration, d) - other._derivative(0.0, d)).max())
            for d in range(3)
        ]
        if there.degree != k or max(gaps) > 1e-4:
            raise SplineError(
                f"trajectories of degrees {k} and {there.degree} meet with gaps of {gaps[0]:.2g} m, "
                f"{gaps[1]:.2g} m/s and {gaps[2]:.2g} m/s^2; valid: one degree, and the second starts as the "
                "first ends"
            )
        total = self.duration + other.duration
        first, second = (
            here.knots * (self.duration / total),
            1.0 - (1.0 - there.knots) * (other.duration / total),
        )
        # Two continuous derivatives: the joint is k - 2 knots.
        joint = np.full(k - 2, self.duration / total)
        knots = np.concatenate([first[: -k - 1], joint, second[k + 1 :]])
        inner = np.unique(knots)
        times = np.unique(np.concatenate([np.linspace(a, b, 4 * k) for a, b in itertools.pairwise(inner)]))
        before = times <= joint[0]
        wanted = np.concatenate([
            here(np.clip(times[before] * total / self.duration, 0.0, 1.0)),
            there(np.clip(1.0 - (1.0 - times[~before]) * total / other.duration, 0.0, 1.0)),
        ])  # fmt: skip
        spline = BSpline.fit(
            k, knots, times, wanted, first=here.control_points[:1], last=there.control_points[-1:]
        )
        phases = (*self.schedule.sequence, *other.schedule.sequence)
        instants = np.concatenate([self.schedule.instants, self.duration + other.schedule.instants[1:]])
        schedule = ContactSchedule(StanceSequence(phases), instants)
        return CentroidalTrajectory(self.mass, spline, schedule)

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

    def pseudo_wrench(self, time: ArrayLike, reference: ArrayLike | None = None) -> FloatArray:
        """(..., 6) ``[m (a - g); (p - o) x m (a - g) + Ldot]`` about ``reference`` o [N, N.m].

        Moments are about the world origin when it is omitted.

        [Qiu2012]_ 4.6 for a point mass, 4.51 with the rate of its angular momentum.
        """
        rate = None if self.turning is None else self.angular_momentum_rate(time)
        return pseudo_wrench(self.mass, self.position(time), self.acceleration(time), rate, reference)

    def angular_momentum_rate(self, time: ArrayLike) -> FloatArray:
        """(..., 3) rate of the angular momentum about the CoM at each time [N.m]; zero for a point mass."""
        t = np.asarray(time, dtype=np.float64)
        if self.turning is None:
            return np.zeros((*t.shape, 3))
        inside = ((t >= 0.0) & (t <= self.duration))[..., None]
        return np.where(inside, self.turning(np.clip(t / self.duration, 0.0, 1.0)), 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Mass, degree, normalised knots, control points and key instants as plain lists and numbers."""
        turning = self.turning
        return {
            "mass_kg": float(self.mass),
            "degree": int(self.spline.degree),
            "knots": self.spline.knots.tolist(),
            "control_points_m": self.spline.control_points.tolist(),
            "key_instants_s": self.schedule.instants.tolist(),
            **({} if turning is None else {"turning": _spline_dict(turning)}),
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
        schedule = ContactSchedule(sequence, data["key_instants_s"])
        told = data.get("turning")
        turning = None if told is None else BSpline(told["degree"], told["knots"], told["control_points_Nm"])
        return cls(float(data["mass_kg"]), spline, schedule, turning=turning)

    def _derivative(self, time: ArrayLike, order: int) -> FloatArray:
        t = np.asarray(time, dtype=np.float64)
        values = self.spline(np.clip(t / self.duration, 0.0, 1.0), order) / self.duration**order
        if order > 0:
            values = np.where(((t >= 0.0) & (t <= self.duration))[..., None], values, 0.0)
        return values


def _spline_dict(spline: BSpline) -> dict[str, Any]:
    return {
        "degree": int(spline.degree),
        "knots": spline.knots.tolist(),
        "control_points_Nm": spline.control_points.tolist(),
    }
