"""The benchmark: entries of tasks, each on its own, kept and taken up again."""

import json

import pytest

from manikin.cli import main
from manikin.errors import TimeLimitError
from manikin.pipeline import benchmark, jobs
from manikin.pipeline.benchmark import BenchmarkTask, run_benchmark, run_task
from manikin.reports.pages import write_benchmark_page
from manikin.reports.summary_table import family_rows
from manikin.scenarios.families import FAMILIES


def without_times(entry):
    return {key: value for key, value in entry.items() if key != "processor_s"}


@pytest.mark.long
def test_a_task_is_the_same_whatever_ran_before():
    task = BenchmarkTask("bars", 1)
    first = run_task(task)
    run_task(BenchmarkTask("stairs", 1, time_limit=0.2))
    again = run_task(task)
    assert without_times(again) == without_times(first)
    assert first["outcome"] == "contacts"
    assert first["processor_s"]["contacts"] > 0.0
    assert first["failure"] is None


def test_a_task_ends_after_its_processor_time_and_says_where_it_was(monkeypatch):
    """The search computes without an end, so that no machine is quick enough for it."""

    def endless(_context, report):
        report.progress("contacts", 0.0)
        while True:
            pass

    monkeypatch.setattr(jobs, "plan_contacts", endless)
    entry = run_task(BenchmarkTask("stairs", 0, time_limit=0.4))
    assert entry["outcome"] == "failed"
    assert entry["failure"]["stage"] == "contacts"
    assert entry["failure"]["reason"] == "did not end within 0.4 s of processor time"


def test_a_task_that_is_ended_later_has_come_as_far_as_it_has(monkeypatch):
    def endless(_scenario, stages):
        stages("wholebody", 0.0)
        raise TimeLimitError("did not end")

    monkeypatch.setattr(jobs, "_whole", endless)
    entry = run_task(BenchmarkTask("flat", 0, "all"))
    assert (entry["outcome"], entry["contacts"], entry["planned"]) == ("contacts", True, False)
    assert entry["failure"]["stage"] == "wholebody"


def test_a_defect_becomes_an_entry(monkeypatch):
    monkeypatch.setattr(jobs, "plan_contacts", lambda *_: {}["lost"])
    entry = run_task(BenchmarkTask("flat", 0))
    assert entry["failure"]["stage"] == "error"
    assert "KeyError: 'lost'" in entry["failure"]["reason"]


def test_what_is_done_stays_done_until_the_scene_or_the_stage_changes(tmp_path, monkeypatch):
    done = []

    def fake(task):
        done.append(task.name)
        scene = benchmark.digest(benchmark.draw_scene(FAMILIES[task.family], task.seed))
        return {
            "family": task.family, "seed": task.seed, "stage": task.stage, "scene": scene, "contacts": True,
            "outcome": "contacts", "body": {"model": "human"}, "planned": False, "proved": False,
            "checked": None, "failure": None, "duration_s": None,
            "processor_s": {"contacts": 1.0 + task.seed, "total": 2.0},
        }  # fmt: skip

    monkeypatch.setattr(benchmark, "run_task", fake)
    families = [FAMILIES["flat"], FAMILIES["bars"]]
    run_benchmark(families, range(1), path=tmp_path, jobs=1)
    result = run_benchmark(families, range(3), path=tmp_path, jobs=1)
    assert done == ["flat-0", "bars-0", "flat-1", "flat-2", "bars-1", "bars-2"]
    assert result["complete"]
    assert result["total"]["tasks"] == 6
    assert result["families"]["flat"]["contacts_s"]["median"] == pytest.approx(2.0)
    assert json.loads((tmp_path / "benchmark.json").read_text())["total"] == result["total"]
    assert (tmp_path / "scenes" / "bars-2.yaml").is_file()
    assert family_rows(result)[-1][:4] == ("all", "6", "6", "-")
    assert 'href="scenes/bars-2.yaml"' in write_benchmark_page(tmp_path, result).read_text()
    entry = tmp_path / "tasks" / "bars-2.json"
    entry.write_text(entry.read_text().replace('"stage": "contacts"', '"stage": "all"'))
    run_benchmark(families, range(3), path=tmp_path, jobs=1)
    assert done[6:] == ["bars-2"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--families", "stars"], "--families has 'stars'; valid: all, or some of"),
        (["--stage", "feet"], "'--stage': 'feet' is not one of 'contacts', 'all'"),
        (["--seeds", "0"], "--seeds"),
    ],
)
def test_bad_input_is_one_line(words, message, capsys):
    assert main(["benchmark", *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
