"""Figures of statistics show what they are given, recorded or published."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.errors import FigureError
from manikin.recordings import (
    Overhead,
    RecordedClip,
    RecordedSupports,
    StatisticsSettings,
    Support,
    phase_durations,
    published_distances,
    published_phases,
    statistics_of,
)
from manikin.reports.directories import clip_figures, phase_table, published_figures
from manikin.reports.figures import (
    LowestPoints,
    com_distances_figure,
    com_heights_figure,
    com_paths_figure,
    phase_durations_figure,
    placements_figure,
    published_lowest,
)


@pytest.fixture(scope="module")
def clip():
    """Somebody who slides ahead on two feet, ducks in the middle, and grasps for a while."""
    time = np.linspace(0.0, 2.0, 101)
    com = np.column_stack([time, 0.05 * time, 0.95 - 0.3 * np.exp(-(((time - 1.0) / 0.3) ** 2))])
    feet = [("left_foot", 0.0, 1.2, 0.3), ("right_foot", 0.5, 2.0, 1.2), ("left_hand", 0.8, 1.0, 0.9)]
    supports = tuple(
        Support(name, start, end, *3 * (np.array([x, 0.1, 0.0]),), start > 0.0, end < 2.0)
        for name, start, end, x in feet
    )
    tops = {"head": com + np.array([0.0, 0.0, 0.7])}
    return RecordedClip("one", "sliders", RecordedSupports(supports, 0.0, 2.0, (0.0,)), time, com, tops, 0.95)


def bars(axes):
    return [patch for patch in axes.patches if patch.get_height() > 0.0]


def test_published_means_are_the_bars():
    """[Qiu2012]_ Fig. 3.11: five phases of four configurations."""
    shown = [one for one in published_phases("left_foot") if not one.group.endswith("C3")]
    motions, means = phase_durations_figure(shown).axes
    assert len(bars(motions)) == sum(len(one.phases) for one in shown)
    assert len(bars(means)) == 20
    assert [label.get_text() for label in means.get_xticklabels()] == ["SS-1", "DS-2", "SS-2", "DS-3", "SS-3"]
    counts = [text.get_text() for text in means.texts]
    assert counts == ["5"] * 5 + ["6"] * 15
    expected = phase_durations([one for one in shown if one.group == "H2C2"])["SS-3"].mean
    assert bars(means)[-1].get_height() == pytest.approx(expected)


def test_recorded_phases_are_drawn_by_the_same_function(clip):
    motions, means = phase_durations_figure([clip.phases], "kind").axes
    assert sum(bar.get_width() for bar in bars(motions)) == pytest.approx(2.0)
    kinds = {label.get_text() for label in means.get_xticklabels()}
    assert kinds == {"DS", "DS\nleft hand"}


def test_places_of_each_group_have_a_panel(clip):
    found = statistics_of([clip, replace(clip, name="two"), replace(clip, name="three")])
    axes = placements_figure({**{g: one.placements for g, one in found.items()}, "none": ()}).axes
    assert len(axes) == 1
    assert len(axes[0].patches) == 3  # an ellipse for each of the supports
    assert "3 motions" in axes[0].get_title(loc="left")


def test_ways_are_seen_from_their_lowest_points(clip):
    how = StatisticsSettings(origin="lowest")
    side, above = com_paths_figure([clip], [how.origin_of(clip)], overhead=1.5).axes
    lowest = next(line for line in side.lines if line.get_marker() == "v")
    assert lowest.get_xydata()[0] == pytest.approx([0.0, 0.65], abs=1e-9)
    assert len([line for line in above.lines if line.get_marker() == "s"]) == 3
    with pytest.raises(FigureError, match="valid: one for each"):
        com_paths_figure([clip], [])


def test_published_heights_stand_beside_recorded_ones(clip):
    (found,) = statistics_of([clip], StatisticsSettings(Overhead(1.5))).values()
    left, right = com_heights_figure([*published_lowest(), LowestPoints.of(found, 1.5)], 0.97).axes
    assert [bar.get_height() for bar in bars(left)] == pytest.approx([0.85, 0.80, 0.65, 0.65])
    assert [bar.get_height() for bar in bars(right)] == pytest.approx([0.60, 0.50, 0.45, 0.85])
    (whole,) = statistics_of([clip]).values()
    assert LowestPoints.of(whole).com == pytest.approx((0.65,))


def test_a_panel_for_each_effector_with_published_ranges(clip):
    figure = com_distances_figure([clip], published=published_distances())
    titles = [axes.get_title(loc="left") for axes in figure.axes[::2]]
    assert titles == ["left foot", "left hand", "right foot"]
    alone = com_distances_figure([], published=published_distances())
    assert len(alone.axes) == 4


def test_all_figures_of_motions_and_of_the_published_ones(clip):
    how = StatisticsSettings(Overhead(1.5), origin="lowest")
    assert len(clip_figures([clip], statistics_of([clip], how), how)) == 5
    still = replace(clip, com=np.tile(clip.com[0], (101, 1)))
    names = set(clip_figures([still], statistics_of([still]), StatisticsSettings()))
    assert names == {"phase_durations", "com_heights", "com_distances"}
    assert set(published_figures()) == names
    lines = phase_table([clip.phases]).splitlines()
    assert len(lines) == 1 + len(clip.phases.phases)


@pytest.mark.parametrize(
    "draw",
    [
        lambda: phase_durations_figure([]),
        lambda: placements_figure({}),
        lambda: com_paths_figure([], []),
        lambda: com_heights_figure([]),
        lambda: com_distances_figure([]),
    ],
)
def test_nothing_to_draw_is_refused(draw):
    with pytest.raises(FigureError, match="valid:"):
        draw()
