import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import SceneError
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Sphere, cover, load_mesh
from manikin.scene.covering import winding_inside

length = st.floats(0.05, 2.0)
count = st.integers(1, 40)


def random_points_inside(shape, rng, number=4000):
    if isinstance(shape, Sphere):
        points = rng.normal(size=(number, 3))
        return shape.radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    if isinstance(shape, Box):
        return (rng.random((number, 3)) - 0.5) * shape.size
    disc = np.sqrt(rng.random(number))
    angle = rng.random(number) * 2 * np.pi
    height = (rng.random(number) - 0.5) * shape.length
    tube = np.column_stack([shape.radius * disc * np.cos(angle), shape.radius * disc * np.sin(angle), height])
    if isinstance(shape, Cylinder):
        return tube
    ends = random_points_inside(Sphere(shape.radius), rng, number)
    ends[:, 2] += np.sign(ends[:, 2]) * shape.length / 2
    return np.vstack([tube, ends])


def covered(found, points):
    gap = np.linalg.norm(points[:, None] - found.centres, axis=2) - found.radii
    return gap.min(axis=1).max()


@given(length, length, length, count)
def test_spheres_cover_every_primitive_with_at_most_the_count(a, b, c, number):
    rng = np.random.default_rng(0)
    for shape in (Box((a, b, c)), Cylinder(a, b), Capsule(a, b), Sphere(a)):
        found = cover(shape, count=number)
        assert 1 <= len(found) <= number
        assert covered(found, random_points_inside(shape, rng)) <= 1e-9


@given(length, length, length, count)
def test_no_sphere_reaches_farther_beyond_the_shape_than_said(a, b, c, number):
    """Points of the spheres' surfaces against the exact distance to the box and the capsule."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    box, capsule = Box((a, b, c)), Capsule(a, b)
    for shape in (box, capsule):
        found = cover(shape, count=number)
        points = (found.centres[:, None] + found.radii[:, None, None] * directions).reshape(-1, 3)
        if isinstance(shape, Box):
            beyond = np.linalg.norm(np.maximum(np.abs(points) - shape.size / 2, 0.0), axis=1)
        else:
            axis = np.clip(points[:, 2], -b / 2, b / 2)
            beyond = np.linalg.norm(points - axis[:, None] * [0.0, 0.0, 1.0], axis=1) - a
        assert beyond.max() <= found.overshoot + 1e-9


@pytest.mark.parametrize(
    "number", [10, pytest.param(20, marks=pytest.mark.long), pytest.param(21, marks=pytest.mark.long)]
)
def test_the_published_counts_of_a_car_can_be_used(number):
    """[Qiu2012]_ Table 7.2: sill, pillars and roof 10 to 20, seat 20, wheel 21 spheres.

    The wheel: 0.36 m across, the tube 3 cm thick. 21 equal chords of it need spheres of
    hypot(0.18 sin(pi / 21), 0.015) = 0.031 m; clustering is allowed twice that.
    """
    pillar = cover(Capsule(0.05, 1.2), count=number)
    assert len(pillar) == number
    assert pillar.overshoot < 0.05
    ring = trimesh.creation.torus(0.18, 0.015)
    wheel = cover(Mesh(ring.vertices, ring.faces), count=number)
    assert len(wheel) == number
    if number == 21:
        assert wheel.radii.max() < 0.062


def test_spheres_cover_closed_meshes_through_and_through():
    for solid in (trimesh.creation.torus(0.18, 0.03), trimesh.creation.box((0.5, 0.4, 0.9))):
        found = cover(Mesh(solid.vertices, solid.faces), count=20)
        box = np.random.default_rng(0).random((4000, 3)) * solid.extents + solid.bounds[0]
        points = box[winding_inside(solid.triangles, box)]
        on_it = trimesh.sample.sample_surface(solid, 4000, seed=0)[0]
        assert covered(found, np.vstack([points, on_it])) <= 1e-9


def test_the_same_mesh_is_covered_by_the_same_spheres():
    ring = trimesh.creation.torus(0.18, 0.015)
    mesh = Mesh(ring.vertices, ring.faces)
    assert np.array_equal(cover(mesh, count=12).centres, cover(mesh, count=12).centres)


def test_nonsense_is_refused():
    for shape in (Plane((0, 0, 1)), HalfSpace((0, 0, 1))):
        with pytest.raises(SceneError, match="valid: a shape with an end"):
            cover(shape)
    for bad in (0, -1, 2.5, True):
        with pytest.raises(SceneError, match="count"):
            cover(Sphere(1.0), count=bad)


def test_a_real_open_mesh_is_covered(scene_files):
    mesh = load_mesh(scene_files / "hpp_environments/chair.stl")
    found = cover(mesh, count=20)
    points = trimesh.sample.sample_surface(Obstacle("chair", mesh).to_trimesh(), 4000, seed=0)[0]
    assert covered(found, points) <= 1e-9


def test_inside_is_told_by_solid_angles():
    """A torus has a hole; a box has corners."""
    ring = trimesh.creation.torus(1.0, 0.2, major_sections=64, minor_sections=32)
    points = np.random.default_rng(0).uniform(-1.3, 1.3, size=(2000, 3))
    depth = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2]) - 0.2
    clear = np.abs(depth) > 0.005  # the facets' sagitta: 1.2 (1 - cos(pi / 64)) = 0.0015
    assert np.array_equal(winding_inside(ring.triangles, points)[clear], (depth < 0.0)[clear])
