"""Data of the player of a page: what a browser decodes stands where the body stands."""

import base64
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import manikin.reports
from manikin.body import Configuration
from manikin.body.skin import segment_frames, skin_of
from manikin.reports.pages import render
from manikin.reports.player import MOST_FRAMES, MOST_TRIANGLES, player_data
from manikin.scene import Obstacle, Scene, Sphere

SCRIPT = Path(manikin.reports.__file__).parent / "templates/player.js"


@pytest.fixture(scope="module")
def data(finished_run):
    file = finished_run
    return json.loads(json.dumps(player_data(file.body, file.planned, file.scene, file.schedule)))


def decoded(text, kind, *shape):
    return np.frombuffer(base64.b64decode(text), dtype=kind).reshape(shape).astype(float)


def test_decoded_vertices_are_those_of_the_skin(data, finished_run):
    """Shares of 2 m in 16 bits are off by 0.02 mm, weights in 8 bits by some tenths of a millimetre."""
    body, motion, skin = finished_run.body, finished_run.planned, skin_of(finished_run.body)
    part, frames, bones = data["skin"], data["frames"], data["segments"]
    places = decoded(part["places"], "<u2", -1, 4)[:, :3] / 65535.0 * part["size"] + part["low"]
    tracks = decoded(data["tracks"], "<f4", frames, bones, 7)
    weights = decoded(part["weights"], "u1", -1, 4) / 255.0
    numbers = decoded(part["bones"], "u1", -1, 4).astype(int)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    for frame in (0, frames // 2, frames - 1):
        time = motion.time[0] + motion.duration * frame / (frames - 1)
        sample = min(np.searchsorted(motion.time, time - 1e-9), len(motion.time) - 1)
        turns = Rotation.from_quat(tracks[frame, :, :4]).as_matrix()
        each = np.einsum("nkij,nj->nki", turns[numbers], places) + tracks[frame, :, 4:][numbers]
        drawn = np.einsum("nk,nki->ni", weights, each)
        known, _ = skin.posed(*segment_frames(body, motion.q[sample]))
        assert np.abs(drawn - known).max() < 1e-3


def test_every_triangle_of_the_skin_has_a_colour(data, finished_run):
    skin = skin_of(finished_run.body)
    assert sum(count for count, _ in data["skin"]["parts"]) == len(skin.faces)
    assert len(data["skin"]["parts"]) == 5


def test_neighbouring_frames_have_quaternions_of_the_same_half(data):
    """So that a mean of both is a turn between them."""
    tracks = decoded(data["tracks"], "<f4", data["frames"], data["segments"], 7)[..., :4]
    assert np.sum(tracks[1:] * tracks[:-1], axis=-1).min() > 0.0


def test_a_scene_of_too_many_triangles_is_shown_by_bounds(finished_run):
    at = Configuration(finished_run.body, finished_run.planned.q[0]).com
    balls = [Obstacle(f"ball {k}", Sphere(0.1), None, np.add(at, [0.4, 0.1 * k, 0.0])) for k in range(40)]
    shown = player_data(finished_run.body, finished_run.planned, Scene(balls))
    assert shown["scene"]["count"] <= 3 * MOST_TRIANGLES
    assert shown["frames"] <= MOST_FRAMES


def test_a_page_with_the_player_needs_no_other_file_and_is_small(data):
    summary = {"scenario": "a", "succeeded": True, "requirements": []}
    rest = {"pictures": {}, "values": {}, "contacts": [], "key_numbers": {}, "commands": ""}
    page = render("run", summary=summary, verdict="proved", motion=data, **rest)
    assert "http" not in page
    assert len(page) < 2.5e6


STUBS = """
const calls = [], listeners = {};
const element = (name) => ({
  name, hidden: true, value: "1", clientWidth: 400, clientHeight: 300, textContent: "",
  addEventListener: (kind, act) => { listeners[name + kind] = act; }, setPointerCapture() {},
  getContext: () => gl,
});
const gl = new Proxy({}, { get: (_, key) => {
  if (/^[A-Z_]+$/.test(key)) return key;
  return (...rest) => {
    calls.push([key, ...rest]);
    return key === "getAttribLocation" ? 0 : key === "getUniformLocation" ? rest[1] : true;
  };
} });
const parts = {};
for (const name of ["canvas", "button", "input", "select", "output", ".missing"]) parts[name] = element(name);
const document = { getElementById: (id) => id === "player" ? { querySelector: (name) => parts[name] }
  : { textContent: require("fs").readFileSync(process.argv[2], "utf8") } };
const window = { devicePixelRatio: 1, addEventListener() {} };
let next = null;
const requestAnimationFrame = (act) => { next = act; };
"""
ASKED = """
const rows = () => Array.from(calls.filter((call) => call[1] === "rows").at(-1)[2]);
const shown = [];
for (const now of [0, 100, 200]) next(now);
shown.push(Number(parts.input.value), rows());
parts.input.value = DURATION; listeners.inputinput(); next(300);
shown.push(parts.button.textContent, parts.output.textContent, rows());
listeners.buttonclick(); next(400); next(500);
shown.push(parts.button.textContent, Number(parts.input.value));
console.log(JSON.stringify(shown));
"""


def test_the_page_tells_only_of_what_is_shown(data):
    rest = {"pictures": {}, "values": {}, "contacts": [], "key_numbers": {}, "commands": ""}
    rest |= {"summary": {"scenario": "a", "succeeded": True, "requirements": []}, "verdict": "proved"}
    assert "Lines on the floor" in render("run", motion=data, **rest)
    alone = render("run", motion={**data, "floor": None, "scene": None}, **rest)
    assert "Lines on the floor" not in alone
    assert "body shines through." not in alone


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node to run the page's script")
def test_the_script_plays_loops_pauses_and_places_the_segments(data, tmp_path):
    """Run by node with a stand-in for WebGL that keeps what the shader is given."""
    file, run = tmp_path / "data.json", tmp_path / "run.js"
    file.write_text(json.dumps(data))
    script = SCRIPT.read_text(encoding="utf-8").replace('"use strict";', "")
    run.write_text(STUBS + script + ASKED.replace("DURATION", str(data["duration"])))
    result = subprocess.run(["node", run, file], capture_output=True, text=True, timeout=60)
    assert result.returncode == 0, result.stderr
    time, rows, paused, clock, last, playing, looped = json.loads(result.stdout)
    assert time == pytest.approx(0.2)
    assert paused == "Play"
    assert clock == f"{data['start'] + data['duration']:.2f} s"
    assert playing == "Pause"
    assert looped < 0.5  # begins again at the end
    tracks = decoded(data["tracks"], "<f4", data["frames"], data["segments"], 7)
    for at, shown in ((-1, last), (0.2 / data["duration"] * (data["frames"] - 1), rows)):
        track = tracks[-1] if at == -1 else tracks[round(at)]
        placed = np.reshape(shown, (-1, 3, 4))
        # 0.2 s is a frame but for rounding, and nothing moves a tenth of a frame far.
        np.testing.assert_allclose(placed[..., :3], Rotation.from_quat(track[:, :4]).as_matrix(), atol=2e-3)
        np.testing.assert_allclose(placed[..., 3], track[:, 4:], atol=2e-3)
