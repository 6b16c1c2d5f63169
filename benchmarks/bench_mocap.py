"""Reading of recorded markers, reconstruction, and the motion with velocities and accelerations.

A walk of 8 s at 120 Hz by 36 markers with 3 mm of noise, made here: no recordings are needed.
"""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.recordings import MarkerRecording, motion_of, read_trc, reconstruct

RATE, FRAMES = 120.0, 960

MARKERS = {
    "ASI": ("pelvis", 0.10, 0.125, 0.09), "PSI": ("pelvis", -0.09, 0.05, 0.10),
    "SHO": ("thorax", 0.0, 0.18, 0.21), "CLA": ("thorax", 0.08, 0.06, 0.15),
    "FHD": ("neck", 0.1, 0.07, 0.17), "BHD": ("neck", -0.08, 0.07, 0.17),
    "ELB": ("upper_arm", 0.0, 0.047, -0.275), "ELBM": ("upper_arm", 0.0, -0.047, -0.275),
    "WRA": ("forearm", 0.03, 0.0, -0.26), "WRB": ("forearm", -0.03, 0.0, -0.26),
    "THI": ("thigh", 0.02, 0.08, -0.25), "KNE": ("thigh", 0.0, 0.057, -0.40),
    "KNEM": ("thigh", 0.0, -0.057, -0.40), "TIB": ("leg", 0.02, 0.06, -0.2),
    "ANK": ("leg", 0.0, 0.042, -0.42), "ANKM": ("leg", 0.0, -0.042, -0.42),
    "HEE": ("foot", -0.05, 0.0, -0.04), "TOE": ("foot", 0.14, 0.0, -0.04),
}  # fmt: skip
"""Segment and place of the left marker of each pair [m]."""


def walking(body):
    """Postures of something like a walk: one stride per second, 1.2 m/s along x."""
    time, q = np.arange(FRAMES) / RATE, np.tile(body.standing_posture(), (FRAMES, 1))
    q[:, 0] += 1.2 * time
    for side, sign in (("left", 1.0), ("right", -1.0)):
        swing = sign * np.sin(2.0 * np.pi * time)
        for joint, angle in (
            ("hip_flexion", 0.4 * swing), ("knee_flexion", 0.4 * (1.0 - np.cos(2.0 * np.pi * time + sign))),
            ("shoulder_flexion", -0.3 * swing), ("elbow_flexion", 0.2 + 0.1 * swing),
        ):  # fmt: skip
            q[:, 7 + body.joint_index(f"{side}_{joint}")] += angle
    return q


@pytest.fixture(scope="module")
def recording():
    body, rng = human(), np.random.default_rng(0)
    data, names, positions = body.pinocchio.createData(), [], []
    for q in walking(body):
        pin.framesForwardKinematics(body.pinocchio, data, q)
        for letter, side, sign in (("L", "left", 1.0), ("R", "right", -1.0)):
            for name, (part, x, y, z) in MARKERS.items():
                segment = part if part in ("pelvis", "thorax", "neck") else f"{side}_{part}"
                names.append(letter + name)
                positions.append(data.oMf[body.segment_frame(segment)].act(np.array([x, sign * y, z])))
    names = names[: 2 * len(MARKERS)]
    there = np.array(positions).reshape(FRAMES, len(names), 3)
    return MarkerRecording("walk", tuple(names), there + rng.normal(scale=0.003, size=there.shape), RATE)


def written(recording, file):
    """The recording as a TRC file."""
    names = recording.marker_names
    flat = (1000.0 * recording.positions[..., [1, 2, 0]]).reshape(len(recording), -1)
    header = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")
    values = (RATE, RATE, len(recording), len(names), "mm")
    lines = [f"PathFileType\t4\t(X/Y/Z)\t{file.name}", "\t".join(header), "\t".join(map(str, values))]
    lines += ["Frame#\tTime\t" + "\t\t\t".join(names), ""]
    for frame, row in enumerate(flat):
        lines.append("\t".join([str(frame + 1), f"{frame / RATE:.5f}", *(f"{value:.5f}" for value in row)]))
    file.write_text("\n".join(lines))
    return file


def test_read(benchmark, recording, tmp_path):
    file = written(recording, tmp_path / "walk.trc")
    assert len(benchmark(read_trc, file)) == FRAMES


@pytest.mark.parametrize("frames", [120, FRAMES])
def test_reconstruct(benchmark, recording, frames):
    """The difference is that of more frames; the rest is for the person's lengths and the markers' places."""
    found = benchmark(reconstruct, recording.cut(0, frames))
    assert found.median < 0.01


def test_motion(benchmark, recording):
    found = reconstruct(recording)
    benchmark(motion_of, found)
