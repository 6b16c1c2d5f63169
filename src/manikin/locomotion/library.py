"""The motion library: walking cycles of one body, by forward, left and angular velocity."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, human
from manikin.body.mirror import mirrored_hinges
from manikin.errors import InputError
from manikin.locomotion.fourier import shifted
from manikin.spatial import FloatArray, frozen_array

ROOT = ("ahead", "left", "height", "roll", "pitch", "yaw")
"""Signals of the root: its error around the line or circle, and its height [m]; its turns, yaw being the
error of the heading [rad]. The hinges' angles follow."""

_ROOT_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])

REFERENCE_STATURE = 1.75
"""Of the body that all cycles are kept for [m]."""

STAND = "stand"


@cache
def reference_body() -> BodyModel:
    """The human that all cycles are kept for."""
    return human(REFERENCE_STATURE)


def leg_length(body: BodyModel) -> float:
    """Hip to ankle of a stretched leg [m], by which places and velocities scale from body to body."""
    return -float(body.segment("left_leg").origin[2] + body.segment("left_foot").origin[2])


@dataclass(frozen=True, eq=False)
class MotionLibrary:
    """c cycles that begin when the left toes push off ([Truong2010]_ 6.4).

    Joint angles are those of the reference body's revolute hinges. Their ranges leave one triple of angles
    only for every turn of a ball joint (the middle one stays within 90 degrees, the others within 180), so
    that blends of postures within the ranges are within the ranges, without leaps.

    Attributes:
        names: Of the cycles, ``FILE first-last``, with ``mirrored`` for the mirror images.
        kinds: Class of each, such as ``"walk straight"``.
        velocities: (c, 3) forward, left [m/s], angular [rad/s].
        periods: (c,) durations [s].
        events: (c, 3) phases at which the left foot lands, the right one leaves the floor, and the right one
            landed before: below 0 where it did so before the cycle's begin.
        coefficients: (c, 2 k + 1, s) Fourier coefficients of the signals: :data:`ROOT`, then the hinges.
        joint_names: Of the hinges.
        leg: Leg length of the body they are for [m].
        acknowledgements: Of those who recorded the motions.
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    velocities: FloatArray
    periods: FloatArray
    events: FloatArray
    coefficients: FloatArray
    joint_names: tuple[str, ...]
    leg: float
    acknowledgements: tuple[str, ...]

    def __post_init__(self) -> None:
        c, signals = len(self.names), len(ROOT) + len(self.joint_names)
        wanted = {"velocities": (c, 3), "periods": (c,), "events": (c, 3), "coefficients": (c, None, signals)}
        for name, shape in wanted.items():
            array = frozen_array(getattr(self, name), f"motion library {name}", shape)
            object.__setattr__(self, name, array)
        if len(self.kinds) != c:
            raise InputError(f"motion library has {len(self.kinds)} kinds; valid: {c}, one a cycle")
        if self.coefficients.shape[1] % 2 == 0 or self.coefficients.shape[1] < 3:
            raise InputError(
                f"motion library has {self.coefficients.shape[1]} coefficients a signal; valid: 3, 5, 7, ..."
            )
        if c == 0 or self.periods.min() <= 0.0 or not self.leg > 0.0:
            raise InputError("motion library has no cycle, or no duration or leg length; valid: all > 0")
        landing, off, other = self.events.T
        if not np.all(
            (landing > 0.0)
            & (landing < 1.0)
            & (off > 0.0)
            & (off < 1.0)
            & (other < off)
            & (other > off - 1.0)
        ):
            raise InputError(
                "motion library has events out of order; valid: 0 < landing, off < 1, other before off"
            )

    def __len__(self) -> int:
        return len(self.names)

    @property
    def harmonics(self) -> int:
        """Of every signal."""
        return (self.coefficients.shape[1] - 1) // 2

    @cached_property
    def hinges(self) -> slice:
        """Where the hinges' angles are among the signals."""
        return slice(len(ROOT), None)

    def index(self, name: str) -> int:
        """Place of a cycle.

        Raises:
            InputError: If there is none of that name.
        """
        if name not in self.names:
            raise InputError(f"motion library has no cycle {name!r}; valid: {', '.join(self.names)}")
        return self.names.index(name)

    def chosen(self, indices: Sequence[int] | NDArray[np.integer]) -> Self:
        """The library of some of its cycles."""
        of_cycles = ("velocities", "periods", "events", "coefficients")
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        given |= {name: given[name][list(indices)] for name in of_cycles}
        given |= {name: tuple(given[name][i] for i in indices) for name in ("names", "kinds")}
        return type(self)(**given)

    def mirrored(self, body: BodyModel) -> Self:
        """The library of the mirror images, which begin at the left toe-off again.

        Args:
            body: Whose hinges they are.
        """
        indices, factors = mirrored_hinges(body)
        hinges = self.hinges
        coefficients = np.array(self.coefficients)
        coefficients[:, :, : len(ROOT)] *= _ROOT_MIRROR
        coefficients[:, :, hinges] = factors * self.coefficients[:, :, hinges][:, :, indices]
        strike, off, other = self.events.T
        coefficients = np.array([shifted(c, p) for c, p in zip(coefficients, off, strict=True)])
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        given |= {
            "names": tuple(f"{name} mirrored" for name in self.names),
            "velocities": self.velocities * [1.0, -1.0, -1.0],
            "events": np.column_stack([other + 1.0 - off, 1.0 - off, strike - off]),
            "coefficients": coefficients,
        }
        return type(self)(**given)

    def with_cycles(self, other: "MotionLibrary") -> Self:
        """Both libraries in one."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        for name in ("velocities", "periods", "events", "coefficients"):
            given[name] = np.concatenate([getattr(self, name), getattr(other, name)])
        for name in ("names", "kinds"):
            given[name] = getattr(self, name) + getattr(other, name)
        return type(self)(**given)
