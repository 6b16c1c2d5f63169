"""Stepping down as far as people do: the rear heel rises before the rear foot leaves."""

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.body.limbs import hinge_line, toe_hinge
from manikin.contact import SolePart, sole, sole_part
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.planning.contacts.walk_search import LANDING_INSETS
from manikin.scene import Box, Obstacle, Scene


@pytest.mark.parametrize(("stature", "sex"), [(1.75, "male"), (1.62, "female")])
def test_the_body_rests_on_the_lower_foot_with_the_upper_one_on_its_toes(stature, sex):
    """0.45 m down, the feet 0.36 m apart: over the lower foot, the rear heel up by 8 to 55 degrees."""
    body, height = human(stature, 23.0 * stature**2, sex), 0.45
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    edge = 0.5 * body.sole_length
    upper = sole("left_foot", (-edge - 0.005, 0.1, height), **size)
    lower = sole("right_foot", (edge + 0.04, -0.08, 0.0), **size)
    on_toes = sole_part(upper, SolePart.TOES, hinge_line(body, "left_foot"))
    ledge = Obstacle("ledge", Box((2.0, 2.0, height)), translation=(-1.0, 0.0, 0.5 * height))
    finder = PostureFinder(body, Scene([ledge]))
    start = np.array(body.standing_posture())
    start[2] += 0.3
    found = finder.pose(
        {"left_foot": on_toes, "right_foot": lower}, {"right_foot": lower}, start, restarts=True
    )
    assert found.q is not None, found.reason
    state = Configuration(body, found.q)
    rotation, position = state.effector_placement("left_foot")
    assert 8.0 < np.rad2deg(np.arcsin(-rotation[2, 0])) < 55.0
    toes = toe_hinge(body, "left_foot")
    np.testing.assert_allclose(position + rotation @ toes, upper.position + toes, atol=1e-3)
    assert abs(state.com[0] - lower.position[0]) < edge


def test_a_foot_comes_down_farther_where_the_body_rests_less_far_inside():
    """0.74 m down beside the other one: not with 4.5 cm between the weight and the edge, but with 1.5 cm."""
    body, height = human(1.75, 79.0, "male"), 0.74
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    upper = sole("left_foot", (0.0, 0.0, height), **size)
    lower = sole("right_foot", (0.0, -0.25, 0.0), **size)
    block = Obstacle("block", Box((3.0, 1.0, height)), translation=(0.0, 0.39, 0.5 * height))
    finder, start = PostureFinder(body, Scene([block], 0.0)), np.array(body.standing_posture())
    start[1:3] += -0.1, 0.4 * height
    held, found = {"left_foot": upper, "right_foot": lower}, dict[float, bool]()
    for inset in (finder.settings.inset, LANDING_INSETS[-1]):
        posed = finder.pose(held, {"left_foot": upper}, start, start[:7], inset=inset, restarts=True)
        found[inset] = posed.q is not None
    assert list(found.values()) == [False, True]
