"""Postures of a quadruped whose tips stand beside and on blocks."""

import numpy as np
import pytest

from manikin.body import Configuration, quadruped
from manikin.contact import point
from manikin.numerics.polytope import convex_polygon, signed_distance
from manikin.pipeline.stages import RunContext
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scene import Box, Obstacle, Scene

BODY = quadruped(0.75, 26.0)
STANDING = np.array(BODY.standing_posture())
HEIGHT = 0.19


def tips(**moved):
    """Contacts of the standing body, some of them moved by (3,)."""
    state = Configuration(BODY, STANDING)
    at = {limb.effector: np.array(state.effector_placement(limb.effector)[1]) for limb in BODY.limbs}
    return {name: point(name, place + moved.get(name, 0.0), friction=0.7) for name, place in at.items()}


def block(front):
    """A step across the way whose front face is at x [m]."""
    return Obstacle("block", Box((1.0, 1.2, HEIGHT)), translation=(front + 0.5, 0.0, 0.5 * HEIGHT))


def test_a_tip_needs_its_clearance_beside_what_it_does_not_touch():
    held = tips()["left_front_tip"]
    foot = BODY.segment("left_front_foot").shapes[-1].size[0]
    finder = PostureFinder(BODY, Scene())
    least = finder.settings.clearance + foot
    for away, clears in ((least - 1e-3, False), (least + 1e-3, True)):
        scene = Scene([block(held.position[0] + away)], 0.0)
        assert PostureFinder(BODY, scene).clears(held) is clears


@pytest.mark.parametrize("ahead", [-0.2, 0.0, 0.2])
def test_the_inner_place_is_halfway_to_the_middle_of_the_support(ahead):
    held = tips()
    staying = {name: contact for name, contact in held.items() if name != "left_rear_tip"}
    finder, guide = PostureFinder(BODY, Scene((), 0.0)), STANDING[:7].copy()
    guide[0] += ahead
    corners = np.array([contact.position[:2] for contact in staying.values()])
    hull, inset = convex_polygon(corners), finder.settings.inset
    com = Configuration(BODY, STANDING).com
    outer = finder.resting_place(staying, np.array([com[0] + ahead, com[1]]), inset)
    inner = finder.inner_place(staying, guide)
    assert inner is not None
    assert outer is not None
    assert min(signed_distance(inner, hull), signed_distance(outer, hull)) > 0.9 * inset
    np.testing.assert_allclose(inner, 0.5 * (outer + corners.mean(axis=0)), atol=1e-6)


@pytest.mark.long
def test_steep_stairs_need_few_postures():
    """Three steps of 0.19 m for legs 0.5 m long.

    Legs come up onto steps from inside them, and the body rests away from the edge of a narrow support.
    Without either, hundreds of moves were refused, or there were no contacts.
    """
    context = RunContext.of(draw_scene(FAMILIES["quadruped-stairs"], 2502), None)
    result = find_supports(context.scenario, context.body, context.scene, np.random.default_rng(0))
    assert result.plan is not None, result.failure
    assert result.summary["backtracks"] <= 10
