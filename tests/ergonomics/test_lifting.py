"""The lifting equation against the worked examples of its manual, in the manual's units."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human
from manikin.body.strength import carrying
from manikin.ergonomics.lift_of_motion import lift_of
from manikin.ergonomics.lifting import (
    COUPLING,
    HandPlace,
    Lift,
    composite_index,
    frequency_multiplier,
    lifting_index,
    multipliers,
)
from manikin.errors import InputError

from .conftest import posture, still

INCH, POUND = 0.025, 23.0 / 51.0
"""As the manual equates 10 in and 25 cm, 51 lb and 23 kg: its formulas in both units are one."""


def place(horizontal, vertical):
    return HandPlace(horizontal * INCH, vertical * INCH)


PUNCH_PRESS = Lift(44 * POUND, place(23, 15), place(23, 64), coupling="fair")
INSPECTION = Lift(26 * POUND, place(10, 22), place(20, 59), frequency=3.0, coupling="fair")


@pytest.mark.parametrize(
    ("lift", "end", "factors", "pounds", "index"),
    [
        # Waters et al. 1994, Example 1 (punch press stock) and Example 4 (package inspection): multipliers of
        # the worksheets in the order H, V, D, A, F, C, recommended weight and index of that end.
        (PUNCH_PRESS, "origin", (0.44, 0.89, 0.86, 1.0, 1.0, 0.95), 16.3, 2.7),
        (PUNCH_PRESS, "destination", (0.44, 0.75, 0.86, 1.0, 1.0, 1.0), 14.5, 3.0),
        (INSPECTION, "origin", (1.0, 0.94, 0.87, 1.0, 0.88, 0.95), 34.9, 0.7),
        (INSPECTION, "destination", (0.5, 0.78, 0.87, 1.0, 0.88, 1.0), 15.2, 1.7),
    ],
)
def test_worked_examples(lift, end, factors, pounds, index):
    """Multipliers, weights and indices are those that are printed, but for their rounding.

    The multipliers have two decimals (0.44 stands for 10/23): within 0.006. The printed weight is their
    product as printed, so that ours differs by what rounding costs, below 2.5 %.
    """
    found = multipliers(lift, getattr(lift, end))
    assert list(vars(found).values()) == pytest.approx(factors, abs=0.006)
    assert 51.0 * np.prod(factors) == pytest.approx(pounds, abs=0.06)
    assert lift.load / POUND / pounds == pytest.approx(index, abs=0.05)
    assert found.weight / POUND == pytest.approx(pounds, rel=0.025)


def test_the_lower_end_counts_where_the_load_is_placed_with_care():
    found = lifting_index(INSPECTION)
    assert found.weight == min(found.origin.weight, found.destination.weight)
    free = lifting_index(replace(INSPECTION, control=False))
    assert free.weight == found.origin.weight
    assert found.index == pytest.approx(1.7, abs=0.05)


def test_composite_index_follows_the_formula_of_the_manual():
    """Section 2.4.5: CLI = 1.6 + 1.0 (1/.88 - 1/.94) + .67 (1/.70 - 1/.88) = 1.87.

    Of three lifts of 1, 2 and 4 per minute, weights without frequency of 40, 40 and 30 lb, loads of 60, 40
    and 20 lb, whose single indices are 1.6, 1.1 and 0.8.
    """

    def lift(load, weight, frequency):
        # All other multipliers are 1 at 75 cm and a travel of 25 cm.
        near = HandPlace(0.25 * 51.0 / weight, 0.75)
        return Lift(load * POUND, near, HandPlace(near.horizontal, 1.0), frequency, control=False)

    lifts = [lift(20, 30, 4.0), lift(60, 40, 1.0), lift(40, 40, 2.0)]
    assert sorted(lifting_index(one).index for one in lifts) == pytest.approx([0.79, 1.10, 1.60], abs=0.01)
    expected = 1.5 / 0.94 + 1.0 * (1 / 0.88 - 1 / 0.94) + 10 / 15 * (1 / 0.70 - 1 / 0.88)
    assert composite_index(lifts) == pytest.approx(expected, rel=1e-9)
    assert composite_index(lifts) == pytest.approx(1.87, abs=0.01)
    assert composite_index(lifts[:1]) == lifting_index(lifts[0]).index
    assert composite_index([replace(one, frequency=8.0) for one in lifts]) == np.inf


def test_limits_of_the_equation():
    """Tables 1 to 4 end at 63 cm, 175 cm, 175 cm and 135 degrees; nearer or shorter counts as 25 cm."""
    best = Lift(10.0, HandPlace(0.2, 0.75), HandPlace(0.2, 0.9))
    assert lifting_index(best).origin.weight == pytest.approx(23.0)
    for worse in (HandPlace(0.64, 0.75), HandPlace(0.3, 1.76), HandPlace(0.3, 0.75, np.deg2rad(136.0))):
        assert multipliers(best, worse).weight == 0.0
    assert lifting_index(replace(best, origin=HandPlace(0.64, 0.75))).index == np.inf
    assert multipliers(best, HandPlace(0.3, 0.75, np.deg2rad(90.0))).asymmetry == pytest.approx(0.712)
    assert multipliers(best, HandPlace(0.3, 0.0)).vertical == pytest.approx(0.775)


@pytest.mark.parametrize(
    ("frequency", "hours", "vertical", "factor"),
    [(0.0, 1.0, 0.5, 1.0), (0.2, 8.0, 1.0, 0.85), (2.4, 1.0, 0.5, 0.898), (13.0, 1.0, 0.5, 0.0),
     (13.0, 1.0, 0.75, 0.34), (8.0, 8.0, 0.5, 0.18), (9.0, 8.0, 0.5, 0.0), (12.0, 2.0, 0.8, 0.21)],
)  # fmt: skip
def test_frequency_multiplier(frequency, hours, vertical, factor):
    """Table 5 of the manual; 2.4 lifts per minute is between its rows (Example 7)."""
    assert frequency_multiplier(frequency, hours, vertical) == pytest.approx(factor)


@given(st.floats(0.2, 15.0), st.floats(0.2, 15.0), st.floats(0.0, 1.75))
def test_more_often_is_never_easier(one, other, vertical):
    low, high = sorted((one, other))
    for hours in (1.0, 2.0, 8.0):
        assert frequency_multiplier(low, hours, vertical) >= frequency_multiplier(high, hours, vertical)
    assert frequency_multiplier(low, 1.0, vertical) >= frequency_multiplier(low, 8.0, vertical)


def test_wrong_values_take_one_line():
    with pytest.raises(InputError, match="coupling is 'glue'; valid: good, fair, poor"):
        replace(PUNCH_PRESS, coupling="glue")
    with pytest.raises(InputError, match="hours of lifting"):
        replace(PUNCH_PRESS, hours=9.0)
    with pytest.raises(InputError, match="vertical of the hands"):
        HandPlace(0.3, -0.1)
    with pytest.raises(InputError, match="no lifts"):
        composite_index([])
    assert set(COUPLING) == {"good", "fair", "poor"}


def raised(body, *elbows, twist=0.0):
    """Frames with elbows bent, the trunk turned to the left."""
    return [
        posture(body, left_elbow_flexion=angle, right_elbow_flexion=angle, lumbar_rotation=twist)
        for angle in elbows
    ]


def test_the_lift_of_a_motion_has_the_heights_and_distances_of_the_hands():
    """Bending the elbows: where the palms are comes from the forward kinematics of the body."""
    body = carrying(human(), 12.0)
    frames = np.array(raised(body, 20.0, 45.0, 90.0))
    motion = still(body, frames, duration=1.0, rate=2.0)
    lift, instants = lift_of(body, motion, frequency=2.0, hours=2.0, coupling="unacceptable")
    for number, end in ((0, lift.origin), (2, lift.destination)):
        there = Configuration(body, frames[number])
        middle = np.mean([there.effector_placement(f"{side}_hand")[1] for side in ("left", "right")], axis=0)
        assert end.vertical == pytest.approx(
            middle[2] - there.effector_placement("left_foot")[1][2], abs=1e-9
        )
        assert end.horizontal == pytest.approx(abs(middle[0]), abs=0.02)  # the ankles are below the hips
        assert end.asymmetry == pytest.approx(0.0, abs=1e-6)
    assert lift.load == pytest.approx(12.0)
    assert (lift.frequency, lift.hours, lift.coupling) == (2.0, 2.0, "poor")
    assert instants == (0.0, 1.0)


def test_a_turned_trunk_makes_a_lift_asymmetric_and_a_moved_scene_does_not():
    """The feet say what is straight ahead: 10 degrees of the lumbar joint turn the arms by as much."""
    body = carrying(human(), 12.0)
    plain, twisted = (
        lift_of(body, still(body, np.array(raised(body, 30.0, 110.0, twist=twist)), duration=1.0, rate=1.0))[
            0
        ]
        for twist in (0.0, 10.0)
    )
    turned = twisted.destination.asymmetry - plain.destination.asymmetry
    assert np.rad2deg(turned) == pytest.approx(10.0, abs=1.5)
    frames = np.array(raised(body, 30.0, 110.0, twist=10.0))
    frames[:, :3] += [10.0, -3.0, 0.0]
    frames[:, 3:7] = [0.0, 0.0, np.sin(0.5), np.cos(0.5)]
    moved = lift_of(body, still(body, frames, duration=1.0, rate=1.0))[0]
    assert lifting_index(moved).weight == pytest.approx(lifting_index(twisted).weight, rel=1e-9)


def test_hands_between_the_feet_are_not_behind_the_body():
    """Within 10 cm of the ankles the direction of the hands means nothing: it counts as straight ahead."""
    body = carrying(human(), 12.0)
    frames = [
        posture(body, **{f"{side}_shoulder_flexion": -8.0 for side in ("left", "right")}),
        *raised(body, 100.0),
    ]
    lift, _ = lift_of(body, still(body, np.array(frames), duration=1.0, rate=1.0))
    assert lift.origin.horizontal < 0.1
    assert lift.origin.asymmetry == 0.0


def test_what_is_no_lift_is_refused():
    body = human()
    motion = still(body, np.array(raised(body, 0.0, 90.0)), duration=1.0, rate=1.0)
    with pytest.raises(InputError, match="nothing is in the hands"):
        lift_of(body, motion)
    with pytest.raises(InputError, match="the load is in one hand"):
        lift_of(carrying(body, 5.0, "left"), motion)
    stepping, walking = (np.array(raised(body, 20.0, 100.0)) for _ in range(2))
    for side in ("hip", "knee"):
        stepping[:, 7 + body.joint_index(f"left_{side}_flexion")] += np.deg2rad(60.0)
    walking[1, 0] += 1.5
    for frames, reason in (
        (stepping, "one foot is on a step"),
        (walking, "the person walks between the ends"),
    ):
        with pytest.raises(InputError, match=reason):
            lift_of(carrying(body, 5.0), still(body, frames, duration=1.0, rate=1.0))
    with pytest.raises(InputError, match="up and down by less than 25 cm"):
        lift_of(carrying(body, 5.0), still(body, body.standing_posture()))
