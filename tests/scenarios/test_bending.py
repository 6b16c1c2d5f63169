"""A person whose file bounds the centre of mass by nothing bends no more than the task asks for."""

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.kinematics import PostureProblem, generate_posture
from manikin.planning.com import plan_com
from manikin.scenarios import load_scenario
from manikin.scenarios.problems import BEND

STATURE = 1.60
STANDING = 0.55 * STATURE
"""Height of the standing person's CoM [m], to 2 cm."""


@pytest.fixture(scope="module")
def scenario():
    """The built-in platform for a woman, less friction, without what its file says of CoM and planning."""
    settings = ["com_constraints=[]", "planning=null", "supports.friction=0.5"]
    return load_scenario("platform", overrides=settings).with_body(STATURE, 58.0, "female")


@pytest.fixture(scope="module")
def problem(scenario):
    return scenario.build_centroidal_problem()


@pytest.fixture(scope="module")
def found(problem):
    return plan_com(problem)


def test_regions_end_below_what_supports_and_roof_allow(problem):
    lowest = [-region.offsets[region.normals[:, 2] < -1.0 + 1e-9].min() for region in problem.regions]
    # On the floor before the roof nothing but the legs asks for bending.
    assert lowest[0] == pytest.approx((1.0 - BEND) * STANDING, abs=0.06)
    # On the platform the roof does; the goal above it is given.
    assert 0.5 / 1.75 * STATURE < lowest[-1] - 0.2 < problem.goal_com[2] - 0.2
    assert {item.name for item in problem.geometric} == {"height below 'roof'"}


def test_a_plan_does_not_dip_where_the_legs_could_not_hold_it(found):
    """A low centre of mass has larger margins: without the bound it went down to 0.5 m on one foot."""
    assert found.succeeded
    time = np.linspace(0.0, found.trajectory.duration, 500)
    on_floor = time < found.key_instants[4]
    assert found.trajectory.position(time)[on_floor, 2].min() > 0.72 / 1.75 * STATURE


def test_at_every_change_of_contact_some_posture_has_the_planned_centre_of_mass(scenario, found):
    """It holds the stances before and after, to 2 mm, within the ranges of the joints."""
    body, q = scenario.build_body(), None
    stances = [phase.stance for phase in scenario.build_sequence()]
    for key, time in enumerate(found.key_instants):
        held = {c.effector: c for stance in stances[max(key - 1, 0) : key + 1] for c in stance}
        com = found.trajectory.position(np.array([time]))[0]
        problem = PostureProblem(body, tuple(held.values()), com=com)
        posture = generate_posture(problem, body.standing_posture() if q is None else q)
        state, q = Configuration(body, posture.q), posture.q
        assert np.all((q[7:] >= body.lower) & (q[7:] <= body.upper))
        assert np.linalg.norm(state.com - com) <= 2e-3
        for name, contact in held.items():
            assert np.linalg.norm(state.effector_placement(name)[1] - contact.position) <= 2e-3
