"""A person and an insect with samples of their limbs."""

import numpy as np
import pytest

from manikin.body import human, insect, with_knees_and_elbows
from manikin.kinematics.limb_samples import sample_limbs


@pytest.fixture(scope="session")
def person():
    return with_knees_and_elbows(human(1.75, 79.0, "male"))


@pytest.fixture(scope="session")
def person_samples(person):
    return sample_limbs(person, np.random.default_rng(0), 10_000)


@pytest.fixture(scope="session")
def creature():
    return insect()


@pytest.fixture(scope="session")
def creature_samples(creature):
    return sample_limbs(creature, np.random.default_rng(0), 3000)
