"""The directory of a measured recording, and the overview of several.

::

    DIR/summary.json     what was measured
    DIR/series.csv       what was measured at every frame, units in the header
    DIR/motion.h5        the motion as recorded, and shifted, with supports, forces and margins
    DIR/report.html      all of it for people, in one file

    DIR/index.html, DIR/analyses.csv, DIR/analyses.json    of several recordings

Each file is written atomically.

Also here. Recordings measured side by side in processes beside this one; a bad file stops none of the others.
A plan against the recording on whose stances it was made ([Qiu2012]_ Table 7.7, Fig. 7.16 to 7.18).
"""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from os.path import commonpath
from pathlib import Path
from typing import Any

import numpy as np

from manikin.analysis import Analysis, AnalysisEntry, AnalysisJob, AnalysisOptions, analyze_file
from manikin.analysis.adaptation import Replan
from manikin.balance import motion_margin, pseudo_wrench
from manikin.errors import InputError, ManikinError
from manikin.motion.file import MotionFile, write_motions
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import MOTION, SUMMARY, ComTrack, RunRecord
from manikin.planning.com.com_certificate import phase_margins, phase_times
from manikin.reports.analysis_report import overview_page, report_page
from manikin.reports.analysis_sheet import recording_sheet
from manikin.reports.comparison.compare import RunComparison, compare_runs
from manikin.runtime.files import ResultDirectory, make_directory, write_result
from manikin.runtime.parallel import side_by_side


def analyze_files(
    jobs: Sequence[AnalysisJob], options: AnalysisOptions, *, workers: int = 1
) -> Iterator[AnalysisEntry]:
    """Measure files, and write the directory of each as soon as it is known.

    Args:
        jobs: The files.
        options: The same for all.
        workers: Processes, see :func:`manikin.runtime.parallel.side_by_side`.

    Yields:
        Entries in the order in which they are done.

    Raises:
        InputError: If ``workers`` is less than 1.
        ManikinError: If a process ends before its time.
    """
    if workers < 1:
        raise InputError(f"workers is {workers}; valid: at least 1")
    # Longest first, so that all processes end together.
    ordered = sorted(jobs, key=lambda job: -job.path.stat().st_size)
    one = partial(analyze_one, options=options)
    for _, entry in side_by_side(one, ordered, workers, "analysis"):
        yield entry


def analyze_one(job: AnalysisJob, options: AnalysisOptions) -> AnalysisEntry:
    """Measure one file and write its directory."""
    try:
        found = analyze_file(job.path, options)
    except (ManikinError, np.linalg.LinAlgError) as error:
        return AnalysisEntry(job, None, " ".join(str(error).split()))
    if job.directory is not None:
        write_analysis(found, job.directory, draw=job.draw)
    return AnalysisEntry(job, found.as_dict())


def directories_for(paths: Sequence[Path], out: Path) -> list[Path]:
    """A directory in ``out`` for each file: its path below the folder that all share, without the ending.

    Files that differ in their ending only keep it.
    """
    whole = [path.resolve() for path in paths]
    shared = Path(commonpath([path.parent for path in whole]))
    stems = [path.with_suffix("") for path in whole]
    return [
        out / (path if stems.count(stem) > 1 else stem).relative_to(shared)
        for path, stem in zip(whole, stems, strict=True)
    ]


def compare_with_recording(found: Replan) -> RunComparison:
    """Compare plan and recording as two runs: timing, centre of mass and margins; the recording comes first.

    Margins of both are those of a point mass: with the recorded acceleration, and as planned.

    Args:
        found: A plan; of one that failed there is only the recording.
    """
    schedule = found.recording.schedule
    first = RunRecord(
        "recorded", MotionFile(body=found.body, scene=found.scene, schedule=schedule),
        {"succeeded": True}, found.body.mass, _recorded_track(found),
    )  # fmt: skip
    succeeded = found.com.trajectory is not None
    content = MotionFile(body=found.body, scene=found.scene, schedule=found.schedule if succeeded else None)
    second = RunRecord(
        found.method, content, {"succeeded": succeeded}, found.body.mass, _planned_track(found)
    )  # fmt: skip
    return compare_runs(first, second)


def _recorded_track(found: Replan) -> ComTrack:
    recording = found.recording
    time, com = recording.time, recording.com
    velocity = np.gradient(com, time, axis=0, edge_order=2)
    acceleration = np.gradient(velocity, time, axis=0, edge_order=2)
    return ComTrack(time, com, velocity, acceleration, _margins(found, time, com, acceleration))


def _margins(found: Replan, time: FloatArray, com: FloatArray, acceleration: FloatArray) -> FloatArray:
    wrench = pseudo_wrench(found.body.mass, com, acceleration)
    schedule = found.recording.schedule
    stances = [phase.stance for phase in schedule.sequence]
    known = found.com.polytopes
    return motion_margin(stances, schedule.phase_at(time), wrench, com, polytopes=known).margin


def _planned_track(found: Replan) -> ComTrack | None:
    trajectory = found.com.trajectory
    if trajectory is None:
        return None
    trajectory = replace(trajectory, turning=None)
    time = np.concatenate(phase_times(trajectory))
    margin = np.concatenate(phase_margins(found.com.problem, trajectory, found.com.polytopes))
    derivatives = trajectory.position, trajectory.velocity, trajectory.acceleration
    position, velocity, acceleration = (evaluate(time) for evaluate in derivatives)
    return ComTrack(time, position, velocity, acceleration, margin, found.com.problem.margin_unit)


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
    from manikin.reports.figures.write_figures import comparison_pictures

    against_recording = compare_with_recording

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
