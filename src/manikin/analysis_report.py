"""The report of a measured recording, and the overview of several, as pages for people."""

from collections.abc import Mapping, Sequence
from typing import Any

from manikin.analysis import Analysis
from manikin.figures.style import readable
from manikin.report_page import ReportPage
from manikin.version import __version__

WORDS = (
    "Times are seconds from the first frame of the recording's clock. The margin is the distance of the "
    "wrench that the motion needs to the faces of what the contacts can give (Qiu 2012, 4.2.9), moments "
    "about the middle of the contacts, alpha = 1 m: below 0 the contacts, as they were found, could not "
    "give it. Recordings tell places to a centimetre and so leave accelerations open: the shift onto the "
    "contacts is the least one of the whole body after which the contacts could."
)
STRONGEST_SHOWN = 8
"""Joints in the table of torques, those first that come nearest to their strength."""


def report_page(found: Analysis, summary: Mapping[str, Any], pictures: Mapping[str, bytes]) -> str:
    """HTML of one recording.

    Args:
        found: What was measured.
        summary: Its numbers.
        pictures: Contents of PNG files by what they show: the sheet of the recording, then those of a plan.
    """
    page = ReportPage(found.name, f"{summary['file']}, measured by manikin {__version__}")
    page.remarks(summary["remarks"])
    page.numbers(_headline(summary))
    sheet, *others = [*pictures.items(), ("", b"")]
    if sheet[1]:
        page.picture(sheet[1], sheet[0])
    page.text(WORDS)
    page.heading("Supports")
    page.table(
        ("effector", "from [s]", "to [s]", "duration [s]", "place x, y, z [m]"),
        [
            (readable(one["effector"]), _time(one["start_s"], one["start_seen"]),
             _time(one["end_s"], one["end_seen"]), one["end_s"] - one["start_s"], tuple(one["place_m"]))
            for one in summary["supports"]
        ],
    )  # fmt: skip
    page.heading("Phases")
    page.table(
        ("phase", "from [s]", "to [s]", "duration [s]", "lowest margin [N.m]", "supports"),
        [
            (number, one["start_s"], one["end_s"], one["end_s"] - one["start_s"], one["margin_min_Nm"],
             ", ".join(map(readable, one["effectors"])) or "flight")
            for number, one in enumerate(summary["phases"])
        ],
    )  # fmt: skip
    if summary["segments"]:
        page.heading("Walking: where people look is where they go (nonholonomic), or not (holonomic)")
        page.table(
            ("kind", "from [s]", "to [s]"),
            [(one["kind"], one["start_s"], one["end_s"]) for one in summary["segments"]],
        )
    _torques(page, summary)
    _ergonomics(page, summary)
    if summary["force_plates"] is not None:
        page.heading("Against force plates")
        page.numbers(summary["force_plates"])
    if summary["plan"] is not None:
        _plan(page, summary["plan"])
        for words, picture in others:
            if picture:
                page.picture(picture, words)
    return page.html()


def overview_page(
    rows: Sequence[Mapping[str, Any]], overview: Mapping[str, Any], links: Mapping[str, str]
) -> str:
    """HTML of several recordings.

    Args:
        rows: One for each, all with the same keys.
        overview: Of all of them.
        links: Addresses of their reports, by file.
    """
    page = ReportPage(
        "Recordings",
        f"{len(overview['files'])} measured, {len(overview['refused'])} refused, manikin {__version__}",
    )
    page.remarks(one["reason"] for one in overview["refused"])
    columns = [name for name in rows[0] if name != "refused"]
    page.table(columns, [[row[name] for name in columns] for row in rows], links=links)
    return page.html()


def _headline(summary: Mapping[str, Any]) -> dict[str, Any]:
    margin, residual = summary["margin"], summary["reconstruction_residual_m"]
    shifted = margin["shifted"]
    return {
        "duration [s]": summary["duration_s"],
        "frames": summary["frames"],
        "person": f"{summary['stature_m']:.2f} m, {summary['mass_kg']:.1f} kg, {summary['sex']}",
        "residual of the reconstruction [mm]": f"{1e3 * residual['median']:.1f} (median), "
        f"{1e3 * residual['max']:.1f} (largest)",
        "sequence of touch-downs": ", ".join(map(readable, summary["sequence"])) or "none",
        "lowest centre of mass [m]": summary["com_height_min_m"],
        "lowest margin [N.m]": margin["min"],
        "frames with a positive margin": None
        if margin["share_positive"] is None
        else f"{100.0 * margin['share_positive']:.1f} %",
        "limited by": margin["limiting"],
        "shift onto the contacts [mm]": f"{1e3 * shifted['rms_m']:.1f} (RMS), {1e3 * shifted['max_m']:.1f} "
        f"(largest); positive then in {100.0 * shifted['share_positive']:.1f} % of the frames",
    }


def _plan(page: ReportPage, plan: Mapping[str, Any]) -> None:
    page.heading(f"Planned anew on the same stances ({plan['method']})")
    page.remarks([plan["failure"]] if plan["failure"] else [])
    page.numbers({
        "recorded duration [s]": plan["recorded_duration_s"],
        "planned duration [s]": plan["duration_s"],
        "centre of mass from the recorded one, RMS [m]": plan["com_rms_m"],
        "largest [m]": plan["com_max_m"],
        f"least margin [{plan['margin_unit']}]": plan["min_margin"],
    })  # fmt: skip
    if plan["phase_durations_s"] is not None:
        page.table(
            ("phase", "recorded [s]", "planned [s]", "supports"),
            [
                (number, recorded, planned, ", ".join(map(readable, supports)))
                for number, (recorded, planned, supports) in enumerate(
                    zip(
                        plan["recorded_phase_durations_s"], plan["phase_durations_s"], plan["supports"],
                        strict=True,
                    )
                )
            ],
        )  # fmt: skip
    if plan["execution"] is not None:
        page.numbers({
            f"executed: {name.replace('_', ' ')}": value
            for name, value in plan["execution"].items()
            if not isinstance(value, Mapping | list)
        })  # fmt: skip


def _time(instant: float, seen: bool) -> str:
    return f"{instant:.3f}" if seen else f"({instant:.3f})"


def _torques(page: ReportPage, summary: Mapping[str, Any]) -> None:
    strength = summary["ergonomics"]["strength"]
    if strength is None:
        return
    page.heading("Torques and strength")
    joints = list(strength["joints"].items())[:STRONGEST_SHOWN]
    page.table(
        ("joint", "strength [N.m]", "largest share", "at [s]", "share of time loaded"),
        [
            (readable(name), one["limit_Nm"], one["max_share"], one["max_at_s"], one["share_of_time_above"])
            for name, one in joints
        ],
    )


def _ergonomics(page: ReportPage, summary: Mapping[str, Any]) -> None:
    found = summary["ergonomics"]
    page.heading("Ergonomics")
    scores = {name: found[name] for name in ("rula", "reba") if found[name] is not None}
    page.table(
        ("score", "highest", "at [s]", "side", "mean", "action"),
        [
            (name.upper(), one["max"], one["max_at_s"], one["max_side"], one["mean"], one["action"])
            for name, one in scores.items()
        ],
    )
    if found["effort"] is not None:
        page.numbers({
            "mean share of strength": found["effort"]["rms_share"],
            "work done by the joints [J]": found["effort"]["positive_work_J"],
            "work taken up by the joints [J]": found["effort"]["negative_work_J"],
        })  # fmt: skip
    page.remarks(f"{part}: {reason}" for part, reason in found["missing"].items())
