"""A run read back from its directory, and every way in which a directory can be wrong."""

import json

import numpy as np
import pytest

from manikin.cli import main
from manikin.contact import ContactSchedule
from manikin.errors import InputError, MotionFileError
from manikin.motion.file import write_motions
from manikin.numerics.spline import BSpline
from manikin.pipeline.run_directory import RunDirectory, read_run
from manikin.planning.com import CentroidalTrajectory
from manikin.reports.export import write_outputs
from manikin.reports.figures import COMPARISONS
from manikin.scenarios import load_scenario

SUMMARY = {"scenario": "platform", "succeeded": True, "failure": None}


def write_run(path, content=None, *, com=True):
    """A run directory of the platform scenario, with a straight CoM path."""
    scenario = load_scenario("platform")
    directory = RunDirectory(path)
    directory.write("scenario.yaml", scenario.to_yaml())
    if com:
        share = np.clip((np.arange(12) - 2) / 7, 0.0, 1.0)[:, None]
        points = scenario.start_com + share * (scenario.goal_com - scenario.start_com)
        inner = np.array([0.321, 0.721, 0.93, 1.73, 2.837, 3.637]) / 4.193
        spline = BSpline(5, np.concatenate([np.zeros(6), inner, np.ones(6)]), points)
        instants = [0.0, *(4.193 * inner), 4.193]
        schedule = ContactSchedule(scenario.build_sequence(planning=True), instants)
        trajectory = CentroidalTrajectory(scenario.mass, spline, schedule)
        directory.write("stages/com_trajectory.json", trajectory.to_dict())
    if content is not None:
        write_motions(directory.path / "motion.h5", content)
    directory.write("summary.json", SUMMARY)
    return directory.path


def test_a_point_mass_run_has_schedule_scene_and_margin(tmp_path):
    """Without a motion file the planned CoM is what there is; it rests at both ends."""
    record = read_run(write_run(tmp_path / "com"))
    assert (record.label, record.scenario, record.mass) == ("com", "platform", 79.0)
    assert list(record.tracks) == ["planned"]
    assert record.motions == {}
    track = record.tracks["planned"]
    np.testing.assert_allclose(track.position[[0, -1]], [[0, 0, 0.92], [0.6, 0.65, 0.86]], atol=1e-12)
    np.testing.assert_allclose(track.velocity[[0, -1]], 0.0, atol=1e-12)
    assert track.margin_unit == "N.m"
    assert np.isfinite(track.margin).all()
    assert {obstacle.name for obstacle in record.scene} == {"floor", "roof", "threshold", "platform"}
    # The ZMP of a body at rest is below its centre of mass.
    np.testing.assert_allclose(record.zmp["planned"].point[-1, :2], [0.6, 0.65], atol=1e-9)


def test_margin_of_the_plan_is_that_of_the_planner(tmp_path):
    """At rest over both feet at the start the point mass has the margin of that stance."""
    from manikin.balance import evaluate_balance

    record = read_run(write_run(tmp_path / "com"))
    stance = load_scenario("platform").build_sequence(planning=True)[0].stance
    plan = record.plan
    at_rest = evaluate_balance(stance, 79.0, plan.position[0], plan.acceleration[0])
    assert plan.margin[0] == pytest.approx(at_rest.margin)


def test_a_full_run_has_motions_and_plan(tmp_path, finished_run):
    record = read_run(write_run(tmp_path / "full", finished_run))
    assert list(record.tracks) == ["planned", "executed"]
    np.testing.assert_array_equal(record.tracks["executed"].position, finished_run.executed.com)
    np.testing.assert_array_equal(record.schedule.instants, finished_run.schedule.instants)
    assert record.plan is not None
    assert record.effectors == ("left_foot", "right_foot")


@pytest.mark.long
def test_products_of_a_point_mass_run_are_its_figures(tmp_path):
    names = {path.name for path in write_outputs(write_run(tmp_path / "com"))}
    assert {"com.png", "margin.png", "zmp.png", "contacts.png", "timing.png", "scene.png"} <= names
    assert names.isdisjoint({"postures.png", "tracking.png", "motion.bvh", "motion.glb"})


def test_a_run_that_failed_at_once_has_no_products(tmp_path):
    path = write_run(tmp_path / "failed", com=False)
    assert write_outputs(path) == []
    assert not (path / "figures").exists()


def test_the_plan_may_end_before_the_last_phases(tmp_path):
    """What follows then rests on something else than the point mass can tell."""
    path = write_run(tmp_path / "short")
    file = path / "stages/com_trajectory.json"
    data = json.loads(file.read_text())
    data["key_instants_s"] = data["key_instants_s"][:6]
    file.write_text(json.dumps(data))
    assert len(read_run(path).schedule.sequence) == 5


BROKEN = {
    "missing": (lambda path: path / "none", "no such directory"),
    "a file": (lambda path: path / "summary.json", "is a file"),
    "not a run": (lambda path: path / "stages", "not a run directory"),
    "unfinished": (lambda path: (path / "summary.json").unlink(), "did not finish"),
    "broken summary": (lambda path: (path / "summary.json").write_text("{"), "summary.json"),
    "broken motion": (lambda path: (path / "motion.h5").write_bytes(b"no"), "motion.h5"),
    "broken plan": (lambda path: (path / "stages/com_trajectory.json").write_text("["), "com_trajectory"),
    "a list": (lambda path: (path / "stages/com_trajectory.json").write_text("[]"), "not a JSON object"),
    "empty plan": (lambda path: (path / "stages/com_trajectory.json").write_text("{}"), "is damaged"),
    "broken scenario": (lambda path: (path / "scenario.yaml").write_text("name: [x"), "scenario.yaml"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_directory_is_one_line_and_status_2(case, tmp_path, finished_run, capfd):
    change, says = BROKEN[case]
    good = write_run(tmp_path / "good", finished_run)
    bad = write_run(tmp_path / "bad", finished_run)
    given = change(bad)
    place = given if given is not None and not isinstance(given, int) else bad
    with pytest.raises(InputError, match=says):
        read_run(place)
    assert main(["compare", str(good), str(place)]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert says in err


def test_compare_prints_one_object_or_tables_and_draws(tmp_path, finished_run, capfd, monkeypatch):
    """With one of the figures, all of which ``tests/reports/comparison`` draws."""
    for name in set(COMPARISONS) - {"compare_timing"}:
        monkeypatch.delitem(COMPARISONS, name)
    first = write_run(tmp_path / "first", finished_run)
    second = write_run(tmp_path / "second", finished_run)
    out = tmp_path / "both"
    assert main(["compare", str(first), str(second), "--json", "--out", str(out)]) == 0
    found = json.loads(capfd.readouterr().out)
    assert found["com"]["executed"]["max_distance_m"] == 0.0
    assert found["margins"]["point_mass"]["min_difference"] == 0.0
    assert json.loads((out / "comparison.json").read_text()) == found
    assert [path.name for path in out.glob("*.png")] == ["compare_timing.png"]
    assert main(["compare", str(first), str(second)]) == 0
    text = capfd.readouterr().out
    assert "Timing [s]" in text
    assert "left foot, right foot" in text
    assert "Postures at the key instants, executed [deg]" in text


def test_compare_needs_a_place_it_can_write_to(tmp_path, finished_run, capfd):
    first = write_run(tmp_path / "first", finished_run)
    assert main(["compare", str(first), str(first), "--out", str(first / "summary.json")]) == 2
    assert "is a file; valid: a directory" in capfd.readouterr().err


def test_read_run_names_the_error_class(tmp_path):
    with pytest.raises(MotionFileError):
        read_run(tmp_path / "none")
