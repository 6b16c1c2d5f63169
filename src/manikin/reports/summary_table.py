"""One table of many runs, and the verdict of each in words."""

from collections.abc import Mapping
from typing import Any

HEADER = (
    "scenario", "variant", "duration", "planned margin", "bound", "clearance", "executed margin",
    "force at the CoM", "ZMP to the edge", "CoM rms", "fell", "wall", "planned", "proved", "result",
)  # fmt: skip
"""Columns of the table."""

UNITS = ("", "", "s", "", "N.m", "mm", "N.m", "N", "mm", "mm", "", "s + s + s", "", "", "")
"""Units of the columns; the planned margin brings its own."""

NOTHING = "-"
"""Stands for a value that a run does not have."""

STAGES = ("centroidal", "wholebody", "execution")
"""Stages whose numbers the table shows."""

_YES_OR_NO = {True: "yes", False: "no", None: NOTHING}


def result_rows(report: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """One row of texts per run, under :data:`HEADER`.

    Args:
        report: As :func:`manikin.pipeline.batch.run_jobs` returns it.
    """
    return [_row(run) for run in report["runs"]]


def text_table(report: Mapping[str, Any]) -> str:
    """The table in columns of equal width."""
    rows = [HEADER, UNITS, *result_rows(report)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADER) - 1)]
    lines = [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row[:-1], widths, strict=True)), row[-1]])
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


def _row(run: Mapping[str, Any]) -> tuple[str, ...]:
    com, body, executed = (run[stage] or {} for stage in STAGES)
    unit = f" {com.get('margin_unit', '')}"
    if not com:  # a motion that was refined without a planned centre of mass
        com, unit = body, " N.m"
    walls = [block.get("wall_s") for block in (run["centroidal"] or {}, body, executed)]
    return (
        str(run["scenario"]).partition("@")[0],
        run["variant"] or NOTHING,
        number(com.get("duration_s"), 2),
        number(com.get("min_margin"), 1, unit),
        number(com.get("feasibility_radius"), 1),
        number(body.get("min_clearance_m"), 1, scale=1000.0),
        number(executed.get("min_margin"), 1),
        number(executed.get("min_force_at_com_N"), 0),
        number(executed.get("min_zmp_distance_m"), 0, scale=1000.0),
        number(executed.get("com_rms_error_m"), 2, scale=1000.0),
        _YES_OR_NO[executed.get("fell")],
        " + ".join(number(wall, 1) for wall in walls if wall is not None) or NOTHING,
        *(_YES_OR_NO[run[key]] for key in ("planned", "proved")),
        result(run),
    )


def result(run: Mapping[str, Any]) -> str:
    """How a run ended, in words."""
    if run["failure"] is None:
        return f"{run['verdict']}{'' if run['as_expected'] else ' although a failure was expected'}"
    word = "failed as expected" if run["as_expected"] else "FAILED"
    return f"{word} ({run['failure']['stage']}): {run['failure']['reason']}"


def verdict_line(summary: Mapping[str, Any]) -> str:
    """Verdict of a run with its scenario, and for a failure the reason first.

    Args:
        summary: Of a run.
    """
    failure = summary["failure"]
    if failure is None:
        words = {
            "proved": "executed in the physics engine, every requirement kept",
            "planned": "not executed, every requirement of the plan kept",
        }
        return f"{summary['verdict']}: {summary['scenario']}, {words[summary['verdict']]}"
    after = ", after a plan that kept every requirement" if summary["planned"] else ""
    return f"failed: {failure['reason']} ({summary['scenario']}, {failure['stage']}{after})"


def counts_line(report: Mapping[str, Any]) -> str:
    """How many of many runs were planned, proved and fell, and ended as their scenarios say."""
    words = (
        f"{len(report['runs'])} runs: {report['planned']} planned, {report['proved']} proved",
        f"{report['succeeded']} succeeded, {report['failed']} failed ({report['fell']} fell)",
        f"{report['as_expected']} as expected, {report['not_as_expected']} not",
        f"{report['wall_s']:.0f} s",
    )
    return "; ".join(words)


def number(value: float | None, digits: int, unit: str = "", scale: float = 1.0) -> str:
    """A value with a number of decimals, or :data:`NOTHING`."""
    return NOTHING if value is None else f"{scale * value:.{digits}f}{unit}"
