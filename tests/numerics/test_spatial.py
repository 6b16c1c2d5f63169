"""Rotation vectors of many rotations agree with Pinocchio's, which takes one at a time."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.numerics.spatial import rotation_vector, rotation_vector_jacobian


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.019, 0.021, 1.0, 3.0])
def test_rotation_vectors_and_their_jacobians(size):
    """To 1e-10: near zero the difference 1 - (a / 2) cot(a / 2) of Pinocchio loses digits."""
    axes = np.random.default_rng(4).normal(size=(5, 3))
    vectors = size * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    rotations = np.array([pin.exp3(vector) for vector in vectors])
    np.testing.assert_allclose(rotation_vector(rotations), vectors, atol=1e-10)
    expected = np.array([pin.Jlog3(rotation) for rotation in rotations])
    np.testing.assert_allclose(rotation_vector_jacobian(vectors), expected, atol=1e-10)
