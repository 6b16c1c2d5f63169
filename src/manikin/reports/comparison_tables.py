"""A comparison as tables for the terminal."""

from rich.console import Console, Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from manikin.reports.alignment import PhaseTime
from manikin.reports.comparison import (
    RunComparison,
    com_difference,
    margin_difference,
    shared_tracks,
)


def report(comparison: RunComparison) -> Group:
    """Timing, CoM, margins and postures as tables, then what could not be compared.

    Print it with a :class:`rich.console.Console`.
    """
    parts: list[RenderableType] = []
    if comparison.rows:
        parts.append(_timing_table(comparison))
    if comparison.rows and shared_tracks(*comparison.runs):
        parts += [_com_table(comparison), _margin_table(comparison)]
    if comparison.postures:
        parts.append(_posture_table(comparison))
    parts += [Text(f"not compared: {line}") for line in comparison.unmatched]
    return Group(*parts)


def report_console() -> Console:
    """Console on standard output; elsewhere than on a terminal lines are not cut at 80 columns."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=160)


def _timing_table(comparison: RunComparison) -> Table:
    first, second = comparison.names
    table = _table("Timing [s]")
    for heading in ("supports", f"{first} phase", "start", "end", "duration"):
        table.add_column(heading, justify="left" if heading == "supports" else "right")
    for heading in (f"{second} phase", "start", "end", "duration", "difference"):
        table.add_column(heading, justify="right")
    for row in comparison.rows:
        difference = row.duration_difference_s
        table.add_row(
            ", ".join(name.replace("_", " ") for name in row.supports) or "flight",
            *_phase(row.first), *_phase(row.second), _number(difference, "+z.3f"),
        )  # fmt: skip
    total = [comparison.durations[0], comparison.durations[1]]
    gap = None if total[0] is None or total[1] is None else total[1] - total[0]
    table.add_section()
    table.add_row("whole motion", "", "", "", _number(total[0], ".3f"), "", "", "", _number(total[1], ".3f"),
                  _number(gap, "+z.3f"))  # fmt: skip
    return table


def _com_table(comparison: RunComparison) -> Table:
    table = _table("Centre of mass at equal shares of the matched phases [m]")
    for heading in ("stage", "RMS distance", "largest", "at [s]", "mean difference x", "y", "z"):
        table.add_column(escape(heading), justify="left" if heading == "stage" else "right")
    for stage, tracks in shared_tracks(*comparison.runs).items():
        result = com_difference(comparison.rows, *tracks)
        if result is None:
            continue
        table.add_row(
            stage, f"{result['rms_distance_m']:.4f}", f"{result['max_distance_m']:.4f}",
            f"{result['max_at_first_s']:.2f} / {result['max_at_second_s']:.2f}",
            *(f"{value:+z.4f}" for value in result["mean_difference_m"]),
        )  # fmt: skip
    return table


def _margin_table(comparison: RunComparison) -> Table:
    table = _table(f"Smallest margins: {comparison.names[0]} / {comparison.names[1]} (difference)")
    shared = shared_tracks(*comparison.runs)
    result = [margin_difference(comparison.rows, *tracks) for tracks in shared.values()]
    table.add_column("phase")
    for stage, margins in zip(shared, result, strict=True):
        unit = margins["unit"] or f"{margins['first_unit']} / {margins['second_unit']}"
        table.add_column(escape(f"{stage} [{unit}]"), justify="right")
    for number, row in enumerate(comparison.rows):
        phases = [margins["phases"][number] for margins in result]
        cells = [_pair(item["first"], item["second"], item["difference"]) for item in phases]
        table.add_row(_phases(row.first, row.second), *cells)
    table.add_section()
    table.add_row(
        "whole motion", *(_pair(m["min_first"], m["min_second"], m["min_difference"]) for m in result)
    )
    return table


def _pair(first: float | None, second: float | None, difference: float | None) -> str:
    return f"{_number(first, '.1f')} / {_number(second, '.1f')} ({_number(difference, '+z.1f')})"


def _posture_table(comparison: RunComparison) -> Table:
    first, second = comparison.names
    table = _table(f"Postures at the key instants, {comparison.postures_of} [deg]")
    table.add_column(escape(f"{first} at [s]"), justify="right")
    table.add_column(escape(f"{second} at [s]"), justify="right")
    table.add_column("RMS", justify="right")
    table.add_column("largest differences, second less first")
    for posture in comparison.postures:
        joints = [joint for joint in posture.largest[:3] if joint.difference_deg != 0.0]
        text = ", ".join(f"{j.joint.replace('_', ' ')} {j.difference_deg:+z.1f}" for j in joints)
        table.add_row(
            f"{posture.first_s:.2f}", f"{posture.second_s:.2f}", f"{posture.rms_deg:.2f}", text or "none"
        )
    return table


def _table(title: str) -> Table:
    return Table(title=escape(title), title_justify="left", title_style="bold", header_style="")


def _phase(phase: PhaseTime | None) -> tuple[str, str, str, str]:
    if phase is None:
        return "-", "-", "-", "-"
    return str(phase.index), f"{phase.start_s:.3f}", f"{phase.end_s:.3f}", f"{phase.duration_s:.3f}"


def _phases(first: PhaseTime | None, second: PhaseTime | None) -> str:
    item, other = ("-" if phase is None else str(phase.index) for phase in (first, second))
    return item if item == other else f"{item} / {other}"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
