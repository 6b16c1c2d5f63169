"""Figures of words, of the holonomic zone and of categories show what they are given."""

import numpy as np
import pytest

from manikin.errors import FigureError
from manikin.reports.figures import (
    equal_paths_figure,
    holonomic_ends_figure,
    holonomic_zone_figure,
    words_figure,
)
from manikin.walking import CategorySpread, CategoryStatistics, HolonomicZone
from manikin.walking.words import WordGrid, equal_paths, solve_slice


@pytest.fixture(scope="module")
def one():
    return solve_slice(340, WordGrid((-2.0, 0.4), (3.0, 3.4), 0.2))


def test_cells_and_a_path_to_each(one):
    figure = words_figure([one])
    cells, ways = figure.axes
    words = set(one.words.ravel().tolist())
    drawn = np.asarray(cells.images[0].get_array())
    assert drawn.shape == one.grid.shape
    assert len(np.unique(drawn)) == len(words)
    assert len(ways.texts) == len(words)  # an arrow at each goal
    assert {text.get_text() for text in figure.legends[0].get_texts()} == words | {"two best paths"}
    assert "340" in cells.get_title(loc="left")


def test_two_paths_and_their_curvatures(one):
    a, b = one.jumps()[0]
    pair = equal_paths(one.path(*a), one.path(*b))
    ways, curvatures = equal_paths_figure([pair]).axes
    for path, number in ((pair.first, 0), (pair.second, 1)):
        line = curvatures.lines[2 * number]
        assert line.get_label().startswith(path.word)
        assert line.get_xdata()[-1] == pytest.approx(path.length)
        assert np.abs(np.asarray(line.get_ydata())[[0, -1]]).max() < 1e-9
        assert len(curvatures.lines[2 * number + 1].get_xdata()) == len(path.word) - 1
    assert f"{pair.first.cost:.3f}" in ways.get_title(loc="left")


def test_zone_marks_every_goal_that_counts():
    goals = np.array([[0.0, 0.5, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    zone = HolonomicZone(goals, np.array([1.0, 0.4, 0.0]), np.array([True, True, False]))
    axes = holonomic_zone_figure({"made up": zone}).axes[0]
    filled, empty = axes.lines[:2]
    assert np.allclose(filled.get_xydata(), [[-0.5, 0.0]])
    assert np.allclose(empty.get_xydata(), [[1.0, 0.0]])
    assert "0.50 m" in axes.get_title(loc="left")


def test_bars_of_categories():
    spread = CategorySpread(0.3, 0.05, 0.15)
    one = CategoryStatistics(2, 4, spread, CategorySpread(0.2, 0.0, 0.0), 1.0, 0.3, None, None)
    first, second = holonomic_ends_figure({"LCF": one, "HCF": one}).axes
    assert [bar.get_height() for bar in first.patches] == pytest.approx([0.3, 0.3, 0.05, 0.05, 0.15, 0.15])
    assert [bar.get_height() for bar in second.patches][:2] == pytest.approx([0.2, 0.2])
    assert [label.get_text() for label in second.get_xticklabels()] == ["LCF", "HCF"]


@pytest.mark.parametrize(
    "draw",
    [
        lambda: words_figure([]),
        lambda: equal_paths_figure([]),
        lambda: holonomic_zone_figure({}),
        lambda: holonomic_ends_figure({}),
    ],
)
def test_nothing_to_draw_is_refused(draw):
    with pytest.raises(FigureError, match="valid:"):
        draw()
