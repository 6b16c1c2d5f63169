"""Numbers of different contact plans, acts and guides over seeds: `python benchmarks/sweep_contacts.py`.

Results are different if a number differs in any bit; only different ones are evidence.  The guides are those
of `bench_reachability.py`.
"""

import argparse
import hashlib
import importlib.util
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from manikin.body import human
from manikin.kinematics import reach_volume
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning.guide import abstraction_of, plan_guide
from manikin.scenarios import load_scenario

SCENARIOS = ("crouch", "stairs", "stand-up-chair", "stand-up-sofa", "climb-wall", "truck-egress")
LIMITS_ALONE = ("insect-books", "push-cupboard", "pull-rope")


def sweep(name: str, seeds: int, search: Callable[[int], FloatArray | None]) -> None:
    """Print how many seeds give a result, how many of these are different, and the CPU time of each."""
    digests, seconds = [], []
    for seed in range(seeds):
        began = time.process_time()
        values = search(seed)
        seconds.append(time.process_time() - began)
        if values is not None:
            digests.append(hashlib.sha256(np.ascontiguousarray(values).tobytes()).digest())
    found = f"{len(digests)} of {seeds} found, {len(set(digests))} different"
    print(f"{name:32} {found}, {np.mean(seconds):.2f} s (largest {max(seconds):.2f})", flush=True)


def contacts(name: str, ranges: str) -> Callable[[int], FloatArray | None]:
    """Search for the contacts of a scenario, within joint limits or learnt ranges."""
    scenario = load_scenario(name).with_overrides([f"contacts.ranges={ranges}"]).in_task_frame()
    body, scene = scenario.build_body(), scenario.build_scene()

    def search(seed: int) -> FloatArray | None:
        plan = find_supports(scenario, body, scene, np.random.default_rng(seed)).plan
        return None if plan is None else plan.postures

    return search


def main() -> None:
    """Print one line for each scenario and each world."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    seeds = parser.parse_args().seeds
    for name in SCENARIOS:
        for ranges in ("limits", "learnt"):
            sweep(f"{name} {ranges}", seeds, contacts(name, ranges))
    for name in LIMITS_ALONE:
        sweep(name, seeds, contacts(name, "limits"))
    body, rng = human(1.75, 79.0, "male"), np.random.default_rng(0)
    creature = abstraction_of(body, [reach_volume(body, limb, rng) for limb in body.limbs])
    spec = importlib.util.spec_from_file_location("worlds", Path(__file__).parent / "bench_reachability.py")
    assert spec is not None
    assert spec.loader is not None
    worlds = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(worlds)
    for name, build in worlds.WORLDS.items():
        try:
            world, task = build(creature)
        except pytest.skip.Exception:
            continue

        def search(seed: int) -> FloatArray | None:
            path = plan_guide(world, task, np.random.default_rng(seed)).path  # noqa: B023
            return None if path is None else path.control_points

        sweep(f"guide {name}", seeds, search)


if __name__ == "__main__":
    main()
