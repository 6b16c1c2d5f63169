"""The segments of a recorded person: axes that mean the same on every skeleton.

Skeletons differ in what their rest pose is and in how their bones' frames lie. What they share are
joints, so the axes are made of those:

* **pelvis** and **thorax**: y from the right joint of the hips (shoulders) to the left one, z up in an
  upright posture, made perpendicular to y;
* **thigh** and **upper arm**: z along the bone, from its far joint to its near one; y the axis about
  which the knee (elbow) bends, made perpendicular to z, pointing to the left when the limb hangs.

Each is a fixed rotation of the frame of one joint. It is the identity on our human in the zero
posture, so rotations between these axes are those between the segments of
:func:`manikin.body.human`.

Also here. Recorded rotations of hips and shoulders as angles of our human's hinges.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import human
from manikin.body.joint_volume import ball_angles
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.skeleton_recording import Recording

SIDES = ("left", "right")

JOINTS: Mapping[str, tuple[str, ...]] = {
    # Names on skeletons of CMU (ASF, then the BVH made of them) and of ACCAD.
    "pelvis": ("pelvis", "root", "Hips"),
    "thorax": ("thorax", "Chest2", "Spine1"),
    "left_thigh": ("left_thigh", "lfemur", "LeftHip", "LeftUpLeg"),
    "left_leg": ("left_leg", "ltibia", "LeftKnee", "LeftLeg"),
    "left_foot": ("left_foot", "lfoot", "LeftAnkle", "LeftFoot"),
    "right_thigh": ("right_thigh", "rfemur", "RightHip", "RightUpLeg"),
    "right_leg": ("right_leg", "rtibia", "RightKnee", "RightLeg"),
    "right_foot": ("right_foot", "rfoot", "RightAnkle", "RightFoot"),
    "left_upper_arm": ("left_upper_arm", "lhumerus", "LeftArm", "LeftShoulder"),
    "left_forearm": ("left_forearm", "lradius", "LeftForeArm", "LeftElbow"),
    "left_hand": ("left_hand", "lwrist", "LeftHand", "LeftWrist"),
    "right_upper_arm": ("right_upper_arm", "rhumerus", "RightArm", "RightShoulder"),
    "right_forearm": ("right_forearm", "rradius", "RightForeArm", "RightElbow"),
    "right_hand": ("right_hand", "rwrist", "RightHand", "RightWrist"),
}
"""Joints at which our segments begin, by the names that occur, our own among them; the first one is taken."""

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
    joints = {segment: segment_joint(first, segment) for segment in JOINTS}
    pose = _rest(first) if upright is None else upright
    axes = {
        "pelvis": _trunk(pose, joints, "pelvis", "thigh"),
        "thorax": _trunk(pose, joints, "thorax", "upper_arm"),
    }
    for side in SIDES:
        for part in _BALLS:
            axes[f"{side}_{part}"] = _limb(recordings, joints, side, part)
    return Anatomy(joints, axes)


def segment_joint(recording: Recording, segment: str) -> int:
    """Index of the joint at which a segment of :data:`JOINTS` begins.

    Raises:
        InputError: If the segment is not known, or the recording has none of its names.
    """
    if segment not in JOINTS:
        raise InputError(f"no segment {segment!r}; valid: {', '.join(JOINTS)}")
    for name in JOINTS[segment]:
        if name in recording.joint_names:
            return recording.joint_names.index(name)
    names = ", ".join(JOINTS[segment])
    raise InputError(f"recording {recording.name!r} has no joint for {segment!r}; valid: one of {names}")


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
        anatomy: Of the same person, see :func:`manikin.recordings.reconstruction.anatomy.anatomy_of`.

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
