"""Films, decoded again, and what is on their pictures."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from manikin.errors import InputError
from manikin.reports.export import ExportOptions, export_motion, film_of_motion, resample
from manikin.reports.formats.video import Film, film_size, to_gif, to_mp4
from manikin.scene import Box, Obstacle, Scene

SMALL = ExportOptions(size=(96, 72))


RATE = 1.0


@pytest.fixture(scope="module")
def content(finished_run):
    return replace(finished_run, executed=None)


@pytest.fixture(scope="module")
def film(content):
    """A film of six pictures, each computed once."""
    film = Film(content.body, resample(content.planned, RATE), content.scene, SMALL.size)
    drawn = list(film.pictures())
    object.__setattr__(film, "pictures", lambda: iter(drawn))
    return film


def decoded(path):
    """Facts and pictures of a film, by the encoder's own program."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="mp4 needs imageio-ffmpeg (extra 'video')")
    stream = ffmpeg.read_frames(str(path))
    facts = next(stream)
    width, height = facts["size"]
    return facts, [np.frombuffer(data, np.uint8).reshape(height, width, 3) for data in stream]


def test_mp4_plays_with_all_its_frames(film, tmp_path):
    pytest.importorskip("imageio_ffmpeg", reason="mp4 needs imageio-ffmpeg (extra 'video')")
    path, told = tmp_path / "motion.mp4", []
    path.write_bytes(to_mp4(film, RATE, told.append))
    facts, frames = decoded(path)
    assert len(frames) == len(film) == len(told)
    assert told[-1] == 1.0
    assert facts["size"] == (96, 72)
    assert facts["fps"] == RATE
    assert facts["codec"] == "h264"
    # The file says its duration in hundredths of a second.
    assert facts["duration"] == pytest.approx(len(film) / RATE, abs=0.011)
    drawn = np.array(list(film.pictures()), dtype=float)
    # The encoder halves the resolution of colours and rounds: a few steps of 255 on average.
    assert np.abs(np.array(frames, dtype=float) - drawn).mean() < 5.0
    # Each frame is nearer to its own picture than to another one.
    assert np.abs(frames[0] - drawn[0]).mean() < 0.5 * np.abs(frames[0] - drawn[-1]).mean()


def test_gif_has_every_frame_for_its_time(film):
    with Image.open(BytesIO(to_gif(film, 3.0))) as image:
        durations = []
        for number in range(image.n_frames):
            image.seek(number)
            durations.append(image.info["duration"])
        assert image.size == (96, 72)
        assert image.info["loop"] == 0
    assert len(durations) == len(film)
    # A third of a second is 33 hundredths twice and 34 once, so that the whole keeps pace.
    assert set(durations) == {330, 340}
    assert sum(durations) == pytest.approx(1000.0 * len(film) / 3.0, abs=5.0)


def test_a_film_is_an_export_like_others(content, tmp_path):
    arrays = {name: array[:2] for name, array in content.planned.arrays().items()}
    short = replace(content, planned=replace(content.planned, **arrays), scene=None)
    assert export_motion(short, tmp_path, "gif", options=SMALL) == tmp_path / "motion.gif"
    with Image.open(tmp_path / "motion.gif") as image:
        assert image.n_frames == 1  # two samples 5 ms apart have one instant of a film


def test_camera_keeps_the_body_in_the_picture(content):
    motion = resample(content.planned, RATE)
    q = motion.q.copy()
    q[:, 0] += 4.0 * motion.time  # far more than a picture is wide
    film = Film(content.body, replace(motion, q=q), None, (96, 72))
    left, right, bottom, top = film.window
    for number, image in enumerate(film.pictures()):
        body = film._solid(number)
        places = film.camera(number).project(body.vertices)
        assert left < places[:, 0].min() < places[:, 0].max() < right
        assert bottom < places[:, 1].min() < places[:, 1].max() < top
        # Of a person of 1.7 m in a picture of about 2.3 m by 3.1 m a tenth or so is covered.
        assert 0.02 < np.mean(image.min(axis=2) < 200) < 0.5


def test_what_hides_the_body_is_seen_through(content):
    motion = resample(content.planned, RATE)
    root = motion.q[:, :3].mean(axis=0)
    open_film = Film(content.body, motion, None, (96, 72))
    towards = open_film.camera(0).towards
    screen = Obstacle("screen", Box([0.05, 4.0, 3.0]), translation=root + 1.0 * towards * [1.0, 1.0, 0.0],
                      rotation=open_film.camera(0).axes[[2, 0, 1]].T)  # fmt: skip
    film = Film(content.body, motion, Scene((screen,)), (96, 72))
    object.__setattr__(film, "_first", open_film._first)
    assert film._clear(0) == {"screen"}


@pytest.mark.parametrize("text", ["640", "641x480", "640x", "x480", "20x20", "640x480x3", "axb", "9000x900"])
def test_sizes_that_no_encoder_takes_are_refused(text):
    with pytest.raises(InputError, match=r"size is .*; valid: "):
        film_size(text)


def test_bad_films_give_one_line(content, tmp_path):
    with pytest.raises(InputError, match="at most 50 Hz"):
        export_motion(content, tmp_path, "gif", rate=60.0, options=SMALL)
    with pytest.raises(InputError, match="frames; valid: at most"):
        export_motion(content, tmp_path, "gif", rate=5000.0, options=SMALL)
    assert list(tmp_path.iterdir()) == []


def test_a_film_for_the_page_is_that_of_the_export(content, monkeypatch):
    """Of the first two pictures, 1/12.5 s apart, and small."""
    short = resample(content.planned, 12.5)
    first = replace(short, **{name: array[:2] for name, array in short.arrays().items()})
    monkeypatch.setattr("manikin.reports.export.SIZE", SMALL.size)
    told = []
    data = film_of_motion(replace(content, planned=first), "planned", "gif", told.append)
    image = Image.open(BytesIO(data))
    assert (image.n_frames, image.size, told) == (2, SMALL.size, [0.5, 1.0])
    with pytest.raises(InputError, match="motion is 'executed'"):
        film_of_motion(content, "executed", "gif", told.append)
