"""``manikin adapt``: the run that it leaves, what it prints, and what it refuses."""

import json

import pytest

import manikin as mk
from manikin.analysis.motion_transfer import body_like
from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, FAILED
from manikin.motion.file import read_motions

STEP = """
scene:
  - {name: step, box: [4.0, 4.0, 0.1], position: [0.0, 0.0, 0.05]}
"""


@pytest.fixture(scope="module")
def made(standing_file, tmp_path_factory):
    """A heavier person who stands on a platform: directory and printed summary."""
    folder = tmp_path_factory.mktemp("adapted")
    scene = folder / "place.yaml"
    scene.write_text(STEP)
    out = folder / "out"
    options = ["--scene", str(scene), "--at", "0", "0", "90", "--mass", "90", "--no-figures"]
    assert main(["adapt", str(standing_file), *options, "--out", str(out)]) == DONE
    return out, json.loads((out / "summary.json").read_text())


def test_a_motion_is_made_in_another_place_and_kept_as_a_run(made):
    out, summary = made
    assert summary["verdict"] == "proved"
    assert summary["mass_kg"] == 90.0
    changes = json.loads((out / "adaptation.json").read_text())
    assert {contact["planned_m"][2] for contact in changes["contacts"]} == {0.1}
    assert changes["pace"] == 1.0
    assert list(read_motions(out).motions) == ["planned", "executed"]
    assert "manikin adapt" in (out / "report.html").read_text()


def test_the_run_can_be_read_again(made):
    out, _ = made
    run = mk.compare(out, out).result.runs[0]
    assert run.body is not None
    assert run.schedule is not None


def test_a_place_without_ground_is_an_explained_failure(standing_file, tmp_path, capsys):
    scene = tmp_path / "hole.yaml"
    scene.write_text("floor_height_m: null\nscene:\n  - {name: bar, box: [0.02, 0.02, 0.02]}\n")
    assert main(["adapt", str(standing_file), "--scene", str(scene), "--json"]) == FAILED
    failure = json.loads(capsys.readouterr().out)["failure"]
    assert failure["stage"] == "contacts"
    assert "no level surface carries the whole contact" in failure["reason"]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--mass", "900"], "--mass"),
        (["--method", "quickly"], "'quickly' is not one of 'keyframes', 'timing-free'"),
        (["--scene", "nowhere.yaml"], "there is no such file"),
        (["--window", "90", "91"], "valid: at least 4"),
    ],
)
def test_what_is_not_usable_is_one_line(standing_file, capsys, options, told):
    assert main(["adapt", str(standing_file), *options, "--json"]) == BAD_INPUT
    shown = capsys.readouterr()
    assert shown.out == ""
    (line,) = shown.err.strip().splitlines()
    assert told in line


def test_the_front_door_makes_the_same_run(standing_file):
    """Another body by hand; the run has its motions, and says what has changed."""
    person = body_like(mk.analyze(standing_file).analysis.found.body, stature=1.6)
    run = mk.adapt(standing_file, body=person, pace=1.0)
    assert run.succeeded, run.summary["failure"]
    assert run.executed is not None
    assert run.summary["adaptation"]["body"]["adapted"]["stature"] == pytest.approx(1.6)
