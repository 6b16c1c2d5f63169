"""The wrench that a motion needs, in both of its forms."""

import numpy as np
import pytest

from manikin.balance import pseudo_wrench
from manikin.body import human, insect
from manikin.motion.dynamics import FreeDynamics, centroidal_motion
from manikin.numerics.spatial import GRAVITY

HUMAN = human()


def moving(body, seed=7, count=6):
    """Random states about standing, away from the origin."""
    rng = np.random.default_rng(seed)
    q = np.tile(body.standing_posture(), (count, 1))
    q[:, :3] += (4.0, -3.0, 0.5)
    q[:, 3:7] = rng.normal(size=(count, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[:, 7:] += rng.normal(0.0, 0.3, q[:, 7:].shape)
    return q, rng.normal(0.0, 1.0, (count, body.nv)), rng.normal(0.0, 4.0, (count, body.nv))


@pytest.mark.parametrize("body", [HUMAN, insect()], ids=["human", "insect"])
def test_momentum_and_newton_euler_need_the_same_wrench(body):
    """To 1e-9 of the largest moment, which is what rounding leaves of levers of metres."""
    states = moving(body)
    one, other = centroidal_motion(body, *states).wrench, FreeDynamics.of(body, *states).wrench
    np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(one).max())


def test_it_is_the_pseudo_wrench_of_the_centre_of_mass():
    """[Qiu2012]_ 4.51."""
    found = centroidal_motion(HUMAN, *moving(HUMAN))
    acceleration = found.wrench[:, :3] / HUMAN.mass + np.array([0.0, 0.0, -GRAVITY])
    wanted = pseudo_wrench(HUMAN.mass, found.com, acceleration, found.angular_momentum_rate)
    np.testing.assert_allclose(found.wrench, wanted, rtol=1e-12, atol=1e-9)


def test_who_is_at_rest_needs_their_weight_below_their_centre_of_mass():
    q, v, a = moving(HUMAN)
    found = centroidal_motion(HUMAN, q, 0.0 * v, 0.0 * a)
    weight = np.tile([0.0, 0.0, HUMAN.mass * GRAVITY], (len(q), 1))
    np.testing.assert_allclose(found.wrench[:, :3], weight, atol=1e-9)
    np.testing.assert_allclose(found.wrench[:, 3:], np.cross(found.com, weight), atol=1e-8)
    np.testing.assert_allclose(found.angular_momentum, 0.0, atol=1e-12)
