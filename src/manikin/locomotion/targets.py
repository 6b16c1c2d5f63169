"""The targets of the thesis' experiment and of its tests ([Truong2010]_ 4.3.3, 5.5.2)."""

import numpy as np

from manikin.spatial import FloatArray

START = (0.0, 0.0, float(np.pi / 2))
"""Where every subject stood: x, y [m], heading [rad] ([Truong2010]_ Fig. 4.14)."""

TEST_TARGETS = ((1.0, 0.0, 0.0), (-1.0, 1.0, float(np.pi / 4)))
"""Targets on which the thesis tests its cost ([Truong2010]_ 5.5.2)."""

_ACROSS = (0.5, 1.0, 2.0, 3.0)
_ALONG = (-1.0, 0.0, 0.5, 1.0)


def experiment_targets() -> FloatArray:
    """106 targets like those of the experiment ([Truong2010]_ 4.3.3).

    The thesis states 106 targets at 32 places of [-3, 3] x [-1, 1] m, 16 on either side, with headings out
    of eight from 0 to 7 pi/4; which ones is in a drawing only. Here the places are 0.5, 1, 2 and 3 m to
    either side and -1, 0, 0.5 and 1 m ahead, mirrored, with three or four of the headings at each, so that
    every heading and its mirror image occur.

    Returns:
        (106, 3) x, y [m], heading [rad], in [0, 2 pi).
    """
    targets = []
    for number, (x, y) in enumerate((x, y) for x in _ACROSS for y in _ALONG):
        headings = [(3 * number + step) % 8 for step in ((0, 2, 4, 6) if number % 3 == 0 else (0, 3, 5))]
        for heading in headings[: 4 if number < 15 else 3]:
            angle = heading * np.pi / 4
            targets += [(x, y, angle), (-x, y, (np.pi - angle) % (2.0 * np.pi))]
    return np.array(targets)
