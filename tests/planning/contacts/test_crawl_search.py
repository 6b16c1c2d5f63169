"""Contacts of a way that is crawled: balanced, free, within strength, and the same wherever the scene is."""

from itertools import pairwise

import numpy as np

from manikin.body import human
from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.contacts import CrawlSearch, Endpoints, Habit, PostureFinder, WalkSearch
from manikin.scene import Box, Obstacle, Scene

BODY = human(1.75, 75.0, "male")
CRAWLERS = {"left_fist", "right_fist", "left_knee", "right_knee"}


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


def searched(scene, away, yaw=0.0):
    finder = PostureFinder(BODY, scene)
    ends = Endpoints(finder, 0.7)
    heading = rotation_from_yaw(yaw)[:2, 0]
    start, goal = (ends.find(far * heading, yaw, Habit.STANDING).stage for far in (0.0, away))
    return CrawlSearch(finder, ends, start, goal, 0.7, lambda a, b: WalkSearch(finder, a, b).run()).run()


def test_a_tunnel_is_crawled_through_whatever_its_heading(checked):
    scene = tunnel(0.65, yaw=0.6)
    found = searched(scene, 1.9, 0.6)
    assert found.failure is None
    held = [set(stage.contacts) for stage in found.plan.stages]
    assert CRAWLERS in held
    assert held[0] == held[-1] == {"left_foot", "right_foot"}
    assert all(len(a ^ b) == 1 for a, b in pairwise(held))
    assert checked(BODY, scene, found.plan).verdict == "certified"


def test_a_tunnel_that_is_too_low_is_told_at_once():
    found = searched(tunnel(0.3), 1.9)
    assert found.plan is None
    assert found.failure == "no way over the ground has room for the body on hands and knees"
    assert found.searches == 0
