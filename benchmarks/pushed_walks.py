"""Pushes of a walker at 1.2 m/s in the physics engine, with moved steps and without.

``python benchmarks/pushed_walks.py`` pushes the thorax with 150 N for 0.1 s from four sides at phases of a
step, from the landing of the left foot to that of the right one. Held is a push after which the body is on
its plan again and the walk ends within 10 cm of where it was planned. ``--unmoved`` leaves all steps where
they were planned. Some ten seconds each on one core. Directions are those of the force, seen from the walker.
"""

import argparse

import numpy as np

from manikin.body import human
from manikin.control import ControlSettings, ReturnSettings, ShiftSettings
from manikin.scenarios import load_scenario
from manikin.simulation import execute, push_on_the_way
from manikin.simulation.execution import ARRIVED
from manikin.walking import step_along
from manikin.walking.gait.balanced_walk import balanced_walk
from manikin.walking.path.steady_walk import SteadyWalk

SPEED, IMPULSE, DURATION = 1.2, 15.0, 0.1


def main() -> None:
    """Push, and tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--unmoved", action="store_true", help="leave the steps where they were planned")
    parser.add_argument("--phases", type=float, nargs="+", default=[0.1, 0.5, 0.8], help="shares of a step")
    parser.add_argument(
        "--directions", type=float, nargs="+", default=[0.0, 90.0, 180.0, 270.0], help="[deg]"
    )
    options = parser.parse_args()
    body, scene = human(), load_scenario("stroll").build_scene()
    stepped = step_along(SteadyWalk(np.array([SPEED, 0.0, 0.0]), hold=4.0, ramp=1.5))
    walk = balanced_walk(body, stepped)
    lands = sorted(step.lands for step in stepped.footprints.of("left_foot"))
    begin = next(time for time in lands if time > 2.3)
    end = next(step.lands for step in stepped.footprints.of("right_foot") if step.lands > begin)
    stepping = None if options.unmoved else ShiftSettings()
    settings = ControlSettings(returning=ReturnSettings(), stepping=stepping, watch_toes=True)
    held = []
    for phase in options.phases:
        for direction in options.directions:
            at = begin + phase * (end - begin)
            push = push_on_the_way(walk.motion, IMPULSE / DURATION, direction, at, DURATION)
            run = execute(body, scene, walk.motion, walk.schedule, pushes=[push], settings=settings, hold=0.5)
            held.append(run.push is not None and run.push.recovered and run.moved_m <= ARRIVED)
            outcome = run.failure or f"held, the plan moved by {run.moved_m:.3f} m"
            print(f"phase {phase:g}, {direction:g} deg: {outcome}", flush=True)
    print(f"{sum(held)} of {len(held)} held")


if __name__ == "__main__":
    main()
