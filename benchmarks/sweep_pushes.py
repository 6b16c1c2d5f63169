"""Hundreds of random pushes against the stored map of held ones: `pytest benchmarks/sweep_pushes.py -n 2`.

Two minutes on two cores; the tests make 16 of these 400 pushes.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from manikin.body import human, kudoh
from manikin.control.recovery import RecoverySettings
from manikin.simulation import (
    Feet,
    PushMap,
    PushTrials,
    RecoveryTask,
    feet_apart_posture,
    one_foot_posture,
    push_near_com,
    recover,
)

STORED = json.loads(
    (Path(__file__).parents[1] / "tests/simulation/data/push_map_kudoh_free.json").read_text()
)
MAP = PushMap.from_dict(STORED)
TRIALS = PushTrials(
    kudoh(), RecoveryTask((), Feet(STORED["feet"])), RecoverySettings(delay=STORED["delay_s"]),
    STORED["duration_s"], begins=0.0,
)  # fmt: skip
CHUNK = 25


def pushes(first, shares, border, seed):
    """Direction, impulse and outcome; impulses are shares of those at the border."""
    rng = np.random.default_rng([seed, first])
    for _ in range(CHUNK):
        direction = rng.uniform(0.0, 360.0)
        impulse = rng.uniform(*shares) * border(direction)
        yield direction, impulse, TRIALS.push(direction, impulse, until_at_rest=0.2)


@pytest.mark.parametrize("first", range(0, 200, CHUNK))
def test_pushes_of_at_most_four_fifths_of_the_map_are_held(first):
    for direction, impulse, found in pushes(first, (0.0, 0.8), MAP.surely_held, 1):
        assert found.recovered, (direction, impulse, found.failure)
        assert found.foot_motion < 0.02


@pytest.mark.parametrize("first", range(0, 200, CHUNK))
def test_nothing_beyond_thirteen_tenths_of_the_map_is_called_a_recovery(first):
    for direction, impulse, found in pushes(first, (1.3, 2.5), MAP.surely_beyond, 2):
        assert not found.recovered, (direction, impulse)
        assert found.failure


def pushed(body, force, **task):
    push = push_near_com(body, force, 0.2, 0.1, q=task.get("q"))
    return recover(body, RecoveryTask((push,), Feet.FREE, **task), RecoverySettings(delay=0.2))


@pytest.mark.parametrize("force", [615.0, 620.0, 625.0])
def test_two_steps_recover_what_one_cannot(force):
    one, two = (pushed(kudoh(), (-force, 0.0, 0.0), steps=steps) for steps in (1, 2))
    assert not one.recovered
    assert two.recovered, two.failure


@pytest.mark.parametrize("body", [kudoh(), human()], ids=["kudoh", "human"])
@pytest.mark.parametrize("force", [(100.0, 0.0, 0.0), (0.0, -60.0, 0.0)])
def test_a_push_is_held_on_one_foot(body, force):
    q = one_foot_posture(body, "left_foot")
    found = pushed(body, force, q=q, support=("left_foot",))
    assert found.recovered, found.failure


def test_from_the_side_less_is_held_with_the_feet_together():
    """As in the thesis ([Kudoh2002]_ 3.3, experiment 4): the soles are then 20 cm wide and 25 cm long."""

    def together(force):
        push = push_near_com(kudoh(), force, 0.2, 0.1, q=feet_apart_posture(kudoh(), 0.1))
        task = RecoveryTask((push,), Feet.HELD, 3.5, q=feet_apart_posture(kudoh(), 0.1))
        return recover(kudoh(), task, RecoverySettings(delay=0.2)).recovered

    assert together((250.0, 0.0, 0.0))
    assert together((-250.0, 0.0, 0.0))
    assert not together((0.0, 250.0, 0.0))
    assert together((0.0, 180.0, 0.0))


@pytest.mark.parametrize(("stature", "mass", "sex"), [(1.55, 48.0, "female"), (1.95, 105.0, "male")])
def test_bodies_of_any_size_recover(stature, mass, sex):
    """From a push that gives each a speed of 0.25 m/s."""
    found = pushed(human(stature, mass, sex), (2.5 * mass, 0.0, 0.0), duration=2.5)
    assert found.recovered, found.failure
