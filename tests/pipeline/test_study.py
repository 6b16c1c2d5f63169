"""Studies: entries of jobs, who can and who cannot, the same for any number of processes, taken up again."""

import csv
import json

import pytest
from scipy.stats import beta, norm

from manikin.cli import main
from manikin.ergonomics.working_postures import VERDICTS
from manikin.errors import InputError, MotionFileError
from manikin.pipeline import study as studies
from manikin.pipeline.jobs import measures_of
from manikin.pipeline.study import StudyDirectory, judged, run_study, study_jobs, wilson_interval
from manikin.reports.pages import study_page
from manikin.reports.summary_table import group_table, person_lines
from manikin.scenarios.study_file import load_study

# A step to the side on a flat floor: contacts take about a second.
FILES = {
    "step.yaml": """
name: step
body: {model: human}
task: {start: {at: [0.0, 0.0]}, goal: {at: [0.0, 0.3]}}
contacts: {friction: 0.7}
""",
    "study.yaml": """
name: steps
scenario: step.yaml
bodies:
  - {name: small, body: {stature_m: 1.6, mass_kg: 55, sex: female}}
  - {name: large, body: {stature_m: 1.85, mass_kg: 90}}
sweeps:
  - {key: contacts.friction, values: [0.7, 0.5]}
""",
}


@pytest.fixture
def study(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return load_study(tmp_path / "study.yaml")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One study, done by two processes."""
    folder = tmp_path_factory.mktemp("study")
    for name, text in FILES.items():
        (folder / name).write_text(text.replace("[0.7, 0.5]", "[0.7]"))
    study = load_study(folder / "study.yaml")
    return study, folder / "two", run_study(study, path=folder / "two", jobs=2)


def without_times(value):
    """A copy without what depends on the machine."""
    if isinstance(value, dict):
        times = ("processor_s", "wall_s")
        return {key: without_times(item) for key, item in value.items() if key not in times}
    return [without_times(item) for item in value] if isinstance(value, list | tuple) else value


def fake(job):
    """An entry as of a job that nobody of less than 60 kg can do."""
    can = job.scenario().file.body.mass_kg >= 60.0
    failure = None if can else {"stage": "contacts", "reason": "too high", "where": "", "time_s": 0.0}
    return {
        "job": job.name, "body_name": job.body, "setting": job.setting, "seed": job.seed, "succeeded": can,
        "time_limit_s": job.time_limit, "stage": job.stage, "scene": job.scene, "body": None,
        "outcome": "contacts" if can else "failed", "failure": failure, "timed_out": False, "checked": None,
        "steps": 2, "duration_s": None, "measures": dict.fromkeys(studies.MEASURES, 0.5),
        "processor_s": {"total": 1.0},
    }  # fmt: skip


def test_the_same_bits_for_one_process_and_for_two(finished):
    study, folder, two = finished
    one = run_study(study, path=folder.parent / "one", jobs=1)
    assert without_times(one) == without_times(two)
    table = (folder / "study.csv").read_bytes()
    assert table == (folder.parent / "one" / "study.csv").read_bytes()
    rows = list(csv.DictReader(table.decode().splitlines()))
    assert [row["job"] for row in rows] == [entry["job"] for entry in two["jobs"]]
    assert rows[0]["stature_m"] == "1.6"
    assert rows[0]["succeeded"] == "True"


def test_a_step_to_the_side_is_what_everybody_can(finished):
    _, _, result = finished
    assert result["complete"]
    assert {person["verdict"] for person in result["people"]} == {"can"}
    assert result["jobs"][0]["checked"]["certified"]
    assert 0.0 < result["jobs"][0]["measures"]["rest_torque_share"] <= 1.0


def test_a_job_is_repeated_by_its_scenario_file(finished):
    study, folder, result = finished
    from manikin.pipeline.jobs import digest
    from manikin.scenarios import load_scenario

    for job, entry in zip(study_jobs(study), result["jobs"], strict=True):
        again = load_scenario(folder / "scenes" / f"{job.name}.yaml")
        assert digest(again) == entry["scene"] == job.scene


def test_what_is_done_stays_done(study, tmp_path, monkeypatch):
    done = []

    def work(job):
        if len(done) == 2 and not (tmp_path / "go-on").exists():
            raise KeyboardInterrupt
        done.append(job.name)
        return fake(job)

    monkeypatch.setattr(studies, "run_study_job", work)
    with pytest.raises(KeyboardInterrupt):
        run_study(study, path=tmp_path / "out", jobs=1)
    assert json.loads((tmp_path / "out" / "study.json").read_text())["complete"] is False
    (tmp_path / "go-on").touch()
    result = run_study(study, path=tmp_path / "out", jobs=1)
    assert done == [job.name for job in study_jobs(study)]
    assert json.loads((tmp_path / "out" / "study.json").read_text())["people"] == json.loads(
        json.dumps(result["people"])
    )
    text = (tmp_path / "study.yaml").read_text()
    (tmp_path / "study.yaml").write_text(text.replace("[0.7, 0.5]", "[0.7, 0.6]"))
    run_study(load_study(tmp_path / "study.yaml"), path=tmp_path / "out", jobs=1)
    assert done[4:] == ["small-at1-seed0", "large-at1-seed0"]


def test_a_longer_time_limit_does_again_what_was_ended(study, tmp_path):
    directory, job = StudyDirectory(tmp_path / "out"), study_jobs(study)[0]
    directory.keep(job, fake(job) | {"timed_out": True, "time_limit_s": 5.0})
    assert directory.known(job) is None
    directory.keep(job, fake(job) | {"timed_out": True})
    assert directory.known(job) is not None


def test_verdicts_groups_and_pages(study, monkeypatch):
    monkeypatch.setattr(studies, "run_study_job", fake)
    result = run_study(study, jobs=1)
    assert [person["verdict"] for person in result["people"]] == ["cannot", "cannot", "can", "can"]
    assert result["people"][0]["reason"] == "too high"
    assert "small, contacts.friction 0.7 cannot (contacts): too high" in list(person_lines(result))
    assert "body, female" in group_table(result)
    page = study_page(result)
    assert page.index("Who cannot") < page.index("too high") < page.index("Who can<")
    assert page.count("data:image/png") == 4
    refused = [fake(job) for job in study_jobs(study)]
    refused[0]["failure"]["stage"] = "scenario"
    (person, *_), groups = judged(study, refused)["people"], judged(study, refused)["groups"]
    assert person["verdict"] == "undecided"
    assert (groups[0]["undecided"], groups[0]["share"]) == (1, 0.0)


def test_only_draws_have_an_interval_of_the_population(study, tmp_path):
    """20 draws of each sex: a share of each, and one of both; chosen bodies stand for no share."""
    text = (tmp_path / "study.yaml").read_text()
    people = "bodies:\n  - {random: 20}\n  - {percentiles: [5], sex: male}\n  - {name: small"
    (tmp_path / "drawn.yaml").write_text(text.replace("bodies:\n  - {name: small", people))
    drawn = load_study(tmp_path / "drawn.yaml")
    jobs = study_jobs(drawn)
    groups = {group["group"]: group for group in judged(drawn, [fake(job) for job in jobs])["groups"][:6]}
    expected = [sum(job.scenario().file.body.mass_kg >= 60.0 for job in jobs[first : first + 40 : 2])
                for first in (0, 40)]  # fmt: skip
    assert 0 < expected[0] < expected[1] <= 20
    for name, can in zip(("random, female", "random, male"), expected, strict=True):
        assert (groups[name]["people"], groups[name]["can"]) == (20, can)
        assert groups[name]["interval"] == wilson_interval(can, 20, 0.95)
    assert groups["random, all"]["interval"] == wilson_interval(sum(expected), 40, 0.95)
    assert groups["percentiles, male"]["interval"] is None
    late = [fake(job) | {"timed_out": not fake(job)["succeeded"]} for job in jobs]
    female = next(group for group in judged(drawn, late)["groups"] if group["group"] == "random, female")
    assert (female["can"], female["undecided"]) == (expected[0], 20 - expected[0])
    assert female["interval"] == (wilson_interval(expected[0], 20, 0.95)[0], 1.0)
    assert len(study.bodies) == 2


@pytest.mark.usefixtures("study")
def test_a_value_that_never_fits_is_bad_input_and_one_that_fits_sometimes_is_told(tmp_path, capsys):
    text = (tmp_path / "study.yaml").read_text()
    (tmp_path / "bad.yaml").write_text(text.replace("contacts.friction", "contacts.fiction"))
    assert main(["study", str(tmp_path / "bad.yaml"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "contacts.fiction is not a known key" in error
    assert len(error.splitlines()) == 1
    (tmp_path / "some.yaml").write_text(text.replace("[0.7, 0.5]", "[0.7, none]"))
    jobs = study_jobs(load_study(tmp_path / "some.yaml"))
    assert [job.scene is None for job in jobs] == [False, True, False, True]


@pytest.mark.usefixtures("study")
def test_the_command_lists_bodies_and_refuses(tmp_path, capsys):
    assert main(["study", str(tmp_path / "study.yaml"), "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert (listed["jobs"], list(listed["bodies"])) == (4, ["small", "large"])
    assert main(["study", str(tmp_path / "no.yaml")]) == 2
    assert "no.yaml: there is no such file; valid: a study file" in capsys.readouterr().err
    words = ["study", str(tmp_path / "study.yaml"), "--cluster", "tcp://a:1", "--jobs", "2"]
    assert main(words) == 2
    assert "--jobs does not go with this run: --cluster says who works" in capsys.readouterr().err


def test_a_directory_of_something_else_is_left_alone(study, tmp_path):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "letter.txt").touch()
    with pytest.raises(MotionFileError, match=r"no study\.json, so it is not an earlier study"):
        run_study(study, path=tmp_path / "other", jobs=1)


@pytest.mark.parametrize(("successes", "count"), [(0, 10), (3, 20), (50, 100), (10, 10)])
def test_the_interval_is_that_of_the_score_test(successes, count):
    """Both ends p solve (x - n p)^2 = z^2 n p (1 - p), and are near those of Clopper and Pearson."""
    low, high = wilson_interval(successes, count, 0.95)
    z = norm.ppf(0.975)
    for share in (low, high):
        if 0.0 < share < 1.0:
            error = (successes - count * share) ** 2 - z**2 * count * share * (1.0 - share)
            assert error == pytest.approx(0.0, abs=1e-9 * count**2)
    exact = (
        beta.ppf(0.025, successes, count - successes + 1) if successes else 0.0,
        beta.ppf(0.975, successes + 1, count - successes) if successes < count else 1.0,
    )
    assert (low, high) == pytest.approx(exact, abs=0.08)
    assert wilson_interval(0, 0, 0.95) is None


def test_without_distributed_a_cluster_is_refused(study, monkeypatch):
    from manikin.runtime import parallel

    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(parallel, "import_module", missing)
    with pytest.raises(InputError, match=r"cluster tcp://a:1: the package distributed is not installed"):
        run_study(study, cluster="tcp://a:1")


def test_a_dask_cluster_gives_the_same_bits(finished):
    distributed = pytest.importorskip("distributed", reason="the extra cluster is not installed")
    study, _, result = finished
    options = {"n_workers": 1, "threads_per_worker": 2, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        again = run_study(study, cluster=cluster.scheduler_address)
    assert without_times(again) == without_times(result)


def test_nobody_answers_at_the_address(study, monkeypatch):
    pytest.importorskip("distributed", reason="the extra cluster is not installed")
    monkeypatch.setattr("manikin.runtime.parallel.CLUSTER_TIMEOUT", 0.5)
    with pytest.raises(InputError, match=r"cluster tcp://127.0.0.1:9: .*valid: tcp://HOST:PORT"):
        run_study(study, cluster="tcp://127.0.0.1:9")


def test_a_whole_run_tells_what_ergonomists_ask_for(runs):
    """Numbers of the run's summary; EN 1005-4 as levels that grow with what is wrong."""
    summary = runs.step().summary
    work, told = summary["ergonomics"], measures_of(summary)
    assert set(told) == set(studies.MEASURES)
    for name in ("rula_max", "reba_max", "owas_max", "l5s1_max_compression_N"):
        assert told[name] == work[name] > 0
    assert told["lifting_index"] is None  # nothing is lifted
    for how, verdict in work["working_postures"].items():
        assert VERDICTS[told[f"working_postures_{how}"]] == verdict
    assert told["capable_share"] == min(work["capable_min_share"].values())
