"""Distances between a human and a scene: `pytest benchmarks/bench_scene.py`."""

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from manikin.body import human
from manikin.contact import sole
from manikin.numerics.spatial import rotation_from_yaw
from manikin.scene import (
    Box,
    Capsule,
    Cylinder,
    FootingTable,
    Mesh,
    Obstacle,
    Proximity,
    Scene,
    Sphere,
    SphereProximity,
    cover,
)

FEET = frozenset((f"{side}_{part}", "floor") for side in ("left", "right") for part in ("foot", "toes"))


@pytest.fixture(scope="module")
def person():
    return human(1.75, 79.0, "male")


@pytest.fixture(scope="module")
def scene():
    """Five obstacles and the floor."""
    return Scene(
        [
            Obstacle("platform", Box((1.0, 1.0, 0.2)), translation=(1.0, 0.0, 0.1)),
            Obstacle("roof", Box((1.0, 1.5, 0.05)), translation=(1.2, 0.0, 1.5)),
            Obstacle("post", Cylinder(0.1, 2.0), translation=(0.0, 1.0, 1.0)),
            Obstacle("rail", Capsule(0.05, 0.5), translation=(-0.5, 0.5, 1.0)),
            Obstacle("ball", Sphere(0.2), translation=(0.6, -0.4, 0.8)),
        ]
    )


@pytest.fixture(scope="module")
def motion(person):
    """4 s at 1 kHz: a walk forward with swinging joints."""
    q, joints = person.standing_posture(), np.arange(person.nv - 6)
    moves = [
        np.concatenate([[2e-4 * i, 0, 0.3], np.zeros(3), 0.1 * np.sin(joints + i / 400)]) for i in range(4000)
    ]
    return np.array([pin.integrate(person.pinocchio, q, move) for move in moves])


@pytest.mark.parametrize("activation", [0.03, 0.1, 0.3])
def test_evaluate(benchmark, person, scene, activation):
    near = Proximity(person, scene)
    q = person.standing_posture()
    result = benchmark(near.evaluate, q, activation, FEET)
    benchmark.extra_info["rows"] = len(result)
    benchmark.extra_info["pairs"] = len(near.pairs)


def test_evaluate_every_pair(benchmark, person, scene):
    near = Proximity(person, scene)
    benchmark(near.evaluate, person.standing_posture(), 100.0)


def test_minimum(benchmark, person, scene):
    near = Proximity(person, scene)
    benchmark(near.minimum, person.standing_posture(), FEET)


def test_minimum_over_four_seconds(benchmark, person, scene, motion):
    near = Proximity(person, scene)
    benchmark.pedantic(near.minimum_over, (motion, FEET), rounds=3)


def test_minimum_of_each_of_four_seconds(benchmark, person, scene, motion):
    """What ``minimum_over`` saves."""
    near = Proximity(person, scene)
    benchmark.pedantic(lambda: min(near.minimum(q, FEET).distance for q in motion), rounds=1)


def test_evaluate_spheres(benchmark, person, scene):
    near = SphereProximity(person, scene)
    benchmark(near.evaluate, person.standing_posture(), 0.1, FEET)


@pytest.mark.parametrize("distance", [0.35, 0.7], ids=["through", "beside"])
def test_evaluate_at_a_closed_mesh(benchmark, person, distance):
    """A wheel of 2048 triangles, through the trunk or just before it."""
    ring = trimesh.creation.torus(0.4, 0.05)
    wheel = Obstacle("wheel", Mesh(ring.vertices, ring.faces), translation=(distance, 0.0, 1.0))
    near = Proximity(person, Scene([wheel]))
    benchmark.extra_info["minimum"] = near.minimum(person.standing_posture(), FEET).distance
    benchmark(near.evaluate, person.standing_posture(), 0.1, FEET)


def test_prepare(benchmark, person, scene):
    benchmark(Proximity, person, scene)


def test_supporting_surface(benchmark, scene):
    foot = sole("left_foot", (1.0, 0.0, 0.2), length=0.28, width=0.12, friction=0.7)
    benchmark(scene.supporting_surface, foot)


@pytest.fixture(scope="module")
def rubble():
    """Sixteen turned boxes in each other and fourteen steps, on the floor."""
    rng = np.random.default_rng(1)
    boxes = [
        Obstacle(
            f"box_{k}", Box(rng.uniform(0.1, 0.6, 3)), rotation_from_yaw(turn), (*rng.uniform(-1, 1, 2), 0.0)
        )
        for k, turn in enumerate(rng.uniform(0.0, 6.0, 16))
    ]
    steps = [
        Obstacle(f"step_{k}", Box((0.25, 1.0, h)), translation=(1.5 + 0.25 * k, 0.0, h / 2))
        for k, h in enumerate(0.15 * np.arange(1, 15))
    ]
    return [*boxes, *steps]


def test_surfaces_of_thirty_boxes(benchmark, rubble):
    benchmark(lambda: Scene(rubble).surfaces)


def test_a_thousand_soles(benchmark, rubble):
    """About half of them over an edge."""
    surfaces = Scene(rubble).surfaces_facing((0.0, 0.0, 1.0), 0.1)
    sole = np.array([[0.14, 0.05], [0.14, -0.05], [-0.14, -0.05], [-0.14, 0.05]])
    table, rng = FootingTable(surfaces, sole), np.random.default_rng(2)
    places = table.under(rng.uniform((-1.2, -1.2), (4.0, 1.2), (1000, 2)), rng.uniform(-3.0, 3.0, 1000))
    chosen = (places.numbers[:1000], places.positions[:1000], places.rotations[:1000])
    footing = table.place(*chosen)
    benchmark.extra_info["over_an_edge"] = float(np.mean((footing.share > 0.0) & (footing.share < 1.0)))
    benchmark(table.place, *chosen)


def test_cover_a_mesh(benchmark):
    ring = trimesh.creation.torus(0.18, 0.015)
    mesh = Mesh(ring.vertices, ring.faces)
    benchmark.pedantic(lambda: cover(mesh, count=21), rounds=3)
