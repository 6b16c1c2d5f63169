"""A person who pushes a cupboard."""

import numpy as np
import pytest

from manikin.body import human
from manikin.kinematics.limb_samples import sample_limbs
from manikin.planning.push_pull import Act, ActKind, BraceSettings, find_braced_posture
from manikin.scene import Box, Obstacle, Scene

FEW = BraceSettings(enough=2, distances=(0.60, 0.52), heights=(0.88,), leans=(0.3,))
"""Two places of the trunk."""


@pytest.fixture(scope="session")
def body():
    return human(1.75, 79.0, "male")


@pytest.fixture(scope="session")
def samples(body):
    return sample_limbs(body, np.random.default_rng(0), 10_000)


@pytest.fixture(scope="session")
def scene():
    return Scene([Obstacle("cupboard", Box((0.6, 1.2, 1.9)), translation=(0.8, 0.0, 0.95))], floor_height=0.0)


@pytest.fixture(scope="session")
def push():
    return Act(ActKind.PUSH, "cupboard", (1.0, 0.0, 0.0), 200.0)


@pytest.fixture(scope="session")
def brace(body, scene, samples, push):
    found = find_braced_posture(body, scene, samples, push, np.zeros(2), settings=FEW)
    assert found.failure is None
    return found.brace
