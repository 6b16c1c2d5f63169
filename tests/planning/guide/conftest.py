"""A stand-in for the reach of limbs, small creatures and scenes."""

from dataclasses import dataclass

import numpy as np
import pytest

from manikin.body import human
from manikin.body.segments import ShapeKind
from manikin.planning.guide import Abstraction, LimbReach, TrunkShape


@dataclass(frozen=True)
class FakeLimb:
    name: str
    segments: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FakeReach:
    limb: FakeLimb
    segment: str
    vertices: np.ndarray


def ball_points(centre, radius, count=60):
    """Points spread over a sphere."""
    index = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * index / count, np.pi * (1.0 + 5.0**0.5) * index
    ring = np.sqrt(1.0 - z * z)
    return np.asarray(centre) + radius * np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def human_reaches():
    """Rough reach of the four limbs: balls cut off behind the back and above the hips."""
    found = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        leg = ball_points((0.1, 0.09 * sign, -0.15), 0.8, 200)
        leg = leg[leg[:, 2] < 0.1]
        names = tuple(f"{side}_{part}" for part in ("thigh", "leg", "foot"))
        found.append(FakeReach(FakeLimb(f"{side}_leg", names), "pelvis", leg))
        arm = ball_points((0.1, 0.22 * sign, 0.2), 0.6, 150)
        names = tuple(f"{side}_{part}" for part in ("upper_arm", "forearm", "hand"))
        found.append(FakeReach(FakeLimb(f"{side}_arm", names), "thorax", arm[arm[:, 0] > -0.3]))
    return found


@pytest.fixture(scope="session")
def person():
    return human(1.75, 79.0, "male")


@pytest.fixture(scope="session")
def reaches():
    return human_reaches()


@pytest.fixture(scope="session")
def bug():
    """A ball of 10 cm with two legs that reach 40 cm to its left and right."""
    return Abstraction(
        (TrunkShape("trunk/ball", ShapeKind.SPHERE, (0.1,)),),
        (
            LimbReach("left", ball_points((0.0, 0.1, 0.0), 0.4)),
            LimbReach("right", ball_points((0.0, -0.1, 0.0), 0.4)),
        ),
    )
