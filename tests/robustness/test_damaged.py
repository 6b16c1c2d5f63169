"""A small share of the damaged files of ``python -m tests.robustness``, other ones than its first."""

import numpy as np
import pytest
from tests.robustness.mutations import mutated
from tests.robustness.samples import FORMATS
from tests.robustness.trial import tried


@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
def test_a_damaged_file_is_refused_in_one_line_or_plausible(kind):
    """Each changed motion file is read by a process of its own first, so that there are few."""
    assert tried(kind, 1, range(4 if kind.name == "motion" else 25)) == []


def test_the_same_seed_makes_the_same_damage_and_nearly_always_one():
    whole = b"friction: 0.7\ncom: [0, 0, 0.9]\n"
    made = [mutated(whole, np.random.default_rng(seed), text=True) for seed in (0, 0, *range(1, 40))]
    assert made[0] == made[1]
    assert sum(content != whole for content in made) > 35
