"""The terms of a posture problem: residuals and Jacobians on the tangent space of the body.

Each term takes a :class:`~manikin.body.configuration.Configuration` and gives a residual ``r`` (m,) with its
Jacobian ``J`` (m, nv): ``r(q + v) = r(q) + J v`` to first order, ``v`` tangent as in Pinocchio's
``integrate``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
import pinocchio as pin

from manikin.body.configuration import Configuration
from manikin.body.model import BodyModel
from manikin.numerics.spatial import FloatArray, skew
from manikin.scene.distance import Ignored, Pair, Proximity, segment_of
from manikin.scene.spheres import SphereProximity

UP: FloatArray = np.array([0.0, 0.0, 1.0])
UP.setflags(write=False)


class Linearised(NamedTuple):
    """A residual (m,) and its Jacobian (m, nv)."""

    residual: FloatArray
    jacobian: FloatArray


class Term(Protocol):
    """A residual that is to be small."""

    def evaluate(self, configuration: Configuration) -> Linearised:
        """Residual and Jacobian at a configuration."""
        ...


class PostureRequirement(Term, Protocol):
    """A residual that is to be zero."""

    def describe(self, residual: FloatArray) -> str:
        """Meaning of a residual of this term in words."""
        ...


@dataclass(frozen=True, eq=False)
class PositionTerm:
    """An effector's origin at a position (3,) in the world: ``r = p - p*`` [m]; messages name the kind."""

    effector: str
    position: FloatArray
    kind: str = "placement"

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        _, position = configuration.effector_placement(self.effector)
        return Linearised(position - self.position, configuration.effector_jacobian(self.effector)[:3])

    def describe(self, residual: FloatArray) -> str:
        """See :class:`PostureRequirement`."""
        return f"{self.kind} '{self.effector}' misses its position by {np.linalg.norm(residual):.4f} m"


@dataclass(frozen=True, eq=False)
class RotationTerm:
    """An effector's axes as in a rotation (3, 3) to the world: ``r = log(R R*^T)`` in the world [rad]."""

    effector: str
    rotation: FloatArray
    kind: str = "placement"

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        rotation, _ = configuration.effector_placement(self.effector)
        error = rotation @ self.rotation.T
        # Turning the world axes is a left perturbation: log(exp(w) E) = log(E exp(E^T w)).
        derivative = pin.Jlog3(error) @ error.T
        return Linearised(pin.log3(error), derivative @ configuration.effector_jacobian(self.effector)[3:])

    def describe(self, residual: FloatArray) -> str:
        """See :class:`PostureRequirement`."""
        angle = np.rad2deg(np.linalg.norm(residual))
        return f"{self.kind} '{self.effector}' misses its orientation by {angle:.2f} deg"


@dataclass(frozen=True, eq=False)
class EdgeTerm:
    """A sole that stands on one edge, the hinge of its toes or its heel, and may pitch about it.

    The edge's middle is in its place [m]; the sole's y axis is that of the contact, the pitch is between its
    bounds and the toes stay flat [rad].

    Attributes:
        effector: Name of the effector.
        pivot: (3,) middle of the edge in the effector's frame [m].
        position: (3,) origin of the sole lying flat [m].
        rotation: (3, 3) its axes to the world's.
        least, most: Bounds of the pitch, heel up when positive [rad].
        toes: Index of the toes' hinge in the velocity vector, or None where they do not carry.
        radius: By which the edge moves forward per pitch: it is round, and rolls [m/rad].
    """

    effector: str
    pivot: FloatArray
    position: FloatArray
    rotation: FloatArray
    least: float
    most: float
    toes: int | None = None
    radius: float = 0.0

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        rotation, position = configuration.effector_placement(self.effector)
        linear, angular = np.split(configuration.effector_jacobian(self.effector), 2)
        arm, along, own = rotation @ self.pivot, rotation[:, 0], rotation[:, 1]
        forward, up = self.rotation[:, 0], self.rotation[:, 2]
        sine, cosine = -along @ up, along @ forward
        pitch = float(np.arctan2(sine, cosine))
        beyond = min(pitch - self.least, 0.0) + max(pitch - self.most, 0.0)
        turn = -cosine * np.cross(along, up) - sine * np.cross(along, forward)
        turning = turn @ angular / (sine**2 + cosine**2)
        rows = [
            linear - skew(arm) @ angular - self.radius * np.outer(forward, turning),
            np.cross(own, forward) @ angular, np.cross(own, up) @ angular,
            turning if beyond else np.zeros_like(turning),
        ]  # fmt: skip
        place = position + arm - self.position - self.rotation @ self.pivot - self.radius * pitch * forward
        residual = [*place, own @ forward, own @ up, beyond]
        if self.toes is not None:
            flat = -turning
            flat[self.toes] += 1.0
            rows.append(flat)
            residual.append(float(configuration.q[self.toes + 1]) - pitch)
        return Linearised(np.array(residual), np.vstack(rows))

    def describe(self, residual: FloatArray) -> str:
        """See :class:`PostureRequirement`."""
        gap, angle = np.linalg.norm(residual[:3]), np.rad2deg(np.linalg.norm(residual[3:]))
        return f"edge of contact '{self.effector}' misses its place by {gap:.4f} m and {angle:.2f} deg"


@dataclass(frozen=True, eq=False)
class ComTerm:
    """The centre of mass at a position (3,), NaN for free axes: ``r = c - c*`` [m]."""

    position: FloatArray

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        axes = np.isfinite(self.position)
        return Linearised(configuration.com[axes] - self.position[axes], configuration.com_jacobian[axes])

    def describe(self, residual: FloatArray) -> str:
        """See :class:`PostureRequirement`."""
        axes = [axis for axis, value in zip("xyz", self.position, strict=True) if np.isfinite(value)]
        parts = ", ".join(f"{axis} {value:+.4f}" for axis, value in zip(axes, residual, strict=True))
        return f"centre of mass misses by {np.linalg.norm(residual):.4f} m ({parts})"


@dataclass(frozen=True, eq=False)
class UprightTerm:
    """Vertical axes of segments upright: ``r = z - up`` of each, the chord of the tilt.

    Unlike the sine it grows up to the opposite direction, so that a raised arm is drawn down.
    """

    segments: tuple[str, ...]

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        axes = np.array([configuration.segment_placement(name)[0][:, 2] for name in self.segments])
        turning = np.array([configuration.segment_jacobian(name)[3:] for name in self.segments])
        # With the angular velocity w an axis z changes by w x z.
        x, y, z = axes.T[:, :, None]
        first, second, third = turning.transpose(1, 0, 2)
        moving = np.stack([second * z - third * y, third * x - first * z, first * y - second * x], axis=1)
        return Linearised((axes - UP).ravel(), moving.reshape(-1, moving.shape[-1]))


@dataclass(frozen=True, eq=False)
class ReferenceTerm:
    """The hinges near reference angles (nv - 6,): ``r = q_hinges - q*_hinges`` [rad]."""

    angles: FloatArray

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`Term`."""
        return Linearised(configuration.q[7:] - self.angles, self._jacobian)

    @cached_property
    def _jacobian(self) -> FloatArray:
        count = len(self.angles)
        return np.hstack([np.zeros((count, 6)), np.eye(count)])


class LimitTerm:
    """The hinge ranges (nv - 6,) of a body, less a margin at both ends of at most a quarter of each [rad]."""

    def __init__(self, body: BodyModel, margin: float = 0.0) -> None:
        margins = np.minimum(margin, 0.25 * (body.upper - body.lower))
        self.body, self.lower, self.upper = body, body.lower + margins, body.upper - margins

    def at_limit(self, configuration: Configuration) -> tuple[str, ...]:
        """Names of the hinges within 1e-3 rad of an end of their range."""
        angles = configuration.q[7:]
        slack = np.minimum(angles - self.lower, self.upper - angles)
        return tuple(name for name, room in zip(self.body.joint_names, slack, strict=True) if room < 1e-3)


BESIDE = 5e-4
"""Distance of what may be as near as touching; more than the solver's tolerance [m]."""

NEARBY = 3.5e-3
"""Distance of forearms from what their hands hold [m]: 1.5 mm more than a refined motion has to keep."""

SINKING = -4e-3
"""Distance of what touches at a point from what it touches [m]: 1 mm less deep than a check allows."""

GRASPING = -0.055
"""Distance of an open hand from what its fingers close round [m]: 5 mm less deep than a check allows."""


@dataclass(frozen=True, eq=False)
class ClearanceTerm:
    """No shape closer than a safety distance to an obstacle or to another part of the body.

    Attributes:
        proximity: Measures the distances.
        safety: Distance to keep to obstacles [m].
        self_safety: Distance to keep between body parts [m].
        activation: Pairs farther apart than the safety distance plus this are left out [m].
        ignore: Pairs of names that may touch.
        touching: Distances that pairs (segment, obstacle) keep which may touch, negative inside [m].
    """

    proximity: Proximity | SphereProximity
    safety: float
    self_safety: float
    activation: float
    ignore: Ignored
    touching: Mapping[Pair, float] = field(default_factory=dict)

    def evaluate(self, configuration: Configuration) -> tuple[Linearised, tuple[Pair, ...]]:
        """Distances beyond the safety distance [m] of the pairs of shapes that are close."""
        reach = max(self.safety, self.self_safety) + self.activation
        close = self.proximity.evaluate(configuration.q, reach, self.ignore)
        safety = np.array([self._safety(*pair) for pair in close.pairs])
        gradient = close.gradient.reshape(-1, configuration.body.nv)
        return Linearised(close.distance - safety, gradient), close.pairs

    def describe(self, residual: FloatArray, pairs: tuple[Pair, ...]) -> str:
        """Say which pair is closest to or beyond its safety distance."""
        worst = int(np.argmin(residual))
        first, second = pairs[worst]
        safety = self._safety(first, second)
        return f"'{first}' and '{second}' are {residual[worst] + safety:.4f} m apart; required {safety:.4f} m"

    def _safety(self, shape: str, other: str) -> float:
        """Distance that a pair has to keep [m]."""
        if "/" in other:
            return self.self_safety
        return min(self.touching.get((segment_of(shape), other), np.inf), self.safety)
