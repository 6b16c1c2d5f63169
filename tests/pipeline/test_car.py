"""Into a car, from the first step to both hands on the wheel."""

import pytest

import manikin
from manikin.motion.file import read_motions
from manikin.scenarios import load_scenario


@pytest.mark.slow
def test_getting_into_a_car_is_planned_within_the_strength_and_its_touch_is_told(runs):
    """Planned within every joint's strength; the executed upper arm touches the wheel, and that is said."""
    result = runs("car-ingress")
    summary = result.summary
    assert summary["planned"]
    assert summary["wholebody"]["max_torque_share"] <= 1.0
    assert summary["failure"]["stage"] == "execution"
    assert "right_upper_arm touches wheel" in summary["failure"]["reason"]
    # Qiu (2012), 7.2.2 and Table 7.6.
    assert summary["centroidal"]["min_margin"] >= 15.6
    assert summary["centroidal"]["duration_s"] <= 4.56
    assert not summary["execution"]["fell"]
    schedule = read_motions(result.directory / "motion.h5").schedule
    assert len(schedule.sequence) == 12
    last = schedule.sequence[11].stance
    assert set(last.effectors) == {"left_foot", "right_foot", "left_hand", "right_hand", "buttocks"}


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
