"""Quantities derived from a motion."""

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.motion import Motion
from manikin.motion.motion import com_velocity, effector_positions, phases_of


def standing(body, n, **changes):
    zero = np.zeros((n, body.nv))
    values = {
        "time": np.arange(n) * 0.1, "q": np.tile(body.standing_posture(), (n, 1)),
        "v": zero, "a": zero, "tau": zero, "com": np.zeros((n, 3)),
        "angular_momentum": np.zeros((n, 3)), "margin": np.zeros(n),
        "support": np.ones((n, 2), dtype=bool), "contact_force": np.zeros((n, 2, 6)),
        "contact_names": ("left_foot", "right_foot"), "joint_names": body.joint_names,
    }  # fmt: skip
    return Motion(**{**values, **changes})


def test_phases_follow_the_support_table():
    body = human()
    support = np.array([[1, 1], [1, 1], [0, 1], [0, 1], [0, 0], [1, 1]], dtype=bool)
    phases = phases_of(standing(body, 6, support=support))
    assert phases.supports == (("left_foot", "right_foot"), ("right_foot",), (), ("left_foot", "right_foot"))
    np.testing.assert_allclose(phases.instants, [0.0, 0.2, 0.4, 0.5, 0.5])
    assert phases.phase_at(np.array([0.0, 0.19, 0.2, 9.0])).tolist() == [0, 0, 1, 3]


def test_velocity_of_a_parabola_is_exact_inside():
    body = human()
    time = np.arange(20) * 0.1
    com = np.c_[time**2, -(time**2), 3 * time]
    velocity = com_velocity(standing(body, 20, com=com))
    np.testing.assert_allclose(velocity[1:-1], np.c_[2 * time, -2 * time, 3 + 0 * time][1:-1], atol=1e-12)


def test_effector_positions_are_those_of_the_configuration():
    body = human()
    names = ("left_hand", "right_foot")
    found = effector_positions(body, standing(body, 1), names)
    configuration = Configuration(body, body.standing_posture())
    for name in names:
        assert found[name][0] == pytest.approx(configuration.effector_placement(name)[1], abs=1e-14)
