"""Plans that are the same to the last bit, whatever the process did before, however it hashes, and where.

``python -m tests.robustness.determinism NAME...`` makes them in this order, in a process of its own, and
prints a digest of each as JSON.
"""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from tests.robustness.leaks import contact_request

from manikin.pipeline.runner import run
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning.com import plan_com
from manikin.scenarios import load_scenario
from manikin.scenarios.families import FAMILIES, draw_scene


def _contacts(family: str) -> list[np.ndarray]:
    """Postures and centres of mass on the planned contacts of a scene of a family."""
    job = draw_scene(FAMILIES[family], 0)
    found = find_supports(job, job.build_body(), job.build_scene(), np.random.default_rng(job.seed))
    assert found.plan is not None
    return [array for stage in found.plan.stages for array in (stage.q, stage.com)]


def _centre_of_mass(name: str) -> list[np.ndarray]:
    """Control points and key instants of a trajectory."""
    found = plan_com(load_scenario(name).build_centroidal_problem()).trajectory
    assert found is not None
    return [found.spline.bezier_points(), np.asarray(found.schedule.durations)]


def _whole(name: str) -> list[np.ndarray]:
    """Planned and executed configurations, torques and margins."""
    result = run(name)
    motions = [motion for motion in (result.planned, result.executed) if motion is not None]
    return [array for motion in motions for array in (motion.q, motion.tau, motion.margin)]


SMALL: dict[str, Callable[[], list[np.ndarray]]] = {
    "contact of platform": lambda: [contact_request()().result.q],
    "centre of mass of beam-H2C1": lambda: _centre_of_mass("beam-H2C1"),
}
LARGE: dict[str, Callable[[], list[np.ndarray]]] = {
    "contacts of flat": lambda: _contacts("flat"),
    "contacts of stairs": lambda: _contacts("stairs"),
    "contacts of thresholds": lambda: _contacts("thresholds"),
    "centre of mass of platform": lambda: _centre_of_mass("platform"),
    "beam-H2C1": lambda: _whole("beam-H2C1"),
    "platform": lambda: _whole("platform"),
    "stairs": lambda: _whole("stairs"),
}


def in_this_process(names: Sequence[str]) -> dict[str, str]:
    """Digest of each plan, made in this order."""
    return {name: digest((SMALL | LARGE)[name]()) for name in names}


def in_new_process(names: Sequence[str], number: int) -> dict[str, str]:
    """Digest of each plan, made in this order by a process that did nothing before.

    The number is its hash seed and how many threads it may use; it works in a directory of its own and,
    if it is even, in another language and at another place on earth.
    """
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    place = {"LC_ALL": "C", "TZ": "Asia/Tokyo"} if number % 2 == 0 else {}
    given = {"PYTHONPATH": paths, "PYTHONHASHSEED": str(number), "OMP_NUM_THREADS": str(number), **place}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "tests.robustness.determinism", *names], cwd=folder,
            env={**os.environ, **given}, capture_output=True, text=True, check=False,
        )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(done.stderr[-2000:])
    return json.loads(done.stdout.splitlines()[-1])


def digest(arrays: list[np.ndarray]) -> str:
    """Of all bits and shapes of some arrays."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


if __name__ == "__main__":
    print(json.dumps(in_this_process(sys.argv[1:])))
