"""A stored map tells what happens: random pushes well inside it are held, well outside they are not.

The map is what ``manikin push --map --directions 8 --feet free --out DIR`` writes to ``DIR/map.json``; it
is made anew with that command when the controller changes what is held.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from manikin.body import kudoh
from manikin.control.recovery import RecoverySettings
from manikin.simulation import Feet, PushMap, PushTrials, RecoveryTask
from manikin.simulation.recovery import STANDS_HEIGHT

STORED = json.loads((Path(__file__).parent / "data" / "push_map_kudoh_free.json").read_text())
MAP = PushMap.from_dict(STORED)
# Pushed at once, and for 0.2 s at rest only: some of the time saved that 400 pushes take.
TRIALS = PushTrials(
    kudoh(),
    RecoveryTask((), Feet(STORED["feet"])),
    RecoverySettings(delay=STORED["delay_s"]),
    STORED["duration_s"],
    begins=0.0,
)
AT_REST = 0.2
PUSHES = 3


def random_pushes(shares, border, seed):
    """Direction, impulse and outcome of pushes; impulses are shares of those at the border."""
    rng = np.random.default_rng(seed)
    for _ in range(PUSHES):
        direction = rng.uniform(0.0, 360.0)
        impulse = rng.uniform(*shares) * border(direction)
        yield direction, impulse, TRIALS.push(direction, impulse, until_at_rest=AT_REST)


def test_the_stored_map_is_complete_and_of_the_body_of_kudoh():
    assert STORED["complete"]
    assert STORED["body"] == {"model": "kudoh"}
    assert (STORED["support"], STORED["steps"]) == ("both", 0)
    assert (STORED["locked"], STORED["strength"], STORED["posture_control_only"]) == ([], 1.0, False)
    assert STORED["ankle_stiffness"] == TRIALS.settings.ankle_stiffness
    assert np.all(MAP.held > 20.0)
    assert np.all(MAP.beyond - MAP.held <= STORED["tolerance_Ns"])


def test_nothing_is_held_beyond_the_bound_without_a_step():
    """Which is that of the controller as it is, and more than half of which is held in every direction."""
    np.testing.assert_allclose(MAP.bound, TRIALS.bound(MAP.directions), rtol=1e-4)
    assert np.all(MAP.held <= MAP.bound)
    assert np.all(MAP.held > 0.5 * np.array(MAP.bound))


@pytest.mark.slow
def test_pushes_of_at_most_four_fifths_of_the_map_are_held():
    """Between two directions of the map, of the smaller impulse. Who stands, stands upright on both feet."""
    pushes = list(random_pushes((0.0, 0.8), MAP.surely_held, 1))
    assert [
        (direction, impulse, found.failure) for direction, impulse, found in pushes if found.failure
    ] == []
    for _, _, found in pushes:
        com = found.trace.motion.com[:, 2]
        assert com[-1] > STANDS_HEIGHT * com[0]
        assert found.foot_motion < 0.02


@pytest.mark.slow
def test_nothing_beyond_thirteen_tenths_of_the_map_is_called_a_recovery():
    """Between two directions of the map, of the larger impulse. Each fall is explained."""
    pushes = list(random_pushes((1.3, 2.5), MAP.surely_beyond, 2))
    assert [push for *push, found in pushes if found.recovered] == []
    assert all(found.failure and found.time_to_rest is None for *_, found in pushes)
