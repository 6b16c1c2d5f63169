"""Floor plans: what stands in the way, seen from above, and never smaller than it is."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane, Scene, Sphere
from manikin.scene.mesh import Mesh
from manikin.walking import floor_plan
from manikin.walking.path.walk_obstacles import CORNERS


def plan(*obstacles, height=1.75, floor=0.0):
    return {one.name: one for one in floor_plan(Scene(obstacles, floor), height)}


def test_a_box_is_its_rectangle():
    turned = Rotation.from_euler("z", 30, degrees=True)
    found = plan(Obstacle("box", Box((2.0, 0.4, 1.0)), turned.as_matrix(), (1.0, -2.0, 0.5)))["box"]
    wanted = turned.apply([(1, 0.2, 0), (-1, 0.2, 0), (-1, -0.2, 0), (1, -0.2, 0)])[:, :2] + [1.0, -2.0]
    assert len(found.corners) == 4
    assert found.radius == 0.0
    for corner in wanted:
        assert np.linalg.norm(found.corners - corner, axis=1).min() < 1e-8


@pytest.mark.parametrize("shape", [Cylinder(0.3, 1.0), Capsule(0.3, 1.0), Sphere(0.3)])
@pytest.mark.parametrize("flip", [0.0, np.pi])
def test_upright_round_bodies_are_discs(shape, flip):
    turned = Rotation.from_euler("x", flip).as_matrix()
    found = plan(Obstacle("round", shape, turned, (1.0, 2.0, 0.5)))["round"]
    assert found.radius == 0.3
    assert np.allclose(found.corners, [[1.0, 2.0]])


def test_a_lying_log_is_long_and_narrow_in_any_direction():
    for degrees in range(0, 180, 7):
        lying = Rotation.from_euler("zy", [degrees, 90], degrees=True)
        found = plan(Obstacle("log", Capsule(0.1, 4.0), lying.as_matrix(), (0.0, 0.0, 0.1)))["log"]
        along = lying.apply([0, 0, 1])[:2]
        # The hemispheres at the ends add 0.1 m to each.
        assert np.abs(found.corners @ along).max() < 2.2
        assert np.abs(found.corners @ [-along[1], along[0]]).max() < 0.15


@given(st.integers(0, 10**6), st.integers(4, 60), st.floats(0.05, 20.0))
def test_outlines_enclose_meshes(seed, count, stretch):
    random = np.random.default_rng(seed)
    hull = trimesh.convex.convex_hull(random.normal(size=(count, 3)) * [stretch, 1.0, 1.0])
    turned = Rotation.random(random_state=seed)
    middle = turned.apply(hull.vertices)[:, 2].mean()
    place = np.array(
        [*random.uniform(-5, 5, 2), 1.0 - middle]
    )  # at the height of the body, whatever its shape
    found = plan(Obstacle("mesh", Mesh(hull.vertices, hull.faces), turned.as_matrix(), place))["mesh"]
    inside = turned.apply(hull.vertices)[:, :2] + place[:2]
    assert found.distance(inside[:, None], np.zeros(len(inside))).max() < 1e-6
    assert 3 <= len(found.corners) <= CORNERS
    # It is no larger than a rectangle around it would be: twice any convex outline.
    assert ConvexHull(found.corners).volume <= 2.0 * ConvexHull(inside).volume + 1e-6


def test_what_hangs_above_and_what_lies_flat_is_walked_under_and_over():
    lamp = Obstacle("lamp", Sphere(0.2), translation=(1.0, 0.0, 2.2))
    mat = Obstacle("mat", Box((1.0, 1.0, 0.01)), translation=(0.0, 0.0, 0.005))
    beam = Obstacle("beam", Box((0.1, 2.0, 0.1)), translation=(3.0, 0.0, 1.6))
    step = Obstacle("step", Box((1.0, 1.0, 0.1)), translation=(5.0, 0.0, 0.05))
    below = Obstacle("below", Box((1.0, 1.0, 0.5)), translation=(0.0, 0.0, -0.3))
    everything = (lamp, mat, beam, step, below)
    assert set(plan(*everything)) == {"beam", "step"}
    assert set(plan(*everything, height=2.05)) == {"beam", "step", "lamp"}
    assert set(plan(*everything, floor=-0.6)) == {"mat", "beam", "step", "below"} - {"beam"}


def test_floors_are_walked_on_and_endless_walls_are_refused():
    ground = Obstacle("ground", HalfSpace((0, 0, 1), 0.01))
    assert plan(ground, Obstacle("sheet", Plane((0, 0, 1), 0.0))) == {}
    for name, shape in (
        ("wall", HalfSpace((1, 0, 0), -3.0)), ("ramp", Plane((0.1, 0, 0.995), 0.0)),
        ("ceiling", HalfSpace((0, 0, -1), -2.5)), ("platform", HalfSpace((0, 0, 1), 0.5)),
    ):  # fmt: skip
        with pytest.raises(InputError, match=f"'{name}' is endless and no floor"):
            plan(Obstacle(name, shape))


def test_a_scene_without_a_floor_is_refused():
    with pytest.raises(InputError, match="scene has no floor; valid: floor_height_m"):
        floor_plan(Scene([], None), 1.75)
