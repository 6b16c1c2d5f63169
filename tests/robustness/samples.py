"""One small, whole input of each format, made here, and what reading it means."""

import importlib.util
import json
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yaml
from tests.robustness.mutations import mutated

from manikin.analysis import AnalysisOptions, analyze_file
from manikin.body import BodyModel, creature_from_mjcf, creature_from_urdf, human
from manikin.motion import Motion
from manikin.motion.file import MotionFile, read_motions, write_motions
from manikin.recordings import read_marker_map, read_recording
from manikin.reports.formats.bvh import to_bvh
from manikin.reports.formats.recorded import to_c3d, to_trc
from manikin.scenarios import load_scenario
from manikin.scenarios.stance_file import judge_stance_file
from manikin.scenarios.study_file import load_study
from manikin.scene.mesh import load_mesh
from manikin.verification.plan_file import load_contact_plan
from manikin.walking import walk_along, walking_path

TESTS = Path(__file__).parents[1]


@dataclass(frozen=True)
class Format:
    """A format of input.

    Attributes:
        name: As in reports.
        write: Makes the whole file in a folder, with what belongs beside it, and returns it.
        read: Reads a file as a command would, and returns numbers that must be plausible.
        text: Whether words and numbers are mutated as such, not bytes alone.
        gentle: Whether every second damage is one after which the file can mostly be read.
    """

    name: str
    write: Callable[[Path], Path]
    read: Callable[[Path], list[Any]]
    text: bool = True
    gentle: bool = False

    def damaged(self, whole: bytes, seed: int, case: int) -> bytes:
        """A content with the damages of a case."""
        rng = np.random.default_rng((seed, zlib.crc32(self.name.encode()), case))
        return mutated(whole, rng, text=self.text, gentle=self.gentle and case % 2 == 1)


def other_module(path: str) -> Any:
    """Another test module, for its samples."""
    file = TESTS / path
    spec = importlib.util.spec_from_file_location(f"samples_of_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _written(name: str, content: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(content)
        return folder / name

    return write


def _scenario(folder: Path) -> Path:
    return _written("scene.yaml", load_scenario("platform").to_yaml())(folder)


def _read_scenario(path: Path) -> list[Any]:
    scenario = load_scenario(path)
    body, scene = scenario.build_body(), scenario.build_scene()
    places = [obstacle.translation for obstacle in scene]
    return [body.mass, body.standing_posture(), *places]


STANCE = {
    "friction": 0.7, "mass_kg": 70.0, "com": [0.05, 0.1, 0.9],
    "contacts": [
        {"effector": "left_foot", "position": [0.0, 0.1, 0.0]},
        {"effector": "right_foot", "position": [0.0, -0.1, 0.0], "yaw_deg": 10.0},
    ],
}  # fmt: skip


def _read_stance(path: Path) -> list[Any]:
    report = judge_stance_file(path).as_dict(polytope=False)
    return [value for value in report.values() if isinstance(value, float)]


def _motion(folder: Path) -> Path:
    body = load_scenario("platform").build_body()
    module = other_module("motion/test_file.py")
    motion = replace(module.random_motion(body, 12), time=0.01 * np.arange(12))
    write_motions(
        folder / "motion.h5", MotionFile(motion, None, body, load_scenario("platform").build_scene())
    )
    return folder / "motion.h5"


def _read_motion(path: Path) -> list[Any]:
    content = read_motions(path)
    for motion in content.motions.values():
        if content.body is not None:
            to_bvh(content.body, motion)
    kinematic = ("q", "v", "com", "angular_momentum")
    return [getattr(motion, key) for motion in content.motions.values() for key in kinematic]


def _amc(folder: Path) -> Path:
    module = other_module("recordings/conftest.py")
    (folder / "person.asf").write_text(module.ASF)
    return _written("person_1.amc", module.AMC)(folder)


def _trc(folder: Path) -> Path:
    module = other_module("recordings/test_trc_mot.py")
    (folder / "walk.mot").write_text(module.mot(module.pressing()))
    return _written("walk.trc", module.TRC)(folder)


def _c3d(folder: Path) -> Path:
    module = other_module("recordings/test_c3d.py")
    (folder / "small.c3d").write_bytes(module.c3d_bytes(*module.small()))
    return folder / "small.c3d"


def _read_recording(path: Path) -> list[Any]:
    found: Any = read_recording(path)
    places = getattr(found, "positions", None)
    return [np.nan_to_num(places)] if places is not None else [found.root_positions, found.offsets]


def _mesh(ending: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        trimesh.creation.box((1.0, 0.5, 0.3)).export(str(folder / f"box.{ending}"))
        return folder / f"box.{ending}"

    return write


def _read_mesh(path: Path) -> list[Any]:
    return [load_mesh(path).vertices / 10.0]


def _urdf(folder: Path) -> Path:
    trimesh.creation.capsule(height=140.0, radius=15.0).export(folder / "shank.stl")
    return _written("dog.urdf", (TESTS / "body" / "data" / "dog.urdf").read_text())(folder)


def _read_urdf(path: Path) -> list[Any]:
    names = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
    body = creature_from_urdf(path, {name: {"tip": f"{name}_foot"} for name in names})
    return [body.mass / 1e4, body.standing_posture()]


def _mjcf(folder: Path) -> Path:
    (folder / "meshes").mkdir(exist_ok=True)
    trimesh.creation.box((200.0, 100.0, 40.0)).export(folder / "meshes" / "sole.stl")
    return _written("walker.xml", (TESTS / "body" / "data" / "walker.xml").read_text())(folder)


def _read_mjcf(path: Path) -> list[Any]:
    body = creature_from_mjcf(path, {side: {"tip": f"{side}_foot"} for side in ("left", "right")})
    return [body.mass / 1e4, body.standing_posture()]


def _contact_plan(folder: Path) -> Path:
    scenario = load_scenario("platform")
    feet = {"left_foot": {"position": [0.0, 0.1, 0.0]}, "right_foot": {"position": [0.0, -0.1, 0.0]}}
    plan = {
        "format": "manikin-contact-plan-1", "scenario": yaml.safe_load(scenario.to_yaml()),
        "stages": [{"contacts": feet}, {"contacts": {"left_foot": "same"}}],
    }  # fmt: skip
    return _written("contacts.json", json.dumps(plan, indent=1))(folder)


def _read_contact_plan(path: Path) -> list[Any]:
    scenario, _ = load_contact_plan(path)
    return [scenario.mass]


def _bvh(folder: Path) -> Path:
    return _written("small.bvh", other_module("recordings/conftest.py").BVH)(folder)


STUDY = """scenario: scene.yaml
stage: all
bodies:
  - {percentiles: [5, 95]}
  - {sex: male, boundary: 0.9, measures: [stature, mass]}
  - {sex: female, random: 2, seed: 4}
  - {name: tall, body: {stature_m: 1.95, mass_kg: 100}}
sweeps:
  - {key: supports.friction, range: [0.3, 0.7, 3]}
seeds: 3
"""


def _study(folder: Path) -> Path:
    _scenario(folder)
    return _written("study.yaml", STUDY)(folder)


def _read_study(path: Path) -> list[Any]:
    study = load_study(path)
    return [value for body in study.bodies for value in body.keys.values() if isinstance(value, float)]


def _marker_map(folder: Path) -> Path:
    return _written("map.yaml", other_module("recordings/test_marker_map.py").MAP)(folder)


def _read_marker_map(path: Path) -> list[Any]:
    return [len(read_marker_map(path).places)]


@cache
def _walked() -> tuple[BodyModel, Motion]:
    """A walk of 1.5 m of the motion library at 50 Hz."""
    body = human(1.75, 79.0, "male")
    return body, walk_along(walking_path((0.0, 0.0, 0.0), (1.5, 0.0, 0.0)), body, rate=50.0).motion


def _walk(ending: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        to = {"trc": to_trc, "bvh": to_bvh, "c3d": to_c3d}[ending]
        content, file = to(*_walked()), folder / f"walked.{ending}"
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        return file

    return write


def _analyze(path: Path) -> list[Any]:
    """Numbers of the report, of one that is not said to be implausible, which ends with status 3."""
    summary = analyze_file(path, AnalysisOptions(mass=79.0, as_recorded=True)).as_dict()
    if summary["implausible"]:
        return []
    return [[value / 10.0 for value in _numbers(summary)]]  # a spine may be pressed with more than 10 kN


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, int | float):
        yield float(value)


FORMATS = (
    Format("scenario", _scenario, _read_scenario),
    Format("stance", _written("stance.yaml", yaml.safe_dump(STANCE)), _read_stance),
    Format("motion", _motion, _read_motion, text=False),
    Format("contact plan", _contact_plan, _read_contact_plan),
    Format("bvh", _bvh, _read_recording),
    Format("amc", _amc, _read_recording),
    Format("asf", _amc, _read_recording),
    Format("trc", _trc, _read_recording),
    Format("mot", _trc, _read_recording),
    Format("c3d", _c3d, _read_recording, text=False),
    Format("stl", _mesh("stl"), _read_mesh, text=False),
    Format("obj", _mesh("obj"), _read_mesh),
    Format("ply", _mesh("ply"), _read_mesh, text=False),
    Format("dae", _mesh("dae"), _read_mesh),
    Format("glb", _mesh("glb"), _read_mesh, text=False),
    Format("urdf", _urdf, _read_urdf),
    Format("mjcf", _mjcf, _read_mjcf),
    Format("study", _study, _read_study),
    Format("marker map", _marker_map, _read_marker_map),
    Format("analysis of trc", _walk("trc"), _analyze, gentle=True),
    Format("analysis of bvh", _walk("bvh"), _analyze, gentle=True),
    Format("analysis of c3d", _walk("c3d"), _analyze, text=False, gentle=True),
)  # fmt: skip

DAMAGED = {"asf": "person.asf", "mot": "walk.mot"}
"""Files that are damaged in place of the one that is read, where they differ."""
