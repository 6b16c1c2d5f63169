"""The best step of a convex quadratic within bounds, nearly."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsymv
from scipy.linalg.lapack import dposv

from manikin.spatial import FloatArray

MOST_ROUNDS = 5


def projected_step(
    matrix: FloatArray, right: FloatArray, damping: float, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Solution of ``(matrix + damping) @ step = right`` within bounds.

    Unknowns that would leave their bounds are put on them, the others solved for again, until none leaves. An
    unknown that is on its bound and pushed outward stays there (Bertsekas, "Projected Newton methods for
    optimization problems with simple constraints", 1982).

    Args:
        matrix: (d, d), not indefinite; its lower triangle is read.
        right: (d,).
        damping: Added to the diagonal, above 0.
        lower: (d,) at most 0.
        upper: (d,) at least 0.

    Returns:
        (d,) step.
    """
    matrix = matrix.copy()
    matrix.reshape(-1)[:: len(right) + 1] += damping
    stopped = ((lower >= 0.0) & (right < 0.0)) | ((upper <= 0.0) & (right > 0.0))
    step = np.zeros_like(right)
    for _ in range(MOST_ROUNDS):
        step = _solved(matrix, right, stopped, step)
        kept = np.minimum(np.maximum(step, lower), upper)
        beyond = (kept != step) & ~stopped
        step = kept
        if not beyond.any():
            break
        stopped |= beyond
    return step


def _solved(
    matrix: FloatArray, right: FloatArray, stopped: NDArray[np.bool_], step: FloatArray
) -> FloatArray:
    """The solution in which some unknowns are as in a step."""
    fixed = stopped.nonzero()[0]
    if fixed.size:
        known = np.where(stopped, step, 0.0)
        right = np.where(stopped, step, right - dsymv(1.0, matrix.T, known))
        matrix = matrix.copy()
        matrix[fixed], matrix[:, fixed] = 0.0, 0.0
        matrix[fixed, fixed] = 1.0
    return dposv(matrix.T, right)[1]
