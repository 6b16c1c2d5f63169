from collections.abc import Callable, Sequence
from typing import Any

from numpy.typing import ArrayLike

class OptimizeResult(dict[str, Any]):
    x: Any  # None where a linear program has no solution
    fun: float
    success: bool
    status: int
    message: str
    nit: int

def linprog(
    c: ArrayLike,
    A_ub: Any = None,
    b_ub: ArrayLike | None = None,
    A_eq: Any = None,
    b_eq: ArrayLike | None = None,
    bounds: ArrayLike | Sequence[Sequence[float | None]] | tuple[float | None, float | None] = (0, None),
    method: str = "highs",
    callback: Callable[[OptimizeResult], Any] | None = None,
    options: dict[str, Any] | None = None,
    x0: ArrayLike | None = None,
    integrality: ArrayLike | None = None,
) -> OptimizeResult: ...
def minimize(
    fun: Callable[..., Any],
    x0: ArrayLike,
    args: tuple[Any, ...] = (),
    method: str | None = None,
    jac: Callable[..., Any] | str | bool | None = None,
    hess: Any = None,
    hessp: Any = None,
    bounds: Sequence[tuple[float | None, float | None]] | None = None,
    constraints: Any = (),
    tol: float | None = None,
    callback: Callable[..., Any] | None = None,
    options: dict[str, Any] | None = None,
) -> OptimizeResult: ...
def lsq_linear(
    A: Any,
    b: ArrayLike,
    bounds: tuple[ArrayLike, ArrayLike] = ...,
    method: str = "trf",
    tol: float = 1e-10,
    lsq_solver: str | None = None,
    lsmr_tol: float | str | None = None,
    max_iter: int | None = None,
    verbose: int = 0,
) -> OptimizeResult: ...
def brentq(
    f: Callable[[float], float],
    a: float,
    b: float,
    args: tuple[Any, ...] = (),
    xtol: float = 2e-12,
    rtol: float = ...,
    maxiter: int = 100,
) -> float: ...
