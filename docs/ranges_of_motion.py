"""Learn the ranges of motion of hips and shoulders: writes ``human_volumes.npz`` of the package and a figure.

Skeletons differ in their rest pose and in the frames of their bones. What they share are joints, so the
axes of segments are made of those:

* **pelvis** and **thorax**: y from the right joint of the hips (shoulders) to the left one, z up in an
  upright posture, made perpendicular to y;
* **thigh** and **upper arm**: z along the bone, from its far joint to its near one; y the axis about
  which the knee (elbow) bends, made perpendicular to z, pointing to the left when the limb hangs.

Each is a fixed rotation of the frame of one joint, the identity on our human in the zero posture, so that
rotations between these axes are those between the segments of :func:`manikin.body.human`.

Run ``python docs/ranges_of_motion.py FOLDER``, where FOLDER has ``cmu_asf_amc``, ``cmu_bvh`` and
``accad_male1_bvh`` with recordings of the CMU Graphics Lab and of the ACCAD Open Motion Project.
"""

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from manikin.body import human
from manikin.body.human_parts import HUMAN_HINGES
from manikin.body.joint_volume import JointVolume, ball_angles, volume_of
from manikin.body.natural_range import FILE, FORMAT, UNIT
from manikin.body.segments import SIDES
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.recordings import Recording, read_recording
from manikin.recordings.readers.marker_sets import JOINTS, joint_of
from manikin.runtime.files import atomic_path

HERE = Path(__file__).parent
UPRIGHT = "Male1_A1_Stand.bvh"
"""The ACCAD skeleton's rest pose is not upright; here its person is."""
ACKNOWLEDGEMENT = (
    "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding "
    "from NSF EIA-0196217. Motion capture data: ACCAD / The Ohio State University, Open Motion Project, "
    "CC BY 3.0 Unported"
)

BENT = np.deg2rad(30.0)
"""A knee or elbow that is bent by more than this shows the axis about which it bends."""

FEWEST_BENT = 10
"""Frames with a bent knee or elbow without which its axis is not told."""

_BALLS = {"thigh": ("pelvis", "leg", "foot", 1.0), "upper_arm": ("thorax", "forearm", "hand", -1.0)}
"""Segment of a ball joint: what carries it, the joints beyond, and the sign of y about which they bend."""


@dataclass(frozen=True, eq=False)
class Anatomy:
    """Axes of the segments of one recorded person.

    Attributes:
        joints: Index of the joint whose frame carries each segment.
        axes: (3, 3) rotation from each segment's axes to that joint's frame.
    """

    joints: Mapping[str, int]
    axes: Mapping[str, FloatArray]

    def rotations(self, recording: Recording, segment: str) -> FloatArray:
        """(n, 3, 3) from a segment's axes to the world's.

        Raises:
            InputError: If the segment is not among :attr:`axes`.
        """
        if segment not in self.axes:
            raise InputError(f"no axes of segment {segment!r}; valid: {', '.join(self.axes)}")
        return recording.world_rotations[:, self.joints[segment]] @ self.axes[segment]

    def relative(self, recording: Recording, segment: str) -> FloatArray:
        """(n, 3, 3) from a thigh's (upper arm's) axes to the pelvis' (thorax')."""
        carrier = _BALLS[segment.split("_", 1)[1]][0]
        return self.rotations(recording, carrier).transpose(0, 2, 1) @ self.rotations(recording, segment)

    def bend(self, recording: Recording, segment: str) -> FloatArray:
        """(n,) angle between a thigh (upper arm) and the lower leg (forearm) [rad]."""
        side, part = segment.split("_", 1)
        upper, lower = _bones(recording, self.joints, side, part)
        return np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=1), np.sum(upper * lower, axis=1))


def anatomy_of(recordings: Sequence[Recording], upright: Recording | None = None) -> Anatomy:
    """Axes of a person's segments from recordings of the same skeleton.

    Args:
        recordings: Motions of the person in which all knees and elbows bend.
        upright: The person standing upright; None where the rest pose is upright.

    Raises:
        InputError: If there is no recording, a joint is not found, skeletons differ, or a knee or
            elbow never bends.
    """
    if not recordings:
        raise InputError("anatomy of no recording; valid: at least one")
    first = recordings[0]
    wrong = [r.name for r in recordings if r.joint_names != first.joint_names]
    if wrong:
        raise InputError(f"recording {wrong[0]!r} has other joints than {first.name!r}; valid: one skeleton")
    joints = {segment: joint_of(first, segment, {}) for segment in JOINTS}
    pose = _rest(first) if upright is None else upright
    axes = {
        "pelvis": _trunk(pose, joints, "pelvis", "thigh"),
        "thorax": _trunk(pose, joints, "thorax", "upper_arm"),
    }
    for side in SIDES:
        for part in _BALLS:
            axes[f"{side}_{part}"] = _limb(recordings, joints, side, part)
    return Anatomy(joints, axes)


def _rest(recording: Recording) -> Recording:
    """The rest pose as a recording of one frame."""
    turns = np.broadcast_to(np.eye(3), (1, len(recording.joint_names), 3, 3))
    return Recording(
        recording.name, recording.joint_names, recording.parents, recording.offsets, recording.ends,
        turns, np.zeros((1, 3)), recording.rate,
    )  # fmt: skip


def _trunk(pose: Recording, joints: Mapping[str, int], segment: str, part: str) -> FloatArray:
    """Axes of the pelvis or thorax: y across, z up."""
    turns = pose.world_rotations[:, joints[segment]]
    across = pose.positions[:, joints[f"left_{part}"]] - pose.positions[:, joints[f"right_{part}"]]
    y = np.mean(_into(turns, across), axis=0)
    return _frame(np.mean(turns[:, 2], axis=0), y, keep="y")


def _limb(recordings: Sequence[Recording], joints: Mapping[str, int], side: str, part: str) -> FloatArray:
    """Axes of a thigh or upper arm: z along it, y about which the next joint bends."""
    sign = _BALLS[part][3]
    along, normal, bent = np.zeros(3), np.zeros(3), 0
    for recording in recordings:
        turns = recording.world_rotations[:, joints[f"{side}_{part}"]]
        upper, lower = _bones(recording, joints, side, part)
        along += -np.mean(_into(turns, upper), axis=0)
        cross = np.cross(upper, lower)
        used = (np.linalg.norm(cross, axis=1) > np.sin(BENT)) | (np.sum(upper * lower, axis=1) < 0.0)
        normal += sign * np.sum(_into(turns, cross)[used], axis=0)
        bent += int(used.sum())
    if bent < FEWEST_BENT:
        raise InputError(
            f"recording {recordings[0].name!r}: the limb below {side}_{part} is bent in {bent} frames; "
            f"valid: at least {FEWEST_BENT}, by {np.rad2deg(BENT):.0f} deg"
        )
    return _frame(along, normal, keep="z")


def _bones(
    recording: Recording, joints: Mapping[str, int], side: str, part: str
) -> tuple[FloatArray, FloatArray]:
    """(n, 3) unit directions of the upper and the lower bone, away from the trunk, world."""
    _, middle, far, _ = _BALLS[part]
    places = [recording.positions[:, joints[f"{side}_{name}"]] for name in (part, middle, far)]
    upper, lower = places[1] - places[0], places[2] - places[1]
    return (
        upper / np.linalg.norm(upper, axis=1, keepdims=True),
        lower / np.linalg.norm(lower, axis=1, keepdims=True),
    )


def _into(turns: FloatArray, vectors: FloatArray) -> FloatArray:
    """(n, 3) world vectors in the frames of (n, 3, 3)."""
    return np.einsum("nij,ni->nj", turns, vectors)


def _frame(z: FloatArray, y: FloatArray, keep: str) -> FloatArray:
    """(3, 3) with columns x, y, z of two directions; the one kept is exact."""
    if keep == "y":
        y = y / np.linalg.norm(y)
        z = z - (z @ y) * y
    z = z / np.linalg.norm(z)
    y = y - (y @ z) * z
    y = y / np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


BALL_SEGMENTS = ("thigh", "upper_arm")
"""Segments on ball joints, without their side."""


def ball_joint_angles(recording: Recording, anatomy: Anatomy) -> Mapping[str, FloatArray]:
    """Angles of the hips and shoulders of a recording.

    A shoulder's are those of the upper arm to the thorax, the movement of the shoulder girdle included.
    Each angle is within half a turn of the middle of its hinge's range.

    Args:
        recording: The motion.
        anatomy: Of the same person.

    Returns:
        (n, 3) [rad] in the order of the hinges, by segment (``"left_thigh"`` ...); equal angles of the
        two sides are mirrored postures.
    """
    body, found = human(), {}
    for part in BALL_SEGMENTS:
        for side in SIDES:
            name = f"{side}_{part}"
            hinges = body.segment(name).hinges
            axes = np.array([hinge.axis for hinge in hinges])
            middle = np.array([0.5 * (hinge.lower + hinge.upper) for hinge in hinges])
            found[name] = ball_angles(axes, anatomy.relative(recording, name), middle)
    return found


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
