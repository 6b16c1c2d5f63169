"""Models of walking paths: closed forms and properties that their sources give."""

import numpy as np
import pytest

from manikin.walking import PROSE_ORDER, Walker
from manikin.walking.path.path_models import COMPARED, MINIMUM_JERK, UNICYCLE, OptimalModel, SteeringModel
from manikin.walking.path.walking_path import WalkingTask

REST = np.zeros(3)


def task_to(goal, start_velocity=(0.0, 0.0, 0.0), goal_velocity=(0.0, 0.0, 0.0)):
    ends = np.array(start_velocity, dtype=float), np.array(goal_velocity, dtype=float)
    return WalkingTask(REST, np.array(goal, dtype=float), PROSE_ORDER, (), Walker(), 0.0, None, *ends)


@pytest.mark.parametrize("name", COMPARED)
def test_every_model_walks_to_the_goal(name):
    walk = COMPARED[name].walk(task_to((2.0, 1.0, 0.8), (0.8, 0.0, 0.0), (0.8, 0.0, 0.0)))
    ends = walk.place_at([0.0, walk.duration])[:, :2]
    # Steering circles about nothing: it passes the goal at a few centimetres.
    assert np.abs(ends - [[0.0, 0.0], [2.0, 1.0]]).max() < (0.05 if name == "Fajen and Warren" else 1e-6)


def test_minimum_jerk_from_rest_to_rest_is_the_polynomial():
    """Free accelerations at the ends leave a quintic without third derivative there (2.2)."""
    walk = OptimalModel(MINIMUM_JERK).walk(task_to((2.0, 0.0, 0.0)))
    share = np.linspace(0.0, 1.0, 50)
    # 0 = x(0) = x'(0) = x'''(0) and the same at the end: 5/2 s^2 - 5/2 s^4 + s^5.
    expected = 2.0 * (2.5 * share**2 - 2.5 * share**4 + share**5)
    # A spline of degree 4, whose weights of accelerations are next to nothing.
    assert np.abs(walk.place_at(share * walk.duration)[:, 0] - expected).max() < 2e-3


def test_a_unicycle_does_not_go_aside():
    walk = OptimalModel(UNICYCLE, along=True).walk(task_to((2.0, 1.0, 1.0), (0.8, 0.2, 0.0), (0.8, 0.0, 0.0)))
    assert np.abs(walk.velocity[:, 1]).max() < 0.01 * walk.velocity[:, 0].max()


def test_steering_has_the_linear_frequency_and_damping_of_its_source():
    """Far from the goal small angles obey ``phi'' = -b phi' - k c2 phi``."""
    model = SteeringModel(decay=10.0)
    walk = model.walk(task_to((60.0, 0.0, 0.0), (1.0, 0.05, 0.0)))
    time = np.linspace(0.0, 1.5, 40)
    root = np.sqrt(complex(model.damping**2 / 4.0 - model.stiffness * model.far))
    start = np.arctan2(0.05, 1.0)
    exact = np.real(
        start * np.exp(-model.damping * time / 2.0)
        * (np.cosh(root * time) + model.damping / (2.0 * root) * np.sinh(root * time))
    )  # fmt: skip
    assert np.abs(walk.place_at(time)[:, 2] - exact).max() < 1e-3
