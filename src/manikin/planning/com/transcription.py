"""The nonlinear programme of the timing-free method, written in Bezier pieces.

A spline of degree k whose simple internal knots are the key instants is one polynomial of degree k per phase
with k - 1 continuous derivatives across the key instants. In the pieces' Bezier points and the durations
every expression is a low-order polynomial of few unknowns, with cheap derivatives. :func:`spline_from_bezier`
turns the solution into the control points and knots of [Qiu2012]_ 5.20, the published unknowns.
"""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import Any

import casadi as ca
import numpy as np

from manikin.numerics.spatial import GRAVITY, FloatArray
from manikin.numerics.spline import (
    BSpline,
    bernstein_matrix,
    clamped_knots,
    end_control_points,
    start_control_points,
)
from manikin.planning.com.com_problem import MarginSpace

MARGIN_SCALE = {"wrench": 10.0, "force": 100.0, "wrench_about_origin": 10.0}
"""Unit of the unknown d_min and of the balance rows in the programme [N.m] or [N]."""


@dataclass(frozen=True)
class ComStructure:
    """What the programme's expressions depend on; numbers are its parameters.

    Attributes:
        samples: n_s, samples of each phase but one.
        rows: Number of facets imposed in each phase.
        contacts: Number of contacts of each phase.
        key_planes: Key instant and lead [s] of each plane.
        loaded: Phases with a load.
        reach: Number of faces of its region imposed in each phase.
    """

    degree: int
    samples: int
    rows: tuple[int, ...]
    contacts: tuple[int, ...]
    margin_space: MarginSpace
    geometric: tuple[Callable[[Any, Any, Any], Any], ...]
    limited_distance: bool
    key_planes: tuple[tuple[int, float], ...] = ()
    loaded: tuple[int, ...] = ()
    reach: tuple[int, ...] = ()

    @property
    def phases(self) -> int:
        """Number of phases."""
        return len(self.rows)


@dataclass(frozen=True, eq=False)
class ComProgram:
    """The compiled programme and the order of its rows.

    Attributes:
        solver: CasADi's ``nlpsol``; unknowns are the Bezier points of each phase (column by column), the
            durations and their sum [s], d_min and its shortfall below the required margin, both over
            MARGIN_SCALE.
        groups: Names of the row groups with their number of rows, in order. ``end`` rows are
            start velocity, start acceleration, goal velocity, goal acceleration.
        parameters: Names and shapes of the parameters, in order.
    """

    structure: ComStructure
    solver: ca.Function
    groups: tuple[tuple[str, int], ...]
    parameters: tuple[tuple[str, tuple[int, int]], ...]

    def pack_parameters(self, values: dict[str, Any]) -> FloatArray:
        """Parameter vector from arrays by name."""
        return np.concatenate([
            np.asarray(values[name], dtype=np.float64).reshape(shape).ravel(order="F")
            for name, shape in self.parameters
        ])  # fmt: skip

    def pack_unknowns(
        self, bezier: FloatArray, durations: FloatArray, total: float, margin: float, shortfall: float
    ) -> FloatArray:
        """Vector of unknowns from (phases, k + 1, 3) points, (phases,) durations, sum, d_min, shortfall."""
        margins = np.array([margin, shortfall]) / MARGIN_SCALE[self.structure.margin_space]
        return np.concatenate([bezier.transpose(0, 2, 1).ravel(), durations, [total], margins])

    def unpack_unknowns(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Bezier points (phases, k + 1, 3), durations (phases,) and d_min."""
        phases, margin = self.structure.phases, float(unknowns[-2])
        bezier = unknowns[: -phases - 3].reshape(phases, 3, -1).transpose(0, 2, 1)
        return bezier, unknowns[-phases - 3 : -3], margin * MARGIN_SCALE[self.structure.margin_space]


class _Builder:
    """Collects unknowns, parameters and rows while the programme is written."""

    def __init__(self, structure: ComStructure) -> None:
        self.structure = structure
        self.parameters: dict[str, ca.SX] = {}
        self.rows: list[ca.SX] = []
        self.groups: list[tuple[str, int]] = []
        self.bezier = [ca.SX.sym(f"b{i}", structure.degree + 1, 3) for i in range(structure.phases)]
        self.durations = ca.SX.sym("h", structure.phases)
        self.total, self.margin, self.shortfall = (ca.SX.sym(name) for name in "Tde")

    def parameter(self, name: str, rows: int, columns: int = 1) -> ca.SX:
        self.parameters[name] = ca.SX.sym(name, rows, columns)
        return self.parameters[name]

    def add(self, group: str, expression: ca.SX) -> None:
        column = ca.vec(expression)
        self.rows.append(column)
        self.groups.append((group, column.numel()))


@lru_cache(maxsize=8)
def transcribe(structure: ComStructure) -> ComProgram:
    """Write and compile the programme of [Qiu2012]_ 5.4.1-5.4.2.

    Cached by structure; only the last few, because each keeps 20 to 40 MB.
    """
    builder = _Builder(structure)
    mass = builder.parameter("mass", 1)
    builder.parameter("reference", 1, 3)
    for phase in range(structure.phases):
        _add_samples(builder, phase, mass)
        if phase + 1 < structure.phases:
            _add_continuity(builder, phase)
    _add_end_conditions(builder)
    _add_key_planes(builder)
    builder.add("total_duration", ca.sum1(builder.durations) - builder.total)
    builder.add("required_margin", builder.margin + builder.shortfall)
    objective = _objective(builder)
    bezier = map(ca.vec, builder.bezier)
    unknowns = ca.vertcat(*bezier, builder.durations, builder.total, builder.margin, builder.shortfall)
    parameters = ca.vertcat(*map(ca.vec, builder.parameters.values()))
    problem = {"x": unknowns, "p": parameters, "f": objective, "g": ca.vertcat(*builder.rows)}
    shapes = tuple((name, p.shape) for name, p in builder.parameters.items())
    return ComProgram(structure, _compile(problem), tuple(builder.groups), shapes)


def _compile(problem: dict[str, ca.SX]) -> ca.Function:
    ipopt = {
        "print_level": 0, "sb": "yes", "mu_strategy": "adaptive", "adaptive_mu_globalization": "kkt-error",
        "alpha_for_y": "min-dual-infeas", "max_iter": 250, "tol": 1e-5, "constr_viol_tol": 1e-8,
        "bound_relax_factor": 0.0, "linear_solver": "mumps",
    }  # fmt: skip
    options = {"print_time": False, "error_on_fail": False, "calc_lam_p": False, "no_nlp_grad": True}
    return ca.nlpsol("timing_free", "ipopt", problem, options | {"ipopt": ipopt})


def _add_samples(builder: _Builder, phase: int, mass: ca.SX) -> None:
    structure, k = builder.structure, builder.structure.degree
    s = np.linspace(0.0, 1.0, structure.samples + 1)
    points, duration = builder.bezier[phase], builder.durations[phase]
    position = ca.DM(bernstein_matrix(k, s)) @ points
    second = ca.DM(k * (k - 1) * bernstein_matrix(k - 2, s)) @ _differences(points, 2)
    _add_balance(builder, phase, mass, position, second / duration**2)
    if structure.limited_distance:
        centres = builder.parameter(f"contacts{phase}", structure.contacts[phase], 3)
        for index in range(structure.contacts[phase]):
            offset = position - ca.repmat(centres[index, :], len(s), 1)
            builder.add("distance", ca.sum2(offset * offset))
    inner = slice(1 if phase == 0 else 0, len(s) - 1 if phase == structure.phases - 1 else len(s))
    faces = structure.reach[phase] if structure.reach else 0
    within = position[inner, :]
    if faces:
        normals = builder.parameter(f"faces{phase}", faces, 3)
        offsets = builder.parameter(f"ends{phase}", faces)
        builder.add("reach", within @ normals.T - ca.repmat(offsets.T, len(s[inner]), 1))
    for index, function in enumerate(structure.geometric):
        places = within + ca.repmat(builder.parameters["reference"], within.shape[0], 1)
        builder.add(f"geometric{index}", _symbolic(function, places))


def _symbolic(function: Callable[[Any, Any, Any], Any], position: ca.SX) -> ca.SX:
    """Values of a geometric constraint at (n, 3) symbolic positions, one per position."""
    with warnings.catch_warnings():
        # CasADi announces that numpy's functions on its symbols may change; what it returns is right.
        warnings.simplefilter("ignore", FutureWarning)
        values = function(position[:, 0], position[:, 1], position[:, 2])
    return values + ca.SX.zeros(position.shape[0])


def _add_balance(builder: _Builder, phase: int, mass: ca.SX, position: ca.SX, acceleration: ca.SX) -> None:
    """Rows ``h - H w_p >= d_min`` ([Qiu2012]_ 5.4.2), each over its length with moments about the CoM.

    In force space it is over its slope in f; about the world origin its length is 1.
    """
    structure = builder.structure
    facets, count = builder.structure.rows[phase], position.shape[0]
    H, h = builder.parameter(f"H{phase}", facets, 6), builder.parameter(f"h{phase}", facets)
    force = mass * (acceleration - ca.repmat(ca.DM([[0.0, 0.0, -GRAVITY]]), count, 1))
    wrench = ca.horzcat(force, _cross(position, force))
    if phase in structure.loaded:  # a further mass that moves with the CoM, at an offset from it
        load = builder.parameter(f"load{phase}", 4)
        push = load[0] / mass * force
        wrench += ca.horzcat(push, _cross(position + ca.repmat(load[1:].T, count, 1), push))
    slack = ca.repmat(h.T, count, 1) - wrench @ H.T
    scale = MARGIN_SCALE[structure.margin_space]
    wanted = builder.margin * ca.SX.ones(count, facets)
    if structure.margin_space != "wrench_about_origin":
        wanted = builder.margin * _lengths(H, position, with_moment=structure.margin_space == "wrench")
    builder.add("balance", slack / scale - wanted)


def _lengths(H: ca.SX, position: ca.SX, *, with_moment: bool) -> ca.SX:
    """(samples, facets) length of the rows with moments about the CoM, or of their force part alone.

    The latter, ``|H1 + H2 p^|``, is the change of a row per newton at the CoM in its direction.
    """
    columns = []
    for row in range(H.shape[0]):
        moment = ca.repmat(H[row, 3:], position.shape[0], 1)
        slope = ca.repmat(H[row, :3], position.shape[0], 1) + _cross(moment, position)
        further = ca.sum2(moment * moment) if with_moment else 1e-12
        columns.append(ca.sqrt(ca.sum2(slope * slope) + further))
    return ca.horzcat(*columns)


def _add_continuity(builder: _Builder, phase: int) -> None:
    """Equal derivatives 0 ... k - 1 at the key instant after ``phase``, in units of position."""
    before, after = builder.bezier[phase], builder.bezier[phase + 1]
    ratio = builder.durations[phase] / builder.durations[phase + 1]
    for order in range(builder.structure.degree):
        left, right = _differences(before, order)[-1, :], _differences(after, order)[0, :]
        builder.add("continuity", left - ratio**order * right)


def _add_end_conditions(builder: _Builder) -> None:
    """Velocities and accelerations at both ends ([Qiu2012]_ 5.24-5.25), in units of position."""
    k, last = builder.structure.degree, builder.structure.phases - 1
    for name, phase, row in (("start", 0, 0), ("goal", last, -1)):
        points, duration = builder.bezier[phase], builder.durations[phase]
        velocity = builder.parameter(f"{name}_velocity", 1, 3)
        acceleration = builder.parameter(f"{name}_acceleration", 1, 3)
        builder.add("end", _differences(points, 1)[row, :] - velocity * duration / k)
        builder.add("end", _differences(points, 2)[row, :] - acceleration * duration**2 / (k * (k - 1)))


def _add_key_planes(builder: _Builder) -> None:
    """How far the CoM is beyond each plane at its key instant, the end of the phase before."""
    degree = builder.structure.degree
    for index, (key, lead) in enumerate(builder.structure.key_planes):
        normal, offset = builder.parameter(f"normal{index}", 3), builder.parameter(f"offset{index}", 1)
        points, place = builder.bezier[key - 1], builder.bezier[key - 1][-1, :]
        if lead > 0.0:
            place = place + lead * degree / builder.durations[key - 1] * _differences(points, 1)[-1, :]
        builder.add("key_plane", place @ normal - offset)


def _objective(builder: _Builder) -> ca.SX:
    """Weighted objectives ([Qiu2012]_ 5.27-5.28), the sums exactly integrated.

    An exact penalty asks for the required margin, so that the largest is found when it cannot be reached. The
    total duration is an unknown of its own, which keeps the second derivatives sparse.
    """
    weights = builder.parameter("weights", 4)
    diagonals = [builder.parameter(name, 1, 3) for name in ("velocity", "acceleration", "jerk")]
    total, smoothness = builder.total, ca.SX(0)
    scale = MARGIN_SCALE[builder.structure.margin_space]
    for points, duration in zip(builder.bezier, ca.vertsplit(builder.durations), strict=True):
        for order, diagonal in enumerate(diagonals, start=1):
            smoothness += _squared_integral(points, duration, order, diagonal)
    margin = weights[0] * builder.margin - weights[3] * builder.shortfall
    return -scale * margin + weights[1] * smoothness / total + weights[2] * total


def _squared_integral(points: ca.SX, duration: ca.SX, order: int, diagonal: ca.SX) -> ca.SX:
    """Integral over one phase of ``sum_c q_c (p_c^(order))^2`` from products of Bernstein polynomials."""
    degree = points.shape[0] - 1 - order
    if degree < 0:
        return ca.SX(0)
    factor = np.prod(np.arange(degree + 1, degree + order + 1))
    derivative = factor * _differences(points, order)
    gram = ca.DM(bernstein_gram(degree))
    return ca.sum2(diagonal * ca.sum1((gram @ derivative) * derivative)) / duration ** (2 * order - 1)


def bernstein_gram(degree: int) -> FloatArray:
    """(k + 1, k + 1) integrals over [0, 1] of the products of Bernstein polynomials."""
    index = range(degree + 1)
    return np.array([
        [comb(degree, i) * comb(degree, j) / comb(2 * degree, i + j) / (2 * degree + 1) for j in index]
        for i in index
    ])  # fmt: skip


def spline_from_bezier(
    bezier: FloatArray, durations: FloatArray, *, start: tuple[FloatArray | None, ...],
    goal: tuple[FloatArray | None, ...],
) -> BSpline:  # fmt: skip
    """B-spline on normalised time with the key instants as internal knots ([Qiu2012]_ 5.4.3).

    Bezier points are (phases, k + 1, 3) [m], durations (phases,) [s]. Position, velocity and acceleration at
    start and goal are met exactly up to the first that is None.
    """
    k = bezier.shape[1] - 1
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    total = float(instants[-1])
    knots = clamped_knots(k, instants / total)
    knots[len(knots) - k - 1 :] = 1.0
    s = (1.0 - np.cos(np.linspace(0.0, np.pi, 2 * k))) / 2.0
    times = (instants[:-1, None] + durations[:, None] * s).ravel() / total
    values = (bernstein_matrix(k, s) @ bezier).reshape(-1, 3)
    first = start_control_points(k, knots, *_per_normalised_time(start, total))
    last = end_control_points(k, knots, *_per_normalised_time(goal, total))
    return BSpline.fit(k, knots, np.minimum(times, 1.0), values, first=first, last=last)


def _per_normalised_time(derivatives: tuple[FloatArray | None, ...], total: float) -> Iterator[FloatArray]:
    for order, value in enumerate(derivatives):
        if value is None:
            return
        yield value * total**order


def _differences(points: ca.SX, order: int) -> ca.SX:
    for _ in range(order):
        points = points[1:, :] - points[:-1, :]
    return points


def _cross(a: ca.SX, b: ca.SX) -> ca.SX:
    """Row-wise cross product of (n, 3) matrices."""
    return ca.horzcat(
        a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
        a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
        a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
    )
