"""Processor time of the parts of planning random scenes, without the fit and the execution.

Run with ``python benchmarks/planning_times.py stairs:9600 flat:9600`` (family and seed of each scene) and
``OMP_NUM_THREADS=1``. Each line has the seconds of every part, and those of all posture searches inside of
them, with a digest of the swings and guide postures, which tells whether a change has changed them. Compare
two versions by turns on the same machine.
"""

import contextlib
import hashlib
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from manikin.kinematics.posture_search import PostureSolver
from manikin.pipeline import runner
from manikin.pipeline.stages import whole_body_stage
from manikin.planning.whole_body import key_postures, swing_planner
from manikin.planning.whole_body.fit_job import FitJob
from manikin.planning.whole_body.plan_whole_body import _Planner
from manikin.scenarios import problems
from manikin.scenarios.families import FAMILIES, draw_scene

PARTS = (
    ("contacts", runner, "plan_contacts"), ("regions", problems, "_regions"),
    ("centre of mass", whole_body_stage.com, "plan_com"), ("centre of mass", key_postures, "plan_com"),
    ("key postures", whole_body_stage, "find_key_postures"), ("swings", swing_planner, "plan_swing"),
    ("guide", _Planner, "_guide"), ("posture searches", PostureSolver, "solve"),
)  # fmt: skip
"""Names of the parts with the functions that do them."""


class _Planned(Exception):
    """All is planned that is looked at."""


class Times:
    """Adds up the processor time of functions, and the answers of swings and guides."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.found = hashlib.sha1(usedforsecurity=False)

    def timed(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed."""

        def call(*args: Any, **options: Any) -> Any:
            began = time.process_time()
            result = function(*args, **options)
            self.seconds[name] += time.process_time() - began
            answer = {"swings": lambda: result.curve.control_position, "guide": lambda: result.configurations}
            if name in answer:
                self.found.update(np.ascontiguousarray(answer[name]()).tobytes())
            return result

        return call


def _end(*_args: Any, **_options: Any) -> None:
    raise _Planned


def main(scenes: list[str]) -> None:
    """Print a line for each scene."""
    times = Times()
    for name, owner, function in PARTS:
        setattr(owner, function, times.timed(name, getattr(owner, function)))
    FitJob.attempt = runner.execute_motion = _end
    for scene in scenes:
        family, seed = scene.split(":")
        times.seconds.clear()
        with contextlib.suppress(_Planned):
            runner.run(draw_scene(FAMILIES[family], int(seed)))
        parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in times.seconds.items())
        print(f"{scene}: {parts} s; {times.found.hexdigest()[:8]}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
