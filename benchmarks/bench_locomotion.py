"""Walking paths and the weights of their cost.

Run with ``pytest benchmarks/bench_locomotion.py``; the targets are those of the thesis' experiment, one after
the other, and a round is one path.
"""

import itertools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manikin.walking import PROSE_ORDER, START, WalkObstacle, experiment_targets, walking_path
from manikin.walking.path.path_plan import initial_guesses
from manikin.walking.path.path_program import free_optimum, solve

sys.path.append(str(Path(__file__).parents[1] / "docs"))

from identify_objective import RecordedWalk, identify_objective

OBSTACLES = {
    "pillar": WalkObstacle.disc("pillar", (0.0, 1.5), 0.3),
    "box": WalkObstacle("box", [(-0.4, 1.0), (0.2, 1.0), (0.2, 1.6), (-0.4, 1.6)]),
    "person": WalkObstacle.moving_disc("person", (0.0, 4.0), [(-1.5, 1.5), (1.5, 1.5)], 0.3),
}


def per_target(benchmark, function):
    """Measure a function of the number of a target over all of them, three times."""
    numbers = itertools.cycle(range(106))
    benchmark.pedantic(lambda: function(next(numbers)), rounds=3 * 106, warmup_rounds=1)


def test_path_from_the_table(benchmark):
    """The default objective; ``worse`` counts targets for which another guess leads to a cheaper path."""
    targets = experiment_targets()
    per_target(benchmark, lambda i: walking_path(START, targets[i]))
    paths = [walking_path(START, target) for target in targets]
    best = [min(one.cost for one in optima(path.task)) for path in paths]
    benchmark.extra_info["from the table"] = sum(path.guess.startswith("table") for path in paths)
    benchmark.extra_info["worse"] = sum(
        path.cost > 1.0001 * cost for path, cost in zip(paths, best, strict=True)
    )


def optima(task):
    """What Newton's method reaches from all guesses."""
    return [path for guess in initial_guesses(task) if (path := free_optimum(task, guess)) is not None]


def test_path_from_all_guesses_by_newton(benchmark):
    tasks = [walking_path(START, target).task for target in experiment_targets()]
    per_target(benchmark, lambda i: optima(tasks[i]))


def test_path_from_all_guesses_by_ipopt(benchmark):
    """As it was before; a limit that is far away keeps Newton's method out."""
    tasks = [replace(walking_path(START, target).task, max_speed=50.0) for target in experiment_targets()]
    per_target(benchmark, lambda i: [solve(tasks[i], guess) for guess in initial_guesses(tasks[i])])


@pytest.mark.parametrize("kind", ["straight", "turning"])
def test_path_from_one_guess(benchmark, kind):
    tasks = [walking_path(START, target).task for target in experiment_targets()]
    guesses = [next(guess for guess in initial_guesses(task) if guess.name == kind) for task in tasks]
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
