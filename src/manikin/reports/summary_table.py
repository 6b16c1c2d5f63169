"""Results of runs in words: the verdict and requirements of one, tables of many and of benchmarks."""

from collections.abc import Container, Iterator, Mapping, Sequence
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
_YES_OR_NO = {True: "yes", False: "no", None: NOTHING}


def result_rows(report: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """One row of texts per run of :func:`manikin.pipeline.batch.run_jobs`, under :data:`HEADER`."""
    return [_row(run) for run in report["runs"]]


def text_table(report: Mapping[str, Any]) -> str:
    """The table in columns of equal width."""
    return columns([HEADER, UNITS, *result_rows(report)])


def columns(rows: Sequence[Sequence[str]], right: Container[int] = ()) -> str:
    """Rows in columns of equal width, some of them by their numbers aligned to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    forms = [f"{'>' if number in right else '<'}{width}" for number, width in enumerate(widths)]
    return "\n".join("  ".join(map(format, row, forms)).rstrip() for row in rows)


def _row(run: Mapping[str, Any]) -> tuple[str, ...]:
    com, body, executed = (run[stage] or {} for stage in ("centroidal", "wholebody", "execution"))
    unit = f" {com.get('margin_unit', '')}"
    if not com:  # a motion that was refined without a planned centre of mass
        com, unit = body, " N.m"
    walls = [block.get("wall_s") for block in (run["centroidal"] or {}, body, executed)]
    return (
        str(run["scenario"]).partition("@")[0], run["variant"] or NOTHING, number(com.get("duration_s"), 2),
        number(com.get("min_margin"), 1, unit), number(com.get("feasibility_radius"), 1),
        number(body.get("min_clearance_m"), 1, scale=1000.0), number(executed.get("min_margin"), 1),
        number(executed.get("min_force_at_com_N"), 0),
        number(executed.get("min_zmp_distance_m"), 0, scale=1000.0),
        number(executed.get("com_rms_error_m"), 2, scale=1000.0), _YES_OR_NO[executed.get("fell")],
        " + ".join(number(wall, 1) for wall in walls if wall is not None) or NOTHING,
        *(_YES_OR_NO[run[key]] for key in ("planned", "proved")), result(run),
    )  # fmt: skip


def result(run: Mapping[str, Any]) -> str:
    """Outcome of a run in words."""
    if run["failure"] is None:
        return f"{run['verdict']}{'' if run['as_expected'] else ' although a failure was expected'}"
    word = "failed as expected" if run["as_expected"] else "FAILED"
    return f"{word} ({run['failure']['stage']}): {run['failure']['reason']}"


def verdict_line(summary: Mapping[str, Any]) -> str:
    """Verdict of a run with its scenario, and for a failure the reason first."""
    failure = summary["failure"]
    if failure is None:
        words = {
            "proved": "executed in the physics engine, every requirement kept",
            "planned": "not executed, every requirement of the plan kept",
        }
        return f"{summary['verdict']}: {summary['scenario']}, {words[summary['verdict']]}"
    after = ", after a plan that kept every requirement" if summary["planned"] else ""
    return f"failed: {failure['reason']} ({summary['scenario']}, {failure['stage']}{after})"


HEADINGS = {
    "contacts": "planned contacts", "walk": "planned walk", "centroidal": "planned centre of mass",
    "wholebody": "planned whole body", "act": "planned act", "act execution": "executed act",
    "execution": "executed in the physics engine", "push": "executed in the physics engine",
}  # fmt: skip
"""Headings of the requirements of each stage."""

YES_OR_NO = {"fell": ("no", "yes"), "at_rest": ("no", "yes")}
"""Words of 0 and 1 for requirements that are no quantity."""


def verdict_lines(summary: Mapping[str, Any]) -> list[str]:
    """Verdict of a run in one line, then every requirement; broken ones are marked."""
    lines = [verdict_line(summary), about_line(summary), *requirement_lines(summary["requirements"])]
    return lines if (trials := summary.get("trials")) is None else [*lines, trials_line(trials)]


def trials_line(trials: Mapping[str, Any]) -> str:
    """Shares of the worlds in which the body stood and arrived, and what failed first in the others."""
    shares = f"stood in {trials['stood_share']:.0%}, arrived in {trials['arrived_share']:.0%}"
    failures = "".join(f"; {count} x {what}" for what, count in trials["first_failures"].items())
    return f"trials: {trials['worlds']} other worlds, {shares}{failures}"


def requirement_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Every requirement in a line, those of a stage below its heading; broken ones are marked."""
    names = [f"{row['name']} ({row['where']})" if row["where"] else str(row["name"]) for row in rows]
    width = max(map(len, names), default=0)
    heading = ""
    for name, row in zip(names, rows, strict=True):
        if HEADINGS[row["stage"]] != heading:
            heading = HEADINGS[row["stage"]]
            yield f"{heading}:"
        measured, allowed = requirement_values(row)
        mark = "ok    " if row["held"] else "FAILED"
        time = "" if row["time_s"] is None else f"at {row['time_s']:.2f} s"
        yield f"  {mark}  {name:{width}}  {measured:>14}  {allowed:<14}  {time}".rstrip()


def about_line(summary: Mapping[str, Any]) -> str:
    """Body, duration of the motion, and computing time."""
    stature, mass = summary["stature_m"], summary["mass_kg"]
    who = f"body of {mass:g} kg" if stature is None else f"person of {stature:g} m and {mass:g} kg"
    known = [summary[stage] or {} for stage in ("wholebody", "centroidal")]
    planned = next((block["duration_s"] for block in known if block.get("duration_s")), 0.0)
    duration = planned + (summary["walk"] or {}).get("motion_s", 0.0)
    lasts = f", motion of {duration:.2f} s" if duration else ""
    return f"{who}{lasts}, computed in {summary['wall_s']:.1f} s, seed {summary['seed']}"


def requirement_values(row: Mapping[str, Any]) -> tuple[str, str]:
    """Measured and allowed value of a requirement, as texts."""
    if row["key"] in YES_OR_NO:
        words = YES_OR_NO[row["key"]]
        return words[round(row["measured"])], words[round(row["limit"])]
    unit = f" {row['unit']}" if row["unit"] else ""
    measured = "-" if row["measured"] is None else f"{row['measured']:.3g}{unit}"
    return measured, f"{row['sense']} {row['limit']:.3g}{unit}"


def counts_line(report: Mapping[str, Any]) -> str:
    """Numbers of runs that were planned, proved, fell, and ended as their scenarios say."""
    return (
        f"{len(report['runs'])} runs: {report['planned']} planned, {report['proved']} proved; "
        f"{report['succeeded']} succeeded, {report['failed']} failed ({report['fell']} fell); "
        f"{report['as_expected']} as expected, {report['not_as_expected']} not; {report['wall_s']:.0f} s"
    )


def number(value: float | None, digits: int, unit: str = "", scale: float = 1.0) -> str:
    """A value with a number of decimals, or :data:`NOTHING`."""
    return NOTHING if value is None else f"{scale * value:.{digits}f}{unit}"


FAMILY_HEADER = (
    "family", "tasks", "contacts", "certified", "planned", "proved", "contacts [s]: median", "95 %",
    "motion [s]", "computing / motion", "failures by stage",
)  # fmt: skip
"""Columns of the table; times are processor time, of motions the median."""


def family_rows(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """One row of texts for each family under :data:`FAMILY_HEADER`, all of them together last."""
    whole, rows = result["stage"] == "all", []
    for name, counts in [*result["families"].items(), ("all", result["total"])]:
        found = (number(counts[key], 0) for key in ("tasks", "contacts", "checked"))
        ended = (number(counts[key] if whole else None, 0) for key in ("planned", "proved"))
        times = (number(counts["contacts_s"][key], 2) for key in ("median", "p95"))
        motions = (number(counts[key], 1) for key in ("duration_s", "computing_over_motion"))
        failed = ", ".join(f"{stage} {count}" for stage, count in counts["failures"].items()) or NOTHING
        rows.append((name, *found, *ended, *times, *motions, failed))
    return rows


def family_table(result: Mapping[str, Any]) -> str:
    """The table in columns of equal width."""
    return columns([FAMILY_HEADER, *family_rows(result)], right=range(1, len(FAMILY_HEADER) - 1))


def failure_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Every task that failed with its stage and reason, and every one whose contacts the check refuses."""
    for entry in result["tasks"]:
        name, checked, failure = f"{entry['family']}-{entry['seed']}", entry["checked"], entry["failure"]
        if checked is not None and not checked["certified"]:
            yield f"{name} (check): {checked['verdict']}"
        if failure is not None:
            yield f"{name} ({failure['stage']}): {failure['reason']}"


def group_table(result: Mapping[str, Any]) -> str:
    """Groups of a study with their shares and intervals, in columns of equal width."""
    swept = list(result["settings"][0])
    percent = f"{100.0 * result['confidence']:g} % interval"
    rows: list[tuple[str, ...]] = [
        ("group", *swept, "people", "can", "cannot", "undecided", "share", percent)
    ]
    for group in result["groups"]:
        values = (str(result["settings"][group["setting"]][name]) for name in swept)
        counts = (str(group[key]) for key in ("people", "can", "cannot", "undecided"))
        share, interval = number(group["share"], 1, " %", 100.0), NOTHING
        if group["interval"] is not None:
            interval = " to ".join(number(value, 1, " %", 100.0) for value in group["interval"])
        rows.append((group["group"], *values, *counts, share, interval))
    return columns(rows, right=range(1, len(rows[0])))


def person_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Everybody of a study who cannot, or is undecided, with the reason."""
    for person in result["people"]:
        if person["verdict"] != "can":
            values = result["settings"][person["setting"]]
            at = "".join(f", {name} {value}" for name, value in values.items())
            yield f"{person['body']}{at} {person['verdict']} ({person['stage']}): {person['reason']}"
