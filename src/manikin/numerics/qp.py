"""Quadratic programs: one dense program, a sequence of similar dense ones, one sparse program.

Each is ``minimise x' H x / 2 + g' x`` under ``rows_lower <= A x <= rows_upper`` and ``lower <= x <= upper``,
where the first ``equalities`` rows have equal bounds. Bounds of 1e30 and more count as infinite.

DAQP, a dual active-set method, solves the dense ones, exact to rounding; from the working set of a similar
program it needs one or two iterations. PIQP, an interior-point method, solves the sparse ones.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import daqp
import numpy as np
import piqp
from scipy import sparse

from manikin.numerics.spatial import FloatArray

SparseMatrix = sparse.sparray | sparse.spmatrix

_INFINITY = 1e30
_EQUALITY, _SOFT = 5, 8
"""DAQP's marks of a row that is an equality, and of one that may be violated at a price."""


@dataclass(frozen=True, eq=False)
class QPSolution:
    """Answer of a solver.

    Attributes:
        x: (n,) the minimiser; without meaning unless ``solved``.
        solved: Whether it is the minimiser.
        status: The solver's own word.
        iterations: Its iterations.
        multipliers: Of dense programs, those of bounds, if any, and rows; positive at an upper bound.
    """

    x: FloatArray
    solved: bool
    status: str
    iterations: int
    multipliers: FloatArray = field(default_factory=lambda: np.zeros(0))


def solve_qp(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, rows_lower: FloatArray | None,
    rows_upper: FloatArray | None, bounds: tuple[FloatArray, FloatArray] | None = None, *,
    equalities: int = 0, softness: float | None = None, tolerance: float = 1e-6,
) -> QPSolution:  # fmt: skip
    """Solve one dense program.

    Args:
        hessian: (n, n) positive definite.
        gradient: (n,).
        rows: (m, n).
        rows_lower: (m,); None for no lower bounds.
        rows_upper: (m,); None for no upper bounds.
        bounds: (n,) lower and (n,) upper bounds of the unknowns.
        equalities: Number of leading rows that are equalities.
        softness: Rows may be violated by ``e`` at the cost ``e^2 / (2 softness)``; None where they may not.
        tolerance: Accepted violation of a unit row.
    """
    count = len(rows)
    lower = np.full(count, -_INFINITY) if rows_lower is None else rows_lower
    upper = np.full(count, _INFINITY) if rows_upper is None else rows_upper
    if bounds is not None:
        lower, upper = np.concatenate((bounds[0], lower)), np.concatenate((bounds[1], upper))
    options = {} if softness is None else {"rho_soft": softness}
    x, _, flag, info = daqp.solve(
        np.require(hessian, np.float64, ["C", "W"]), gradient, np.require(rows, np.float64, ["C", "W"]),
        upper, lower, _sense(len(upper), count, equalities, soft=softness is not None),
        primal_tol=tolerance, **options,
    )  # fmt: skip
    return QPSolution(np.array(x), flag > 0, f"daqp {flag}", int(info["iterations"]), np.array(info["lam"]))


def solve_sparse_qp(
    hessian: SparseMatrix, gradient: FloatArray, rows: SparseMatrix, rows_lower: FloatArray | None,
    rows_upper: FloatArray, bounds: tuple[FloatArray, FloatArray], *, equalities: int = 0,
    tolerance: float | None = None,
) -> QPSolution:  # fmt: skip
    """Solve one sparse program, with a positive semidefinite Hessian and otherwise as :func:`solve_qp`.

    The tolerance is absolute and relative, of residuals; None for PIQP's own.
    """
    solver = piqp.SparseSolver()
    if tolerance is not None:
        solver.settings.eps_abs = solver.settings.eps_rel = tolerance
    equal, rest, matrix = slice(equalities), slice(equalities, None), sparse.csc_matrix(rows)
    solver.setup(
        sparse.csc_matrix(hessian), gradient,
        matrix[equal] if equalities else None, rows_upper[equal] if equalities else None,
        matrix[rest], None if rows_lower is None else rows_lower[rest], rows_upper[rest], *bounds,
    )  # fmt: skip
    status, result = solver.solve(), solver.result
    return QPSolution(np.array(result.x), status == piqp.PIQP_SOLVED, str(status), int(result.info.iter))


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """A dense program as of :func:`solve_qp`; bounds are infinite where there are none."""

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
        """The same program with the unknowns ``start`` to ``end`` (exclusive) unbounded."""
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[start:end], upper[start:end] = -np.inf, np.inf
        return replace(self, lower=lower, upper=upper)


class WarmQPSolver:
    """Solves a sequence of similar dense programs, each from the working set of the one before.

    A solution is checked whatever DAQP says of it: no row or bound may be violated by more than 1e-3.
    """

    def __init__(self) -> None:
        self._model: Any = None
        self._shape = (-1, -1)

    def solve(self, program: QuadraticProgram) -> QPSolution:
        """Solve the next program."""
        upper = np.minimum(np.concatenate((program.upper, program.rows_upper)), _INFINITY)
        lower = np.maximum(np.concatenate((program.lower, program.rows_lower)), -_INFINITY)
        H, f, A = program.hessian, program.gradient, program.rows
        if self._model is None or self._shape != A.shape:
            self._model, self._shape = daqp.Model(), A.shape
            flag, _ = self._model.setup(H, f, A, upper, lower, _sense(len(upper), len(A), program.equalities))
        else:
            flag = self._model.update(H=H, f=f, A=A, bupper=upper, blower=lower)
        if flag < 0:
            self._model = None
            return QPSolution(np.zeros(len(f)), False, f"daqp set-up {flag}", 0)
        x, _, flag, info = self._model.solve()
        if flag <= 0:  # its working set is not worth starting from
            self._model = None
        solved = flag > 0 and bool(np.all(np.isfinite(x))) and program.violation(x) <= 1e-3
        return QPSolution(np.array(x), solved, f"daqp {flag}", int(info["iterations"]), np.array(info["lam"]))


def _sense(size: int, rows: int, equalities: int, *, soft: bool = False) -> np.ndarray:
    """(size,) DAQP's marks of bounds and rows, the rows last."""
    sense = np.zeros(size, dtype=np.int32)
    if soft:
        sense[size - rows :] = _SOFT
    sense[size - rows : size - rows + equalities] = _EQUALITY
    return sense
