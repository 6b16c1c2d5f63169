"""Drawings for pages: lines, bars and words as SVG, which a browser draws sharply at any size.

Making one takes a hundredth of what a figure of pixels takes.
"""

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from manikin.spatial import FloatArray

TENTHS = 10.0
"""Of a pixel: what coordinates are rounded to."""

INK = "#222222"


class Drawing:
    """Collects what is drawn; x goes to the right and y downward, in pixels of the page.

    Attributes:
        width: Of the drawing [px].
        height: Of the drawing [px].
    """

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height
        self._parts: list[str] = []

    def curve(self, x: FloatArray, y: FloatArray, colour: str, width: float) -> None:
        """A line through points (n,) and (n,), broken where one is not finite."""
        known = np.isfinite(x) & np.isfinite(y)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(np.int8), [0]])))
        path = [_way(x[first:stop], y[first:stop]) for first, stop in edges.reshape(-1, 2)]
        self._stroke(path, colour, width)

    def strokes(self, lines: Iterable[FloatArray], colour: str, width: float) -> None:
        """Lines (k, 2) from point to point."""
        self._stroke([_way(line[:, 0], line[:, 1]) for line in lines], colour, width)

    def bar(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        """A filled rectangle with its upper left corner at (x, y)."""
        left, top, across, down = (_tenths(one) for one in (x, y, width, height))
        self._parts.append(f'<rect x="{left}" y="{top}" width="{across}" height="{down}" fill="{colour}"/>')

    def text(
        self, x: float, y: float, *parts: tuple[str, str], size: float = 12.0, anchor: str = "start"
    ) -> None:
        """Words in a row, each with its colour.

        Args:
            x: Of the ``anchor``.
            y: Of the line that the words stand on.
            parts: Words and colours.
            size: Of the letters [px].
            anchor: ``"start"``, ``"middle"`` or ``"end"`` of the row.
        """
        spans = "".join(f'<tspan fill="{colour}">{escape(words)}</tspan>' for words, colour in parts)
        self._parts.append(
            f'<text x="{_tenths(x)}" y="{_tenths(y)}" font-size="{_tenths(size)}" text-anchor="{anchor}" '
            f'xml:space="preserve">{spans}</text>'
        )

    def svg(self, words: str) -> str:
        """Text of the drawing, an element of a page of HTML.

        Args:
            words: What it shows, for who does not see it.
        """
        size = f'viewBox="0 0 {_tenths(self.width)} {_tenths(self.height)}"'
        head = f'<svg {size} role="img" aria-label="{escape(words)}"'
        return "\n".join([f'{head} font-family="system-ui, sans-serif">', *self._parts, "</svg>"])

    def _stroke(self, path: Sequence[str], colour: str, width: float) -> None:
        if path:
            self._parts.append(
                f'<path d="{"".join(path)}" fill="none" stroke="{colour}" stroke-width="{_tenths(width)}" '
                'stroke-linecap="round" stroke-linejoin="round"/>'
            )


def round_values(low: float, high: float, most: int) -> FloatArray:
    """Multiples of 1, 2, 2.5 or 5 times a power of ten from ``low`` to ``high``, at most ``most``.

    Args:
        low: Lower end.
        high: Upper end, above it.
        most: At least 1.
    """
    power = 10.0 ** np.floor(np.log10((high - low) / most))
    for step in (power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0, 20.0)):
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        if last - first < most:
            break
    return step * np.arange(first, last + 1.0) + 0.0  # no -0


def _way(x: FloatArray, y: FloatArray) -> str:
    """A line through finite points; those in the middle of straight and even ways are left out."""
    points = np.rint(TENTHS * np.stack([x, y], axis=1)).astype(np.int64)
    steps = np.diff(points, axis=0)
    kept = np.ones(len(points), dtype=bool)
    kept[1:-1] = (steps[1:] != steps[:-1]).any(axis=1)
    points = points[kept]
    return f"M{points[0, 0]} {points[0, 1]}l" + " ".join(map(str, np.diff(points, axis=0).ravel().tolist()))


def _tenths(value: float) -> int:
    return round(TENTHS * value)
