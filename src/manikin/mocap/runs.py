"""Runs of frames in which something holds."""

import numpy as np
from numpy.typing import NDArray


def runs(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First frame and the one after the last of each run, in order.

    Args:
        holds: (n,) whether it holds in each frame.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    return [(int(first), int(stop)) for first, stop in edges.reshape(-1, 2)]


def switch(closes: NDArray[np.bool_], opens: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) state of a switch that is open before the first frame; where both hold, it closes.

    Args:
        closes: (n,) whether it closes in each frame.
        opens: (n,) whether it opens.
    """
    state, states = False, np.zeros(len(closes), dtype=bool)
    for frame in range(len(states)):
        state = bool(closes[frame]) or (state and not opens[frame])
        states[frame] = state
    return states


def lasting(
    holds: NDArray[np.bool_], shortest: float, shortest_cut: float | None = None
) -> list[tuple[int, int]]:
    """Runs of at least ``shortest`` frames, interruptions of less ignored.

    Args:
        holds: (n,) whether it holds in each frame.
        shortest: Frames; what is missing before the first frame and behind the last is no interruption.
        shortest_cut: Frames of a run that begins with the first frame or ends with the last, of which a
            part is missing; as many as of any other if None.
    """
    held, last = holds.copy(), len(holds)
    for first, stop in runs(~holds):
        if stop - first < shortest and first > 0 and stop < last:
            held[first:stop] = True
    cut = shortest if shortest_cut is None else shortest_cut
    return [
        (first, stop)
        for first, stop in runs(held)
        if stop - first >= (cut if first == 0 or stop == last else shortest)
    ]
