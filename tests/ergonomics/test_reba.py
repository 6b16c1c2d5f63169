"""REBA: the published tables, their borders, and scores of postures."""

from itertools import product

import numpy as np
import pytest

from manikin.ergonomics import RebaSteps, bearing_of, postural_angles, reba_action_level, reba_score
from manikin.ergonomics.rula_reba import (
    COUPLINGS,
    REBA_TABLE_A,
    REBA_TABLE_B,
    REBA_TABLE_C,
    reba_load,
    reba_steps,
)
from manikin.errors import InputError

from .conftest import posture, still

SIZES = {"trunk": 5, "neck": 3, "legs": 4, "upper_arm": 6, "lower_arm": 2, "wrist": 3}


def every_combination():
    """All 2160 postures at once."""
    grid = np.array(list(product(*(range(1, size + 1) for size in SIZES.values())))).T
    return dict(zip(SIZES, grid, strict=True))


def test_scores_run_from_one_to_fifteen():
    steps = RebaSteps(**every_combination())
    assert (reba_score(steps).min(), reba_score(steps, load=3, coupling=3, activity=3).max()) == (1, 15)
    every = [reba_score(steps, load=load, activity=load) for load in range(4)]
    assert sorted(set(np.concatenate(every).tolist())) == list(range(1, 16))


@pytest.mark.parametrize("step", SIZES)
def test_a_worse_step_never_lowers_the_score(step):
    steps = every_combination()
    worse = steps | {step: np.minimum(steps[step] + 1, SIZES[step])}
    assert np.all(reba_score(RebaSteps(**worse)) >= reba_score(RebaSteps(**steps)))


@pytest.mark.parametrize("table", [REBA_TABLE_A, REBA_TABLE_B, REBA_TABLE_C], ids=["A", "B", "C"])
def test_the_tables_do_not_fall_along_any_axis(table):
    for axis in range(table.ndim):
        assert np.all(np.diff(table, axis=axis) >= 0)


def test_the_tables_have_room_for_what_is_added():
    """Nine and three make the twelve rows and columns of Table C."""
    assert (REBA_TABLE_A.max() + 3, REBA_TABLE_B.max() + 3) == REBA_TABLE_C.shape


def test_a_worked_example():
    """Neck, trunk and legs 2 with a bent wrist: scores A 4, B 3 (other side 2), C 4 on both sides.

    The example of the package ergonomics-metrics (its README), worked there by the published sheet.
    """
    both = {"trunk": 2, "neck": 2, "legs": 2, "upper_arm": 1, "lower_arm": 2}
    assert REBA_TABLE_A[1, 1, 1] == 4
    assert (REBA_TABLE_B[0, 1, 2], REBA_TABLE_B[0, 1, 1]) == (3, 2)
    assert [int(reba_score(RebaSteps(**both, wrist=wrist))) for wrist in (3, 2)] == [4, 4]


def test_action_levels():
    wanted = [0, 1, 1, 2, 2, 2, 2, 3, 3, 3, 4, 4, 4, 4, 4]
    assert reba_action_level(np.arange(1, 16)).tolist() == wanted


def test_loads_and_couplings():
    loads = [(4.9, "static"), (5, "intermittent"), (10.5, "intermittent"), (0, "shock"), (11, "shock")]
    assert [reba_load(*load) for load in loads] == [0, 1, 2, 1, 3]
    assert [COUPLINGS.index(name) for name in ("good", "fair", "poor", "unacceptable")] == [0, 1, 2, 3]


@pytest.mark.parametrize("wrong", [{"legs": 5}, {"neck": 0}])
def test_scores_out_of_their_range_are_refused(wrong):
    with pytest.raises(InputError, match="valid: whole numbers from 1 to"):
        reba_score(RebaSteps(**dict.fromkeys(SIZES, 1) | wrong))
    with pytest.raises(InputError, match="activity score is 4"):
        reba_score(RebaSteps(**dict.fromkeys(SIZES, 1)), activity=4)


def scored(body, lean=0.0, contacts=("left_foot", "right_foot"), **angles):
    """Step scores of the left side of a posture set by hand, all of it leaning [deg]."""
    q = posture(body, **angles)
    q[3:7] = [0.0, np.sin(np.deg2rad(lean) / 2), 0.0, np.cos(np.deg2rad(lean) / 2)]
    motion = still(body, q, contacts=contacts)
    steps = reba_steps(postural_angles(body, motion.q), bearing_of(body, motion))["left"]
    return {name: int(values[0]) for name, values in vars(steps).items()}


@pytest.mark.parametrize(
    ("lean", "angles", "step", "score"),
    [
        (3, {}, "trunk", 1), (15, {}, "trunk", 2), (-15, {}, "trunk", 2), (-30, {}, "trunk", 3),
        (45, {}, "trunk", 3), (70, {}, "trunk", 4), (70, {"thorax_rotation": 20}, "trunk", 5),
        (0, {"neck_flexion": 15}, "neck", 1), (0, {"neck_flexion": 25}, "neck", 2),
        (0, {"neck_flexion": -10, "neck_side_bend": 15}, "neck", 3),
        (0, {"left_knee_flexion": 29}, "legs", 1), (0, {"right_knee_flexion": 45}, "legs", 2),
        (0, {"right_knee_flexion": 61}, "legs", 3),
        (0, {"left_wrist_flexion": 15}, "wrist", 1), (0, {"left_wrist_flexion": 30}, "wrist", 2),
        (0, {"left_forearm_pronation": 70, "left_wrist_flexion": 30}, "wrist", 3),
        (0, {"left_elbow_flexion": 90}, "lower_arm", 1), (0, {"left_elbow_flexion": 30}, "lower_arm", 2),
    ],
)  # fmt: skip
def test_steps_of_postures_set_by_hand(body, lean, angles, step, score):
    assert scored(body, lean, **angles)[step] == score


def test_a_seat_takes_the_weight_off_bent_knees(body):
    bent = {"left_knee_flexion": 90.0, "right_knee_flexion": 90.0}
    assert scored(body, **bent)["legs"] == 3
    assert scored(body, contacts=("left_foot", "right_foot", "buttocks"), **bent)["legs"] == 1
    assert scored(body, contacts=("left_foot",), **bent)["legs"] == 4


def test_an_arm_that_hangs_from_a_bent_trunk_is_assisted_by_gravity(body):
    """Lifted 60 degrees before the chest it scores 3, but it hangs when the trunk leans as much."""
    lifted = {"left_shoulder_flexion": 60.0, "left_shoulder_abduction": -25.0}
    upright, bent = scored(body, 0.0, **lifted), scored(body, 60.0, **lifted)
    assert (upright["upper_arm"], bent["upper_arm"]) == (3, 2)
