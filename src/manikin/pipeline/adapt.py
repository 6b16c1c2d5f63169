"""A recorded motion adapted to another body or place, executed, and kept as a run with its changes.

Beside the files of any run (:mod:`manikin.pipeline.run_directory`) there is ``adaptation.json`` with what has
changed from the recording; ``scenario.yaml`` has the place and the body's size, with a way from where the
motion begins to where it ends, and can be planned without the recording.
"""

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from manikin.analysis import Analysis
from manikin.analysis.adaptation import Adaptation, Method, adapt_carried, crop, recorded_on_contacts
from manikin.analysis.adaptation_changes import AdaptationLimits, changes_of
from manikin.analysis.motion_transfer import MotionOnContacts, NoPlaceError, body_like, carried_over
from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.numerics.spatial import IDENTITY, PlanarTransform
from manikin.pipeline.run_directory import ADAPTATION
from manikin.pipeline.stages import Progress, Report, RunContext, RunResult
from manikin.planning.whole_body import WholeBodySettings
from manikin.recordings import Reconstruction, motion_of
from manikin.recordings.reconstruction.proportions import level_heading
from manikin.recordings.supports.recorded_stances import FRICTION
from manikin.scenarios import Scenario, ScenarioFile
from manikin.scenarios.validation import validate
from manikin.scene import Box, Scene

PACES = (1.0, 1.15, 1.3)
"""Durations that are tried one after the other, as multiples of the recorded one."""


@dataclass(frozen=True, eq=False)
class AdaptationTask:
    """What a recording is adapted to.

    Attributes:
        size: Of another body: ``stature``, ``mass``, ``sex``, ``age`` and ``strength``, as far as given.
        scene: Scenario whose obstacles and floor the motion is made on; None for where it was recorded.
        at: x [m], y [m] and heading [deg] in the scene at which the motion begins; None for as recorded.
        pace: Duration as a multiple of the recorded one; None to try :data:`PACES`.
        window: Start and end of the part that is taken [s]; None for all.
        method: Of the centre of mass.
    """

    size: Mapping[str, Any] = field(default_factory=dict)
    scene: Scenario | None = None
    at: tuple[float, float, float] | None = None
    pace: float | None = None
    window: tuple[float, float] | None = None
    method: Method = "keyframes"


def adapt(
    analysis: Analysis, task: AdaptationTask | None = None, *, body: BodyModel | None = None,
    friction: float | None = None, out: str | Path | None = None, progress: Progress | None = None,
) -> RunResult:  # fmt: skip
    """Adapt a measured recording, execute the result and report it as a run.

    A motion that cannot be made so is a result with ``succeeded`` False, and says why.

    Args:
        analysis: The measured recording.
        task: What it is adapted to; the same body in the same place if None.
        body: Another body, in place of the task's size.
        friction: Coefficient of feet and seat; 0.8 if None.
        out: Run directory; nothing is written when omitted.
        progress: Called with the stage and the share of it that is done.

    Raises:
        InputError: If a value is not usable.
    """
    given, began = task or AdaptationTask(), clock.perf_counter()
    found, supports = analysis.found, analysis.supports
    if given.window is not None:
        found, supports = crop(found, supports, *given.window)
    source = recorded_on_contacts(found, supports, friction=FRICTION if friction is None else friction)
    who = body_like(source.body, **given.size) if body is None and given.size else body
    transform = None if given.at is None else _transform(found, given.at)
    scene = None if given.scene is None else given.scene.build_scene()
    try:
        carried, nowhere = carried_over(source, who, scene, transform), ""
    except NoPlaceError as error:
        carried, nowhere = replace(source, body=who or source.body, scene=scene or source.scene), str(error)
    job = _scenario(analysis.name, given, carried)
    context = RunContext(job, IDENTITY, job, carried.body, carried.scene, carried.scene, WholeBodySettings())
    report = Report(context, out, progress, began)
    report.summary["adaptation"] = {"recording": analysis.source}
    if nowhere:
        report.fail("contacts", nowhere)
        return RunResult.of(report)
    padded = () if given.scene is None else given.scene.padded
    attempt = partial(
        adapt_carried, source, carried, motion_of(found), method=given.method, execute=True, padded=padded
    )
    with threadpool_limits(1):
        pace, result = _first_proved(attempt, PACES if given.pace is None else (given.pace,), report)
    return _reported(analysis.source, result, pace, report)


def _first_proved(
    attempt: Callable[..., Adaptation], paces: Sequence[float], report: Report
) -> tuple[float, Adaptation]:
    """The first pace at which the motion is proved, and its result; the first of all if there is none."""
    first = None
    for number, pace in enumerate(paces):
        report.progress("adaptation", number / len(paces))
        result = attempt(pace=pace)
        first = first or (pace, result)
        if (table := AdaptationLimits().table(result)) is not None and table.held:
            first = pace, result
            break
    report.progress("adaptation", 1.0)
    if first is None:
        raise InputError("no pace is given; valid: at least one")
    return first


def _reported(recording: str, result: Adaptation, pace: float, report: Report) -> RunResult:
    """The result as a run."""
    plain, com = result.as_dict(), result.com
    changes = {"recording": recording, "method": result.method, "pace": pace} | changes_of(result)
    report.finish("adaptation", changes)
    if report.directory is not None:
        report.directory.write(ADAPTATION, changes)
    report.finish("centroidal", {key: plain[key] for key in _CENTROIDAL})
    if (failure := com.failure) is not None:
        report.fail("centroidal", failure.reason, failure.time or 0.0, failure.where)
    ran, adapted, table = result.execution, plain["wholebody"], AdaptationLimits().table(result)
    if adapted is not None:
        report.planned = True
        report.finish("wholebody", adapted | {"duration_s": result.schedule.duration})
        report.keep_motions(result.schedule, result.planned, result.executed)
    if ran is not None and table is not None:
        report.require("execution", table)
        report.finish("execution", ran.summary())
        report.proved = table.held
    return RunResult.of(report, com, planned=result.planned, execution=ran)


_CENTROIDAL = "succeeded", "failure", "duration_s", "com_rms_m", "com_max_m", "min_margin", "margin_unit"
"""Keys of a plan that stand in its summary."""


def _transform(found: Reconstruction, at: tuple[float, float, float]) -> PlanarTransform:
    """From the frame of a recording to one in which its person begins at a place."""
    x, y, heading = at
    first = found.q[:1]
    start = PlanarTransform(float(first[0, 0]), float(first[0, 1]), float(np.degrees(level_heading(first))))
    return PlanarTransform(x, y, heading).after(start.inverse)


def _scenario(name: str, task: AdaptationTask, carried: MotionOnContacts) -> Scenario:
    """Scenario with the body's size, the scene and a way from where the motion begins to where it ends."""
    ends = {}
    for end, row in (("start", 0), ("goal", -1)):
        heading = round(float(np.degrees(level_heading(carried.q[[row]]))), 2)
        ends[end] = {"at": np.round(carried.q[row, :2], 4).tolist(), "heading_deg": heading}
    body, folder = carried.body, Path.cwd()
    data: dict[str, Any] = {
        "name": f"{name}-adapted", "task": ends,
        "body": {
            "stature_m": body.stature, "mass_kg": body.own_mass, "sex": body.sex, "age": body.age,
            "strength": body.strength,
        },
        "floor_height_m": carried.floor, "scene": boxes_of(carried.scene),
    }  # fmt: skip
    if task.scene is not None:
        kept, folder = task.scene.file.model_dump(mode="json", exclude_none=True), task.scene.folder
        data |= {"scene": kept["scene"], "floor_height_m": task.scene.file.floor_height_m}
    return Scenario(validate(ScenarioFile, data, "manikin adapt"), "manikin adapt", folder, {})


def boxes_of(scene: Scene) -> list[dict[str, Any]]:
    """Entries of a scenario's scene for the boxes of a scene."""
    return [
        {
            "name": item.name, "box": np.round(item.shape.size, 4).tolist(),
            "position": np.round(item.translation, 4).tolist(),
            "rpy_deg": [0.0, 0.0, round(float(np.degrees(np.arctan2(*item.rotation[1::-1, 0]))), 2)],
        }
        for item in scene.obstacles
        if isinstance(item.shape, Box)
    ]  # fmt: skip
