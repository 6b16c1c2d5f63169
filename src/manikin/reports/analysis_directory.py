"""Result directories of measured recordings, and the overview of several.

::

    DIR/summary.json     what was measured
    DIR/series.csv       what was measured at every frame, units in the header
    DIR/motion.h5        the motion as recorded, and shifted, with supports, forces and margins
    DIR/report.html      all of it in one page

    DIR/index.html, DIR/analyses.csv, DIR/analyses.json    of several recordings

Each file is written atomically. A plan made on the stances of a recording is compared with it as two runs are
([Qiu2012]_ Table 7.7, Fig. 7.16 to 7.18).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from os.path import commonpath
from pathlib import Path
from typing import Any

import numpy as np

from manikin.analysis import Analysis, AnalysisEntry, AnalysisJob, AnalysisOptions, analyze_file
from manikin.analysis.adaptation import Adaptation
from manikin.balance import motion_margin, pseudo_wrench
from manikin.errors import ManikinError
from manikin.motion.file import MotionFile, write_motions
from manikin.pipeline.run_directory import MOTION, SUMMARY, ComTrack, RunRecord, point_mass_track
from manikin.reports.analysis_sheet import recording_sheet
from manikin.reports.comparison import RunComparison, compare_runs
from manikin.reports.gait_sheet import gait_columns, gait_sheet
from manikin.reports.pages import analysis_page, render
from manikin.runtime.files import ResultDirectory, columns_csv, csv_text, make_directory, write_result
from manikin.runtime.parallel import side_by_side


def analyze_files(
    jobs: Sequence[AnalysisJob], options: AnalysisOptions, *, workers: int = 1
) -> Iterator[AnalysisEntry]:
    """Measure files in so many processes, write the directory of each, and yield their entries as they end.

    Raises:
        ManikinError: If a process ends before its time.
    """
    ordered = sorted(jobs, key=lambda job: -job.path.stat().st_size)  # so that all processes end together
    for _, entry in side_by_side(partial(_analyze_one, options=options), ordered, workers, "analysis"):
        yield entry


def _analyze_one(job: AnalysisJob, options: AnalysisOptions) -> AnalysisEntry:
    """Measure one file and write its directory."""
    try:
        result = analyze_file(job.path, options)
    except (ManikinError, np.linalg.LinAlgError) as error:
        return AnalysisEntry(job, None, " ".join(str(error).split()))
    if job.directory is not None:
        write_analysis(result, job.directory, draw=job.draw)
    return AnalysisEntry(job, result.as_dict())


def directories_for(paths: Sequence[Path], out: Path) -> list[Path]:
    """A directory in ``out`` for each file: its path below the folder that all share, without the ending.

    Files that differ in their ending only keep it.
    """
    whole = [path.resolve() for path in paths]
    shared = Path(commonpath([path.parent for path in whole]))
    stems = [path.with_suffix("") for path in whole]
    names = (path if stems.count(stem) > 1 else stem for path, stem in zip(whole, stems, strict=True))
    return [out / name.relative_to(shared) for name in names]


def compare_with_recording(found: Adaptation) -> RunComparison:
    """Compare plan and recording as two runs: timing, centre of mass and margins; the recording comes first.

    Margins of both are those of a point mass: with the recorded acceleration, and as planned. Of a plan that
    failed there is only the recording.
    """
    content = MotionFile(body=found.body, scene=found.scene, schedule=found.recording.schedule)
    mass, plan, trajectory = found.body.mass, None, found.com.trajectory
    first = RunRecord("recorded", content, {"succeeded": True}, mass, _recorded_track(found))
    if trajectory is not None:
        plan = point_mass_track(found.com.problem, replace(trajectory, turning=None), found.com.polytopes)
    content = replace(content, schedule=None if plan is None else found.schedule)
    second = RunRecord(found.method, content, {"succeeded": plan is not None}, mass, plan)
    return compare_runs(first, second)


def _recorded_track(found: Adaptation) -> ComTrack:
    time, com, schedule = found.recording.time, found.recording.com, found.recording.schedule
    velocity = np.gradient(com, time, axis=0, edge_order=2)
    acceleration = np.gradient(velocity, time, axis=0, edge_order=2)
    wrench = pseudo_wrench(found.body.mass, com, acceleration)
    stances, phases = [phase.stance for phase in schedule.sequence], schedule.phase_at(time)
    margins = motion_margin(stances, phases, wrench, com, polytopes=found.com.polytopes)
    return ComTrack(time, com, velocity, acceleration, margins.margin)


SHEET = "Postures, supports, forces, margins, height and scores over time"
"""Alternative text of the drawing of a report."""
REPORT = "report.html"
SERIES = "series.csv"
CYCLES = "cycles.csv"
CYCLES_SHEET = "Angles, moments and powers of both legs over the gait cycle"
OVERVIEW = "index.html"
TABLE = "analyses.csv"
ANALYSES = "analyses.json"

COLUMNS: tuple[tuple[str, str, str, float, int], ...] = (
    ("duration_s", "duration_s", "duration [s]", 1.0, 2),
    ("frames", "frames", "frames", 1, 0),
    ("stature_m", "stature_m", "stature [m]", 1.0, 2),
    ("mass_kg", "mass_kg", "mass [kg]", 1.0, 1),
    ("residual_median_m", "reconstruction_residual_m.median", "residual, median [mm]", 1e3, 1),
    ("activity", "activity.kind", "", 1.0, 0),
    ("supports", "supports", "supports", 1, 0),
    ("phases", "phase_durations_s", "phases", 1, 0),
    ("com_height_min_m", "com_height_min_m", "lowest CoM [m]", 1.0, 3),
    ("margin_min_Nm", "margin.min", "lowest margin as recorded [N.m]", 1.0, 1),
    ("margin_share_positive", "margin.share_positive", "", 1.0, 0),
    ("share_positive_in_contact", "margin.share_positive_in_contact",
     "positive as recorded [% of frames in contact]", 100.0, 1),
    ("recorded_share_positive_in_contact", "margin.recorded.share_positive_in_contact", "", 1.0, 0),
    ("shift_rms_m", "margin.shifted.rms_m", "shift, RMS [mm]", 1e3, 1),
    ("shift_believed", "margin.shifted.believed", "", 1.0, 0),
    ("shifted_share_positive_in_contact", "margin.shifted.share_positive_in_contact",
     "positive once shifted [%]", 100.0, 1),
    ("shifted_share_at_floor_in_contact", "margin.shifted.share_at_floor_in_contact",
     "at the imposed floor [% of frames in contact]", 100.0, 1),
    ("floor_m", "margin.shifted.floor_m", "", 1.0, 0),
    ("floor_Nm", "margin.shifted.floor_Nm", "", 1.0, 0),
    ("timing_median_s", "force_plates.timing_median_s", "instants against plates [ms]", 1e3, 0),
    ("vertical_rms_body_weight", "force_plates.vertical_rms_body_weight",
     "force against plates [% of weight]", 100.0, 1),
    ("cop_rms_m", "force_plates.cop_rms_m", "CoP against plates [mm]", 1e3, 0),
    ("rula_max", "ergonomics.rula.max", "highest RULA", 1, 0),
    ("reba_max", "ergonomics.reba.max", "highest REBA", 1, 0),
)  # fmt: skip
"""Columns of the table of recordings: key, place in the summary, then heading on the page (empty: not shown),
factor and decimals."""


class AnalysisDirectory(ResultDirectory):
    """Directory of an analysis, or of several with their overview."""

    kind, marks = "analysis", (REPORT, OVERVIEW, SUMMARY)


def write_analysis(analysis: Analysis, directory: Path, *, draw: bool = True) -> None:
    """Write the files of one recording, with figures or without; the summary comes last.

    Raises:
        MotionFileError: If they cannot be written.
    """
    make_directory(directory)
    summary, sheet = analysis.as_dict(), recording_sheet(analysis, SHEET) if draw else ""
    content = MotionFile(body=analysis.body, recorded=analysis.motion, shifted=analysis.shifted_motion)
    write_motions(directory / MOTION, content)
    write_result(directory / SERIES, columns_csv(analysis.series(), 6))
    cycles = ""
    if analysis.gait is not None and analysis.gait.cycles:
        band = analysis.gait_band
        write_result(directory / CYCLES, columns_csv(gait_columns(analysis.gait, band), 5))
        cycles = gait_sheet(analysis.gait, band, CYCLES_SHEET) if draw else ""
    write_result(directory / REPORT, analysis_page(analysis, summary, (sheet, cycles)))
    write_result(directory / SUMMARY, summary)


def overview_of(entries: Sequence[AnalysisEntry], wall: float) -> dict[str, Any]:
    """Content of ``analyses.json``: all summaries, and what was refused; ``wall`` is the time of all [s]."""
    measured = [entry.summary for entry in entries if entry.summary is not None]
    duration = sum(summary["duration_s"] for summary in measured)
    left_out = [entry for entry in entries if entry.summary is None]
    refused = [{"file": str(entry.job.path), "reason": entry.refusal} for entry in left_out]
    return {
        "files": measured, "refused": refused, "duration_s": duration, "wall_s": wall,
        "realtime_factor": duration / wall,
    }  # fmt: skip


def write_overview(entries: Sequence[AnalysisEntry], overview: dict[str, Any], directory: Path) -> None:
    """Write :func:`overview_of` recordings as a page, as CSV and as JSON, beside their directories.

    Raises:
        MotionFileError: If they cannot be written.
    """
    rows = []
    for entry in entries:
        values = {key: _value(entry.summary, path) for key, path, *_ in COLUMNS}
        rows.append({"file": str(entry.job.path), **values, "refused": entry.refusal})
    write_result(directory / TABLE, csv_text(list(rows[0]), [list(row.values()) for row in rows]))
    write_result(directory / OVERVIEW, _overview_page(entries, rows, overview, directory))
    write_result(directory / ANALYSES, overview)


def _overview_page(
    entries: Sequence[AnalysisEntry], rows: Sequence[dict[str, Any]], overview: dict[str, Any], folder: Path
) -> str:
    """HTML of several recordings; columns without any value are left out."""
    files = [entry.job.path.resolve() for entry in entries]
    shared = Path(commonpath([file.parent for file in files]))
    known = [item for item in COLUMNS if item[2] and any(row[item[0]] is not None for row in rows)]
    shown = []
    for entry, file, row in zip(entries, files, rows, strict=True):
        inside = None if entry.summary is None else entry.job.directory
        shown.append({
            "name": file.relative_to(shared).as_posix(),
            "link": None if inside is None else f"{inside.relative_to(folder).as_posix()}/{REPORT}",
            **{key: None if row[key] is None else factor * row[key] for key, _, _, factor, _ in known},
        })  # fmt: skip
    columns = [{"key": key, "heading": heading, "decimals": digits} for key, _, heading, _, digits in known]
    return render("overview", **overview, folder=shared, columns=columns, rows=shown)


def _value(summary: Mapping[str, Any] | None, path: str) -> Any:
    """Value at a dotted path, None if it is not there; of a list its length."""
    value: Any = summary
    for key in path.split("."):
        value = None if value is None else value.get(key)
    return len(value) if isinstance(value, list) else value
