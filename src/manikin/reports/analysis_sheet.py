"""A recorded person on one sheet: postures, supports, forces, margins, height and scores over time.

All share one axis of time, band below band. The sheet is an SVG drawing: there is one for every recording of
a folder, and it is made in a hundredth of the time of a figure of Matplotlib.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import pinocchio as pin

from manikin.analysis import Analysis
from manikin.body import BodyModel
from manikin.body.segments import end_of
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, rotation_from_quaternion, turned_root
from manikin.runtime.display import COLOURS, colours_of, readable, side_colour

TENTHS = 10.0
"""Coordinates are rounded to the inverse of this [1/px]."""


class SvgDrawing:
    """Collects what is drawn; x goes to the right and y downward, in pixels of the page."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height
        self._parts: list[str] = []

    def curve(self, x: FloatArray, y: FloatArray, colour: str, width: float) -> None:
        """A line through points (n,) and (n,), broken where one is not finite."""
        known = mask_runs(np.isfinite(x) & np.isfinite(y))
        self._stroke([_way(x[first:stop], y[first:stop]) for first, stop in known], colour, width)

    def strokes(self, lines: Iterable[FloatArray], colour: str, width: float) -> None:
        """Lines (k, 2) from point to point."""
        self._stroke([_way(line[:, 0], line[:, 1]) for line in lines], colour, width)

    def area(self, x: FloatArray, y: FloatArray, colour: str, opacity: float) -> None:
        """A filled polygon through points (n,) and (n,), all finite."""
        self._parts.append(f'<path d="{_way(x, y)}z" fill="{colour}" fill-opacity="{opacity:g}"/>')

    def bar(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        """A filled rectangle with its upper left corner at (x, y)."""
        left, top, across, down = (_tenths(item) for item in (x, y, width, height))
        self._parts.append(f'<rect x="{left}" y="{top}" width="{across}" height="{down}" fill="{colour}"/>')

    def text(
        self, x: float, y: float, *parts: tuple[str, str], size: float = 12.0, anchor: str = "start"
    ) -> None:
        """Words in a row on the line y, each with its colour, in letters of a size [px].

        The ``anchor`` at x is the ``"start"``, ``"middle"`` or ``"end"`` of the row.
        """
        spans = "".join(f'<tspan fill="{colour}">{escape(words)}</tspan>' for words, colour in parts)
        self._parts.append(
            f'<text x="{_tenths(x)}" y="{_tenths(y)}" font-size="{_tenths(size)}" text-anchor="{anchor}" '
            f'xml:space="preserve">{spans}</text>'
        )

    def svg(self, words: str) -> str:
        """Text of the drawing, an element of a page of HTML; ``words`` are its alternative text."""
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
    """Multiples of 1, 2, 2.5 or 5 times a power of ten from ``low`` to ``high``, at most ``most``."""
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


POSTURES = 7
"""Postures drawn, each above its instant: in the middle of as many equal parts of the time."""
LARGEST = 115.0
"""Scale of the postures where there is room [px/m]."""
WIDTH, LEFT, RIGHT = 1120.0, 105.0, 15.0
ROW, BAND, GAP = 20.0, 92.0, 42.0
"""Heights of a row of supports, of a band of curves, and between bands [px]."""
GRID = "#E3E3E3"
Curves = Mapping[str, tuple[FloatArray, str]]


@dataclass(frozen=True)
class _Band:
    """Curves over time on a scale from ``low`` to ``high``: values (n,) and colour by name."""

    title: str
    curves: Curves
    low: float
    high: float


def recording_sheet(analysis: Analysis, words: str) -> str:
    """SVG element of what was measured of a recording over time; ``words`` are its alternative text."""
    figures, bands = _Postures(analysis), _bands(analysis)
    rows = figures.height + 40.0
    top = rows + ROW * len(analysis.motion.contact_names)
    sheet = SvgDrawing(WIDTH, top + len(bands) * (GAP + BAND) + 42.0)
    clock = _Clock(float(analysis.time[0]), float(analysis.time[-1]))
    figures.draw(sheet, clock)
    _supports(sheet, clock, analysis, rows)
    for band in bands:
        top += GAP + BAND
        _draw(sheet, clock(analysis.time), band, top)
    clock.draw(sheet, top + 6.0)
    return sheet.svg(words)


class _Clock:
    """Positions of instants on the sheet."""

    def __init__(self, first: float, last: float) -> None:
        self.first, self.last = first, last
        self._scale = (WIDTH - LEFT - RIGHT) / (last - first)

    def __call__(self, time: FloatArray) -> FloatArray:
        return LEFT + self._scale * (time - self.first)

    def draw(self, sheet: SvgDrawing, level: float) -> None:
        ticks = round_values(self.first, self.last, 10)
        places = self(ticks)
        marks = [np.array([[place, level], [place, level + 5.0]]) for place in places]
        sheet.strokes([_level(level), *marks], COLOURS["soft"], 1.0)
        for tick, place in zip(ticks, places, strict=True):
            sheet.text(place, level + 18.0, (f"{tick:g}", COLOURS["ink"]), size=11.0, anchor="middle")
        middle = 0.5 * (LEFT + WIDTH - RIGHT)
        sheet.text(middle, level + 34.0, ("time [s]", COLOURS["ink"]), anchor="middle")


def _level(y: float) -> FloatArray:
    """(2, 2) ends of a level line across the sheet [px]."""
    return np.array([[LEFT, y], [WIDTH - RIGHT, y]])


def _bands(analysis: Analysis) -> list[_Band]:
    ink, ours, soft = COLOURS["ink"], COLOURS["recorded"], COLOURS["soft"]
    forces = {"from motion": (analysis.vertical_force / analysis.weight, ours)}
    if analysis.plates is not None and analysis.plates.compared.any():
        measured = np.where(analysis.plates.compared, analysis.plates.vertical_force, np.nan)
        forces["force plates"] = (measured / analysis.weight, ink)
    margins = {
        "as recorded": (analysis.motion.margin, ours),
        "as a point mass": (analysis.point_mass_margin, ink),
    }
    if (shifted := analysis.measured.believed) is not None:
        margins["shifted"] = (shifted.margins.whole_body, COLOURS["shifted"])
        floor = np.where(shifted.at_floor, shifted.margins.whole_body, np.nan)
        margins["at the imposed floor"] = (floor, soft)
    bands = [
        _scaled("vertical force [body weight]", forces, 0.0),
        _scaled("margin [N.m]", margins, 0.0, 0.01),
        _scaled("height of the centre of mass [m]", {"": (analysis.com_height, ours)}),
    ]
    if (posture := analysis.ergonomics.posture) is not None:
        methods = (posture.rula, COLOURS["planned"]), (posture.reba, COLOURS["executed"])
        scores = {item.method: (item.score.astype(np.float64), colour) for item, colour in methods}
        bands.append(_Band("scores", scores, 0.0, 15.0))
    return bands


def _scaled(title: str, curves: Curves, least: float | None = None, cut: float = 0.0) -> _Band:
    """A band that shows all values but the share ``cut`` that is lowest, and the value ``least``."""
    known = np.concatenate([values[np.isfinite(values)] for values, _ in curves.values()])
    low, high = (float(np.quantile(known, cut)), float(known.max())) if known.size else (0.0, 1.0)
    low = low if least is None else min(low, least)
    room = 0.05 * max(high - low, 0.05)
    return _Band(title, curves, low - room, high + room)


def _draw(sheet: SvgDrawing, x: FloatArray, band: _Band, bottom: float) -> None:
    def placed(values: FloatArray) -> FloatArray:
        shares = (values - band.low) / (band.high - band.low)
        return bottom - BAND * np.where(np.abs(shares - 0.5) <= 0.5, shares, np.nan)

    ticks = round_values(band.low, band.high, 4)
    for tick, level in zip(ticks, placed(ticks), strict=True):
        colour = COLOURS["soft"] if abs(tick) < 1e-9 and band.low < 0.0 else GRID
        sheet.strokes([_level(level)], colour, 0.8)
        words = f"{0.0 if abs(tick) < 1e-9 else tick:g}"
        sheet.text(LEFT - 8.0, level + 4.0, (words, COLOURS["ink"]), size=11.0, anchor="end")
    sheet.text(LEFT, bottom - BAND - 8.0, (band.title, COLOURS["ink"]))
    for values, colour in reversed(list(band.curves.values())):
        sheet.curve(x, placed(values), colour, 1.6)
    key = [(f"   {name}", colour) for name, (_, colour) in band.curves.items()]
    sheet.text(WIDTH - RIGHT, bottom - BAND - 8.0, *key, anchor="end")


def _supports(sheet: SvgDrawing, clock: _Clock, analysis: Analysis, top: float) -> None:
    """A row of bars for each effector."""
    names = analysis.motion.contact_names
    colours = colours_of(names)
    for row, name in enumerate(names):
        level = top + ROW * row
        for item in analysis.supports.of(name):
            first, last = clock(np.array([item.start, item.end]))
            sheet.bar(first, level + 2.0, last - first, ROW - 4.0, colours[name])
        sheet.text(LEFT - 8.0, level + 0.5 * ROW + 4.0, (readable(name), COLOURS["ink"]), anchor="end")


class _Postures:
    """Postures from the right side of where the person goes, or looks at first; ``height`` is in pixels."""

    def __init__(self, analysis: Analysis) -> None:
        frames = np.unique((np.arange(0.5, POSTURES) / POSTURES * len(analysis.time)).astype(np.int64))
        turned = turned_root(analysis.motion.q[frames], -_heading(analysis))
        turned[:, :2] = 0.0
        self._instants = analysis.time[frames]
        self._colours = list(map(side_colour, _drawn(analysis.body)))
        self._bones = np.array([_bones(analysis.body, q) for q in turned])
        ahead, up = np.moveaxis(self._bones, -1, 0)  # views
        up -= min(analysis.supports.surfaces, default=0.0)
        room = (WIDTH - LEFT - RIGHT) / max(len(frames), 4)
        self._scale = min(LARGEST, room / (float(np.ptp(ahead, axis=(1, 2)).max()) + 0.15))
        ahead -= 0.5 * (ahead.min(axis=(1, 2), keepdims=True) + ahead.max(axis=(1, 2), keepdims=True))
        self._top, self._below = max(float(up.max()), 0.5), max(-float(up.min()), 0.0)
        self.height = self._scale * (self._top + self._below) + 20.0

    def draw(self, sheet: SvgDrawing, clock: _Clock) -> None:
        floor = 10.0 + self._scale * self._top
        sheet.strokes([_level(floor)], COLOURS["soft"], 1.0)
        places = np.stack([clock(self._instants), np.full(len(self._instants), floor)], axis=1)
        bones = places[:, None, None] + self._scale * self._bones * (1.0, -1.0)
        for colour in map(side_colour, ("left", "trunk", "right")):  # seen from the right, the nearest limbs
            chosen = [number for number, item in enumerate(self._colours) if item == colour]
            sheet.strokes([line for lines in bones[:, chosen] for line in lines], colour, 5.0)
        for instant, (place, _) in zip(self._instants, places, strict=True):
            level = floor + self._scale * self._below + 18.0
            sheet.text(place, level, (f"{instant:.2f} s", COLOURS["ink"]), size=11.0, anchor="middle")


def _drawn(body: BodyModel) -> list[str]:
    """Segments whose bones are drawn: from each parent to all, then those without children."""
    parents, names = {item.parent for item in body.segments}, [item.name for item in body.segments[1:]]
    return names + [name for name in names if name not in parents]


def _bones(body: BodyModel, q: FloatArray) -> FloatArray:
    """(k, 2, 2) lines of :func:`_drawn`, seen from the right [m].

    From the origin of each segment's parent to its own, and of head, hands and toes to their ends: twice as
    far as their centres of mass.
    """
    model, data = body.pinocchio, body.pinocchio.createData()
    pin.framesForwardKinematics(model, data, q)
    frames = {item.name: data.oMf[body.segment_frame(item.name)] for item in body.segments}
    places = {name: frame.translation for name, frame in frames.items()}
    lines = [[places[item.parent or ""], places[item.name]] for item in body.segments[1:]]
    for name in _drawn(body)[len(lines) :]:
        lines.append([places[name], frames[name].act(end_of(body.segment(name)))])
    return np.array(lines)[..., [0, 2]]


def _heading(analysis: Analysis) -> float:
    """Heading of the way of the pelvis, or of the pelvis in the middle of the recording if it stays [rad]."""
    q = analysis.motion.q
    way = q[-1, :2] - q[0, :2]
    if float(np.linalg.norm(way)) <= 0.5:
        way = rotation_from_quaternion(q[None, len(q) // 2, 3:7])[0, :2, 0]
    return float(np.arctan2(way[1], way[0]))
