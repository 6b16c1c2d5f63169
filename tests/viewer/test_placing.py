"""A task placed by hand: by rays and by the gizmo, planned when asked, watched and placed anew."""

import threading
import types

import numpy as np
import pytest
import yaml

from manikin.errors import InputError, ScenarioError
from manikin.scenarios import load_scenario

pytest.importorskip("viser")

from manikin.viewer.door import Door  # only where viser is
from manikin.viewer.placing import Planned, TaskViewer

SCENE = {
    "name": "shelf", "body": {"model": "human"},
    "scene": [{"name": "step", "box": [1.0, 1.0, 0.2], "position": [1.5, 0.0, 0.1]}],
    "task": {"start": {"at": [0.0, 0.0]}, "goal": {"at": [1.5, 0.0], "heading_deg": 90.0}},
}  # fmt: skip


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    file = tmp_path_factory.mktemp("placing") / "shelf.yaml"
    file.write_text(yaml.safe_dump(SCENE))
    return load_scenario(str(file))


@pytest.fixture
def asked():
    """Scenarios that were to be planned."""
    return []


@pytest.fixture
def page(job, asked):
    def plan(scenario, progress):
        progress("contacts", 0.5)
        asked.append(scenario)
        return Planned("no way", None)

    viewer = TaskViewer(job, Door(0), plan)
    yield viewer
    viewer.close()


def test_the_page_begins_at_the_task_of_the_scenario(page):
    """The goal is on the step: the floor below it is no ground."""
    assert page.places["start"].tolist() == [0.0, 0.0, 0.0]
    assert page.places["goal"] == pytest.approx([1.5, 0.0, 0.2])
    assert page.headings == {"start": 0.0, "goal": 90.0}


def test_an_end_goes_to_the_ground_nearest_in_height(page):
    page.place("goal", (1.4, 0.1, 0.18), 45.0)
    assert page.places["goal"] == pytest.approx([1.4, 0.1, 0.2])
    page.place("goal", (0.4, 0.1, 0.18))
    assert page.places["goal"] == pytest.approx([0.4, 0.1, 0.0])
    assert page.headings["goal"] == 45.0


def test_a_click_places_where_its_ray_first_meets_ground(page):
    """From above the step the ray ends on it; below its top, past its side, the ray goes on to the floor."""
    page.click("start", (1.5, 0.0, 2.2), (0.0, 0.0, -1.0))
    assert page.places["start"] == pytest.approx([1.5, 0.0, 0.2])
    page.click("start", (0.0, 0.0, 1.0), (0.5, 0.0, -1.0))
    assert page.places["start"] == pytest.approx([0.5, 0.0, 0.0])
    page.click("start", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    assert page.places["start"] == pytest.approx([0.5, 0.0, 0.0])


def test_dragging_the_gizmo_moves_and_turns(page):
    gizmo = page._gizmos["start"]
    for phase in ("start", "update", "end"):
        gizmo.position, gizmo.wxyz = (1.2, 0.2, 0.15), (np.cos(0.25), 0.0, 0.0, np.sin(0.25))
        for callback in gizmo._impl_aux.update_cb:
            callback(types.SimpleNamespace(target=gizmo, phase=phase))
    assert page.places["start"] == pytest.approx([1.2, 0.2, 0.2])
    assert page.headings["start"] == pytest.approx(np.rad2deg(0.5))
    np.testing.assert_allclose(gizmo.position, page.places["start"])


def test_what_is_placed_is_planned_when_asked(page, asked):
    page.advance(0.1)
    assert not asked
    page.place("goal", (1.5, 0.0, 0.2), -90.0)
    page.postures["goal"], page.pace = "crouched", "brisk"
    page.ask()
    page.advance(0.1)
    (scenario,) = asked
    goal = scenario.file.task.goal
    assert (goal.at, goal.height_m, goal.heading_deg, goal.posture) == ((1.5, 0.0), 0.2, -90.0, "crouched")
    assert scenario.file.task.pace == "brisk"
    assert page._text.content == "no way"
    page.advance(0.1)
    assert len(asked) == 1


def test_planning_is_stopped_at_its_next_report(job):
    def plan(_, progress):
        viewer.stop()
        progress("contacts", 0.5)
        raise AssertionError("it went on")

    viewer = TaskViewer(job, Door(0), plan)
    try:
        viewer.ask()
        viewer.advance(0.1)
        assert viewer._text.content == "stopped"
        assert viewer.planned is None
    finally:
        viewer.close()


def test_what_cannot_be_planned_is_said_on_the_page(job):
    def plan(*_):
        raise ScenarioError("task.goal.at: is [9, 9]; valid: a place with ground")

    viewer = TaskViewer(job, Door(0), plan)
    try:
        viewer.ask()
        viewer.advance(0.1)
        assert "valid: a place with ground" in viewer._text.content
    finally:
        viewer.close()


def test_own_supports_and_their_options_are_left_out(job):
    """``platform`` lists its supports and options that were chosen for them."""
    body = job.file.body
    platform = load_scenario("platform").with_body(body.stature_m, body.mass_kg, body.sex)
    viewer = TaskViewer(platform, Door(0), lambda *_: Planned("", None))
    try:
        placed = viewer.scenario().file
    finally:
        viewer.close()
    assert placed.supports is None
    assert placed.planning == type(placed.planning)()
    assert len(placed.scene) == 3
    assert placed.task.goal.at == (0.6, 0.65)


def test_a_body_that_does_not_stand_is_refused():
    mass = {"body": {"model": "point_mass", "mass_kg": 79.0}, "execution": "none"}
    job = load_scenario("platform").replaced(reference_stature_m=None, **mass)
    with pytest.raises(InputError, match="valid here: a body that stands"):
        TaskViewer(job, Door(0), lambda *_: Planned("", None))


def test_a_motion_is_watched_at_the_same_address_and_placed_anew(job, finished_run, monkeypatch):
    """Plan, watch, place anew, and leave: three pages, one after the other, at one port."""
    from manikin import viewer
    from manikin.viewer import session

    seen, done = [], threading.Event()

    def run(page):
        seen.append((type(page).__name__, page.door.port))
        if isinstance(page, session.ViewerSession):
            page.place_anew()
        elif len(seen) == 1:
            page.place("goal", (1.4, 0.2, 0.2))
            page.ask()
            page.advance(0.1)
        else:
            assert page.places["goal"] == pytest.approx([1.4, 0.2, 0.2])
            page.close()
            done.set()

    monkeypatch.setattr(viewer.canvas.Page, "run", run)
    viewer.serve_task(job, lambda *_: Planned("proved", finished_run), port=0)
    assert done.is_set()
    assert [name for name, _ in seen] == ["TaskViewer", "ViewerSession", "TaskViewer"]
    assert len({port for _, port in seen}) == 1
