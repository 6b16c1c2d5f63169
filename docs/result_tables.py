"""Tables of many runs for the documentation, in Markdown, and what is kept of a report to make them.

A report is what ``manikin run all --json`` printed. It says with which stature and seed it was asked for; one
without either is the main report.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from manikin.reports.summary_table import HEADER, NOTHING, UNITS, number, result, result_rows

BEAM = "beam-"
"""First letters of the scenarios of the table of beams."""

_EXACT = (("centroidal", "min_margin"), ("wholebody", "min_margin"), ("execution", "min_margin"))
"""What has to be the same to the last bit for two runs to count as the same."""

Report = Mapping[str, Any]


def beam_table(report: Report, published: Mapping[str, Any]) -> str:
    """Lowest CoM and clearance of the head of every passage that succeeded, beside the published heights.

    Args:
        report: The main report, or :func:`reduced`.
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


def stature_table(reports: Iterable[Report]) -> str:
    """Result and executed margin of every run of a body with a stature; the reports have theirs."""
    heads = ["scenario", "variant", "stature [m]", "mass [kg]", "result", "executed margin [N.m]"]
    rows = [
        [
            _scenario(run), run["variant"] or NOTHING, number(report["stature_m"], 2),
            number(run["mass_kg"], 0), result(run), number((run["execution"] or {}).get("min_margin"), 1),
        ]
        for report in reports
        for run in report["runs"]
        if run["stature_m"] is not None or run["seed"] is None  # a run that broke off knows neither
    ]  # fmt: skip
    return markdown_rows(heads, sorted(rows, key=lambda row: (row[0], row[1] != NOTHING, row[1], row[2])))


def seed_record(report: Report) -> dict[str, list[Any]]:
    """What the table of seeds needs of one report: per run whether it was as expected, and exact margins.

    Returns:
        By ``NAME`` or ``NAME@VARIANT``: whether it ended as expected, the three margins (None
        where a stage did not run), the reason of a failure, and whether a random number was drawn.
    """
    return {
        _name(run): [
            run["as_expected"],
            *((run[stage] or {}).get(key) for stage, key in _EXACT),
            None if run["failure"] is None else run["failure"]["reason"],
            (run["wholebody"] or {}).get("seed_matters"),
        ]
        for run in report["runs"]
    }


def seed_table(records: Mapping[str, Mapping[str, Sequence[Any]]]) -> str:
    """How many seeds ended as expected, and how many different results they gave.

    Seeds that give the same bits are one result: only different ones are evidence.

    Args:
        records: :func:`seed_record` by seed.
    """
    heads = [
        "scenario", "variant", "as expected", "random", "different results", "executed margin [N.m]",
    ]  # fmt: skip
    names = dict.fromkeys(name for record in records.values() for name in record)
    found = {name: [record[name] for record in records.values() if name in record] for name in names}
    return markdown_rows(heads, [_seed_row(name, entries) for name, entries in found.items()])


def _seed_row(name: str, entries: Sequence[Sequence[Any]]) -> list[str]:
    scenario, _, variant = name.partition("@")
    margins = [entry[3] for entry in entries if entry[3] is not None]
    ends = sorted({number(margin, 1) for margin in margins}, key=float)
    different = {tuple(entry[:-1]) for entry in entries}
    return [
        scenario,
        variant or NOTHING,
        f"{sum(bool(entry[0]) for entry in entries)} of {len(entries)} seeds",
        "yes" if any(entry[-1] for entry in entries) else "no",
        str(len(different)),
        " to ".join([ends[0], ends[-1]] if len(ends) > 1 else ends) or NOTHING,
    ]


def filed(kept: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """The kept results with one more report in its place, which it replaces.

    Args:
        kept: ``main``: the reduced main report; ``statures``: reduced reports by stature; ``seeds``:
            :func:`seed_record` by seed.  Keys may be missing.
        report: With ``stature_m`` and ``seed``: None, or what it was asked for.

    Returns:
        The same with the report added; the main one counts as the seed that all its runs had, if any.
    """
    changed = {"main": None, "statures": {}, "seeds": {}, **kept}
    stature, seed = report.get("stature_m"), report.get("seed")
    if stature is not None:
        return changed | {"statures": _ordered({**changed["statures"], f"{stature:g}": reduced(report)})}
    own = {run.get("seed") for run in report["runs"]} - {None}
    if seed is None:
        changed["main"] = reduced(report)
        seed = own.pop() if len(own) == 1 else None
    if seed is not None:
        changed["seeds"] = _ordered({**changed["seeds"], str(seed): seed_record(report)})
    return changed


def _ordered(entries: Mapping[str, Any]) -> dict[str, Any]:
    return dict(sorted(entries.items(), key=lambda item: float(item[0])))


def _scenario(run: Mapping[str, Any]) -> str:
    return str(run["scenario"]).partition("@")[0]


def _name(run: Mapping[str, Any]) -> str:
    return _scenario(run) if run["variant"] is None else f"{_scenario(run)}@{run['variant']}"


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
