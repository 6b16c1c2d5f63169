"""Arithmetic expressions: exact values, CasADi, and nothing but arithmetic."""

import math
import pickle

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import ScenarioError
from manikin.scenarios.expressions import FUNCTIONS, Expression

BAND = "0.91 - 0.08*atan(10*(x-0.2))/pi"


def test_height_band_has_the_published_values():
    """[Qiu2012]_ 5.4.4 prints 0.938 m at x = 0 and 0.876 m at x = 0.6 (three digits)."""
    band = Expression(BAND)
    np.testing.assert_allclose(band(np.array([0.0, 0.6]), 0.0, 0.0), [0.938, 0.876], atol=5e-4)


def test_a_copy_for_another_process_has_the_same_values():
    copy = pickle.loads(pickle.dumps(Expression(BAND)))
    assert copy(0.3, 0.0, 0.0) == Expression(BAND)(0.3, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 ** 3 ** 2", 512.0),
        ("-x ** 2", -0.25),
        ("min(x, y) + max(x, y)", 1.25),
        ("abs(-z) + +z", 3.8),
        ("atan2(y, x) / pi", math.atan2(0.75, 0.5) / math.pi),
        ("e**x - exp(x)", 0.0),
        ("sqrt(x*x) + arctan(0) + log(e)", 1.5),
        ("tanh(x) - sinh(x)/cosh(x)", 0.0),
    ],
)
def test_arithmetic(text, value):
    # Elementary functions of libm are exact to a few units in the last place.
    assert Expression(text)(0.5, 0.75, 1.9) == pytest.approx(value, abs=1e-14)


@given(st.lists(st.floats(0.1, 0.9), min_size=3, max_size=3), st.sampled_from(FUNCTIONS))
def test_casadi_and_numpy_agree_on_every_function(values, function):
    arguments = "x, y" if function in ("atan2", "arctan2", "min", "max") else "x"
    expression = Expression(f"{function}({arguments}) * z + y / x - 1.5**y")
    symbols = [casadi.SX.sym(name) for name in "xyz"]
    compiled = casadi.Function("f", symbols, [expression(*symbols)])
    # Both use the same C library or one within a few units in the last place.
    assert float(compiled(*values)) == pytest.approx(float(expression(*values)), rel=1e-13)


def test_casadi_derivative_is_the_analytic_one():
    x = casadi.SX.sym("x")
    slope = casadi.Function("slope", [x], [casadi.jacobian(Expression(BAND)(x, 0.0, 0.0), x)])
    assert float(slope(0.3)) == pytest.approx(-0.08 / math.pi * 10 / (1 + 1.0**2), rel=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')", "x.real", "(lambda: 1)()", "[1][0]", "x if y else z", "x < y",
        "open('f')", "w + 1", "1j", "True", "'a'", "x, y", "x := 1", "sin(x, y)", "atan2(x)", "sin(x=1)",
        "x @ y", "x // y", "x % y", "~x", "", "x +", "sin", "f'{x}'", "max(*[x, y])", "x" + " + x" * 400,
        "(" * 300 + "x", "-" * 900 + "x",
    ],
)  # fmt: skip
def test_anything_but_arithmetic_is_refused_in_one_line(text):
    with pytest.raises(ScenarioError) as caught:
        Expression(text)
    assert "\n" not in str(caught.value)
    assert "valid" in str(caught.value)


def test_huge_powers_end_at_infinity_instead_of_never():
    with np.errstate(over="ignore"):
        assert np.isinf(Expression("9**9**9**9")(0.0, 0.0, 0.0))
