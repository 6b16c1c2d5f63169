"""Many runs: gathered in order, each on its own, whatever becomes of one of them."""

import json
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from manikin.pipeline.batch import Job, RunOptions, built_in_jobs, run_jobs

INFEASIBLE = "extends: platform\nname: greedy\nplanning: {min_margin: 120}\n"
"""More margin than the intersection of two polytopes allows: ends before any optimisation."""


def script(text):
    return [sys.executable, "-c", text]


def says(succeeded, status, before=""):
    """A process that prints a summary and ends with a status."""
    failure = (
        None if succeeded else {"stage": "centroidal", "reason": "no margin", "time_s": 1.0, "where": ""}
    )
    words = {"verdict": "proved" if succeeded else "failed", "planned": succeeded, "proved": succeeded}
    summary = {"scenario": "fake", **words, "succeeded": succeeded, "failure": failure, "wall_s": 0.1}
    summary |= dict.fromkeys(("centroidal", "wholebody", "execution"))
    return script(f"import sys\n{before}\nprint({json.dumps(summary)!r})\nsys.exit({status})")


PROCESSES = {
    "good": says(True, 0),
    "infeasible": says(False, 3),
    "crashing": script("import os, sys; print('deep trouble', file=sys.stderr, flush=True); os.abort()"),
    "refused": script("import sys; sys.exit('manikin: supports is missing')"),
    "chatty": says(True, 0, before="print('x' * 10**6, file=sys.stderr)"),
    "late": script("import time; time.sleep(60)"),
}


def ran(names, expected=None, **options):
    jobs = [Job(name, expected=(expected or {}).get(name, "success")) for name in names]
    return run_jobs(jobs, lambda job: PROCESSES[job.scenario], **options)


def test_a_crash_or_a_failure_of_one_does_not_lose_the_others():
    report = ran(["good", "crashing", "infeasible", "refused", "chatty"], workers=2)
    assert [run["succeeded"] for run in report["runs"]] == [True, False, False, False, True]
    assert (report["succeeded"], report["failed"]) == (2, 3)
    crashed = report["runs"][1]["failure"]
    assert crashed["stage"] == "run"
    assert "status -6: deep trouble" in crashed["reason"]
    assert report["runs"][2]["failure"]["reason"] == "no margin"
    assert "status 1: manikin: supports is missing" in report["runs"][3]["failure"]["reason"]


def test_an_expected_failure_is_right_when_it_is_explained():
    wanted = dict.fromkeys(["infeasible", "crashing", "refused", "good"], "failure")
    report = ran([*wanted], wanted, workers=2)
    assert [run["as_expected"] for run in report["runs"]] == [True, False, False, False]
    assert (report["as_expected"], report["not_as_expected"]) == (1, 3)
    assert (report["succeeded"], report["failed"]) == (1, 3)


def test_a_failure_in_another_stage_is_not_the_expected_one():
    """The fake process fails in the centroidal stage."""
    for stage, right in (("centroidal", True), ("execution", False), (None, True)):
        job = Job("infeasible", None, "failure", stage, "because")
        report = run_jobs([job], lambda job: PROCESSES[job.scenario], workers=1)
        assert report["runs"][0]["as_expected"] is right
        assert report["runs"][0]["expected_because"] == "because"


@pytest.fixture(scope="module")
def built_in():
    """Every scenario with its variants."""
    return built_in_jobs()


def test_every_expected_failure_of_a_stage_gives_its_reason(built_in):
    staged = [job for job in built_in if job.stage is not None]
    assert {"beam-H2C2@S2", "beam-H2C3@S2"} <= {job.name for job in staged}
    for job in staged:
        assert job.expected == "failure", job.name
        assert job.because, job.name
        assert job.stage in ("contacts", "centroidal", "wholebody", "execution"), job.name


def test_a_run_that_does_not_end_is_ended():
    report = ran(["late", "good"], workers=1, time_limit=0.5)
    assert "did not end within 0.5 s" in report["runs"][0]["failure"]["reason"]
    assert report["runs"][0]["expected"] == "success"
    assert len(report["runs"]) == 2


def test_results_are_in_the_order_of_the_jobs_and_reported_as_they_come(tmp_path):
    """The first job waits for a file that the last one makes."""
    flag = tmp_path / "flag"
    waits = f"import os, time\nwhile not os.path.exists({str(flag)!r}): time.sleep(0.02)"
    processes = {
        "first": says(True, 0, before=waits), "second": says(False, 3),
        "last": says(True, 0, before=f"open({str(flag)!r}, 'w').close()"),
    }  # fmt: skip
    seen = []
    report = run_jobs(
        [Job(name) for name in processes], lambda job: processes[job.scenario], workers=2,
        report=lambda entry, done: seen.append((entry["succeeded"], done)),
    )  # fmt: skip
    assert seen[0] == (False, 1)
    assert [done for _, done in seen] == [1, 2, 3]
    assert [run["succeeded"] for run in report["runs"]] == [True, False, True]


def test_no_process_is_left_behind_when_the_work_is_interrupted(monkeypatch):
    processes = []

    class Watched(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            processes.append(self)

    def interrupt(_entry, _done):
        raise KeyboardInterrupt

    monkeypatch.setattr(subprocess, "Popen", Watched)
    with pytest.raises(KeyboardInterrupt):
        ran(["good", "late"], workers=2, report=interrupt)
    assert len(processes) == 2
    assert all(process.poll() is not None for process in processes)


PUSHES = {"push-back-500", "push-front-300", "push-right-200", "push-sine-100"}


def test_jobs_for_another_stature_leave_out_what_has_none(built_in):
    """A point mass has no stature and the body of Kudoh its own; everything else is asked."""
    left_out = set(built_in) - set(built_in_jobs(statures=True))
    assert {job.scenario for job in left_out} == {"insect-books", "walls", *PUSHES}


def test_built_in_jobs_are_every_scenario_with_its_variants(built_in):
    assert Job("platform") in built_in
    assert Job("platform", "slippery", "failure") in built_in
    assert len({job.name for job in built_in}) == len(built_in)


def test_the_command_of_a_job(tmp_path):
    options = RunOptions(tmp_path, figures=False, arguments=("--seed", "4"))
    words = options.command(Job("walls", "trial-4"))
    assert words[1:4] == ["-m", "manikin", "run"]
    out = str(tmp_path / "walls@trial-4")
    assert words[4:] == ["walls@trial-4", "--json", "--seed", "4", "--out", out, "--no-figures"]


def test_real_runs_write_their_directories(tmp_path):
    """A variant of a file that fails in the centroidal stage, in a process of its own."""
    file = tmp_path / "greedy.yaml"
    file.write_text(INFEASIBLE + "variants:\n  more: {expect: failure, planning: {min_margin: 140}}\n")
    jobs = [Job(str(file), "more", "failure")]
    (entry,) = run_jobs(jobs, RunOptions(tmp_path / "out").command, workers=2)["runs"]
    assert (entry["failure"]["stage"], entry["as_expected"], entry["variant"]) == ("centroidal", True, "more")
    summary = json.loads((tmp_path / "out" / "greedy@more" / "summary.json").read_text())
    assert summary["failure"] == entry["failure"]
    assert summary["scenario"] == entry["scenario"] == "greedy@more"


MANY = """
from manikin.pipeline.batch import Job, RunOptions, run_jobs
jobs = [Job("platform"), Job("stairs")]
run_jobs(jobs, RunOptions().command, workers=2)
"""


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_runs_end_with_the_process_that_started_them():
    """It is killed, so that it cannot end them itself."""

    def children(parent):
        found = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                if stat.read_text().rpartition(")")[2].split()[1] == str(parent):
                    found.append(int(stat.parent.name))
        return found

    parent = subprocess.Popen(
        [sys.executable, "-c", MANY], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        until = time.monotonic() + 60.0
        while len(runs := children(parent.pid)) < 2 and time.monotonic() < until:
            time.sleep(0.05)
        assert len(runs) == 2
        time.sleep(2.0)  # until they listen
    finally:
        parent.kill()
        parent.wait()
    until = time.monotonic() + 20.0
    while any(Path(f"/proc/{run}").exists() for run in runs) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(Path(f"/proc/{run}").exists() for run in runs)
