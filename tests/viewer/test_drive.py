"""The walking mode: keys and sliders steer the walker, in steps of time that the tests give."""

import threading
import types
import urllib.request

import numpy as np
import pytest

from manikin.cli import main
from manikin.cli.console import DONE
from manikin.errors import InputError
from manikin.scene import Box, Obstacle, Scene
from manikin.walking import WalkController

pytest.importorskip("viser")

from manikin.viewer.door import Door  # only where viser is

FRAME = 1.0 / 20.0
"""Of a page on a slow computer [s]: bodies are drawn as often as needed to see them move."""


@pytest.fixture(scope="module")
def drive():
    from manikin.viewer import drive

    return drive


@pytest.fixture
def viewer(drive):
    page = drive.WalkViewer(WalkController(), Door(0))
    yield page
    page.close()


@pytest.fixture
def press(viewer, drive):
    keys = {key.hotkey: key for key in drive.KEYS}

    def pressed(hotkey, times=1):
        for _ in range(times):
            viewer.press(keys[hotkey])

    return pressed


def walked(viewer, seconds):
    for _ in range(round(seconds / FRAME)):
        viewer.advance(FRAME)


def slid(viewer, index, value):
    """What viser does when a visitor drags a slider: the value first, then the callbacks with the visitor."""
    handle = viewer._sliders[index]
    handle._impl.value = value
    for callback in handle._impl.update_cb:
        callback(types.SimpleNamespace(client=object(), client_id=0, target=handle))


def test_the_page_is_served(viewer):
    assert b"<html" in urllib.request.urlopen(viewer.url, timeout=10).read().lower()
    assert viewer.url.startswith("http://127.0.0.1:")


def test_every_key_is_shown_and_changes_what_it_says(viewer, press, drive):
    assert len({key.hotkey for key in drive.KEYS}) == len(drive.KEYS)
    for hotkey, wanted in (
        ("arrowup", [0.2, 0, 0]), ("arrowdown", [0, 0, 0]), ("arrowdown", [-0.2, 0, 0]),
        ("arrowleft", [-0.2, 0, 0.25]), ("A", [-0.2, 0.1, 0.25]), ("arrowright", [-0.2, 0.1, 0.0]),
        ("D", [-0.2, 0, 0]), ("D", [-0.2, -0.1, 0]), ("S", [-0.2, 0, 0]), ("space", [0, 0, 0]),
    ):  # fmt: skip
        press(hotkey)
        assert viewer.directive.tolist() == wanted
        assert [slider.value for slider in viewer._sliders] == wanted


def test_keys_stop_at_the_limits_of_the_page_and_come_back_to_zero(viewer, press, drive):
    press("arrowup", 40)
    press("arrowleft", 40)
    press("A", 40)
    assert np.array_equal(viewer.directive, drive.HIGHEST)
    press("arrowdown", 15)
    assert viewer.directive[0] == 0.0  # tenths add up without a rest
    press("arrowdown", 40)
    press("arrowright", 40)
    press("D", 40)
    assert np.array_equal(viewer.directive, drive.LOWEST)


def test_the_walker_walks_ahead_turns_and_stops(viewer, press):
    press("arrowup", 5)
    walked(viewer, 4.0)
    place = viewer.controller.step(FRAME, viewer.directive).place
    # 1 m/s for 4 s but for the first half second, in which it speeds up with 2 m/s^2.
    assert place[0] == pytest.approx(4.0 - 0.25, abs=0.05)
    assert abs(place[1]) < 1e-9
    press("arrowleft", 2)
    walked(viewer, np.pi)
    turned = viewer.controller.step(FRAME, viewer.directive)
    assert turned.place[2] == pytest.approx(np.pi / 2, abs=0.1)
    assert turned.velocity == pytest.approx([1.0, 0.0, 0.5], abs=1e-6)
    press("space")
    walked(viewer, 3.0)
    stopped = viewer.controller.step(FRAME, viewer.directive)
    assert stopped.velocity.tolist() == [0.0, 0.0, 0.0]
    assert stopped.support == (True, True)
    walked(viewer, 0.5)
    assert np.array_equal(viewer.controller.step(FRAME, viewer.directive).place, stopped.place)
    assert "standing on: left, right" in viewer._text.content


def test_shapes_are_where_the_body_is(viewer, press):
    press("arrowup", 5)
    walked(viewer, 2.0)
    frames = viewer._shapes.frames
    pelvis = np.asarray(frames["pelvis"].position)
    assert abs(pelvis[0] - viewer._place[0]) < 0.2
    assert 0.8 < pelvis[2] < 1.1
    for foot in ("left_foot", "right_foot"):
        assert np.linalg.norm(np.asarray(frames[foot].position) - pelvis) < 1.2


def test_a_late_page_makes_up_for_the_time_but_not_for_more_than_it_should(viewer, press, drive):
    press("arrowup", 5)
    walked(viewer, 1.0)
    before = viewer._place[0]
    viewer.advance(0.3)
    assert viewer._place[0] - before == pytest.approx(0.3, abs=1e-6)
    viewer.advance(60.0)
    assert viewer._place[0] - before == pytest.approx(0.3 + drive.LONGEST_GAP, abs=1e-6)


def test_sliders_steer_and_what_the_page_itself_moves_does_not(viewer, press):
    slid(viewer, 0, 0.8)
    slid(viewer, 2, -0.5)
    assert viewer.directive.tolist() == [0.8, 0.0, -0.5]
    # The page sets one slider after the other; the state in between is nobody's wish.
    asked = []
    steer = viewer.steer
    viewer.steer = lambda wish: (asked.append(wish), steer(wish))
    press("space")
    assert len(asked) == 1
    assert viewer.directive.tolist() == [0.0, 0.0, 0.0]
    assert [slider.value for slider in viewer._sliders] == [0.0, 0.0, 0.0]


def test_a_directive_beyond_the_library_is_said_so(viewer, press):
    press("arrowdown", 4)
    press("arrowleft", 8)
    press("A", 8)
    walked(viewer, 0.1)
    assert "beyond the motion library" in viewer.notice
    assert viewer.notice in viewer._text.content
    press("space")
    walked(viewer, 0.1)
    assert viewer.notice is None


def test_the_walker_stands_on_the_floor_of_the_scene(drive):
    box = Obstacle("box", Box((1.0, 1.0, 1.0)), translation=(3.0, 0.0, 1.0))
    page = drive.WalkViewer(WalkController(place=(0.5, 0.0, 0.0)), Door(0), Scene([box], 0.5))
    try:
        assert 0.5 + 0.8 < page._shapes.frames["pelvis"].position[2] < 0.5 + 1.1
    finally:
        page.close()
    with pytest.raises(InputError, match="scene has no floor"):
        drive.WalkViewer(WalkController(), Door(0), Scene([], None))


def test_it_runs_until_it_is_closed(viewer, press):
    press("arrowup", 5)
    runner = threading.Thread(target=viewer.run)
    runner.start()
    for _ in range(500):
        if viewer._place[0] > 0.1:
            break
        threading.Event().wait(0.02)
    viewer.close()
    viewer.close()
    runner.join(timeout=10)
    assert not runner.is_alive()
    assert viewer._place[0] > 0.1


def test_the_command_ends_when_the_page_is_closed(monkeypatch, capfd, drive):
    pages = []

    class Closed(drive.WalkViewer):
        def __init__(self, *given):
            super().__init__(*given)
            pages.append(self)
            self.left = 3

        def advance(self, seconds):
            super().advance(seconds)
            self.left = getattr(self, "left", 9) - 1
            if self.left == 0:
                self.close()

    monkeypatch.setattr(drive, "WalkViewer", Closed)
    options = ["--port", "0", "--from", "1", "2", "90", "--in", "narrow", "--stature", "1.6"]
    assert main(["walk", "--drive", *options]) == DONE
    out, err = capfd.readouterr()
    assert out == ""
    assert "viewer at http://127.0.0.1:" in err
    assert np.allclose(pages[0]._place, [1.0, 2.0, np.pi / 2])
    assert pages[0].controller.body.stature == 1.6
