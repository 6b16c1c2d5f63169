"""The directory of a measured recording, and the overview of several.

::

    DIR/summary.json     what was measured
    DIR/series.csv       what was measured at every frame, units in the header
    DIR/motion.h5        the motion as recorded, and shifted, with supports, forces and margins
    DIR/report.html      all of it for people, in one file

    DIR/index.html, DIR/analyses.csv, DIR/analyses.json    of several recordings

Each file is written atomically.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from manikin.analysis import Analysis, AnalysisEntry
from manikin.analysis_report import overview_page, report_page
from manikin.analysis_sheet import recording_sheet
from manikin.motion.file import MotionFile, write_motions
from manikin.output import MOTION, SUMMARY
from manikin.result_directory import ResultDirectory, make_directory, write_result

if TYPE_CHECKING:
    from manikin.replan import Replan

SHEET = "Postures, supports, forces, margins, height and scores over time"
"""What the drawing of a report shows."""
REPORT = "report.html"
SERIES = "series.csv"
OVERVIEW = "index.html"
TABLE = "analyses.csv"
ANALYSES = "analyses.json"


class AnalysisDirectory(ResultDirectory):
    """Directory of an analysis, or of several with their overview."""

    kind, marks = "analysis", (REPORT, OVERVIEW, SUMMARY)


def summary_of(found: Analysis, plan: "Replan | None" = None) -> dict[str, Any]:
    """Content of ``summary.json``: the analysis, and ``plan`` where one was made."""
    return found.as_dict() | {"plan": None if plan is None else plan.as_dict()}


def write_analysis(
    found: Analysis, directory: Path, *, draw: bool = True, plan: "Replan | None" = None
) -> None:
    """Write the files of one recording; the summary comes last.

    Args:
        found: What was measured.
        directory: Created if it is not there.
        draw: Whether the report has its figures.
        plan: The recording planned anew.

    Raises:
        MotionFileError: If they cannot be written.
    """
    make_directory(directory)
    summary = summary_of(found, plan)
    sheet = recording_sheet(found, SHEET) if draw else ""
    pictures = _plan_pictures(plan) if draw and plan is not None else {}
    content = MotionFile(body=found.body) if plan is None else plan.content
    content = replace(content, recorded=found.motion, shifted=found.shifted_motion)
    write_motions(directory / MOTION, content)
    write_result(directory / SERIES, _series_text(found))
    write_result(directory / REPORT, report_page(found, summary, sheet, pictures))
    write_result(directory / SUMMARY, summary)


def _plan_pictures(plan: "Replan") -> dict[str, bytes]:
    """Contents of PNG files that compare a plan with its recording, by what they show."""
    if plan.com.trajectory is None:
        return {}
    from manikin.figures.write import comparison_pictures
    from manikin.replan import against_recording

    return comparison_pictures(against_recording(plan))


def write_overview(entries: Sequence[AnalysisEntry], overview: dict[str, Any], directory: Path) -> None:
    """Write the table of several recordings as a page, as CSV and as JSON.

    Args:
        entries: In order.
        overview: What the command says of all of them.
        directory: Where the directories of the recordings are.

    Raises:
        MotionFileError: If they cannot be written.
    """
    rows = [_row(entry) for entry in entries]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_result(directory / TABLE, text.getvalue())
    links = {
        str(entry.job.path): f"{entry.job.directory.relative_to(directory).as_posix()}/{REPORT}"
        for entry in entries
        if entry.job.directory is not None and entry.summary is not None
    }
    write_result(directory / OVERVIEW, overview_page(rows, overview, links))
    write_result(directory / ANALYSES, overview)


def _row(entry: AnalysisEntry) -> dict[str, Any]:
    """A recording in one line; empty where it was refused."""
    found = entry.summary or {}
    margin, residual = found.get("margin") or {}, found.get("reconstruction_residual_m") or {}
    recorded, shifted = margin.get("recorded") or {}, margin.get("shifted") or {}
    plates, effort = found.get("force_plates") or {}, found.get("ergonomics") or {}
    return {
        "file": str(entry.job.path),
        "duration_s": found.get("duration_s"),
        "frames": found.get("frames"),
        "stature_m": found.get("stature_m"),
        "mass_kg": found.get("mass_kg"),
        "residual_median_m": residual.get("median"),
        "supports": len(found["supports"]) if found else None,
        "phases": len(found["phase_durations_s"]) if found else None,
        "com_height_min_m": found.get("com_height_min_m"),
        "margin_min_Nm": margin.get("min"),
        "margin_share_positive": margin.get("share_positive"),
        "share_positive_in_contact": margin.get("share_positive_in_contact"),
        "recorded_share_positive_in_contact": recorded.get("share_positive_in_contact"),
        "shift_rms_m": shifted.get("rms_m"),
        "shift_believed": shifted.get("believed"),
        "shifted_share_positive_in_contact": shifted.get("share_positive_in_contact"),
        "shifted_share_at_floor_in_contact": shifted.get("share_at_floor_in_contact"),
        "floor_m": shifted.get("floor_m"),
        "floor_Nm": shifted.get("floor_Nm"),
        "timing_median_s": plates.get("timing_median_s"),
        "vertical_rms_body_weight": plates.get("vertical_rms_body_weight"),
        "cop_rms_m": plates.get("cop_rms_m"),
        "rula_max": (effort.get("rula") or {}).get("max"),
        "reba_max": (effort.get("reba") or {}).get("max"),
        "refused": entry.refusal,
    }


def _series_text(found: Analysis) -> str:
    columns = found.series()
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.6g", delimiter=",")
    return text.getvalue()
