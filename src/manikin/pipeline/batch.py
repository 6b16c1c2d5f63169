"""Many runs at once: every built-in scenario with its variants, one process per run.

A run is a process of its own, so that one which crashes or hangs takes no other with it, and its
result does not depend on what ran before or beside it.
"""

import json
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from joblib import cpu_count

from manikin.runtime.child import environment_of_child
from manikin.runtime.files import ResultDirectory
from manikin.scenarios import Scenario, list_scenarios, list_variants, load_scenario

TIME_LIMIT = 1800.0
"""Wall time after which a run is ended [s]."""
_EXPLAINED = 3
"""Exit status of a run that ended in an explained failure."""


class BatchDirectory(ResultDirectory):
    """Directory of many run directories and their results; what else is in it is left alone."""

    kind, exclusive = "set of runs", True
    RESULTS: ClassVar[str] = "results.json"
    """File of the results, written when every run has ended."""

    def __init__(self, path: str | Path) -> None:
        """Create the directory, or take over one, whose earlier results are removed; see the base."""
        super().__init__(path)
        self.remove(self.RESULTS, f".{self.RESULTS}.*.tmp")


@dataclass(frozen=True)
class Job:
    """One run to be done.

    Attributes:
        scenario: Name of a built-in scenario, or a scenario file.
        variant: Name of one of its variants, or None.
        expected: ``"success"`` or ``"failure"``, see the key ``expect`` of a scenario.
        stage: Stage that is expected to fail, or None for any.
        because: Why; empty if the scenario does not say.
    """

    scenario: str
    variant: str | None = None
    expected: str = "success"
    stage: str | None = None
    because: str = ""

    @classmethod
    def of(cls, name: str, variant: str | None, scenario: Scenario) -> "Job":
        """The run of a scenario that was loaded by this name and variant."""
        wanted = scenario.file.expect
        return cls(name, variant, wanted.outcome, wanted.stage, wanted.because or "")

    @property
    def name(self) -> str:
        """As the command line takes it: ``NAME`` or ``NAME@VARIANT``."""
        return self.scenario if self.variant is None else f"{self.scenario}@{self.variant}"

    @property
    def folder(self) -> str:
        """Name of its run directory."""
        return replace(self, scenario=Path(self.scenario).stem).name


@dataclass(frozen=True, eq=False)
class RunOptions:
    """Options of every run.

    Attributes:
        out: Directory of the run directories, or None to write none.
        figures: Whether figures are drawn into them.
        arguments: Further arguments of ``manikin run``, such as ``("--seed", "3")``.
    """

    out: Path | None = None
    figures: bool = False
    arguments: tuple[str, ...] = ()

    def command(self, job: Job) -> list[str]:
        """The process of a job."""
        words = [sys.executable, "-m", "manikin", "run", job.name, "--json", *self.arguments]
        if self.out is not None:
            words += ["--out", str(self.out / job.folder)]
        return words if self.figures else [*words, "--no-figures"]


def built_in_jobs(*, statures: bool = False) -> tuple[Job, ...]:
    """Every built-in scenario followed by its variants, in the order of ``manikin scenarios``.

    Those whose meshes are of a distribution that is not installed are left out.

    Args:
        statures: Whether to leave out bodies without a stature, such as a point mass or an insect.

    Raises:
        ScenarioError: If one of the files is not valid.
    """
    pairs = [(name, variant) for name in list_scenarios() for variant in (None, *list_variants(name))]
    loaded = [(*pair, load_scenario(*pair)) for pair in pairs]
    loaded = [of for of in loaded if of[-1].missing_mesh() is None]
    return tuple(Job.of(*of) for of in loaded if not statures or of[-1].file.body.model == "human")


def run_jobs(
    jobs: Sequence[Job], command: Callable[[Job], list[str]], *, workers: int | None = None,
    time_limit: float = TIME_LIMIT, report: Callable[[dict[str, Any], int], None] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Run jobs side by side and gather their summaries.

    Args:
        command: Process of a job; it prints the run's summary as JSON on standard output.
        workers: Runs at a time; one per usable core when omitted.
        time_limit: Wall time after which a run is ended [s].
        report: Told the entry of each run that has ended, and how many have.

    Returns:
        ``runs`` in the order of the jobs, each the summary of the run with ``variant``, ``expected``,
        ``expected_because`` and ``as_expected``; their numbers, see :func:`counts`; ``wall_s``.
    """
    began = clock.perf_counter()
    result: dict[int, dict[str, Any]] = {}
    with closing(_completed(jobs, command, workers or cpu_count(), time_limit)) as completed:
        for index, entry in completed:
            result[index] = entry
            if report is not None:
                report(entry, len(result))
    runs = [result[index] for index in range(len(jobs))]
    return {"runs": runs, **counts(runs), "wall_s": clock.perf_counter() - began}


def counts(runs: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Numbers of runs planned, proved, fallen, and that did or did not succeed or end as expected."""
    number = {key: sum(bool(run[key]) for run in runs) for key in ("planned", "proved", "succeeded")}
    fell = sum(bool((run["execution"] or {}).get("fell")) for run in runs)
    right = sum(bool(run["as_expected"]) for run in runs)
    return {
        **number, "failed": len(runs) - number["succeeded"], "fell": fell,
        "as_expected": right, "not_as_expected": len(runs) - right,
    }  # fmt: skip


def _completed(
    jobs: Sequence[Job], command: Callable[[Job], list[str]], workers: int, time_limit: float
) -> Generator[tuple[int, dict[str, Any]]]:
    """Index and entry of each job, in the order in which they end.

    One thread waits for each process. When the iterator is closed early, processes that run are ended, at the
    latest by their threads.
    """
    running: set[subprocess.Popen[str]] = set()
    closed = threading.Event()

    def run(job: Job) -> dict[str, Any]:
        began, status = clock.perf_counter(), None
        # A session of its own: Ctrl-C reaches this process alone, which then ends the others in order.
        process = subprocess.Popen(
            command(job), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True, env=environment_of_child(),
        )  # fmt: skip
        running.add(process)
        try:
            output, errors = process.communicate(timeout=0.0 if closed.is_set() else time_limit)
            status = process.returncode
        except subprocess.TimeoutExpired:
            _end(process)
            output, errors = process.communicate()
        running.discard(process)
        seconds = clock.perf_counter() - began
        summary = None if status is None else _summary(output)
        ended = "broken off"
        if summary is not None:
            ended = "success" if summary["succeeded"] else "failure" if status == _EXPLAINED else ended
        else:
            late = f"did not end within {time_limit:g} s"
            ending = late if status is None else f"ended with status {status}"
            summary = _broken_off(job, f"the run {ending}", errors, seconds)
        right_stage = job.stage in (None, (summary["failure"] or {}).get("stage"))
        return summary | {
            "variant": job.variant, "expected": job.expected, "expected_because": job.because or None,
            "as_expected": ended == job.expected and right_stage,
        }  # fmt: skip

    with ThreadPoolExecutor(workers) as pool:
        futures = {pool.submit(run, job): index for index, job in enumerate(jobs)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            closed.set()
            pool.shutdown(wait=False, cancel_futures=True)
            for process in list(running):
                _end(process)


def _end(process: subprocess.Popen[str]) -> None:
    """Ask a process to end, and make it."""
    process.terminate()
    try:
        process.wait(timeout=10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _summary(output: str) -> dict[str, Any] | None:
    try:
        summary = json.loads(output)
    except ValueError:
        return None
    return summary if isinstance(summary, dict) and "succeeded" in summary else None


def _broken_off(job: Job, what: str, errors: str, seconds: float) -> dict[str, Any]:
    """Summary of a run that has none."""
    lines = errors.strip().splitlines()
    reason = f"{what}: {lines[-1]}" if lines else what
    failure = {"stage": "run", "reason": reason, "time_s": 0.0, "where": ""}
    stages = dict.fromkeys(("centroidal", "wholebody", "execution"))
    unknown = dict.fromkeys(("stature_m", "mass_kg", "seed"))
    return {
        "scenario": job.folder, **unknown, "verdict": "failed", "planned": False, "proved": False,
        "succeeded": False, "failure": failure, "requirements": [], **stages, "wall_s": seconds,
    }  # fmt: skip
