"""Walks in scenarios that are executed: to a goal, to supports, and what is refused."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.errors import ScenarioError
from manikin.pipeline.runner import run
from manikin.scenarios import load_scenario


def test_a_walk_to_a_goal_behind_is_executed():
    """The body turns round and arrives; feet stand beside the goal."""
    result = run("stroll@behind")
    assert result.succeeded, result.summary["failure"]
    assert result.summary["execution"]["max_penetration_m"] < 5e-3
    motion = result.executed
    assert motion.time[0] == 0.0
    np.testing.assert_allclose(motion.com[-1, :2], [-1.0, 1.0], atol=0.06)
    ahead = pin.XYZQUATToSE3(motion.q[-1, :7]).rotation[:2, 0]
    assert np.degrees(np.arctan2(ahead[1], ahead[0])) == pytest.approx(150.0, abs=5.0)


@pytest.mark.long
@pytest.mark.slow
def test_the_walk_to_the_platform_ends_in_the_first_posture_of_its_plan(runs):
    """No planned sample is farther from the one before than its velocities explain, at the seam neither."""
    result = runs("walk-and-platform", overrides=(*runs.shorter_by("walk-and-platform"), "execution=none"))
    assert result.succeeded
    assert result.planned is not None
    motion, body = result.planned, load_scenario("platform").build_body()
    step = np.diff(motion.time)[:, None]
    moved = np.array([
        pin.difference(body.pinocchio, a, b) for a, b in zip(motion.q[:-1], motion.q[1:], strict=True)
    ])  # fmt: skip
    mean = 0.5 * (motion.v[1:] + motion.v[:-1])
    # At 5 ms the trapezoid rule is wrong by j dt^3 / 12; the walk has jerks of some 1e4 where feet land.
    assert np.abs(moved - step * mean).max() < 1e-3
    seam = int(np.argmax(np.diff(motion.time) < 0.002))
    assert np.abs(moved[seam - 3 : seam + 3]).max() < 1e-4


def test_a_walk_that_would_meet_a_wall_says_what_and_when():
    """Between long walls 0.52 m apart shoulders fit, arms do not; nothing is executed."""
    wall = "{{name: {}, box: [9, 0.1, 2], position: [1, {}, 1]}}"
    walls = f"[{wall.format('left', 0.31)}, {wall.format('right', -0.31)}]"
    changed = [f"scene={walls}", "walking.room_m=0.0", "task.goal={at: [2, 0], heading_deg: 0}"]
    result = run("stroll", overrides=changed)
    failure = result.summary["failure"]
    assert failure["stage"] == "walk"
    assert "arm from" in failure["where"] or "hand from" in failure["where"]
    assert 0.0 < failure["time_s"] < result.summary["walk"]["motion_s"]
    assert result.executed is None


@pytest.mark.parametrize(
    ("name", "override", "words"),
    [
        ("platform", "walking={}", "walking.start"),
        ("stroll", "walking.start={at: [0, 0]}", "walking.start"),
        ("walk-and-platform", "walking.whole_body=recorded", "none for a recorded walk"),
        ("stroll", "contacts={}", "contacts"),
        ("walk-and-platform", "walking.start.at=[0.0, 0.0]", "already is"),
        ("walk-and-platform", "supports.phases.0.left_foot=null", "left_foot"),
    ],
)
def test_what_cannot_be_walked_is_refused(name, override, words):
    with pytest.raises(ScenarioError, match=words) as caught:
        run(name, overrides=[override])
    assert "\n" not in str(caught.value)
