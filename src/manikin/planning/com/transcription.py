"""The nonlinear programme of the timing-free method, written in Bezier pieces.

A spline of degree k whose simple internal knots are the key instants is one polynomial of degree k per phase
with k - 1 continuous derivatives across the key instants. In the pieces' Bezier points and the durations
every expression is a low-order polynomial of few unknowns, with cheap derivatives. :func:`spline_from_bezier`
turns the solution into the control points and knots of [Qiu2012]_ 5.20, the published unknowns.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import Any

import casadi as ca
import numpy as np

from manikin.numerics.element_program import Element, Indices, PlacedElement, compile_programme
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
        geometric: Geometric constraints, each as :func:`written`.
        key_planes: Key instant and lead [s] of each plane.
        loaded: Phases with a load.
        reach: Number of faces of its region imposed in each phase.
    """

    degree: int
    samples: int
    rows: tuple[int, ...]
    contacts: tuple[int, ...]
    margin_space: MarginSpace
    geometric: tuple[str, ...]
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


@dataclass(frozen=True, eq=False)
class _Terms:
    """An element of the programme and the groups of its rows."""

    element: Element
    groups: tuple[tuple[str, int], ...]


class _Writer:
    """Collects parameters and rows while an element is written."""

    def __init__(self) -> None:
        self.parameters: list[ca.SX] = []
        self.rows: list[tuple[str, ca.SX]] = []

    def parameter(self, rows: int, columns: int = 1) -> ca.SX:
        self.parameters.append(ca.SX.sym(f"p{len(self.parameters)}", rows, columns))
        return self.parameters[-1]

    def add(self, group: str, expression: ca.SX) -> None:
        self.rows.append((group, ca.vec(expression)))

    def terms(self, unknowns: Sequence[ca.SX], objective: ca.SX | None = None) -> _Terms:
        parameters = ca.vertcat(ca.SX(0, 1), *map(ca.vec, self.parameters))
        rows = ca.vertcat(*(row for _, row in self.rows))
        element = Element(
            ca.vertcat(*map(ca.vec, unknowns)), parameters, ca.SX(0) if objective is None else objective, rows
        )
        return _Terms(element, tuple((group, row.numel()) for group, row in self.rows))


@dataclass(frozen=True)
class _PhaseKind:
    """What the expressions of a phase depend on; as :class:`ComStructure`, of one phase.

    Attributes:
        ends: Whether the motion starts in this phase, and whether it ends there.
    """

    degree: int
    samples: int
    ends: tuple[bool, bool]
    rows: int
    contacts: int
    faces: int
    loaded: bool
    margin_space: MarginSpace
    geometric: tuple[str, ...]


class _Assembly:
    """Numbers of the unknowns and parameters of a programme, and its elements."""

    def __init__(self, structure: ComStructure) -> None:
        each, phases = 3 * (structure.degree + 1), structure.phases
        self.bezier = np.arange(each * phases).reshape(phases, each)
        self.durations = each * phases + np.arange(phases)
        self.total, self.margin, self.shortfall = self.durations[-1] + 1 + np.arange(3)
        self.parameters: dict[str, tuple[int, int]] = {}
        self.numbers: dict[str, Indices] = {}
        self.elements: list[PlacedElement] = []
        self.groups: list[tuple[str, int]] = []

    @property
    def size(self) -> int:
        """Number of parameters so far."""
        return sum(rows * columns for rows, columns in self.parameters.values())

    def parameter(self, name: str, rows: int, columns: int = 1) -> None:
        self.numbers[name] = self.size + np.arange(rows * columns)
        self.parameters[name] = rows, columns

    def place(self, terms: _Terms, unknowns: Sequence[Any], names: Sequence[str] = ()) -> None:
        numbers = [np.zeros(0, dtype=np.int64), *(self.numbers[name] for name in names)]
        self.elements.append(PlacedElement(terms.element, np.hstack(unknowns), np.hstack(numbers)))
        self.groups += terms.groups


@lru_cache(maxsize=8)
def transcribe(structure: ComStructure) -> ComProgram:
    """Write and compile the programme of [Qiu2012]_ 5.4.1-5.4.2."""
    assembly, last = _Assembly(structure), structure.phases - 1
    for name, size in (("mass", 1), ("reference", 3), ("weights", 4)):
        assembly.parameter(name, size)
    for name in _DIAGONALS:
        assembly.parameter(name, 3)
    for phase in range(structure.phases):
        _place_phase(assembly, structure, phase)
        if phase < last:
            both = [*assembly.bezier[phase : phase + 2], assembly.durations[phase : phase + 2]]
            assembly.place(_continuity(structure.degree), both)
    for end, phase in (("start", 0), ("goal", last)):
        names = [f"{end}_velocity", f"{end}_acceleration"]
        for name in names:
            assembly.parameter(name, 3)
        unknowns = [assembly.bezier[phase], assembly.durations[phase]]
        assembly.place(_end_conditions(structure.degree, end == "start"), unknowns, names)
    for index, (key, lead) in enumerate(structure.key_planes):
        names = [f"normal{index}", f"offset{index}"]
        assembly.parameter(names[0], 3)
        assembly.parameter(names[1], 1)
        unknowns = [assembly.bezier[key - 1], assembly.durations[key - 1]]
        assembly.place(_key_plane(structure.degree, lead), unknowns, names)
    shared = [assembly.durations, assembly.total, assembly.margin, assembly.shortfall]
    assembly.place(_whole_motion(structure.phases, structure.margin_space), shared, ["weights"])
    solver = compile_programme(
        "timing_free", assembly.elements, int(assembly.shortfall) + 1, assembly.size, _options()
    )
    return ComProgram(structure, solver, tuple(assembly.groups), tuple(assembly.parameters.items()))


def _options() -> dict[str, Any]:
    ipopt = {
        "print_level": 0, "sb": "yes", "mu_strategy": "adaptive", "adaptive_mu_globalization": "kkt-error",
        "alpha_for_y": "min-dual-infeas", "max_iter": 250, "tol": 1e-5, "constr_viol_tol": 1e-8,
        "bound_relax_factor": 0.0, "linear_solver": "mumps",
        # With more than that no step leads anywhere: the rows are restored first.
        "max_hessian_perturbation": 1e7,
    }  # fmt: skip
    options = {"print_time": False, "error_on_fail": False, "calc_lam_p": False, "no_nlp_grad": True}
    return options | {"ipopt": ipopt}


def _place_phase(assembly: _Assembly, structure: ComStructure, phase: int) -> None:
    contacts = structure.contacts[phase] if structure.limited_distance else 0
    faces = structure.reach[phase] if structure.reach else 0
    loaded, facets = phase in structure.loaded, structure.rows[phase]
    names = [*_SHARED]
    for name, *shape in (
        ("H", facets, 6), ("h", facets, 1), ("load", 4 * loaded, 1), ("contacts", contacts, 3),
        ("faces", faces, 3), ("ends", faces, 1),
    ):  # fmt: skip
        if shape[0]:
            assembly.parameter(f"{name}{phase}", *shape)
            names.append(f"{name}{phase}")
    kind = _PhaseKind(
        structure.degree, structure.samples, (phase == 0, phase == structure.phases - 1), facets, contacts,
        faces, loaded, structure.margin_space, structure.geometric,
    )  # fmt: skip
    unknowns = [assembly.bezier[phase], assembly.durations[phase], assembly.total, assembly.margin]
    assembly.place(_phase(kind), unknowns, names)


_DIAGONALS = ("velocity", "acceleration", "jerk")
_SHARED = ("mass", "reference", "weights", *_DIAGONALS)
"""Parameters of every phase."""


@lru_cache(maxsize=64)
def _phase(kind: _PhaseKind) -> _Terms:
    """Rows of one phase at its samples, and its share of the smoothness."""
    writer, k = _Writer(), kind.degree
    mass, reference, weights, *diagonals = (writer.parameter(size) for size in (1, 3, 4, 3, 3, 3))
    points, (duration, total, margin) = ca.SX.sym("b", k + 1, 3), (ca.SX.sym(name) for name in "hTd")
    s = np.linspace(0.0, 1.0, kind.samples + 1)
    position = ca.DM(bernstein_matrix(k, s)) @ points
    second = ca.DM(k * (k - 1) * bernstein_matrix(k - 2, s)) @ _differences(points, 2)
    _add_balance(writer, kind, margin, mass, position, second / duration**2)
    if kind.contacts:
        centres = writer.parameter(kind.contacts, 3)
        for index in range(kind.contacts):
            offset = position - ca.repmat(centres[index, :], len(s), 1)
            writer.add("distance", ca.sum2(offset * offset))
    starts, ends = kind.ends
    within = position[int(starts) : len(s) - int(ends), :]
    if kind.faces:
        normals, offsets = writer.parameter(kind.faces, 3), writer.parameter(kind.faces)
        writer.add("reach", within @ normals.T - ca.repmat(offsets.T, within.shape[0], 1))
    for index, function in enumerate(kind.geometric):
        places = within + ca.repmat(reference.T, within.shape[0], 1)
        writer.add(f"geometric{index}", _symbolic(function, places))
    smoothness = ca.SX(0)
    for order, diagonal in enumerate(diagonals, start=1):
        smoothness += _squared_integral(points, duration, order, diagonal.T)
    return writer.terms([points, duration, total, margin], weights[1] * smoothness / total)


def written(function: Callable[[Any, Any, Any], Any]) -> str:
    """CasADi's text of a function of x, y and z, the same for all functions with the same expression.

    Programmes are kept by it: a function of an equal problem is another object, by which none is found again.
    """
    symbols = [ca.SX.sym(name) for name in "xyz"]
    with warnings.catch_warnings():
        # CasADi announces that numpy's functions on its symbols may change; what it returns is right.
        warnings.simplefilter("ignore", FutureWarning)
        value = function(*symbols)
    return ca.Function("geometric", symbols, [ca.SX(value)]).serialize()


def _symbolic(text: str, position: ca.SX) -> ca.SX:
    """Values of a :func:`written` function at (n, 3) symbolic positions, one per position."""
    function = ca.Function.deserialize(text)
    places = [position[row, :] for row in range(position.shape[0])]
    return ca.vertcat(*(function(place[0], place[1], place[2]) for place in places))


def _add_balance(
    writer: _Writer, kind: _PhaseKind, margin: ca.SX, mass: ca.SX, position: ca.SX, acceleration: ca.SX
) -> None:
    """Rows ``h - H w_p >= d_min`` ([Qiu2012]_ 5.4.2), each over its length with moments about the CoM.

    In force space it is over its slope in f; about the world origin its length is 1.
    """
    count = position.shape[0]
    H, h = writer.parameter(kind.rows, 6), writer.parameter(kind.rows)
    force = mass * (acceleration - ca.repmat(ca.DM([[0.0, 0.0, -GRAVITY]]), count, 1))
    wrench = ca.horzcat(force, _cross(position, force))
    if kind.loaded:  # a further mass that moves with the CoM, at an offset from it
        load = writer.parameter(4)
        push = load[0] / mass * force
        wrench += ca.horzcat(push, _cross(position + ca.repmat(load[1:].T, count, 1), push))
    slack = ca.repmat(h.T, count, 1) - wrench @ H.T
    wanted = margin * ca.SX.ones(count, kind.rows)
    if kind.margin_space != "wrench_about_origin":
        wanted = margin * _lengths(H, position, with_moment=kind.margin_space == "wrench")
    writer.add("balance", slack / MARGIN_SCALE[kind.margin_space] - wanted)


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


@lru_cache(maxsize=8)
def _continuity(degree: int) -> _Terms:
    """Equal derivatives 0 ... k - 1 at the key instant between two phases, in units of position."""
    writer, durations = _Writer(), ca.SX.sym("h", 2)
    before, after = (ca.SX.sym(name, degree + 1, 3) for name in ("before", "after"))
    ratio = durations[0] / durations[1]
    for order in range(degree):
        left, right = _differences(before, order)[-1, :], _differences(after, order)[0, :]
        writer.add("continuity", left - ratio**order * right)
    return writer.terms([before, after, durations])


@lru_cache(maxsize=16)
def _end_conditions(degree: int, at_start: bool) -> _Terms:
    """Velocity and acceleration at an end ([Qiu2012]_ 5.24-5.25), in units of position."""
    writer, row = _Writer(), 0 if at_start else -1
    points, duration = ca.SX.sym("b", degree + 1, 3), ca.SX.sym("h")
    velocity, acceleration = writer.parameter(1, 3), writer.parameter(1, 3)
    writer.add("end", _differences(points, 1)[row, :] - velocity * duration / degree)
    curved = acceleration * duration**2 / (degree * (degree - 1))
    writer.add("end", _differences(points, 2)[row, :] - curved)
    return writer.terms([points, duration])


@lru_cache(maxsize=16)
def _key_plane(degree: int, lead: float) -> _Terms:
    """How far the CoM is beyond a plane at the end of a phase, or where it would be a lead [s] later."""
    writer, points, duration = _Writer(), ca.SX.sym("b", degree + 1, 3), ca.SX.sym("h")
    normal, offset = writer.parameter(3), writer.parameter(1)
    place = points[-1, :]
    if lead > 0.0:
        place = place + lead * degree / duration * _differences(points, 1)[-1, :]
    writer.add("key_plane", place @ normal - offset)
    return writer.terms([points, duration])


@lru_cache(maxsize=32)
def _whole_motion(phases: int, margin_space: MarginSpace) -> _Terms:
    """Total duration, required margin, and what they weigh ([Qiu2012]_ 5.27-5.28).

    An exact penalty asks for the required margin, so that the largest is found when it cannot be reached. The
    total duration is an unknown of its own, which keeps the second derivatives sparse.
    """
    writer, durations = _Writer(), ca.SX.sym("h", phases)
    total, margin, shortfall = (ca.SX.sym(name) for name in "Tde")
    weights = writer.parameter(4)
    writer.add("total_duration", ca.sum1(durations) - total)
    writer.add("required_margin", margin + shortfall)
    wished = weights[0] * margin - weights[3] * shortfall
    objective = -MARGIN_SCALE[margin_space] * wished + weights[2] * total
    return writer.terms([durations, total, margin, shortfall], objective)


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
