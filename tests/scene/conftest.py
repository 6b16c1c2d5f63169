"""Small bodies: a single free shape, and the human."""

from pathlib import Path
from types import SimpleNamespace

import coal
import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human


def free_body(geometry: coal.CollisionGeometry) -> SimpleNamespace:
    """One free segment with one shape."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    shapes = pin.GeometryModel()
    shapes.addGeometryObject(pin.GeometryObject("probe/shape", joint, pin.SE3.Identity(), geometry))
    return SimpleNamespace(pinocchio=model, geometry=shapes, collision_pairs=())


def pose(translation, rotation=None) -> np.ndarray:
    """Configuration of a free body."""
    matrix = np.eye(3) if rotation is None else np.asarray(rotation)
    return pin.SE3ToXYZQUAT(pin.SE3(matrix, np.asarray(translation, dtype=float)))


@pytest.fixture(name="free_body", scope="session")
def _free_body():
    return free_body


@pytest.fixture(name="pose", scope="session")
def _pose():
    return pose


@pytest.fixture(scope="session")
def person():
    return human(1.75, 79.0, "male")


@pytest.fixture(scope="session")
def scene_files() -> Path:
    """Folder of real meshes that stands beside the repository, not in it."""
    folder = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "scenes"
    if not folder.is_dir():
        pytest.skip("the real scene meshes are not beside this repository")
    return folder
