"""The motion nearest to a recorded one that its contacts can carry.

Markers tell where a body is to a centimetre, and so leave its acceleration open: a millimetre to and fro at
4 Hz is 0.6 m/s^2, which moves the zero moment point by 6 cm. A margin that is not positive therefore need not
say that a person was out of balance. It says so if no motion within the error of the recording is in balance.

Here the whole body is shifted in every frame by a smooth ``s(t)``, all of its postures kept, such that the
wrench stays within the admissible ones by a given margin, and ``sum |s|^2 / e^2 + |s''|^2 / f^2`` is least,
with ``e`` and ``f`` the errors of place and of acceleration. The wrench of the shifted body is

    ``w(s) = w + [m s'', s x f + c x m s'']``,

linear in ``s`` but for its product with itself, so that this is a quadratic program; ``s`` is a spline of
fifth degree and its derivatives are the differences with which the motion itself is differentiated. Only
facets that a solution violates enter it, a few at a time. What no shift up to a bound repairs stays as it is,
as far as it must: the largest violation of each frame is paid for at a price.
"""

from dataclasses import dataclass, replace

import numpy as np
import piqp
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import BSpline

from manikin.balance.friction import cross
from manikin.errors import InputError
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_dynamics import RecordedDynamics, dynamics_of_postures
from manikin.mocap.recorded_margins import RecordedMargins, margins_within, wrench_at
from manikin.spatial import GRAVITY, FloatArray, frozen_array

PLACE_ERROR = 0.005
"""``e``: of the centre of mass by markers [m]."""

ACCELERATION_ERROR = 0.3
"""``f``: of its acceleration [m/s^2]."""

LARGEST_SHIFT = 0.03
"""Bound on each component of the shift [m]: more is no error of a recording."""

INSIDE = 0.01
"""Margin that is kept, per body weight [m]: so far from the edge of a sole is the centre of pressure."""

KNOTS = 0.04
"""Time between the knots of the spline [s]: a shift up to 6 Hz."""

PRICE = 1e4
"""Of a violation, per metre: more than what a shift within the bound costs."""

REACH = 0.2
"""Farther from a facet no shift brings the wrench, per body weight [m]."""

TOLERANCE = 1e-4
"""Violations that are let pass, per body weight [m]."""

ROUNDS = 12
"""Most times that violated facets are added."""

_DEGREE = 5


@dataclass(frozen=True, eq=False)
class LeastShift:
    """A recorded motion, shifted so that its contacts can carry it.

    Attributes:
        dynamics: Of the shifted motion.
        margins: Of the shifted motion.
        shift: (n, 3) of the whole body in each frame, world frame [m].
    """

    dynamics: RecordedDynamics
    margins: RecordedMargins
    shift: FloatArray

    @property
    def size(self) -> FloatArray:
        """(n,) length of the shift [m]."""
        return np.linalg.norm(self.shift, axis=1)

    @property
    def rms(self) -> float:
        """[m]."""
        return float(np.sqrt(np.mean(self.size**2)))


def least_shift(
    found: Reconstruction,
    dynamics: RecordedDynamics,
    margins: RecordedMargins,
    inside: float = INSIDE,
) -> LeastShift:
    """Shift a recorded motion as little as its contacts ask for.

    Args:
        found: The reconstruction of the person.
        dynamics: Of its smooth postures.
        margins: Of ``dynamics`` on its stances.
        inside: Margin to keep, per body weight [m].

    Raises:
        InputError: If ``inside`` is negative.
    """
    if not inside >= 0.0:
        raise InputError(f"inside is {inside!r}; valid: at least 0 m")
    facets = _Facets.near(dynamics, margins, inside)
    spline = _Spline.over(dynamics.time)
    shift, bend = np.zeros((len(dynamics), 3)), np.zeros((len(dynamics), 3))
    used = np.zeros(len(facets.frame), dtype=bool)
    for _ in range(ROUNDS):
        new = ~used & (facets.distances(shift, bend) < -TOLERANCE)
        if not new.any():
            break
        used |= new
        coefficients = _solve(facets.part(used), spline)
        if coefficients is None:
            break
        shift, bend = spline.values @ coefficients, spline.second @ coefficients
    if not shift.any():
        return LeastShift(dynamics, margins, frozen_array(shift, "shift"))
    q = np.array(dynamics.q)
    q[:, :3] += shift
    moved = dynamics_of_postures(replace(found, body=dynamics.body), q)
    return LeastShift(
        moved, margins_within(margins.polytopes, margins.phase, moved), frozen_array(shift, "shift")
    )


@dataclass(frozen=True, eq=False)
class _Facets:
    """Facets near the wrench of a frame; distances are per body weight [m], ``base - on . (s, s'')``.

    Attributes:
        frame: (v,) which frame.
        base: (v,) distance to the facet, less what is kept.
        on_shift: (v, 3) what a shift takes from it.
        on_bend: (v, 3) what its second derivative takes.
    """

    frame: NDArray[np.int64]
    base: FloatArray
    on_shift: FloatArray
    on_bend: FloatArray

    @classmethod
    def near(cls, dynamics: RecordedDynamics, margins: RecordedMargins, inside: float) -> "_Facets":
        """Those within reach of a shift, of all frames with contacts."""
        mass = dynamics.body.mass
        parts = []
        for number in np.unique(margins.phase):
            polytope = margins.polytopes[number]
            if polytope is None:
                continue
            frames = np.flatnonzero(margins.phase == number)
            distance = polytope.distances(wrench_at(dynamics.wrench[frames], polytope.reference))
            distance /= GRAVITY * mass
            where, row = np.nonzero(distance < inside + REACH)
            frame = frames[where]
            force, moment = polytope.H[row, :3], polytope.H[row, 3:]
            # H_m . (s x f) = s . (f x H_m), and H_m . (c x s'') = s'' . (H_m x c)
            parts.append((
                frame, distance[where, row] - inside,
                cross(dynamics.wrench[frame, :3], moment) / (GRAVITY * mass),
                (force + cross(moment, dynamics.com[frame] - polytope.reference)) / GRAVITY,
            ))  # fmt: skip
        if not parts:
            return cls(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))
        return cls(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def part(self, chosen: NDArray[np.bool_]) -> "_Facets":
        """Some of them."""
        return _Facets(self.frame[chosen], self.base[chosen], self.on_shift[chosen], self.on_bend[chosen])

    def distances(self, shift: FloatArray, bend: FloatArray) -> FloatArray:
        """(v,) for (n, 3) shifts and their second derivatives; negative beyond what is kept [m]."""
        taken = self.on_shift * shift[self.frame] + self.on_bend * bend[self.frame]
        return self.base - taken.sum(axis=1)


@dataclass(frozen=True, eq=False)
class _Spline:
    """Values (n, k) and second differences (n, k) of the k splines of a basis at the frames."""

    values: sparse.csr_array
    second: sparse.csr_array
    count: int

    @classmethod
    def over(cls, time: FloatArray) -> "_Spline":
        """Basis with even knots over the instants, none closer than they are."""
        n, step = len(time), float(time[-1] - time[0]) / (len(time) - 1)
        spans = max(int((time[-1] - time[0]) / max(KNOTS, step)), 1)
        inner = np.linspace(time[0], time[-1], spans + 1)
        knots = np.r_[[inner[0]] * _DEGREE, inner, [inner[-1]] * _DEGREE]
        values = sparse.csr_array(BSpline.design_matrix(time, knots, _DEGREE))
        # As velocities and accelerations of recorded postures, see recorded_motion.rates_of.
        velocity = sparse.lil_array((n, n))
        velocity.setdiag(-0.5, -1)
        velocity.setdiag(0.5, 1)
        velocity[0, :3], velocity[n - 1, n - 3 :] = [-1.5, 2.0, -0.5], [0.5, -2.0, 1.5]
        gradient = velocity.tocsr() / step
        return cls(values, sparse.csr_array(gradient @ gradient @ values), spans + _DEGREE)


def _solve(facets: _Facets, spline: _Spline) -> FloatArray | None:
    """(k, 3) coefficients of the least shift that keeps to the facets, as far as its bound allows.

    None where the solver finds none, as for postures that jump.
    """
    count = spline.count
    cost = spline.values.T @ spline.values / PLACE_ERROR**2
    cost = cost + spline.second.T @ spline.second / ACCELERATION_ERROR**2
    frames, owner = np.unique(facets.frame, return_inverse=True)
    excess = sparse.csr_array((-np.ones(len(owner)), (np.arange(len(owner)), owner)))
    taken = [
        spline.values[facets.frame].multiply(facets.on_shift[:, [axis]])
        + spline.second[facets.frame].multiply(facets.on_bend[:, [axis]])
        for axis in range(3)
    ]
    quadratic = sparse.block_diag([cost, cost, cost, sparse.csr_array((len(frames), len(frames)))])
    linear = np.concatenate([np.zeros(3 * count), np.full(len(frames), PRICE)])
    bound = np.concatenate([np.full(3 * count, LARGEST_SHIFT), np.full(len(frames), np.inf)])
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-8
    solver.setup(
        sparse.csc_matrix(quadratic), linear, None, None, sparse.csc_matrix(sparse.hstack([*taken, excess])),
        None, facets.base, np.where(np.isinf(bound), 0.0, -bound), bound,
    )  # fmt: skip
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    return solver.result.x[: 3 * count].reshape(3, count).T
