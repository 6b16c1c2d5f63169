"""Assembly and solution of the block-banded normal equations of a spline fit, in linear time.

A clamped B-spline of degree ``p`` couples each control point with ``p`` neighbours: the normal equations of
any sum of per-sample residuals are assembled with one sparse product and solved by banded Cholesky factors.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.linalg.blas import dsyrk
from scipy.sparse import csr_matrix

from manikin.numerics.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class SampledBasis:
    """The non-zero basis functions of a clamped spline at sample times.

    Attributes:
        first: (n,) index of the first control point that matters at each sample.
        values: (3, n, degree + 1) basis values and their first two derivatives.
        size: Number of control points.
    """

    first: NDArray[np.int64]
    values: FloatArray
    size: int

    @classmethod
    def at(cls, time: FloatArray, knots: FloatArray, degree: int) -> "SampledBasis":
        """Sample the basis of ``knots`` [s] at ``time`` (n,) [s]."""
        size = len(knots) - degree - 1
        first = np.clip(np.searchsorted(knots, time, side="right") - 1, degree, size - 1) - degree
        identity = BSpline(knots, np.eye(size), degree)
        rows, columns = np.arange(len(time))[:, None], first[:, None] + np.arange(degree + 1)
        return cls(first, np.stack([identity(time, nu=order)[rows, columns] for order in range(3)]), size)

    @property
    def starts(self) -> NDArray[np.bool_]:
        """(n,) whether a sample is the first of its knot span, or the last of all."""
        starts = np.diff(self.first, prepend=-1) > 0
        starts[-1] = True
        return starts

    def gather(self, per_sample: FloatArray) -> FloatArray:
        """(size,) sum of (n,) values per sample, shared out to the control points around them."""
        shares = (self.values[0] * per_sample[:, None]).ravel()
        return np.asarray(np.bincount(self.columns.ravel(), shares, self.size), dtype=np.float64)

    def evaluate(self, control_points: FloatArray, order: int = 0) -> FloatArray:
        """(n, d) spline values, or derivatives of ``order`` 1 or 2."""
        return np.einsum("ns,nsd->nd", self.values[order], control_points[self.columns])

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """(n, degree + 1) indices of the control points that matter at each sample."""
        return self.first[:, None] + np.arange(self.values.shape[2])


class BlockBandedSystem:
    """Normal equations ``A x = b`` over control points of dimension ``dimension``."""

    def __init__(self, basis: SampledBasis, dimension: int) -> None:
        self._basis, self._dimension, self._bandwidth = basis, dimension, basis.values.shape[2]
        # First control point, first sample and sample after the last of each span with samples.
        points, start = np.unique(basis.first, return_index=True)
        stop = np.append(start[1:], len(basis.first))
        self._spans = list(zip(points.tolist(), start.tolist(), stop.tolist(), strict=True))
        self._products = [self._pair_products(order) for order in range(3)]
        self._rows = [self._row_weights(order) for order in range(3)]
        self.reset()

    def reset(self) -> None:
        """Remove all terms."""
        size, d = self._basis.size, self._dimension
        self._blocks = np.zeros((self._bandwidth * size, d * d))
        self._coupled: list[FloatArray] = []
        self._right = np.zeros((size, d))
        self._memory: FloatArray | None = None

    def add(self, hessian: FloatArray | None, gradient: FloatArray, order: int = 0) -> None:
        """Add per-sample terms on the spline's derivative of ``order``.

        Args:
            hessian: (n, d, d) Gauss-Newton matrices, or None for none.
            gradient: (n, d) gradients of half the squared residuals.
            order: 0 for values, 1 for rates, 2 for accelerations.
        """
        if hessian is not None:
            self._memory = None
            self._blocks += self._products[order] @ hessian.reshape(len(hessian), -1)
        self._right -= self._rows[order] @ gradient

    def add_diagonal(self, weight: FloatArray, gradient: FloatArray, order: int = 0) -> None:
        """Add terms as :meth:`add` does whose Gauss-Newton matrices have the diagonals ``weight`` (n, d)."""
        self._memory = None
        self._blocks[:, :: self._dimension + 1] += self._products[order] @ weight
        self._right -= self._rows[order] @ gradient

    def add_coupled(self, jacobians: tuple[FloatArray, FloatArray, FloatArray], residual: FloatArray) -> None:
        """Add residuals that depend on values, rates and accelerations at once.

        Args:
            jacobians: Three (n, m, d) derivatives, by value, rate and acceleration.
            residual: (n, m).
        """
        self._memory = None
        n, m, d = jacobians[0].shape
        local = np.zeros((n, m, self._bandwidth, d))
        for order, jacobian in enumerate(jacobians):
            local += self._basis.values[order][:, None, :, None] * jacobian[:, :, None, :]
            self._right -= self._rows[order] @ (residual[:, None, :] @ jacobian)[:, 0]
        self._coupled.append(local.reshape(n, m, -1))

    def solve(self, damping: float | FloatArray) -> FloatArray:
        """(size, d) step of every control point, with Levenberg damping: one number, or one per point."""
        return self.factorised(damping).solve(self._right)

    def factorised(self, damping: float | FloatArray) -> "FactorisedSystem":
        """The system with Levenberg damping as of :meth:`solve`, to be solved for several right sides."""
        size, d = self._basis.size, self._dimension
        if self._memory is None:  # a step is often solved for again with more damping
            self._memory = self._assembled()
        band = self._memory.copy().reshape(size * d, -1).T
        band[0] += np.repeat(np.broadcast_to(damping, size), d)
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return FactorisedSystem(factor, self._basis, self._rows[0])

    @property
    def right(self) -> FloatArray:
        """(size, d) right side."""
        return self._right

    def _assembled(self) -> FloatArray:
        """The matrix in LAPACK's lower banded storage (bandwidth d + 1, size d), column by column, flat.

        The last row is zero; with it, a block of the matrix is an array that BLAS can add to in place.
        """
        size, d, width = self._basis.size, self._dimension, self._bandwidth
        depth = width * d
        memory = np.zeros(size * d * (depth + 1))
        # Below a diagonal element follow the rows of its own block column, so that the same
        # row of the next column lies one place earlier.
        steps = [memory.itemsize * step for step in (d * (depth + 1), depth, d, 1)]
        by_column = as_strided(memory, (size, d, width, d), steps)
        blocks = self._blocks.reshape(width, size, d, d)
        # What is above the diagonal would fall on places of the previous column.
        by_column[:, :, 0] = np.tril(blocks[0]).transpose(0, 2, 1)
        by_column[:, :, 1:] = blocks[1:].transpose(1, 3, 0, 2)
        for local in self._coupled:
            for first, start, stop in self._spans:
                begin = first * d * (depth + 1)
                block = memory[begin : begin + depth**2].reshape(depth, depth).T
                rows = local[start:stop].reshape(-1, depth)
                dsyrk(1.0, rows.T, beta=1.0, c=block, lower=1, overwrite_c=1)
        return memory

    def _pair_products(self, order: int) -> csr_matrix:
        values, first, size = self._basis.values[order], self._basis.first, self._basis.size
        n, pairs = len(first), [(a, b) for b in range(self._bandwidth) for a in range(b, self._bandwidth)]
        rows = np.concatenate([(a - b) * size + first + b for a, b in pairs])
        data = np.concatenate([values[:, a] * values[:, b] for a, b in pairs])
        columns = np.tile(np.arange(n), len(pairs))
        return csr_matrix((data, (rows, columns)), shape=(self._bandwidth * size, n))

    def _row_weights(self, order: int) -> csr_matrix:
        values, rows = self._basis.values[order], self._basis.columns.ravel()
        n, width = values.shape
        columns = np.repeat(np.arange(n), width)
        return csr_matrix((values.ravel(), (rows, columns)), shape=(self._basis.size, n))


VANISHED = 1e-3
"""Share of linearised residuals at which they count as met."""

UNANSWERED = 1e-9
"""Share of a change of the multipliers that the residuals must answer with, or no step can meet them."""


@dataclass(frozen=True, eq=False)
class FactorisedSystem:
    """Cholesky factor of normal equations, for steps that differ in their right side.

    Attributes:
        factor: In LAPACK's lower banded storage.
    """

    factor: FloatArray
    basis: SampledBasis
    rows: csr_matrix

    def solve(self, right: FloatArray) -> FloatArray:
        """(size, d) step for a right side of that shape."""
        step = cho_solve_banded((self.factor, True), right.ravel(), check_finite=False)
        return np.asarray(step, dtype=np.float64).reshape(right.shape)

    def constrained(
        self, right: FloatArray, jacobian: FloatArray, residual: FloatArray, multiplier: FloatArray,
        rounds: int,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Step for which some linearised residuals vanish, and the multipliers that hold them there.

        Conjugate gradients on the multipliers; each round is one more solution with the same factor. The
        residuals are among those whose squares the matrix has, so that few rounds do.

        Args:
            right: (size, d) right side, with ``multiplier`` added to the residuals.
            jacobian: (n, m, d) derivatives of the residuals by the spline's values; zero where free.
            residual: (n, m), zero where free.
            multiplier: (n, m) from which the rounds begin.
            rounds: Most further solutions; fewer where the residuals have vanished but for :data:`VANISHED`.
        """
        step = self.solve(right)
        left = residual + self._along(jacobian, step)
        direction, size = left, float(np.sum(left**2))
        enough = VANISHED**2 * size
        for _ in range(rounds):
            if size <= enough:
                break
            change = self.solve(self.rows @ (direction[:, None, :] @ jacobian)[:, 0])
            answer = self._along(jacobian, change)
            curvature = float(np.sum(direction * answer))
            if curvature <= UNANSWERED * float(np.sum(direction**2)):
                break
            length = size / curvature
            step, multiplier = step - length * change, multiplier + length * direction
            left = left - length * answer
            before, size = size, float(np.sum(left**2))
            direction = left + (size / before) * direction
        return step, multiplier

    def _along(self, jacobian: FloatArray, step: FloatArray) -> FloatArray:
        """(n, m) change of residuals with a step."""
        return (jacobian @ self.basis.evaluate(step)[:, :, None])[:, :, 0]

    def smallest(self, jacobian: FloatArray, residual: FloatArray, rounds: int) -> FloatArray:
        """Step for which linearised residuals vanish and nothing else counts; see :meth:`constrained`."""
        right = -(self.rows @ (residual[:, None, :] @ jacobian)[:, 0])
        return self.constrained(right, jacobian, residual, np.zeros_like(residual), rounds)[0]
