import numpy as np
import pytest

from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY
from manikin.planning.push_pull import Act


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.2), (0.0, 0.0, 0.0)])
def test_a_direction_that_is_not_level_is_refused(direction):
    with pytest.raises(InputError, match="direction"):
        Act("push", "cupboard", direction, 100.0)


def test_hands_are_pushed_against_the_act_and_feet_along_it_and_up(body):
    """The reaction on the hands opposes the act (T-3); the ground gives the act's force and the weight."""
    act = Act("pull", "rope", (-2.0, 0.0, 0.0), 200.0)
    np.testing.assert_allclose(act.hand_task(("left_arm",)).reaction_on("left_arm"), (1.0, 0.0, 0.0))
    weight = body.mass * GRAVITY
    wanted = np.array([-200.0, 0.0, weight]) / np.hypot(200.0, weight)
    np.testing.assert_allclose(act.foot_task(body).reaction_on("left_leg"), wanted, atol=1e-12)
    assert act.hand_heuristic().pulling
    np.testing.assert_allclose(act.facing, (1.0, 0.0, 0.0))
