"""The interactive mode: the body is moved through the page's callbacks, the contacts follow."""

import threading
import types
import urllib.request

import numpy as np
import pytest

from manikin.body import Configuration, human, point_mass
from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE
from manikin.errors import BodyError
from manikin.planning.contacts.single_contact import Role
from manikin.scene import Box, Obstacle, Scene

pytest.importorskip("viser")

from manikin.viewer.door import Door  # only where viser is
from manikin.viewer.drive import LiveContacts


@pytest.fixture(scope="module")
def live():
    body = human()
    cupboard = Obstacle("cupboard", Box((0.6, 1.2, 1.9)), translation=(0.75, 0.0, 0.95))
    return LiveContacts(body, Scene([cupboard]), body.standing_posture(), samples=4000)


@pytest.fixture
def viewer(live):
    from manikin.viewer.drive import ContactViewer

    live.q[:] = live.body.standing_posture()
    live.aim(0.0, 0.0)
    live.ask([limb.name for limb in live.body.limbs])
    live.heuristic, live.role, live.pulling = "efort", Role.AUTO, False
    session = ContactViewer(live, Door(0))
    yield session
    session.close()


def drag(viewer, position, wxyz=(1.0, 0.0, 0.0, 0.0)):
    """What viser does when the gizmo is dragged: the pose first, then the callbacks."""
    viewer.gizmo.position, viewer.gizmo.wxyz = position, wxyz
    for callback in viewer.gizmo._impl_aux.update_cb:
        callback(types.SimpleNamespace(target=viewer.gizmo, phase="update"))


def test_the_page_is_served(viewer):
    assert b"<html" in urllib.request.urlopen(viewer.url, timeout=10).read().lower()
    assert viewer.url.startswith("http://127.0.0.1:")


def test_dragging_the_body_changes_its_contacts(viewer, live):
    before = viewer.latest
    assert before.answers["right_arm"].obstacle == "cupboard"
    height = live.q[2]
    drag(viewer, (-0.06, 0.1, height))
    assert viewer.updates == 1
    after = viewer.update()
    assert after is viewer.latest
    assert viewer.updates == 2
    assert after.q[:3].tolist() == [-0.06, 0.1, height]
    moved = after.answers["right_arm"].contact.position - before.answers["right_arm"].contact.position
    assert np.abs(moved).max() > 1e-3
    drag(viewer, (-2.0, 0.0, height))
    far = viewer.update()
    assert not far.answers["right_arm"].found
    assert "within reach" in far.answers["right_arm"].message
    assert not viewer._normals["right_arm"].visible
    assert viewer.update() is None


def test_only_the_newest_of_many_poses_is_answered(viewer, live):
    for step in range(20):
        drag(viewer, (-0.002 * step, 0.0, live.q[2]))
    viewer.update()
    assert viewer.updates == 2
    assert viewer.latest.q[0] == pytest.approx(-0.038)


def test_contacts_shown_are_where_the_effectors_are(viewer, live):
    """Limb after limb in one posture: arrows, shapes and the answer agree."""
    drag(viewer, (-0.03, 0.02, live.q[2]), (0.995, 0.0, 0.0, 0.1))
    answer = viewer.update()
    state = Configuration(live.body, answer.q)
    found = [name for name, item in answer.answers.items() if item.found]
    assert len(found) >= 2
    for limb in live.body.limbs:
        if limb.name in found:
            contact = answer.answers[limb.name].contact
            assert np.abs(state.effector_placement(limb.effector)[1] - contact.position).max() < 2e-5
            start, end = np.asarray(viewer._normals[limb.name].points)[0]
            assert np.allclose(start, contact.position, atol=1e-6)
            assert np.allclose(end - start, 0.2 * contact.normal, atol=1e-6)
    _, place = state.segment_placement("left_hand")
    assert np.allclose(viewer._shapes.frames["left_hand"].position, place)
    assert f"{1e3 * answer.wall_s:.1f} ms" in viewer._text.content


def test_the_controls_turn_the_task_and_choose_the_limbs(viewer, live):
    viewer.elevation.value = 90.0
    assert np.allclose(live.direction, [0.0, 0.0, 1.0])
    viewer.elevation.value = 0.0
    viewer.azimuth.value = 90.0
    assert np.allclose(live.direction, [0.0, 1.0, 0.0])
    viewer.limbs["left_leg"].value = False
    viewer.heuristic.value = "distance"
    viewer.role.value = "object"
    answer = viewer.update()
    assert "left_leg" not in answer.answers
    assert (live.heuristic, live.role) == ("distance", Role.OBJECT)


def test_it_runs_until_it_is_closed(viewer, live):
    runner = threading.Thread(target=viewer.run)
    runner.start()
    drag(viewer, (-0.01, 0.0, live.q[2]))
    for _ in range(200):
        if viewer.updates >= 2:
            break
        threading.Event().wait(0.02)
    viewer.close()
    viewer.close()
    runner.join(timeout=10)
    assert not runner.is_alive()
    assert viewer.updates >= 2


def test_a_body_without_limbs_is_refused():
    with pytest.raises(BodyError, match="has no limbs"):
        LiveContacts(point_mass(70.0), Scene([]), np.zeros(7))


def test_the_command_serves_a_scenario(monkeypatch, capfd):
    served = []
    monkeypatch.setattr("manikin.viewer.serve_contacts", lambda *given, **_: served.append(given[0]))
    assert main(["view", "platform", "--contacts", "--samples", "200"]) == DONE
    assert {limb.name for limb in served[0].body.limbs} >= {"left_arm", "right_leg"}
    assert main(["view", "nowhere", "--contacts"]) == BAD_INPUT
    assert main(["view", "nowhere", "--samples", "200"]) == BAD_INPUT
    assert "--samples does not go with this run: it is for --contacts" in capfd.readouterr().err
