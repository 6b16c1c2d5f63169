"""Predicted impulses against closed forms for a body that stands, and for one whose support changes."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics.spatial import GRAVITY

SPEC = importlib.util.spec_from_file_location("pushed", Path(__file__).parents[2] / "docs/pushed.py")
sys.modules["pushed"] = module = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(module)
predict_impulse = module.predict_impulse

MASS, HEIGHT = 70.0, 0.9
OMEGA = np.sqrt(GRAVITY / HEIGHT)
LEFT = sole("left_foot", position=(0.0, 0.1, 0.0), yaw=0.0, length=0.26, width=0.10, friction=0.7)
RIGHT = sole("right_foot", position=(0.0, -0.1, 0.0), yaw=0.0, length=0.26, width=0.10, friction=0.7)


def standing(stances, instants, speed=0.0, margin=50.0, place=(0.02, 0.05)):
    """A body above a place within both feet or the left one, carried there; its CoM may drift along x."""
    time = np.linspace(0.0, instants[-1], 1001)
    n = len(time)
    com = np.tile([*place, HEIGHT], (n, 1))
    com[:, 0] += speed * time
    force = np.zeros((n, 1, 6))
    force[:, 0, 2] = MASS * GRAVITY
    force[:, 0, 3] = (place[1] - 0.1) * MASS * GRAVITY  # about the left foot's origin
    force[:, 0, 4] = -place[0] * MASS * GRAVITY
    zero = np.zeros((n, 7))
    motion = Motion(
        time=time, q=np.tile([0, 0, 0, 0, 0, 0, 1.0, 0.0], (n, 1)), v=zero, a=zero, tau=zero, com=com,
        angular_momentum=np.zeros((n, 3)), margin=np.full(n, margin), support=np.ones((n, 1), dtype=bool),
        contact_force=force, contact_names=("left_foot",), joint_names=("hinge",),
    )  # fmt: skip
    sequence = StanceSequence([Phase(Stance(contacts, 3 * MASS * GRAVITY)) for contacts in stances])
    return motion, ContactSchedule(sequence, instants)


@pytest.mark.parametrize(
    ("direction", "room"), [((1, 0), 0.11), ((-2, 0), 0.15), ((0, 1), 0.10), ((0, -1), 0.20)]
)
def test_at_rest_the_room_is_the_distance_to_the_edge(direction, room):
    """Plan and capture point say the same then: ``J = m w d``; the margin says ``r w / g``."""
    found = predict_impulse(*standing([(LEFT, RIGHT)], [0.0, 5.0]), MASS, 0.5, direction)
    assert found.capture == pytest.approx(MASS * OMEGA * room)
    assert found.plan == pytest.approx(MASS * OMEGA * room)
    assert found.margin == pytest.approx(50.0 * OMEGA / GRAVITY)
    assert found.frequency == pytest.approx(OMEGA)


def test_a_long_push_may_be_larger_and_a_high_one_must_be_smaller():
    motion, schedule = standing([(LEFT, RIGHT)], [0.0, 5.0])
    short = predict_impulse(motion, schedule, MASS, 0.5, (1, 0)).plan
    long = predict_impulse(motion, schedule, MASS, 0.5, (1, 0), duration=0.2).plan
    high = predict_impulse(motion, schedule, MASS, 0.5, (1, 0), height=1.2 * HEIGHT).plan
    assert long / short == pytest.approx(0.2 * OMEGA / (1.0 - np.exp(-0.2 * OMEGA)))
    assert high / short == pytest.approx(1.0 / 1.2)


def test_the_plan_sees_the_landing_to_come():
    """On the left foot alone for 0.2 s, then on both: to the right 0.0 m, then 0.2 m of room."""
    motion, schedule = standing([(LEFT,), (LEFT, RIGHT)], [0.0, 0.7, 5.0])
    found = predict_impulse(motion, schedule, MASS, 0.5, (0, -1))
    assert found.capture == pytest.approx(0.0, abs=1e-9)
    assert found.plan == pytest.approx(MASS * OMEGA * 0.2 * np.exp(-OMEGA * 0.2), rel=0.02)


def test_a_capture_point_that_moves_takes_its_own_room():
    found = predict_impulse(*standing([(LEFT, RIGHT)], [0.0, 1.0], speed=0.1), MASS, 0.5, (1, 0))
    assert found.capture == pytest.approx(MASS * OMEGA * (0.11 - 0.05 - 0.1 / OMEGA))
    assert found.plan == pytest.approx(MASS * OMEGA * 0.11)


def test_the_pendulum_agrees_with_the_prediction():
    """The deviation ``e' = w (e - d)`` with the ZMP at the edge is bounded just below it, and not above."""
    motion, schedule = standing([(LEFT,), (LEFT, RIGHT)], [0.0, 0.7, 8.0])
    limit = predict_impulse(motion, schedule, MASS, 0.5, (0, -1)).plan / (MASS * OMEGA)
    step = 1e-4
    for start, bounded in ((0.95 * limit, True), (1.05 * limit, False)):
        error = start
        for number in range(20000):
            room = 0.0 if number * step < 0.2 else 0.2
            error += step * OMEGA * (error - room)
            if error < 0.0:
                break
        assert (error < 0.0) == bounded


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"time": 9.0}, "push time"), ({"direction": (0.0, 0.0)}, "push direction"),
        ({"direction": (np.nan, 0.0)}, "push direction"), ({"mass": -1.0}, "mass"),
        ({"duration": -0.1}, "push duration"), ({"height": -0.5}, "height of the push"),
    ],
)  # fmt: skip
def test_what_cannot_be_predicted_is_refused(change, says):
    motion, schedule = standing([(LEFT, RIGHT)], [0.0, 5.0])
    values = {"mass": MASS, "time": 0.5, "direction": (1.0, 0.0), **change}
    with pytest.raises(InputError, match=says):
        predict_impulse(motion, schedule, **values)
