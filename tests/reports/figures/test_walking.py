"""The figure of walking paths shows what it is given."""

import numpy as np
import pytest

from manikin.errors import FigureError
from manikin.reports.figures import walking_paths_figure
from manikin.walking import START, WalkObstacle, walking_path


def test_each_group_has_a_panel_with_its_paths_and_obstacles():
    pillar = [WalkObstacle.moving_disc("p", (0, 3), [(0.0, 1.5), (0.5, 1.5)], 0.3)]
    around = walking_path(START, (0, 3, np.pi / 2), obstacles=pillar)
    aside = walking_path(START, (0.5, 0, np.pi / 2))
    figure = walking_paths_figure({"around": [around], "aside": [aside, aside], "none": []})
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["around", "aside"]
    first, second = figure.axes
    assert len(first.patches) == 2  # where it begins, and where it ends
    assert len(second.collections) == 4  # way and shoulders of two paths
    drawn = np.vstack(list(first.collections[0].get_segments()))
    assert np.allclose(drawn[0], around.place[0, :2])
    assert np.allclose(drawn[-1], around.place[-1, :2])
    low, high = first.get_ylim()
    assert low < drawn[:, 1].min() < drawn[:, 1].max() < high


def test_no_path_is_refused():
    with pytest.raises(FigureError, match="needs a walking path"):
        walking_paths_figure({"none": []})
