"""Contacts of a way that is crawled: balanced, free, within strength, and the same wherever the scene is."""

from itertools import pairwise

import numpy as np
import pytest

from manikin.balance.criteria import RestingTorques
from manikin.body import Configuration, human
from manikin.contact import Stance, point
from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.contacts import (
    CrawlSearch,
    Endpoints,
    Habit,
    PostureFinder,
    PostureFinderSettings,
    WalkSearch,
)
from manikin.planning.contacts.crawl_postures import CRAWLERS, STYLES, on_all_fours
from manikin.scene import Box, Obstacle, Scene

BODY = human(1.75, 75.0, "male")
HANDS = {"left_wrist", "right_wrist"}


def tunnel(height, length=0.2, side=0.45, yaw=0.0):
    """A wall with a hole, 0.9 m ahead, behind which is a tunnel."""
    turn = rotation_from_yaw(yaw)

    def box(name, x, y, z):
        low, high = np.array([x, y, z]).T
        return Obstacle(name, Box(tuple(high - low)), rotation=turn, translation=turn @ (0.5 * (low + high)))

    x = (0.9, 0.9 + length)
    return Scene([
        box("left", x, (side, 6.0), (0.0, 2.0)), box("right", x, (-6.0, -side), (0.0, 2.0)),
        box("top", x, (-side, side), (height, 2.0)),
    ])  # fmt: skip


def prepared(scene, away, yaw=0.0, body=BODY):
    finder = PostureFinder(body, scene)
    ends = Endpoints(finder, 0.7)
    heading = rotation_from_yaw(yaw)[:2, 0]
    start, goal = (ends.find(far * heading, yaw, Habit.STANDING).stage for far in (0.0, away))
    return CrawlSearch(finder, ends, start, goal, 0.7, lambda a, b: WalkSearch(finder, a, b).run())


def searched(scene, away, yaw=0.0, body=BODY):
    return prepared(scene, away, yaw, body).run()


def test_a_tunnel_is_crawled_through_whatever_its_heading(checked):
    scene = tunnel(0.65, yaw=0.6)
    found = searched(scene, 1.9, 0.6)
    assert found.failure is None
    held = [set(stage.contacts) for stage in found.plan.stages]
    assert set(CRAWLERS) in held
    assert held[0] == held[-1] == {"left_foot", "right_foot"}
    assert all(len(a ^ b) == 1 for a, b in pairwise(held))
    assert checked(BODY, scene, found.plan).verdict == "certified"
    kneeling = [stage.q[7:] for stage, names in zip(found.plan.stages, held, strict=True) if names & HANDS]
    assert np.abs(np.diff(kneeling, axis=0)).max() < np.radians(100.0)  # no arm turns over
    # The weight passes from three limbs to other three with little swaying, and nobody gets up on stiff legs.
    across = rotation_from_yaw(0.6)[:2, 1]
    crawled = [stage for stage in found.plan.stages if stage.contacts.keys() <= set(CRAWLERS)]
    assert max(abs(float(across @ stage.com[:2])) for stage in crawled) < 0.04
    knees = [7 + BODY.joint_index(f"{side}_knee_flexion") for side in ("left", "right")]
    squatting = [stage for stage, names in zip(found.plan.stages, held, strict=True) if len(names) == 3]
    bent = [stage.q[knees].min() for stage in squatting if {"left_foot", "right_foot"} <= set(stage.contacts)]
    assert len(bent) == 2
    assert min(bent) > np.radians(45.0)


@pytest.mark.parametrize(
    "body", [BODY, human(1.55, 50.0, "female"), human(1.9, 100.0, "male")], ids=["mean", "small", "tall"]
)
def test_hands_under_nearly_straight_arms_carry_with_little_strength(body):
    """On the ends of upright hands, 0.19 m higher, elbows would have to bend aside under the load."""
    q = on_all_fours(body, PostureFinderSettings()).q
    state = Configuration(body, q)
    held = [point(name, state.effector_placement(name)[1], friction=0.7) for name in CRAWLERS]
    assert np.abs([contact.position[2] for contact in held]).max() < 1e-3
    assert RestingTorques(body, q, Stance(held)).share < 0.3
    assert q[7 + body.joint_index("left_elbow_flexion")] < np.radians(70.0)


@pytest.mark.parametrize(
    "body", [BODY, human(1.55, 50.0, "female"), human(1.9, 100.0, "male")], ids=["mean", "small", "tall"]
)
def test_a_lower_way_to_crawl_has_sloped_thighs_a_lower_pelvis_and_is_not_too_hard(body):
    """Thighs make the height of a pelvis on knees; the arms then carry more, within their strength."""
    pelvis, hips = [], []
    for style in STYLES:
        q = on_all_fours(body, PostureFinderSettings(), style).q
        state = Configuration(body, q)
        held = [point(name, state.effector_placement(name)[1], friction=0.7) for name in CRAWLERS]
        assert RestingTorques(body, q, Stance(held)).share < 0.9
        pelvis.append(q[2])
        hips.append(q[7 + body.joint_index("left_hip_flexion")])
    assert (np.diff(pelvis) < -0.03).all()
    assert (np.diff(hips) < np.radians(-5.0)).all()


@pytest.mark.parametrize(
    ("height", "first"),
    [pytest.param(0.65, 0, marks=pytest.mark.long), pytest.param(0.58, 1, marks=pytest.mark.long), (0.52, 2)],
)
def test_the_ways_to_crawl_that_have_room_are_tried_first(monkeypatch, height, first):
    tried = []

    def none(_self, _way, _down, _up, style, _gait):
        tried.append(style)
        return "refused"

    monkeypatch.setattr(CrawlSearch, "_on_hands_and_knees", none)
    found = searched(tunnel(height), 1.9)
    assert found.failure == "refused"
    assert list(dict.fromkeys(tried)) == [*STYLES[first:], *STYLES[:first]]


@pytest.mark.long
def test_a_crawl_that_a_later_stage_refuses_is_planned_in_another_way():
    """Another gait for a phase on hands and knees, another way up for one behind; nothing for a walk."""
    search = prepared(tunnel(0.65), 1.9)
    first = search.run().plan

    def phases(plan, holds):
        return [k for k, stage in enumerate(plan.stages) if holds(set(stage.contacts))]

    def stood(plan):
        """Places of knees and hands that the body is on [m]."""
        return [
            stage.contacts[name].position
            for stage in plan.stages if stage.contacts.keys() == set(CRAWLERS) for name in CRAWLERS
        ]  # fmt: skip

    crawled = phases(first, lambda held: held < set(CRAWLERS))
    assert search.refuse(crawled[len(crawled) // 2])
    second = search.run().plan
    assert np.shape(stood(second)) != np.shape(stood(first)) or not np.allclose(stood(second), stood(first))
    rising = phases(second, lambda held: bool(held & {"left_foot", "right_foot"}) and bool(held & HANDS))
    assert search.refuse(rising[-1])
    third = search.run().plan
    changes = [
        [set(stage.contacts) for stage in plan.stages[-8:]] + [plan.stages[-8].q.round(3).tolist()]
        for plan in (second, third)
    ]
    assert changes[0] != changes[1]
    assert not search.refuse(len(third.stages))


def test_a_tunnel_that_is_too_low_is_told_at_once():
    found = searched(tunnel(0.3), 1.9)
    assert found.plan is None
    assert found.failure == "no way over the ground has room for the body on hands and knees"
    assert found.searches == 0


@pytest.mark.parametrize(("share", "walks"), [(0.53, False), (0.57, True)])
def test_who_cannot_fold_so_low_does_not_walk_there(share, walks):
    """People fold to 0.55 of their stature; below 0.53 a walk is walled off at once."""
    scene = tunnel(share * 1.75, length=0.6)
    finder = PostureFinder(BODY, scene)
    ends = Endpoints(finder, 0.7)
    start, goal = (ends.find(np.array([far, 0.0]), 0.0, Habit.STANDING).stage for far in (0.0, 2.3))
    assert (WalkSearch(finder, start, goal).search.walled_off() is None) == walks


@pytest.mark.parametrize(("stature", "mass"), [(1.81, 94.1), (1.91, 115.9)])
def test_a_broad_trunk_is_lifted_off_the_thighs_as_the_hands_leave(stature, mass):
    """Chest and thighs lie on each other there; by the straight way one was up to 3 cm in the other."""
    body = human(stature, mass, "female")
    size = stature / 1.75
    found = searched(tunnel(0.68 * size, side=0.5), 2.1 * size, body=body)
    assert found.failure is None
    finder, stages = PostureFinder(body, Scene([])), found.plan.stages
    ends = [*(stage.q for stage in stages[1:]), found.plan.goal]
    for stage, q in zip(stages, ends, strict=True):
        way = [stage.q, q] if stage.via is None else [stage.q, stage.via, q]
        assert finder.crossing(*way) == ""
