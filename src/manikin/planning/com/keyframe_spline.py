"""The quadratic programme of the keyframe-based method: a spline of least velocity and jerk.

At a key frame the position is given, so that the pseudo-wrench there, ``m [a - g; p x (a - g)]`` ([Qiu2012]_
4.6), is affine in the control points: the bilinear balance constraint of 5.17 is linear wherever 5.14 holds.
With the exactly integrated objective this is a convex quadratic programme. It has one solution, which does
not depend on a first guess, and when it has none that is certain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, null_space, solve_triangular
from scipy.optimize import linprog

from manikin.balance import WrenchPolytope
from manikin.contact import ContactSchedule
from manikin.errors import SolverError
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import GRAVITY_VECTOR, FloatArray, skew
from manikin.numerics.spline import BSpline, basis_matrix, clamped_knots
from manikin.planning.com.com_problem import END_CONDITIONS, CentroidalProblem
from manikin.planning.com.feasibility import row_slopes

TIGHTENING = 1e-4
"""Margin asked for beyond the required one, so that rounding cannot undercut it [N.m] or [N]."""


@dataclass(frozen=True, eq=False)
class KeyframeProgramme:
    """The programme, with the equalities shared by the three axes.

    Control points are ``C`` (n + 1, 3); the equalities are ``E C = values``, the objective is
    the mean over time of ``v' Qv v + a' Qa a + j' Qj j``, and ``rows @ C.ravel() + slopes d <= bounds``
    with the margin d.

    Attributes:
        knots: (n + k + 2,) on [0, 1].
        equalities: (e, n + 1) E.
        values: (e, 3) [m].
        grams: (3, n + 1, n + 1) the objective is ``sum_axis C[:, axis]' gram C[:, axis]``.
        rows: (m, 3 (n + 1)) balance at the key frames.
        slopes: (m,) change of each row per unit of margin.
        bounds: (m,) [N.m].
        frames: (m,) number of the key frame of each row.
        phases: (m,) phase whose polytope gave it.
    """

    degree: int
    knots: FloatArray
    equalities: FloatArray
    values: FloatArray
    grams: FloatArray
    rows: FloatArray
    slopes: FloatArray
    bounds: FloatArray
    frames: np.ndarray
    phases: np.ndarray

    def objective(self, control_points: FloatArray) -> float:
        """Mean over time of the weighted squared derivatives of (n + 1, 3) control points."""
        return float(np.einsum("ia,aij,ja->", control_points, self.grams, control_points))

    def spline(self, control_points: FloatArray) -> BSpline:
        """Spline over [0, 1] of (n + 1, 3) control points."""
        return BSpline(self.degree, self.knots, control_points)

    def margins(self, control_points: FloatArray) -> FloatArray:
        """(m,) margin of every balance row [N.m] or [N]."""
        return (self.bounds - self.rows @ control_points.ravel()) / self.slopes

    def solve(self, margin: float) -> "KeyframeSolution | None":
        """Find the least objective with at least ``margin`` at every key frame; None when there is none.

        The equalities are eliminated, so that they hold to rounding.
        """
        room = self._room()
        limits, identity = room.bounds - room.slopes * (margin + TIGHTENING), np.eye(room.basis.shape[1])
        solution = solve_qp(identity, room.gradient, room.rows, None, limits, tolerance=1e-9)
        if not solution.solved:
            return None
        multipliers = solution.multipliers / room.scale
        return KeyframeSolution(room.points(solution.x), multipliers, solution.iterations)

    def most_margin(self) -> tuple[FloatArray, float, int]:
        """Control points with the largest least margin at the key frames, that margin, and its row.

        Raises:
            SolverError: If the solver fails.
        """
        room = self._room()
        cost = np.append(np.zeros(room.basis.shape[1]), -1.0)
        # The margin's unit makes its column as long as the others.
        unit = 1.0 / float(np.median(room.slopes))
        rows = np.column_stack([room.rows, unit * room.slopes])
        result = linprog(cost, rows, room.bounds, bounds=(None, None), method="highs")
        if not result.success:
            raise SolverError(f"the linear programme of the key frames failed: {result.message}")
        points = room.points(result.x[:-1])
        margins = self.margins(points)
        return points, float(margins.min()), int(np.argmin(margins))

    def _room(self) -> "_Room":
        """Eliminate the equalities and scale what is left."""
        particular = np.linalg.pinv(self.equalities) @ self.values
        kernel = null_space(self.equalities)
        free = np.kron(np.eye(3), kernel)
        gram = np.asarray(block_diag(*self.grams), dtype=np.float64)
        factor = np.linalg.cholesky(2.0 * free.T @ gram @ free)
        basis = free @ solve_triangular(factor, np.eye(len(factor)), lower=True).T
        rows = self.rows.reshape(len(self.rows), -1, 3).transpose(0, 2, 1).reshape(len(self.rows), -1) @ basis
        scale = np.maximum(np.linalg.norm(rows, axis=1), 1e-9)
        return _Room(
            particular, basis, 2.0 * basis.T @ (gram @ particular.T.ravel()), rows / scale[:, None],
            (self.bounds - self.rows @ particular.ravel()) / scale, self.slopes / scale, scale,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Room:
    """The programme in unknowns y that keep the equalities and have the identity as Hessian; unit rows."""

    particular: FloatArray
    basis: FloatArray
    gradient: FloatArray
    rows: FloatArray
    bounds: FloatArray
    slopes: FloatArray
    scale: FloatArray

    def points(self, y: FloatArray) -> FloatArray:
        """(n + 1, 3) control points."""
        return self.particular + (self.basis @ y).reshape(3, -1).T


@dataclass(frozen=True, eq=False)
class KeyframeSolution:
    """Optimum of a programme: (n + 1, 3) control points [m], (m,) multipliers >= 0 of the balance rows."""

    control_points: FloatArray
    multipliers: FloatArray
    iterations: int


def build_keyframe_programme(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], schedule: ContactSchedule,
    times: FloatArray, positions: FloatArray, control_points: int,
) -> KeyframeProgramme:  # fmt: skip
    """Write the programme of [Qiu2012]_ 5.3.2 for (f,) times of key frames, both ends among them [s].

    The problem gives mass, degree, weights, margin and end conditions; the W_i of the phases are about its
    reference. The CoM at the key frames is (f, 3) [m].
    """
    k, duration = problem.degree, float(schedule.instants[-1])
    # First and second derivative over normalised time at both ends, where imposed.
    given = [getattr(problem, name) for name in END_CONDITIONS]
    ends = [
        [value * duration**order for order, value in enumerate(pair, start=1) if value is not None]
        for pair in (given[:2], given[2:])
    ]
    knots = keyframe_knots(k, times / duration, control_points, *map(len, ends))
    equalities = [basis_matrix(k, knots, np.minimum(times / duration, 1.0))]
    values = [positions]
    for end, conditions in zip((0.0, 1.0), ends, strict=True):
        for order, value in enumerate(conditions, start=1):
            equalities.append(basis_matrix(k, knots, end, order))
            values.append(value[None, :])
    return KeyframeProgramme(
        k, knots, np.vstack(equalities), np.vstack(values), _grams(problem, knots, duration),
        *_balance_rows(problem, polytopes, schedule, times, positions, knots),
    )  # fmt: skip


def keyframe_knots(
    degree: int, key_frames: FloatArray, control_points: int, start_derivatives: int, goal_derivatives: int
) -> FloatArray:
    """Knots for which every key frame and end condition can be met, and freedom is spread evenly.

    As many sites as control points are laid out: the key frames (f,) from 0 to 1, the ends once more for each
    derivative imposed there, and the rest one by one in the middle of the longest gap. The inner knots are
    the means of ``degree`` successive sites (de Boor's rule), for which interpolation at the sites has
    exactly one solution (Schoenberg and Whitney). The thesis gives no rule for the knots.

    Returns:
        (control_points + degree + 1,).
    """
    sites = list(key_frames)
    while len(sites) + start_derivatives + goal_derivatives < control_points:
        widest = int(np.argmax(np.round(np.diff(sites), 12)))
        sites.insert(widest + 1, 0.5 * (sites[widest] + sites[widest + 1]))
    sites = [0.0] * start_derivatives + sites + [1.0] * goal_derivatives
    inner = [float(np.mean(sites[j : j + degree])) for j in range(1, control_points - degree)]
    return clamped_knots(degree, [0.0, *inner, 1.0])


def quadrature(degree: int, knots: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes on [0, 1] and weights, (n,) each, exact for squared derivatives of a spline."""
    nodes, shares = np.polynomial.legendre.leggauss(degree)
    breaks = np.unique(knots)
    half = 0.5 * np.diff(breaks)[:, None]
    return (breaks[:-1, None] + half * (1.0 + nodes)).ravel(), (half * shares).ravel()


def _grams(problem: CentroidalProblem, knots: FloatArray, duration: float) -> FloatArray:
    """(3, n + 1, n + 1) matrices of the objective, by quadrature that is exact for the polynomials."""
    k, weights = problem.degree, problem.weights
    times, share = quadrature(k, knots)
    total = np.zeros((3, len(knots) - k - 1, len(knots) - k - 1))
    for order, diagonal in enumerate((weights.velocity, weights.acceleration, weights.jerk), start=1):
        basis = basis_matrix(k, knots, times, order) / duration**order
        total += np.array(diagonal)[:, None, None] * (basis.T @ (share[:, None] * basis))
    return weights.smoothness * total


def _balance_rows(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], schedule: ContactSchedule,
    times: FloatArray, positions: FloatArray, knots: FloatArray,
) -> list[np.ndarray]:  # fmt: skip
    """Rows ``H m [a - g; p x (a - g)] + slope d <= h`` with p given; both polytopes at a key instant.

    They are followed by slopes, bounds, and the key frame and phase of each.
    """
    duration = float(schedule.instants[-1])
    second = basis_matrix(problem.degree, knots, np.minimum(times / duration, 1.0), 2) / duration**2
    parts = []
    for index, (time, position) in enumerate(zip(times, positions, strict=True)):
        for phase in phases_touching(schedule, float(time)):
            polytope = polytopes[phase]
            gain = problem.mass * polytope.H @ np.vstack([np.eye(3), skew(position - problem.reference)])
            rows = np.einsum("i,rj->rij", second[index], gain).reshape(len(gain), -1)
            slopes, bounds = row_slopes(polytope, problem, position), polytope.h + gain @ GRAVITY_VECTOR
            parts.append((rows, slopes, bounds, *(np.full(len(gain), number) for number in (index, phase))))
    return [np.concatenate(part) for part in zip(*parts, strict=True)]


def phases_touching(schedule: ContactSchedule, time: float) -> tuple[int, ...]:
    """Phases whose closed interval holds ``time`` [s]: two at a key instant inside the motion."""
    later = int(schedule.phase_at(time))
    return (later - 1, later) if later > 0 and time == schedule.instants[later] else (later,)
