"""The motion nearest to a recorded one that its contacts can carry.

Markers give the position of a body to a centimetre, which leaves its acceleration open: a millimetre at 4 Hz
is 0.6 m/s^2, which moves the zero moment point by 6 cm. A margin that is not positive therefore means that a
person was out of balance only if no motion within the error of the recording is in balance.

The whole body is shifted in every frame by a smooth ``s(t)``, its postures kept, such that the wrench stays
within the admissible ones by a given margin, and

    ``sum |s|^2 / e^2 + |s''|^2 / f^2 + y^2 / a^2``

is least, with ``e`` and ``f`` the errors of position and acceleration, and ``y`` the distance of the centre
of pressure of a foot that carries alone from its long axis, which is about ``a`` in people who walk. The
wrench of the shifted body is

    ``w(s) = w + [m s'', s x f + c x m s'']``,

linear in ``s`` but for its product with itself, so that this is a quadratic program; ``s`` is a spline of
fifth degree, differentiated like the motion. Reported margins are measured on the shifted motion. Where a
facet at the imposed margin, the floor, holds the shift, the margin of the shifted motion says nothing about
the person (:attr:`LeastShift.at_floor`).

The imposed margin is a distance to the facets with moments about the middle of the contacts of the phase,
per body weight: where a sole tips it is the distance of the centre of pressure from the edge. It does not
depend on the world's origin, nor, as the bounds of a shift are along the person's axes at the first instant,
on the world's heading. Only facets that a solution violates enter the program. What no shift within the
bounds repairs remains: the largest violation of each frame has a price.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import BSpline

from manikin.balance import WrenchPolytope
from manikin.contact import ContactKind
from manikin.errors import InputError
from manikin.numerics.qp import solve_sparse_qp
from manikin.numerics.spatial import (
    GRAVITY,
    FloatArray,
    cross,
    finite_number,
    frozen_array,
    rotation_from_yaw,
    wrench_about,
)
from manikin.recordings.dynamics.recorded_dynamics import (
    RecordedDynamics,
    RecordedMargins,
    dynamics_of_postures,
    margins_within,
)
from manikin.recordings.reconstruction.proportions import Reconstruction, level_heading

PLACE_ERROR, ACCELERATION_ERROR = 0.005, 0.3
"""``e`` and ``f``: of the centre of mass by markers [m], and of its acceleration [m/s^2]."""

ASIDE = 0.02
"""``a``: force plates under 11 straight walks of seven people say 6 to 25 mm, root mean square [m]."""

LARGEST_SHIFT = 0.03
"""Bound on the shift ahead, to the left and up, each [m]: more is no error of a recording."""

INSIDE, AT_FLOOR = 0.01, 2e-4
"""Margin that is imposed, per body weight [m]: so far from the edge of a sole is the centre of pressure; and
the difference from it up to which a facet of the program is at it."""

KNOTS = 0.04
"""Time between the knots of the spline [s]: a shift up to some 10 Hz."""

LARGEST_RMS, LEAST_BALANCED = 0.01, 0.9
"""Of shifts that are believed: longest root mean square [m], least share of balanced frames with contacts."""

PRICE, TOLERANCE = 1e4, 1e-4
"""Price of a violation, per metre, and violations that are let pass, per body weight [m]."""

ROUNDS, _DEGREE = 12, 5
"""Most times that violated facets are added; degree of the spline."""


@dataclass(frozen=True, eq=False)
class LeastShift:
    """A recorded motion, shifted so that its contacts can carry it.

    Attributes:
        dynamics: Of the shifted motion, as are ``margins``.
        shift: (n, 3) of the whole body in each frame, world frame [m].
        solved: Whether one was found; if not, the motion is as recorded, or shifted too little.
        floor: Margin that was imposed, moments about the middle of the contacts [N.m].
        at_floor: (n,) whether a facet at the floor holds the shift: there the margin of the shifted motion
            was imposed, and is no result of the recording.
    """

    dynamics: RecordedDynamics
    margins: RecordedMargins
    shift: FloatArray
    solved: bool
    floor: float
    at_floor: NDArray[np.bool_]

    @property
    def floor_length(self) -> float:
        """The imposed margin per body weight [m]."""
        return self.floor / (GRAVITY * self.dynamics.body.mass)

    @property
    def size(self) -> FloatArray:
        """(n,) length of the shift [m]."""
        return np.linalg.norm(self.shift, axis=1)

    @property
    def rms(self) -> float:
        """Root mean square of the shift [m]."""
        return float(np.sqrt(np.mean(self.size**2)))

    @property
    def believable(self) -> bool:
        """Whether the shift leads to balance and is as short as a recording's errors.

        If not, contacts are missing, and it means nothing.
        """
        balanced = self.margins.balanced or 0.0
        return self.solved and balanced >= LEAST_BALANCED and self.rms <= LARGEST_RMS


def least_shift(
    found: Reconstruction, dynamics: RecordedDynamics, margins: RecordedMargins, inside: float = INSIDE,
    aside: float | None = ASIDE,
) -> LeastShift:  # fmt: skip
    """Shift a recorded motion as little as its contacts ask for.

    Args:
        found: The reconstruction of the person.
        dynamics: Of its smooth postures; ``margins`` are those on its stances.
        inside: Margin to impose, per body weight [m], at least 0.
        aside: ``a`` [m], above 0; None to shift no more than the contacts ask for.
    """
    if not inside >= 0.0:
        raise InputError(f"inside is {inside!r}; valid: at least 0 m")
    if aside is not None:
        finite_number(aside, "aside [m]", above=0.0)
    weight = GRAVITY * dynamics.body.mass
    kept, spline = inside * weight, _Spline.over(dynamics.time)
    axes = _Rows.joined([] if aside is None else list(_sole_axes(dynamics, margins)))
    turn = rotation_from_yaw(level_heading(dynamics.q[:1]))
    shift, bend = np.zeros((len(dynamics), 3)), np.zeros((len(dynamics), 3))
    used, solved = np.zeros((0, 2), dtype=np.int64), True
    for number in range(ROUNDS):
        wrench = _shifted_wrench(dynamics, shift, bend)
        known = np.unique(np.vstack([used, _violated(margins, wrench, kept - TOLERANCE * weight)]), axis=0)
        if len(known) == len(used) and (number or not len(axes.frame)):
            break
        used = known
        facets = _facets(dynamics, margins, used, kept)
        coefficients = _solve(facets.turned(turn), axes.turned(turn, aside or 1.0), spline)
        if coefficients is None:
            solved = False
            break
        coefficients = coefficients @ turn.T
        shift, bend = spline.values @ coefficients, spline.second @ coefficients
    moved, held, at_floor = dynamics, margins, np.zeros(len(dynamics), dtype=bool)
    if shift.any():
        for frames, distance, lengths in _distances(margins, _shifted_wrench(dynamics, shift, bend)):
            left = (distance / lengths).min(axis=1) - kept
            at_floor[frames] = np.abs(left) <= AT_FLOOR * weight
        q = np.array(dynamics.q)
        q[:, :3] += shift
        moved = dynamics_of_postures(replace(found, body=dynamics.body), q)
        held = margins_within(margins.polytopes, margins.phase, moved)
    at_floor.setflags(write=False)
    return LeastShift(moved, held, frozen_array(shift, "shift"), solved, kept, at_floor)


def _shifted_wrench(dynamics: RecordedDynamics, shift: FloatArray, bend: FloatArray) -> FloatArray:
    """(n, 6) about the world's origin, the product of the shift with itself left out [N, N.m]."""
    force = dynamics.body.mass * bend
    moment = cross(shift, dynamics.wrench[:, :3]) + cross(dynamics.com, force)
    return dynamics.wrench + np.hstack([force, moment])


def _lengths(polytope: WrenchPolytope) -> FloatArray:
    """(m,) lengths of the rows of a polytope with moments about the middle of its contacts."""
    middle = np.mean([contact.position for contact in polytope.stance], axis=0)
    force, moment = polytope.H[:, :3], polytope.H[:, 3:]
    force = force + cross(moment, middle - polytope.reference)
    return np.sqrt(np.sum(force**2, axis=1) + np.sum(moment**2, axis=1))


def _distances(
    margins: RecordedMargins, wrench: FloatArray
) -> Iterator[tuple[NDArray[np.int64], FloatArray, FloatArray]]:
    """Of each phase with contacts the frames, their distances (k, m) to the facets, and :func:`_lengths`."""
    for number in np.unique(margins.phase):
        polytope = margins.polytopes[number]
        if polytope is not None:
            frames = np.flatnonzero(margins.phase == number)
            distance = polytope.distances(wrench_about(wrench[frames], polytope.reference))
            yield frames, distance, _lengths(polytope)


def _violated(margins: RecordedMargins, wrench: FloatArray, least: float) -> NDArray[np.int64]:
    """(v, 2) frame and facet of its polytope, of all that are nearer than the least distance, or beyond."""
    found = [np.zeros((0, 2), dtype=np.int64)]
    for frames, distance, lengths in _distances(margins, wrench):
        where, row = np.nonzero(distance < least * lengths)
        found.append(np.column_stack([frames[where], row]))
    return np.vstack(found)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Lengths that a shift changes: ``base - on . (s, s'')``, a moment or force per body weight [m].

    In (v,) frames they are ``base`` (v,) without a shift; it and its second derivative take (v, 3) each.
    """

    frame: NDArray[np.int64]
    base: FloatArray
    on_shift: FloatArray
    on_bend: FloatArray

    @classmethod
    def of(
        cls, dynamics: RecordedDynamics, frame: NDArray[np.int64], H: FloatArray, h: FloatArray,
        about: FloatArray,
    ) -> "_Rows":  # fmt: skip
        """``h - H w`` of (v, 6) rows in (v,) frames, moments about a point."""
        weight, (force, moment) = GRAVITY * dynamics.body.mass, (H[:, :3], H[:, 3:])
        base = (h - np.sum(H * wrench_about(dynamics.wrench[frame], about), axis=1)) / weight
        # H_m . (s x f) = s . (f x H_m), and H_m . (c x s'') = s'' . (H_m x c)
        on_shift = cross(dynamics.wrench[frame, :3], moment) / weight
        on_bend = (force + cross(moment, dynamics.com[frame] - about)) / GRAVITY
        return cls(frame, base, on_shift, on_bend)

    @classmethod
    def joined(cls, parts: Sequence["_Rows"]) -> "_Rows":
        """The rows of several, or of none."""
        none = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
        each = [none, *((one.frame, one.base, one.on_shift, one.on_bend) for one in parts)]
        return cls(*(np.concatenate(column) for column in zip(*each, strict=True)))

    def turned(self, axes: FloatArray, unit: float = 1.0) -> "_Rows":
        """Rows for shifts along the columns of ``axes`` (3, 3), in another unit of length."""
        base, on_shift, on_bend = (each / unit for each in (self.base, self.on_shift, self.on_bend))
        return _Rows(self.frame, base, on_shift @ axes, on_bend @ axes)

    def taken(self, spline: "_Spline") -> list[sparse.csr_array]:
        """What the coefficients of each axis take, (v, k) each."""
        values, second = spline.values[self.frame], spline.second[self.frame]
        parts = zip(self.on_shift.T[..., None], self.on_bend.T[..., None], strict=True)
        return [sparse.csr_array(values.multiply(a) + second.multiply(b)) for a, b in parts]


def _facets(
    dynamics: RecordedDynamics, margins: RecordedMargins, used: NDArray[np.int64], kept: float
) -> _Rows:
    """Distances of (v, 2) frames and facets, less what is kept, by their phases."""
    phases, parts = margins.phase[used[:, 0]], []
    for number in np.unique(phases):
        polytope = margins.polytopes[number]
        assert polytope is not None  # none is violated in flight
        frame, row = used[phases == number].T
        left = polytope.h[row] - kept * _lengths(polytope)[row]
        parts.append(_Rows.of(dynamics, frame, polytope.H[row], left, polytope.reference))
    return _Rows.joined(parts)


def _sole_axes(dynamics: RecordedDynamics, margins: RecordedMargins) -> Iterator[_Rows]:
    """Moments about the long axis of each foot that carries alone."""
    for number in np.unique(margins.phase):
        polytope = margins.polytopes[number]
        if polytope is None or len(polytope.stance) != 1:
            continue
        contact = polytope.stance.contacts[0]
        if contact.kind is ContactKind.SOLE and contact.effector.endswith("foot"):
            frame = np.flatnonzero(margins.phase == number)
            rows = np.zeros((len(frame), 6))
            rows[:, 3:] = contact.rotation_contact_to_world[:, 0]
            yield _Rows.of(dynamics, frame, rows, np.zeros(len(frame)), contact.position)


@dataclass(frozen=True, eq=False)
class _Spline:
    """Values (n, k) and second differences (n, k) of the k splines of a basis at the frames."""

    values: sparse.csr_array
    second: sparse.csr_array

    @classmethod
    def over(cls, time: FloatArray) -> "_Spline":
        """Basis with even knots over the instants, none closer than they are."""
        n, step = len(time), float(time[-1] - time[0]) / (len(time) - 1)
        spans = max(int((time[-1] - time[0]) / max(KNOTS, step)), 1)
        inner = np.linspace(time[0], time[-1], spans + 1)
        knots = np.r_[[inner[0]] * _DEGREE, inner, [inner[-1]] * _DEGREE]
        values = sparse.csr_array(BSpline.design_matrix(time, knots, _DEGREE))
        # As velocities and accelerations of recorded postures, see recorded_dynamics.rates_of.
        velocity = sparse.lil_array((n, n))
        velocity.setdiag(-0.5, -1)
        velocity.setdiag(0.5, 1)
        velocity[0, :3], velocity[n - 1, n - 3 :] = [-1.5, 2.0, -0.5], [0.5, -2.0, 1.5]
        gradient = velocity.tocsr() / step
        return cls(values, sparse.csr_array(gradient @ gradient @ values))


def _solve(facets: _Rows, axes: _Rows, spline: _Spline) -> FloatArray | None:
    """(k, 3) coefficients of the least shift that keeps to the facets, as far as its bounds allow.

    None where the solver finds none, as for postures that jump.
    """
    count = (spline.values.shape or (0, 0))[1]
    cost = spline.values.T @ spline.values / PLACE_ERROR**2
    cost = cost + spline.second.T @ spline.second / ACCELERATION_ERROR**2
    aside = sparse.hstack(axes.taken(spline)).tocsr()
    frames, owner = np.unique(facets.frame, return_inverse=True)
    ones = -np.ones(len(owner)), (np.arange(len(owner)), owner)
    excess = sparse.csr_array(ones, shape=(len(owner), len(frames)))
    moved = sparse.block_diag([cost, cost, cost]) + aside.T @ aside
    quadratic = sparse.block_diag([moved, sparse.csr_array((len(frames), len(frames)))])
    linear = np.concatenate([-(aside.T @ axes.base), np.full(len(frames), PRICE)])
    bound = np.concatenate([np.full(3 * count, LARGEST_SHIFT), np.full(len(frames), np.inf)])
    rows = sparse.csc_matrix(sparse.hstack([*facets.taken(spline), excess]))
    solution = solve_sparse_qp(
        quadratic, linear, rows, None, facets.base,
        (np.where(np.isinf(bound), 0.0, -bound), bound), tolerance=1e-8,
    )  # fmt: skip
    return solution.x[: 3 * count].reshape(3, count).T if solution.solved else None
