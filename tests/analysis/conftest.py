"""Somebody who stands, written as a recording; and the real recordings beside the repository."""

from pathlib import Path

import numpy as np
import pytest

from manikin.body import human
from manikin.export.bvh import to_bvh
from manikin.motion import Motion

FRAMES, RATE = 60, 50.0


@pytest.fixture(scope="session")
def recordings_folder() -> Path:
    folder = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "mocap"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this repository")
    return folder


@pytest.fixture(scope="session")
def standing_file(tmp_path_factory) -> Path:
    """Of 1.75 m, who stands for 1.2 s."""
    body = human(1.75, 79.0, "male")
    q = np.tile(body.standing_posture(), (FRAMES, 1))
    none, nv = np.zeros(FRAMES), body.nv
    motion = Motion(
        time=np.arange(FRAMES) / RATE, q=q, v=np.zeros((FRAMES, nv)), a=np.zeros((FRAMES, nv)),
        tau=np.zeros((FRAMES, nv)), com=np.zeros((FRAMES, 3)), angular_momentum=np.zeros((FRAMES, 3)),
        margin=none, support=np.zeros((FRAMES, 0), dtype=bool), contact_force=np.zeros((FRAMES, 0, 6)),
        contact_names=(), joint_names=tuple(body.joint_names),
    )  # fmt: skip
    file = tmp_path_factory.mktemp("recordings") / "standing.bvh"
    file.write_text(to_bvh(body, motion))
    return file
