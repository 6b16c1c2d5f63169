"""Into a car, from the first step to both hands on the wheel."""

import numpy as np
import pytest

import manikin
from manikin.motion.file import read_motions
from manikin.scenarios import load_scenario


@pytest.mark.slow
def test_getting_into_a_car_is_planned_and_executed_to_the_last_column(runs):
    result = runs("car-ingress")
    summary = result.summary
    assert summary["proved"], summary["failure"]
    assert summary["wholebody"]["max_torque_share"] <= 1.0  # of the mean man, the impact on the seat included
    # Qiu (2012), 7.2.2 and Table 7.6.
    assert summary["centroidal"]["min_margin"] >= 18.7
    assert summary["centroidal"]["duration_s"] <= 4.56
    execution = summary["execution"]
    assert not execution["fell"]
    assert execution["min_margin"] > 0.0
    assert execution["max_penetration_m"] < 0.01
    assert result.execution.touches == ()
    schedule = read_motions(result.directory / "motion.h5").schedule
    assert len(schedule.sequence) == 12
    last = schedule.sequence[11].stance
    assert set(last.effectors) == {"left_foot", "right_foot", "left_hand", "right_hand", "buttocks"}
    # The seat carries most of the weight at the end, the hands hardly any.
    names = list(result.executed.contact_names)
    force = result.executed.contact_force[-1, :, 2]
    assert force[names.index("buttocks")] > 0.5 * 79.0 * 9.81
    assert np.abs(force[[names.index("left_hand"), names.index("right_hand")]]).max() < 150.0


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
