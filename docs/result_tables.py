"""Tables of many runs for the documentation, in Markdown, and what is kept of a report to make them.

A report is what ``manikin run all --json`` printed.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from manikin.reports.summary_table import HEADER, NOTHING, UNITS, number, result_rows

BEAM = "beam-"
"""First letters of the scenarios of the table of beams."""

Report = Mapping[str, Any]


def beam_table(report: Report, published: Mapping[str, Any]) -> str:
    """Lowest CoM and clearance of the head of every passage that succeeded, beside the published heights.

    Args:
        report: A report, or :func:`reduced`.
        published: ``lowest_com_m`` and ``beam_height_m`` of ``H1`` to ``H3`` [m].
    """
    heads = [
        "scenario", "variant", "beam [m]", "people: lowest CoM [m]", "planned: lowest CoM [m]",
        "executed: lowest CoM [m]", "planned: head clearance [mm]", "executed: head clearance [mm]",
    ]  # fmt: skip
    rows = [
        _beam_row(run, published)
        for run in report["runs"]
        if str(run["scenario"]).startswith(BEAM) and run["expected"] == "success"
    ]
    return markdown_rows(heads, rows)


def _beam_row(run: Mapping[str, Any], published: Mapping[str, Any]) -> list[str]:
    name = _scenario(run)
    height = name.removeprefix(BEAM)[:2]
    planned, executed = run["wholebody"] or {}, run["execution"] or {}
    return [
        name,
        run["variant"] or NOTHING,
        number(published["beam_height_m"].get(height), 2),
        number(published["lowest_com_m"].get(height), 2),
        *(number(block.get("lowest_com_m"), 2) for block in (planned, executed)),
        *(number(block.get("head_clearance_m"), 1, scale=1000.0) for block in (planned, executed)),
    ]


def _scenario(run: Mapping[str, Any]) -> str:
    return str(run["scenario"]).partition("@")[0]


ASKED = ("stature_m", "seed")
"""What a report says that its runs were asked for, None for each scenario's own."""

COUNTS = ("planned", "proved", "succeeded", "failed", "fell", "as_expected", "not_as_expected")
"""Numbers of runs in a report."""

_RUN_WITH = ("stature_m", "mass_kg", "seed")
"""What a run says that it was run with."""

_KEPT: dict[str, tuple[str, ...]] = {
    "centroidal": (
        "duration_s",
        "min_margin",
        "margin_unit",
        "min_force_at_com_N",
        "min_zmp_distance_m",
        "feasibility_radius",
        "wall_s",
    ),
    "wholebody": (
        "duration_s",
        "min_margin",
        "min_force_at_com_N",
        "min_zmp_distance_m",
        "min_clearance_m",
        "lowest_com_m",
        "head_clearance_m",
        "wall_s",
    ),
    "execution": (
        "min_margin",
        "min_force_at_com_N",
        "min_zmp_distance_m",
        "com_rms_error_m",
        "lowest_com_m",
        "head_clearance_m",
        "fell",
        "wall_s",
    ),
}
"""Keys of a run's summary that the tables show."""


def markdown_table(report: Mapping[str, Any]) -> str:
    """The table in Markdown."""
    heads = [f"{name} [{unit}]" if unit else name for name, unit in zip(HEADER, UNITS, strict=True)]
    return markdown_rows(heads, result_rows(report))


def markdown_rows(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown of any columns."""
    lines = [_markdown_row(heads), _markdown_row(["---"] * len(heads))]
    return "\n".join([*lines, *(_markdown_row(row) for row in rows)]) + "\n"


def reduced(report: Mapping[str, Any]) -> dict[str, Any]:
    """What the tables show of a report and no more, rounded to four digits."""
    return {
        **{key: report.get(key) for key in ASKED},
        "runs": [_reduced_run(run) for run in report["runs"]],
        **{key: report[key] for key in COUNTS}, "wall_s": _rounded(report["wall_s"]),
    }  # fmt: skip


def _reduced_run(run: Mapping[str, Any]) -> dict[str, Any]:
    names = (
        "scenario", "variant", "expected", "as_expected", "verdict", "planned", "proved", "succeeded",
    )  # fmt: skip
    failure = run["failure"]
    kept: dict[str, Any] = {name: run[name] for name in names} | {name: run.get(name) for name in _RUN_WITH}
    kept["failure"] = None if failure is None else {key: failure[key] for key in ("stage", "reason")}
    for stage, keys in _KEPT.items():
        block = run[stage]
        kept[stage] = None if block is None else {key: _rounded(block[key]) for key in keys if key in block}
    return {**kept, "wall_s": _rounded(run["wall_s"])}


def rounded_values(value: Any) -> Any:
    """Plain values with four significant digits each."""
    if isinstance(value, Mapping):
        return {key: rounded_values(item) for key, item in value.items()}
    return _rounded(value)


def _rounded(value: Any) -> Any:
    """Four significant digits, so that what changes in a file has changed in the world."""
    if not isinstance(value, float) or not math.isfinite(value) or value == 0.0:
        return value
    return round(value, 3 - math.floor(math.log10(abs(value))))


def _markdown_row(cells: Sequence[str]) -> str:
    escaped = (" ".join(cell.split()).replace("|", "\\|") for cell in cells)
    return f"| {' | '.join(escaped)} |"
