"""The report of a measured recording, and the overview of several, as pages for people."""

from collections.abc import Mapping, Sequence
from os.path import commonpath
from pathlib import Path
from typing import Any

from manikin.analysis import Analysis
from manikin.reports.report_page import ReportPage
from manikin.runtime.palette import readable
from manikin.runtime.version import __version__

WORDS = (
    "Times are seconds on the recording's clock. The margin is the distance of the wrench that the motion "
    "needs to the faces of what the contacts can give (Qiu 2012, 4.2.9), moments about the CoM, "
    "alpha = 1 m: below 0 the contacts, as they were found, could not give it. Measured is the motion as "
    "recorded. Recordings tell places to a centimetre and so leave accelerations open: a margin below 0 need "
    "not say that a person was out of balance."
)
SHIFTED = (
    "The shifted motion is the recorded one after the least shift of the whole body with which its contacts "
    "can carry it. The shift imposes a margin, the floor: the centre of pressure is kept that far inside of "
    "the edges of the soles, wherever that is possible. Where the floor holds the shift, the margin of the "
    "shifted motion says nothing about the person, and no number is given."
)
AT_FLOOR = "at the imposed floor"
"""Stands for a margin of a shifted motion that the shift imposed."""

COLUMNS: dict[str, tuple[str, float, int]] = {
    "duration_s": ("duration [s]", 1.0, 2),
    "frames": ("frames", 1, 0),
    "stature_m": ("stature [m]", 1.0, 2),
    "mass_kg": ("mass [kg]", 1.0, 1),
    "residual_median_m": ("residual, median [mm]", 1e3, 1),
    "supports": ("supports", 1, 0),
    "phases": ("phases", 1, 0),
    "com_height_min_m": ("lowest CoM [m]", 1.0, 3),
    "margin_min_Nm": ("lowest margin as recorded [N.m]", 1.0, 1),
    "share_positive_in_contact": ("positive as recorded [% of frames in contact]", 100.0, 1),
    "shifted_share_positive_in_contact": ("positive once shifted [%]", 100.0, 1),
    "shifted_share_at_floor_in_contact": ("at the imposed floor [% of frames in contact]", 100.0, 1),
    "shift_rms_m": ("shift, RMS [mm]", 1e3, 1),
    "timing_median_s": ("instants against plates [ms]", 1e3, 0),
    "vertical_rms_body_weight": ("force against plates [% of weight]", 100.0, 1),
    "cop_rms_m": ("CoP against plates [mm]", 1e3, 0),
    "rula_max": ("highest RULA", 1, 0),
    "reba_max": ("highest REBA", 1, 0),
}
"""Columns of the overview for people, by those of the table: heading, factor, decimals."""

STRONGEST_SHOWN = 8
"""Joints in the table of torques, those first that come nearest to their strength."""


def report_page(
    found: Analysis, summary: Mapping[str, Any], sheet: str, pictures: Mapping[str, bytes]
) -> str:
    """HTML of one recording.

    Args:
        found: What was measured.
        summary: Its numbers.
        sheet: SVG of :func:`manikin.reports.analysis_sheet.recording_sheet`; empty for none.
        pictures: Contents of PNG files of the plan by what they show.
    """
    page = ReportPage(found.name, f"{summary['file']}, measured by manikin {__version__}")
    page.remarks(summary["remarks"])
    page.numbers(_headline(summary))
    if sheet:
        page.drawing(sheet)
    page.text(WORDS)
    page.heading("Supports")
    page.table(
        ("effector", "from [s]", "to [s]", "duration [s]", "place x, y, z [m]"),
        [
            (readable(one["effector"]), _time(one["start_s"], one["start_seen"]),
             _time(one["end_s"], one["end_seen"]), one["end_s"] - one["start_s"], tuple(one["place_m"]))
            for one in summary["supports"]
        ],
        decimals=(None, None, None, 3, 3),
    )  # fmt: skip
    page.text("In brackets: the support began before the recording, or went on after it.")
    page.heading("Phases")
    page.table(
        ("phase", "from [s]", "to [s]", "duration [s]", "lowest margin as recorded [N.m]",
         "once shifted [N.m]", "supports"),
        [
            (number, one["start_s"], one["end_s"], one["end_s"] - one["start_s"], one["margin_min_Nm"],
             _shifted_lowest(one["shifted_margin_min_Nm"], one["shifted_at_floor"]),
             ", ".join(map(readable, one["effectors"])) or "flight")
            for number, one in enumerate(summary["phases"])
        ],
        decimals=(None, 3, 3, 3, 1, 1),
    )  # fmt: skip
    _shift(page, summary["margin"])
    if summary["segments"]:
        page.heading("Walking: where people look is where they go (nonholonomic), or not (holonomic)")
        page.table(
            ("kind", "from [s]", "to [s]"),
            [(one["kind"], one["start_s"], one["end_s"]) for one in summary["segments"]],
            decimals=(None, 3, 3),
        )
    _torques(page, summary)
    _ergonomics(page, summary)
    if summary["force_plates"] is not None:
        _plates(page, summary["force_plates"])
    if summary["plan"] is not None:
        _plan(page, summary["plan"])
        for words, picture in pictures.items():
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
        f"{len(overview['files'])} recordings of {overview['duration_s']:.0f} s measured, "
        f"{len(overview['refused'])} refused, manikin {__version__}",
        wide=True,
    )
    page.remarks(one["reason"] for one in overview["refused"])
    whole = {row["file"]: Path(row["file"]).resolve() for row in rows}
    shared = commonpath([path.parent for path in whole.values()])
    page.text(f"Files in {shared}:")
    names = {file: path.relative_to(shared).as_posix() for file, path in whole.items()}
    shown = {key: COLUMNS[key] for key in COLUMNS if any(row[key] is not None for row in rows)}
    page.table(
        ("file", *(heading for heading, _, _ in shown.values())),
        [
            (
                names[row["file"]],
                *(None if row[key] is None else factor * row[key] for key, (_, factor, _) in shown.items()),
            )
            for row in rows
        ],
        decimals=(None, *(decimals for _, _, decimals in shown.values())),
        links={names[file]: address for file, address in links.items()},
    )
    return page.html()


def _headline(summary: Mapping[str, Any]) -> dict[str, Any]:
    margin, residual = summary["margin"], summary["reconstruction_residual_m"]
    return {
        "duration [s]": summary["duration_s"],
        "frames": summary["frames"],
        "person": f"{summary['stature_m']:.2f} m, {summary['mass_kg']:.1f} kg, {summary['sex']}",
        "residual of the reconstruction [mm]": f"{1e3 * residual['median']:.1f} (median), "
        f"{1e3 * residual['max']:.1f} (largest)",
        "sequence of touch-downs": ", ".join(map(readable, summary["sequence"])) or "none",
        "lowest centre of mass [m]": summary["com_height_min_m"],
        "lowest margin, as recorded [N.m]": margin["min"],
        "smallest force at the CoM that would end balance [N]": margin["force_min_N"],
        "smallest distance of the ZMP to the edge of the soles [mm]": None
        if margin["zmp_distance_min_m"] is None
        else f"{1e3 * margin['zmp_distance_min_m']:.0f}",
        "limited by": None if margin["limiting"] is None else readable(margin["limiting"]),
        "frames in contact": _share(margin["share_in_contact"]),
        "of them with a positive margin, as recorded": _share(margin["share_positive_in_contact"]),
    }


def _shift(page: ReportPage, margin: Mapping[str, Any]) -> None:
    """The shifted motion, beside the recorded one."""
    shifted = margin["shifted"]
    if shifted is None:
        return
    page.heading("Shifted onto the contacts")
    page.text(SHIFTED)
    page.numbers({
        "to be believed": "yes" if shifted["believed"] else "no",
        "shift of the whole body [mm]": f"{_millimetres(shifted['rms_m'])} (RMS), "
        f"{_millimetres(shifted['max_m'])} (largest)",
        "imposed floor": f"{shifted['floor_m']:.3f} m per body weight: {shifted['floor_Nm']:.1f} N.m about "
        "the middle of the contacts" + _at_floor(shifted["margin_at_floor_Nm"]),
        "frames in contact at the floor": _share(shifted["share_at_floor_in_contact"]),
        "frames that the contacts can carry": _share(shifted["share_positive_in_contact"]),
        "lowest margin [N.m]": _shifted_lowest(shifted["min"], shifted["min_at_floor"]),
    })  # fmt: skip


def _at_floor(margin: float | None) -> str:
    return "" if margin is None else f"; there the margin is {margin:.1f} N.m (median)"


def _shifted_lowest(value: float | None, at_floor: bool | None) -> float | str | None:
    return AT_FLOOR if at_floor else value


def _plates(page: ReportPage, plates: Mapping[str, Any]) -> None:
    def of(key: str, factor: float, unit: str) -> str | None:
        return None if plates[key] is None else f"{factor * plates[key]:.1f} {unit}"

    page.heading("Against force plates")
    page.numbers({
        "mass": of("mass_kg", 1.0, "kg"),
        "touch-downs and lift-offs compared": plates["events"],
        "their distance in time": None if plates["timing_median_s"] is None
        else f"{of('timing_median_s', 1e3, 'ms')} (median), {of('timing_max_s', 1e3, 'ms')} (largest)",
        "frames with all supports on plates": plates["frames"],
        "error of the vertical force, RMS": of("vertical_rms_body_weight", 100.0, "% of body weight"),
        "positive margin of the measured forces": of("margin_share_positive", 100.0, "% of these frames"),
        "frames with one foot on a plate": plates["single_support_frames"],
        "error of the centre of pressure, RMS": of("cop_rms_m", 1e3, "mm"),
        "the same of the shifted motion": of("cop_rms_shifted_m", 1e3, "mm"),
    })  # fmt: skip
    if plates["torques"]:
        page.table(
            ("torque", "frames", "difference, RMS [N.m]", "once shifted [N.m]", "mean [N.m]", "largest [N.m]",
             "by plates [N.m]"),
            [
                (readable(joint), one["frames"], one["rms_Nm"],
                 (plates["torques_shifted"].get(joint) or {}).get("rms_Nm"), one["mean_Nm"], one["peak_Nm"],
                 one["peak_by_plates_Nm"])
                for joint, one in plates["torques"].items()
            ],
            decimals=(None, 0, 1, 1, 1, 1, 1),
        )  # fmt: skip
        page.text("Of both legs, while the foot is on a plate of its own.")


def _plan(page: ReportPage, plan: Mapping[str, Any]) -> None:
    page.heading(f"Planned anew on the same stances ({plan['method']})")
    page.remarks([plan["failure"]] if plan["failure"] else [])
    page.numbers({
        "recorded duration [s]": plan["recorded_duration_s"],
        "planned duration [s]": plan["duration_s"],
        "centre of mass from the recorded one [mm]": f"{_millimetres(plan['com_rms_m'])} (RMS), "
        f"{_millimetres(plan['com_max_m'])} (largest)",
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
            decimals=(None, 3, 3),
        )  # fmt: skip
    if plan["execution"] is not None:
        _execution(page, plan["execution"], plan["margin_unit"])


def _execution(page: ReportPage, found: Mapping[str, Any], unit: str) -> None:
    page.heading("The plan executed by the whole body in the physics engine")
    page.remarks([readable(found["failure"])] if found["failure"] else [])
    page.numbers({
        "executed [s]": found["executed_s"],
        "fell": "yes" if found["fell"] else "no",
        "frames with a positive margin": _share(found["share_positive_margin"]),
        f"lowest margin [{unit}]": found["min_margin"],
        "centre of mass from the planned one [mm]": f"{_millimetres(found['com_rms_error_m'])} (RMS), "
        f"{_millimetres(found['com_max_error_m'])} (largest), "
        f"{_millimetres(found['final_com_error_m'])} (in the end)",
        "feet from where they were planned, largest [mm]": _millimetres(found["max_foot_error_m"]),
        "deepest penetration of a contact [mm]": _millimetres(found["max_penetration_m"]),
        "speed, per real time": found["realtime_factor"],
    })  # fmt: skip


def _share(value: float | None) -> str | None:
    return None if value is None else f"{100.0 * value:.1f} %"


def _millimetres(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f}"


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
        decimals=(None, 1, 2, 3, 3),
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
        decimals=(None, None, 3, None, 2),
    )
    if found["effort"] is not None:
        page.numbers({
            "mean share of strength": found["effort"]["rms_share"],
            "work done by the joints [J]": found["effort"]["positive_work_J"],
            "work taken up by the joints [J]": found["effort"]["negative_work_J"],
        })  # fmt: skip
    page.remarks(f"{part}: {reason}" for part, reason in found["missing"].items())
