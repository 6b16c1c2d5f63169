"""What the timing-free method is asked: bodies, stances, bounds and weights ([Qiu2012]_ 5.4)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from manikin.centroidal.constraints import GeometricConstraint
from manikin.centroidal.key_planes import KeyPlane
from manikin.contact import StanceSequence
from manikin.errors import InputError
from manikin.spatial import FloatArray, finite_number, frozen_array

MarginSpace = Literal["wrench", "force", "wrench_about_origin"]
"""``wrench``: distance to the facets of W_p with moments about the CoM in [N.m], alpha = 1 m;
``force``: smallest force at the CoM that ends balance, [N] ([Qiu2012]_ 4.2.9, cases 3 and 1).
``wrench_about_origin`` has the moments about the world origin, as the tables of [Qiu2012]_ have: it
depends on where the scene stands."""

_UNITS: dict[str, str] = {"wrench": "N.m", "force": "N", "wrench_about_origin": "N.m"}


@dataclass(frozen=True)
class Weights:
    """Weights of the objectives ([Qiu2012]_ 5.27-5.28).

    The objective is ``- margin d_min + smoothness S + duration T`` with S the mean over time
    of ``v' Qv v + a' Qa a + j' Qj j``, exactly integrated: the sum of the thesis divided by
    its number of samples, in the limit of many. Its sum has no acceleration term.

    Attributes:
        margin: [1/(N.m)] or [1/N].
        smoothness: Of S as a whole.
        duration: [1/s].
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


@dataclass(frozen=True, eq=False)
class CentroidalProblem:
    """A CoM trajectory to find through a sequence of stances ([Qiu2012]_ 5.18-5.28).

    Attributes:
        mass: [kg].
        sequence: Stances with the bounds of their durations.
        start_com: (3,) p_i [m] (5.22).
        goal_com: (3,) p_f [m] (5.23).
        start_velocity: (3,) [m/s] (5.24), or None when free.
        goal_velocity: (3,) [m/s] (5.25), or None when free.
        start_acceleration: (3,) [m/s^2], or None when free.
        goal_acceleration: (3,) [m/s^2], or None when free.
        degree: Degree of the spline, >= 3; it has ``phases + degree`` control points.
        margin_space: Whether the margin is a wrench [N.m] or a force at the CoM [N].
        required_margin: d_min must not be smaller (5.21) [N.m] or [N].
        support_distance: Largest distance of the CoM from every active contact (5.26) [m].
        geometric: Further constraints on the CoM position.
        key_planes: Planes behind which the CoM must be at single key instants, neither the first nor the
            last, where the CoM is given.
        max_duration: Of the whole motion [s].
        weights: Of the objectives (5.28).
        samples: n_s, balance is imposed at j = 0 ... n_s in every phase.
    """

    mass: float
    sequence: StanceSequence
    start_com: FloatArray
    goal_com: FloatArray
    start_velocity: FloatArray | None
    goal_velocity: FloatArray | None
    start_acceleration: FloatArray | None
    goal_acceleration: FloatArray | None
    degree: int
    margin_space: MarginSpace
    required_margin: float
    support_distance: float | None
    geometric: tuple[GeometricConstraint, ...]
    key_planes: tuple[KeyPlane, ...]
    max_duration: float | None
    weights: Weights
    samples: int

    def __init__(
        self,
        mass: float,
        sequence: StanceSequence,
        start_com: ArrayLike,
        goal_com: ArrayLike,
        *,
        start_velocity: ArrayLike | None = (0.0, 0.0, 0.0),
        goal_velocity: ArrayLike | None = (0.0, 0.0, 0.0),
        start_acceleration: ArrayLike | None = None,
        goal_acceleration: ArrayLike | None = None,
        degree: int = 5,
        margin_space: MarginSpace = "wrench",
        required_margin: float = 0.0,
        support_distance: float | None = None,
        geometric: Sequence[GeometricConstraint] = (),
        key_planes: Sequence[KeyPlane] = (),
        max_duration: float | None = None,
        weights: Weights | None = None,
        samples: int = 10,
    ) -> None:
        if margin_space not in _UNITS:
            raise InputError(f"centroidal margin_space is {margin_space!r}; valid: {', '.join(_UNITS)}")
        values = {
            "mass": finite_number(mass, "centroidal mass [kg]", above=0.0),
            "sequence": sequence,
            "start_com": frozen_array(start_com, "centroidal start_com [m]", (3,)),
            "goal_com": frozen_array(goal_com, "centroidal goal_com [m]", (3,)),
            "start_velocity": _optional_vector(start_velocity, "start_velocity [m/s]"),
            "goal_velocity": _optional_vector(goal_velocity, "goal_velocity [m/s]"),
            "start_acceleration": _optional_vector(start_acceleration, "start_acceleration [m/s^2]"),
            "goal_acceleration": _optional_vector(goal_acceleration, "goal_acceleration [m/s^2]"),
            "degree": _integer(degree, "degree", 3),
            "margin_space": margin_space,
            "required_margin": finite_number(required_margin, "centroidal required_margin", at_least=0.0),
            "support_distance": _optional_limit(support_distance, "support_distance [m]"),
            "geometric": tuple(geometric),
            "key_planes": _inner_planes(key_planes, len(sequence)),
            "max_duration": _optional_limit(max_duration, "max_duration [s]"),
            "weights": Weights() if weights is None else weights,
            "samples": _integer(samples, "samples", 2),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def reference(self) -> FloatArray:
        """(3,) middle of all contacts, about which the programmes have positions and moments [m].

        Their numbers are then the same wherever the scene stands.
        """
        places = [contact.position for phase in self.sequence for contact in phase.stance]
        return np.mean(places or [self.start_com], axis=0)

    @property
    def margin_unit(self) -> str:
        """``"N.m"`` or ``"N"``."""
        return _UNITS[self.margin_space]

    @property
    def min_durations(self) -> FloatArray:
        """(phases,) lower bounds of the durations [s]."""
        return np.array([phase.min_duration for phase in self.sequence])

    @property
    def max_durations(self) -> FloatArray:
        """(phases,) upper bounds of the durations [s], infinite where there is none."""
        return np.array([np.inf if p.max_duration is None else p.max_duration for p in self.sequence])


def _optional_vector(value: ArrayLike | None, name: str) -> FloatArray | None:
    return None if value is None else frozen_array(value, f"centroidal {name}", (3,))


def _inner_planes(planes: Sequence[KeyPlane], phases: int) -> tuple[KeyPlane, ...]:
    for plane in planes:
        if not 1 <= plane.key < phases:
            valid = f"1 to {phases - 1}" if phases > 1 else "none with a single phase"
            raise InputError(f"centroidal key_planes name key instant {plane.key}; valid: {valid}")
    return tuple(planes)


def _optional_limit(value: float | None, name: str) -> float | None:
    return None if value is None else finite_number(value, f"centroidal {name}", above=0.0)


def _integer(value: object, name: str, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"centroidal {name} is {value!r}; valid: an integer >= {least}")
    return int(value)
