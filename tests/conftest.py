"""Values that the tests of several rooms share."""

import fcntl
import gc
import hashlib
import multiprocessing
import os
import pickle
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache

os.environ.setdefault("OMP_NUM_THREADS", "1")  # as the command line does, before numpy is loaded
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each process of the tests would compile all modules again

from pathlib import Path

import numpy as np
import pytest
import typer.main
from hypothesis import HealthCheck, settings

from manikin.body import human
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.reports.figures import contacts, raster, space, views
from manikin.reports.formats.bvh import to_bvh

sys.dont_write_bytecode = False
FEET = ("left_foot", "right_foot")

# The examples of a property do not depend on the machine: no clock, the same draws in every run, no memory of
# others. `--hypothesis-profile=thorough` draws more, and others in each run.
settings.register_profile(
    "standard", deadline=None, derandomize=True, database=None, max_examples=10,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
settings.register_profile("thorough", settings.get_profile("standard"), derandomize=False, max_examples=300)
settings.load_profile("standard")


APART = frozenset({
    "tests/pipeline/test_beam.py", "tests/pipeline/test_key_postures.py",
    "tests/pipeline/test_limb_contacts.py", "tests/pipeline/test_pushed_moving.py",
    "tests/pipeline/test_run.py", "tests/simulation/test_push_map_holds.py",
    "tests/test_readme.py",
})  # fmt: skip
"""Modules of long tests that share no results, but for those with the same parameters."""


LONG = frozenset({
    "test_acts.py", "test_adapt.py", "test_analyze.py", "test_assemble.py", "test_batch.py", "test_cli.py",
    "test_contact_model.py", "test_execute.py", "test_figures.py", "test_found_supports.py",
    "test_key_planes.py", "test_limb_contacts.py", "test_obstacles.py", "test_parts.py", "test_push.py",
    "test_pushed.py", "test_readme.py", "test_recover.py", "test_refine.py", "test_timing_free.py",
    "test_walk_search.py", "test_walking.py", "test_walls.py", "test_words.py",
})  # fmt: skip
"""Modules without slow tests that take fifteen seconds and more."""


def unit_of(nodeid):
    """What a test is done together with by one worker: its module, or the tests with its parameters."""
    module, _, test = nodeid.partition("::")
    if module not in APART:
        return module
    name, bracket, parameters = test.partition("[")
    return f"{module}[{parameters}" if bracket else f"{module}::{name}"


def pytest_collection_finish():
    """What is loaded by now stays: the collector of garbage need not look through it again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


def pytest_collection_modifyitems(items):
    """Long modules come first, so that no worker is left alone with one at the end.

    Modules stay together, because their tests share results; what looks at all runs comes last.
    """
    slow = {item.path for item in items if item.get_closest_marker("slow")}

    def place(item):
        last = item.path.name == "test_friction_shares.py"
        return last, item.path not in slow, item.path.name not in LONG

    items.sort(key=place)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Workers get one unit after the other, in the order of the tests; none is done twice or waits long."""
    if config.option.dist not in {"load", "worksteal"}:
        return None
    from xdist.scheduler import LoadScopeScheduling

    class UnitScheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return unit_of(nodeid)

    config.option.loadscopereorder = False
    return UnitScheduling(config, log)


SHORTER = {
    "goal-left": ("walking.whole_body=recorded", "execution=none"),
    "crouch": ("scene.0.box=[0.3, 3.0, 0.3]", "task.start.at=[0.75, 0.0]", "task.goal.at=[1.65, 0.0]"),
    "walk-and-platform": ("walking.start.at=[0.0, -1.2]",),
}
"""Shorter ways through scenarios: no execution, a slab that is less deep, fewer steps before and after it."""

QUICKLY = "planning.max_duration_s=2.6"
"""Time for :meth:`Runs.step` that leaves it a good margin [s]; the file has 4 s."""


def documented_scenarios() -> list[str]:
    """Scenarios that the documentation gives in full; the first is one step to the left on the floor."""
    marked = re.compile(r"<!-- example: scenario -->\n```yaml\n(.*?)```", re.DOTALL)
    pages = sorted((Path(__file__).resolve().parents[1] / "docs").glob("*.md"))
    return [text for page in pages for text in marked.findall(page.read_text(encoding="utf-8"))]


class Runs:
    """Whole runs of scenarios, each made once for all tests and all workers of a session.

    A run is known by its scenario, variant, overrides, body, seed and place. Its directory belongs to all
    tests: they read it and copy what they change. It is made in a process of its own, as by the command line:
    what a worker did before would change its last bits.
    """

    def __init__(self, folder):
        self.folder = folder
        self.read = {}

    def __call__(self, name, variant=None, overrides=(), seed=None, body=(), moved=()):
        """Result of a run, with its directory.

        ``body`` is stature [m], mass [kg], sex; ``moved`` is x, y [m], yaw [deg].
        """
        from manikin.scenarios import load_scenario

        seed = load_scenario(name, variant, overrides).seed if seed is None else seed
        key = f"{name}@{variant}|{'|'.join(overrides)}|{seed}|{body}|{moved}"
        if key not in self.read:
            place = self.folder / hashlib.sha256(key.encode()).hexdigest()[:16]
            place.mkdir(parents=True, exist_ok=True)
            with (place / "lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)  # another worker may be making it
                result = place / "result.pickle"
                if not result.exists():
                    result.write_bytes(
                        pickle.dumps(self._made(name, variant, overrides, seed, body, moved, place))
                    )
                self.read[key] = pickle.loads(result.read_bytes())
        return self.read[key]

    def step_file(self):
        """File of one step to the left, the first of :func:`documented_scenarios`."""
        file = self.folder / "side-step.yaml"
        if not file.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            whole = self.folder / f"{os.getpid()}.yaml"
            whole.write_text(documented_scenarios()[0])
            whole.replace(file)  # at once: another worker may be reading it
        return file

    def step(self, overrides=(), *, quick=True, **given):
        """Result of a run of one step to the left: all that a run has, in a third of the platform's time.

        Where it need not be ``quick`` it takes the 4 s that the file allows.
        """
        return self(str(self.step_file()), overrides=(*overrides, *[QUICKLY][:quick]), **given)

    @staticmethod
    def shorter_by(name):
        """Overrides for the shorter way through a scenario, if there is one."""
        return SHORTER.get(name, ())

    def shorter(self, name, **given):
        """Result of a run on that way."""
        return self(name, overrides=self.shorter_by(name), **given)

    def _made(self, name, variant, overrides, seed, body, moved, place):
        from manikin.pipeline.runner import run
        from manikin.scenarios import load_scenario

        scenario = load_scenario(name, variant, overrides)
        scenario = scenario.with_body(*body) if body else scenario
        scenario = scenario.moved(*moved) if moved else scenario
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["manikin.pipeline.runner"])
        with ProcessPoolExecutor(1, mp_context=context) as process:
            return process.submit(run, scenario, seed=seed, out=place / "run").result()


@pytest.fixture(scope="session", autouse=True)
def coarse_pictures():
    """Pictures have fewer points, and are computed in as many as they have, in a sixth of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(raster, "FINER", 1)
        patch.setattr(views, "PICTURE", 160)
        patch.setattr(space, "PICTURE", 300)
        patch.setattr(contacts, "PIXELS", 200)
        yield


@pytest.fixture(scope="session", autouse=True)
def commands_built_once():
    """The tree of commands is built once, as in a process of the command line, not by each test again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield


@pytest.fixture(scope="session")
def runs(tmp_path_factory) -> Runs:
    """Runs of scenarios that tests share: ``runs("platform")``."""
    base = tmp_path_factory.getbasetemp()
    return Runs((base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "runs-of-all")


def carried(scenario, body, schedule, time, offset=0.0):
    """A standing body carried along the straight line from start to goal: no motion, but complete data."""
    share = np.clip(time / schedule.instants[-1], 0.0, 1.0)[:, None]
    com = (
        scenario.start_com
        + share * (scenario.goal_com - scenario.start_com)
        + offset * np.sin(9 * time)[:, None]
    )
    n = len(time)
    q = np.tile(body.standing_posture(), (n, 1))
    q[:, :3] += com - [0.0, 0.0, 0.92]
    q[:, 3:7] = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]
    support = schedule.support(time, FEET)
    force = np.zeros((n, 2, 6))
    force[:, :, 2] = support * (body.mass * 9.81 / support.sum(axis=1))[:, None]
    zero = np.zeros((n, body.nv))
    return Motion(
        time=time, q=q, v=zero, a=zero, tau=zero, com=com, angular_momentum=np.zeros((n, 3)),
        margin=30.0 + 10.0 * np.cos(5.0 * time) + 1000.0 * offset, support=support, contact_force=force,
        contact_names=FEET, joint_names=body.joint_names,
    )  # fmt: skip


@pytest.fixture(scope="session")
def finished_run():
    """Content of a motion file of the platform scenario, with made-up motions."""
    from manikin.contact import ContactSchedule
    from manikin.scenarios import load_scenario

    scenario = load_scenario("platform")
    body, scene = scenario.build_body(), scenario.build_scene()
    instants = [0.0, 0.321, 0.721, 0.93, 1.73, 2.837, 3.637, 4.193]  # [Qiu2012]_ Table 5.4
    schedule = ContactSchedule(scenario.build_sequence(), instants)
    planned = carried(scenario, body, schedule, np.linspace(0.0, 4.193, 420))
    executed = carried(scenario, body, schedule, np.arange(0.0, 5.193, 0.005), offset=0.003)
    return MotionFile(planned, executed, body, scene, schedule)


@pytest.fixture(scope="session")
def aside():
    """A walking path of 1.2 m to the left that keeps its heading, in 6 s from rest to rest."""
    from dataclasses import replace

    from manikin.numerics.signals import least_jerk
    from manikin.numerics.spline import BSpline
    from manikin.walking import walking_path

    path = walking_path((0, 0, 0), (0, 1.2, 0), max_speed=0.6)
    share = np.linspace(0.0, 1.0, 200)
    way = least_jerk(share)[0]
    places = np.column_stack([0.0 * share, 1.2 * way, 0.0 * share])
    spline = BSpline.fit(path.spline.degree, path.spline.knots, share, places)
    return replace(path, spline=spline, duration=6.0)


@pytest.fixture(scope="session")
def recordings_folder() -> Path:
    """Folder of real recordings that stands beside the repository, not in it."""
    folder = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "mocap"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this repository")
    return folder


def standing_bvh() -> str:
    """BVH of somebody of 1.75 m who stands for 60 frames at 50 Hz."""
    body, n = human(1.75, 79.0, "male"), 60
    flat, nv = np.zeros((n, 3)), body.nv
    motion = Motion(
        time=np.arange(n) / 50.0, q=np.tile(body.standing_posture(), (n, 1)), v=np.zeros((n, nv)),
        a=np.zeros((n, nv)), tau=np.zeros((n, nv)), com=flat, angular_momentum=flat, margin=np.zeros(n),
        support=np.zeros((n, 0), dtype=bool), contact_force=np.zeros((n, 0, 6)), contact_names=(),
        joint_names=tuple(body.joint_names),
    )  # fmt: skip
    return to_bvh(body, motion)


@pytest.fixture(scope="session")
def standing_file(tmp_path_factory) -> Path:
    """File of :func:`standing_bvh`."""
    file = tmp_path_factory.mktemp("recordings") / "standing.bvh"
    file.write_text(standing_bvh())
    return file
