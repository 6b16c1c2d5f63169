"""Maps of a study: who can, and with what margin, over stature and mass and over the swept values."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from manikin.body.anthropometry import Sex
from manikin.body.population import boundary_people
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures.style import dress, legend_below_title, new_grid
from manikin.runtime.display import COLOURS

VERDICTS = {"can": "#009E73", "cannot": "#D55E00", "undecided": "#8A8A8A"}
"""Colours of what becomes of a person."""
MARKS = {"female": "o", "male": "s"}
"""Marks of the sexes; others are drawn as those of men."""
MARGINS = {
    "executed_margin_Nm": "least margin as executed [N.m]", "planned_margin_Nm": "least planned margin [N.m]",
    "rest_torque_share": "largest share of strength at rest",
}  # fmt: skip
"""What is drawn as the margin, the first of which there is one; of a share, less is better."""
_SHARE = ListedColormap([VERDICTS["cannot"], "#E8A77C", "#EFE3C8", "#8CCDB4", VERDICTS["can"]])
_MOST_NAMES = 40


def study_maps(result: Mapping[str, Any]) -> dict[str, Figure]:
    """Maps of a finished study that apply, by what they show.

    Args:
        result: As of :func:`manikin.pipeline.study.run_study`.
    """
    people, settings = result["people"], result["settings"]
    sized = [person for person in people if person["stature_m"] and person["mass_kg"]]
    maps = {}
    if len({(person["stature_m"], person["mass_kg"]) for person in sized}) > 1:
        maps["who can, by stature and mass"] = _over_sizes(sized, settings, None)
        if (margin := _margin_of(sized)) is not None:
            maps["margin, by stature and mass"] = _over_sizes(sized, settings, margin)
    if len(settings) > 1:
        maps["who can, by swept values"] = _over_settings(people, settings, None)
        if (margin := _margin_of(people)) is not None:
            maps["margin, by swept values"] = _over_settings(people, settings, margin)
    return maps


def setting_words(values: Mapping[str, Any]) -> str:
    """Swept values in words; empty without any."""
    return ", ".join(f"{name} {_number(value)}" for name, value in values.items())


def _number(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _margin_of(people: Sequence[Mapping[str, Any]]) -> str | None:
    """Which measure is drawn as the margin; None if nobody has one."""
    return next((key for key in MARGINS if any(person[key] is not None for person in people)), None)


def _colours(margin: str | None) -> str:
    """Colours of a margin, brighter where it is better."""
    return "viridis_r" if margin == "rest_torque_share" else "viridis"


def _over_sizes(
    people: Sequence[Mapping[str, Any]], settings: Sequence[Mapping[str, Any]], margin: str | None
) -> Figure:
    """People by stature and mass, one panel for each of the first six settings."""
    shown = list(range(min(len(settings), 6)))
    columns = min(len(shown), 3)
    rows = -(-len(shown) // columns)
    title = "Who can" if margin is None else MARGINS[margin][0].upper() + MARGINS[margin][1:]
    figure, grid = new_grid(
        0.9 + 3.6 * columns + (0.8 if margin else 0.0), 0.9 + 3.2 * rows, title, rows, columns, top=0.95,
        between=0.6, across=0.35, right=0.15 if margin is None else 1.0,
    )  # fmt: skip
    values = [person[margin] for person in people if margin and person[margin] is not None]
    span = (min(values), max(values)) if values else (0.0, 1.0)
    points = None
    first: Axes | None = None
    for number in shown:
        axes = figure.add_subplot(grid[number // columns, number % columns], sharex=first, sharey=first)
        first = first or axes
        here = [person for person in people if person["setting"] == number]
        _draw_ellipses(axes, {person["sex"] for person in here})
        for mark in dict.fromkeys(MARKS.values()):
            group = [person for person in here if MARKS.get(person["sex"], MARKS["male"]) == mark]
            points = _draw_people(axes, group, mark, margin, span) or points
        dress(
            axes, "mass [kg]" if number % columns == 0 else "",
            "stature [m]" if number // columns == rows - 1 else "", setting_words(settings[number]),
        )  # fmt: skip
    if margin is not None and points is not None:
        width = figure.get_figwidth()
        bar = figure.add_axes((1.0 - 0.75 / width, 0.15, 0.14 / width, 0.6))
        figure.colorbar(points, cax=bar).ax.tick_params(labelsize=8)
    colours = VERDICTS if margin is None else {"cannot": VERDICTS["cannot"]}
    keys = [_key(word, "x" if word == "cannot" else "o", colour) for word, colour in colours.items()]
    keys += [_key(sex, mark, COLOURS["ink"], "none") for sex, mark in MARKS.items()]
    keys.append(Line2D([], [], color=COLOURS["soft"], linewidth=0.9, label="90 % of the survey"))
    legend_below_title(figure, keys)
    return figure


def _key(word: str, mark: str, colour: str, face: str | None = None) -> Line2D:
    inside = face or colour
    return Line2D(
        [], [], linestyle="none", marker=mark, label=word, markerfacecolor=inside, markeredgecolor=colour
    )


def _draw_people(
    axes: Axes, people: Sequence[Mapping[str, Any]], mark: str, margin: str | None, span: tuple[float, float]
) -> Any:
    """Draw people with one mark; of a margin, return what its colours are read from."""
    points = None
    can = [person for person in people if person["verdict"] == "can"]
    for word, colour in VERDICTS.items():
        group = [person for person in people if person["verdict"] == word]
        if not group or (margin is not None and word == "can"):
            continue
        place = [[person[key] for person in group] for key in ("stature_m", "mass_kg")]
        axes.scatter(*place, s=34, marker="x" if word == "cannot" else mark, color=colour, zorder=3)
    known = [person for person in can if margin is not None and person[margin] is not None]
    if margin is not None and known:
        place = [[person[key] for person in known] for key in ("stature_m", "mass_kg")]
        points = axes.scatter(
            *place, c=[person[margin] for person in known], s=44, marker=mark, cmap=_colours(margin),
            vmin=span[0], vmax=span[1], edgecolor=COLOURS["ink"], linewidth=0.5, zorder=3,
        )  # fmt: skip
    return points


def _draw_ellipses(axes: Axes, sexes: set[str | None]) -> None:
    """Draw the ellipse of stature and mass that holds 90 % of each sex in the survey."""
    for sex in (item for item in Sex if item in sexes):
        ends = np.array([person.values[:2] for person in boundary_people(sex, 0.9, ("stature", "mass"))])
        middle, turn = ends.mean(axis=0), np.linspace(0.0, 2.0 * np.pi, 73)[:, None]
        line = middle + np.cos(turn) * (ends[0] - middle) + np.sin(turn) * (ends[2] - middle)
        axes.plot(*line.T, color=COLOURS["soft"], linewidth=0.9, zorder=1)


def _over_settings(
    people: Sequence[Mapping[str, Any]], settings: Sequence[Mapping[str, Any]], margin: str | None
) -> Figure:
    """Share who can, or the margin: two swept values against each other, or bodies against the settings."""
    names = list(settings[0])
    if len(names) == 2:
        rows, columns = ([*dict.fromkeys(_number(item[name]) for item in settings)] for name in names)
        place = {
            number: (rows.index(_number(item[names[0]])), columns.index(_number(item[names[1]])))
            for number, item in enumerate(settings)
        }
        table = _table(people, (len(rows), len(columns)), lambda person: place[person["setting"]], margin)
        words = names
    else:
        ordered = sorted(people, key=lambda person: (person["stature_m"] or 0.0, person["mass_kg"] or 0.0))
        bodies = list(dict.fromkeys(person["body"] for person in ordered))
        columns = [setting_words(item) if len(names) > 1 else _number(item[names[0]]) for item in settings]
        rank = {name: number for number, name in enumerate(bodies)}
        table = _table(
            people, (len(bodies), len(columns)), lambda person: (rank[person["body"]], person["setting"]),
            margin,
        )  # fmt: skip
        rows, words = bodies, ["bodies by stature", ", ".join(names)]
    return _draw_table(table, rows, columns, words, margin)


def _table(
    people: Sequence[Mapping[str, Any]], shape: tuple[int, int], place: Any, margin: str | None
) -> Any:
    """Mean of what is drawn in each cell, NaN where nothing is known."""
    total, count = np.zeros(shape), np.zeros(shape)
    for person in people:
        value = person[margin] if margin else {"can": 1.0, "cannot": 0.0}.get(person["verdict"])
        if value is not None and (margin is None or person["verdict"] == "can"):
            total[place(person)] += value
            count[place(person)] += 1.0
    return np.divide(total, count, out=np.full(shape, np.nan), where=count > 0)


def _draw_table(
    table: FloatArray, rows: Sequence[str], columns: Sequence[str], words: Sequence[str], margin: str | None
) -> Figure:
    named = len(rows) <= _MOST_NAMES
    left = 0.85 + (0.07 * max(map(len, rows)) if named else 0.0)
    height = 1.6 + (0.24 * len(rows) if named else 6.0)
    width = left + max(3.0, min(0.7 * len(columns), 12.0)) + 1.3
    title = "Share who can" if margin is None else MARGINS[margin][0].upper() + MARGINS[margin][1:]
    figure, grid = new_grid(width, height, title, 1, 1, left=left, right=1.1, top=0.55, bottom=0.65)
    axes = figure.add_subplot(grid[0, 0])
    look: dict[str, Any] = (
        {"cmap": _SHARE, "vmin": 0.0, "vmax": 1.0} if margin is None else {"cmap": _colours(margin)}
    )
    axes.set_facecolor(COLOURS["shade"])
    image = axes.imshow(np.ma.masked_invalid(table), aspect="auto", origin="lower", **look)
    dress(axes, words[0], words[1])
    axes.grid(False)
    axes.set_xticks(np.arange(len(columns) - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) - 1) + 0.5 if named else [], minor=True)
    axes.grid(True, which="minor", color="white", linewidth=1.5)
    axes.tick_params(which="minor", length=0)
    axes.set_xticks(range(len(columns)), columns, fontsize=8)
    axes.set_yticks(range(len(rows)) if named else [], rows if named else [], fontsize=8)
    if len(columns) > 8 or max(map(len, columns)) > 8:
        axes.tick_params(axis="x", labelrotation=45)
    bar = figure.add_axes((1.0 - 0.85 / width, 0.65 / height, 0.14 / width, 1.0 - 1.2 / height))
    figure.colorbar(image, cax=bar).ax.tick_params(labelsize=8)
    grey = "grey: undecided" if margin is None else "grey: nobody who can"
    figure.text(1.0 - 0.1 / width, 0.1 / height, grey, fontsize=8, color=COLOURS["soft"], ha="right")
    return figure
