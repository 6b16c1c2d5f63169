"""``manikin adapt``: a recorded motion on another body or in another place, balanced and executed."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from manikin.cli import console
from manikin.cli.console import (
    AgeOption,
    FiguresOption,
    FramesOption,
    JsonOption,
    MarkersOption,
    MassOption,
    OutOption,
    SexOption,
    StatureOption,
    StrengthOption,
    argument,
    option,
)


def adapt(
    context: typer.Context,
    recording: Annotated[Path, argument("FILE", "Recording (.c3d .trc .bvh .amc).")],
    scene: Annotated[
        str | None,
        option("NAME|FILE.yaml", "Where: the scene of a scenario. Default: where it was recorded."),
    ] = None,
    at: Annotated[
        tuple[float, float, float] | None,
        option("X Y YAW_DEG", "Where in the scene it begins. Default: the recording's coordinates."),
    ] = None,
    out: OutOption = None,
    stature: StatureOption = None,
    mass: MassOption = None,
    sex: SexOption = None,
    age: AgeOption = None,
    strength: StrengthOption = None,
    recorded_mass: Annotated[
        float | None, option("KG", "Mass of the recorded person. Default: the file's, or the plates'.")
    ] = None,
    recorded_sex: Annotated[
        Literal["male", "female"], option("male|female", "Sex of the recorded person.")
    ] = "male",
    window: Annotated[
        tuple[float, float] | None, option("START END", "Part of the recording that is taken [s].")
    ] = None,
    frames: FramesOption = None,
    markers: MarkersOption = None,
    friction: Annotated[float, option("MU", "Of soles on the ground, and of seats.")] = 0.8,
    pace: Annotated[
        float | None,
        option("X", "Duration over the recorded one. Default: 1, or slower if needed.", min=0.25, max=4.0),
    ] = None,
    method: Annotated[
        Literal["keyframes", "timing-free"],
        option("keyframes|timing-free", "Of the centre of mass: near the recorded one, or free in time."),
    ] = "keyframes",
    figures: FiguresOption = True,
    json: JsonOption = False,
) -> int:
    """Adapt a recorded motion to another body or place, execute it and say what has changed."""
    from manikin.analysis import AnalysisOptions, analyze_file
    from manikin.pipeline.adapt import AdaptationTask
    from manikin.pipeline.adapt import adapt as adapted
    from manikin.recordings import read_marker_map
    from manikin.scenarios import load_scene

    size = {"stature": stature, "mass": mass, "sex": sex, "age": age, "strength": strength}
    place = None if scene is None else load_scene(scene)
    task = AdaptationTask(console.given(size), place, at, pace, window, method)
    options = AnalysisOptions(
        frames=frames, mass=recorded_mass, sex=recorded_sex, friction=friction, as_recorded=True,
        markers=None if markers is None else read_marker_map(markers),
    )  # fmt: skip
    directory = console.directory_of(out, f"{recording.stem}-adapted", json=json)
    with console.stdout_kept_clean():
        analysis = analyze_file(recording, options)
    return console.report_run(
        lambda progress: adapted(analysis, task, friction=friction, out=directory, progress=progress),
        directory, context.obj, draw=figures, json=json, table=_changes,
    )  # fmt: skip


def _changes(summary: dict[str, Any]) -> dict[str, Any]:
    """Rows of what has changed; none of a motion that found no place."""
    from manikin.analysis.adaptation_changes import flat_changes

    changes = summary["adaptation"]
    return flat_changes(changes) if "contacts" in changes else {}
