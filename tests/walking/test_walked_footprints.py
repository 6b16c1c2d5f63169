"""Footprints of walks from the library: where and when their feet stand."""

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking import StepRule, walk_along, walked_footprints, walking_path
from manikin.walking.footprints import FEET
from manikin.walking.stepper import SIDE, within_reach

START = (0.0, 0.0, 0.0)
WAYS = {"straight": ((3.0, 0.0, 0.0), 0.6), "curved": ((2.0, 2.0, np.pi / 2), 0.5),
        "sideways": ((0.0, 1.2, 0.0), 0.3)}  # fmt: skip


@pytest.fixture(scope="module", params=WAYS)
def way(request):
    goal, speed = WAYS[request.param]
    return goal, walk_along(walking_path(START, goal, max_speed=speed))


def test_feet_stand_when_they_do_in_the_walk(way):
    """At most a frame longer; there is a double support around every landing."""
    _, walk = way
    found, frame = walked_footprints(walk), walk.time[1]
    for column, foot in enumerate(FEET):
        held = np.any([(walk.time >= s.lands) & (walk.time < s.leaves) for s in found.of(foot)], axis=0)
        more = held[:-1].astype(int) - walk.support[:-1, column]
        assert more.min() == 0
        assert more.sum() <= len(found.of(foot))
    assert found.end - found.start == pytest.approx(walk.time[-1])
    counts = [len(stance) for stance, _ in found.phases()]
    assert counts == [2, 1] * found.count + [2]
    assert min(seconds for _, seconds in found.phases()) >= frame - 1e-9


def test_feet_lead_from_start_to_goal_within_the_limits_of_the_hips(way):
    goal, walk = way
    found, rule = walked_footprints(walk, height=0.1), StepRule()
    for held, place in ((found.first(), START), (found.last(), goal)):
        middle = np.mean([step.position for step in held.values()], axis=0)
        # The rule moves feet by up to 2 cm each at the ends.
        assert np.hypot(*(middle[:2] - np.array(place[:2]))) < 0.02
        assert middle[2] == pytest.approx(0.1)
    # Those at the start are two; then each is beside the one before it of the other foot.
    placed = [np.append(step.position[:2], step.yaw) for step in found.steps]
    for number, step in enumerate(found.steps[1:], start=1):
        other = max(i for i in range(number) if found.steps[i].effector != step.effector)
        reached = within_reach(placed[number], placed[other], SIDE[step.effector], rule)
        assert np.allclose(reached, placed[number], atol=1e-9)


def test_fast_sidesteps_that_fly_are_refused():
    walk = walk_along(walking_path(START, WAYS["sideways"][0], max_speed=0.6))
    with pytest.raises(InputError, match=r"walk has no foot on the floor at .* s; valid here: a slower one"):
        walked_footprints(walk)
