"""The speed with which a body comes to rest on other contacts."""

import numpy as np
import pytest

from manikin.balance.capturability import momentum_to_rest
from manikin.balance.margin import stability_margins
from manikin.balance.wrench import pseudo_wrench, wrench_polytope
from manikin.contact import Stance, sole
from manikin.numerics.spatial import GRAVITY

FEET = Stance([
    sole("left_foot", (0.0, 0.09, 0.0), length=0.26, width=0.10, friction=0.7),
    sole("right_foot", (0.0, -0.09, 0.0), length=0.26, width=0.10, friction=0.7),
])  # fmt: skip
REST = np.array([0.0, 0.0, 0.95])


@pytest.mark.parametrize("behind", [0.02, 0.05])
def test_speed_carries_the_centre_of_mass_over_the_feet(behind):
    """The instant at which a contact is left is balanced, by a polytope about the centre of mass itself."""
    com = np.array([-0.13 - behind, 0.0, 0.6])
    found = momentum_to_rest(FEET, 70.0, com, REST)
    assert found.velocity[0] > 0.0
    polytope = wrench_polytope(FEET.bounded(70.0))
    wrench = pseudo_wrench(70.0, com, found.acceleration, None, polytope.reference)
    assert stability_margins(polytope, wrench, com).wrench >= found.margin - 1e-6
    # The extrapolated centre of mass (Hof 2008) is over the soles.
    assert com[0] + found.velocity[0] * np.sqrt(com[2] / GRAVITY) > -0.13


def test_no_speed_helps_too_far_behind_the_feet():
    assert momentum_to_rest(FEET, 70.0, np.array([-0.40, 0.0, 0.6]), REST) is None


def test_no_speed_is_asked_for_over_the_feet():
    found = momentum_to_rest(FEET, 70.0, np.array([-0.05, 0.0, 0.6]), REST)
    assert np.linalg.norm(found.velocity) == 0.0
