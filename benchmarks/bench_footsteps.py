"""Footsteps alone of about 30 contacts, flat and up stairs: `pytest benchmarks/bench_footsteps.py`.

Bodies of random stature, mass and sex; ways of random place and heading, on the flat with turned goals.
"""

import time

import numpy as np
import pytest

from manikin.body import human
from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.contacts import Endpoints, Habit, PostureFinder, WalkSearch
from manikin.scene import Box, Obstacle, Scene

WAYS = 20
FLAT = 12.0  # length of a flat way [m]
STEPS = 28  # of stairs


def flat(rng, put, turn):  # noqa: ARG001
    return Scene(), put(FLAT, 0.0), rng.uniform(-1.5, 1.5)


def stairs(rng, put, turn):
    rise, tread = rng.uniform(0.14, 0.19), rng.uniform(0.26, 0.32)
    depths = [tread] * (STEPS - 1) + [1.4]
    ends = 0.6 + np.cumsum(depths)
    boxes = [
        Obstacle(
            f"step{k}", Box((depth, 1.2, (k + 1) * rise)), turn, put(end - 0.5 * depth, 0.5 * (k + 1) * rise)
        )
        for k, (depth, end) in enumerate(zip(depths, ends, strict=True))
    ]
    return Scene(boxes), put(ends[-1] - 0.7, STEPS * rise), 0.0


def random_way(make, seed):
    """Body, scene, and stages at the start and the goal."""
    rng = np.random.default_rng(seed)
    stature = rng.uniform(1.5, 1.95)
    body = human(stature, rng.uniform(19.0, 32.0) * stature**2, ("male", "female")[seed % 2])
    yaw, at = rng.uniform(-np.pi, np.pi), rng.uniform(-3.0, 3.0, 2)
    turn = rotation_from_yaw(yaw)
    scene, goal, turned = make(rng, lambda x, z: turn @ [x, 0.0, z] + [*at, 0.0], turn)
    ends = Endpoints(PostureFinder(body, scene), 0.7)
    start = ends.find(at, yaw, Habit.STANDING).stage
    return body, scene, start, ends.find(goal[:2], yaw + turned, Habit.STANDING).stage


@pytest.mark.parametrize("make", [flat, stairs])
def test_footsteps(benchmark, make):
    """CPU time of the preparation in a scene and the best way, and its contacts, are in ``extra_info``.

    What belongs to the body alone, its postures of the trunk and reach of steps, is there before.
    """
    took, contacts = [], []

    def ways():
        for seed in range(100, 100 + WAYS):
            body, scene, start, goal = random_way(make, seed)
            poser = PostureFinder(body, scene)
            WalkSearch(poser, start, goal)
            begun = time.process_time()
            way = WalkSearch(poser, start, goal).search.best()
            took.append(time.process_time() - begun)
            contacts.append(len(way) - 2)

    benchmark.pedantic(ways, rounds=1)
    benchmark.extra_info["contacts"] = f"{min(contacts)} to {max(contacts)}"
    benchmark.extra_info["average_s"] = float(np.mean(took))
    benchmark.extra_info["median_s"] = float(np.median(took))
    benchmark.extra_info["95_percent_s"] = float(np.percentile(took, 95))
    benchmark.extra_info["worst_s"] = float(np.max(took))
