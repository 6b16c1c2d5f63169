"""Guides for the root of a human: `pytest benchmarks/bench_reachability.py`.

The reach of the limbs is that of the body, from 10,000 samples each.
"""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manikin.body import human
from manikin.kinematics import reach_volume
from manikin.planning.guide import (
    Condition,
    GuideTask,
    GuideWorld,
    LimbRule,
    ReachabilityChecker,
    SamplingRegion,
    UsableSurface,
    abstraction_of,
    offline_roadmap,
    plan_guide,
    request,
    root_pose,
)
from manikin.planning.guide.steering import LocalPlanner
from manikin.scene import Box, Mesh, Obstacle, Scene, load_mesh

TRUCK = Path(__file__).parents[2] / "shared/data/scenes/hpp_environments/truck.stl"
LEGS = ("left_leg", "right_leg")
HOLDS = (
    (0.27, -0.11, 0.45), (0.21, 0.22, 0.61), (0.22, -0.2, 0.77), (0.1, 0.2, 0.93), (0.22, -0.24, 1.16),
    (0.15, 0.22, 1.38), (0.22, -0.27, 1.66), (0.1, 0.28, 1.84), (0.26, -0.24, 1.95), (0.18, 0.34, 2.12),
    (0.25, -0.1, 2.28), (0.31, 0.22, 2.48),
)  # fmt: skip


@pytest.fixture(scope="module")
def creature():
    body, rng = human(1.75, 79.0, "male"), np.random.default_rng(0)
    return abstraction_of(body, [reach_volume(body, limb, rng) for limb in body.limbs])


def crouch(creature):
    """Under a block 70 cm above the floor, between two walls."""
    scene = Scene(
        [
            Obstacle("block", Box((1.5, 3.0, 1.0)), translation=(1.5, 0.0, 1.2)),
            Obstacle("left", Box((3.5, 0.1, 2.0)), translation=(1.5, 1.5, 1.0)),
            Obstacle("right", Box((3.5, 0.1, 2.0)), translation=(1.5, -1.5, 1.0)),
        ]
    )
    region = SamplingRegion((-1, -1.5, 0), (4, 1.5, 1.4), (-0.6, 0.6), (-0.2, 1.8), (-0.3, 0.3))
    condition = Condition.standing_or_bent(LEGS, creature.limb_names)
    task = GuideTask(root_pose((-0.3, 0.0, 0.87)), root_pose((3.3, 0.0, 0.87)))
    return GuideWorld(scene, creature, region, condition), task


def climb(creature):
    """Up a dozen holds in the air, three limbs at a time."""
    holds = [Obstacle(f"hold{i}", Box((0.1, 0.1, 0.1)), translation=place) for i, place in enumerate(HOLDS)]
    region = SamplingRegion((-1, -1, 0.5), (1, 1, 2.2), (-0.5, 0.5), (-0.3, 0.5), (-0.3, 0.3))
    task = GuideTask(root_pose((-0.4, 0.0, 0.85)), root_pose((-0.4, 0.0, 1.8)))
    return GuideWorld(Scene(holds), creature, region, Condition.limbs(at_least=3)), task


def cabin(creature):
    """Out of a cabin with blocked doors through its windscreen: a mesh of 7,680 triangles."""
    panels = (
        ((2.4, 1.8, 0.3), (-0.4, 0.0, 0.85)),  # floor
        ((2.3, 1.8, 0.1), (-0.4, 0.0, 2.35)),  # roof
        ((0.1, 1.8, 1.4), (-1.6, 0.0, 1.65)),  # back
        ((2.3, 0.1, 1.4), (-0.4, 0.9, 1.65)),  # left door
        ((2.3, 0.1, 1.4), (-0.4, -0.9, 1.65)),  # right door
        ((0.1, 1.8, 0.3), (0.7, 0.0, 1.15)),  # below the windscreen
        ((0.1, 0.15, 0.9), (0.7, 0.1, 1.8)),  # post in the windscreen
        ((0.5, 1.7, 0.3), (-0.1, 0.0, 1.1)),  # seat
        ((0.15, 1.7, 0.35), (-0.3, 0.0, 1.35)),  # its back
        ((0.9, 1.8, 0.9), (1.3, 0.0, 0.45)),  # bonnet
    )
    boxes = [
        trimesh.creation.box(size, trimesh.transformations.translation_matrix(place))
        for size, place in panels
    ]
    fine = [box.subdivide().subdivide().subdivide() for box in boxes]
    whole = trimesh.util.concatenate(fine)
    scene = Scene([Obstacle("cabin", Mesh(whole.vertices, whole.faces))])
    region = SamplingRegion((-1.8, -1.2, 0.2), (3.2, 1.4, 2.4), (-0.8, 0.8), (-0.5, 1.7), (-0.4, 0.4))
    task = GuideTask(root_pose((-0.85, -0.4, 1.25)), root_pose((2.6, -0.4, 0.87)))
    return GuideWorld(scene, creature, region, Condition.limbs(at_least=2)), task


def truck(creature):
    """Out of the truck of the thesis through its windscreen; its mesh is not part of this repository."""
    if not TRUCK.exists():
        pytest.skip(f"{TRUCK} is not there")
    scene = Scene([Obstacle("truck", load_mesh(TRUCK))], floor_height=0.0)
    region = SamplingRegion((-1.8, -1.2, 0.2), (3.2, 1.4, 2.4), (-0.8, 0.8), (-0.5, 1.7), (-0.4, 0.4))
    task = GuideTask(root_pose((-0.6, -0.22, 1.08)), root_pose((2.9, -0.4, 0.87)))
    return GuideWorld(scene, creature, region, Condition.limbs(at_least=2)), task


def stairs(creature):
    """Up four steps of 0.16 m, both legs within reach of them."""
    steps = ((0.66, 0.08), (0.98, 0.16), (1.30, 0.24))
    boxes = [
        Obstacle(f"step{n}", Box((0.32, 1.2, 2.0 * z)), translation=(x, 0.0, z))
        for n, (x, z) in enumerate(steps)
    ]
    boxes.append(Obstacle("landing", Box((1.2, 1.2, 0.64)), translation=(2.06, 0.0, 0.32)))
    region = SamplingRegion((-0.5, -0.6, 0.5), (2.6, 0.6, 1.7), (-0.6, 0.6), (-0.2, 1.0), (-0.1, 0.1))
    ground = UsableSurface((0.0, 0.0, 1.0), float(np.deg2rad(35.0)))
    condition = Condition((LimbRule(LEGS, 2),), dict.fromkeys(LEGS, ground))
    task = GuideTask(root_pose((0.0, 0.0, 0.87)), root_pose((2.0, 0.0, 1.51)))
    return GuideWorld(Scene(boxes, floor_height=0.0), creature, region, condition), task


WORLDS = {"crouch": crouch, "climb": climb, "cabin": cabin, "truck": truck, "stairs": stairs}


@pytest.fixture(scope="module", params=WORLDS)
def asked(request, creature):
    return WORLDS[request.param](creature)


def test_condition(benchmark, asked):
    """A thousand random poses of the region."""
    world, _ = asked
    checker, rng = (
        ReachabilityChecker(world.abstraction, world.scene, world.condition),
        np.random.default_rng(0),
    )
    places = rng.uniform(world.region.lower, world.region.upper, (1000, 3))
    poses = np.hstack([places, world.region.turns(1000, rng)])
    benchmark.extra_info["held"] = sum(benchmark(lambda: [checker.holds(pose) for pose in poses]))


def test_offline_roadmap(benchmark, asked):
    world, _ = asked
    streams = (np.random.default_rng(seed) for seed in range(10))
    roadmap = benchmark.pedantic(
        lambda stream: offline_roadmap(world, stream), setup=lambda: ((next(streams),), {}), rounds=5
    )
    benchmark.extra_info["nodes"] = len(roadmap.poses)


def test_request(benchmark, asked):
    """Start and goal joined to a finished roadmap, and A*."""
    world, task = asked
    roadmap = offline_roadmap(world, np.random.default_rng(0))
    planner = LocalPlanner(world.checker(), (task.start, task.goal))
    route = benchmark(lambda: request(roadmap, planner, task.start, task.goal, np.random.default_rng(0)))
    benchmark.extra_info["found"] = route.succeeded


def test_refinement(benchmark, asked):
    """With a finished roadmap: request, pruning, spline and shortcuts."""
    world, task = asked
    roadmap = offline_roadmap(world, np.random.default_rng(0))
    result = benchmark(lambda: plan_guide(world, task, np.random.default_rng(0), roadmap))
    assert result.succeeded, result.failure


def test_guide(benchmark, asked):
    """From nothing to a smooth path, for one task."""
    world, task = asked
    streams = (np.random.default_rng(seed) for seed in range(10))
    result = benchmark.pedantic(
        lambda stream: plan_guide(world, task, stream), setup=lambda: ((next(streams),), {}), rounds=5
    )
    benchmark.extra_info["failure"] = result.failure
    assert result.succeeded, result.failure
