"""``manikin push``: one push as a run of its own, maps that go on where they were, one line for mistakes."""

import csv
import json

import numpy as np
import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, FAILED, INTERRUPTED
from manikin.scenarios import load_scenario
from manikin.simulation import HeldImpulse
from manikin.simulation.push_search import DirectionSearch

ONE = ["push", "--force", "100", "--direction", "0"]
MAP = ["push", "--map", "--directions", "4", "--jobs", "1"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["push"], "--force is missing"),
        (["push", "--force", "100"], "--direction is missing"),
        (["push", "--force", "nan", "--direction", "0"], "--force [N] is nan; valid: a finite number"),
        (["push", "--force", "1e6", "--direction", "0"], "<= 5000"),
        (["push", "--force", "-10", "--direction", "0"], "--force [N] is -10"),
        (["push", "--force", "0", "--direction", "0"], "--force [N] is 0"),
        (["push", "--force", "hard", "--direction", "0"], "--force"),
        (["push", "--force", "100", "--direction", "inf"], "--direction: push.direction_deg is inf"),
        ([*ONE, "--duration", "-0.1"], "--duration: push.duration_s is -0.1; valid: a number > 0"),
        ([*ONE, "--duration", "59"], "--duration: "),
        ([*ONE, "--duration", "nan"], "--duration: "),
        ([*ONE, "--delay", "-1"], "--delay: recovery.delay_s is -1.0"),
        ([*ONE, "--feet", "glued"], "--feet: recovery.feet is 'glued'; valid: 'held' or 'free'"),
        (
            [*ONE, "--support", "hand"],
            "--support: recovery.support is 'hand'; valid: 'both', 'left' or 'right'",
        ),
        ([*ONE, "--steps", "3", "--feet", "free"], "--steps: recovery.steps is 3; valid: a number <= 2"),
        ([*ONE, "--steps", "-1", "--feet", "free"], "--steps: recovery.steps is -1"),
        ([*ONE, "--steps", "1"], "--steps: recovery.steps is 1 of held feet; valid: 0, or free feet"),
        (
            [*ONE, "--steps", "1", "--feet", "free", "--support", "left"],
            "--steps: recovery.steps is 1 on one foot; valid: 0, or both feet",
        ),
        (
            [*ONE, "--feet-apart", "0.2", "--support", "left"],
            "--feet-apart: recovery.feet_apart_m is 0.2 on one foot; valid: leave it out, or both feet",
        ),
        ([*ONE, "--ankle-stiffness", "-1"], "--ankle-stiffness: recovery.ankle_stiffness is -1.0"),
        ([*ONE, "--ankle-stiffness", "nan"], "--ankle-stiffness: recovery.ankle_stiffness is nan"),
        ([*ONE, "--locked", "legs"], "'arms' or 'hips'"),
        ([*ONE, "--strength", "0"], "--strength: recovery.strength is 0.0"),
        ([*ONE, "--body", "insect"], "'--body': 'insect' is not one of 'kudoh', 'human'"),
        ([*ONE, "--stature", "1.7"], "--stature: body.stature_m does not apply to the body of Kudoh"),
        ([*ONE, "--body", "human", "--stature", "9"], "stature [m] is 9"),
        ([*ONE, "--body", "human", "--sex", "other"], "'--sex': 'other' is not one of 'male', 'female'"),
        ([*ONE, "--directions", "4"], "--directions does not go with this run"),
        ([*ONE, "--tolerance", "4"], "--tolerance does not go with this run"),
        ([*ONE, "--compare", "feet=free"], "--compare does not go with this run"),
        ([*ONE, "--jobs", "2"], "--jobs does not go with this run"),
        ([*MAP, "--force", "100"], "--force does not go with this run"),
        ([*MAP, "--direction", "0"], "--direction does not go with this run"),
        (["push", "--map", "--directions", "0"], "number of directions is 0; valid: 1 to 360"),
        (["push", "--map", "--jobs", "0"], "--jobs"),
        ([*MAP, "--tolerance", "0"], "--tolerance is 0"),
        ([*MAP, "--tolerance", "nan"], "--tolerance is nan"),
        ([*MAP, "--duration", "0"], "--duration: "),
        ([*MAP, "--delay", "nan"], "--delay: "),
        ([*MAP, "--compare", "arms"], "'arms' is not a setting; valid: feet=free"),
        ([*MAP, "--compare", "delay=soon"], "'delay=soon' is not a setting"),
        ([*MAP, "--compare", "delay=-1"], "recovery.delay_s is -1.0"),
        ([*MAP, "--compare", "steps=0.5"], "'steps=0.5' is not a setting"),
        ([*MAP, "--feet-apart", "0.05"], "[m] is 0.05; valid: a finite number >= 0.1"),
        ([*MAP, "--compare", "feet-apart=wide"], "'feet-apart=wide' is not a setting"),
        ([*MAP, "--compare", "steps=1"], "recovery.steps is 1 of held feet"),
        ([*MAP, "--compare", "ankle-stiffness="], "'ankle-stiffness=' is not a setting"),
        ([*MAP, "--compare", "ankle-stiffness=-2"], "recovery.ankle_stiffness is -2.0"),
        ([*MAP, "--compare", "locked=legs"], "'arms' or 'hips'"),
    ],
)
def test_mistakes_give_one_line_and_status_2(capfd, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == BAD_INPUT
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("manikin: ")
    assert says in err
    assert list(tmp_path.iterdir()) == []


def untimed(block):
    return {key: value for key, value in block.items() if key not in ("wall_s", "control_step_ms")}


@pytest.mark.long
def test_a_push_is_the_run_of_the_scenario_with_the_same_numbers(capfd, runs):
    """The experiment of the thesis from the side: the same summary, but for its name and wall times."""
    assert main(["push", "--force", "200", "--direction", "90", "--duration", "0.1", "--json"]) == DONE
    found = json.loads(capfd.readouterr().out)
    wanted = runs("push-right-200").summary
    assert found.keys() == wanted.keys()
    assert found["succeeded"]
    assert untimed(found["push"]) == untimed(json.loads(json.dumps(wanted["push"])))


def test_a_push_for_people_leaves_a_run_directory(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--feet", "free", "--locked", "arms", "--posture-control-only", "--strength", "1.5"]
    assert main(["push", "--force", "60", "--direction", "-30", *options, "--no-figures"]) == DONE
    out = capfd.readouterr().out
    lines = out.splitlines()
    assert len(lines) < 25
    assert lines[0].startswith("proved: push-60N--30deg")
    assert "recovered" in out
    folder = tmp_path / "runs" / "push-60N--30deg"
    assert lines[-1] == f"report: {folder.relative_to(tmp_path)}/report.html"
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["push"]["program_share"] == 0.0
    kept = load_scenario(folder / "scenario.yaml").file
    assert (kept.recovery.feet, kept.recovery.locked, kept.recovery.strength) == ("free", ["arms"], 1.5)
    assert (kept.push.force_N, kept.push.direction_deg) == (60.0, -30.0)


@pytest.mark.long
def test_the_directory_of_a_push_runs_again(capfd, tmp_path):
    """To the same numbers."""
    folder = tmp_path / "push"
    assert main(["push", "--force", "60", "--direction", "-30", "--no-figures", "--out", str(folder)]) == DONE
    capfd.readouterr()
    summary = json.loads((folder / "summary.json").read_text())
    assert main(["run", str(folder / "scenario.yaml"), "--json"]) == DONE
    again = json.loads(capfd.readouterr().out)
    assert untimed(again["push"]) == untimed(summary["push"])


@pytest.mark.long
def test_a_body_on_one_foot_is_pushed_too(capfd):
    """It holds 3 N.s where it carries itself."""
    options = ["--support", "left", "--feet", "free", "--json"]
    assert main(["push", "--force", "30", "--direction", "90", *options]) == DONE
    assert json.loads(capfd.readouterr().out)["push"]["recovered"] is True


@pytest.mark.long
def test_a_body_that_may_step_holds_more_than_its_bound_and_stiff_ankles_raise_that(capfd):
    """45 N.s from the back are beyond the bound without a step; stiff ankles raise that bound."""
    options = ["--direction", "0", "--feet", "free", "--json"]
    found = {}
    for name, more in {"step": ["--steps", "1"], "stiff": ["--ankle-stiffness", "1.3"]}.items():
        main(["push", "--force", "450", *options, *more])
        found[name] = json.loads(capfd.readouterr().out)["push"]
    assert found["step"]["recovered"]
    assert found["step"]["steps"] == 1
    assert found["step"]["impulse_Ns"] > found["step"]["bound_Ns"]
    assert found["stiff"]["steps"] == 0
    assert found["stiff"]["bound_Ns"] > 1.2 * found["step"]["bound_Ns"]


@pytest.mark.parametrize(
    "options",
    [
        pytest.param([], id="too hard"),
        pytest.param(["--delay", "100"], id="never reacts", marks=pytest.mark.long),
    ],
)
def test_a_body_that_falls_is_status_3_with_a_reason(capfd, options):
    force = "100" if options else "500"
    assert (
        main(["push", "--force", force, "--direction", "0", "--feet", "free", *options, "--json"]) == FAILED
    )
    out, err = capfd.readouterr()
    found = json.loads(out)
    assert found["push"]["recovered"] is False
    assert found["failure"]["stage"] == "push"
    assert "fell" in found["failure"]["reason"]
    assert "QACC" not in err


class Searched(list):
    """Directions that were searched, as (locked, direction); interrupted before that of number ``stop``."""

    stop = None

    def run(self, search, _go_on=None):
        if len(self) == self.stop:
            raise KeyboardInterrupt
        locked = search.trials.settings.locked
        self.append((locked, search.direction_deg))
        held = 40.0 - search.direction_deg / 30.0 - 3.0 * len(locked)
        return HeldImpulse(held, held + search.tolerance, 9)


@pytest.fixture
def searched(monkeypatch):
    """Searches replaced by a formula."""
    asked = Searched()
    monkeypatch.setattr(DirectionSearch, "run", lambda search, go_on=None: asked.run(search, go_on))
    return asked


def test_a_map_has_its_figure_table_and_json(capfd, tmp_path, searched):
    out = tmp_path / "map"
    arguments = [*MAP, "--feet", "free", "--compare", "locked=arms,support=left", "--out", str(out), "--json"]
    assert main(arguments) == DONE
    printed = json.loads(capfd.readouterr().out)
    assert printed == json.loads((out / "map.json").read_text())
    assert printed["complete"] is True
    assert printed["directions_deg"] == [0.0, 90.0, 180.0, 270.0]
    assert printed["impulse_Ns"] == [40.0, 37.0, 34.0, 31.0]
    assert printed["beyond_Ns"] == [41.0, 38.0, 35.0, 32.0]
    said = {key: printed[key] for key in ("body", "feet", "locked", "delay_s", "duration_s", "tolerance_Ns")}
    assert said == {"body": {"model": "kudoh"}, "feet": "free", "locked": [], "delay_s": 0.2,
                    "duration_s": 0.1, "tolerance_Ns": 1.0}  # fmt: skip
    assert (printed["steps"], printed["ankle_stiffness"]) == (0, 0.64)
    (other,) = printed["compared"]
    assert (printed["support"], other["support"], other["locked"]) == ("both", "left", ["arms"])
    assert other["impulse_Ns"] == [37.0, 34.0, 31.0, 28.0]
    rows = list(csv.DictReader((out / "map.csv").read_text().splitlines()))
    for column in ("impulse_Ns", "bound_Ns"):
        assert [float(row[column]) for row in rows] == printed[column] + other[column]
    ahead, left, back, right = printed["bound_Ns"]
    assert back < ahead < left == pytest.approx(right, rel=1e-3)
    assert other["bound_Ns"][1] < other["bound_Ns"][3]  # of the left foot, whose outer edge is near
    assert (out / "figures" / "push_map.png").stat().st_size > 10_000
    assert len(searched) == 8


def test_a_map_goes_on_where_it_was_interrupted(capfd, tmp_path, searched):
    arguments = [*MAP, "--compare", "locked=arms+hips,delay=0", "--out", str(tmp_path / "map"), "--json"]
    searched.stop = 3
    assert main(arguments) == INTERRUPTED
    part = json.loads((tmp_path / "map" / "map.json").read_text())
    assert part["complete"] is False
    assert part["impulse_Ns"] == [40.0, 37.0, 34.0, None]
    searched.stop = None
    capfd.readouterr()
    assert main(arguments) == DONE
    resumed = (tmp_path / "map" / "map.json").read_bytes()
    assert searched[3:] == [((), 270.0), *((("arms", "hips"), angle) for angle in (0.0, 90.0, 180.0, 270.0))]
    assert main([*arguments[:-2], str(tmp_path / "whole"), "--json"]) == DONE
    assert (tmp_path / "whole" / "map.json").read_bytes() == resumed
    count = len(searched)
    assert main(arguments) == DONE
    assert len(searched) == count
    assert (tmp_path / "map" / "map.json").read_bytes() == resumed


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (["--delay", "0"], "delay_s is 0.2 there and 0.0 now; valid: the same settings"),
        (["--tolerance", "2"], "tolerance_Ns is 1.0 there and 2.0 now"),
        (["--directions", "5"], "directions_deg"),
        (["--body", "human"], "body is"),
        (["--compare", "locked=arms"], "other maps are compared there"),
    ],
)
@pytest.mark.usefixtures("searched")
def test_maps_of_other_settings_are_not_mixed(capfd, tmp_path, changed, says):
    assert main([*MAP, "--out", str(tmp_path / "map"), "--json"]) == DONE
    before = (tmp_path / "map" / "map.json").read_bytes()
    capfd.readouterr()
    assert main([*MAP, *changed, "--out", str(tmp_path / "map"), "--json"]) == BAD_INPUT
    out, err = capfd.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert says in err
    assert (tmp_path / "map" / "map.json").read_bytes() == before


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"impulse_Ns": 3'])
@pytest.mark.usefixtures("searched")
def test_a_damaged_map_is_refused(capfd, tmp_path, content):
    (tmp_path / "map.json").write_text(content)
    assert main([*MAP, "--out", str(tmp_path)]) == BAD_INPUT
    assert capfd.readouterr().err.count("\n") == 1
    assert (tmp_path / "map.json").read_text() == content


@pytest.mark.usefixtures("searched")
def test_a_map_does_not_go_into_a_directory_of_something_else(capfd, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    assert main([*MAP, "--out", str(tmp_path)]) == BAD_INPUT
    assert "holds 'thesis.txt' but no map.json" in capfd.readouterr().err
    assert main([*MAP, "--out", str(tmp_path / "thesis.txt")]) == BAD_INPUT


@pytest.mark.usefixtures("searched")
def test_a_map_for_people_is_a_table(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*MAP, "--compare", "locked=arms", "--no-figures"]) == DONE
    out, err = capfd.readouterr()
    assert "nothing locked  arms locked" in out
    assert out.splitlines()[2].split() == ["0", "40.0", "37.0"]
    found = json.loads((tmp_path / "runs" / "push-map" / "map.json").read_text())
    assert found["bound_Ns"] is None  # of held feet
    assert "files in runs/push-map" in err
    assert not (tmp_path / "runs" / "push-map" / "figures").exists()


@pytest.mark.usefixtures("searched")
def test_maps_with_and_without_a_step_and_stiff_ankles(capfd, tmp_path):
    compare = ["--compare", "steps=1", "--compare", "steps=2,ankle-stiffness=1.3"]
    assert main([*MAP, "--feet", "free", *compare, "--out", str(tmp_path), "--no-figures"]) == DONE
    head = capfd.readouterr().out.splitlines()[1]
    names = ["no step, usual ankles", "up to 1 step, usual ankles", "up to 2 steps, ankles of 1.3 m g h"]
    assert head.split("  ")[-3:] == names


@pytest.mark.long
@pytest.mark.slow
def test_a_real_map_of_one_direction(capfd, tmp_path):
    """Each border was tried: what is held stands again when pushed once more, what is beyond falls."""
    arguments = ["push", "--map", "--directions", "1", "--tolerance", "40", "--feet", "free", "--json"]
    assert main([*arguments, "--out", str(tmp_path / "map")]) == DONE
    found = json.loads(capfd.readouterr().out)
    held, beyond = np.array(found["impulse_Ns"]), np.array(found["beyond_Ns"])
    assert np.all((held > 10.0) & (beyond - held <= 40.0) & (beyond > held))
    assert np.all(held <= found["bound_Ns"])
    for impulse, status in ((held[0], DONE), (beyond[0], FAILED)):
        force = ["--force", str(impulse / 0.1), "--direction", "0", "--feet", "free"]
        assert main(["push", *force, "--json"]) == status
