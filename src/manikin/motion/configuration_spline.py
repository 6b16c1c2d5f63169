"""A whole-body motion as one clamped B-spline in configuration space.

The control points live in R^nq: pelvis position, four quaternion components and the joint angles. The
quaternion is normalised on evaluation, so the motion is smooth wherever the raw one does not vanish.
Velocities and accelerations are exact derivatives, in Pinocchio's convention (pelvis frame).
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from manikin.errors import SplineError
from manikin.numerics.spatial import FloatArray, frozen_array, rotation_from_quaternion, skew


class StateSamples(NamedTuple):
    """Configurations (n, nq) with unit quaternions, and their exact derivatives (n, nq - 1).

    The pelvis' part of velocity and acceleration is in the pelvis frame.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


@dataclass(frozen=True, eq=False)
class ConfigurationSpline:
    """Clamped B-spline ``q(t)`` of a free-floating body.

    Attributes:
        knots: (m,) clamped knots [s].
        control_points: (k, nq), raw: the quaternion columns need not be of unit length.
        degree: Polynomial degree.
    """

    knots: FloatArray
    control_points: FloatArray
    degree: int

    def __post_init__(self) -> None:
        what = "configuration spline"
        knots = frozen_array(self.knots, f"{what} knots [s]", (None,), SplineError)
        points = frozen_array(self.control_points, f"{what} control points", (None, None), SplineError)
        if len(knots) != len(points) + self.degree + 1:
            told = f"{what} has {len(knots)} knots and {len(points)} control points of degree {self.degree}"
            raise SplineError(f"{told}; valid: knots = control points + degree + 1")
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "control_points", points)

    @classmethod
    def joined(cls, parts: "Sequence[ConfigurationSpline]") -> "ConfigurationSpline":
        """Splines of one degree one after the other, each of which starts as the one before ends.

        Raises:
            SplineError: If an end and the start after it differ by more than 1e-9.
        """
        knots, points, degree = parts[0].knots, parts[0].control_points, parts[0].degree
        for part in parts[1:]:
            following = np.array(part.control_points)
            if following[0, 3:7] @ points[-1, 3:7] < 0.0:
                following[:, 3:7] *= -1.0
            gap = float(np.abs(following[0] - points[-1]).max())
            if gap > 1e-9 or part.degree != degree:
                told = f"splines of degrees {degree} and {part.degree} meet with a gap of {gap:.2g}"
                raise SplineError(f"{told}; valid: one degree, and each starts as the one before ends")
            knots = np.concatenate([knots[:-1], knots[-1] - part.knots[0] + part.knots[degree + 1 :]])
            points = np.concatenate([points, following[1:]])
        return cls(knots, points, degree)

    def on_knots(self, knots: FloatArray) -> "ConfigurationSpline":
        """The same motion on clamped knots [s] that include its own (knot insertion, [deBoor2001]_ XI).

        Raises:
            SplineError: If one of its knots is missing among them.
        """
        finer, own = np.unique(knots), np.unique(self.knots)
        if not np.isin(own, finer).all():
            missing = own[~np.isin(own, finer)][0]
            raise SplineError(f"knots lack {missing:.6g} s; valid: knots that include those of the spline")
        spline = BSpline(self.knots, self.control_points, self.degree)
        for knot in np.setdiff1d(finer, own):
            spline = spline.insert_knot(knot)
        return ConfigurationSpline(spline.t, spline.c, self.degree)

    def evaluate(self, time: ArrayLike) -> StateSamples:
        """Evaluate the motion at ``time`` (n,) [s], clamped to the spline's interval."""
        t = np.clip(np.atleast_1d(np.asarray(time, dtype=float)), self.knots[0], self.knots[-1])
        spline = BSpline(self.knots, self.control_points, self.degree)
        return states_from_raw(spline(t), spline(t, nu=1), spline(t, nu=2))


def states_from_raw(raw: FloatArray, raw_rate: FloatArray, raw_second: FloatArray) -> StateSamples:
    """Turn raw spline values and derivatives (n, nq) into Pinocchio states.

    With ``rho`` the raw quaternion and ``u = rho / |rho|``, the pelvis turns at
    ``omega = 2 vec(conj(u) u')`` and accelerates at ``2 vec(conj(u) u'')``.
    """
    rho, rho_1, rho_2 = raw[:, 3:7], raw_rate[:, 3:7], raw_second[:, 3:7]
    size = np.linalg.norm(rho, axis=1, keepdims=True)
    u = rho / size
    size_1 = _dot(u, rho_1)
    u_1 = (rho_1 - size_1 * u) / size
    size_2 = _dot(u, rho_2) + _dot(u_1, rho_1)
    u_2 = (rho_2 - size_2 * u - 2.0 * size_1 * u_1) / size
    body = _quaternion_left_vector(u)
    omega = 2.0 * np.einsum("nij,nj->ni", body, u_1)
    alpha = 2.0 * np.einsum("nij,nj->ni", body, u_2)
    world_to_body = rotation_from_quaternion(u).transpose(0, 2, 1)
    linear = np.einsum("nij,nj->ni", world_to_body, raw_rate[:, :3])
    linear_rate = np.einsum("nij,nj->ni", world_to_body, raw_second[:, :3]) - np.cross(omega, linear)
    q, v = np.hstack([raw[:, :3], u, raw[:, 7:]]), np.hstack([linear, omega, raw_rate[:, 7:]])
    return StateSamples(q, v, np.hstack([linear_rate, alpha, raw_second[:, 7:]]))


def tangent_map(raw: FloatArray) -> FloatArray:
    """(n, 7, 7) derivative of Pinocchio's tangent vector by the raw coordinates (n, nq) of the pelvis.

    The first six rows map raw pelvis coordinates to the pelvis part of the tangent; the last is the radial
    direction of the quaternion, which does not move the body. Joint angles map to themselves.
    """
    size = np.linalg.norm(raw[:, 3:7], axis=1)
    u = raw[:, 3:7] / size[:, None]
    block = np.zeros((len(raw), 7, 7))
    block[:, :3, :3] = rotation_from_quaternion(u).transpose(0, 2, 1)
    block[:, 3:6, 3:7] = 2.0 * _quaternion_left_vector(u) / size[:, None, None]
    block[:, 6, 3:7] = u
    return block


class TurnDerivatives(NamedTuple):
    """(n, 3, 4) derivatives of the pelvis' angular velocity ``omega`` and acceleration ``alpha``.

    By the raw quaternion, its rate and its second derivative.
    """

    omega_by_value: FloatArray
    omega_by_rate: FloatArray
    alpha_by_value: FloatArray
    alpha_by_rate: FloatArray
    alpha_by_second: FloatArray


def turn_derivatives(rho: FloatArray, rho_1: FloatArray, rho_2: FloatArray) -> TurnDerivatives:
    """Differentiate ``omega = 2 Q(rho) rho' / |rho|^2`` and its rate (arguments (n, 4)).

    ``alpha = 2 Q(rho) rho'' / |rho|^2 - 2 omega (rho . rho') / |rho|^2``, and
    ``Q(a) b = -Q(b) a`` gives the derivatives by the quaternion itself.
    """
    square = np.sum(rho**2, axis=1)[:, None, None]
    q0, q1, q2 = (_quaternion_left_vector(part) for part in (rho, rho_1, rho_2))
    omega = 2.0 * (q0 @ rho_1[:, :, None]) / square
    stretch = np.sum(rho * rho_1, axis=1)[:, None, None]
    row, row_1 = rho[:, None, :], rho_1[:, None, :]
    by_second = 2.0 * q0 / square
    omega_by_value = -2.0 * q1 / square - 2.0 * omega @ row / square
    alpha = by_second @ rho_2[:, :, None] - 2.0 * omega * stretch / square
    alpha_by_rate = -2.0 * (stretch * by_second + omega @ row) / square
    stretched = stretch * omega_by_value + omega @ row_1
    alpha_by_value = -2.0 * q2 / square - 2.0 * alpha @ row / square - 2.0 * stretched / square
    return TurnDerivatives(omega_by_value, by_second, alpha_by_value, alpha_by_rate, by_second)


def by_raw_spline(
    by_state: Sequence[FloatArray], states: StateSamples, raw: Sequence[FloatArray], tangent: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives by raw spline values, rates and second derivatives, from those by Pinocchio's states.

    The pelvis' velocity and acceleration, in its own frame, depend on its raw attitude, too: with ``R`` the
    pelvis-to-world rotation and ``p`` its place, ``v = R^T p'`` and ``a = R^T p'' - omega x v``.

    Args:
        by_state: Three (n, m, nv), by the tangent of the configuration, by velocity and by acceleration.
        states: That the raw values give.
        raw: Three (n, nq) values, rates and second derivatives.
        tangent: (n, 7, 7) :func:`tangent_map`.

    Returns:
        Three (n, m, nq).
    """
    turn = turn_derivatives(*(part[:, 3:7] for part in raw))
    turned, to_pelvis = tangent[:, 3:6, 3:7], tangent[:, :3, :3]
    linear, omega = skew(states.v[:, :3]), skew(states.v[:, 3:6])
    pulled = skew(states.a[:, :3] + np.cross(states.v[:, 3:6], states.v[:, :3]))

    def pelvis(by_place: FloatArray | float, by_turn: FloatArray | float, turning: FloatArray) -> FloatArray:
        block = np.zeros((len(tangent), 6, 7))
        block[:, :3, :3], block[:, :3, 3:], block[:, 3:, 3:] = by_place, by_turn, turning
        return block

    velocity = (
        pelvis(0.0, linear @ turned, turn.omega_by_value), pelvis(to_pelvis, 0.0, turn.omega_by_rate)
    )  # fmt: skip
    falling = (pulled - omega @ linear) @ turned + linear @ turn.omega_by_value
    acceleration = (
        pelvis(0.0, falling, turn.alpha_by_value),
        pelvis(-omega @ to_pelvis, linear @ turn.omega_by_rate, turn.alpha_by_rate),
        pelvis(to_pelvis, 0.0, turn.alpha_by_second),
    )
    by_q, by_v, by_a = (part[:, :, :6] for part in by_state)
    own = (
        by_q @ tangent[:, :6] + by_v @ velocity[0] + by_a @ acceleration[0],
        by_v @ velocity[1] + by_a @ acceleration[1],
        by_a @ acceleration[2],
    )
    first, second, third = (
        np.concatenate([part, whole[:, :, 6:]], axis=2) for part, whole in zip(own, by_state, strict=True)
    )
    return first, second, third


def align_quaternions(configurations: FloatArray) -> FloatArray:
    """Flip quaternion signs so that consecutive rows lie in the same half-space."""
    aligned = np.array(configurations, dtype=float)
    for before, row in itertools.pairwise(aligned):
        if before[3:7] @ row[3:7] < 0.0:
            row[3:7] *= -1.0
    return aligned


def _quaternion_left_vector(u: FloatArray) -> FloatArray:
    """(n, 3, 4) matrices with ``vec(conj(u) * p) = Q p`` for xyzw quaternions."""
    matrix = np.zeros((len(u), 3, 4))
    matrix[:, :, :3] = u[:, 3, None, None] * np.eye(3) - skew(u[:, :3])
    matrix[:, :, 3] = -u[:, :3]
    return matrix


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.sum(a * b, axis=1, keepdims=True)
