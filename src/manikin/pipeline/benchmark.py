"""Benchmark: families of random scenes times seeds, contacts alone or whole runs.

A task is one scene. Its entry depends on nothing but the family, the seed and the options: neither on the
order of the tasks nor on the number of processes. Only times differ.

::

    DIR/benchmark.json         options, families with their counts, entries of all tasks
    DIR/tasks/FAMILY-SEED.json the entry of a task, written as soon as it is known
    DIR/scenes/FAMILY-SEED.yaml its scenario, for manikin run and for other planners, with its meshes
    DIR/report.html            the counts, and every task with its body, times and reason
"""

import hashlib
import tempfile
import time as clock
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from joblib import cpu_count

from manikin.errors import ManikinError, TimeLimitError
from manikin.pipeline.run_directory import CONTACT_PLAN
from manikin.pipeline.runner import run
from manikin.pipeline.stages import Report, RunContext
from manikin.pipeline.stages.contact_stage import plan_contacts
from manikin.pipeline.stages.context import plan_in_world
from manikin.runtime import __version__
from manikin.runtime.files import ResultDirectory
from manikin.runtime.parallel import processor_time_limit, side_by_side
from manikin.scenarios import Scenario
from manikin.scenarios.families import FAMILIES, Family, draw_scene
from manikin.verification import PlannedContacts, check_contact_plan

BENCHMARK = "benchmark.json"
SCENES = "scenes"
TASKS = "tasks"
TIME_LIMIT = 600.0
"""Processor time after which a task is ended [s]."""
OUTCOMES = ("proved", "planned", "contacts", "failed")
"""How far a task came, the farthest first."""
StageName = Literal["contacts", "all"]
SIZES = ("stature_m", "mass_kg", "sex")
"""Keys of a body that an entry tells."""
_AFTER = {"planned": ("execution",), "contacts": ("centroidal", "wholebody", "execution", "check")}
"""Stages in which a task that is ended has come so far already."""


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
        ``family``, ``seed``, ``stage``, ``scene`` (digest of the scenario), ``body``, ``outcome`` (one of
        :data:`OUTCOMES`), ``contacts``, ``planned`` and ``proved`` (whether it came so far), ``checked``
        (verdict of an independent check of the contacts, or None), ``failure`` (``stage``, ``reason``,
        ``where``, ``time_s``, or None), ``steps``, ``duration_s`` of the motion, and ``processor_s`` by
        stage, with ``total``.
    """
    stages = _StageClock()
    entry: dict[str, Any] = {
        "family": task.family, "seed": task.seed, "stage": task.stage, "scene": None, "body": None,
        "outcome": "failed", "contacts": False, "planned": False, "proved": False, "checked": None,
        "failure": None, "steps": None, "duration_s": None,
    }  # fmt: skip
    try:
        with processor_time_limit(task.time_limit):
            scenario = draw_scene(FAMILIES[task.family], task.seed, task.folder)
            body = scenario.file.body.model_dump(mode="json", include={"model", *SIZES}, exclude_none=True)
            entry |= {"scene": digest(scenario), "body": body}
            summary = _contacts(scenario, stages) if task.stage == "contacts" else _whole(scenario, stages)
            entry |= _outcome(summary, task.stage)
    except TimeLimitError as error:
        reached = [name for name, stages_after in _AFTER.items() if stages.current in stages_after]
        entry |= dict.fromkeys(reached, True)
        entry |= {"outcome": (reached or ["failed"])[0], "failure": _failure(stages.current, str(error))}
    except ManikinError as error:
        entry["failure"] = _failure("scenario" if entry["scene"] is None else stages.current, str(error))
    except Exception as error:  # a defect of the library is an entry as well, and ends no other task
        last = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"
        entry["failure"] = _failure("error", reason, stages.current)
    return {**entry, "processor_s": stages.times()}


def digest(scenario: Scenario) -> str:
    """First letters of the digest of a scenario's content, which change if the scene does."""
    text = scenario.file.model_dump_json(exclude_none=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class _StageClock:
    """Processor time by stage, told by the progress of a run."""

    def __init__(self) -> None:
        self.current = "scene"
        self._times: dict[str, float] = {}
        self._last = clock.process_time()

    def __call__(self, stage: str, _share: float) -> None:
        """Take a report of progress; the time since the last one is that of the stage before."""
        self._count()
        self.current = stage

    def times(self) -> dict[str, float]:
        """Times so far [s], with their ``total``."""
        self._count()
        return {**self._times, "total": sum(self._times.values())}

    def _count(self) -> None:
        now = clock.process_time()
        self._times[self.current] = self._times.get(self.current, 0.0) + now - self._last
        self._last = now


def _contacts(scenario: Scenario, stages: _StageClock) -> dict[str, Any]:
    """Summary of the contact stage alone, with the verdict of the check."""
    context = RunContext.of(scenario)
    report = Report(context, None, stages, clock.perf_counter())
    planned = plan_contacts(context, report)
    stages("check", 0.0)
    checked = None
    if planned is not None and planned.plan is not None:
        checked = checked_contacts(scenario, plan_in_world(planned.plan, report.transform))
    return report.close() | {"checked": checked}


def _whole(scenario: Scenario, stages: _StageClock) -> dict[str, Any]:
    """Summary of a run, with the verdict of the check of its contacts."""
    with tempfile.TemporaryDirectory() as temporary:
        directory = Path(temporary) / "run"
        summary = run(scenario, out=directory, progress=stages).summary
        stages("check", 0.0)
        file = directory / CONTACT_PLAN
        return {**summary, "checked": checked_contacts(scenario, file) if file.is_file() else None}


def checked_contacts(scenario: Scenario, plan: PlannedContacts | Path) -> dict[str, Any]:
    """Verdict of the independent check of a contact plan.

    Returns:
        ``certified``, ``verdict`` in one line, ``broken`` (keys of the requirements that do not hold) and
        ``room_m`` of the centre of mass.
    """
    try:
        result = check_contact_plan(scenario, plan)
    except ManikinError as error:
        return {"certified": False, "verdict": f"refused: {error}", "broken": [], "room_m": None}
    broken = sorted(result.requirements.broken)
    return {"certified": result.held, "verdict": result.verdict, "broken": broken, "room_m": result.room}


def _outcome(summary: Mapping[str, Any], stage: StageName) -> dict[str, Any]:
    """What an entry takes from the summary of a run."""
    contacts = summary["contacts"] or {}
    found = contacts.get("steps") is not None
    reached = {"proved": summary["proved"], "planned": bool(summary["planned"]), "contacts": found}
    blocks = [summary[name] or {} for name in ("wholebody", "centroidal")]
    done = found if stage == "contacts" else summary["succeeded"]
    return {
        **reached, "outcome": next((name for name in OUTCOMES if reached.get(name)), "failed"),
        "checked": summary.get("checked"), "failure": None if done else summary["failure"],
        "steps": contacts.get("steps"),
        "duration_s": next((block["duration_s"] for block in blocks if block.get("duration_s")), None),
    }  # fmt: skip


def _failure(stage: str, reason: str, where: str = "") -> dict[str, Any]:
    return {"stage": stage, "reason": " ".join(reason.split()), "time_s": 0.0, "where": where}


class BenchmarkDirectory(ResultDirectory):
    """Directory of a benchmark; tasks that are done stay done."""

    kind, marks, writer = "benchmark", (BENCHMARK,), "manikin benchmark"

    def known(self, task: BenchmarkTask) -> dict[str, Any] | None:
        """Entry of a task that is done; None if it is not, or was done with another scene or stage."""
        file = f"{TASKS}/{task.name}.json"
        if not (self.path / file).is_file():
            return None
        entry = self.read(file)
        try:
            scene = digest(draw_scene(FAMILIES[task.family], task.seed))
        except ManikinError:
            scene = None
        return entry if (entry.get("stage"), entry.get("scene")) == (task.stage, scene) else None

    def keep(self, entry: Mapping[str, Any]) -> None:
        """Write the entry of a task."""
        self.write(f"{TASKS}/{entry['family']}-{entry['seed']}.json", entry)


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
        entries: dict[str, dict[str, Any]] = {}
        if directory is not None and not fresh:
            entries = {task.name: item for task in tasks if (item := directory.known(task)) is not None}
        waiting = [task for task in tasks if task.name not in entries]
        with closing(side_by_side(run_task, waiting, jobs or cpu_count(), "benchmark")) as results:
            for number, entry in results:
                entries[waiting[number].name] = entry
                if directory is not None:
                    directory.keep(entry)
                if report is not None:
                    report(entry, len(entries), len(tasks))
    ordered = [entries[task.name] for task in tasks]
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
