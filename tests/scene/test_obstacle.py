import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import SceneError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Sphere

ANGLE = st.floats(-3.0, 3.0)


@pytest.mark.parametrize("name", ["", "a/b", 3])
def test_bad_names_are_refused(name):
    with pytest.raises(SceneError, match="obstacle name"):
        Obstacle(name, Sphere(1.0))


def test_bad_placements_and_shapes_are_refused():
    with pytest.raises(SceneError, match="'car' shape"):
        Obstacle("car", "box")
    with pytest.raises(SceneError, match="'car' rotation is not a rotation"):
        Obstacle("car", Sphere(1.0), rotation=2 * np.eye(3))
    with pytest.raises(SceneError, match="'car' translation"):
        Obstacle("car", Sphere(1.0), translation=(0.0, np.nan, 0.0))


@given(ANGLE, ANGLE, ANGLE)
def test_bounds_hold_the_drawn_triangles_tightly(roll, pitch, yaw):
    """A drawn round shape is inscribed, so it misses the true bounds by its facets' sagitta only."""
    shapes = [Box((0.4, 0.6, 0.2)), Sphere(0.3), Cylinder(0.2, 0.7), Capsule(0.1, 0.5)]
    for shape in shapes:
        item = Obstacle("a", shape, rotation_from_rpy(roll, pitch, yaw), (1.0, -2.0, 0.5))
        drawn = item.to_trimesh().bounds
        low, high = item.bounds
        assert np.all(drawn[0] >= low - 1e-12)
        assert np.all(drawn[1] <= high + 1e-12)
        # 32 facets around: sagitta r (1 - cos(pi / 32)) < 0.005 r; 0.01 leaves room for both ends.
        assert np.abs(drawn - np.array([low, high])).max() < 0.01


def test_mesh_bounds_are_those_of_its_vertices():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    low, high = Obstacle("m", mesh, translation=(1.0, 1.0, 1.0)).bounds
    assert np.allclose(low, 1.0)
    assert np.allclose(high, (2.0, 3.0, 4.0))


def test_endless_shapes_have_endless_bounds_and_a_world_plane():
    tilted = rotation_from_rpy(0.3, -0.2, 0.5)
    for shape in (Plane((0.0, 0.0, 1.0), 0.25), HalfSpace((0.0, 0.0, 1.0), 0.25)):
        item = Obstacle("ground", shape, tilted, (0.1, 0.2, 0.3))
        assert np.all(np.isinf(item.bounds))
        normal, offset = item.world_plane
        on_it = item.to_world([0.7, -0.4, 0.25])
        assert np.isclose(normal @ on_it, offset)
        assert np.allclose(item.to_trimesh().vertices @ normal, offset)
    with pytest.raises(SceneError, match="has no plane"):
        _ = Obstacle("ball", Sphere(1.0)).world_plane
