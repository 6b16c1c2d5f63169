import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp
from manikin.control import Controller, ForceWish
from manikin.errors import InputError


def test_a_wished_force_rises_smoothly_and_is_held():
    wish = ForceWish("left_hand", (-100.0, 0.0, 0.0), 1.0, 0.5)
    np.testing.assert_array_equal(wish.at(0.9), np.zeros(3))
    np.testing.assert_allclose(wish.at(1.25), (-50.0, 0.0, 0.0))
    np.testing.assert_allclose(wish.at(3.0), (-100.0, 0.0, 0.0))


def test_a_ramp_of_no_time_is_refused():
    with pytest.raises(InputError, match="ramp"):
        ForceWish("left_hand", (1.0, 0.0, 0.0), 0.0, 0.0)


def test_the_controller_lets_a_hand_feel_the_wished_force(body, still, contacts):
    """A standing person who holds on with a hand is asked for 40 N there: within 1 N of it, at rest."""
    placed = np.array([0.3, 0.25, 1.0])
    stance = Stance([*contacts, grasp("left_hand", placed, max_force=200.0)])
    held = ContactSchedule(StanceSequence([Phase(stance)]), [0.0, float(still.time[-1])])
    wish = ForceWish("left_hand", (-40.0, 0.0, 0.0), 0.0, 0.1)
    output = Controller(body, still, held, wishes=[wish]).step(
        float(still.time[-1]), body.standing_posture(), np.zeros(body.nv)
    )
    before = Controller(body, still, held).step(
        float(still.time[-1]), body.standing_posture(), np.zeros(body.nv)
    )
    assert abs(before.wrenches["left_hand"][0] + 40.0) > 10.0
    np.testing.assert_allclose(output.wrenches["left_hand"][:3], (-40.0, 0.0, 0.0), atol=1.0)
