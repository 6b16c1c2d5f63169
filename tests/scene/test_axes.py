"""Distances between capsules and balls, many at once, against Coal's one by one."""

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from manikin.scene.distance_bounds import segment_distances

GEOMETRIES = (coal.Capsule(0.05, 0.4), coal.Capsule(0.03, 0.2), coal.Sphere(0.1))
HALVES, RADII = (0.2, 0.1, 0.0), (0.05, 0.03, 0.1)


@given(st.integers(0, 2**32 - 1), st.sampled_from([(0, 1), (1, 0), (0, 2), (2, 1), (2, 2)]))
def test_round_shapes_are_as_far_apart_as_coal_says(seed, pair):
    """Apart, to 1e-9 m: both are closed forms."""
    turns = Rotation.random(2, rng=np.random.default_rng(seed)).as_matrix()
    centres = np.array([[0.0, 0.0, 0.0], [0.3, 0.5, -0.4]]) + 0.1 * turns[:, 0]
    a, b = (HALVES[shape] * turns[k : k + 1, :, 2] for k, shape in enumerate(pair))
    found = segment_distances(centres[:1], a, centres[1:], b) - RADII[pair[0]] - RADII[pair[1]]
    first, second = (coal.Transform3s(turn, centre) for turn, centre in zip(turns, centres, strict=True))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    expected = coal.distance(GEOMETRIES[pair[0]], first, GEOMETRIES[pair[1]], second, request, result)
    assert found[0] == pytest.approx(expected, abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-12, 1e-7, 1e-6, 1e-4, 1.0]))
def test_no_two_points_of_segments_are_nearer(seed, skew):
    """Also of segments that are parallel, or nearly, to 1e-6 m.

    Those within an angle of 1e-6 count as parallel, which is wrong by that times their length.
    """
    rng = np.random.default_rng(seed)
    centre, half, other_centre = 0.2 * rng.normal(size=(3, 1, 3))
    other_half = rng.uniform(0.1, 1.0) * half + 0.2 * skew * rng.normal(size=(1, 3))
    found = segment_distances(centre, half, other_centre, other_half)[0]
    shares = np.linspace(-1.0, 1.0, 201)
    points, others = centre + shares[:, None] * half, other_centre + shares[:, None] * other_half
    sampled = np.linalg.norm(points[:, None] - others[None], axis=2).min()
    assert found <= sampled + 1e-6
    assert found >= sampled - 0.01  # the spacing of the points
