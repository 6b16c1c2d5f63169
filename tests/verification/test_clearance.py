"""Distances of the check against brute force, and solids given in two ways."""

import numpy as np
import pytest
import trimesh

from manikin.body import human
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene.mesh import Mesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from manikin.verification.clearance import BodySolids
from manikin.verification.solids import REACH, Solid, segment_segment, segment_triangle, winding_numbers

SHAPES = (
    Box([0.4, 0.3, 0.5]), Cylinder(0.2, 0.5), Capsule(0.15, 0.3), Sphere(0.25),
    HalfSpace([0.2, 0.1, 1.0], -0.2),
)  # fmt: skip


@pytest.fixture(scope="module")
def shapes():
    return BodySolids(human())


@pytest.fixture(scope="module")
def postures(shapes):
    """Random postures with the root near the origin."""
    rng, body = np.random.default_rng(7), shapes.body
    q = np.array([body.standing_posture()] * 12)
    q[:, 7:] = rng.uniform(0.6 * body.lower, 0.6 * body.upper, (12, len(body.lower)))
    q[:, :3] = rng.uniform(-0.4, 0.4, (12, 3))
    turn = rng.normal(size=(12, 4))
    q[:, 3:7] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    return q


def placed(shape):
    return Obstacle("thing", shape, rotation_from_rpy(0.3, -0.5, 0.8), [0.1, -0.2, 0.1])


def sampled(shapes, postures, solid):
    """Distances by points every few millimetres of the shapes' surfaces or axes; an upper bound."""
    rounds, boxes = shapes.placed(postures)
    result = np.full((len(postures), len(shapes.shapes)), np.inf)
    start, end = rounds.ends
    share = np.linspace(0.0, 1.0, 200)[:, None]
    for row, (a, b) in enumerate(zip(start, end, strict=True)):
        distance = solid.distance(a + share * (b - a)).min() - rounds.radius[row]
        result[rounds.posture[row], rounds.shape[row]] = distance
    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 9)] * 3), axis=-1).reshape(-1, 3)
    for row in range(len(boxes.shape)):
        points = boxes.position[row] + (grid * boxes.size[row]) @ boxes.rotation[row].T
        result[boxes.posture[row], boxes.shape[row]] = solid.distance(points).min()
    return result


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_clearances_are_those_of_dense_samples(shapes, postures, shape):
    """Round shapes: the same to the samples' 2 mm, outside and inside. Boxes: no overlap is missed."""
    solid = Solid(placed(shape))
    exact, brute = shapes.to_obstacle(postures, solid), sampled(shapes, postures, solid)
    near = exact < REACH
    assert near.sum() > 20
    assert np.all(brute[~near] > REACH - 1e-9)
    is_round = np.array([shape.kind != "box" for shape in shapes.shapes]) & near
    assert np.abs(exact - brute)[is_round].max() < 2e-3
    assert np.all(exact[near] <= brute[near] + 1e-9)
    assert np.all(exact[near & (brute < 0.0)] < 0.0)


def test_a_box_given_as_a_mesh_keeps_its_clearances(shapes, postures):
    """Triangles and the winding number tell the same overlaps, and outside the same distances of capsules."""
    box = trimesh.creation.box([0.4, 0.3, 0.5])
    solid, mesh = (Solid(placed(shape)) for shape in (SHAPES[0], Mesh(box.vertices, box.faces)))
    exact, other = (shapes.to_obstacle(postures, item) for item in (solid, mesh))
    near = (exact < 0.2) & np.isfinite(other)
    assert np.array_equal(exact[near] < 0.0, other[near] < 0.0)
    is_round = np.array([shape.kind != "box" for shape in shapes.shapes])
    apart = near & is_round & (exact > 0.0)
    assert apart.sum() > 5
    assert np.abs(exact[apart] - other[apart]).max() < 1e-8
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (300, 3))
    inside = solid.distance(points) < 0.0
    assert np.array_equal(np.abs(winding_numbers(points, mesh.triangles.corners)) > 0.5, inside)
    reached = np.abs(solid.distance(points)) < REACH
    assert np.abs(solid.distance(points) - mesh.distance(points))[reached].max() < 1e-9


def test_segments_and_triangles_against_samples():
    """Distances of random segments to segments and triangles, and 0 where they cross."""
    rng = np.random.default_rng(3)
    a, b, c, d, e = rng.uniform(-1.0, 1.0, (5, 40, 3))
    s = np.linspace(0.0, 1.0, 120)
    first = a[:, None] + s[:, None] * (b - a)[:, None]
    second = c[:, None] + s[:, None] * (d - c)[:, None]
    brute = np.linalg.norm(first[:, :, None] - second[:, None], axis=-1).min(axis=(1, 2))
    exact = segment_segment(a, b, c, d)
    assert np.all(exact <= brute + 1e-12)
    assert np.abs(exact - brute).max() < 0.02
    corners = np.stack([c, d, e], axis=1)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 30), np.linspace(0.0, 1.0, 30))
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=-1).reshape(-1, 3)
    spread = np.einsum("wk,nki->nwi", weights, corners)
    brute = np.linalg.norm(first[:, ::4, None] - spread[:, None], axis=-1).min(axis=(1, 2))
    exact = segment_triangle(a, b, corners)
    assert np.all(exact <= brute + 1e-12)
    assert np.abs(exact - brute).max() < 0.1
    assert (exact == 0.0).sum() >= 2


def test_the_body_is_clear_of_itself_when_it_stands(shapes):
    """Standing upright no pair touches; a hand drawn into the pelvis does."""
    body = shapes.body
    standing = body.standing_posture()
    assert shapes.to_itself(standing[None]).min() > 0.0
    folded = standing.copy()
    folded[7 + body.joint_index("left_hip_flexion")] = body.upper[body.joint_index("left_hip_flexion")]
    folded[7 + body.joint_index("lumbar_flexion")] = body.upper[body.joint_index("lumbar_flexion")]
    assert shapes.to_itself(folded[None]).min() < 0.0
