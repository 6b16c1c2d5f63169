"""The command line: exit status, one line for every mistake, nothing but JSON on standard output."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
import types

import numpy as np
import pytest
import yaml

import manikin
from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, FAILED, INTERRUPTED
from manikin.motion.file import write_motions
from manikin.reports.figures import FIGURES
from manikin.runtime.files import LOCK

SUMMARY = {
    "scenario": "platform", "stature_m": 1.75, "mass_kg": 79.0, "seed": 0,
    "verdict": "proved", "planned": True, "proved": True, "succeeded": True, "failure": None,
    "requirements": [
        {
            "stage": "execution", "key": "min_margin", "name": "executed margin", "unit": "N.m",
            "measured": 33.0, "sense": ">", "limit": 0.0, "time_s": 1.25, "where": "", "held": True,
        },
    ],
    "centroidal": {"duration_s": 4.7, "phase_durations_s": [0.3, 0.4], "min_margin": 33.0},
    "wholebody": {"swings": [{"effector": "left_foot", "method": "curve"}], "closest_pair": ["head", "roof"]},
    "execution": {"fell": False, "peak_torque_Nm": {"left_knee": 120.0, "right_knee": -150.0}},
    "walk": None, "wall_s": 1.0,
}  # fmt: skip

STANCE = {
    "mass_kg": 79,
    "com": [0, 0, 0.92],
    "contacts": [
        {"effector": "left_foot", "position": [0, 0.1, 0]},
        {"effector": "right_foot", "position": [0, -0.1, 0], "friction": 0.5},
    ],
}


@pytest.fixture
def pipeline(monkeypatch, finished_run):
    """A stand-in that prints, reports progress, writes the motion and remembers how it was called."""
    calls = []

    def run(scenario, *, out=None, seed=0, progress=None):
        calls.append((scenario, out, seed))
        os.write(1, b"a native library's banner\n")
        print("a chatty library")
        progress("centroidal", 0.5)
        progress("centroidal", 1.0)
        if stand_in.error is not None:
            raise stand_in.error
        if out is not None:
            from manikin.pipeline.run_directory import RunDirectory

            directory = RunDirectory(out)
            directory.write("scenario.yaml", scenario.to_yaml())
            write_motions(directory.path / "motion.h5", finished_run)
            directory.write("summary.json", stand_in.summary)
        return types.SimpleNamespace(
            summary=stand_in.summary,
            planned=finished_run.planned,
            executed=finished_run.executed,
            motion=finished_run.executed,
            directory=out,
        )

    stand_in = types.SimpleNamespace(run=run, calls=calls, summary=SUMMARY, error=None)
    monkeypatch.setitem(sys.modules, "manikin.pipeline.runner", stand_in)
    monkeypatch.setattr("manikin.pipeline.runner", stand_in, raising=False)
    return stand_in


def assert_refused(capfd, arguments, *says):
    assert main([str(argument) for argument in arguments]) == BAD_INPUT
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("manikin: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for text in says:
        assert text in err


def test_version_and_help(capfd):
    assert main(["--version"]) == DONE
    assert capfd.readouterr().out == f"manikin {manikin.__version__}\n"
    for arguments in (["--help"], ["run", "--help"]):
        assert main(arguments) == DONE
        assert "Usage" in capfd.readouterr().out


def test_a_command_with_nothing_to_do_says_what_to_do_next(capfd):
    """A few commands with a line each; every one of them is a command, with arguments that it takes."""
    assert main([]) == DONE
    lines = [line.split() for line in capfd.readouterr().out.splitlines() if line.startswith("  manikin ")]
    assert 4 <= len(lines) <= 6
    for _, command, *_ in lines:
        assert main([command] if command == "--help" else [command, "--help"]) == DONE


def test_one_thread_unless_the_user_says_otherwise(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    main(["--version"])
    assert os.environ["OMP_NUM_THREADS"] == "1"
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    main(["--version"])
    assert os.environ["OMP_NUM_THREADS"] == "2"


def test_scenarios_are_listed_with_one_line_each(capfd):
    assert main(["scenarios"]) == DONE
    lines = capfd.readouterr().out.splitlines()
    assert any(line.startswith("platform ") for line in lines)
    assert main(["scenarios", "--json"]) == DONE
    listed = json.loads(capfd.readouterr().out)
    assert "platform" in listed["scenarios"]
    assert set(listed["variants"]) == set(listed["scenarios"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["rum"], "No such command 'rum'"),
        (["run"], "Missing argument"),
        (["run", "platform", "--sed", "1"], "No such option"),
        (["run", "platform", "--seed", "one"], "--seed"),
        (["run", "platform", "--seed", "-1"], "seed is -1"),
        (["run", "platform", "--stature", "tall"], "--stature"),
        (["run", "platform", "--stature", "nan"], "--stature"),
        (["run", "platform", "--stature", "5"], "--stature"),
        (["run", "platform", "--mass", "-3"], "--mass"),
        (["run", "platform", "--mass", "11"], "greater than or equal to 12"),
        (["run", "platform", "--age", "12"], "--age"),
        (["run", "platform", "--stature", "0.95"], "valid: 10 to 60 kg/m^2"),
        (["run", "all", "--stature", "0.95"], "valid: 10 to 60 kg/m^2"),
        (["run", "platform", "--sex", "other"], "'other' is not one of 'male', 'female'"),
        (["run", "plattform"], "did you mean 'platform'"),
        (["run", "none.yaml"], "no such file"),
        (["run", "."], "is a directory"),
        (["run", ""], "is empty"),
        (["run", "platform", "--variant", "low"], "has no variant 'low'; valid: slippery"),
        (["run", "platform@low"], "has no variant 'low'; valid: slippery"),
        (["run", "platform", "--set", "supports.frictoin=1"], "did you mean 'friction'? valid: "),
        (["run", "platform", "--set", "scene.rof.box.0=1"], "or roof, threshold, platform"),
        (["compare", "none"], "Missing argument"),
        (["compare", "none", "none"], "no such directory"),
        (["compare", ".", "."], "is not a run directory"),
        (["run", "all", "--variant", "slippery"], "--variant does not go with this run"),
        (["run", "all", "--set", "seed=1"], "--set does not go with this run"),
        (["run", "all", "--uncertainty", "2"], "--uncertainty does not go with this run"),
        (["run", "all", "--seed", "-1"], "seed is -1"),
        (["run", "all", "--jobs", "0"], "--jobs"),
        (["run", "platform", "--jobs", "2"], "--jobs does not go with this run"),
        (["view", "none"], "no such file"),
        (["view", "none", "--port", "99999"], "--port"),
        (["export", "none", "--format", "bvh"], "no such file"),
        (["export", ".", "--format", "gltf"], "is not one of 'bvh', 'c3d'"),
        (["export", ".", "--format", "avi"], "is not one of 'bvh', 'c3d'"),
        (["export", ".", "--format", "bvh", "--size", "640x480"], "--size"),
        (["export", "."], "--format"),
        (["balance", "none.yaml"], "no such file"),
        (["balance", "."], "is a directory"),
        (["push", "--force", "200"], "--direction is missing"),
    ],
)
def test_mistakes_give_one_line_and_status_2(capfd, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    assert_refused(capfd, arguments, says)
    assert list(tmp_path.iterdir()) == []


def test_bad_scenario_file_names_file_line_and_key(capfd, tmp_path):
    (tmp_path / "bad.yaml").write_text("name: x\nbody: {mass_kg: -1}\ntask: {start: {com: [0, 0, 1]}}\n")
    assert_refused(capfd, ["run", tmp_path / "bad.yaml", "--json"], "bad.yaml:2: body.mass_kg is -1")


@pytest.mark.usefixtures("pipeline")
def test_run_prints_exactly_one_json_object(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "platform", "--json"]) == DONE
    out, err = capfd.readouterr()
    assert json.loads(out) == SUMMARY
    assert "banner" in err
    assert "chatty" in err
    assert "centroidal" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("pipeline")
def test_run_leaves_a_whole_directory(capfd, tmp_path, monkeypatch):
    """With some of the figures, all of which ``tests/reports/figures`` draws."""
    monkeypatch.chdir(tmp_path)
    for name in set(FIGURES) - {"com", "margin", "walk_paths"}:
        monkeypatch.delitem(FIGURES, name)
    assert main(["run", "platform", "--out", "result", "--json"]) == DONE
    assert json.loads(capfd.readouterr().out) == SUMMARY
    folder = tmp_path / "result"
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    files.remove(LOCK)
    assert files == {
        "scenario.yaml", "motion.h5", "motion.bvh", "motion.glb", "summary.json", "report.html",
        *(f"figures/{name}.png" for name in FIGURES if name != "walk_paths"),
    }  # fmt: skip


@pytest.mark.usefixtures("pipeline")
def test_run_for_people_prints_the_verdict_first_and_the_report_last(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "platform", "--no-figures"]) == DONE
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].startswith("proved: platform")
    assert any(line.split()[:3] == ["ok", "executed", "margin"] and "33 N.m" in line for line in lines)
    assert lines[-2] == "watch it with: manikin view runs/platform"
    page = tmp_path / lines[-1].removeprefix("report: ")
    assert page == tmp_path / "runs" / "platform" / "report.html"
    assert "proved: platform" in page.read_text()
    assert (tmp_path / "runs" / "platform" / "summary.json").exists()
    assert not (tmp_path / "runs" / "platform" / "figures").exists()


def test_a_run_that_fell_says_so_first_and_is_status_3(capfd, tmp_path, monkeypatch, pipeline):
    """The plan held: it is called planned, and the run is no success all the same."""
    failure = {"stage": "execution", "reason": "fell at 27.6 s", "time_s": 27.6, "where": "phase 3"}
    fell = {**SUMMARY["requirements"][0], "key": "fell", "name": "falls", "unit": "", "measured": 1.0,
            "sense": "<=", "held": False}  # fmt: skip
    pipeline.summary = {
        **SUMMARY, "verdict": "failed", "proved": False, "succeeded": False, "failure": failure,
        "requirements": [*SUMMARY["requirements"], fell],
    }  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["run", "platform", "--no-figures"]) == FAILED
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].startswith("failed: fell at 27.6 s (platform, execution")
    assert [line.split()[1] for line in lines if line.startswith("  FAILED")] == ["falls"]
    page = (tmp_path / "runs" / "platform" / "report.html").read_text()
    assert "failed: fell at 27.6 s" in page
    assert "NOT KEPT" in page


def test_a_run_without_a_motion_advertises_no_view(capfd, tmp_path, monkeypatch):
    """Nothing that cannot open: the report page is written, and no motion is there to watch."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", "platform@slippery", "--no-figures"]) == FAILED
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].startswith("failed: ")
    assert lines[0].endswith("(platform@slippery, centroidal)")
    assert not any("manikin view" in line for line in lines)
    assert (tmp_path / lines[-1].removeprefix("report: ")).is_file()
    assert not list(tmp_path.rglob("motion.h5"))


def test_options_reach_the_pipeline_and_the_resolved_scenario(pipeline, tmp_path):
    options = ["--stature", "1.6", "--mass", "58", "--sex", "female", "--seed", "7"]
    assert main(["run", "platform", *options, "--out", str(tmp_path / "r"), "--no-figures", "--json"]) == DONE
    scenario, _, seed = pipeline.calls[0]
    assert seed == 7
    resolved = yaml.safe_load((tmp_path / "r" / "scenario.yaml").read_text())
    assert resolved["body"] == {
        "model": "human", "stature_m": 1.6, "mass_kg": 58.0, "sex": "female", "age": 30.0, "strength": 1.0,
    }  # fmt: skip
    assert resolved["seed"] == 7
    assert scenario.stature_scale == pytest.approx(1.6 / 1.75)


def test_variants_and_single_values_reach_the_pipeline(pipeline, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("extends: platform\nname: mine\nvariants: {light: {body: {mass_kg: 60}}}\n")
    options = [
        "--set",
        "supports.friction=0.4",
        "--set",
        "scene.roof.position.2=1.6",
        "--no-figures",
        "--json",
    ]
    for source in ([str(file), "--variant", "light"], [f"{file}@light"]):
        assert main(["run", *source, *options]) == DONE
        scenario = pipeline.calls[-1][0]
        assert (scenario.name, scenario.mass, scenario.file.supports.friction) == ("mine@light", 60.0, 0.4)
        assert scenario.file.scene[0].position[2] == 1.6


def test_explained_failure_is_status_3(capfd, pipeline):
    failure = {"stage": "centroidal", "reason": "no margin in phase 4", "time_s": 1.2, "where": "left_foot"}
    pipeline.summary = {**SUMMARY, "verdict": "failed", "succeeded": False, "failure": failure}
    assert main(["run", "platform", "--json"]) == FAILED
    assert json.loads(capfd.readouterr().out)["failure"] == failure


@pytest.fixture
def two_runs(monkeypatch):
    """Every run of ``run all`` replaced by a process that prints a made-up summary."""
    from manikin.pipeline import batch

    failure = {"stage": "centroidal", "reason": "no margin", "time_s": 0.0, "where": ""}
    stages = dict.fromkeys(("centroidal", "wholebody", "execution"))
    summaries = {
        "one": {
            "scenario": "one",
            "verdict": "planned",
            "planned": True,
            "proved": False,
            "succeeded": True,
            "failure": None,
            **stages,
            "wall_s": 1.0,
        },
        "two": {
            "scenario": "two@bad",
            "verdict": "failed",
            "planned": False,
            "proved": False,
            "succeeded": False,
            "failure": failure,
            **stages,
            "wall_s": 1.0,
        },
    }

    def command(_options, job):
        summary = summaries[job.scenario]
        status = 0 if summary["succeeded"] else 3
        return [sys.executable, "-c", f"print({json.dumps(summary)!r}); raise SystemExit({status})"]

    def expect(outcome):
        jobs = (batch.Job("one"), batch.Job("two", "bad", outcome))
        monkeypatch.setattr(batch, "built_in_jobs", lambda **_: jobs)

    monkeypatch.setattr(batch.RunOptions, "command", command)
    return expect


def test_run_all_prints_one_json_object_and_status_0_when_all_is_as_expected(capfd, two_runs):
    two_runs("failure")
    assert main(["run", "all", "--json"]) == DONE
    out, err = capfd.readouterr()
    report = json.loads(out)
    assert [run["scenario"] for run in report["runs"]] == ["one", "two@bad"]
    assert (report["as_expected"], report["not_as_expected"]) == (2, 0)
    assert (report["planned"], report["proved"], report["succeeded"], report["failed"]) == (1, 0, 1, 1)
    assert report["wall_s"] > 0
    assert (report["stature_m"], report["seed"]) == (None, None)
    assert "[2/2]" in err


def test_run_all_says_which_stature_and_seed_it_was_asked_for(capfd, two_runs):
    two_runs("failure")
    assert main(["run", "all", "--json", "--stature", "1.65", "--seed", "3", "--jobs", "2"]) == DONE
    report = json.loads(capfd.readouterr().out)
    assert (report["stature_m"], report["seed"]) == (1.65, 3)


def test_run_all_is_status_3_and_a_table_when_one_fails(capfd, two_runs, tmp_path):
    two_runs("success")
    assert main(["run", "all", "--out", str(tmp_path / "runs"), "--jobs", "1"]) == FAILED
    out = capfd.readouterr().out
    assert "FAILED (centroidal): no margin" in out
    assert "2 runs: 1 planned, 0 proved; 1 succeeded, 1 failed (0 fell); 1 as expected, 1 not" in out
    assert json.loads((tmp_path / "runs" / "results.json").read_text())["failed"] == 1


def test_interruption_is_one_line_and_status_130(capfd, pipeline):
    pipeline.error = KeyboardInterrupt()
    assert main(["run", "platform", "--json"]) == INTERRUPTED
    out, err = capfd.readouterr()
    assert out == ""
    assert err.endswith("manikin: interrupted; the files of finished stages are kept\n")


def test_interruption_that_a_solver_swallows_comes_back(capfd, pipeline, monkeypatch):
    """CasADi's IPOPT takes the exception for its own stop signal and returns normally."""
    inner = pipeline.run

    def swallowing(scenario, **options):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        return inner(scenario, **options)

    monkeypatch.setattr(pipeline, "run", swallowing)
    assert main(["run", "platform", "--json"]) == INTERRUPTED
    out, err = capfd.readouterr()
    assert out == ""
    assert err.endswith("manikin: interrupted; the files of finished stages are kept\n")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_terminated_process_ends_like_an_interrupted_one(number):
    """SIGTERM unwinds the program, and SIGINT does where a shell has set it to be ignored."""
    code = (
        "import signal, sys, time\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "import manikin.cli as cli\n"
        "def wait(*a):\n print('ready', flush=True)\n time.sleep(60)\n"
        "cli.app = lambda **k: wait()\nsys.exit(cli.main([]))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        assert process.wait(timeout=30) == INTERRUPTED
        assert process.stderr.read().count("\n") == 1


def program(tmp_path, code, *, signalled):
    """Status and output of ``python -m`` of a program with other commands, perhaps interrupted when ready."""
    (tmp_path / "other.py").write_text(
        "import os, signal, sys, time\nimport manikin.cli as cli\n"
        f"from manikin.__main__ import program\n{code}\ncli.app = app\nsys.exit(program())\n"
    )
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    with subprocess.Popen(
        [sys.executable, "-m", "other"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, "PYTHONPATH": path},
    ) as process:  # fmt: skip
        if signalled:
            assert process.stdout.readline() == "ready\n"
            process.send_signal(signal.SIGINT)
        return process.wait(timeout=30), process.stdout.read()


def test_an_interrupt_in_code_that_was_given_as_text_is_no_death_by_signal(tmp_path):
    """Python ends by SIGINT if KeyboardInterrupt ever left an ``exec``, as dataclasses use it."""
    status, output = program(tmp_path, "def app(**_): exec('raise KeyboardInterrupt')", signalled=False)
    assert status == INTERRUPTED
    assert output.startswith("manikin: interrupted")


def test_an_interrupt_waits_for_a_library_that_is_imported(tmp_path):
    """Some catch everything around their own imports, and work on without a part of them."""
    (tmp_path / "library.py").write_text(
        "import time\nprint('ready', flush=True)\ntry:\n time.sleep(0.5)\n"
        "except BaseException:\n PART = None\nelse:\n print('whole', flush=True)\n"
    )
    status, output = program(tmp_path, "def app(**_):\n import library\n time.sleep(60)", signalled=True)
    assert (status, output.count("\n")) == (INTERRUPTED, 2)
    assert output.startswith("whole\n")


def test_a_signal_does_not_change_the_status_of_a_command_that_is_done(tmp_path):
    """Python gives SIGINT back to the system before the last objects of a program go."""
    code = (
        "class Last:\n def __del__(self, kill=os.kill, own=os.getpid()):\n  kill(own, signal.SIGINT)\n"
        "last = Last()\ndef app(**_):\n return 3"
    )
    assert program(tmp_path, code, signalled=False) == (FAILED, "")


def test_export_writes_beside_the_run(capfd, finished_run, tmp_path):
    write_motions(tmp_path / "motion.h5", finished_run)
    assert main(["export", str(tmp_path), "--format", "csv", "--motion", "planned"]) == DONE
    assert capfd.readouterr().out.strip() == str(tmp_path / "motion.csv")
    assert len((tmp_path / "motion.csv").read_text().splitlines()) == 421
    assert main(["export", str(tmp_path / "motion.h5"), "--format", "bvh", "--rate", "50"]) == DONE
    assert "Frame Time: 0.02\n" in (tmp_path / "motion.bvh").read_text()
    assert main(["export", str(tmp_path), "--format", "csv", "--motion", "recorded"]) == BAD_INPUT
    assert main(["export", str(tmp_path), "--format", "csv", "--rate", "-3"]) == BAD_INPUT


def test_balance_agrees_with_the_library(capfd, tmp_path):
    from manikin.balance import pseudo_wrench, stability_margins, wrench_polytope
    from manikin.contact import Stance, sole

    (tmp_path / "stance.yaml").write_text(yaml.safe_dump(STANCE))
    assert main(["balance", str(tmp_path / "stance.yaml"), "--json", "--polytope"]) == DONE
    report = json.loads(capfd.readouterr().out)
    stance = Stance(
        [
            sole("left_foot", (0, 0.1, 0), length=0.28, width=0.12, friction=0.7),
            sole("right_foot", (0, -0.1, 0), length=0.28, width=0.12, friction=0.5),
        ],
        3 * 79 * 9.81,
    )
    W = wrench_polytope(stance)
    wrench = pseudo_wrench(79.0, (0, 0, 0.92), (0, 0, 0))
    assert report["margin_Nm"] == pytest.approx(
        float(stability_margins(W, wrench, (0, 0, 0.92)).wrench_about_com), rel=1e-12
    )
    assert report["balanced"]
    assert len(report["H"]) == len(report["h"]) == len(W)
    assert main(["balance", str(tmp_path / "stance.yaml")]) == DONE
    assert "limiting.description" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"mass_kg": -79}, "mass_kg is -79"),
        ({"mass_kg": None}, "mass_kg is empty"),
        ({"com": [0, 0, float("nan")]}, "com[2] is nan"),
        ({"contacts": []}, "contacts is []"),
        ({"contacts": [{"position": [0, 0, 0]}]}, "contacts[0].effector is missing"),
        ({"contacts": [{"effector": "left_foot", "position": [0, 0, 0], "friction": 0}]}, "friction is 0"),
        ({"contacts": [STANCE["contacts"][0]] * 2}, "contacts[1].effector is 'left_foot' again"),
        ({"contacts": [{"effector": "left_hand", "position": [0, 0, 1]}]}, "max_force_N is missing"),
        ({"contacts": [{"effector": "left_foot", "position": [0, 0]}]}, "contacts[0].position is [0, 0]"),
        ({"acceleration": "up"}, "acceleration is 'up'"),
        ({"friction_model": "circle"}, "friction_model is 'circle'"),
        ({"masss_kg": 3}, "did you mean 'mass_kg'"),
    ],
)  # fmt: skip
def test_bad_stance_files_give_one_line(capfd, tmp_path, change, says):
    (tmp_path / "stance.yaml").write_text(yaml.safe_dump({**STANCE, **change}))
    assert_refused(capfd, ["balance", tmp_path / "stance.yaml", "--json"], "stance.yaml:", says)


def test_degenerate_stances_have_a_report(capfd, tmp_path):
    """A single point cannot balance a person beside it; a single point below is balanced on an edge."""
    contact = {"effector": "left_foot", "kind": "point", "position": [0.3, 0, 0]}
    (tmp_path / "stance.yaml").write_text(yaml.safe_dump({**STANCE, "contacts": [contact]}))
    assert main(["balance", str(tmp_path / "stance.yaml"), "--json"]) == DONE
    report = json.loads(capfd.readouterr().out)
    assert not report["balanced"]
    assert report["margin_Nm"] < 0


def test_help_does_not_load_the_engines():
    code = (
        "import sys\nfrom manikin.cli import main\nmain(['--help'])\n"
        "heavy = {'pinocchio', 'mujoco', 'casadi', 'numpy', 'matplotlib', 'pydantic', 'h5py', 'viser'}\n"
        "sys.exit(','.join(sorted(heavy & set(sys.modules))) or 0)"
    )
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr


def test_wrong_input_is_refused_before_the_engines_load():
    code = (
        "import sys\nfrom manikin.cli import main\nstatus = main(['run', 'platform', '--mass', '-1'])\n"
        "heavy = {'pinocchio', 'mujoco', 'casadi', 'matplotlib', 'h5py', 'viser'} & set(sys.modules)\n"
        "sys.exit(','.join(sorted(heavy)) or status)"
    )
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert finished.returncode == BAD_INPUT, finished.stderr


def test_viewer_command_serves_and_ends_with_ctrl_c(finished_run, tmp_path):
    pytest.importorskip("viser")
    write_motions(tmp_path / "motion.h5", finished_run)
    command = [sys.executable, "-m", "manikin", "view", str(tmp_path), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stderr.readline()
        assert "http://127.0.0.1:" in line
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == DONE
        assert process.stdout.read() == ""
        assert "Traceback" not in process.stderr.read()


def test_closed_pipe_is_no_traceback():
    command = f"{sys.executable} -m manikin.cli scenarios --json | true"
    finished = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert "Traceback" not in finished.stderr
    assert "Exception" not in finished.stderr


CUPBOARD = """
name: cupboard
scene:
  - {name: cupboard, box: [0.6, 1.2, 1.9], position: [0.8, 0.0, 0.95]}
task: {start: {at: [0, 0], heading_deg: 0}, goal: {at: [0, 0]}}
"""
PUSHING = ["--limb", "right_arm", "--task", "1", "0", "0"]


@pytest.fixture
def cupboard(tmp_path):
    (tmp_path / "cupboard.yaml").write_text(CUPBOARD)
    return str(tmp_path / "cupboard.yaml")


def test_a_pushing_hand_is_put_on_the_cupboard_and_against_the_push(capfd, cupboard, tmp_path):
    picture = tmp_path / "answer.png"
    assert main(["contact", cupboard, *PUSHING, "--json", "--figure", str(picture)]) == DONE
    out, err = capfd.readouterr()
    answer = json.loads(out)
    assert err == ""
    assert answer["found"]
    assert answer["failure"] is None
    assert answer["obstacle"] == "cupboard"
    assert answer["role"] == "object"
    assert answer["normal"] == pytest.approx([-1.0, 0.0, 0.0])
    assert answer["position"][0] == pytest.approx(0.5)
    assert answer["efort"] > 0.0
    assert answer["candidates"] > 0
    assert answer["wall_ms"] > 0.0
    assert picture.stat().st_size > 1000


def test_a_person_is_asked_where_they_are_told_to_stand(capfd, cupboard):
    """Turned by a quarter and beside the cupboard, the other arm touches its side."""
    place = ["--at", "0.8", "-1.0", "--heading", "90"]
    asked = ["--limb", "left_arm", "--task", "0", "1", "0", *place, "--role", "object"]
    assert main(["contact", cupboard, *asked, "--json"]) == DONE
    answer = json.loads(capfd.readouterr().out)
    assert answer["normal"] == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)
    assert answer["q"][:2] == [0.8, -1.0]


def test_no_contact_is_an_explained_failure(capfd, cupboard):
    far = ["--at", "-3", "0"]
    assert main(["contact", cupboard, *PUSHING, *far, "--json"]) == FAILED
    answer = json.loads(capfd.readouterr().out)
    assert not answer["found"]
    assert answer["failure"] == "no surface is within reach of right_arm"
    assert answer["hindrance"] == "reach"
    assert answer["position"] is None
    assert main(["contact", cupboard, *PUSHING, *far]) == FAILED
    out, err = capfd.readouterr()
    assert "no contact: no surface is within reach" in err
    assert "found" in out


def test_built_in_scenarios_are_asked_at_the_place_of_their_feet(capfd):
    assert main(["contact", "platform", "--limb", "left_leg", "--task", "0", "0", "1", "--json"]) == DONE
    answer = json.loads(capfd.readouterr().out)
    assert answer["obstacle"] == "floor"
    assert answer["role"] == "body"
    assert answer["kind"] == "sole"


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (["--limb", "arm", "--task", "1", "0", "0"], "no limb 'arm'; valid: left_arm, right_arm"),
        (["--limb", "left_arm", "--task", "0", "0", "0"], "task is [0.0, 0.0, 0.0]; valid: a direction"),
        (["--limb", "left_arm", "--task", "nan", "0", "0"], "task"),
        (["--limb", "left_arm", "--task", "1", "0"], "--task"),
        (["--limb", "left_arm"], "--task"),
        (["--task", "1", "0", "0"], "--limb"),
        ([*PUSHING, "--role", "hero"], "role is 'hero'; valid: auto, body, object"),
        ([*PUSHING, "--kind", "glue"], "kind is 'glue'; valid: sole, point, grasp"),
        ([*PUSHING, "--heuristic", "hope"], "heuristic is 'hope'; valid: efort, distance"),
        ([*PUSHING, "--posture", "flying"], "posture is 'flying'; valid: standing, seated, crouched"),
        ([*PUSHING, "--samples", "3"], "--samples"),
        ([*PUSHING, "--at", "nan", "0"], "at x [m]"),
        ([*PUSHING, "--heading", "inf"], "heading [deg]"),
        ([*PUSHING, "--figure", "/nowhere/x.png"], "/nowhere/x.png"),
    ],
)
def test_wrong_questions_about_a_contact_are_refused_in_one_line(capfd, cupboard, changed, says):
    assert_refused(capfd, ["contact", cupboard, *changed], says)


def test_a_climber_stands_on_the_front_of_the_feet_and_grips_by_the_task(capfd):
    """The rules of the file's contacts count here as well; another direction has another hand hold."""

    def asked(limb, *task):
        assert main(["contact", "climb", "--limb", limb, "--task", *task, "--json"]) == DONE
        return json.loads(capfd.readouterr().out)

    foot, up, aside = (
        asked("right_leg", "0", "0", "1"),
        asked("left_arm", "0", "0", "1"),
        asked("left_arm", "0", "1", "0"),
    )
    assert all(answer["obstacle"].startswith("hold") for answer in (foot, up, aside))
    assert foot["normal"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    assert np.linalg.norm(np.subtract(up["position"], aside["position"])) > 0.05


def test_a_seated_body_gets_up_with_its_hands_on_what_is_level(capfd, tmp_path):
    """The start of a scenario without supports: hands press on the table or the seat, below them."""
    asked = ["--limb", "left_arm", "--task", "0", "0", "1", "--json"]
    near = tmp_path / "near.yaml"
    near.write_text(
        "extends: stand-up-chair\nname: near\nscene:\n"
        "- {name: seat, padded: true, box: [0.42, 0.46, 0.06], position: [-0.08, 0.0, 0.42]}\n"
        "- {name: table, box: [0.7, 1.4, 0.04], position: [0.85, 0.0, 0.72]}\n"
    )
    assert main(["contact", str(near), *asked]) == DONE
    answer = json.loads(capfd.readouterr().out)
    assert answer["obstacle"] in ("table", "seat")
    assert answer["normal"] == pytest.approx([0.0, 0.0, 1.0])
    assert answer["role"] == "body"
    assert_refused(
        capfd, ["contact", "platform", *asked, "--posture", "seated"], "no posture", "valid: another"
    )


def test_a_body_without_limbs_is_refused(capfd):
    assert_refused(capfd, ["contact", "walls", *PUSHING], "has no limbs; valid: ")
