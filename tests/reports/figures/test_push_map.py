"""The figure of push maps: every impulse where its push leads, ahead upward, the soles in the middle."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import kudoh
from manikin.errors import FigureError
from manikin.reports.figures import push_map_figure
from manikin.simulation import HeldImpulse, PushMap, PushTrials
from manikin.simulation.push_map import told_apart

CONDITIONS = {
    "body": {"model": "kudoh"}, "feet": "free", "support": "both", "feet_apart_m": None, "delay_s": 0.2,
    "friction": 0.7,
    "locked": [], "posture_control_only": False, "strength": 1.0, "duration_s": 0.1, "tolerance_Ns": 1.0,
    "steps": 0, "ankle_stiffness": 0.64,
}  # fmt: skip
FOUND = (HeldImpulse(30.0, 31.0, 9), HeldImpulse(45.0, 46.0, 9), HeldImpulse(25.0, 26.0, 9), None)
MAP = PushMap(CONDITIONS, (0.0, 90.0, 180.0, 270.0), FOUND)


def test_ahead_is_up_and_left_is_left():
    figure = push_map_figure([MAP], PushTrials(kudoh()).soles())
    figure.canvas.draw()
    (axes,) = figure.axes
    curve = next(line for line in axes.lines if len(line.get_xdata()) == 5)
    centre, ahead, left = axes.transData.transform([(0.0, 0.0), (0.0, 30.0), (np.pi / 2, 45.0)])
    drawn = axes.transData.transform(np.column_stack([curve.get_xdata(), curve.get_ydata()]))
    np.testing.assert_allclose(drawn[:2], [ahead, left])
    assert drawn[0][1] > centre[1] + 100.0
    assert drawn[1][0] < centre[0] - 100.0
    assert np.isnan(drawn[3]).any()  # not searched yet: a gap
    np.testing.assert_allclose(drawn[4], drawn[0])  # closed
    soles = [patch.get_window_extent() for patch in axes.patches if len(patch.get_xy()) == 5]
    assert len(soles) == 2
    assert soles[0].x1 < centre[0] < soles[1].x0  # left and right of the centre of mass
    for sole in soles:
        assert sole.height / sole.width == pytest.approx(kudoh().sole_length / kudoh().sole_width, rel=1e-6)


def test_curves_are_named_by_what_tells_them_apart():
    other = PushMap(CONDITIONS | {"locked": ["arms"], "delay_s": 0.0}, MAP.directions, FOUND)
    (axes,) = push_map_figure([MAP, other]).axes
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["nothing locked, reaction after 0.2 s", "arms locked, reaction after 0 s"]
    common, names = told_apart([CONDITIONS])
    assert names == [""]
    assert common == "body of Kudoh, feet free, reaction after 0.2 s, push of 0.1 s"
    common, names = told_apart([CONDITIONS | {"steps": steps, "ankle_stiffness": 1.3} for steps in (0, 1, 2)])
    assert names == ["no step", "up to 1 step", "up to 2 steps"]
    assert "ankles of 1.3 m g h" in common


def test_maps_name_how_far_the_feet_are_apart_and_older_ones_do_without():
    older = {key: value for key, value in CONDITIONS.items() if key != "feet_apart_m"}
    _, names = told_apart([older, CONDITIONS | {"feet_apart_m": 0.1}])
    assert names == ["usual stance", "feet 0.1 m apart"]


def test_bounds_are_dashed_with_one_name_and_inside_the_figure():
    high = replace(MAP, bound=(40.0, 70.0, 30.0, 65.0))
    low = replace(MAP, conditions=CONDITIONS | {"locked": ["arms"]}, bound=(35.0, 60.0, 28.0, 55.0))
    (axes,) = push_map_figure([high, low]).axes
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["nothing locked", "arms locked", "bound without a step"]
    dashed = [line for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata())]
    for line, one in zip(dashed, (high, low), strict=True):
        np.testing.assert_allclose(line.get_ydata(), [*one.bound, one.bound[0]])
    assert axes.get_ylim()[1] > 70.0
    (alone,) = push_map_figure([high]).axes
    assert [text.get_text() for text in alone.get_legend().get_texts()] == ["held", "bound without a step"]
    assert push_map_figure([MAP]).axes[0].get_legend() is None


def test_a_map_of_nothing_is_not_drawn():
    with pytest.raises(FigureError, match="valid: a map"):
        push_map_figure([PushMap.empty(CONDITIONS, (0.0, 180.0))])
