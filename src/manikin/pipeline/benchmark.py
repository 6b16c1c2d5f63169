"""Benchmark: families of random scenes times seeds, contacts alone or whole runs.

A task is one scene. Its entry depends on nothing but the family, the seed and the options: neither on the
order of the tasks nor on the number of processes. Only times differ.

::

    DIR/benchmark.json         options, families with their counts, entries of all tasks
    DIR/tasks/FAMILY-SEED.json the entry of a task, written as soon as it is known
    DIR/scenes/FAMILY-SEED.yaml its scenario, for manikin run and for other planners, with its meshes
    DIR/report.html            the counts, and every task with its body, times and reason
"""

import tempfile
import time as clock
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from manikin.errors import ManikinError
from manikin.pipeline.jobs import TIME_LIMIT, JobDirectory, StageName, digest, do_jobs, job_entry
from manikin.runtime import __version__
from manikin.runtime.files import ResultDirectory
from manikin.scenarios.families import FAMILIES, Family, draw_scene

BENCHMARK = "benchmark.json"
SCENES = "scenes"
SIZES = ("stature_m", "mass_kg", "sex")
"""Keys of a body that an entry tells."""


@dataclass(frozen=True)
class BenchmarkTask:
    """One scene of a family, by its seed, and what is done with it.

    Attributes:
        stage: ``"contacts"``, or ``"all"`` for a whole run.
        time_limit: Processor time after which it is ended [s].
        folder: Where the meshes of the scene are.
    """

    family: str
    seed: int
    stage: StageName = "contacts"
    time_limit: float = TIME_LIMIT
    folder: Path | None = None

    @property
    def name(self) -> str:
        """``FAMILY-SEED``."""
        return f"{self.family}-{self.seed}"


def run_task(task: BenchmarkTask) -> dict[str, Any]:
    """Draw a scene and plan it; whatever happens becomes an entry.

    Returns:
        ``family``, ``seed``, and what :func:`~manikin.pipeline.jobs.job_entry` says.
    """
    entry = job_entry(
        lambda: draw_scene(FAMILIES[task.family], task.seed, task.folder), task.stage, task.time_limit, SIZES
    )
    return {"family": task.family, "seed": task.seed, **entry}


class BenchmarkDirectory(JobDirectory):
    """Directory of a benchmark; tasks that are done stay done."""

    kind, marks, writer = "benchmark", (BENCHMARK,), "manikin benchmark"

    def is_same(self, entry: Mapping[str, Any], job: BenchmarkTask) -> bool:
        """Whether an entry is of the same scene and stage."""
        try:
            scene = digest(draw_scene(FAMILIES[job.family], job.seed))
        except ManikinError:
            scene = None
        return (entry.get("stage"), entry.get("scene")) == (job.stage, scene)


def run_benchmark(
    families: Sequence[Family], seeds: Sequence[int], *, stage: StageName = "contacts",
    path: Path | None = None, jobs: int | None = None, time_limit: float = TIME_LIMIT, fresh: bool = False,
    report: Callable[[Mapping[str, Any], int, int], None] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Do the tasks of families times seeds, those that are not done yet, and count them.

    Args:
        stage: ``"contacts"`` for contacts alone, ``"all"`` for whole runs.
        path: Directory to keep everything in, or to go on with; nothing is kept when omitted.
        jobs: Processes; one per usable core when omitted.
        time_limit: Processor time after which a task is ended [s].
        fresh: Whether tasks that the directory has already are done again.
        report: Told each entry, how many are done, and of how many.

    Returns:
        ``manikin`` (version), ``complete``, ``stage``, ``first_seed``, ``seeds``, ``time_limit_s``,
        ``families`` and ``total`` (see :func:`counted`), ``tasks`` (see :func:`run_task`), ``wall_s``.

    Raises:
        ManikinError: If the directory cannot be written to, or a process ends before its time.
    """
    began = clock.perf_counter()
    asked = {
        "manikin": __version__, "complete": False, "stage": stage, "first_seed": seeds[0],
        "seeds": len(seeds), "time_limit_s": time_limit,
    }  # fmt: skip
    directory = None if path is None else BenchmarkDirectory(path)
    if directory is not None:
        directory.write(BENCHMARK, asked)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if directory is not None:
            folder = write_scenes(families, seeds, directory.path / SCENES)
        pairs = product((family.name for family in families), seeds)
        tasks = [BenchmarkTask(name, seed, stage, time_limit, folder) for name, seed in pairs]
        ordered = do_jobs(
            run_task, tasks, directory, name="benchmark", workers=jobs, fresh=fresh, report=report
        )
    result = asked | {"complete": True, **counted(ordered), "tasks": ordered}
    result["wall_s"] = clock.perf_counter() - began
    if directory is not None:
        directory.write(BENCHMARK, result)
    return result


def write_scenes(families: Iterable[Family], seeds: Sequence[int], folder: Path) -> Path:
    """Write scenes as scenario files with their meshes, and return the folder.

    Raises:
        MotionFileError: If they cannot be written.
    """
    directory = ResultDirectory(folder, "scenes")
    for family, seed in product(families, seeds):
        scenario = draw_scene(family, seed, folder)
        directory.write(f"{scenario.name}.yaml", scenario.to_short_yaml())
    return folder


def counted(entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of each family, and of all.

    Returns:
        ``families`` by name and ``total``: ``tasks``, ``contacts``, ``planned``, ``proved``, ``checked``
        (contacts that an independent check certified, None where nothing was checked), ``contacts_s``
        (processor time of the contact stage: ``median``, ``p95``, ``largest``), ``duration_s`` (median of
        the motions), ``computing_over_motion`` (median), ``failures`` (number by stage).
    """
    names = dict.fromkeys(str(entry["family"]) for entry in entries)
    families = {name: _counts([entry for entry in entries if entry["family"] == name]) for name in names}
    return {"families": families, "total": _counts(entries)}


def _counts(entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    found = [entry["processor_s"]["contacts"] for entry in entries if "contacts" in entry["processor_s"]]
    moved = [entry for entry in entries if entry["duration_s"] and entry["planned"]]
    verdicts = [entry["checked"]["certified"] for entry in entries if entry["checked"] is not None]
    failures = [entry["failure"]["stage"] for entry in entries if entry["failure"] is not None]
    ratios = [entry["processor_s"]["total"] / entry["duration_s"] for entry in moved]
    percentiles = {"median": 50.0, "p95": 95.0, "largest": 100.0}
    return {
        "tasks": len(entries),
        **{key: sum(bool(entry[key]) for entry in entries) for key in ("contacts", "planned", "proved")},
        "checked": sum(map(bool, verdicts)) if verdicts else None,
        "contacts_s": {name: _share(found, percent) for name, percent in percentiles.items()},
        "duration_s": _share([entry["duration_s"] for entry in moved], 50.0),
        "computing_over_motion": _share(ratios, 50.0),
        "failures": {stage: failures.count(stage) for stage in sorted(set(failures))},
    }


def _share(values: Sequence[float], percent: float) -> float | None:
    """A percentile; None without values."""
    return float(np.percentile(values, percent)) if values else None
