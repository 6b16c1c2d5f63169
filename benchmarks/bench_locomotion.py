"""Walking paths and the weights of their cost.

Run with ``pytest benchmarks/bench_locomotion.py``; the targets are those of the thesis' experiment, one after
the other, and a round is one path.
"""

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from manikin.walking import LITERAL_ORDER, PROSE_ORDER, START, WalkObstacle, experiment_targets, walking_path
from manikin.walking.path.path_plan import _guesses, kinds_of_guesses
from manikin.walking.path.path_program import solve

sys.path.append(str(Path(__file__).parents[1] / "docs"))

from identify_objective import RecordedWalk, identify_objective

ORDERS = {"prose": PROSE_ORDER, "literal": LITERAL_ORDER}

OBSTACLES = {
    "pillar": WalkObstacle.disc("pillar", (0.0, 1.5), 0.3),
    "box": WalkObstacle("box", [(-0.4, 1.0), (0.2, 1.0), (0.2, 1.6), (-0.4, 1.6)]),
    "person": WalkObstacle.moving_disc("person", (0.0, 4.0), [(-1.5, 1.5), (1.5, 1.5)], 0.3),
}


def per_target(benchmark, function):
    """Measure a function of the number of a target over all of them, three times."""
    numbers = itertools.cycle(range(106))
    benchmark.pedantic(lambda: function(next(numbers)), rounds=3 * 106, warmup_rounds=1)


@pytest.mark.parametrize("order", ORDERS)
def test_path_from_all_guesses(benchmark, order):
    targets = experiment_targets()
    per_target(benchmark, lambda i: walking_path(START, targets[i], ORDERS[order]))
    paths = [walking_path(START, target, ORDERS[order]) for target in targets]
    wanted = sum(len(kinds_of_guesses(path.task.start, path.task.goal)) for path in paths)
    benchmark.extra_info["converged"] = f"{sum(len(path.others) for path in paths)} of {wanted} guesses"


@pytest.mark.parametrize("kind", ["straight", "turning"])
def test_path_from_one_guess(benchmark, kind):
    tasks = [walking_path(START, target).task for target in experiment_targets()]
    guesses = [next(guess for guess in _guesses(task) if guess.name == kind) for task in tasks]
    per_target(benchmark, lambda i: solve(tasks[i], guesses[i]))


def test_path_from_a_neighbour(benchmark):
    targets = experiment_targets()
    paths = [walking_path(START, target) for target in targets]
    per_target(benchmark, lambda i: walking_path(START, targets[i] + [0.02, 0.02, 0.02], like=paths[i]))


@pytest.mark.parametrize("name", OBSTACLES)
def test_path_around(benchmark, name):
    benchmark.pedantic(
        lambda: walking_path(START, (0.0, 3.0, np.pi / 2), obstacles=[OBSTACLES[name]]),
        rounds=5,
        warmup_rounds=1,
    )


def test_weights_from_five_walks(benchmark):
    rng = np.random.default_rng(0)
    walks = []
    for target in [(1, 0, 0), (-1, 1, np.pi / 4), (2, 1, np.pi / 2), (-2, 0.5, np.pi), (1.5, -1, -np.pi / 4)]:
        path = walking_path(START, target)
        noise = rng.normal(size=path.place.shape) * [0.01, 0.01, 0.02]
        walks.append(RecordedWalk(path.time, path.place + noise, START, path.place[-1]))
    found = benchmark.pedantic(lambda: identify_objective(walks), rounds=5, warmup_rounds=1)
    assert found.objective.weights == pytest.approx(PROSE_ORDER.weights, rel=0.05)
