"""Names of the joints at which the segments of a recorded skeleton begin."""

from collections.abc import Mapping

from manikin.errors import InputError
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

WRISTS = {"left_hand": ("lhand",), "right_hand": ("rhand",)}
"""Joints that are the wrist before those of JOINTS: CMU's ASF ends the forearm twice, second at the wrist."""


def joint_of(recording: Recording, segment: str) -> str:
    """Name of the recorded joint at which one of our segments begins.

    Raises:
        InputError: If the skeleton has none.
    """
    names = (*WRISTS.get(segment, ()), *JOINTS[segment])
    for name in names:
        if name in recording.joint_names:
            return name
    raise InputError(
        f"recording {recording.name!r} has no joint for {segment!r}; valid: one of {', '.join(names)}"
    )


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
