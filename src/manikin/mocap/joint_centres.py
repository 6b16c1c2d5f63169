"""The joint centres that a recorded skeleton shares with our human."""

from collections.abc import Mapping

import numpy as np

from manikin.errors import InputError
from manikin.mocap.anatomy import JOINTS, SIDES
from manikin.mocap.recording import Recording
from manikin.spatial import FloatArray

CENTRES = tuple(
    f"{side}_{part}" for side in SIDES for part in ("thigh", "leg", "foot", "upper_arm", "forearm", "hand")
)
"""Segments whose origins are hips, knees, ankles, shoulders, elbows and wrists."""

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


def joint_centres(recording: Recording) -> Mapping[str, FloatArray]:
    """Joint centres in the world, (n, 3) [m], by segment of :data:`CENTRES`.

    Raises:
        InputError: If the skeleton lacks one of the joints.
    """
    joints = [recording.joint_index(joint_of(recording, segment)) for segment in CENTRES]
    return {segment: recording.positions[:, joint] for segment, joint in zip(CENTRES, joints, strict=True)}


def far_point(recording: Recording, joint: str) -> FloatArray | None:
    """(n, 3) end of the bone that begins at a joint: its first child, or its end [m]; None without one."""
    index = recording.joint_index(joint)
    children = np.flatnonzero(recording.parents == index)
    offset = recording.offsets[children[0]] if children.size else recording.ends.get(joint)
    if offset is None or np.linalg.norm(offset) < 1e-3:
        return None
    return recording.positions[:, index] + recording.world_rotations[:, index] @ offset
