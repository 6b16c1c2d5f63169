"""Figures: what they show, that the same run gives the same bytes, and that no window is needed."""

from dataclasses import replace

import matplotlib
import numpy as np
import pytest

from manikin.errors import MotionFileError
from manikin.figures import (
    com_figure,
    footprint_figure,
    margin_figure,
    scene_figure,
    tracking_figure,
    write_figures,
)
from manikin.motion.file import MotionFile

PNG = b"\x89PNG\r\n\x1a\n"


def labels(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


def test_every_figure_is_written_and_is_the_same_again(finished_run, tmp_path):
    shares = []
    written = write_figures(finished_run, tmp_path, shares.append)
    assert [path.name for path in written] == [
        "com.png", "margin.png", "footprints.png", "scene.png", "tracking.png",
    ]  # fmt: skip
    assert shares[-1] == 1.0
    first = {path.name: path.read_bytes() for path in written}
    assert all(data.startswith(PNG) for data in first.values())
    write_figures(finished_run, tmp_path)
    assert {path.name: path.read_bytes() for path in written} == first
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(first)


def test_no_global_state_is_left():
    import sys

    import manikin.figures  # noqa: F401

    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_planned_motion_alone_can_be_drawn(finished_run, tmp_path):
    for content in (replace(finished_run, executed=None), MotionFile(finished_run.planned)):
        names = [path.name for path in write_figures(content, tmp_path)]
        assert names == ["com.png", "margin.png", "footprints.png", "scene.png"]
        with pytest.raises(MotionFileError, match="tracking"):
            tracking_figure(content)


def test_com_figure_shows_both_motions_on_six_labelled_axes(finished_run):
    figure = com_figure(finished_run)
    named = {axes.get_ylabel(): axes for axes in figure.axes if axes.get_ylabel()}
    assert set(named) == {f"{axis} [{unit}]" for axis in "xyz" for unit in ("m", "m/s")}
    drawn = named["y [m]"].get_lines()
    np.testing.assert_array_equal(drawn[-2].get_ydata(), finished_run.planned.com[:, 1])
    np.testing.assert_array_equal(drawn[-1].get_ydata(), finished_run.executed.com[:, 1])
    # Time runs to the end of the execution, a second after the last phase.
    assert named["y [m]"].get_xlim() == (0.0, finished_run.executed.time[-1])


def test_margin_figure_names_the_limiting_phase(finished_run):
    motion = finished_run.planned
    lowest = int(np.argmin(motion.margin))
    phase = int(finished_run.schedule.phase_at(motion.time[lowest]))
    text = " ".join(labels(margin_figure(finished_run)))
    assert (
        f"planned (lowest {motion.margin[lowest]:.1f} N.m in phase {phase}, {motion.time[lowest]:.2f} s)"
        in text
    )


def test_footprints_are_numbered_in_the_order_they_are_made(finished_run):
    text = labels(footprint_figure(finished_run))
    for label in ("1: left foot", "2: right foot", "3: left foot", "4: right foot\nz = 0.2 m"):
        assert label in text
    assert any("roof" in label for label in text)


def test_tracking_errors_are_those_of_the_data(finished_run):
    """The executed CoM is off by 3 mm sin(9 t) along each axis, and so is the whole body."""
    size = np.abs(3.0 * np.sqrt(3.0) * np.sin(9.0 * finished_run.executed.time))
    text = " ".join(labels(tracking_figure(finished_run)))
    assert f"largest {size.max():.1f} mm" in text


def test_scene_is_drawn_to_scale(finished_run):
    axes = scene_figure(finished_run).axes[0]
    spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    np.testing.assert_allclose(axes._box_aspect / axes._box_aspect[0], spans / spans[0], rtol=1e-12)


def test_folder_that_does_not_exist_gives_one_line(finished_run, tmp_path):
    with pytest.raises(MotionFileError, match="cannot be written"):
        write_figures(finished_run, tmp_path / "none")
