"""The CoM trajectory, and the problem that asks for one: stances, bounds and weights ([Qiu2012]_ 5.4)."""

import itertools
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule, StanceSequence
from manikin.errors import InputError, SplineError
from manikin.kinematics.com_reach import ComRegion
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.numerics.spline import BSpline
from manikin.planning.com.com_constraints import GeometricConstraint, KeyPlane
from manikin.runtime.display import Displayed


@dataclass(frozen=True, eq=False, repr=False)
class CentroidalTrajectory(Displayed):
    """CoM in time, ``p(t) = p_s(sigma t)`` with ``sigma = 1 / T`` ([Qiu2012]_ 5.2-5.6).

    Before and after, the position is held and all derivatives are zero.

    Attributes:
        mass: Mass of the body [kg].
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
        if not _spatial(self.spline):
            raise SplineError(
                "centroidal trajectory needs a spline over [0, 1]; valid: with (n, 3) control points"
            )
        if self.turning is not None and not _spatial(self.turning):
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
        k, leading, following = self.spline.degree, self.spline, other.spline
        steps = [self._derivative(self.duration, d) - other._derivative(0.0, d) for d in range(3)]
        gaps = np.abs(steps).max(axis=1)
        if following.degree != k or max(gaps) > 1e-4:
            raise SplineError(
                f"trajectories of degrees {k} and {following.degree} meet with gaps of {gaps[0]:.2g} m, "
                f"{gaps[1]:.2g} m/s and {gaps[2]:.2g} m/s^2; valid: one degree, and the second starts as the "
                "first ends"
            )
        total = self.duration + other.duration
        first = leading.knots * (self.duration / total)
        second = 1.0 - (1.0 - following.knots) * (other.duration / total)
        # Two continuous derivatives: the joint is k - 2 knots.
        joint = np.full(k - 2, self.duration / total)
        knots = np.concatenate([first[: -k - 1], joint, second[k + 1 :]])
        spans = itertools.pairwise(np.unique(knots))
        times = np.unique(np.concatenate([np.linspace(a, b, 4 * k) for a, b in spans]))
        before = times <= joint[0]
        wanted = np.concatenate([
            leading(np.clip(times[before] * total / self.duration, 0.0, 1.0)),
            following(np.clip(1.0 - (1.0 - times[~before]) * total / other.duration, 0.0, 1.0)),
        ])  # fmt: skip
        spline = BSpline.fit(
            k, knots, times, wanted, first=leading.control_points[:1], last=following.control_points[-1:]
        )
        phases = StanceSequence((*self.schedule.sequence, *other.schedule.sequence))
        instants = np.concatenate([self.schedule.instants, self.duration + other.schedule.instants[1:]])
        return CentroidalTrajectory(self.mass, spline, ContactSchedule(phases, instants))

    def slowed(self, span: tuple[int, int], factor: float) -> "CentroidalTrajectory":
        """The same path, slower from one key instant to another, at both of which it rests.

        Raises:
            SplineError: If it moves there, or turns.
        """
        before, ends = self.schedule.instants, self.schedule.instants[list(span)]
        rates = np.abs([self.velocity(ends), self.acceleration(ends)]).max()
        if self.turning is not None or rates > 1e-2:
            raise SplineError(
                f"trajectory moves with {rates:.2g} m/s or m/s^2 at the ends of what is slowed down, or "
                "turns; valid: that of a point mass that rests there"
            )
        durations = self.schedule.durations.copy()
        durations[slice(*span)] *= factor
        instants = np.concatenate([[0.0], np.cumsum(durations)])
        k, knots = self.spline.degree, np.interp(self.spline.knots * before[-1], before, instants)
        spans = itertools.pairwise(np.unique(knots))
        times = np.unique(np.concatenate([np.linspace(a, b, 4 * k) for a, b in spans]))
        wanted, points = self.position(np.interp(times, instants, before)), self.spline.control_points
        spline = BSpline.fit(
            k, knots / instants[-1], times / instants[-1], wanted, first=points[:1], last=points[-1:]
        )
        binding = self.binding_until
        return CentroidalTrajectory(
            self.mass, spline, ContactSchedule(self.schedule.sequence, instants),
            None if binding is None else float(np.interp(binding, before, instants)),
        )  # fmt: skip

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

    def pseudo_wrench(
        self, time: ArrayLike, reference: ArrayLike | None = None, phase: int | None = None
    ) -> FloatArray:
        """(..., 6) ``[m (a - g); (p - o) x m (a - g) + Ldot]`` about ``reference`` o [N, N.m].

        [Qiu2012]_ 4.6 for a point mass, 4.51 with the rate of its angular momentum; o is the world's origin
        when omitted. A load of the phases moves with the CoM, at its offset from it; at a key instant that of
        ``phase`` counts, or of the later one.
        """
        rate = None if self.turning is None else self.angular_momentum_rate(time)
        position, acceleration = self.position(time), self.acceleration(time)
        wrench = pseudo_wrench(self.mass, position, acceleration, rate, reference)
        times = np.asarray(time, dtype=np.float64)
        phases = self.schedule.phase_at(times) if phase is None else np.full(times.shape, phase)
        for number, item in enumerate(self.schedule.sequence):
            if item.load is not None and np.any(rows := phases == number):
                place = position[rows] + item.load.offset
                wrench[rows] += pseudo_wrench(item.load.mass, place, acceleration[rows], None, reference)
        return wrench

    def angular_momentum_rate(self, time: ArrayLike) -> FloatArray:
        """(..., 3) rate of the angular momentum about the CoM at each time [N.m]; zero for a point mass."""
        t = np.asarray(time, dtype=np.float64)
        if self.turning is None:
            return np.zeros((*t.shape, 3))
        inside = ((t >= 0.0) & (t <= self.duration))[..., None]
        return np.where(inside, self.turning(np.clip(t / self.duration, 0.0, 1.0)), 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Mass, degree, normalised knots, control points and key instants as plain lists and numbers."""

        def plain(spline: BSpline, unit: str) -> dict[str, Any]:
            points = {f"control_points_{unit}": spline.control_points.tolist()}
            return {"degree": int(spline.degree), "knots": spline.knots.tolist(), **points}

        instants = {"key_instants_s": self.schedule.instants.tolist()}
        turning = {} if self.turning is None else {"turning": plain(self.turning, "Nm")}
        return {"mass_kg": float(self.mass), **plain(self.spline, "m"), **instants, **turning}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], sequence: StanceSequence) -> Self:
        """Rebuild what :meth:`to_dict` wrote, with the stances, which the dictionary does not hold.

        Raises:
            InputError: If a key is missing.
            SplineError: If knots and control points do not make a clamped spline.
        """
        wanted = ("mass_kg", "degree", "knots", "control_points_m", "key_instants_s")
        for key in wanted:
            if key not in data:
                raise InputError(f"centroidal trajectory lacks {key!r}; valid keys: {', '.join(wanted)}")
        spline = BSpline(data["degree"], data["knots"], data["control_points_m"])
        schedule = ContactSchedule(sequence, data["key_instants_s"])
        rate = data.get("turning")
        turning = None if rate is None else BSpline(rate["degree"], rate["knots"], rate["control_points_Nm"])
        return cls(float(data["mass_kg"]), spline, schedule, turning=turning)

    def _derivative(self, time: ArrayLike, order: int) -> FloatArray:
        t = np.asarray(time, dtype=np.float64)
        values = self.spline(np.clip(t / self.duration, 0.0, 1.0), order) / self.duration**order
        if order > 0:
            values = np.where(((t >= 0.0) & (t <= self.duration))[..., None], values, 0.0)
        return values


def _spatial(spline: BSpline) -> bool:
    return spline.domain == (0.0, 1.0) and spline.control_points.shape[1] == 3


MarginSpace = Literal["wrench", "force", "wrench_about_origin"]
"""``wrench``: distance to the facets of W_p with moments about the CoM in [N.m], alpha = 1 m;
``force``: smallest force at the CoM that ends balance, [N] ([Qiu2012]_ 4.2.9, cases 3 and 1).
``wrench_about_origin`` has the moments about the world origin, as the tables of [Qiu2012]_ have: it
depends on where the scene stands."""

_UNITS: dict[str, str] = {"wrench": "N.m", "force": "N", "wrench_about_origin": "N.m"}


@dataclass(frozen=True)
class Weights:
    """Weights of the objectives ([Qiu2012]_ 5.27-5.28).

    The objective is ``- margin d_min + smoothness S + duration T`` with S the mean over time of ``v' Qv v +
    a' Qa a + j' Qj j``, exactly integrated. The sum of the thesis over samples has no acceleration term.

    Attributes:
        margin: Weight of d_min [1/(N.m)] or [1/N].
        smoothness: Weight of S as a whole.
        duration: Weight of T [1/s].
        velocity: Diagonal of Qv [s^2/m^2].
        acceleration: Diagonal of Qa [s^4/m^2].
        jerk: Diagonal of Qj [s^6/m^2].
    """

    margin: float = 1.0
    smoothness: float = 10.0
    duration: float = 5.0
    velocity: tuple[float, float, float] = (1.0, 1.0, 1.0)
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    jerk: tuple[float, float, float] = (1e-3, 1e-3, 1e-3)

    def __post_init__(self) -> None:
        for name in ("margin", "smoothness", "duration"):
            finite_number(getattr(self, name), f"weight {name}", at_least=0.0)
        for name in ("velocity", "acceleration", "jerk"):
            diagonal = frozen_array(getattr(self, name), f"weights {name}", (3,))
            if np.any(diagonal < 0):
                raise InputError(f"weights {name} are {diagonal.tolist()}; valid: numbers >= 0")
            object.__setattr__(self, name, tuple(float(value) for value in diagonal))


END_CONDITIONS = ("start_velocity", "start_acceleration", "goal_velocity", "goal_acceleration")
"""Attributes of a :class:`CentroidalProblem` that are None where its ends are free."""


@dataclass(frozen=True, eq=False)
class CentroidalProblem:
    """A CoM trajectory to find through a sequence of stances ([Qiu2012]_ 5.18-5.28).

    Velocities and accelerations at the ends are (3,), or None when free [m/s, m/s^2] (5.24-5.25).

    Attributes:
        mass: Mass of the body [kg].
        sequence: Stances with the bounds of their durations.
        start_com: (3,) p_i [m] (5.22).
        goal_com: (3,) p_f [m] (5.23).
        degree: Degree of the spline, >= 3; it has ``phases + degree`` control points.
        margin_space: Whether the margin is a wrench [N.m] or a force at the CoM [N].
        required_margin: d_min must not be smaller (5.21) [N.m] or [N].
        support_distance: Largest distance of the CoM from every active contact (5.26) [m].
        regions: Where the body's postures have the CoM in each phase, None where that is not known; empty
            for none at all.
        key_planes: Planes behind which the CoM must be at single key instants, neither the first nor the
            last, where the CoM is given.
        rests: CoM of a balanced posture at the beginning of each phase [m], None where none is known; empty
            for none at all. Long motions on other contacts than feet may come to rest there.
        max_duration: Longest duration of the whole motion [s].
        weights: Weights of the objectives (5.28).
        samples: n_s, balance is imposed at j = 0 ... n_s in every phase.
    """

    mass: float
    sequence: StanceSequence
    start_com: FloatArray
    goal_com: FloatArray
    _: KW_ONLY
    start_velocity: FloatArray | None = field(default_factory=lambda: np.zeros(3))
    goal_velocity: FloatArray | None = field(default_factory=lambda: np.zeros(3))
    start_acceleration: FloatArray | None = None
    goal_acceleration: FloatArray | None = None
    degree: int = 5
    margin_space: MarginSpace = "wrench"
    required_margin: float = 0.0
    support_distance: float | None = None
    regions: tuple[ComRegion | None, ...] = ()
    geometric: tuple[GeometricConstraint, ...] = ()
    key_planes: tuple[KeyPlane, ...] = ()
    rests: tuple[FloatArray | None, ...] = ()
    max_duration: float | None = None
    weights: Weights = Weights()
    samples: int = 10

    def __post_init__(self) -> None:
        if self.margin_space not in _UNITS:
            raise InputError(f"centroidal margin_space is {self.margin_space!r}; valid: {', '.join(_UNITS)}")
        phases, margin = len(self.sequence), self.required_margin
        values: dict[str, object] = {
            "mass": finite_number(self.mass, "centroidal mass [kg]", above=0.0),
            "degree": _integer(self.degree, "degree", 3),
            "required_margin": finite_number(margin, "centroidal required_margin", at_least=0.0),
        }
        if self.regions and len(self.regions) != phases:
            raise InputError(
                f"centroidal regions are {len(self.regions)} for {phases} phases; valid: one per phase"
            )
        for plane in self.key_planes:
            if not 1 <= plane.key < phases:
                valid = f"1 to {phases - 1}" if phases > 1 else "none with a single phase"
                raise InputError(f"centroidal key_planes name key instant {plane.key}; valid: {valid}")
        values |= {name: tuple(getattr(self, name)) for name in ("regions", "geometric", "key_planes")}
        values["samples"] = _integer(self.samples, "samples", 2)
        for name, unit in (("support_distance", "m"), ("max_duration", "s")):
            if getattr(self, name) is not None:
                values[name] = finite_number(getattr(self, name), f"centroidal {name} [{unit}]", above=0.0)
        for end in ("start", "goal"):
            for name, unit in (("com", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2")):
                vector = getattr(self, f"{end}_{name}")
                if name == "com" or vector is not None:
                    values[f"{end}_{name}"] = frozen_array(vector, f"centroidal {end}_{name} [{unit}]", (3,))
        vars(self).update(values)

    @property
    def reference(self) -> FloatArray:
        """(3,) middle of all contacts, the origin of positions and moments in the programmes [m]."""
        places = [contact.position for phase in self.sequence for contact in phase.stance]
        return np.mean(places or [self.start_com], axis=0)

    @property
    def margin_unit(self) -> str:
        """Unit of the margin, ``"N.m"`` or ``"N"``."""
        return _UNITS[self.margin_space]

    @property
    def min_durations(self) -> FloatArray:
        """(phases,) lower bounds of the durations [s]."""
        return np.array([phase.min_duration for phase in self.sequence])

    @property
    def max_durations(self) -> FloatArray:
        """(phases,) upper bounds of the durations [s], infinite where there is none."""
        return np.array([np.inf if p.max_duration is None else p.max_duration for p in self.sequence])


def _integer(value: object, name: str, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"centroidal {name} is {value!r}; valid: an integer >= {least}")
    return int(value)
