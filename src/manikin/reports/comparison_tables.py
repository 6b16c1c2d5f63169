"""A comparison as tables for the terminal."""

from rich.console import Console, Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from manikin.reports.alignment import PhaseTime
from manikin.reports.comparison import RunComparison, com_difference, margin_difference, shared_tracks
from manikin.runtime.display import readable


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
    first, second = ((f"{name} phase", "start", "end", "duration") for name in comparison.names)
    table = _table("Timing [s]", "supports", *first, *second, "difference")
    for row in comparison.rows:
        held = ", ".join(map(readable, row.supports)) or "flight"
        gap = _number(row.duration_difference_s, "+z.3f")
        table.add_row(held, *_phase(row.first), *_phase(row.second), gap)
    one, other = comparison.durations
    gap = None if one is None or other is None else other - one
    table.add_section()
    cells = "", "", "", _number(one, ".3f"), "", "", "", _number(other, ".3f"), _number(gap, "+z.3f")
    table.add_row("whole motion", *cells)
    return table


def _com_table(comparison: RunComparison) -> Table:
    headings = "stage", "RMS distance", "largest", "at [s]", "mean difference x", "y", "z"
    table = _table("Centre of mass at equal shares of the matched phases [m]", *headings)
    for stage, tracks in shared_tracks(*comparison.runs).items():
        if (result := com_difference(comparison.rows, *tracks)) is not None:
            when = f"{result['max_at_first_s']:.2f} / {result['max_at_second_s']:.2f}"
            distances = f"{result['rms_distance_m']:.4f}", f"{result['max_distance_m']:.4f}", when
            table.add_row(stage, *distances, *(f"{value:+z.4f}" for value in result["mean_difference_m"]))
    return table


def _margin_table(comparison: RunComparison) -> Table:
    shared = shared_tracks(*comparison.runs)
    result = [margin_difference(comparison.rows, *tracks) for tracks in shared.values()]
    headings = []
    for stage, margins in zip(shared, result, strict=True):
        unit = margins["unit"] or f"{margins['first_unit']} / {margins['second_unit']}"
        headings.append(f"{stage} [{unit}]")
    title = f"Smallest margins: {comparison.names[0]} / {comparison.names[1]} (difference)"
    table = _table(title, "phase", *headings)
    for number, row in enumerate(comparison.rows):
        phases = [margins["phases"][number] for margins in result]
        cells = [_pair(item["first"], item["second"], item["difference"]) for item in phases]
        one, other = ("-" if phase is None else str(phase.phase) for phase in (row.first, row.second))
        table.add_row(one if one == other else f"{one} / {other}", *cells)
    table.add_section()
    least = (_pair(item["min_first"], item["min_second"], item["min_difference"]) for item in result)
    table.add_row("whole motion", *least)
    return table


def _pair(first: float | None, second: float | None, difference: float | None) -> str:
    return f"{_number(first, '.1f')} / {_number(second, '.1f')} ({_number(difference, '+z.1f')})"


def _posture_table(comparison: RunComparison) -> Table:
    first, second = comparison.names
    title = f"Postures at the key instants, {comparison.postures_of} [deg]"
    last = "largest differences, second less first"
    table = _table(title, f"{first} at [s]", f"{second} at [s]", "RMS", last, words=3)
    for posture in comparison.postures:
        joints = [joint for joint in posture.largest[:3] if joint.difference_deg != 0.0]
        text = ", ".join(f"{readable(j.joint)} {j.difference_deg:+z.1f}" for j in joints)
        numbers = posture.first_s, posture.second_s, posture.rms_deg
        table.add_row(*(f"{number:.2f}" for number in numbers), text or "none")
    return table


def _table(title: str, *headings: str, words: int = 0) -> Table:
    """A table of numbers, aligned to the right, but for the column of ``words``."""
    table = Table(title=escape(title), title_justify="left", title_style="bold", header_style="")
    for number, heading in enumerate(headings):
        table.add_column(escape(heading), justify="left" if number == words else "right")
    return table


def _phase(phase: PhaseTime | None) -> tuple[str, str, str, str]:
    if phase is None:
        return "-", "-", "-", "-"
    return str(phase.phase), f"{phase.start_s:.3f}", f"{phase.end_s:.3f}", f"{phase.duration_s:.3f}"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
