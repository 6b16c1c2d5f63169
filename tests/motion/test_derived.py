"""Quantities derived from a motion."""

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.motion import Motion
from manikin.motion.motion import centre_of_pressure, com_velocity, effector_positions, phases_of


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


def test_centre_of_pressure_of_corner_forces():
    """The resultant of point forces at known places presses at their weighted mean."""
    body = human()
    left, right = (Configuration(body, body.standing_posture()).effector_placement(f"{side}_foot")[1]
                   for side in ("left", "right"))  # fmt: skip
    rng = np.random.default_rng(0)
    points = np.array([left, left, right]) + np.c_[rng.uniform(-0.1, 0.1, (3, 2)), np.zeros(3)]
    forces = np.c_[rng.uniform(-30, 30, (3, 2)), rng.uniform(100, 400, 3)]
    contact = np.zeros((1, 2, 6))
    for point, force, number, origin in zip(points, forces, (0, 0, 1), (left, left, right), strict=True):
        contact[0, number] += np.r_[force, np.cross(point - origin, force)]
    found = centre_of_pressure(body, standing(body, 1, contact_force=contact))[0]
    expected = forces[:, 2] @ points / forces[:, 2].sum()
    np.testing.assert_allclose(found[:2], expected[:2], atol=1e-12)


def test_nothing_presses_in_the_air():
    body = human()
    assert np.isnan(centre_of_pressure(body, standing(body, 2))).all()


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
