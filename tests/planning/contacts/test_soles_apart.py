"""Soles of a step keep apart at any turn."""

import coal
import numpy as np

from manikin.numerics.polytope import rectangles_apart
from manikin.numerics.spatial import rotation_from_yaw


def test_the_gap_of_two_soles_is_no_more_than_their_distance():
    """Against boxes of unit height: equal where they overlap in sign, else a bound that edges reach.

    The gap along an edge's normal is the distance unless two corners are nearest.
    """
    rng, size = np.random.default_rng(0), (0.28, 0.11)
    ahead, aside = rng.uniform(-0.5, 0.5, 300), rng.uniform(0.0, 0.4, 300)
    turned = rng.uniform(-0.8, 1.1, 300)
    gaps = rectangles_apart(ahead, aside, turned, size)
    box, here = coal.Box(*size, 1.0), coal.Transform3s.Identity()
    exact = 0
    for x, y, turn, gap in zip(ahead, aside, turned, gaps, strict=True):
        there = coal.Transform3s(rotation_from_yaw(turn), np.array([x, y, 0.0]))
        distance = coal.distance(box, here, box, there, coal.DistanceRequest(), coal.DistanceResult())
        assert (gap > 0.0) == (distance > 1e-6)
        if gap > 0.0:
            assert gap <= distance + 1e-6
            exact += abs(gap - distance) < 1e-6
    assert exact > 50
