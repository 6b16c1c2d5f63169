"""Into a car: what is refused, and how planning is stricter; ``benchmarks/sweep_scenarios.py`` gets in."""

import pytest

import manikin
from manikin.scenarios import load_scenario


@pytest.mark.parametrize(
    ("variant", "cause"),
    [("slippery", "friction of 0.05 is too low"), ("wheel-out-of-reach", "right_hand, out of reach")],
)
def test_what_nobody_can_do_is_explained(variant, cause):
    result = manikin.run("car-ingress", variant=variant)
    assert not result.succeeded
    assert cause in result.summary["failure"]["reason"]


def test_planning_has_smaller_soles_less_friction_and_weaker_hands_than_the_execution():
    scenario = load_scenario("car-ingress")
    planned, real = scenario.build_sequence(planning=True), scenario.build_sequence()
    for ours, theirs in zip(planned, real, strict=True):
        for contact in ours.stance:
            other = theirs.stance[contact.effector]
            assert contact.same_place(other)
            assert contact.max_force <= other.max_force
            if "foot" in contact.effector:
                assert (contact.length, contact.width) == pytest.approx((0.24, 0.09))
                assert (other.length, other.width) == pytest.approx((0.26, 0.10))
                assert contact.friction < other.friction
