"""Learn the ranges of motion of hips and shoulders: writes ``human_volumes.npz`` of the package and a figure.

Run ``python docs/ranges_of_motion.py FOLDER``, where FOLDER has ``cmu_asf_amc``, ``cmu_bvh`` and
``accad_male1_bvh`` with recordings of the CMU Graphics Lab and of the ACCAD Open Motion Project.
"""

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from manikin.body.human_parts import HUMAN_HINGES
from manikin.body.joint_volume import JointVolume, volume_of
from manikin.body.natural_range import FILE, FORMAT, UNIT
from manikin.numerics.spatial import FloatArray
from manikin.recordings import Recording, read_recording
from manikin.recordings.reconstruction.anatomy import BALL_SEGMENTS, anatomy_of, ball_joint_angles
from manikin.runtime.files import atomic_path

HERE = Path(__file__).parent
UPRIGHT = "Male1_A1_Stand.bvh"
"""The ACCAD skeleton's rest pose is not upright; here its person is."""
ACKNOWLEDGEMENT = (
    "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding "
    "from NSF EIA-0196217. Motion capture data: ACCAD / The Ohio State University, Open Motion Project, "
    "CC BY 3.0 Unported"
)

Angles = dict[tuple[str, str], dict[str, FloatArray]]


def recorded_angles(folder: Path) -> Angles:
    """Angles (n, 3) of hips and of shoulders, both sides together, by person and clip."""
    people: defaultdict[str, list[Recording]] = defaultdict(list)
    for file in sorted(
        [*folder.glob("cmu_*/*.amc"), *folder.glob("cmu_*/*.bvh"), *folder.glob("accad_*/*.bvh")]
    ):
        name = file.name.removeprefix("scaled_").split("_")[0]
        people[name].append(read_recording(file))
    found: Angles = {}
    for person, recordings in people.items():
        upright = next((recording for recording in recordings if recording.name == UPRIGHT), None)
        anatomy = anatomy_of(recordings, upright)
        for recording in recordings:
            angles = ball_joint_angles(recording, anatomy)
            found[person, recording.name] = {
                part: np.concatenate([angles[f"left_{part}"], angles[f"right_{part}"]])
                for part in BALL_SEGMENTS
            }
    return found


def learn(clips: Iterable[Mapping[str, FloatArray]]) -> dict[str, JointVolume]:
    """Volumes of clips' angles, by segment."""
    kept = list(clips)
    return {part: volume_of(np.concatenate([clip[part] for clip in kept])) for part in BALL_SEGMENTS}


def save_volumes(path: str | Path, volumes: Mapping[str, JointVolume], acknowledgement: str) -> None:
    """Write volumes by segment into a NumPy archive, distances to 1e-4 rad, with their acknowledgement."""
    arrays: dict[str, Any] = {}
    for name, volume in volumes.items():
        arrays[f"{name}/origin"], arrays[f"{name}/step"] = volume.origin, np.array(volume.step)
        arrays[f"{name}/distances"] = np.rint(volume.distances / UNIT).astype(np.int16)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file, format=np.array(FORMAT), acknowledgement=np.array(acknowledgement), **arrays
        )


def figure(volumes: Mapping[str, JointVolume]) -> Figure:
    """Sections of the volumes: lines of equal distance, 10 degrees apart; grey, the hinges' intervals."""
    drawn = Figure(figsize=(9.0, 5.6), layout="constrained")
    axes = drawn.subplots(2, 3)
    for row, (part, title) in zip(axes, (("thigh", "hip"), ("upper_arm", "shoulder")), strict=True):
        hinges, volume = HUMAN_HINGES[part], volumes[part]
        for panel, turn in zip(row, (-30.0, 0.0, 30.0), strict=True):
            _section(panel, volume, hinges, turn)
            panel.set_title(f"{title}, rotation {turn:.0f}°", fontsize=9)
            panel.set(xlabel="flexion [°]", ylabel="abduction [°]")
    return drawn


def _section(panel, volume, hinges, turn):  # noqa: ANN001, ANN202
    first, second = (np.arange(hinge.lower_deg - 15.0, hinge.upper_deg + 16.0, 1.0) for hinge in hinges[:2])
    grid = np.stack(np.meshgrid(first, second, [turn], indexing="ij"), axis=-1)[:, :, 0]
    value = np.rad2deg(volume.distance(np.deg2rad(grid)))
    levels = np.arange(-60.0, 61.0, 10.0)
    panel.contour(first, second, value.T, levels, colors="#5b7a9d", linewidths=0.6, linestyles="solid")
    panel.contour(first, second, value.T, [0.0], colors="#0b3c6f", linewidths=2.0)
    low, high = ([getattr(hinge, end) for hinge in hinges[:2]] for end in ("lower_deg", "upper_deg"))
    x, y = zip(low, high, strict=True)
    panel.plot([x[0], x[1], x[1], x[0], x[0]], [y[0], y[0], y[1], y[1], y[0]], color="0.6", linewidth=1.0)
    panel.set_aspect("equal")


def main() -> None:
    """Learn from the folder on the command line and write the file and the figure."""
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        raise SystemExit("usage: python docs/ranges_of_motion.py FOLDER; valid: a folder of recordings")
    volumes = learn(recorded_angles(Path(sys.argv[1])).values())
    save_volumes(FILE, volumes, ACKNOWLEDGEMENT)
    figure(volumes).savefig(HERE / "images/ranges-of-motion.png", dpi=110)


if __name__ == "__main__":
    main()
