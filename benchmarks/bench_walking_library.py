"""Whole-body walks: a frame under directives, and a walk along a path.

Run with ``pytest benchmarks/bench_walking_library.py``. A round of the first is one frame, at most 1 ms; of
the second one walk, at most 10 ms per metre of ``extra_info["length_m"]`` (the thesis: 90 ms).
"""

import itertools

import numpy as np
import pytest

from manikin.walking import WalkController, load_library, walk_along, walking_path

DIRECTIVES = {
    "straight": [(1.2, 0.0, 0.0)],
    "changing": [(1.2, 0.0, 0.5), (0.0, 0.4, 0.0), (2.5, 0.0, 0.0), (-0.6, 0.0, 0.0)],
    "every frame": [(1.2 + 0.2 * np.sin(k), 0.1 * np.cos(k), 0.3 * np.sin(2.0 * k)) for k in range(100)],
    "beyond": [(9.0, 0.0, 1.0)],
}
GOALS = {"4 m": (4.0, 0.0, 0.0), "round a corner": (3.0, 3.0, np.pi / 2), "1 m aside": (0.0, 1.0, 0.0),
         "0.5 m": (0.5, 0.0, 0.0)}  # fmt: skip


@pytest.mark.parametrize("name", DIRECTIVES)
def test_frame(benchmark, name):
    orders = DIRECTIVES[name]
    hold = 1 if len(orders) > 10 else 60
    directives = itertools.cycle([order for order in orders for _ in range(hold)])
    controller = WalkController()
    benchmark.pedantic(lambda: controller.step(1.0 / 60.0, next(directives)), rounds=600, warmup_rounds=60)


@pytest.mark.parametrize("name", GOALS)
def test_walk_along(benchmark, name):
    path = walking_path((0.0, 0.0, 0.0), GOALS[name], max_speed=1.4)
    benchmark.extra_info["length_m"] = path.length
    benchmark.pedantic(walk_along, (path,), rounds=30, warmup_rounds=2)


def test_load(benchmark, tmp_path):
    from manikin.walking import save_library

    save_library(load_library(), tmp_path / "library.npz")
    benchmark.pedantic(load_library, (tmp_path / "library.npz",), rounds=10, warmup_rounds=1)
