"""A person whose file bounds the centre of mass by nothing bends no more than the task asks for."""

import numpy as np
import pytest

from manikin.planning.com import plan_com
from manikin.scenarios import load_scenario
from manikin.scenarios.problems import BEND

STANDING = 0.55 * 1.75
"""Height of the standing person's CoM [m], to 2 cm."""


@pytest.fixture(scope="module")
def problem():
    """The built-in platform without what its file says of the centre of mass and of planning."""
    return load_scenario(
        "platform", overrides=["com_constraints=[]", "planning=null"]
    ).build_centroidal_problem()


def test_regions_end_below_what_supports_and_roof_allow(problem):
    lowest = [-region.offsets[region.normals[:, 2] < -1.0 + 1e-9].min() for region in problem.regions]
    # On the floor before the roof nothing but the legs asks for bending.
    assert lowest[0] == pytest.approx((1.0 - BEND) * STANDING, abs=0.06)
    # On the platform the roof does; the goal, 0.66 m above it, is given.
    assert 0.5 < lowest[-1] - 0.2 < 0.66
    assert {item.name for item in problem.geometric} == {"height below 'roof'"}


def test_a_plan_does_not_dip_where_the_legs_could_not_hold_it(problem):
    """A low centre of mass has larger margins: without the bound it went down to 0.5 m on one foot."""
    found = plan_com(problem)
    assert found.succeeded
    time = np.linspace(0.0, found.trajectory.duration, 500)
    on_floor = time < found.key_instants[4]
    assert found.trajectory.position(time)[on_floor, 2].min() > 0.72
