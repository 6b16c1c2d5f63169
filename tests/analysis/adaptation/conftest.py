"""Recorded people: one made from known postures, and a real walk over force plates."""

from pathlib import Path

import numpy as np
import pytest

from manikin.analysis.adaptation import adapt_recording
from manikin.body import human
from manikin.body.configuration import Configuration
from manikin.kinematics import PointTargets
from manikin.recordings import (
    Reconstruction,
    RecordedSupports,
    Support,
    read_recording,
    reconstruct,
    supports_of,
)

RATE, FRAMES = 50.0, 41


def nodding():
    """Our human who stands on both feet and bends its trunk a little and back, in less than a second."""
    body = human()
    q = np.tile(body.standing_posture(), (FRAMES, 1))
    bend = 0.5 * np.deg2rad(10.0) * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, FRAMES)))
    q[:, 7 + body.joint_index("lumbar_flexion")] += bend
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    found = Reconstruction(body, np.arange(FRAMES) / RATE, q, targets, np.zeros((FRAMES, 1)))
    end, held = float(found.time[-1]), []
    for name in ("left_foot", "right_foot"):
        place = Configuration(body, q[0]).effector_placement(name)[1]
        held.append(Support(name, 0.0, end, place, place, place, False, False))
    return found, RecordedSupports(tuple(held), 0.0, end, (float(held[0].place[2]),))


@pytest.fixture(scope="session")
def nod():
    """Planned and executed."""
    return adapt_recording(*nodding(), execute=True)


@pytest.fixture(scope="session")
def walk():
    """Postures and supports of a walk over force plates."""
    folder = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "mocap"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this repository")
    found = reconstruct(read_recording(folder / "grf/nimble_opencap_s4/walking1.trc"))
    return found, supports_of(found)


@pytest.fixture(scope="session")
def walked(walk):
    """Planned and executed."""
    return adapt_recording(*walk, execute=True)
