"""The criterion: its weights, the direction of the goal, and the integrands."""

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking import LITERAL_ORDER, PROSE_ORDER, WalkObjective
from manikin.walking.path.walking_model import cost_rates, goal_direction

GOAL = np.array([1.0, 2.0, 0.3])


def test_both_orders_hold_the_published_numbers():
    """[Truong2010]_ 5.8: 1, 1.2, 1.7, 0.7, 5.2; by (5.5) u_2 is angular, by the text it is lateral."""
    assert PROSE_ORDER.weights.tolist() == [1.0, 1.2, 1.7, 0.7, 5.2]
    assert LITERAL_ORDER.weights.tolist() == [1.0, 1.2, 0.7, 1.7, 5.2]
    assert PROSE_ORDER.lateral / PROSE_ORDER.forward == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(
    ("offset", "heading", "psi"),
    [
        ((-2.0, 0.0), 0.0, 0.0),
        ((0.0, -2.0), 0.0, np.pi / 2),
        ((2.0, 0.0), np.pi / 2, np.pi / 2),
        ((2.0, -0.1), 0.0, np.pi - np.arctan(0.05)),
        ((-2.0, 0.0), 4 * np.pi + 0.1, -0.1),
    ],
)
def test_goal_direction_is_counted_from_the_heading_within_half_a_turn(offset, heading, psi):
    place = np.array([[GOAL[0] + offset[0], GOAL[1] + offset[1], heading]])
    assert goal_direction(place, GOAL)[0] == pytest.approx(psi)


def test_goal_term_fades_to_one_half_at_its_distance_and_to_nothing_at_the_goal():
    objective = WalkObjective(goal_fade=0.2)
    places = np.array([[1.0 - 0.2, 2.0, np.pi / 2], [1.0 - 20.0, 2.0, np.pi / 2], [1.0, 2.0, np.pi / 2]])
    rates = cost_rates(places, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), GOAL, objective)[:, 4]
    square = (np.pi / 2) ** 2
    assert rates == pytest.approx([square / 2, square, 0.0], rel=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"lateral": 0.0}, "walking weight lateral is 0; valid: a finite number > 0"),
        ({"goal": -1.0}, "walking weight goal is -1; valid: a finite number >= 0"),
        ({"forward": float("nan")}, "walking weight forward is nan; valid: a finite number > 0"),
        ({"goal_fade": 0.0}, "walking weight goal fade is 0; valid: a finite number > 0"),
    ],
)
def test_bad_weights_are_refused_in_one_line(given, message):
    with pytest.raises(InputError) as caught:
        WalkObjective(**given)
    assert str(caught.value) == message
