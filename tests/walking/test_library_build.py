"""Cycles found in recordings, and libraries built from them."""

import json

import numpy as np
import pytest

from manikin.cli import main
from manikin.errors import InputError
from manikin.numerics.signals import fourier_basis
from manikin.recordings import read_recording, reconstruct
from manikin.walking.gait.blend import Gait, travelled
from manikin.walking.gait.cycles import cycle_cuts, foot_events
from manikin.walking.gait.library_build import TABLE, build_library, read_windows
from manikin.walking.gait.motion_library import ROOT, load_library, reference_body
from manikin.walking.gait.stance_foot import Legs, put_in_place

HEAD = "class,file,first_frame0,end_frame0\n"
BODY = reference_body()
WINDOWS = (
    "idle,accad_male1_bvh/Male1_A1_Stand.bvh,0,150",
    "walk straight,cmu_asf_amc/16_15.amc,0,471",
    "walk straight,cmu_asf_amc/16_21.amc,0,312",
    "walk veer,cmu_asf_amc/16_25.amc,0,284",
    "walk 90 turn (1.2 s core),cmu_asf_amc/16_17.amc,214,358",
    "sidestep core,accad_male1_bvh/Male1_B22_SideStepLeft.bvh,66,102",
    "run straight,cmu_asf_amc/16_35.amc,0,162",
)  # fmt: skip


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """A folder with few windows of the real recordings; skips where they are missing."""
    from pathlib import Path

    data = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "mocap"
    if not data.is_dir():
        pytest.skip("the real recordings are not beside this repository")
    folder = tmp_path_factory.mktemp("recordings")
    (folder / "mocap").symlink_to(data)
    (folder / TABLE).write_text(HEAD + "\n".join(WINDOWS) + "\n")
    return folder


@pytest.fixture(scope="module")
def built(recordings):
    return build_library(recordings)


@pytest.mark.parametrize("velocity", [(1.2, 0.0, 0.0), (1.0, 0.0, 0.5), (0.0, 0.4, 0.0), (-0.7, 0.0, 0.0)])
def test_known_events_are_found(velocity):
    """Those of a walk whose feet stand when we put them: within 0.15 s, for a foot slows before it lands."""
    gait, legs = Gait(load_library(), BODY), Legs(BODY)
    rate, n = 120.0, 600
    time = np.arange(n) / rate
    blend = gait.blend(np.tile(velocity, (n, 1)))
    frames = gait.frames(blend, time / gait.period(blend), travelled(blend.velocity, time))
    swing = frames.swing()
    q, _ = legs.reached(frames, put_in_place(legs.feet(frames), swing))
    found = foot_events(BODY, q, rate)
    for side, share in zip(("left", "right"), swing, strict=True):
        standing = np.diff((share < 0.0).astype(int))
        for known, events in ((-1, found[side].off), (1, found[side].on)):
            instants = np.flatnonzero(standing == known) / rate
            inner = instants[(instants > 0.2) & (instants < time[-1] - 0.2)]
            assert len(inner) >= 3
            assert np.abs(inner[:, None] - events).min(axis=1).max() < 0.15
    cuts = cycle_cuts(found, 0.0, time[-1])
    period = float(gait.period(blend)[0])
    assert len(cuts) >= 4
    np.testing.assert_allclose([cut.period for cut in cuts], period, atol=0.1)


def test_a_small_library(built):
    """Classes, velocities near the labels of the windows, mirror images of one-sided cycles."""
    library = built.library
    assert not built.without_cycle
    kinds = dict(zip(library.kinds, library.velocities, strict=True))
    assert set(kinds) == {"stand", "walk straight", "walk veer", "walk 90 turn", "sidestep", "run straight"}
    assert len(library) == 7 + 3
    labels = {"16_15": 1.08, "16_21": 1.65, "16_35": 2.62}
    for name, velocity in zip(library.names, library.velocities, strict=True):
        if name.split(" ")[0] in labels:
            assert velocity[0] == pytest.approx(labels[name.split(" ")[0]], rel=0.1)
            assert velocity[1] == velocity[2] == 0.0
    turn = library.velocities[[i for i, n in enumerate(library.names) if n.startswith("16_17")]]
    np.testing.assert_allclose(np.degrees(turn[0, 2]), 75.3, atol=20.0)
    assert len(library.acknowledgements) == 2


def test_movements_are_the_recorded_ones(built, recordings):
    """Knees and ankles of a one-sided cycle within 3 degrees RMS, but for their means and the drift."""
    library = built.library
    name = next(n for n in library.names if n.startswith("16_25") and "mirrored" not in n)
    first, last = (int(frame) for frame in name.split(" ")[1].split("-"))
    file = recordings / "mocap" / "cmu_asf_amc" / "16_25.amc"
    q = reconstruct(read_recording(file)).q[first:last]
    share = np.linspace(0.0, 1.0, len(q), endpoint=False)
    cycle = library.coefficients[library.names.index(name)]
    for joint in ("left_knee_flexion", "right_knee_flexion", "left_ankle_dorsiflexion"):
        slot = BODY.joint_index(joint)
        recorded = q[:, 7 + slot]
        recorded = recorded - (share - 0.5) * (recorded[-1] - recorded[0])
        best = min(
            np.std(fourier_basis(share + shift) @ cycle[:, len(ROOT) + slot] - recorded)
            for shift in np.arange(0.0, 1.0, 0.01)
        )
        assert np.degrees(best) < 3.0


@pytest.mark.long
def test_the_command(recordings, tmp_path, capsys):
    out = tmp_path / "library.npz"
    assert main(["library", "build", str(recordings), "--out", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["cycles"] == 10
    assert summary["size_bytes"] == out.stat().st_size
    assert load_library(out).names[0].startswith("16_")


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (None, f"no {TABLE}"),
        (HEAD, "no window with a whole cycle"),
        (HEAD + "walk,a.bvh,0\n", "line 2 is not usable"),
        (HEAD + "walk,a.bvh,9,3\n", "line 2 is not usable"),
        (HEAD + "walk,missing.bvh,0,30\n", "missing.bvh"),
        ("a,b\n1,2\n", "line 2 is not usable"),
        (b"\xff\xfe\x00", "cannot be read"),
    ],
)
def test_bad_folders_are_refused_in_one_line(tmp_path, table, message, capsys):
    if isinstance(table, bytes):
        (tmp_path / TABLE).write_bytes(table)
    elif table is not None:
        (tmp_path / TABLE).write_text(table)
    assert main(["library", "build", str(tmp_path), "--out", str(tmp_path / "x.npz")]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert message in said
    assert not (tmp_path / "x.npz").exists()


def test_window_beyond_the_recording(recordings, tmp_path):
    (tmp_path / "mocap").symlink_to(recordings / "mocap")
    (tmp_path / TABLE).write_text(HEAD + "idle,accad_male1_bvh/Male1_A1_Stand.bvh,900,1000\n")
    with pytest.raises(InputError, match="187 frames"):
        build_library(tmp_path)
    assert len(read_windows(tmp_path)) == 1


def test_out_in_no_folder(tmp_path, capsys):
    assert main(["library", "build", str(tmp_path), "--out", str(tmp_path / "none" / "x.npz")]) == 2
    assert "folder that exists" in capsys.readouterr().err
