"""Reflection of postures."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import BodyModel, Configuration, human, random_configuration
from manikin.body.limbs import mirrored, mirrored_hinges, mirrored_name
from manikin.errors import BodyError

BODY = human()
REFLECTION = np.diag([1.0, -1.0, 1.0])


@pytest.mark.parametrize("seed", range(5))
def test_reflected_kinematics(seed):
    """The centre of mass and every effector of the reflected posture are the reflected ones."""
    q = random_configuration(BODY, np.random.default_rng(seed))
    state, other = Configuration(BODY, q), Configuration(BODY, mirrored(BODY, q))
    np.testing.assert_allclose(other.com, REFLECTION @ state.com, atol=1e-12)
    for name in BODY.effectors:
        turn, place = state.effector_placement(name)
        turned, placed = other.effector_placement(mirrored_name(name))
        np.testing.assert_allclose(placed, REFLECTION @ place, atol=1e-12)
        np.testing.assert_allclose(turned, REFLECTION @ turn @ REFLECTION, atol=1e-12)


def test_twice_is_none():
    rng = np.random.default_rng(7)
    q = np.array([random_configuration(BODY, rng) for _ in range(4)])
    np.testing.assert_array_equal(mirrored(BODY, mirrored(BODY, q)), q)


def test_ranges_are_those_of_the_other_side():
    """A posture within the limits stays within them."""
    indices, factors = mirrored_hinges(BODY)
    ends = np.sort(factors * np.array([BODY.lower[indices], BODY.upper[indices]]), axis=0)
    np.testing.assert_allclose(ends, [BODY.lower, BODY.upper])


def test_misuse():
    with pytest.raises(BodyError, match="posture has shape"):
        mirrored(BODY, np.zeros(3))
    arm = BODY.segment("left_hand")
    one_sided = BodyModel("one-sided", (BODY.segments[0], replace(arm, parent="pelvis")), {})
    with pytest.raises(BodyError, match="no counterpart"):
        mirrored(one_sided, one_sided.zero_posture())
