"""Gait cycles of a recorded person on one sheet: angles, moments and powers of both legs over 0 to 100 %.

A grey band is the mean and one standard deviation of the people of :mod:`manikin.analysis.gait_bands`; a
person's own cycles have a line for the mean, and a pale band for one standard deviation where there are
several. A tick below marks the mean lift-off of each foot.
"""

import numpy as np

from manikin.analysis.gait_bands import GaitBand
from manikin.analysis.gait_cycles import PERCENT, GaitReport
from manikin.numerics.spatial import FloatArray
from manikin.reports.analysis_sheet import GRID, SvgDrawing, round_values
from manikin.runtime.display import COLOURS, side_colour

PANELS = (
    (("hip_flexion_deg", "hip: flexion [deg]"), ("knee_flexion_deg", "knee: flexion [deg]"),
     ("ankle_dorsiflexion_deg", "ankle: dorsiflexion [deg]")),
    (("hip_extension_Nm_per_kg", "hip: extending moment [N.m/kg]"),
     ("knee_extension_Nm_per_kg", "knee: extending moment [N.m/kg]"),
     ("ankle_plantarflexion_Nm_per_kg", "ankle: plantarflexing moment [N.m/kg]")),
    (("hip_power_W_per_kg", "hip: power [W/kg]"), ("knee_power_W_per_kg", "knee: power [W/kg]"),
     ("ankle_power_W_per_kg", "ankle: power [W/kg]")),
    (("hip_abduction_deg", "hip: abduction [deg]"), ("hip_rotation_deg", "hip: rotation [deg]"),
     ("hip_abduction_Nm_per_kg", "hip: abducting moment [N.m/kg]")),
)  # fmt: skip
"""Curves of the sheet, row by row, with their titles."""

WIDTH, HEIGHT, LEFT, TOP, ACROSS, DOWN = 300.0, 130.0, 50.0, 50.0, 370.0, 195.0
"""Size of a panel, place of the first one, and distances from one to the next [px]."""

OPAQUE, PALE = 1.0, 0.18
"""How opaque the band of the people, and that of the person's own cycles is."""


def gait_sheet(report: GaitReport, band: GaitBand, words: str) -> str:
    """SVG element of the cycles beside the band of the people; ``words`` are its alternative text."""
    rows = len(PANELS)
    sheet = SvgDrawing(LEFT + 3.0 * ACROSS - 20.0, TOP + rows * DOWN)
    key = [(f"   {side}: {len(report.of(side))} cycles", side_colour(side)) for side in report.curves]
    people = f"{band.group}: {band.people} people, mean and standard deviation"
    sheet.text(LEFT, 16.0, (people, COLOURS["soft"]), *key)
    for row, panels in enumerate(PANELS):
        for column, (name, title) in enumerate(panels):
            left, bottom = LEFT + column * ACROSS, TOP + row * DOWN + HEIGHT
            _panel(sheet, report, band, name, title, left, bottom)
    return sheet.svg(words)


def _panel(
    sheet: SvgDrawing, report: GaitReport, band: GaitBand, name: str, title: str, left: float, bottom: float
) -> None:
    mean, deviation = band.curves[name]
    own = {side: curves[name] for side, curves in report.curves.items()}
    edges = [mean - deviation, mean + deviation, *(values for values, _ in own.values())]
    low, high = float(np.min(edges)), float(np.max(edges))
    room = 0.06 * max(high - low, 1e-3)
    low, high = low - room, high + room

    def x(percent: FloatArray) -> FloatArray:
        return left + 0.01 * WIDTH * percent

    def y(values: FloatArray) -> FloatArray:
        return bottom - HEIGHT * (np.clip(values, low, high) - low) / (high - low)

    def area(centre: FloatArray, spread: FloatArray, colour: str, opacity: float) -> None:
        across = np.concatenate([PERCENT, PERCENT[::-1]])
        up = np.concatenate([centre - spread, (centre + spread)[::-1]])
        sheet.area(x(across), y(up), colour, opacity)

    area(mean, deviation, GRID, OPAQUE)
    for tick, level in zip(ticks := round_values(low, high, 5), y(ticks), strict=True):
        line = np.array([[left, level], [left + WIDTH, level]])
        sheet.strokes([line], COLOURS["soft"] if abs(tick) < 1e-9 else GRID, 0.8)
        sheet.text(left - 6.0, level + 4.0, (f"{tick:g}", COLOURS["ink"]), size=10.0, anchor="end")
    sheet.curve(x(PERCENT), y(mean), COLOURS["soft"], 1.0)
    for side, (values, spread) in own.items():
        if spread is not None:
            area(values, spread, side_colour(side), PALE)
        sheet.curve(x(PERCENT), y(values), side_colour(side), 1.8)
        off = float(np.mean([one.stance for one in report.of(side)]))
        place = float(x(np.array([off]))[0])
        sheet.strokes([np.array([[place, bottom - 8.0], [place, bottom]])], side_colour(side), 2.0)
    sheet.strokes([np.array([[left, bottom], [left + WIDTH, bottom]])], COLOURS["soft"], 1.0)
    for tick in (0.0, 20.0, 40.0, 60.0, 80.0, 100.0):
        place = float(x(np.array([tick]))[0])
        sheet.text(place, bottom + 14.0, (f"{tick:g}", COLOURS["ink"]), size=10.0, anchor="middle")
    sheet.text(
        left + 0.5 * WIDTH, bottom + 27.0, ("% of the cycle", COLOURS["ink"]), size=10.0, anchor="middle"
    )
    sheet.text(left, bottom - HEIGHT - 8.0, (title, COLOURS["ink"]))


def gait_columns(report: GaitReport, band: GaitBand) -> dict[str, FloatArray]:
    """(101,) columns for a table: the cycle's per cent, curves of both sides, and those of the people."""
    columns = {"percent": PERCENT}
    for side, curves in report.curves.items():
        for name, (mean, deviation) in curves.items():
            columns[f"{side}_{name}_mean"] = mean
            columns[f"{side}_{name}_sd"] = np.full(len(PERCENT), np.nan) if deviation is None else deviation
    for name, (mean, deviation) in band.curves.items():
        columns[f"{band.group}_{name}_mean"], columns[f"{band.group}_{name}_sd"] = mean, deviation
    return columns
