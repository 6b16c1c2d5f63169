"""Many independent jobs of the pipeline: one entry each, whatever happens, kept as soon as it is known.

The benchmark and studies are made of them. An entry depends on nothing but its job: neither on the order of
the jobs nor on the number of processes. Only times differ. What a directory has already is not done again.
"""

import hashlib
import tempfile
import time as clock
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol, TypeVar

from joblib import cpu_count

from manikin.ergonomics.working_postures import VERDICTS
from manikin.errors import ManikinError, TimeLimitError
from manikin.pipeline.run_directory import CONTACT_PLAN
from manikin.pipeline.runner import run
from manikin.pipeline.stages import Report, RunContext
from manikin.pipeline.stages.contact_stage import plan_contacts
from manikin.pipeline.stages.context import plan_in_world
from manikin.runtime.files import ResultDirectory
from manikin.runtime.parallel import on_cluster, processor_time_limit, side_by_side
from manikin.scenarios import Scenario
from manikin.verification import PlannedContacts, check_contact_plan

TIME_LIMIT = 600.0
"""Processor time after which a job is ended [s]."""
OUTCOMES = ("proved", "planned", "contacts", "failed")
"""How far a job came, the farthest first."""
StageName = Literal["contacts", "all"]
_AFTER = {"planned": ("execution",), "contacts": ("centroidal", "wholebody", "execution", "check")}
"""Stages in which a job that is ended has come so far already."""


class NamedJob(Protocol):
    """What a list of jobs is made of: anything with a name, which is that of its file as well."""

    @property
    def name(self) -> str:
        """Unique among the jobs of a list."""
        ...


J = TypeVar("J", bound=NamedJob)


def job_entry(
    build: Callable[[], Scenario], stage: StageName, time_limit: float, body_keys: Sequence[str]
) -> dict[str, Any]:
    """Build a scenario and plan it; whatever happens becomes an entry.

    Args:
        build: Makes the scenario; a ManikinError is a failure of the stage ``scenario``.
        stage: ``"contacts"``, or ``"all"`` for a whole run.
        time_limit: Processor time after which it is ended [s].
        body_keys: Keys of the body that the entry tells beside ``model``.

    Returns:
        ``stage``, ``scene`` (digest of the scenario), ``body``, ``outcome`` (one of :data:`OUTCOMES`),
        ``contacts``, ``planned`` and ``proved`` (whether it came so far), ``checked`` (verdict of an
        independent check of the contacts, or None), ``failure`` (``stage``, ``reason``, ``where``,
        ``time_s``, or None), ``timed_out`` (whether the time limit ended it), ``steps``, ``duration_s`` of
        the motion, ``measures`` (see :data:`MEASURES`), and ``processor_s`` by stage, with ``total``.
    """
    stages = StageClock()
    entry: dict[str, Any] = {
        "stage": stage, "scene": None, "body": None, "outcome": "failed", "contacts": False, "planned": False,
        "proved": False, "checked": None, "failure": None, "timed_out": False, "steps": None,
        "duration_s": None, "measures": dict.fromkeys(MEASURES),
    }  # fmt: skip
    try:
        with processor_time_limit(time_limit):
            scenario = build()
            body = scenario.file.body.model_dump(
                mode="json", include={"model", *body_keys}, exclude_none=True
            )
            entry |= {"scene": digest(scenario), "body": body}
            summary = _contacts(scenario, stages) if stage == "contacts" else _whole(scenario, stages)
            entry |= _outcome(summary, stage)
    except TimeLimitError as error:
        reached = [name for name, stages_after in _AFTER.items() if stages.current in stages_after]
        entry |= dict.fromkeys(reached, True) | {"timed_out": True}
        entry |= {"outcome": (reached or ["failed"])[0], "failure": _failure(stages.current, str(error))}
    except ManikinError as error:
        entry["failure"] = _failure("scenario" if entry["scene"] is None else stages.current, str(error))
    except Exception as error:  # a defect of the library is an entry as well, and ends no other job
        last = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"
        entry["failure"] = _failure("error", reason, stages.current)
    return {**entry, "processor_s": stages.times()}


def digest(scenario: Scenario) -> str:
    """First letters of the digest of a scenario's content, which change if the scene does."""
    text = scenario.file.model_dump_json(exclude_none=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class StageClock:
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


def _contacts(scenario: Scenario, stages: StageClock) -> dict[str, Any]:
    """Summary of the contact stage alone, with the verdict of the check."""
    context = RunContext.of(scenario)
    report = Report(context, None, stages, clock.perf_counter())
    planned = plan_contacts(context, report)
    stages("check", 0.0)
    checked = None
    if planned is not None and planned.plan is not None:
        checked = checked_contacts(scenario, plan_in_world(planned.plan, report.transform))
    return report.close() | {"checked": checked}


def _whole(scenario: Scenario, stages: StageClock) -> dict[str, Any]:
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
        ``certified``, ``verdict`` in one line, ``broken`` (keys of the requirements that do not hold),
        ``room_m`` of the centre of mass, and ``torque_share``, the largest that rest takes of the strength.
    """
    try:
        result = check_contact_plan(scenario, plan)
    except ManikinError as error:
        unknown = {"room_m": None, "torque_share": None}
        return {"certified": False, "verdict": f"refused: {error}", "broken": [], **unknown}
    rest = (row.measured for row in result.requirements if row.key == "max_torque_share")
    return {
        "certified": result.held, "verdict": result.verdict, "broken": sorted(result.requirements.broken),
        "room_m": result.room, "torque_share": next(rest, None),
    }  # fmt: skip


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
        "steps": contacts.get("steps"), "measures": measures_of(summary),
        "duration_s": next((block["duration_s"] for block in blocks if block.get("duration_s")), None),
    }  # fmt: skip


_SCORES = ("rula_max", "reba_max", "owas_max", "l5s1_max_compression_N", "lifting_index", "force_risk")
_POSTURES = ("working_postures_rare", "working_postures_frequent")
MEASURES = (
    "planned_margin_Nm", "executed_margin_Nm", "peak_torque_share", "rest_torque_share", "clearance_m",
    "com_room_m", "capable_share", *_SCORES, *_POSTURES,
)  # fmt: skip
"""Numbers of a job that an entry tells, None where its stages did not come so far.

Least margin of the planned and of the executed motion, about the centre of mass; largest share of a joint's
torque limit, and the same at rest on the planned contacts; least counted distance; room of the centre of mass
in the contact plan; least share of people of that size who have the strength for a joint; largest scores,
compression of L5/S1, lifting index and risk of the summary, and worst level of EN 1005-4 (1 to 3) for rare
and for frequent work.
"""


def measures_of(summary: Mapping[str, Any]) -> dict[str, float | None]:
    """Numbers of a run by the names of :data:`MEASURES`."""
    body, executed, checked = (summary.get(key) or {} for key in ("wholebody", "execution", "checked"))
    work = summary.get("ergonomics") or {}
    shares = (work.get("capable_min_share") or {}).values()
    level_of = {verdict: level for level, verdict in VERDICTS.items()}
    verdicts = work.get("working_postures") or {}
    return {
        "planned_margin_Nm": body.get("min_margin"), "executed_margin_Nm": executed.get("min_margin"),
        "peak_torque_share": body.get("max_torque_share"), "clearance_m": body.get("min_clearance_m"),
        "rest_torque_share": checked.get("torque_share"), "com_room_m": checked.get("room_m"),
        "capable_share": min((share for share in shares if share is not None), default=None),
        **{name: work.get(name) for name in _SCORES},
        **{name: level_of.get(verdicts.get(name.rpartition("_")[2], "")) for name in _POSTURES},
    }  # fmt: skip


def _failure(stage: str, reason: str, where: str = "") -> dict[str, Any]:
    return {"stage": stage, "reason": " ".join(reason.split()), "time_s": 0.0, "where": where}


class JobDirectory(ResultDirectory, ABC):
    """Directory of many jobs; those that are done stay done."""

    TASKS: ClassVar[str] = "tasks"
    """Folder with one file for each entry."""

    def known(self, job: Any) -> dict[str, Any] | None:
        """Entry of a job that is done; None if it is not, or was another one of the same name."""
        file = f"{self.TASKS}/{job.name}.json"
        if not (self.path / file).is_file():
            return None
        entry = self.read(file)
        return entry if self.is_same(entry, job) else None

    @abstractmethod
    def is_same(self, entry: Mapping[str, Any], job: Any) -> bool:
        """Whether an entry is that of a job, and not of another one of that name."""

    def keep(self, job: NamedJob, entry: Mapping[str, Any]) -> None:
        """Write the entry of a job."""
        self.write(f"{self.TASKS}/{job.name}.json", entry)


def do_jobs(
    work: Callable[[J], dict[str, Any]], jobs: Sequence[J], directory: JobDirectory | None, *, name: str,
    workers: int | None = None, cluster: str | None = None, fresh: bool = False,
    report: Callable[[Mapping[str, Any], int, int], None] | None = None,
) -> list[dict[str, Any]]:  # fmt: skip
    """Do jobs side by side, those that are not done yet, and return their entries in the order of the jobs.

    Args:
        work: Makes the entry of a job; can be pickled, as the jobs can.
        directory: Where entries are kept and looked for; nothing is kept when None.
        name: Of the work, for messages.
        workers: Processes; one per usable core when omitted.
        cluster: Address of a Dask scheduler whose workers do the jobs instead.
        fresh: Whether jobs that the directory has already are done again.
        report: Told each entry, how many are done, and of how many.

    Raises:
        ManikinError: If the directory cannot be written to, a process ends before its time, or there is no
            such cluster.
    """
    entries: dict[str, dict[str, Any]] = {}
    if directory is not None and not fresh:
        entries = {job.name: item for job in jobs if (item := directory.known(job)) is not None}
    waiting = [job for job in jobs if job.name not in entries]
    if cluster is None:
        work_done = side_by_side(work, waiting, workers or cpu_count(), name)
    else:
        work_done = on_cluster(work, waiting, cluster, name)
    with closing(work_done) as results:
        for number, entry in results:
            job = waiting[number]
            entries[job.name] = entry
            if directory is not None:
                directory.keep(job, entry)
            if report is not None:
                report(entry, len(entries), len(jobs))
    return [entries[job.name] for job in jobs]
