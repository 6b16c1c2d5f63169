"""Drawings for pages."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.reports.analysis_sheet import SvgDrawing, round_values


def points(svg):
    """Points of each line of a drawing, in pixels."""
    lines = []
    for path in re.findall(r' d="([^"]*)"', svg):
        for way in path.split("M")[1:]:
            begin, _, steps = way.partition("l")
            first = np.array([list(map(int, begin.split()))])
            rest = np.array(list(map(int, steps.split())), dtype=int).reshape(-1, 2)
            lines.append(np.concatenate([first, rest]).cumsum(axis=0) / 10.0)
    return lines


def test_a_curve_goes_through_its_points_to_a_tenth_of_a_pixel():
    x = np.linspace(0.0, 700.0, 400)
    y = 50.0 + 40.0 * np.sin(0.02 * x)
    drawing = SvgDrawing(700.0, 100.0)
    drawing.curve(x, y, "#000000", 1.0)
    (line,) = points(drawing.svg("a wave"))
    np.testing.assert_allclose(np.interp(x, *line.T), y, atol=0.15)  # rounding of both coordinates
    np.testing.assert_allclose(line[[0, -1]], [[x[0], y[0]], [x[-1], y[-1]]], atol=0.051)


def test_a_curve_is_broken_where_it_is_not_known():
    y = np.array([np.nan, 1.0, 2.0, np.nan, np.nan, 4.0, 1.0])
    drawing = SvgDrawing(7.0, 5.0)
    drawing.curve(np.arange(7.0), y, "#000000", 1.0)
    found = [line.tolist() for line in points(drawing.svg("two parts"))]
    assert found == [[[1.0, 1.0], [2.0, 2.0]], [[5.0, 4.0], [6.0, 1.0]]]


def test_straight_and_even_ways_need_their_ends_only():
    drawing = SvgDrawing(100.0, 10.0)
    drawing.curve(np.arange(100.0), np.full(100, 3.0), "#000000", 1.0)
    (line,) = points(drawing.svg("a level"))
    assert line.tolist() == [[0.0, 3.0], [99.0, 3.0]]


def test_words_are_shown_as_they_are():
    drawing = SvgDrawing(10.0, 10.0)
    drawing.text(1.0, 2.0, ("a < b & c", "#000000"))
    svg = drawing.svg('"quoted"')
    assert "a &lt; b &amp; c" in svg
    assert 'aria-label="&quot;quoted&quot;"' in svg


@given(low=st.floats(-1e6, 1e6), width=st.floats(1e-3, 1e6), most=st.integers(2, 12))
def test_round_values_are_even_and_inside(low, width, most):
    high = low + width
    values = round_values(low, high, most)
    assert 1 <= len(values) <= most
    room = 1e-6 * width
    assert values[0] >= low - room
    assert values[-1] <= high + room
    if len(values) > 2:
        np.testing.assert_allclose(np.diff(values), values[1] - values[0], rtol=1e-3)


def test_round_values_of_a_band():
    assert round_values(-0.4, 1.6, 4).tolist() == [0.0, 0.5, 1.0, 1.5]
    assert round_values(0.0, 15.0, 4).tolist() == [0.0, 5.0, 10.0, 15.0]
    assert round_values(-120.0, 70.0, 4) == pytest.approx([-100.0, -50.0, 0.0, 50.0])
