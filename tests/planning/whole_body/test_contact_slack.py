"""Linear programs for the balance of a stance, against its polytope and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.balance import wrench_polytope
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, point, sole
from manikin.planning.whole_body.refine_physics import contact_slack

FEET = [
    sole("left_foot", (0.0, 0.1, 0.0), length=0.28, width=0.12, friction=0.7),
    sole("right_foot", (0.1, -0.1, 0.03), yaw=0.1, length=0.28, width=0.12, friction=0.7),
]
STANCES = {
    "feet": FEET,
    "foot": FEET[:1],
    "hand on a table": [*FEET, point("left_hand", (0.4, 0.3, 0.9), normal=(0.0, 0.3, 0.95), friction=0.5)],
    "grasp": [*FEET, grasp("left_hand", (0.4, 0.3, 1.0), max_force=150.0, max_moment=10.0)],
    "grasp without moment": [FEET[0], grasp("left_hand", (0.4, 0.3, 1.0), max_force=150.0)],
    "three points": [
        point(f"leg_{k}", (np.cos(2.1 * k), np.sin(2.1 * k), 0.1 * k), friction=0.8) for k in range(3)
    ],
}  # fmt: skip


def schedule_of(contacts, cap=1500.0):
    return ContactSchedule(StanceSequence([Phase(Stance(contacts, cap))]), [0.0, 1.0])


@pytest.mark.parametrize("name", STANCES)
@settings(max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_slack_and_margin_have_one_sign(name, seed):
    rng = np.random.default_rng(seed)
    schedule = schedule_of(STANCES[name])
    spread = np.array([80.0, 80.0, 300.0, 60.0, 60.0, 20.0])
    wrench = np.array([0.0, 0.0, 750.0, 30.0, -30.0, 0.0]) + rng.normal(size=(30, 6)) * spread
    slack = contact_slack(schedule, np.linspace(0.0, 1.0, 30), wrench)
    margin = wrench_polytope(schedule.sequence[0].stance).margin(wrench)
    clear = np.abs(margin) > 1e-6
    np.testing.assert_array_equal(slack[clear] > 0.0, margin[clear] > 0.0)


def test_the_cap_on_the_sum_of_normal_forces_bounds_the_slack():
    """Upright on two soles with 10 N to spare, nothing else is nearer its limit."""
    wrench = np.array([[0.0, 0.0, 990.0, 0.0, 0.0, 0.0]])
    feet = [
        sole(f"{side}_foot", (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
        for side, y in (("left", 0.1), ("right", -0.1))
    ]
    assert contact_slack(schedule_of(feet, 1000.0), np.zeros(1), wrench) == pytest.approx(10.0)


def test_too_few_contacts_have_no_slack_at_all():
    wrench = np.array([[0.0, 0.0, 750.0, 20.0, 0.0, 0.0]])
    hand = [grasp("left_hand", (0.4, 0.3, 1.0), max_force=1000.0)]
    assert contact_slack(schedule_of(hand), np.zeros(1), wrench)[0] == -np.inf
    assert contact_slack(schedule_of([]), np.zeros(1), wrench)[0] == -np.inf
