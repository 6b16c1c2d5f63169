"""Contacts on a ladder: where a climber's centre of mass is, and how long it has."""

from itertools import pairwise

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.body.limbs import limb_named
from manikin.contact import ContactKind, grasp, sole
from manikin.kinematics.limb_samples import sample_limbs
from manikin.kinematics.posture_terms import GRASPING
from manikin.pipeline.stages import RunContext
from manikin.pipeline.stages.contact_stage import HOLDING_ACCELERATION, find_supports
from manikin.planning.contacts import ContactRules, PostureFinder, limb_holds
from manikin.planning.contacts.limb_places import RUNG_SPACING
from manikin.planning.contacts.limb_search import FARTHEST_TURN
from manikin.planning.whole_body.certificate import RefineRequirements
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scene import Cylinder, Obstacle, Proximity, Scene
from manikin.scene.surface import HAND_BREADTH
from manikin.verification.holding import GRASPED


def planned(seed):
    """Task of a drawn ladder, and contacts for it."""
    context = RunContext.of(draw_scene(FAMILIES["ladders"], seed), None)
    found = find_supports(context.scenario, context.body, context.scene, np.random.default_rng(0))
    assert found.plan is not None, found.failure
    return context, found.plan


@pytest.fixture(scope="module")
def plan():
    """Down from the second rung of a ladder of round rungs."""
    context, found = planned(1310)
    return context.body, found


def test_a_climber_does_not_swing_back_to_move_a_hand(plan):
    """Its centre of mass stays within 5 cm of the way between those at both ends of the flight."""
    body, found = plan
    flights = 0
    for stage, after in pairwise(found.stages):
        moved = set(after.contacts) - set(stage.contacts)
        if stage.via is None or not any("hand" in name for name in moved):
            continue
        flights += 1
        way, via = after.com - stage.com, Configuration(body, stage.via).com - stage.com
        share = np.clip(via @ way / max(way @ way, 1e-9), 0.0, 1.0)
        assert np.linalg.norm(via - share * way) < 0.05
    assert flights > 0


def test_changes_take_the_time_of_a_gentle_motion(plan):
    """``T^2 >= 10 d / (sqrt(3) a)`` for the smoothest motion over ``d`` from rest to rest."""
    _, found = plan
    com = np.array([*(stage.com for stage in found.stages), found.goal_com])
    ways = np.linalg.norm(np.diff(com, axis=0), axis=1)
    for stage, way in zip(found.stages, ways, strict=True):
        assert 10.0 / np.sqrt(3.0) * way / stage.min_duration**2 <= HOLDING_ACCELERATION + 1e-9


@pytest.mark.parametrize("place", [(0.5, -0.1), (0.6, -0.1), (0.6, 0.0)])
def test_a_hand_is_round_a_stile_and_not_through_it(place):
    """The open hand that stands for closed fingers is no deeper than the check allows; it was 56 to 57 mm."""
    body, palm = human(1.75, 75.0), np.array([*place, 1.8])
    stile = Scene([Obstacle("stile", Cylinder(0.02, 2.4), translation=(*place, 1.25))])
    feet = {
        foot: sole(foot, (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
        for foot, y in (("left_foot", 0.1), ("right_foot", -0.1))
    }
    hand = grasp("right_hand", palm - [0.03, 0.0, 0.0], max_force=300.0)
    posed = PostureFinder(body, stile).pose({**feet, "right_hand": hand}, feet, body.standing_posture())
    assert posed.q is not None, posed.reason
    near = Proximity(body, stile).evaluate(posed.q, 0.1)
    depths = {one: d for (one, other), d in zip(near.pairs, near.distance, strict=True) if other == "stile"}
    assert -GRASPED < GRASPING <= min(depths.values()) < 0.0


@pytest.mark.long
def test_forearms_are_as_far_from_stiles_as_a_refined_motion_has_to_keep_them():
    """Its parts end in these postures; one with a forearm 1 mm beside a stile could not be kept."""
    context, found = planned(2418)
    near = Proximity(context.body, context.scene)
    rows = [near.evaluate(stage.q, 0.05) for stage in found.stages]
    pairs = [pair for row in rows for pair in zip(row.pairs, row.distance, strict=True)]
    arms = [d for (part, other), d in pairs if "forearm" in part and "stile" in other]
    assert arms
    assert min(arms) >= RefineRequirements().clearance


def test_places_of_a_foot_on_a_rung_are_close():
    """Two soles fit side by side between the stiles of any ladder; steps of 9 cm were too far."""
    body = human(1.57, 75.0, "female")
    limb = limb_named(body, "left_leg")
    samples = sample_limbs(body, np.random.default_rng(0), count=50)
    reference = np.array(body.standing_posture())
    ends = np.array([reference[:7], reference[:7]])
    for width in np.arange(0.35, 0.46, 0.01):
        rung = Obstacle(
            "rung", Cylinder(0.016, width), translation=(0.0, 0.0, 0.3),
            rotation=[[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        )  # fmt: skip
        rules = ContactRules(stiff=0.1)
        (holds,) = limb_holds(
            body, Scene([rung], None), [limb], {limb.name: ContactKind.SOLE}, rules, reference, samples, ends,
            1.0,
        )  # fmt: skip
        aside = np.unique(holds.positions[:, 1].round(6))
        assert np.diff(aside).max() <= RUNG_SPACING + 1e-5
        assert np.ptp(aside) > 0.1


def test_hands_hold_on_away_from_what_ends_their_room():
    """Half a hand and 5 cm from the next rung; at 3 cm, the end of the room, it could not turn round."""
    body = human(1.75, 75.0)
    limb = limb_named(body, "left_arm")
    samples = sample_limbs(body, np.random.default_rng(0), count=50)
    reference = np.array(body.standing_posture())
    ends = np.array([reference[:7], reference[:7]])
    stile = Obstacle("stile", Cylinder(0.02, 2.4), translation=(0.4, 0.0, 1.2))
    rungs = [
        Obstacle(
            f"rung_{k}", Cylinder(0.016, 0.4), translation=(0.4, 0.2, height),
            rotation=[[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        )
        for k, height in enumerate((0.75, 1.0, 1.25))
    ]  # fmt: skip
    scene = Scene([stile, *rungs], None)
    kinds = {limb.name: ContactKind.GRASP}
    (holds,) = limb_holds(body, scene, [limb], kinds, ContactRules(), reference, samples, ends, 0.75)
    on_stile = (np.abs(holds.positions[:, 1]) < 1e-6) & (np.abs(holds.positions[:, 2] - 1.0) < 0.25)
    heights = np.unique(holds.positions[on_stile, 2].round(4))
    assert len(heights) >= 4
    assert heights + heights[::-1] == pytest.approx(2.0, abs=0.02)
    assert np.abs(heights[:, None] - [0.75, 1.0, 1.25]).min() >= 0.5 * HAND_BREADTH + 0.05


@pytest.mark.long
@pytest.mark.parametrize("seed", [9936, 9937])
def test_hands_that_stay_turn_little_round_what_they_hold(seed):
    """Between two postures of one flight; they turned by up to 2.7 rad, through the next rung."""
    context, found = planned(seed)
    state = Configuration(context.body, found.stages[0].q)
    turns = []
    for stage in found.stages:
        if stage.via is None:
            continue
        for name, contact in stage.contacts.items():
            if contact.kind is ContactKind.GRASP:
                first, last = (
                    state.update(q).effector_placement(name)[0].copy() for q in (stage.q, stage.via)
                )
                turns.append(np.arccos(np.clip((np.trace(first.T @ last) - 1.0) / 2.0, -1.0, 1.0)))
    assert turns
    assert max(turns) <= FARTHEST_TURN
