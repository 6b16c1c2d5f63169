"""Ways between postures on which parts of a body would pass through each other."""

import numpy as np
import pytest

from manikin.body import insect
from manikin.planning.contacts import PostureFinder
from manikin.scene import Scene

SWEEPS = {"left_middle_sweep": 1.0, "left_rear_sweep": -1.0}


@pytest.fixture(scope="module")
def finder():
    return PostureFinder(insect(), Scene())


def swept(body, angle):
    """Standing, the middle leg swept back and the rear one forward [rad]."""
    q, model = np.array(body.standing_posture()), body.pinocchio
    for name, sign in SWEEPS.items():
        q[model.joints[model.getJointId(name)].idx_q] += sign * angle
    return q


def test_legs_that_change_sides_cross(finder):
    """Legs of 1 cm that are swept past each other: named, whichever way it goes; not where they stay."""
    here, there = swept(finder.body, 0.0), swept(finder.body, 1.5)
    for way in ((here, there), (there, here), (here, here, there)):
        assert "left_middle" in finder.crossing(*way)
        assert "left_rear" in finder.crossing(*way)
    assert finder.crossing(here, swept(finder.body, 0.5)) == ""
    assert finder.crossing(here, here) == ""
