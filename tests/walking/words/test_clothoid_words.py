"""Words of three clothoid arcs: they lead to the goal, and are extremal or not."""

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.errors import InputError

sys.path.append(str(Path(__file__).parents[3] / "docs"))

from clothoid_words import clothoid_words


@settings(max_examples=10)
@given(st.floats(-2.0, 2.0), st.floats(3.0, 9.0), st.floats(0.0, 6.28))
def test_words_lead_to_the_goal_without_curvature(x, y, heading):
    for one in clothoid_words((x, y, heading))[:4]:
        states = one.states()
        assert np.allclose(states[-1, :2], (x, y), atol=1e-9)
        assert abs(np.angle(np.exp(1j * (states[-1, 2] - heading)))) < 1e-9
        assert abs(states[-1, 3]) < 1e-9
        assert one.lengths[1] == pytest.approx(one.lengths[0] + one.lengths[2])


def test_rates_ascend():
    rates = [one.rate for one in clothoid_words((1.0, 5.0, 2.0))]
    assert rates
    assert all(a <= b for a, b in itertools.pairwise(rates))


def test_a_lane_change_has_its_closed_form():
    """A small shift by d over the length l: y = -d by a quarter, a half, a quarter, so c = 32 d / l^3."""
    shift, length = 0.02, 5.0
    best = clothoid_words((shift, length, np.pi / 2))[0]
    assert best.word == "DID"
    assert best.extremal
    assert best.lengths == pytest.approx(np.array([1.0, 2.0, 1.0]) * length / 4.0, rel=1e-3)
    assert best.rate == pytest.approx(32.0 * shift / length**3, rel=1e-3)


def test_mirrored_goals_have_mirrored_words():
    one, other = (clothoid_words(goal) for goal in ((0.7, 5.0, 1.2), (-0.7, 5.0, np.pi - 1.2)))
    assert [a.rate for a in one] == pytest.approx([a.rate for a in other])
    assert [a.extremal for a in one] == [a.extremal for a in other]


def test_goals_ahead_have_an_extremal_word_and_one_that_faces_back_has_none():
    assert clothoid_words((0.4, 6.0, 1.4))[0].extremal
    assert not any(one.extremal for one in clothoid_words((0.0, 9.0, -np.pi / 2)))


def test_a_goal_that_is_no_number_is_refused():
    with pytest.raises(InputError, match="finite"):
        clothoid_words((np.nan, 1.0, 0.0))
