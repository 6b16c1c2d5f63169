from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

def sosfiltfilt(
    sos: ArrayLike, x: ArrayLike, axis: int = -1, padtype: str | None = "odd", padlen: int | None = None
) -> NDArray[np.float64]: ...
def butter(
    N: int, Wn: ArrayLike, btype: str = "low", analog: bool = False, output: str = "ba", fs: float | None = None
) -> Any: ...
