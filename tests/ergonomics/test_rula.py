"""RULA: the published tables, their borders, and scores of postures."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import random_configuration
from manikin.ergonomics import (
    Circumstances,
    RulaSteps,
    assess_posture,
    bearing_of,
    postural_angles,
    rula_action_level,
    rula_score,
)
from manikin.ergonomics.rula_reba import TABLE_A, TABLE_B, TABLE_C, rula_force, rula_steps
from manikin.errors import InputError

from .conftest import mirrored, posture, still

SIZES = {"upper_arm": 6, "lower_arm": 3, "wrist": 4, "wrist_twist": 2, "neck": 6, "trunk": 6, "legs": 2}


def every_combination():
    """All 5184 postures at once."""
    grid = np.array(list(product(*(range(1, size + 1) for size in SIZES.values())))).T
    return dict(zip(SIZES, grid, strict=True))


def test_scores_run_from_one_to_seven():
    scores = rula_score(RulaSteps(**every_combination()))
    assert sorted(set(scores.tolist())) == [1, 2, 3, 4, 5, 6, 7]
    assert np.all(rula_score(RulaSteps(**every_combination()), muscle_arm=1, muscle_body=1, force=3) >= 3)


@pytest.mark.parametrize("step", SIZES)
def test_a_worse_step_never_lowers_the_score(step):
    steps = every_combination()
    worse = steps | {step: np.minimum(steps[step] + 1, SIZES[step])}
    assert np.all(rula_score(RulaSteps(**worse)) >= rula_score(RulaSteps(**steps)))


@pytest.mark.parametrize("table", [TABLE_A, TABLE_B, TABLE_C], ids=["A", "B", "C"])
def test_the_tables_do_not_fall_along_any_axis(table):
    for axis in range(table.ndim):
        assert np.all(np.diff(table, axis=axis) >= 0)


def test_one_or_two_needs_two_or_less_of_both_groups():
    """As the paper says of grand scores 1 and 2 (stage 3)."""
    rows, columns = np.nonzero(TABLE_C <= 2)
    assert max(rows.max(), columns.max()) == 1
    assert TABLE_C[:2, :2].max() == 2


def test_entries_of_the_published_tables():
    """Corners and single entries of Tables A, B and C as printed."""
    assert (TABLE_A[0, 0, 0, 0], TABLE_A[5, 2, 3, 1], TABLE_A[2, 1, 1, 0], TABLE_A[4, 0, 3, 1]) == (
        1,
        9,
        4,
        7,
    )
    assert (TABLE_B[0, 0, 1], TABLE_B[0, 1, 0], TABLE_B[3, 3, 1], TABLE_B[5, 5, 1]) == (3, 2, 7, 9)
    assert (TABLE_C[0, 0], TABLE_C[3, 3], TABLE_C[4, 5], TABLE_C[7, 0], TABLE_C[7, 6]) == (1, 4, 7, 5, 7)


def test_action_levels():
    assert rula_action_level(np.arange(1, 8)).tolist() == [1, 1, 2, 2, 3, 3, 4]


@pytest.mark.parametrize(
    ("load", "pattern", "score"),
    [
        (0, "intermittent", 0), (1.9, "static", 0), (2, "intermittent", 1), (10, "intermittent", 1),
        (2, "static", 2), (10.5, "intermittent", 2), (10.5, "static", 3), (1, "shock", 3),
    ],
)  # fmt: skip
def test_forces(load, pattern, score):
    assert rula_force(load, pattern) == score


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"neck": 7}, "neck score is 7; valid: whole numbers from 1 to 6"), ({"wrist": 0}, "wrist score is 0"),
     ({"trunk": 1.5}, "trunk score is 1.5"), ({"legs": np.nan}, "legs score is nan")],
)  # fmt: skip
def test_scores_out_of_their_range_are_refused(wrong, message):
    steps = dict.fromkeys(SIZES, 1) | wrong
    with pytest.raises(InputError, match=message):
        rula_score(RulaSteps(**steps))


def scored(body, given=None, contacts=("left_foot", "right_foot"), forces=None, **angles):
    """Step scores of the left side of a posture set by hand [deg]."""
    motion = still(body, posture(body, **angles), contacts=contacts, forces=forces)
    steps = rula_steps(postural_angles(body, motion.q), bearing_of(body, motion), given)["left"]
    return {name: int(values[0]) for name, values in vars(steps).items()}


@pytest.mark.parametrize(
    ("angles", "step", "score"),
    [
        ({}, "trunk", 1), ({"neck_flexion": 4}, "neck", 1), ({"neck_flexion": 10}, "neck", 1),
        ({"neck_flexion": 15}, "neck", 2), ({"neck_flexion": 21}, "neck", 3),
        ({"neck_flexion": -8}, "neck", 4),
        ({"neck_flexion": 15, "neck_rotation": 30}, "neck", 3),
        ({"neck_flexion": 15, "neck_rotation": 30, "neck_side_bend": 20}, "neck", 4),
        ({"thorax_rotation": 20}, "trunk", 2),
        ({"left_elbow_flexion": 59}, "lower_arm", 2), ({"left_elbow_flexion": 60}, "lower_arm", 1),
        ({"left_elbow_flexion": 100}, "lower_arm", 1), ({"left_elbow_flexion": 101}, "lower_arm", 2),
        ({"left_elbow_flexion": 90, "left_shoulder_rotation": 70}, "lower_arm", 2),
        ({"left_elbow_flexion": 90, "left_shoulder_rotation": -50}, "lower_arm", 2),
        ({"left_wrist_flexion": 10}, "wrist", 2), ({"left_wrist_flexion": -16}, "wrist", 3),
        ({"left_wrist_flexion": 10, "left_wrist_radial_deviation": 15}, "wrist", 3),
        ({"left_forearm_pronation": 40}, "wrist_twist", 1),
        ({"left_forearm_pronation": 70}, "wrist_twist", 2),
    ],
)  # fmt: skip
def test_steps_of_postures_set_by_hand(body, angles, step, score):
    assert scored(body, **angles)[step] == score


@pytest.mark.parametrize(("lean", "trunk"), [(4, 1), (15, 2), (40, 3), (75, 4)])
def test_a_bent_trunk(body, lean, trunk):
    """All of the body leans, so that the trunk's line leans by exactly as much."""
    q = posture(body)
    q[3:7] = [0.0, np.sin(np.deg2rad(lean) / 2), 0.0, np.cos(np.deg2rad(lean) / 2)]
    motion = still(body, q)
    steps = rula_steps(postural_angles(body, motion.q), bearing_of(body, motion))
    assert steps["left"].trunk[0] == trunk


def test_legs_need_both_feet_and_an_even_share(body):
    assert scored(body)["legs"] == 1
    assert scored(body, forces={"left_foot": 700.0, "right_foot": 75.0})["legs"] == 2
    assert scored(body, contacts=("right_foot",))["legs"] == 2


def test_a_hand_that_bears_weight_supports_the_arm(body):
    angles = {"left_shoulder_flexion": 60.0}
    contacts = ("left_foot", "right_foot", "left_hand")
    free = scored(body, **angles)["upper_arm"]
    assert scored(body, contacts=contacts, forces={"left_hand": 60.0}, **angles)["upper_arm"] == free - 1


def test_seated_upright_is_better_supported(body):
    seat = ("left_foot", "right_foot", "buttocks")
    assert scored(body, contacts=seat)["trunk"] == 2
    assert scored(body, Circumstances(trunk_supported=True), contacts=seat)["trunk"] == 1


@given(st.integers(0, 2**32 - 1), st.sampled_from(["none", "static", "load"]))
def test_mirroring_a_posture_swaps_the_sides(body, seed, what):
    given_ = {"none": None, "static": Circumstances(static=True), "load": Circumstances(load_kg=12.0)}[what]
    q = random_configuration(body, np.random.default_rng(seed))[None]
    one, other = (assess_posture(body, still(body, each), given_) for each in (q[0], mirrored(body, q)[0]))
    for name in ("rula", "reba"):
        here, there = getattr(one, name), getattr(other, name)
        assert np.array_equal(here.sides["left"], there.sides["right"])
        assert np.array_equal(here.score, there.score)


def test_a_posture_held_for_a_minute_costs_a_point(body):
    """Found from the motion where it is long enough, told where it is not."""
    q = body.standing_posture()
    long, short = still(body, q, duration=90.0, rate=4.0), still(body, q, duration=5.0)
    plain, told = assess_posture(body, short), assess_posture(body, short, Circumstances(static=True))
    found = assess_posture(body, long)
    assert (plain.rula.static_known, found.rula.static_known) == (False, True)
    assert np.all(found.rula.score == told.rula.score[0])
    assert found.rula.score[0] > plain.rula.score[0]
    assert found.reba.score[0] == plain.reba.score[0] + 1


def test_only_the_arm_that_is_held_costs_a_point(body):
    """One arm waves for two minutes while the other and the trunk are still; what moves is not static."""
    motion = still(body, body.standing_posture(), duration=120.0, rate=5.0)
    q = np.array(motion.q)
    q[:, 7 + body.joint_index("left_elbow_flexion")] += 0.4 * np.sin(motion.time)
    from dataclasses import replace

    from manikin.ergonomics.assessment import held

    angles = postural_angles(body, replace(motion, q=q).q)
    assert not held(motion.time, angles.arm("left")).any()
    assert held(motion.time, angles.arm("right")).all()


def test_a_minute_is_found_where_it_is():
    """Still from 20 s to 85 s of 120 s, moving before and after (to the sampling of 0.2 s)."""
    from manikin.ergonomics.assessment import held

    time = np.linspace(0.0, 120.0, 1201)
    angle = np.where(time < 20.0, np.sin(time), np.where(time > 85.0, np.cos(time), 2.0))
    found = time[held(time, angle[:, None])]
    assert found[0] == pytest.approx(20.0, abs=0.3)
    assert found[-1] == pytest.approx(85.0, abs=0.3)
