"""Calls that are made again and again: the memory of the process does not grow with their number.

A leak takes memory in every part of a long series of calls; caches and the allocator do in some.
"""

import gc
import os
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tests.robustness.samples import FORMATS

from manikin.balance import stability_margins, wrench_polytope
from manikin.body import human
from manikin.contact import Stance, sole
from manikin.kinematics.posture_problem import PostureProblem
from manikin.kinematics.posture_search import generate_posture
from manikin.planning.contacts.single_contact import ContactQuestion, find_contact
from manikin.scenarios import load_scenario
from manikin.scenarios.world import contact_rules, start_posture

MOST = 8192.0
"""Growth of a call that is no leak [bytes]; two pages."""
PARTS = 4
READ = ("scenario", "stance", "motion", "contact plan", "bvh", "amc", "trc", "c3d", "stl", "obj", "urdf")
"""Formats whose whole files are read again and again."""


def _feet() -> Stance:
    feet = (("left_foot", (0.0, 0.1, 0.0)), ("right_foot", (0.0, -0.1, 0.0)))
    return Stance([sole(name, place, length=0.28, width=0.12, friction=0.7) for name, place in feet], 1500.0)


def _margin() -> Callable[[], Any]:
    rng = np.random.default_rng(0)
    wrench = np.concatenate([[0.0, 0.0, 700.0], 10.0 * rng.random(3)])
    return lambda: stability_margins(wrench_polytope(_feet()), wrench, np.array([0.0, 0.0, 0.9]))


def contact_request() -> Callable[[], Any]:
    """Search for a contact of a foot in the scene of the platform, with few samples."""
    job = load_scenario("platform")
    body, scene = job.build_body(), job.build_scene()
    q, rules = start_posture(job, body, scene), contact_rules(job, body)
    question = ContactQuestion.of("left_leg", (0.0, 0.0, 1.0), "auto", False, "efort", None, 500, 0)
    return lambda: find_contact(body, scene, q, question, rules)


def _posture() -> Callable[[], Any]:
    body = human()
    problem = PostureProblem(body, _feet().contacts)
    return lambda: generate_posture(problem)


CALLS: dict[str, Callable[[], Callable[[], Any]]] = {
    "margin": _margin,
    "contact request": contact_request,
    "posture": _posture,
    "body": lambda: lambda: human(1.6, 60.0, "female"),
}
"""Makes, of each, what is called."""


def growths(count: int, names: Iterable[str] = (*CALLS, *READ)) -> dict[str, float]:
    """Growth of each by its name, as :func:`growth` measures it."""
    with tempfile.TemporaryDirectory() as temporary:
        found = {}
        for name in names:
            folder = Path(temporary) / name.replace(" ", "_")
            found[name] = growth(CALLS[name]() if name in CALLS else _reading(name, folder), count)
        return found


def growth(call: Callable[[], Any], count: int) -> float:
    """Least growth per call [bytes] in any of the parts of so many calls, after a fifth as many before."""
    for _ in range(max(count // 5, 2)):
        call()
    used = [resident()]
    each = -(-count // PARTS)
    for _ in range(PARTS):
        for _ in range(each):
            call()
        used.append(resident())
    return float(np.diff(used).min()) / each


def _reading(name: str, folder: Path) -> Callable[[], Any]:
    kind = next(kind for kind in FORMATS if kind.name == name)
    folder.mkdir()
    return partial(kind.read, kind.write(folder))


def resident() -> int:
    """Memory of this process that is in use [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
