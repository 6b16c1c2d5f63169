from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

class PPoly:
    c: NDArray[np.float64]
    x: NDArray[np.float64]
    def __call__(
        self, x: ArrayLike, nu: int = 0, extrapolate: bool | str | None = None
    ) -> NDArray[np.float64]: ...
    def derivative(self, nu: int = 1) -> PPoly: ...
    def antiderivative(self, nu: int = 1) -> PPoly: ...
    def integrate(self, a: float, b: float, extrapolate: bool | str | None = None) -> NDArray[np.float64]: ...

class CubicHermiteSpline(PPoly):
    def __init__(
        self, x: ArrayLike, y: ArrayLike, dydx: ArrayLike, axis: int = 0, extrapolate: bool | None = None
    ) -> None: ...

class PchipInterpolator(CubicHermiteSpline):
    def __init__(self, x: ArrayLike, y: ArrayLike, axis: int = 0, extrapolate: bool | None = None) -> None: ...

class CubicSpline(CubicHermiteSpline):
    def __init__(
        self,
        x: ArrayLike,
        y: ArrayLike,
        axis: int = 0,
        bc_type: Any = "not-a-knot",
        extrapolate: bool | str | None = None,
    ) -> None: ...

class BPoly:
    c: NDArray[np.float64]
    x: NDArray[np.float64]
    def __init__(self, c: ArrayLike, x: ArrayLike, extrapolate: bool | None = None, axis: int = 0) -> None: ...
    def __call__(
        self, x: ArrayLike, nu: int = 0, extrapolate: bool | str | None = None
    ) -> NDArray[np.float64]: ...
    def derivative(self, nu: int = 1) -> Self: ...
    @classmethod
    def from_derivatives(
        cls, xi: ArrayLike, yi: Any, orders: int | list[int] | None = None, extrapolate: bool | None = None
    ) -> Self: ...

class BSpline:
    t: NDArray[np.float64]
    c: NDArray[np.float64]
    k: int
    def __init__(
        self, t: ArrayLike, c: ArrayLike, k: int, extrapolate: bool | str = True, axis: int = 0
    ) -> None: ...
    def __call__(
        self, x: ArrayLike, nu: int = 0, extrapolate: bool | str | None = None
    ) -> NDArray[np.float64]: ...
    def derivative(self, nu: int = 1) -> Self: ...
    def antiderivative(self, nu: int = 1) -> Self: ...
    @classmethod
    def design_matrix(cls, x: ArrayLike, t: ArrayLike, k: int, extrapolate: bool | str = False) -> Any: ...
