"""Wrench polytopes and margin queries. Run: ``pytest benchmarks/bench_balance.py``."""

import numpy as np
import pytest

from manikin.balance import evaluate_balance, pseudo_wrench, stability_margins, wrench_polytope
from manikin.contact import Stance, grasp, sole

LEFT = sole("left_foot", (0.0, 0.1, 0.0), 0.1, length=0.28, width=0.12, friction=0.7)
RIGHT = sole("right_foot", (0.0, -0.1, 0.0), -0.1, length=0.28, width=0.12, friction=0.7)
ALIGNED = sole("right_foot", (0.0, -0.1, 0.0), 0.1, length=0.28, width=0.12, friction=0.7)
STEP = sole("right_foot", (0.5, -0.1, 0.2), -0.1, length=0.28, width=0.12, friction=0.7)
SLOPE = sole(
    "right_foot", (0.5, -0.1, 0.2), -0.1, length=0.28, width=0.12, friction=0.7, normal=(0.3, 0.1, 1.0)
)
HAND = grasp("right_hand", (0.4, -0.2, 1.1), max_force=100.0)
FIRM_HAND = grasp("right_hand", (0.4, -0.2, 1.1), max_force=100.0, max_moment=5.0)
OTHER_HAND = grasp("left_hand", (0.4, 0.3, 1.2), max_force=100.0)


def capped(contact_yaw, y, name):
    return sole(
        name, (0.0, y, 0.0), contact_yaw, length=0.28, width=0.12, friction=0.7, normal_force_cap=800.0
    )


STANCES = {
    "one sole": Stance([LEFT], 1500.0),
    "two soles": Stance([LEFT, RIGHT], 1500.0),
    "two aligned soles": Stance([LEFT, ALIGNED], 1500.0),
    "two soles on a step": Stance([LEFT, STEP], 1500.0),
    "two soles, one on a slope": Stance([LEFT, SLOPE], 1500.0),
    "two soles and a grasp": Stance([LEFT, RIGHT, HAND], 1500.0),
    "two soles, one on a slope, and a grasp": Stance([LEFT, SLOPE, HAND], 1500.0),
    "two soles and a firm grasp": Stance([LEFT, RIGHT, FIRM_HAND], 1500.0),
    "two soles and two grasps": Stance([LEFT, RIGHT, HAND, OTHER_HAND], 1500.0),
    "two soles with own caps": Stance([capped(0.1, 0.1, "left_foot"), capped(-0.1, -0.1, "right_foot")]),
    "two soles with own caps and a sum": Stance(
        [capped(0.1, 0.1, "left_foot"), capped(-0.1, -0.1, "right_foot")], 1200.0
    ),
}


@pytest.mark.parametrize("name", STANCES)
def test_wrench_polytope(benchmark, name):
    W = benchmark(wrench_polytope, STANCES[name])
    benchmark.extra_info["facets"] = len(W)


def random_wrenches(count=10_000):
    rng = np.random.default_rng(0)
    com = rng.normal(size=(count, 3)) * [0.05, 0.05, 0.02] + [0.0, 0.0, 0.9]
    return com, pseudo_wrench(79.0, com, rng.normal(size=(count, 3)))


@pytest.mark.parametrize("name", ["two aligned soles", "two soles", "two soles and a grasp"])
def test_ten_thousand_margins(benchmark, name):
    W = wrench_polytope(STANCES[name])
    _, wrenches = random_wrenches()
    benchmark(W.margin, wrenches)


def test_thousand_of_all_margins(benchmark):
    W = wrench_polytope(STANCES["two soles"])
    com, wrenches = random_wrenches(1000)
    benchmark(stability_margins, W, wrenches, com)


def test_report(benchmark):
    benchmark(evaluate_balance, STANCES["two soles"], 79.0, (0.02, 0.01, 0.9))
