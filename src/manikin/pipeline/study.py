"""Study: bodies times swept values times seeds on a scenario, and who of them can do it.

A job is one body at one setting of the swept values with one seed. A person *can* if a job with any of the
seeds succeeds: its motion is proved, or with ``stage: contacts`` its contacts are certified by an independent
check. A person *cannot* if every job ended in an explained failure: the planner found nothing, which is no
proof that nobody could. All others, whose scenario is refused, whose time is over, or who meet a defect, are
*undecided*: a share leaves them out of those who can, and its interval holds whether they can or not.

::

    DIR/study.json            what was asked, groups with their shares and intervals, people, jobs
    DIR/study.csv             one row for each job, without times: the same bits for any number of processes
    DIR/tasks/NAME.json       the entry of a job, written as soon as it is known
    DIR/scenes/NAME.yaml      its scenario, for manikin run
    DIR/study.html            maps of success and margin, groups, and who can and who cannot
"""

import time as clock
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from manikin.body.dimensions import DIMENSIONS
from manikin.errors import ScenarioError
from manikin.pipeline.jobs import MEASURES, JobDirectory, StageName, digest, do_jobs, job_entry
from manikin.runtime import __version__
from manikin.runtime.files import ResultDirectory, csv_text
from manikin.scenarios import Scenario
from manikin.scenarios.study_file import Study, StudyBody, StudySetting

STUDY = "study.json"
TABLE = "study.csv"
PAGE = "study.html"
SCENES = "scenes"
BODY_KEYS = ("sex", "stature_m", "mass_kg", *(f"{name}_m" for name in DIMENSIONS), "age", "strength")
"""Keys of a body that an entry tells."""
INTERVAL = "Wilson score interval"
"""Which interval a share has."""
_REFUSED = ("scenario", "scene", "error")
"""Stages of a failure that say nothing about a person."""


@dataclass(frozen=True, eq=False)
class StudyJob:
    """One body at one setting with one seed.

    Attributes:
        name: Unique in the study.
        base: Scenario of the study.
        overrides: What makes it that of the job, ``KEY=VALUE`` each.
        body: Name of the body.
        setting: Number of the setting.
        seed: Of the planner.
        stage: ``"contacts"``, or ``"all"`` for a whole run.
        time_limit: Processor time after which it is ended [s].
        scene: Digest of the job's scenario; None if that is refused.
    """

    name: str
    base: Scenario
    overrides: tuple[str, ...]
    body: str
    setting: int
    seed: int
    stage: StageName
    time_limit: float
    scene: str | None

    def scenario(self) -> Scenario:
        """The scenario of the job; ScenarioError if a value does not fit."""
        return self.base.with_overrides(self.overrides)


def run_study_job(job: StudyJob) -> dict[str, Any]:
    """Plan one job; whatever happens becomes an entry.

    Returns:
        ``job`` (its name), ``body_name``, ``setting`` (its number), ``seed``, ``succeeded``,
        ``time_limit_s``, and what :func:`~manikin.pipeline.jobs.job_entry` says. Contacts that the check
        refuses are a failure of the stage ``check``.
    """
    entry = job_entry(job.scenario, job.stage, job.time_limit, BODY_KEYS)
    checked = entry["checked"]
    if job.stage == "contacts" and checked is not None and not checked["certified"]:
        entry["failure"] = {"stage": "check", "reason": checked["verdict"], "where": "", "time_s": 0.0}
    head = {"job": job.name, "body_name": job.body, "setting": job.setting, "seed": job.seed}
    return {**head, "succeeded": entry["failure"] is None, "time_limit_s": job.time_limit, **entry}


class StudyDirectory(JobDirectory):
    """Directory of a study; jobs that are done stay done."""

    kind, marks, writer = "study", (STUDY,), "manikin study"

    def is_same(self, entry: Mapping[str, Any], job: StudyJob) -> bool:
        """Whether an entry is of the same scenario and stage, and was not ended by a shorter time limit."""
        same = (entry.get("stage"), entry.get("scene")) == (job.stage, job.scene)
        longer = bool(entry.get("timed_out")) and entry["time_limit_s"] < job.time_limit
        return same and not longer


def study_jobs(study: Study) -> tuple[StudyJob, ...]:
    """The jobs of a study: bodies, settings and seeds, the seeds fastest; what is known of a body serves on.

    Raises:
        ScenarioError: If the scenario of every job is refused; the first reason.
    """
    file, jobs, problem = study.file, [], None
    for body in study.bodies:
        for (number, setting), seed in product(enumerate(study.settings), file.seeds):
            at = f"-at{number}" if len(study.settings) > 1 else ""
            overrides = (*body.overrides, *setting.overrides, f"seed={seed}")
            try:
                scene = digest(study.scenario.with_overrides(overrides))
            except ScenarioError as error:
                scene, problem = None, problem or error
            name = f"{body.name}{at}-seed{seed}"
            limit = float(file.time_limit_s)
            place = (body.name, number, seed)
            jobs.append(StudyJob(name, study.scenario, overrides, *place, file.stage, limit, scene))
    if problem is not None and all(job.scene is None for job in jobs):
        raise problem
    return tuple(jobs)


def run_study(
    study: Study, *, path: Path | None = None, jobs: int | None = None, cluster: str | None = None,
    fresh: bool = False, report: Callable[[Mapping[str, Any], int, int], None] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Do the jobs of a study, those that are not done yet, and say who can and who cannot.

    Args:
        study: As read by :func:`manikin.scenarios.study_file.load_study`.
        path: Directory to keep everything in, or to go on with; nothing is kept when omitted.
        jobs: Processes; one per usable core when omitted.
        cluster: Address of a Dask scheduler whose workers do the jobs instead.
        fresh: Whether jobs that the directory has already are done again.
        report: Told each entry, how many are done, and of how many.

    Returns:
        ``manikin`` (version), ``complete``, ``name``, ``scenario``, ``stage``, ``seeds``, ``time_limit_s``,
        ``confidence``, ``interval``, ``bodies``, ``settings``, ``groups`` and ``people`` (see
        :func:`judged`), ``jobs`` (see :func:`run_study_job`), ``wall_s``.

    Raises:
        ManikinError: If every scenario is refused, the directory cannot be written to, a process ends before
            its time, or there is no such cluster.
    """
    began = clock.perf_counter()
    todo, file = study_jobs(study), study.file
    asked = {
        "manikin": __version__, "complete": False, "name": study.name, "description": file.description,
        "scenario": study.scenario.name, "stage": file.stage, "seeds": list(file.seeds),
        "time_limit_s": file.time_limit_s, "confidence": file.confidence, "interval": INTERVAL,
        "bodies": [_told(body) for body in study.bodies],
        "settings": [dict(setting.values) for setting in study.settings],
    }  # fmt: skip
    directory = None if path is None else StudyDirectory(path)
    if directory is not None:
        directory.write(STUDY, asked)
        write_job_scenes(todo, directory.path / SCENES)

    entries = do_jobs(
        run_study_job, todo, directory, name="study", workers=jobs, cluster=cluster, fresh=fresh,
        report=report,
    )  # fmt: skip
    result = asked | {"complete": True, **judged(study, entries), "jobs": entries}
    result["wall_s"] = clock.perf_counter() - began
    if directory is not None:
        directory.write(TABLE, study_table(result))
        directory.write(STUDY, result)
    return result


def write_job_scenes(jobs: Iterable[StudyJob], folder: Path) -> None:
    """Write the scenario of each job that has one; MotionFileError if that is not possible."""
    directory = ResultDirectory(folder, "scenes")
    for job in jobs:
        if job.scene is not None:
            directory.write(f"{job.name}.yaml", job.scenario().to_yaml())


def judged(study: Study, entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Who can and who cannot.

    Returns:
        ``people``, one for each body and setting: ``body``, ``family``, ``drawn``, ``setting`` (its number),
        ``verdict`` (``can``, ``cannot`` or ``undecided``), ``seeds`` and ``succeeded`` (numbers of jobs),
        ``share`` with its ``interval`` over the seeds (None for a single seed), the sizes of the body, the
        median of each of :data:`~manikin.pipeline.jobs.MEASURES` over the jobs that have it, and ``stage``
        and ``reason`` of the failure that is met most often, None for who can.

        ``groups``, for each setting, one for each family and sex and one for all random draws: ``group``,
        ``setting``, ``people``, ``can``, ``cannot``, ``undecided``, ``share`` who are known to be able, and
        ``interval`` from the lower end if nobody undecided can to the upper end if all of them can; None for
        bodies that were chosen and not drawn, of which it says nothing.
    """
    bodies = {body.name: body for body in study.bodies}
    together: dict[tuple[int, str], list[Mapping[str, Any]]] = {}
    for entry in entries:
        together.setdefault((entry["setting"], entry["body_name"]), []).append(entry)
    confidence = float(study.file.confidence)
    people = [_person(bodies[name], number, jobs, confidence) for (number, name), jobs in together.items()]
    return {"groups": _groups(study.settings, people, confidence), "people": people}


def wilson_interval(successes: int, count: int, confidence: float) -> tuple[float, float] | None:
    """Wilson score interval of a share (Wilson 1927); None of nothing.

    Args:
        successes: How many of them.
        count: How many there were.
        confidence: Between 0 and 1.
    """
    if count == 0:
        return None
    z = float(ndtri(0.5 + 0.5 * confidence))
    share, weight = successes / count, 1.0 + z**2 / count
    middle = (share + z**2 / (2.0 * count)) / weight
    half = z / weight * float(np.sqrt(share * (1.0 - share) / count + z**2 / (4.0 * count**2)))
    return max(0.0, middle - half), min(1.0, middle + half)


def study_table(result: Mapping[str, Any]) -> str:
    """Comma-separated table with one row for each job, without times."""
    families = {body["name"]: body for body in result["bodies"]}
    swept = list(result["settings"][0])
    header = [
        "job", "body", "family", "drawn", *BODY_KEYS, *swept, "seed", "succeeded", "outcome", "stage",
        "reason", *MEASURES, "steps", "duration_s",
    ]  # fmt: skip
    rows = []
    for entry in result["jobs"]:
        body, failure = families[entry["body_name"]], entry["failure"] or {}
        sizes, values = entry["body"] or body["keys"], result["settings"][entry["setting"]]
        rows.append([
            entry["job"], body["name"], body["family"], body["drawn"], *(sizes.get(key) for key in BODY_KEYS),
            *(values[name] for name in swept), entry["seed"], entry["succeeded"], entry["outcome"],
            failure.get("stage"), failure.get("reason"), *(entry["measures"][name] for name in MEASURES),
            entry["steps"], entry["duration_s"],
        ])  # fmt: skip
    return csv_text(header, rows)


def _told(body: StudyBody) -> dict[str, Any]:
    return {"name": body.name, "family": body.family, "drawn": body.drawn, "keys": dict(body.keys)}


def _person(
    body: StudyBody, setting: int, jobs: Sequence[Mapping[str, Any]], confidence: float
) -> dict[str, Any]:
    """What the jobs of one body at one setting say."""
    succeeded = sum(job["succeeded"] for job in jobs)
    failures = [job["failure"] for job in jobs if job["failure"] is not None]
    unexplained = any(
        job["timed_out"] or (job["failure"] or {}).get("stage") in _REFUSED for job in jobs
    )  # fmt: skip
    verdict = "can" if succeeded else "undecided" if unexplained else "cannot"
    # One seed is no sample of what other seeds would give.
    interval = wilson_interval(succeeded, len(jobs), confidence) if len(jobs) > 1 else None
    reasons = Counter((failure["stage"], failure["reason"]) for failure in failures)
    stage, reason = (None, None) if succeeded else reasons.most_common(1)[0][0]
    sizes = next((job["body"] for job in jobs if job["body"] is not None), body.keys)
    return {
        "body": body.name, "family": body.family, "drawn": body.drawn, "setting": setting,
        "verdict": verdict, "seeds": len(jobs), "succeeded": succeeded, "share": succeeded / len(jobs),
        "interval": interval, **{key: sizes.get(key) for key in BODY_KEYS},
        **{name: _median([job["measures"][name] for job in jobs]) for name in MEASURES},
        "stage": stage, "reason": reason,
    }  # fmt: skip


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _groups(
    settings: Sequence[StudySetting], people: Sequence[Mapping[str, Any]], confidence: float
) -> list[dict[str, Any]]:
    """Shares by setting of each family and sex, and of all who were drawn where there are several groups."""
    groups = []
    for number in range(len(settings)):
        here = [person for person in people if person["setting"] == number]
        named: dict[str, list[Mapping[str, Any]]] = {}
        for person in here:
            words = [person["family"], *([person["sex"]] if person["sex"] else [])]
            named.setdefault(", ".join(words), []).append(person)
        drawn = [person for person in here if person["drawn"]]
        if len({person["sex"] for person in drawn}) > 1:
            named["random, all"] = drawn
        groups += [_group(name, number, members, confidence) for name, members in named.items()]
    return groups


def _group(
    name: str, setting: int, members: Sequence[Mapping[str, Any]], confidence: float
) -> dict[str, Any]:
    verdicts = Counter(person["verdict"] for person in members)
    can, count = verdicts["can"], len(members)
    interval = None
    if all(person["drawn"] for person in members):
        least = wilson_interval(can, count, confidence)
        most = wilson_interval(can + verdicts["undecided"], count, confidence)
        interval = (least[0], most[1]) if least and most else None
    return {
        "group": name, "setting": setting, "people": count, "can": can, "cannot": verdicts["cannot"],
        "undecided": verdicts["undecided"], "share": can / count, "interval": interval,
    }  # fmt: skip
