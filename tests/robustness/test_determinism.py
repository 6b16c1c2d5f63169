"""A small share of ``python -m tests.robustness --determinism``."""

import numpy as np
from tests.robustness.determinism import SMALL, digest, in_new_process, in_this_process


def test_plans_are_the_same_bits_whatever_was_planned_before_and_however_python_hashes():
    """These run with other hashes and threads, elsewhere, in the opposite order, and after other things."""
    names = list(SMALL)
    assert in_this_process(names[::-1]) == in_new_process(names, number=2)


def test_adigest_depends_on_every_bit():
    """One unit in the last place is another digest."""
    assert digest([np.ones(3)]) != digest([np.array([1.0, 1.0, np.nextafter(1.0, 2.0)])])
