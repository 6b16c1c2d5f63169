"""``manikin walk``: a walk to a place, the JSON of it, its files, and one line for mistakes."""

import json

import numpy as np
import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, FAILED

TO = ["walk", "--to", "2", "1", "90"]
PROMISED = {
    "duration_s", "path_length_m", "cost", "max_forward_mps", "max_left_mps", "segments",
    "max_stance_slide_m", "path_wall_ms", "wall_s",
}  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["walk"], "--to is missing; valid: X Y HEADING_DEG, or --drive"),
        (["walk", "--to", "1", "0"], "--to"),
        (["walk", "--to", "1", "0", "north"], "--to"),
        (["walk", "--to", "0", "0", "0"], "walking goal is where the walker already is"),
        (["walk", "--to", "0", "0", "360"], "walking goal is where the walker already is"),
        (["walk", "--to", "nan", "0", "0"], "task.goal.at[0] is nan; valid: a finite number"),
        (["walk", "--to", "0", "0", "inf"], "task.goal.heading_deg is inf"),
        (["walk", "--to", "101", "0", "0"], "walking goal is 101 m from the start; valid: 0.01 to 100 m"),
        ([*TO, "--from", "2", "1", "90"], "walking goal is where the walker already is"),
        ([*TO, "--from", "0", "nan", "0"], "task.start.at[1] is nan"),
        ([*TO, "--max-speed", "nan"], "max_speed_m_s is nan"),
        ([*TO, "--max-speed", "-1"], "max_speed_m_s is -1.0"),
        ([*TO, "--max-speed", "0"], "max_speed_m_s is 0.0; valid: a number >= 0.1"),
        (
            [*TO, "--weights", "mine"],
            "weights is 'mine'; valid: 'prose', 'literal', 'recorded' or 'recorded-turns'",
        ),
        ([*TO, "--stature", "9"], "stature [m] is 9"),
        ([*TO, "--mass", "nan"], "mass_kg is nan"),
        ([*TO, "--sex", "other"], "'other' is not one of 'male', 'female'"),
        ([*TO, "--in", "nowhere"], "nowhere: there is no such file"),
        (["walk", "--to", "0.9", "0.75", "0", "--in", "platform"], "walking goal leaves -"),
        ([*TO, "--port", "8080"], "--port does not go with this run: it is for --drive"),
        (["walk", "--drive", "--to", "1", "0", "0"], "--to does not go with this run"),
        (["walk", "--drive", "--json"], "--json does not go with this run"),
        (["walk", "--drive", "--max-speed", "1"], "--max-speed does not go with this run"),
        (["walk", "--drive", "--weights", "prose"], "--weights does not go with this run"),
        (["walk", "--drive", "--out", "here"], "--out does not go with this run"),
        (["walk", "--drive", "--port", "99999"], "--port"),
        (["walk", "--drive", "--in", "nowhere"], "nowhere: there is no such file"),
        (["walk", "--drive", "--stature", "-1"], "stature [m] is -1"),
        (["walk", "--drive", "--from", "nan", "0", "0"], "walker's place"),
    ],
)
def test_mistakes_give_one_line_and_status_2(capfd, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("manikin.viewer.canvas.Page.run", lambda _: None)
    assert main(arguments) == BAD_INPUT
    out, err = capfd.readouterr()
    assert out == ""
    lines = [line for line in err.splitlines() if not line.startswith("walk:")]
    assert len(lines) == 1
    assert lines[0].startswith("manikin: ")
    assert says in lines[0]


@pytest.mark.parametrize(
    ("mode", "says"),
    [(TO, "floor_height_m is null; valid in a walk"), (["walk", "--drive", "--port", "0"], "has no floor")],
)
def test_scenes_without_a_floor_are_refused(capfd, tmp_path, monkeypatch, mode, says):
    monkeypatch.setattr("manikin.viewer.canvas.Page.run", lambda _: None)
    file = tmp_path / "bare.yaml"
    file.write_text("extends: platform\nname: bare\nfloor_height_m: null\n")
    assert main([*mode, "--in", str(file)]) == BAD_INPUT
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert says in err


def test_the_json_holds_what_is_promised(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*TO, "--json"]) == DONE
    found = json.loads(capfd.readouterr().out)
    assert found.keys() >= PROMISED
    assert all(found[key] == found["walk"][key] for key in PROMISED - {"wall_s"})
    assert np.hypot(2, 1) < found["path_length_m"] < 3.0
    assert 0.5 < found["max_forward_mps"] <= 1.6
    assert 0.0 <= found["max_left_mps"] < found["max_forward_mps"]
    assert found["max_stance_slide_m"] < 0.005
    assert found["path_wall_ms"] < 1e3 * found["wall_s"]
    kinds = {one["kind"] for one in found["segments"]}
    assert kinds <= {"holonomic", "nonholonomic", "standing"}
    assert found["segments"][-1]["end_s"] == pytest.approx(found["duration_s"])
    assert list(tmp_path.iterdir()) == []


def test_weights_and_speed_are_those_asked_for(capfd):
    walked = {}
    for name, more in {
        "prose": [], "literal": ["--weights", "literal"], "slow": ["--max-speed", "0.6"],
    }.items():  # fmt: skip
        assert main(["walk", "--to", "3", "0", "0", "--json", *more]) == DONE
        walked[name] = json.loads(capfd.readouterr().out)
    assert walked["slow"]["max_forward_mps"] == pytest.approx(0.6, abs=1e-3)
    assert walked["prose"]["max_forward_mps"] > 0.8
    # A straight walk has no lateral or angular terms, whose order the readings change.
    assert walked["literal"]["cost"] == pytest.approx(walked["prose"]["cost"], rel=1e-3)
    assert walked["slow"]["cost"] > walked["prose"]["cost"]


def test_a_walk_for_people_leaves_a_run_directory_that_runs_again(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*TO, "--no-figures"]) == DONE
    out = capfd.readouterr().out
    lines = out.splitlines()
    assert "path_length_m" in out
    assert len(lines) < 25
    assert lines[0].startswith("planned: walk-to-2-1-90, not executed")
    folder = tmp_path / "runs" / "walk-to-2-1-90"
    assert lines[-1] == f"report: {folder.relative_to(tmp_path)}/report.html"
    assert (folder / "motion.h5").exists()
    summary = json.loads((folder / "summary.json").read_text())
    assert main(["run", str(folder / "scenario.yaml"), "--json"]) == DONE
    again = json.loads(capfd.readouterr().out)
    assert again["walk"]["cost"] == pytest.approx(summary["walk"]["cost"])


def test_obstacles_of_a_scenario_are_walked_around(capfd, tmp_path):
    file = tmp_path / "post.yaml"
    post = {"name": "post", "box": [0.3, 0.3, 2.0], "position": [1.5, 0.1, 1.0]}
    data = {"name": "post", "walking": {}, "scene": [post], "task": {
        "start": {"at": [0, 0]}, "goal": {"at": [3, 0]}}}  # fmt: skip
    file.write_text(json.dumps(data))
    options = ["--from", "0", "0", "0", "--to", "3", "0", "0", "--json"]
    assert main(["walk", *options]) == DONE
    free = json.loads(capfd.readouterr().out)
    assert main(["walk", *options, "--in", str(file)]) == DONE
    found = json.loads(capfd.readouterr().out)
    assert found["min_room_m"] >= 0.05 - 1e-3
    assert found["cost"] > free["cost"]
    assert free["min_room_m"] is None


def test_a_walk_without_a_way_is_status_3_with_a_reason_and_files(capfd, tmp_path):
    ring = [
        {"name": name, "box": size, "position": [*place, 1.0]}
        for name, size, place in (
            ("east", [0.1, 4.0, 2.0], [2.0, 0.0]), ("west", [0.1, 4.0, 2.0], [-2.0, 0.0]),
            ("north", [4.0, 0.1, 2.0], [0.0, 2.0]), ("south", [4.0, 0.1, 2.0], [0.0, -2.0]),
        )
    ]  # fmt: skip
    file = tmp_path / "cell.yaml"
    data = {"name": "cell", "walking": {}, "scene": ring, "task": {
        "start": {"at": [0, 0]}, "goal": {"at": [1, 0]}}}  # fmt: skip
    file.write_text(json.dumps(data))
    out = tmp_path / "run"
    arguments = ["walk", "--to", "5", "0", "0", "--in", str(file), "--out", str(out), "--json"]
    assert main(arguments) == FAILED
    printed, err = capfd.readouterr()
    found = json.loads(printed)
    assert found.keys() >= PROMISED
    assert found["max_stance_slide_m"] is None
    assert "no way" in found["failure"]["reason"]
    assert "Traceback" not in err
    assert (out / "summary.json").exists()
    assert (out / "scenario.yaml").exists()
    assert not (out / "motion.h5").exists()


def test_who_walks_into_somebody_waiting_is_a_failure_and_no_mistake(capfd, tmp_path):
    file = tmp_path / "rammed.yaml"
    rammer = {"name": "rammer", "start": {"at": [0, 3]}, "via": [{"at": [0, 0.1]}]}
    data = {"name": "rammed", "walking": {"wait_s": 8.0, "others": [rammer]}, "task": {
        "start": {"at": [0, 0]}, "goal": {"at": [3, 0]}}}  # fmt: skip
    file.write_text(json.dumps(data))
    assert main(["run", str(file), "--out", str(tmp_path / "run"), "--json"]) == FAILED
    out, _ = capfd.readouterr()
    reason = json.loads(out)["failure"]["reason"]
    assert "obstacle 'rammer' comes within" in reason
    assert "\n" not in reason
