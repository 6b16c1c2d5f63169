"""``manikin ergonomics``: what it prints, the files it writes, and one line for every mistake."""

import json
from dataclasses import replace

import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE
from manikin.motion.file import write_motions


@pytest.fixture
def run(tmp_path, finished_run):
    """A run directory's motion file."""
    write_motions(tmp_path / "motion.h5", finished_run)
    return tmp_path


def test_json_is_one_object_about_the_executed_motion(run, capsys):
    assert main(["ergonomics", str(run), "--json"]) == DONE
    report = json.loads(capsys.readouterr().out)
    assert report["motion"] == "executed"
    assert set(report) >= {
        "owas",
        "static_postures",
        "working_postures",
        "force",
        "low_back",
        "lifting",
        "capable",
    }
    assert report["working_postures"]["known"] is None
    assert set(report) >= {"rula", "reba", "strength", "effort", "margin", "missing", "circumstances"}
    assert 1 <= report["rula"]["max"] <= 7


def test_options_reach_the_scores(run, capsys):
    scores = []
    job = ["--cycles-per-minute", "3", "--job-hours", "2", "--domestic"]
    for options in (
        [],
        [*job, "--load-kg", "12", "--load-pattern", "static", "--static", "--coupling", "poor"],
    ):
        assert main(["ergonomics", str(run / "motion.h5"), "--planned", "--json", *options]) == DONE
        report = json.loads(capsys.readouterr().out)
        assert report["motion"] == "planned"
        scores.append((report["rula"]["max"], report["reba"]["max"]))
        told = report["circumstances"]
        assert (told["cycles_per_minute"], told["job_hours"], told["domestic"]) in (
            (None, None, False),
            (3.0, 2.0, True),
        )
        assert (report["working_postures"]["known"] is None) == (told["cycles_per_minute"] is None)
    assert scores[1][0] > scores[0][0]
    assert scores[1][1] > scores[0][1]


def test_table_and_files(run, capsys):
    csv, figure = run / "series.csv", run / "ergonomics.png"
    assert main(["ergonomics", str(run), "--csv", str(csv), "--figure", str(figure)]) == DONE
    shown = capsys.readouterr().out
    assert "margin.limiting_contact" in shown
    assert all(
        name in shown
        for name in ("OWAS", "static postures", "working postures", "low back L5/S1", "strong enough")
    )
    assert csv.read_text().startswith("time_s,rula,rula_left,rula_right,")
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--planned", "--executed"], "--planned and --executed exclude each other"),
        (["--load-pattern", "often"], "valid: intermittent, static, shock"),
        (["--load-kg", "-1"], "valid: a finite number >= 0"),
        (["--fraction", "2"], "fraction of the strength"),
        (["--back-lever-m", "0.5"], "lever of the back's muscles"),
        (["--lifting-hours", "9"], "hours of lifting"),
        (["--job-hours", "9"], "hours of the job"),
        (["--cycles-per-minute", "-1"], "cycles per minute"),
        (["--people-age", "12"], "age of the people"),
        (["--csv", "/there/is/no/such/folder.csv"], "cannot be written"),
    ],
)
def test_mistakes_take_one_line(run, capsys, options, message):
    assert main(["ergonomics", str(run), *options]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1


def test_a_file_without_what_is_asked_for(tmp_path, finished_run, capsys):
    write_motions(tmp_path / "motion.h5", replace(finished_run, executed=None))
    assert main(["ergonomics", str(tmp_path), "--executed"]) == BAD_INPUT
    assert "holds no executed motion; valid: planned" in capsys.readouterr().err
    write_motions(tmp_path / "motion.h5", replace(finished_run, body=None))
    assert main(["ergonomics", str(tmp_path)]) == BAD_INPUT
    assert "holds no body" in capsys.readouterr().err
