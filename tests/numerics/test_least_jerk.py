"""The way from rest to rest with the least jerk."""

import numpy as np

from manikin.numerics.signals import least_jerk


def test_it_begins_and_ends_at_rest_and_its_derivatives_are_those_of_the_way():
    """Central differences of a quintic: the error of 1e-3 is below 1e-4 of the largest value."""
    for share, end in ((0.0, 0.0), (1.0, 1.0)):
        assert least_jerk(share) == (end, 0.0, 0.0)
    s, h = np.linspace(0.0, 1.0, 11), 1e-3
    way, speed, acceleration = least_jerk(s)
    ahead, behind = least_jerk(s + h), least_jerk(s - h)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2.0 * h), speed, atol=2e-4)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2.0 * h), acceleration, atol=2e-3)
    np.testing.assert_allclose(way + way[::-1], 1.0, atol=1e-15)
