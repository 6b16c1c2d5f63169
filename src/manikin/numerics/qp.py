"""Solvers of the control step's quadratic program, behind one interface.

DAQP (dual active set) is the default: from the previous active set it needs one or two
iterations on most steps. Recipe for another solver: subclass :class:`QPSolver`, import the
package inside ``__init__``, and add the class to ``_SOLVERS``.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """Minimise ``x' hessian x / 2 + gradient' x`` under two-sided rows and bounds.

    Attributes:
        hessian: (n, n) symmetric, positive definite.
        gradient: (n,).
        rows: (m, n).
        rows_lower: (m,).
        rows_upper: (m,); equal to ``rows_lower`` in the first ``equalities`` rows.
        lower: (n,).
        upper: (n,).
        equalities: Number of leading rows that are equalities.
    """

    hessian: FloatArray
    gradient: FloatArray
    rows: FloatArray
    rows_lower: FloatArray
    rows_upper: FloatArray
    lower: FloatArray
    upper: FloatArray
    equalities: int

    def violation(self, x: FloatArray) -> float:
        """Largest violation of a row or bound at ``x`` (n,)."""
        image = self.rows @ x
        gaps = (self.rows_lower - image, image - self.rows_upper, self.lower - x, x - self.upper)
        return float(max(0.0, *(gap.max() for gap in gaps if gap.size)))

    def without_bounds(self, start: int, end: int) -> "QuadraticProgram":
        """Return the same program with the variables ``start`` to ``end`` (exclusive) unbounded."""
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[start:end], upper[start:end] = -np.inf, np.inf
        return replace(self, lower=lower, upper=upper)


_INFINITY = 1e30


@dataclass(frozen=True, eq=False)
class QPSolution:
    """What a solver found.

    Attributes:
        x: (n,) the minimiser, or the last iterate when it was not found.
        found: Whether the solver claims success and the point keeps the constraints.
        status: The solver's own word.
        iterations: Its iterations.
    """

    x: FloatArray
    found: bool
    status: str
    iterations: int


class QPSolver(ABC):
    """Solves a series of similar programs, starting from the previous solution."""

    tolerance = 1e-3
    """Largest violation of a constraint (N, N.m, rad/s^2) in an accepted solution."""

    def solve(self, program: QuadraticProgram) -> QPSolution:
        """Solve one program; the answer is checked whatever the solver says."""
        x, claimed, status, iterations = self._solve(program)
        found = claimed and bool(np.all(np.isfinite(x))) and program.violation(x) <= self.tolerance
        return QPSolution(x, found, status, iterations)

    @abstractmethod
    def _solve(self, program: QuadraticProgram) -> tuple[FloatArray, bool, str, int]:
        """Return the point, whether it is claimed optimal, the status and the iterations."""


def make_solver(name: str) -> QPSolver:
    """Make the solver called ``name``.

    Raises:
        InputError: If there is none.
    """
    if name not in _SOLVERS:
        raise InputError(f"QP solver is {name!r}; valid: {sorted(_SOLVERS)}")
    return _SOLVERS[name]()


class DaqpSolver(QPSolver):
    """DAQP, a dual active-set method that keeps its working set between solves."""

    def __init__(self) -> None:
        import daqp

        self._module = daqp
        self._model = None
        self._shape = (-1, -1)

    def _solve(self, program: QuadraticProgram) -> tuple[FloatArray, bool, str, int]:
        upper = np.minimum(np.concatenate((program.upper, program.rows_upper)), _INFINITY)
        lower = np.maximum(np.concatenate((program.lower, program.rows_lower)), -_INFINITY)
        if self._model is None or self._shape != program.rows.shape:
            model, flag = self._set_up(program, lower, upper)
        else:
            model = self._model
            flag = model.update(
                H=program.hessian, f=program.gradient, A=program.rows, bupper=upper, blower=lower
            )
        if flag < 0:
            self._model = None
            return np.zeros(len(program.gradient)), False, f"daqp set-up {flag}", 0
        x, _, flag, info = model.solve()
        # A failed solve leaves a working set that is not worth starting from.
        self._model = model if flag > 0 else None
        return np.array(x), flag > 0, f"daqp {flag}", int(info["iterations"])

    def _set_up(self, program: QuadraticProgram, lower: FloatArray, upper: FloatArray) -> tuple[Any, int]:
        size = len(program.gradient)
        sense = np.zeros(len(upper), dtype=np.int32)
        sense[size : size + program.equalities] = 5
        model = self._module.Model()
        self._shape = program.rows.shape
        flag, _ = model.setup(program.hessian, program.gradient, program.rows, upper, lower, sense)
        return model, flag


class ProxqpSolver(QPSolver):
    """ProxQP, an augmented Lagrangian method, dense backend."""

    def __init__(self) -> None:
        import proxsuite

        self._module = proxsuite.proxqp
        self._qp = None
        self._shape = (-1, -1)

    def _solve(self, program: QuadraticProgram) -> tuple[FloatArray, bool, str, int]:
        values = _split(program)
        if self._qp is None or self._shape != program.rows.shape:
            size, rows, split = len(program.gradient), len(program.rows), program.equalities
            self._qp = self._module.dense.QP(size, split, rows - split, True)
            self._qp.settings.eps_abs = 1e-5
            self._qp.settings.initial_guess = self._module.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
            self._shape = program.rows.shape
            self._qp.init(*values)
        else:
            self._qp.update(*values)
        self._qp.solve()
        results = self._qp.results
        solved = results.info.status == self._module.QPSolverOutput.PROXQP_SOLVED
        return np.array(results.x), solved, str(results.info.status), int(results.info.iter)


class PiqpSolver(QPSolver):
    """PIQP, a proximal interior-point method, dense backend; does not warm-start."""

    def __init__(self) -> None:
        import piqp

        self._module = piqp
        self._qp = None
        self._shape = (-1, -1)

    def _solve(self, program: QuadraticProgram) -> tuple[FloatArray, bool, str, int]:
        values = _split(program)
        if self._qp is None or self._shape != program.rows.shape:
            self._qp = self._module.DenseSolver()
            self._shape = program.rows.shape
            self._qp.setup(*values)
        else:
            self._qp.update(*values)
        status = self._qp.solve()
        solved = status == self._module.PIQP_SOLVED
        return np.array(self._qp.result.x), solved, str(status), int(self._qp.result.info.iter)


def _split(program: QuadraticProgram) -> tuple[FloatArray, ...]:
    """Cost, equalities, inequalities and bounds in the order that ProxQP and PIQP take them."""
    split = program.equalities
    return (
        program.hessian, program.gradient, program.rows[:split], program.rows_lower[:split],
        program.rows[split:], program.rows_lower[split:], program.rows_upper[split:],
        program.lower, program.upper,
    )  # fmt: skip


_SOLVERS: dict[str, type[QPSolver]] = {"daqp": DaqpSolver, "proxqp": ProxqpSolver, "piqp": PiqpSolver}
