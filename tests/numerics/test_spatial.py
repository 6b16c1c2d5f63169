"""Rotation vectors of many rotations agree with Pinocchio's, which takes one at a time."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.numerics.spatial import (
    area_normals,
    rotation_from_normal,
    rotation_vector,
    rotation_vector_jacobian,
    unit,
    yaw_about_normal,
)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.019, 0.021, 1.0, 3.0])
def test_rotation_vectors_and_their_jacobians(size):
    """To 1e-10: near zero the difference 1 - (a / 2) cot(a / 2) of Pinocchio loses digits."""
    axes = np.random.default_rng(4).normal(size=(5, 3))
    vectors = size * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    rotations = np.array([pin.exp3(vector) for vector in vectors])
    np.testing.assert_allclose(rotation_vector(rotations), vectors, atol=1e-10)
    expected = np.array([pin.Jlog3(rotation) for rotation in rotations])
    np.testing.assert_allclose(rotation_vector_jacobian(vectors), expected, atol=1e-10)


def test_a_normal_and_the_yaw_about_it_give_the_rotation_back():
    """On the level, on slopes and on walls, where the toes point up."""
    rng = np.random.default_rng(0)
    for normal in [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], *rng.normal(size=(20, 3))]:
        yaw = rng.uniform(-3.1, 3.1)
        assert yaw_about_normal(rotation_from_normal(normal, yaw)) == pytest.approx(yaw, abs=1e-9)


def test_unit_vectors_and_normals_of_triangles():
    """A triangle with legs of 3 and 4 along x and y has the normal 12 z; no length is divided by zero."""
    corners = np.array([[[1.0, 1.0, 1.0], [4.0, 1.0, 1.0], [1.0, 5.0, 1.0]]])
    np.testing.assert_array_equal(area_normals(corners), [[0.0, 0.0, 12.0]])
    np.testing.assert_allclose(unit(np.array([[3.0, 4.0], [0.0, 0.0]])), [[0.6, 0.8], [0.0, 0.0]])
