"""``manikin analyze``: measures of recorded people, the same as those of planned motions."""

import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli import console
from manikin.cli.console import (
    FiguresOption,
    FramesOption,
    Interruption,
    JobsOption,
    JsonOption,
    LoadHandOption,
    MarkersOption,
    SexOption,
    argument,
    flag,
    option,
)
from manikin.errors import InputError


def analyze(
    context: typer.Context,
    sources: Annotated[
        list[Path], argument("FILE|DIR...", "Recordings (.c3d .trc .bvh .amc), or folders of them.")
    ],
    out: Annotated[
        Path | None, option("DIR", "Default: runs/analysis/NAME or runs/analysis; none with --json.")
    ] = None,
    frames: FramesOption = None,
    markers: MarkersOption = None,
    mass: Annotated[
        float | None, option("KG", "Mass of the person. Default: the file's, or the plates'.")
    ] = None,
    sex: SexOption = "male",
    friction: Annotated[float, option("MU", "Of soles on the ground.")] = 0.8,
    load: Annotated[float, option("KG", "Carried in the hands, as a mass.", "--load-kg")] = 0.0,
    load_hand: LoadHandOption = "both",
    as_recorded: Annotated[
        bool, flag("--as-recorded", "Look for no shifted motion to stand beside the recorded one.")
    ] = False,
    jobs: JobsOption = None,
    figures: FiguresOption = True,
    json: JsonOption = False,
) -> int:
    """Measure recorded people: supports, timing, balance, forces, effort; one report for each file."""
    single = len(sources) == 1 and not sources[0].is_dir()
    if not single:
        console.refuse(frames is not None, "--frames", "there are several files")
    from manikin.analysis import AnalysisOptions, recordings_in
    from manikin.recordings import read_marker_map

    marker_map = None if markers is None else read_marker_map(markers)
    options = AnalysisOptions(
        frames=frames, mass=mass, sex=sex or "male", friction=friction, load=load,
        load_hand=load_hand or "both", as_recorded=as_recorded, markers=marker_map,
    )  # fmt: skip
    paths = recordings_in(sources)
    if not single:
        directory = console.directory_of(out, "analysis", json=json)
        return _several(paths, directory, options, context.obj, jobs, draw=figures, json=json)
    console.refuse(jobs is not None, "--jobs", "there is one file")
    directory = console.directory_of(out, f"analysis/{paths[0].stem}", json=json)
    return _one(paths[0], directory, options, draw=figures, json=json)


def _one(path: Path, directory: Path | None, options: Any, *, draw: bool, json: bool) -> int:
    with console.stdout_kept_clean():
        from manikin.analysis import analyze_file
        from manikin.reports.analysis_directory import AnalysisDirectory, write_analysis

        if directory is not None:
            AnalysisDirectory(directory)
        result = analyze_file(path, options)
        if directory is not None:
            write_analysis(result, directory, draw=draw)
    summary = result.as_dict()
    if json:
        console.print_json(summary)
    else:
        console.print_table(_shown(summary))
        for finding in summary["implausible"]:
            typer.echo(f"implausible: {finding}", err=True)
        for remark in summary["remarks"]:
            typer.echo(f"note: {remark}", err=True)
        view = f"see the motion with: manikin view {directory}"
        typer.echo(f"report in {directory}/report.html; {view}", err=True)
    return console.FAILED if summary["implausible"] else console.DONE


def _shown(summary: dict[str, Any]) -> dict[str, Any]:
    """Printed values of a recording; everything is in the JSON."""
    from manikin.ergonomics.load_report import load_lines

    margin, residual, effort = summary["margin"], summary["reconstruction_residual_m"], summary["ergonomics"]
    shown = {
        "activity": summary["activity"]["kind"],
        "duration": f"{summary['duration_s']:.2f} s, {summary['frames']} frames",
        "person": f"{summary['stature_m']:.2f} m, {summary['mass_kg']:.1f} kg",
        "residual": f"{1e3 * residual['median']:.1f} mm (median), {1e3 * residual['max']:.1f} mm (largest)",
        "touch-downs": ", ".join(summary["sequence"]) or "none",
        "phases [s]": " ".join(f"{duration:.2f}" for duration in summary["phase_durations_s"]),
        "lowest CoM": f"{summary['com_height_min_m']:.3f} m at {summary['com_height_min_at_s']:.2f} s",
    }
    if (gait := summary["gait"]) is not None and gait["cycles"] and gait["cadence_per_min"] is not None:
        by_plates = sum(one["moments_by"] == "plate" for one in gait["cycles"])
        shown["gait"] = (
            f"{len(gait['cycles'])} cycles, {by_plates} with moments by plates; "
            f"{gait['cadence_per_min']:.0f} steps/min, {gait['speed_mps']:.2f} m/s"
        )
    share = margin["share_positive_in_contact"]
    if margin["min"] is not None:
        shown["lowest margin"] = (
            f"{margin['min']:.1f} N.m at {margin['at_s']:.2f} s ({margin['limiting'] or 'in flight'}), "
            "as recorded; "
            + ("never in contact" if share is None else f"positive in {share:.1%} of the frames in contact")
        )
    if share is not None and (shifted := margin["shifted"]) is not None:
        shown["shifted"] = (
            f"by {1e3 * shifted['rms_m']:.1f} mm (RMS), {1e3 * shifted['max_m']:.1f} mm (largest), "
            f"{'' if shifted['believed'] else 'not '}to be believed: "
            f"positive in {shifted['share_positive_in_contact']:.1%}, "
            f"in {shifted['share_at_floor_in_contact']:.1%} at the imposed floor "
            f"({shifted['floor_m']:g} m x weight = {shifted['floor_Nm']:.1f} N.m)"
        )
    for name in ("rula", "reba"):
        if (score := effort[name]) is not None:
            worst = f"{score['max']} at {score['max_at_s']:.2f} s"
            shown[name.upper()] = f"{worst}, {score['mean']:.1f} on average"
    shown |= load_lines(effort)
    if (strength := effort["strength"]) is not None:
        share, joint = 100.0 * strength["max_share"], strength["max_joint"]
        shown["largest torque"] = f"{share:.0f} % of strength, {joint} at {strength['max_at_s']:.2f} s"
    plates = summary["force_plates"]
    if plates is None:
        return shown
    if plates["timing_median_s"] is not None:
        shown["plates: instants"] = f"{1e3 * plates['timing_median_s']:.0f} ms (median of {plates['events']})"
    if plates["cop_rms_m"] is not None:
        shown["plates: forces"] = (
            f"vertical {100.0 * plates['vertical_rms_body_weight']:.1f} % of body weight, "
            f"CoP {1e3 * plates['cop_rms_m']:.0f} mm (RMS)"
        )
    if feet := plates["foot_forces"]:
        apart = [f"{key} {100.0 * feet[key]['rms']:.1f} %" for key in ("up", "ahead", "aside") if key in feet]
        shown["plates: force of a foot"] = f"{', '.join(apart)} of body weight (RMS)"
    if plates["torques"]:
        apart = [f"{key.replace('_', ' ')} {item['rms_Nm']:.0f}" for key, item in plates["torques"].items()]
        shown["plates: torques"] = f"{', '.join(apart)} N.m (RMS)"
    return shown


def _several(
    paths: Sequence[Path], directory: Path | None, options: Any, interruption: Interruption,
    jobs: int | None, *, draw: bool, json: bool,
) -> int:  # fmt: skip
    from manikin.analysis import AnalysisJob
    from manikin.reports import analysis_directory as files

    if directory is not None:
        files.AnalysisDirectory(directory)
    folders = [None] * len(paths) if directory is None else files.directories_for(paths, directory)
    work = [AnalysisJob(path, folder, draw) for path, folder in zip(paths, folders, strict=True)]
    began, entries = clock.perf_counter(), {}
    with console.bars(interruption) as progress:
        for entry in files.analyze_files(work, options, workers=console.processes(jobs)):
            entries[entry.job.path] = entry
            if entry.summary is None:
                console.complain(entry.refusal, console.BAD_INPUT)
            else:
                for finding in entry.summary["implausible"]:
                    typer.echo(f"implausible: {entry.job.path}: {finding}", err=True)
            progress("analyze", len(entries) / len(work), entry.job.path.name)
    ordered = [entries[path] for path in paths]
    overview = files.overview_of(ordered, clock.perf_counter() - began)
    measured, refused = len(overview["files"]), len(overview["refused"])
    if directory is not None:
        files.write_overview(ordered, overview, directory)
    if json:
        console.print_json(overview)
    else:
        recorded, wall = overview["duration_s"], overview["wall_s"]
        typer.echo(f"{measured} recordings of {recorded:.0f} s measured in {wall:.1f} s, {refused} refused")
        if directory is not None:
            typer.echo(f"overview in {directory}/index.html", err=True)
    if not measured:
        raise InputError(f"none of the {refused} files could be measured; valid: recordings, see above")
    if refused:
        return console.BAD_INPUT
    return console.FAILED if any(one["implausible"] for one in overview["files"]) else console.DONE
