"""Texts on axes that leave out what would cover an earlier one."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox, Transform

from manikin.figures.style import white_edge

_WIDTH = 0.64
"""Width of a character over the size of its font, of the widest digits."""

_HEIGHT = 1.1
"""Height of a line over the size of its font."""


class Labels:
    """Writes short texts on axes, each only where it covers none of those written before.

    The limits of the axes have to be final, for they say how far apart two places are drawn.
    """

    def __init__(self, axes: Axes, transform: Transform | None = None) -> None:
        """Begin without any text.

        Args:
            axes: To write on.
            transform: From the places' coordinates to those of the display; of the data when omitted.
        """
        axes.apply_aspect()
        self._axes, self._transform = axes, transform or axes.transData
        self._point = axes.figure.dpi / 72.0
        self._taken: list[Bbox] = []

    def write(
        self,
        text: str,
        place: tuple[float, float],
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        size: float = 7.5,
        ha: str = "left",
        **style: Any,
    ) -> bool:
        """Write a text unless it would cover another one.

        Args:
            text: One line.
            place: What it belongs to.
            offset: From there to the lower edge of the text [points].
            size: Of the font [points].
            ha: Horizontal alignment.
            style: Passed on to Matplotlib, such as ``color``.

        Returns:
            Whether it was written.
        """
        corner = self._transform.transform(place) + self._point * np.asarray(offset)
        width, height = self._point * size * np.array([_WIDTH * len(text), _HEIGHT])
        left = corner[0] - {"left": 0.0, "center": 0.5, "right": 1.0}[ha] * width
        box = Bbox.from_bounds(left, corner[1], width, height)
        if any(box.overlaps(other) for other in self._taken):
            return False
        self._taken.append(box)
        self._axes.annotate(
            text, place, offset, xycoords=self._transform, textcoords="offset points", fontsize=size, ha=ha,
            va="bottom", path_effects=[white_edge()], **style,
        )  # fmt: skip
        return True
