"""The viewer: served on this computer only, scrubbed, switched and closed."""

import http.client
import socket
import threading
import types
import urllib.request
from dataclasses import replace

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.errors import InputError
from manikin.motion.file import MotionFile
from manikin.viewer import serve

pytest.importorskip("viser")

from manikin.viewer.door import Door  # only where viser is


@pytest.fixture
def session(finished_run):
    from manikin.viewer.session import ViewerSession

    viewer = ViewerSession(finished_run, Door(0))
    yield viewer
    viewer.close()


def test_page_is_served_on_the_loopback_only(session):
    page = urllib.request.urlopen(session.url, timeout=10).read()
    assert b"<html" in page.lower()
    assert session.url.startswith("http://127.0.0.1:")
    port = session.server.get_port()
    others = {address[4][0] for address in socket.getaddrinfo(socket.gethostname(), port, socket.AF_INET)}
    for address in others - {"127.0.0.1", "127.0.1.1"}:
        with pytest.raises(OSError):
            socket.create_connection((address, port), timeout=1.0).close()


def test_scrubbing_places_the_body_as_the_kinematics_do(session, finished_run):
    session.show(1.234)
    motion = finished_run.executed
    index = int(np.searchsorted(motion.time, 1.234))
    body = Configuration(finished_run.body, motion.q[index])
    for name, frame in session._shapes.frames.items():
        rotation, position = body.segment_placement(name)
        np.testing.assert_allclose(frame.position, position, atol=1e-12)
        w, x, y, z = frame.wxyz
        turned = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
        np.testing.assert_allclose(turned, rotation[:, 0], atol=1e-12)
    np.testing.assert_allclose(session._com.position, motion.com[index])
    assert session._slider.value == pytest.approx(1.234)
    session.show(-5.0)
    assert session.time == 0.0
    session.show(1e9)
    assert session.time == motion.time[-1]


def test_a_person_is_shown_by_the_surface_and_on_request_by_the_shapes(session, finished_run):
    """The bones of the surface stand where the segments do."""
    session.show(1.0)
    shapes = session._shapes
    assert len(shapes._surface) == 5
    for mesh in shapes._surface:
        places = [bone.position for bone in mesh.bones]
        frames = [shapes.frames[segment.name].position for segment in finished_run.body.segments]
        np.testing.assert_allclose(places, frames, atol=1e-12)
    for wanted in (False, True):
        session.show_shapes(wanted)
        assert all(frame.visible == wanted for frame in shapes.frames.values())
        assert all(mesh.visible != wanted for mesh in shapes._surface)


def test_forces_are_drawn_at_the_contacts_that_carry_load(session, finished_run):
    session.show(0.5)  # phase 2: right foot only
    assert not session._arrows["left_foot"].visible
    arrow = session._arrows["right_foot"]
    assert arrow.visible
    start, end = np.asarray(arrow.points)[0]
    np.testing.assert_allclose(end - start, [0, 0, finished_run.body.mass * 9.81e-3], rtol=1e-6)
    session._forces.value = False
    session.show(0.5)
    assert not arrow.visible


def test_playing_runs_at_the_chosen_speed_and_stops_at_the_end(session):
    session.advance(1.0)
    assert session.time == 0.0
    session.play()
    session.speed = 0.5
    session.advance(1.0)
    assert session.time == pytest.approx(0.5)
    session.advance(100.0)
    assert session.time == session.motion.time[-1]
    assert not session.playing
    session.play()
    assert session.time == 0.0
    session.pause()
    assert not session.playing


def test_a_loop_begins_again_and_a_step_stops(session):
    session.looping = True
    session.play()
    session.advance(100.0)
    assert (session.time, session.playing) == (session.motion.time[0], True)
    session.step(0.25)
    assert (session.time, session.playing) == (0.25, False)
    session.step(-1.0)
    assert session.time == session.motion.time[0]


class Visitor:
    """A browser's camera, as the server knows it."""

    def __init__(self):
        self.up_direction = (0.0, 0.0, 1.0)
        self.position, self.look_at = np.array([3.0, 0.0, 1.0]), np.zeros(3)
        self.camera = self


def test_cameras_look_from_where_they_are_asked_and_follow_the_body(session, monkeypatch):
    """From the front the camera is ahead on the way; then it keeps its place relative to the CoM."""
    visitor = Visitor()
    monkeypatch.setattr(session.server, "get_clients", lambda: {0: visitor})
    com, way = session.motion.com, session.motion.com[-1] - session.motion.com[0]
    session.show(0.0)
    for view, sign in (("front", 1.0), ("behind", -1.0)):
        session.look(view)
        np.testing.assert_allclose(visitor.look_at, com[0])
        assert sign * (visitor.position - com[0])[:2] @ way[:2] > 0.0
    session.show(1.0)
    np.testing.assert_allclose(visitor.position[:2] - com[0][:2], (visitor.position - visitor.look_at)[:2])
    session.following, before = True, visitor.position - com[session._sample(session.motion)]
    session.show(3.0)
    np.testing.assert_allclose(visitor.position - com[session._sample(session.motion)], before, atol=1e-12)
    with pytest.raises(InputError, match="valid: front, behind, left, right, above"):
        session.look("below")


def test_segments_are_coloured_by_the_largest_share_of_their_joints(finished_run):
    """A knee at its limit is red, one without torque grey; else the sides have their colours."""
    from manikin.viewer.canvas import SHARES, side_colour
    from manikin.viewer.session import ViewerSession

    body, motion = finished_run.body, finished_run.executed
    knee = body.joint_index("left_knee_flexion")
    tau = np.zeros_like(motion.tau)
    tau[:, 6 + knee] = body.torque_upper[knee]
    viewer = ViewerSession(replace(finished_run, executed=replace(motion, tau=tau)), Door(0))
    try:
        viewer.paint_by("torque")
        colours = dict(zip(viewer._shapes.frames, (m.color for m in viewer._shapes._meshes), strict=True))
        assert tuple(colours["left_leg"]) == tuple(SHARES[2])
        assert tuple(colours["right_leg"]) == tuple(SHARES[0])
        assert all(frame.visible for frame in viewer._shapes.frames.values())
        viewer.plot("left_knee_flexion")
        np.testing.assert_allclose(viewer._plot_values[-1], 1.0)
        viewer.paint_by("as it is")
        assert tuple(viewer._shapes._meshes[0].color) == side_colour(next(iter(colours)))
        with pytest.raises(InputError, match="valid: margin, "):
            viewer.plot("knee")
    finally:
        viewer.close()


def test_the_whole_body_is_coloured_by_the_margin(finished_run):
    """At the largest margin as without torque, at none as at the limit; then in its own clothes again."""
    from manikin.viewer.canvas import SHARES
    from manikin.viewer.session import ViewerSession

    motion = finished_run.executed
    margin = np.linspace(0.0, 40.0, len(motion.time))
    viewer = ViewerSession(replace(finished_run, executed=replace(motion, margin=margin)), Door(0))
    try:
        clothes = [tuple(mesh.color) for mesh in viewer._shapes._surface]
        viewer.paint_by("margin")
        for time, row in ((motion.time[0], 2), (motion.time[-1], 0)):
            viewer.show(time)
            assert {tuple(mesh.color) for mesh in viewer._shapes._surface} == {tuple(SHARES[row])}
        viewer.paint_by("as it is")
        assert [tuple(mesh.color) for mesh in viewer._shapes._surface] == clothes
        with pytest.raises(InputError, match="valid: as it is, torque, margin"):
            viewer.paint_by("mood")
    finally:
        viewer.close()


def test_a_motion_beside_can_be_laid_over(session):
    session.put_beside("planned")
    session.set_apart(0.0)
    q = session.content.planned.q[session._sample(session.content.planned)]
    np.testing.assert_allclose(
        session._second.data.oMf[session._body.segment_frame("pelvis")].translation[:2],
        Configuration(session._body, q).segment_placement("pelvis")[1][:2],
        atol=1e-12,
    )
    session.set_apart(1.5)
    moved = session._second.data.oMf[session._body.segment_frame("pelvis")].translation[:2]
    there = Configuration(session._body, q).segment_placement("pelvis")[1][:2]
    assert np.linalg.norm(moved - there) == pytest.approx(1.5)


def test_motions_can_be_switched(session):
    session.show(1.0)
    session.choose("planned")
    assert session.motion is session.content.planned
    assert session.time == 1.0
    with pytest.raises(InputError, match="valid here: planned, executed"):
        session.choose("recorded")


def test_cursor_of_the_plot_stands_at_the_instant_shown(session):
    session.show(2.0)
    time, *_, cursor = session._plot.data
    assert time[np.argmax(cursor)] == pytest.approx(2.0, abs=np.diff(time)[0])


def test_closing_twice_is_fine_and_ends_the_service(finished_run):
    from manikin.viewer.session import ViewerSession

    viewer = ViewerSession(finished_run, Door(0))
    url = viewer.url
    runner = threading.Thread(target=viewer.run)
    runner.start()
    viewer.play()
    viewer.close()
    viewer.close()
    runner.join(timeout=10)
    assert not runner.is_alive()
    with pytest.raises((OSError, http.client.HTTPException)):
        urllib.request.urlopen(url, timeout=2)


def test_taken_and_impossible_ports_are_refused_in_one_line(session):
    for port in (session.server.get_port(), 70000, -1):
        with pytest.raises(InputError, match="valid: a free port"):
            Door(port)


def test_file_without_body_is_refused(finished_run):
    with pytest.raises(InputError, match="no body"):
        serve(replace(finished_run, body=None), port=0)


def test_others_move_on_the_same_clock(finished_run):
    """A twin who is there too is always where the body is; a file without a body is refused."""
    from manikin.viewer.session import ViewerSession

    with pytest.raises(InputError, match="twin"):
        ViewerSession(finished_run, Door(0), {"twin": MotionFile(finished_run.planned)})
    session = ViewerSession(finished_run, Door(0), {"twin": finished_run})
    try:
        for time in (0.5, 1.2):
            session.show(time)
            shapes, _ = session._others[0]
            for name, frame in session._shapes.frames.items():
                np.testing.assert_array_equal(shapes.frames[name].position, frame.position)
    finally:
        session.close()


def test_a_recording_is_shown_beside_its_plan(finished_run):
    """Both at the same instant, apart across the way and nowhere else."""
    from manikin.viewer.session import BESIDE, ViewerSession

    viewer = ViewerSession(replace(finished_run, recorded=finished_run.planned), Door(0))
    try:
        assert viewer.beside == "recorded"
        viewer.choose("planned")
        viewer.show(0.7)
        for name, frame in viewer._second.frames.items():
            apart = np.asarray(frame.position) - np.asarray(viewer._shapes.frames[name].position)
            assert np.linalg.norm(apart[:2]) == pytest.approx(BESIDE, abs=1e-9)
            assert apart[2] == pytest.approx(0.0, abs=1e-12)
        assert all(mesh.visible for mesh in viewer._second._surface)
        viewer.put_beside("nothing")
        assert not any(item.visible for item in (*viewer._second.frames.values(), *viewer._second._surface))
        with pytest.raises(InputError, match="valid here: nothing, recorded, planned, executed"):
            viewer.put_beside("replayed")
    finally:
        viewer.close()


class Keeper:
    """What a session needs of a browser to which it sends files and messages."""

    def __init__(self):
        self.files, self.messages = {}, []

    def send_file_download(self, name, content):
        self.files[name] = content

    def add_notification(self, _title, body, **_options):
        self.messages.append(body)


def test_a_film_of_the_motion_shown_is_sent_and_a_reason_against_it_said(finished_run):
    from manikin.viewer.session import ViewerSession

    labels, visitor = [], Keeper()

    def film(content, name, kind, progress):
        if len(labels) == 2:
            page.close()
        progress(0.5)
        labels.append(page._film_button.label)
        if kind == "mp4":
            raise InputError("mp4 needs imageio-ffmpeg")
        page.send_film(visitor, kind)  # a second one meanwhile is not made
        return f"{name} of {len(content.motions)}".encode()

    page = ViewerSession(finished_run, Door(0), film=film)
    try:
        page.choose("planned")
        page.send_film(visitor, "gif")
        page.send_film(visitor, "mp4")
        assert visitor.files == {"planned.gif": b"planned of 2"}
        assert visitor.messages == ["mp4 needs imageio-ffmpeg"]
        assert labels == ["Film: 50 %"] * 2
        assert (page._film_button.label, page._film_button.disabled) == ("Save a film", False)
        page.send_film(visitor, "gif")
        assert visitor.messages[-1] == "film was not made; valid: with the page open"
    finally:
        page.close()


def test_controls_show_what_was_chosen_and_what_is_chosen_with_them_is_followed(session):
    session.put_beside("planned")
    session.paint_by("margin")
    session.set_apart(0.5)
    assert (session._beside_box.value, session._painting_box.value) == ("planned", "margin")
    assert session._apart_slider.value == 0.5
    handle = session._motions_box
    handle._impl.value = "planned"  # as a visitor does it
    for callback in handle._impl.update_cb:
        callback(types.SimpleNamespace(client=object(), client_id=0, target=handle))
    assert session.chosen == "planned"


def test_without_a_maker_there_is_no_film(session):
    assert not session._film_button.visible
    session.send_film(Keeper(), "gif")
