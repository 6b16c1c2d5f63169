"""Runs and recordings: planned, executed, walked, pushed, read, measured; to print, draw and watch."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from manikin.analysis import Analysis, AnalysisOptions, analyze_file
from manikin.analysis import analyze as measure
from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.pipeline.run_directory import SCENARIO, RunRecord, read_run
from manikin.recordings.readers import read_recording
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.runtime.display import Displayed
from manikin.runtime.files import write_result
from manikin.scenarios import Scenario, load_scenario, load_scene
from manikin.viewer import serve

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from manikin.reports.comparison import RunComparison

Place = tuple[float, float, float]
"""x [m], y [m] and heading [deg, counter-clockwise from x]."""


@dataclass(frozen=True, eq=False, repr=False)
class Run(Displayed):
    """Result of a run of ``scenario``: its verdict, motions and figures.

    Its files are in ``directory``; ``summary`` is as printed by ``manikin run --json``.
    """

    summary: Mapping[str, Any]
    directory: Path
    scenario: Scenario
    _kept: TemporaryDirectory[str] | None = field(default=None)

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        failure, motion = self.summary["failure"], self.motion
        duration = {} if motion is None else {"duration": f"{motion.duration:.2f} s"}
        reason = {} if failure is None else {"failure": f"{failure['stage']}: {failure['reason']}"}
        return {"scenario": str(self.summary["scenario"]), "verdict": self.verdict} | duration | reason

    @property
    def verdict(self) -> str:
        """``"proved"``, ``"planned"`` or ``"failed"``."""
        return str(self.summary["verdict"])

    @property
    def succeeded(self) -> bool:
        """Whether what was asked for is proved, or for a plan alone planned."""
        return bool(self.summary["succeeded"])

    @cached_property
    def record(self) -> RunRecord:
        """Everything that the run left behind."""
        return read_run(self.directory)

    @property
    def planned(self) -> Motion | None:
        """The planned motion."""
        return self.record.content.planned

    @property
    def executed(self) -> Motion | None:
        """The motion in the physics engine."""
        return self.record.content.executed

    @property
    def motion(self) -> Motion | None:
        """The executed motion, or else the planned one."""
        return self.planned if self.executed is None else self.executed

    @property
    def requirements(self) -> "Requirements":
        """Requirements of the run, measured and allowed."""
        return Requirements(tuple(self.summary["requirements"]))

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that :meth:`plot` may draw; some apply to a part of the runs only."""
        from manikin.reports.figures import FIGURES

        return tuple(FIGURES)

    def plot(self, figure: str = "margin") -> "Figure":
        """Draw one of :attr:`figures`; InputError if there is no such one, or the run has no data for it."""
        from manikin.reports.figures import FIGURES

        return _drawn(FIGURES, figure, self.record)

    def view(self, port: int = 8080) -> None:
        """Play the motion in the browser until Ctrl-C, on this computer only."""
        from manikin.reports.export import film_of_motion

        serve(self.record.content, port, print, film=film_of_motion)

    def export(
        self, format_name: str, out: str | Path | None = None, *, which: str | None = None,
        rate: float | None = None, **options: Any,
    ) -> Path:  # fmt: skip
        """Write the motion for other programs, as ``manikin export`` does, and return the file.

        Args:
            format_name: One of :data:`manikin.reports.export.FORMATS`, such as ``"mp4"``.
            out: File to write; beside the motion when omitted.
            which: ``"planned"`` or ``"executed"``; the executed motion if there is one, when omitted.
            rate: Samples per second [Hz]; the format's own when omitted.
            options: Of :class:`manikin.reports.export.ExportOptions`, such as ``size=(320, 240)``.

        Raises:
            InputError: If a value is not usable, or the run has no such motion.
        """
        return _exported(self.record.content, self.directory, format_name, out, which, rate, options)

    def simulate(self, *, push: Mapping[str, float] | None = None) -> "Run":
        """Execute the plan in the physics engine; see :func:`simulate`."""
        return simulate(self.scenario, push=push)


@dataclass(frozen=True, eq=False, repr=False)
class Requirements(Displayed):
    """Table of what a run had to keep: one row for each requirement, as in ``summary.json``."""

    rows: tuple[Mapping[str, Any], ...]

    def facts(self) -> dict[str, str]:
        """Number of requirements, and the broken ones."""
        broken = [str(row["name"]) for row in self.rows if not row["held"]]
        return {"requirements": str(len(self.rows)), "broken": ", ".join(broken) or "none"}

    def to_frame(self) -> Any:
        """Table with one row for each requirement."""
        from pandas import DataFrame

        return DataFrame(list(self.rows))

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(index=False))


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Displayed):
    """Two runs side by side; ``result`` has their timing, centre of mass, margins and postures."""

    result: "RunComparison"

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        first, second = self.result.names
        return {"first": first, "second": second, "matched phases": str(self.result.matched_phases)}

    def plot(self, figure: str = "compare_timing") -> "Figure":
        """Draw a figure of both; InputError if there is no such one, or the runs have no data for it.

        Args:
            figure: ``compare_timing``, ``compare_planes``, ``compare_scene``, ``compare_margin`` or
                ``compare_postures``.
        """
        from manikin.reports.figures import COMPARISONS

        return _drawn(COMPARISONS, figure, self.result)


def plan(scenario: str | Path | Scenario, **options: Any) -> Run:
    """Plan a scenario without executing it; InputError if it is not usable.

    Args:
        scenario: Name of a built-in scenario, a scenario file, or a scenario.
        options: ``body``, ``variant``, ``friction``, ``overrides``, ``seed`` and ``out`` as of
            :func:`simulate`.
    """
    return _run(_changed(scenario, execution="none", **_job_options(options)), **options)


def simulate(
    scenario: str | Path | Scenario | Run, *, push: Mapping[str, float] | None = None, **options: Any
) -> Run:
    """Plan a scenario and execute it in the physics engine; InputError if it is not usable.

    Args:
        scenario: Name of a built-in scenario, a scenario file, a scenario, or a run of one.
        push: ``force_N``, ``direction_deg``, ``duration_s`` and ``at_s`` of a push on the way, or None.
        options: ``body``, a human whose stature, mass and sex are taken; ``variant``; ``friction`` of soles
            and points; ``overrides``, such as ``["planning.min_margin=15"]``; ``seed``; ``out``, a run
            directory that is kept.
    """
    source = scenario.scenario if isinstance(scenario, Run) else scenario
    sections = {} if push is None else {"push": dict(push)}
    return _run(_changed(source, execution="required", **sections, **_job_options(options)), **options)


def walk(
    to: Place, *, start: Place = (0.0, 0.0, 0.0), body: BodyModel | None = None,
    max_speed: float | None = None, seed: int | None = None, out: str | Path | None = None,
) -> Run:  # fmt: skip
    """Walk to a place as people do: path by optimal control, whole body from recorded walks.

    Args:
        body: Who walks; the default human when omitted.
        max_speed: Limit of the speed over the floor [m/s]; InputError if a value is not usable.
    """
    from manikin.scenarios.planned import walk_task

    return _run(_with_body(walk_task(to, start=start, max_speed=max_speed), body), seed=seed, out=out)


def push(
    force: float, direction: float = 0.0, *, duration: float = 0.1, body: BodyModel | None = None,
    seed: int | None = None, out: str | Path | None = None, **recovery: Any,
) -> Run:  # fmt: skip
    """Push a standing body and see whether it stays on its feet; InputError if a value is not usable.

    Args:
        force: [N].
        direction: Of the force, counter-clockwise from the body's forward axis [deg].
        duration: Of the push [s].
        body: A human; the body of Kudoh when omitted.
        recovery: Keys of a scenario's ``recovery``, such as ``feet="free"`` and ``steps=1``.
    """
    from manikin.scenarios.planned import push_task

    model = "kudoh" if body is None else "human"
    job = push_task(force, direction, duration=duration, body={"model": model}, recovery=recovery)
    return _run(_with_body(job, body), seed=seed, out=out)


def adapt(
    path: str | Path, *, body: BodyModel | None = None, scene: str | Path | Scenario | None = None,
    at: Place | None = None, pace: float | None = None, window: tuple[float, float] | None = None,
    out: str | Path | None = None, **options: Any,
) -> Run:  # fmt: skip
    """Make a recorded motion with another body or in another place, and execute it; InputError if unusable.

    What has changed from the recording is ``summary["adaptation"]``.

    Args:
        path: Recording, as of :func:`read`.
        body: A human; the recorded person when omitted.
        scene: Scenario, or its name or file, whose scene it is made in; where it was recorded when omitted.
        at: Where in the scene the motion begins; the recording's coordinates when omitted.
        pace: Duration as a multiple of the recorded one; 1, or slower if needed, when omitted.
        window: Start and end of the part that is taken [s].
        options: Those of :class:`manikin.analysis.AnalysisOptions`.
    """
    from manikin.pipeline.adapt import AdaptationTask
    from manikin.pipeline.adapt import adapt as adapted

    place = scene if scene is None or isinstance(scene, Scenario) else load_scene(scene)
    options.setdefault("as_recorded", True)
    analysis = analyze_file(path, AnalysisOptions(**options))
    kept = None if out is not None else TemporaryDirectory(prefix="manikin-")
    folder = Path(kept.name) / Path(path).stem if kept is not None else Path(str(out))
    task = AdaptationTask(scene=place, at=at, pace=pace, window=window)
    result = adapted(analysis, task, body=body, friction=options.get("friction"), out=folder)
    return Run(result.summary, folder, load_scenario(folder / SCENARIO), kept)


def compare(first: Run | str | Path, second: Run | str | Path) -> Comparison:
    """Compare the timing, centre of mass, margins and postures of two runs, or of their directories.

    Raises:
        InputError: If a directory is not that of a run.
    """
    from manikin.reports.comparison import compare_runs

    records = [run.record if isinstance(run, Run) else read_run(run) for run in (first, second)]
    return Comparison(compare_runs(*records))


def _exported(
    content: MotionFile, folder: Path, format_name: str, out: str | Path | None, which: str | None,
    rate: float | None, options: Mapping[str, Any],
) -> Path:  # fmt: skip
    from manikin.reports.export import ExportOptions, export_motion

    known = [item.name for item in fields(ExportOptions)]
    if unknown := sorted(set(options) - set(known)):
        raise InputError(f"option {unknown[0]!r} is not known; valid: {', '.join(known)}")
    if not content.motions:
        raise InputError("there is no motion to export; valid: a run that planned one")
    chosen = ExportOptions(**options)
    return export_motion(content, folder, format_name, out=out, which=which, rate=rate, options=chosen)


def _drawn(figures: Mapping[str, Callable[[Any], "Figure"]], name: str, data: Any) -> "Figure":
    if name not in figures:
        raise InputError(f"figure is {name!r}; valid: {', '.join(figures)}")
    return figures[name](data)


def _job_options(options: dict[str, Any]) -> dict[str, Any]:
    """Take what changes the scenario out of the options of a run."""
    known = ("body", "variant", "friction", "overrides", "seed", "out")
    unknown = [name for name in options if name not in known]
    if unknown:
        raise InputError(f"option {unknown[0]!r} is not known; valid: {', '.join(known)}")
    return {name: options.pop(name) for name in known[:4] if name in options}


def _changed(
    source: str | Path | Scenario, *, body: BodyModel | None = None, variant: str | None = None,
    friction: float | None = None, overrides: Sequence[str] = (), **sections: Any,
) -> Scenario:  # fmt: skip
    job = source if isinstance(source, Scenario) else load_scenario(str(source), variant)
    settings = list(overrides)
    if friction is not None:
        section = "supports" if job.file.supports is not None else "contacts"
        settings.append(f"{section}.friction={friction!r}")
    return _with_body(job.with_overrides(settings), body).replaced(**sections)


def _with_body(job: Scenario, body: BodyModel | None) -> Scenario:
    if body is None:
        return job
    if body.sex is None:
        raise InputError(f"body is {body.name!r}; valid: a human, whose stature, mass and sex are taken")
    return job.with_body(body.stature, body.mass, body.sex)


def _run(job: Scenario, *, seed: int | None = None, out: str | Path | None = None) -> Run:
    from manikin.pipeline.runner import run

    kept = None if out is not None else TemporaryDirectory(prefix="manikin-")
    folder = Path(kept.name) / job.name if kept is not None else Path(str(out))
    result = run(job, out=folder, seed=seed)
    return Run(result.summary, folder, job, kept)


@dataclass(frozen=True, eq=False, repr=False)
class RecordedMotion(Displayed):
    """A recording of a person, markers or joints of a skeleton, as it was read from the file ``source``."""

    recording: Recording | MarkerRecording
    source: Path

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        kind = "markers" if isinstance(self.recording, MarkerRecording) else "skeleton"
        frames, rate = len(self.recording), self.recording.rate
        return {"file": self.source.name, "kind": kind, "frames": str(frames), "rate": f"{rate:g} Hz"}

    def analyze(self, **options: Any) -> "MeasuredRecording":
        """Measure it, by options of :class:`manikin.analysis.AnalysisOptions`; InputError if that fails."""
        return MeasuredRecording(measure(self.recording, AnalysisOptions(**options), self.source.stem))


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredRecording(Displayed):
    """A recorded person, measured with the yardsticks of plans; ``analysis`` has every measure."""

    analysis: Analysis

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        return self.analysis.facts()

    def to_frame(self) -> "DataFrame":
        """Table with one row for each frame; units stand in the names of the columns."""
        from pandas import DataFrame

        columns = self.analysis.series()
        return DataFrame(columns).set_index(next(iter(columns)))

    def plot(self) -> "Drawing":
        """Sheet of postures, supports, forces, margin, height and scores over time."""
        from manikin.reports.analysis_sheet import recording_sheet

        return Drawing(recording_sheet(self.analysis, str(self)))

    def export(self, format_name: str, out: str | Path, *, rate: float | None = None, **options: Any) -> Path:
        """Write the reconstructed motion for other programs and return the file; see :meth:`Run.export`.

        Args:
            format_name: One of :data:`manikin.reports.export.FORMATS`.
            out: File to write.
            rate: Samples per second [Hz]; the format's own when omitted.
            options: Of :class:`manikin.reports.export.ExportOptions`.

        Raises:
            InputError: If a value is not usable.
        """
        content = MotionFile(recorded=self.analysis.motion, body=self.analysis.body)
        return _exported(content, Path(out).parent, format_name, out, None, rate, options)

    def view(self, port: int = 8080) -> None:
        """Show the measured motion in the browser until Ctrl-C."""
        from manikin.reports.export import film_of_motion

        content = MotionFile(recorded=self.analysis.motion, body=self.analysis.body)
        serve(content, port, print, film=film_of_motion)


@dataclass(frozen=True)
class Drawing:
    """An SVG drawing, which notebooks show."""

    svg: str

    def __repr__(self) -> str:
        """Size of the text."""
        return f"Drawing({len(self.svg)} characters of SVG)"

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | Path) -> None:
        """Write it to a file, as a whole; MotionFileError if it cannot be written."""
        write_result(path, self.svg)


def read(
    path: str | Path, frames: tuple[int, int] | None = None, markers: str | Path | None = None
) -> RecordedMotion:
    """Read a recording of a person.

    Args:
        path: C3D or TRC for markers, BVH or AMC for a skeleton; InputError if it cannot be read.
        frames: First frame and the one after the last; None for all.
        markers: Marker map, a YAML file, for names of markers that do not say what they mark.
    """
    return RecordedMotion(read_recording(path, frames, markers), Path(path))


def analyze(path: str | Path, **options: Any) -> MeasuredRecording:
    """Read a recording and measure it; options are those of :class:`manikin.analysis.AnalysisOptions`.

    Raises:
        InputError: If it cannot be read, or is not a person's motion that can be measured.
    """
    return read(path, options.get("frames"), options.get("markers")).analyze(**options)
