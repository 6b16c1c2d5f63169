import numpy as np
from numpy.typing import ArrayLike, NDArray

def cumulative_trapezoid(
    y: ArrayLike, x: ArrayLike | None = None, dx: float = 1.0, axis: int = -1, initial: float | None = None
) -> NDArray[np.float64]: ...
