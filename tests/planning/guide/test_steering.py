"""Local planners: symmetric, and true to the condition along the whole way."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.planning.guide import NO_MARGINS, Condition, ReachabilityChecker, root_pose
from manikin.planning.guide.root_pose import between
from manikin.planning.guide.steering import LocalPlanner, Way
from manikin.scene import Box, Obstacle, Scene

pose = st.tuples(
    st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(0.13, 0.45), *[st.floats(-3.1, 3.1)] * 3
).map(lambda c: root_pose(c[:3], rotation_from_rpy(*c[3:])))
POST = Obstacle("post", Box((0.3, 0.3, 1.0)), translation=(0.0, 0.0, 0.5))


@pytest.fixture(scope="module")
def planner(bug):
    return LocalPlanner(ReachabilityChecker(bug, Scene([POST]), Condition.limbs(at_least=2)))


def dense(planner, points, count=200):
    """Whether the plain condition holds at many poses of each straight part."""
    shares = np.linspace(0.0, 1.0, count)
    return all(planner.plain.holds(at) for a, b in itertools.pairwise(points) for at in between(a, b, shares))


@given(first=pose, second=pose, share=st.floats(0.05, 0.95))
def test_local_planner_is_symmetric_and_true(planner, first, second, share):
    """Both ends give the same answer, and what is joined holds wherever it is looked at."""
    if not (planner.holds(first) and planner.holds(second)):
        return
    assert planner.straight(first, second) == planner.straight(second, first)
    way = planner.connect(first, second, share)
    back = planner.connect(second, first, 1.0 - share)
    assert (way is None) == (back is None)
    if way is not None:
        assert back is not None
        assert (way.turn_at is None) == (back.turn_at is None)
        assert dense(planner, planner.waypoints(first, second, way.turn_at))


def test_turning_on_the_spot_passes_where_turning_on_the_way_does_not(bug):
    """A slot lets the creature through lengthwise only: turn first, then go."""
    scene = Scene(
        [
            Obstacle("left", Box((1.0, 1.0, 1.0)), translation=(0.5, 0.62, 0.5)),
            Obstacle("right", Box((1.0, 1.0, 1.0)), translation=(0.5, -0.62, 0.5)),
        ]
    )
    planner = LocalPlanner(ReachabilityChecker(_plank(bug), scene))
    first = root_pose((-0.8, 0.0, 0.3), rotation_from_rpy(0.0, 0.0, np.pi / 2))
    second = root_pose((1.2, 0.0, 0.3))
    assert planner.checker.explain(first) is None
    assert planner.checker.explain(second) is None
    assert not planner.straight(first, second)
    way = planner.connect(first, second, 0.05)
    assert way == Way(0.05)
    assert dense(planner, planner.waypoints(first, second, way.turn_at))


def _plank(bug):
    from manikin.planning.guide import Abstraction, TrunkShape

    return Abstraction((TrunkShape("trunk/plank", "box", (0.7, 0.1, 0.1)),), bug.limbs)


def test_margins_are_waived_near_the_ends_of_the_task_only(bug):
    """Where both limbs barely reach the floor, the plain condition counts near an end of the task."""
    lowest = min(limb.vertices[:, 2].min() for limb in bug.limbs)
    barely = root_pose((1.0, 1.0, -lowest - 0.01))
    checker = ReachabilityChecker(bug, Scene([POST]), Condition.limbs(at_least=2))
    assert not checker.holds(barely)
    assert ReachabilityChecker(bug, Scene([POST]), checker.condition, NO_MARGINS).holds(barely)
    lower = root_pose((1.0, 1.0, 0.3))
    assert not LocalPlanner(checker).holds(barely)
    near = LocalPlanner(checker, (barely,))
    assert near.holds(barely)
    assert near.straight(barely, lower)
    assert not LocalPlanner(checker, (root_pose((-1.0, -1.0, 0.3)),)).holds(barely)


def test_a_planner_needs_margins(planner):
    with pytest.raises(InputError, match="margins > 0"):
        LocalPlanner(planner.plain)


def test_a_way_seen_from_the_other_end_is_itself_again():
    assert Way(None).reversed() == Way(None)
    assert Way(0.25).reversed() == Way(0.75)
