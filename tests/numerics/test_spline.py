"""Clamped B-splines: basis, derivatives, end conditions and their published evaluation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline as ScipySpline

from manikin.errors import SplineError
from manikin.numerics.spline import (
    BSpline,
    basis_matrix,
    bernstein_matrix,
    clamped_knots,
    derivative_matrix,
    end_control_points,
    start_control_points,
)

# Values are of order one; sums of k products of such numbers round to about 1e-15.
ROUNDING = 1e-12


@st.composite
def splines(draw: st.DrawFn, min_degree: int = 1) -> BSpline:
    degree = draw(st.integers(min_degree, 6))
    spans = draw(st.lists(st.floats(0.05, 2.0), min_size=1, max_size=6))
    seed = draw(st.integers(0, 2**16))
    knots = clamped_knots(degree, np.concatenate([[0.0], np.cumsum(spans)]))
    points = np.random.default_rng(seed).normal(size=(len(knots) - degree - 1, 3))
    return BSpline(degree, knots, points)


def inner_times(spline: BSpline, count: int = 41) -> np.ndarray:
    return np.linspace(*spline.domain, count)


@given(splines())
def test_basis_functions_add_up_to_one_and_none_is_negative(spline: BSpline):
    values = basis_matrix(spline.degree, spline.knots, inner_times(spline))
    assert np.allclose(values.sum(axis=1), 1.0, atol=ROUNDING)
    assert values.min() >= 0.0


@given(splines(), st.integers(0, 4))
def test_every_derivative_is_that_of_scipy(spline: BSpline, order: int):
    t = inner_times(spline)
    reference = ScipySpline(spline.knots, spline.control_points, spline.degree)(t, order)
    if order > spline.degree:
        reference = np.zeros_like(reference)
    scale = 1.0 + np.abs(reference).max()
    # At an inner knot the highest derivative jumps; both take the value of the span to its right.
    assert np.allclose(spline(t, order), reference, atol=1e-10 * scale)


@given(splines(min_degree=3))
def test_first_derivative_is_the_limit_of_differences(spline: BSpline):
    span = spline.domain[1]
    step = 1e-5 * span
    t = np.linspace(0.01, 0.99, 23) * span
    differences = (spline(t + step) - spline(t - step)) / (2 * step)
    scale = np.abs(spline(t, 1)).max() + np.abs(spline(t, 3)).max() * step**2
    # Truncation is step^2/6 times the third derivative, rounding 1e-16/1e-5.
    assert np.allclose(differences, spline(t, 1), atol=1e-6 * (1.0 + scale))


@given(splines(), st.integers(0, 3))
def test_discretisation_matrix_times_control_points_is_the_curve(spline: BSpline, order: int):
    t = inner_times(spline)
    matrix = basis_matrix(spline.degree, spline.knots, t, order)
    values = spline(t, order)
    assert np.allclose(matrix @ spline.control_points, values, atol=1e-9 * (1 + np.abs(values).max()))


@given(splines(min_degree=2))
def test_derivative_control_points_make_the_derivative_curve(spline: BSpline):
    matrix = derivative_matrix(spline.degree, spline.knots, 2)
    curve = spline.derivative(2)
    assert np.allclose(curve.control_points, matrix @ spline.control_points)
    assert curve.degree == spline.degree - 2
    assert np.array_equal(curve.breakpoints, spline.breakpoints)


def test_half_open_spans_belong_to_their_right_end_only_at_the_last_knot():
    """At an inner knot the basis of degree 0 is that of the span beginning there."""
    knots = clamped_knots(0, [0.0, 1.0, 3.0])
    assert np.array_equal(basis_matrix(0, knots, [0.0, 1.0, 3.0]), [[1, 0], [0, 1], [0, 1]])


@given(splines(min_degree=2), st.integers(0, 2**16))
def test_end_conditions_are_met(spline: BSpline, seed: int):
    """[Qiu2012]_ 2.45-2.50 with the correction of 2.49."""
    if len(spline.control_points) < 6:
        return
    wanted = np.random.default_rng(seed).normal(size=(2, 3, 3))
    points = spline.control_points.copy()
    points[:3] = start_control_points(spline.degree, spline.knots, *wanted[0])
    points[-3:] = end_control_points(spline.degree, spline.knots, *wanted[1])
    curve = BSpline(spline.degree, spline.knots, points)
    for end, values in zip(curve.domain, wanted, strict=True):
        for order, value in enumerate(values):
            # Second derivatives divide differences of points by spans as short as 0.05.
            assert np.allclose(curve(end, order), value, atol=1e-9 * 10**order)


@given(splines())
def test_bezier_points_give_the_pieces_back(spline: BSpline):
    s = np.linspace(0.0, 1.0, 7)
    for start, end, points in zip(
        spline.breakpoints[:-1], spline.breakpoints[1:], spline.bezier_points(), strict=True
    ):
        piece = bernstein_matrix(spline.degree, s) @ points
        assert np.allclose(piece, spline(start + s * (end - start)), atol=1e-9)


def test_fit_returns_the_curve_that_was_sampled():
    knots = clamped_knots(5, [0.0, 0.3, 0.7, 1.0])
    points = np.random.default_rng(1).normal(size=(8, 3))
    curve = BSpline(5, knots, points)
    t = np.linspace(0.0, 1.0, 60)
    fitted = BSpline.fit(5, knots, t, curve(t), first=points[:2], last=points[-1:])
    assert np.array_equal(fitted.control_points[:2], points[:2])
    assert np.allclose(fitted.control_points, points, atol=1e-9)


def test_cubic_polynomial_has_its_exact_derivatives():
    """x^3 on [0, 2] as a spline of degree 3."""
    t = np.linspace(0.0, 2.0, 9)
    curve = BSpline.fit(3, clamped_knots(3, [0.0, 0.5, 2.0]), t, t[:, None] ** 3)
    assert np.allclose(curve(t, 1)[:, 0], 3 * t**2, atol=1e-9)
    assert np.allclose(curve(t, 2)[:, 0], 6 * t, atol=1e-8)
    assert np.allclose(curve(t, 3)[:, 0], 6.0, atol=1e-7)
    assert np.array_equal(curve(t, 4), np.zeros((9, 1)))


@pytest.mark.parametrize(
    ("degree", "knots", "count", "text"),
    [
        (-1, [0, 1], 1, "degree is -1"),
        (1, [0, 0, 1, 1], 3, "4 knots; valid: 5"),
        (1, [0, 0, 1], 1, "1 control points"),
        (1, [0, 0.1, 1, 1], 2, "repeated 2 times"),
        (1, [0, 0, 0.6, 0.5, 1, 1], 4, "nondecreasing"),
        (2, [0, 0, 0, 0, 1, 1, 1], 4, "repeated 3 times"),
        (1, [0, 0, 0.5, 0.5, 1, 1], 4, "repeated at most 1 times"),
        (1, [0, 0, np.nan, 1, 1], 3, "finite"),
    ],
)
def test_unusable_knots_are_refused_in_one_line(degree, knots, count, text):
    with pytest.raises(SplineError, match=text) as error:
        BSpline(degree, knots, np.zeros((count, 1)))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: BSpline(1, [0, 0, 1, 1], [[0.0], [1.0]])(1.1), r"outside \[0, 1\]"),
        (lambda: clamped_knots(2, [0.0, 0.5, 0.5, 1.0]), "increasing"),
        (lambda: start_control_points(3, clamped_knots(3, [0.0, 1.0]), [0.0], None, [1.0]), "without a vel"),
    ],
)
def test_misuse_is_refused(make, text):
    with pytest.raises(SplineError, match=text):
        make()


def test_arrays_cannot_be_written_to():
    curve = BSpline(1, [0, 0, 1, 1], [[0.0], [1.0]])
    with pytest.raises(ValueError, match="read-only"):
        curve.control_points[0] = 2.0
