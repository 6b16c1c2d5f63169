"""Texts in figures do not cover each other, however short the phases are."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Annotation

from manikin.contact import ContactSchedule, Phase, StanceSequence
from manikin.reports.figures import com_figure, contacts_figure, margin_figure, planes_figure, timing_figure
from manikin.reports.figures.style import Labels, new_grid


@pytest.fixture(scope="module")
def crowded(walls):
    """The climb up and down again with twenty phases, most of them shorter than their number is wide."""
    up = [Phase(phase.stance, 0.01) for phase in walls.schedule.sequence]
    known = (up + up[-2:0:-1]) * 3
    durations = np.where(np.arange(20) % 5 == 0, 0.5, 0.03125)
    schedule = ContactSchedule(StanceSequence(known[:20]), np.concatenate([[0.0], np.cumsum(durations)]))
    return replace(walls, content=replace(walls.content, schedule=schedule))


def extents(figure, texts):
    renderer = figure.canvas.get_renderer()
    return [text.get_window_extent(renderer) for text in texts if text.get_text().strip()]


def apart(figure, texts):
    """Whether no two texts share more than the fraction of a pixel."""
    boxes = [box.padded(-0.5) for box in extents(figure, texts)]
    return not any(first.overlaps(second) for first, second in combinations(boxes, 2))


@pytest.mark.parametrize("draw", [com_figure, margin_figure, planes_figure, contacts_figure])
def test_numbers_and_titles_on_axes_keep_apart(crowded, run, seated, draw):
    for record in (crowded, run, seated):
        figure = draw(record)
        figure.canvas.draw()
        for axes in figure.axes:
            notes = [text for text in axes.texts if isinstance(text, Annotation)]
            assert apart(figure, notes), axes.get_title("left")


def test_long_phases_are_numbered_first(crowded):
    strip = com_figure(crowded).axes[0]
    numbers = {text.get_text() for text in strip.texts}
    assert {"0", "5", "10", "15"} <= numbers
    assert len(numbers) < 20


def test_names_below_bars_keep_apart(crowded, run, seated):
    for record in (crowded, run, seated):
        figure = timing_figure(record)
        figure.canvas.draw()
        assert apart(figure, figure.axes[0].get_xticklabels())


def test_what_stands_still_is_not_magnified(walls):
    """The climb has no way across the walls; rounding errors must not fill a panel."""
    panels = [axes for axes in com_figure(walls).axes if axes.get_ylabel() in ("x [m]", "x [m/s]")]
    assert len(panels) == 2
    assert all(np.ptp(axes.get_ylim()) >= 4e-3 for axes in panels)


def test_labels_say_whether_they_were_written():
    figure, grid = new_grid(4.0, 3.0, "", 1, 1)
    axes = figure.add_subplot(grid[0])
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    labels = Labels(axes)
    assert labels.write("12", (0.5, 0.5))
    assert not labels.write("13", (0.505, 0.5))
    assert labels.write("14", (0.505, 0.5), (0.0, 20.0))
    assert [text.get_text() for text in axes.texts] == ["12", "14"]
