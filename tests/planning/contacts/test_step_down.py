"""Stepping down as far as people do: the rear heel rises before the rear foot leaves."""

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.body.limbs import hinge_line, toe_hinge
from manikin.contact import ContactModel, SolePart, sole, sole_part
from manikin.planning.contacts.contact_plan import ContactPlan, Stage
from manikin.planning.contacts.posture_finder import PostureFinder
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


def test_a_foot_comes_down_farther_on_its_toes():
    """0.74 m down beside the other one, which carries: not flat, but with the heel up by 8 to 55 degrees."""
    body, height = human(1.75, 79.0, "male"), 0.74
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    upper = sole("left_foot", (0.0, 0.0, height), **size)
    lower = sole("right_foot", (0.0, -0.25, 0.0), **size)
    block = Obstacle("block", Box((3.0, 1.0, height)), translation=(0.0, 0.39, 0.5 * height))
    finder, start = PostureFinder(body, Scene([block], 0.0)), np.array(body.standing_posture())
    start[1:3] += -0.1, 0.4 * height
    carrying, found = {"left_foot": upper}, []
    for foot in (lower, sole_part(lower, SolePart.TOES, hinge_line(body, "right_foot"))):
        held = {**carrying, "right_foot": foot}
        found.append(finder.pose(held, carrying, start, start[:7], restarts=True).q)
    assert found[0] is None
    assert found[1] is not None
    state, toes = Configuration(body, found[1]), toe_hinge(body, "right_foot")
    rotation, position = state.effector_placement("right_foot")
    assert 8.0 < np.rad2deg(np.arcsin(-rotation[2, 0])) < 55.0
    np.testing.assert_allclose(position + rotation @ toes, lower.position + toes, atol=1e-3)


@pytest.fixture(scope="module")
def on_toes():
    """A plan with one step 0.40 m down: the lower foot lands on its toes, the upper one leaves from them."""
    body, height = human(1.62, 60.0, "female"), 0.40
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    upper = sole("left_foot", (-0.5 * body.sole_length, 0.1, height), **size)
    lower = sole("right_foot", (0.5 * body.sole_length, -0.08, 0.0), **size)
    left, right = (sole_part(foot, SolePart.TOES, hinge_line(body, foot.effector)) for foot in (upper, lower))
    q, both = body.standing_posture(), {"left_foot": upper, "right_foot": lower}
    stages = [
        Stage.of(body, {"left_foot": upper}, q, 1.0),
        Stage.of(body, both, q, 2.0, tilted=(right,)),
        Stage.of(body, {"right_foot": lower}, q, 1.0, tilted=(left,)),
    ]
    return ContactPlan.of(body, stages, q)


def test_feet_tilt_within_the_phases_that_they_share(on_toes):
    """The phase on both feet is divided and as long as before; the keys are where stages begin."""
    schedule = on_toes.schedule(ContactModel())
    parts = [{contact.effector: contact.part for contact in phase.stance} for phase in schedule.sequence]
    toes, full = SolePart.TOES, SolePart.FULL
    assert parts == [
        {"left_foot": full},
        {"left_foot": full, "right_foot": toes},
        {"left_foot": full, "right_foot": full},
        {"left_foot": toes, "right_foot": full},
        {"right_foot": full},
    ]
    begins = schedule.instants[list(schedule.sequence.begins)]
    whole = [stage.min_duration for stage in on_toes.stages]
    np.testing.assert_allclose(np.diff([*begins, schedule.instants[-1]]), whole, atol=1e-12)
    np.testing.assert_array_equal(on_toes.keys(schedule)[0], [*begins, schedule.instants[-1]])
