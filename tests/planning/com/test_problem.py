"""Problems, weights and geometric constraints check what they are given."""

import casadi as ca
import numpy as np
import pytest

from manikin.errors import InputError
from manikin.planning.com import BentSurface, GeometricConstraint, Weights, height_band


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"mass": -79.0}, "mass"),
        ({"mass": float("nan")}, "mass"),
        ({"start_com": (0.0, 0.0)}, "start_com"),
        ({"goal_com": (0.0, np.inf, 0.9)}, "goal_com"),
        ({"degree": 2}, "degree is 2; valid: an integer >= 3"),
        ({"degree": 4.5}, "degree"),
        ({"samples": 1}, "samples"),
        ({"margin_space": "torque"}, "valid: wrench, force, wrench_about_origin"),
        ({"required_margin": -1.0}, "required_margin"),
        ({"support_distance": 0.0}, "support_distance"),
        ({"max_duration": -1.0}, "max_duration"),
        ({"goal_velocity": (1.0, "fast", 0.0)}, "goal_velocity"),
    ],
)
def test_bad_input_is_refused_in_one_line_that_names_it(platform, changes, text):
    with pytest.raises(InputError, match=text) as error:
        platform(**changes)
    assert "\n" not in str(error.value)


def test_negative_weights_are_refused():
    with pytest.raises(InputError, match="weight margin"):
        Weights(margin=-1.0)
    with pytest.raises(InputError, match="weights jerk"):
        Weights(jerk=(1.0, -1.0, 0.0))


def test_vectors_cannot_be_written_to(platform):
    with pytest.raises(ValueError, match="read-only"):
        platform().start_com[0] = 1.0


def test_band_has_the_published_heights():
    """[Qiu2012]_ 5.29 and the heights printed in 5.4.4 to three digits."""
    upper, lower = BentSurface(0.91, 0.08, 10.0, 0.2), BentSurface(0.89, 0.08, 10.0, 0.2)
    assert upper(0.0) == pytest.approx(0.938, abs=5e-4)
    assert upper(0.6) == pytest.approx(0.876, abs=5e-4)
    assert lower(0.0) == pytest.approx(0.918, abs=5e-4)
    assert lower(0.6) == pytest.approx(0.856, abs=5e-4)


@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_constraints_have_the_same_value_on_numbers_and_symbols():
    below, above = height_band(BentSurface(0.89, 0.08, 10.0, 0.2), BentSurface(0.91, 0.08, 10.0, 0.2))
    positions = np.random.default_rng(0).normal(size=(20, 3))
    for constraint in (below, above):
        symbols = ca.SX.sym("p", 3)
        function = ca.Function("f", [symbols], [constraint.function(*ca.vertsplit(symbols))])
        expected = [float(function(p)) for p in positions]
        assert np.allclose(constraint.violation(positions), expected, atol=1e-14)


def test_a_constant_constraint_is_one_value_per_position():
    constraint = GeometricConstraint("always", lambda x, y, z: -1.0)  # noqa: ARG005
    assert np.array_equal(constraint.violation(np.zeros((4, 3))), [-1.0] * 4)


def test_band_is_violated_outside_only():
    below, above = height_band(BentSurface(0.8, 0.0, 1.0, 0.0), BentSurface(1.0, 0.0, 1.0, 0.0))
    heights = np.array([[0, 0, 0.7], [0, 0, 0.9], [0, 0, 1.1]])
    assert np.allclose(below.violation(heights), [0.1, -0.1, -0.3])
    assert np.allclose(above.violation(heights), [-0.3, -0.1, 0.1])
