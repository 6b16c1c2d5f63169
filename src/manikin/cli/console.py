"""Options, output and exit status of the commands, and one job of the pipeline; bars, signals."""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from manikin.errors import InputError
from manikin.limits import AGE_RANGE, MASS_RANGE, STATURE_RANGE
from manikin.reports.summary_table import verdict_lines

if TYPE_CHECKING:
    from manikin.pipeline.stages import RunResult
    from manikin.scenarios import Scenario


class Interruption:
    """Context in which SIGINT and SIGTERM raise :class:`KeyboardInterrupt`.

    Both unwind the program, so that temporary files are removed.  SIGINT is listened to even
    where a shell starts background jobs with it ignored.  A native solver may swallow the
    exception and carry on with what it has; :meth:`check` raises it again if :attr:`requested`.
    While another library is imported the exception waits: some take it for a part that is not installed.
    """

    def __init__(self) -> None:
        self.requested = False
        self._before: dict[signal.Signals, Any] = {}
        self._outside: FrameType | None = None

    def __enter__(self) -> Self:
        # Elsewhere than in the main thread the host program decides about its signals.
        if threading.current_thread() is threading.main_thread():
            self._outside = sys._getframe(1)
            again = [signal.SIGALRM] if hasattr(signal, "setitimer") else []
            for number in (signal.SIGINT, signal.SIGTERM, *again):
                self._before[number] = signal.signal(number, self._stop)
        return self

    def __exit__(self, *error: object) -> None:
        if signal.SIGALRM in self._before:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._outside = None

    def check(self) -> None:
        """Raise :class:`KeyboardInterrupt` if a signal has come."""
        if self.requested:
            raise KeyboardInterrupt

    def _stop(self, _number: int, frame: FrameType | None) -> None:
        self.requested = True
        if hasattr(signal, "setitimer") and self._loads_library(frame):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)
            return
        raise KeyboardInterrupt

    def _loads_library(self, frame: FrameType | None) -> bool:
        """Whether code of another library runs for an import, inside of the last function of ours."""
        is_importing = is_foreign = False
        while frame is not None and frame is not self._outside:
            if str(frame.f_globals.get("__name__")).partition(".")[0] == _OURS:
                break
            of_import = frame.f_code.co_filename.startswith(_IMPORT)
            is_importing, is_foreign = is_importing or of_import, is_foreign or not of_import
            frame = frame.f_back
        return is_importing and is_foreign


_OURS = __name__.partition(".")[0]
_IMPORT = "<frozen importlib."
"""Beginning of the files of the functions that load modules, as tracebacks name them."""
_AGAIN = 0.02
"""Time after which an interruption is tried again [s]."""
DONE, BAD_INPUT, FAILED, INTERRUPTED = 0, 2, 3, 130
"""Exit status of the commands."""


def option(metavar: str, text: str, *names: str, **limits: Any) -> Any:
    """Option with a value: what stands for it, what the help says, its names, and ``min`` or ``max``."""
    return typer.Option(*names, metavar=metavar, help=text, **limits)


def flag(name: str, text: str) -> Any:
    """Option without a value: its name, and what the help says."""
    return typer.Option(name, help=text)


def argument(metavar: str, text: str) -> Any:
    """Argument: what stands for it, and what the help says."""
    return typer.Argument(metavar=metavar, help=text)


JsonOption = Annotated[bool, flag("--json", "Print one JSON object on standard output.")]
OutOption = Annotated[Path | None, option("DIR", "Directory. Default: one in runs; none with --json.")]
FiguresOption = Annotated[bool, typer.Option(help="Draw the figures into the directory.")]
HostOption = Annotated[
    str,
    option("ADDRESS", "Listen to this address, as 0.0.0.0, so that others can open the page by its token."),
]
JobsOption = Annotated[int | None, option("N", "Processes side by side; default: one per core.", min=1)]
FramesOption = Annotated[
    tuple[int, int] | None, option("FIRST STOP", "Frames from FIRST up to, not with, STOP; counted from 0.")
]
MarkersOption = Annotated[
    Path | None, option("MAP.yaml", "What markers mark, where their names do not say it.")
]
SexOption = Annotated[Literal["male", "female"] | None, option("male|female", "Sex of the person.")]
LoadHandOption = Annotated[
    Literal["left", "right", "both"] | None,
    option("left|right|both", "Hand that carries --load-kg. Default: both."),
]


def of_a_person(metavar: str, name: str, unit: str, valid: tuple[float, float]) -> Any:
    """Option with another size or age of the person."""
    low, high = valid
    return option(metavar, f"Other {name}, {low:g} to {high:g} {unit}.", min=low, max=high)


StatureOption = Annotated[float | None, of_a_person("M", "stature", "m", STATURE_RANGE)]
MassOption = Annotated[float | None, of_a_person("KG", "mass", "kg", MASS_RANGE)]
AgeOption = Annotated[float | None, of_a_person("YEARS", "age", "years", AGE_RANGE)]
StrengthOption = Annotated[float | None, option("X", "Torque limits over those of a healthy adult.")]
MotionArgument = Annotated[Path, argument("DIR|FILE", "Run directory or motion file (.h5).")]


def directory_of(out: Path | None, name: str, *, json: bool) -> Path | None:
    """Directory of the files: as asked for, else ``runs/NAME``; none beside JSON."""
    return out if out is not None else None if json else Path("runs") / name


def run_job(
    job: "Scenario", out: Path | None, interruption: Interruption, *, draw: bool, json: bool,
    part: str = "", shown: Sequence[str] = (), beside: Mapping[str, Any] | None = None,
) -> int:  # fmt: skip
    """Run a scenario with bars on standard error, print its summary, and return the exit status.

    Args:
        out: Directory that was asked for.
        draw: Whether figures are drawn into the directory.
        part: Of the summary, whose values ``shown`` are printed after the verdict and the requirements.
        beside: Defaults of the part's values, which then stand in the JSON beside those of the summary.
    """
    from manikin.pipeline import runner

    directory = directory_of(out, job.name, json=json)
    return report_run(
        lambda progress: runner.run(job, out=directory, seed=job.seed, progress=progress), directory,
        interruption, draw=draw, json=json, part=part, shown=shown, beside=beside,
    )  # fmt: skip


def report_run(
    make: "Callable[[Callable[..., None]], RunResult]", directory: Path | None, interruption: Interruption,
    *, draw: bool, json: bool, part: str = "", shown: Sequence[str] = (),
    beside: Mapping[str, Any] | None = None, table: Callable[[dict[str, Any]], dict[str, Any]] | None = None,
) -> int:  # fmt: skip
    """Make a run with bars on standard error, print its summary, and return the exit status.

    Args:
        make: Makes the run; told what reports its progress.
        directory: Where its files are, or None.
        draw: Whether figures are drawn into the directory.
        part: Of the summary, as in :func:`run_job`.
        shown: Keys of the part that are printed.
        beside: Defaults of the part's values.
        table: Makes further rows to be printed of a finished summary.
    """
    with bars(interruption) as progress:
        result = make(progress)
        interruption.check()
        page = None
        if directory is not None:
            from manikin.reports.export import write_outputs
            from manikin.reports.pages import write_run_page

            if draw:
                write_outputs(directory, progress)
            page = write_run_page(directory)
    summary = dict(result.summary)
    if json:
        print_json(summary if beside is None else {**beside, **summary[part], **summary})
    else:
        for line in verdict_lines(summary):
            typer.echo(line)
        if shown:
            print_table({key: summary[part].get(key) for key in shown})
        if table is not None and (rows := table(summary)):
            print_table(rows)
        if directory is not None and result.motion is not None:
            typer.echo(f"watch it with: manikin view {directory}")
        if page is not None:
            typer.echo(f"report: {page}")
    return DONE if summary["succeeded"] else FAILED


@contextmanager
def bars(interruption: Interruption) -> Iterator[Callable[..., None]]:
    """Context with one bar per stage on standard error, which yields what reports (stage, share, remark).

    On a terminal the bars move; elsewhere each stage is one line when it is done. Standard output is kept
    clean. Each report asks whether the command is to be interrupted.
    """
    console, known, done = Console(stderr=True), dict[str, TaskID](), set[str]()
    remark_column = TextColumn("{task.fields[remark]}")
    words, percents = TextColumn("{task.description:<14}"), TextColumn("{task.percentage:>3.0f} %")
    columns = words, BarColumn(bar_width=30), percents, TimeElapsedColumn(), remark_column
    progress = Progress(*columns, console=console, disable=not console.is_terminal)

    def report(stage: str, share: float, remark: str = "") -> None:
        interruption.check()
        if stage not in known:
            known[stage] = progress.add_task(stage, total=1.0, remark=remark)
        progress.update(known[stage], completed=share, remark=remark)
        if share >= 1.0 and stage not in done:
            done.add(stage)
            if progress.disable:
                console.print(f"{stage}: done {remark}".rstrip(), highlight=False, markup=False)

    with stdout_kept_clean(), progress:
        yield report


def refuse(given: bool, option: str, because: str) -> None:
    """Refuse an option, by an InputError, if it was given where it has no meaning."""
    if given:
        raise InputError(f"{option} does not go with this run: {because}; valid: leave it out")


def refuse_given(options: Mapping[str, Any], because: str) -> None:
    """Refuse the first option, by name, whose value is not None."""
    for name, value in options.items():
        refuse(value is not None, name, because)


def given(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values that are not None."""
    return {key: value for key, value in values.items() if value is not None}


def flattened(value: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested sections as one level of dotted keys; long mappings and lists as their size."""
    flat: dict[str, Any] = {}
    for key, item in value.items():
        if isinstance(item, dict) and key != "peak_torque_Nm":
            flat.update(flattened(item, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = item
    return flat


def print_table(rows: dict[str, Any]) -> None:
    """Print names and values in two columns."""
    width = max(len(name) for name in rows)
    for name, value in rows.items():
        typer.echo(f"{name:{width}}  {_shown(value)}")


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, dict):
        if value and all(isinstance(item, (int, float)) for item in value.values()):
            name, top = max(value.items(), key=lambda item: abs(item[1]))
            return f"largest {top:.4g} ({name})"
        return " ".join(_shown(item) for item in value.values()) or "-"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_shown(item) for item in value) + "]"
    return "-" if value is None else str(value)


def print_json(value: Mapping[str, Any]) -> None:
    """Print the one object that ``--json`` promises."""
    from manikin.runtime.files import to_json

    typer.echo(to_json(value))


def print_report(report: Mapping[str, Any], shown: dict[str, Any], *, json: bool) -> None:
    """Print a report as JSON, or what is ``shown`` of it in two columns."""
    if json:
        print_json(report)
    else:
        print_table(shown)


def print_lines(
    report: Mapping[str, Any], lines: Iterable[str], page: Path | None = None, *, json: bool
) -> None:
    """Print a report as JSON, or in lines with where its page is."""
    if json:
        print_json(report)
    else:
        typer.echo("\n".join(lines if page is None else [*lines, f"report: {page}"]))


def processes(jobs: int | None) -> int:
    """How many processes work side by side: as asked for, else one per core."""
    from joblib import cpu_count

    return jobs or cpu_count()


def announce(url: str) -> None:
    """Say where a viewer is served, and for whom."""
    others = "for who has this address" if "token=" in url else "--host 0.0.0.0 opens it for other computers"
    typer.echo(f"viewer at {url} (Ctrl-C ends it; {others})", err=True)


def complain(message: str, status: int) -> int:
    """Say what was wrong, in one line, and return the exit status."""
    typer.echo(f"manikin: {' '.join(message.split())}", err=True)
    return status


@contextmanager
def stdout_kept_clean() -> Iterator[None]:
    """Send what libraries, native ones too, print on standard output to standard error meanwhile."""
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        ctypes.CDLL(None).fflush(None)  # C's own buffer, which a solver's banner may wait in
        os.dup2(saved, 1)
        os.close(saved)
