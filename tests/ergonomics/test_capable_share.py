"""Share of people who have the strength for a torque."""

import numpy as np
import pytest

from manikin.body import human, insect
from manikin.body.strength import (
    ARM_VARIATION,
    HUMAN_STRENGTH,
    KNEE_VARIATION,
    VARIATION,
    carrying,
    hinge_strength,
    variation,
)
from manikin.ergonomics.capable_share import capable_share, capable_shares
from manikin.errors import BodyError, InputError

BODY = human()


def torques(**wanted):
    """(1, j) torques of single joints [N.m]."""
    tau = np.zeros((1, len(BODY.joint_names)))
    for name, torque in wanted.items():
        tau[0, BODY.joint_index(name)] = torque
    return tau


def test_normal_distribution():
    """Half of the people have the mean; one deviation less 84.1 %, 1.645 deviations more 5 %."""
    assert capable_share(100.0, 100.0, 25.0) == 0.5
    assert capable_share(75.0, 100.0, 25.0) == pytest.approx(0.8413, abs=1e-4)
    assert capable_share(100.0 + 1.6449 * 25.0, 100.0, 25.0) == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize(
    ("joint", "sign"), [("elbow_flexion", 1), ("elbow_flexion", -1), ("knee_flexion", -1)]
)
def test_a_torque_at_the_mean_of_a_group_is_what_half_of_it_has(sex, joint, sign):
    """By direction: the torque of the mean person of that sex, age and size, with or without a load."""
    against, along = hinge_strength(joint, BODY.mass, BODY.stature, sex, 50.0)
    tau = torques(**{f"left_{joint}": along if sign > 0 else -against})
    found = capable_shares(carrying(BODY, 20.0), tau, age=50.0)[sex]
    assert found.weakest == (f"left_{joint}", pytest.approx(0.5))
    assert np.sum(found.share < 1.0) == 1


def test_fewer_women_and_fewer_old_people_have_a_torque():
    tau = torques(right_elbow_flexion=50.0, lumbar_flexion=-150.0)
    young, old = (capable_shares(BODY, tau, age=age) for age in (25.0, 70.0))
    for group in (young, old):
        assert group["female"].weakest[1] < group["male"].weakest[1]
    for sex in ("male", "female"):
        assert old[sex].weakest[1] < young[sex].weakest[1]


def test_deviations_are_the_published_ones():
    assert variation("shoulder_abduction") == ARM_VARIATION == 0.277
    assert variation("knee_flexion") == KNEE_VARIATION == 0.189
    assert {variation(name) for name in HUMAN_STRENGTH} == {ARM_VARIATION, KNEE_VARIATION, VARIATION}


def test_other_bodies_and_ages_are_refused():
    creature = insect()
    with pytest.raises(BodyError, match="has a published strength; valid: a human"):
        capable_shares(creature, np.zeros((1, len(creature.joint_names))))
    with pytest.raises(InputError, match="age of the people"):
        capable_shares(BODY, torques(), age=120.0)
