"""Strength that a posture takes at rest, however the world is turned and whatever friction is."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.balance import static_torque_share
from manikin.body import Configuration, human
from manikin.contact import Stance, grasp, sole
from manikin.planning.contacts import PostureFinder
from manikin.scene import Scene
from manikin.verification.equilibrium import torque_share

BODY = human(1.84, 104.0, "female")


def leaning(yaw):
    """Left foot and weak right hand of a body that leans aside, turned about the vertical [rad]."""
    q = np.array(BODY.standing_posture())
    for name, angle in (
        ("right_shoulder_abduction", 0.8),
        ("left_hip_abduction", -0.15),
        ("left_knee_flexion", 0.5),
    ):
        q[7 + BODY.joint_index(name)] = angle
    turn = pin.SE3(pin.utils.rotate("z", yaw), np.zeros(3))
    q[:7] = pin.SE3ToXYZQUAT(turn * pin.XYZQUATToSE3(q[:7]))
    state = Configuration(BODY, q)
    (foot, ground), (palm, hold) = (state.effector_placement(name) for name in ("left_foot", "right_hand"))
    size = {"length": BODY.sole_length, "width": BODY.sole_width}
    held = [
        sole("left_foot", ground, rotation=foot, friction=0.7, **size),
        grasp("right_hand", hold, max_force=40.0, rotation=palm),
    ]
    return q, held


@pytest.mark.parametrize("yaw", np.linspace(0.0, 0.5 * np.pi, 7)[1:])
def test_a_turned_world_asks_for_the_same_strength(yaw):
    """By whole sides of the prism exactly, else to the 8 % by which its flat sides are inside the circle."""
    here, there = (static_torque_share(BODY, q, Stance(held)) for q, held in (leaning(0.0), leaning(yaw)))
    assert np.isfinite(here)
    whole = abs(yaw % (0.25 * np.pi)) < 1e-9 or abs(yaw % (0.25 * np.pi) - 0.25 * np.pi) < 1e-9
    assert there == pytest.approx(here, rel=1e-6 if whole else 0.08)


@pytest.mark.parametrize("yaw", np.linspace(0.0, 0.5 * np.pi, 7))
def test_the_check_in_a_turned_world_asks_for_no_more(yaw):
    """It has the grasp's box of forces in world axes, and friction by cones of 16 edges."""
    q, held = leaning(0.0)
    found = PostureFinder(BODY, Scene()).strained(q, {item.effector: item for item in held}, 0.0)
    mine = float(found.split("takes ")[1].split(" ")[0])
    # The message has two decimals.
    assert torque_share(BODY, *leaning(yaw), None) <= mine + 0.005
