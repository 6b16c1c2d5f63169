"""What a skeleton tells beyond its joint centres: turns of pelvis, thorax and head, feet and hands.

Each is expressed by points on our segments, as markers would be. They weigh less than joint centres,
for they are placed by assumption: where the trunk is most extended, pelvis and thorax are taken to be
aligned with it; on the mean of a recording the head looks where the chest points; a sole is flat where
its ankle is lowest.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.mocap.closed_form import frames, trunk_axes
from manikin.mocap.joint_centres import far_point, joint_of
from manikin.mocap.proportions import hanging_arms, middle
from manikin.mocap.recording import Recording
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

WEIGHT = 0.05
"""Of a guide, against 1 of a joint centre."""

ARM = 0.2
"""Distance of a guide from the middle of its segment's joints [m]."""

LOWEST_SHARE, LOWEST = 5.0, 0.01
"""A sole is flat up to this [m] above this percentile of the ankle's height."""

OTHER_FOOT = np.deg2rad(25.0)
"""A foot's bone differs from ours by less than this when the sole is flat [rad]."""

_PARTS = {"pelvis": "thigh", "thorax": "upper_arm"}

HEADS = ("head", "Head")
NECKS = ("neck", "Neck", "lowerneck")


def trunk_turns(recording: Recording, centres: Mapping[str, FloatArray], segment: str) -> FloatArray:
    """(n, 3, 3) from the axes of ``"pelvis"`` or ``"thorax"`` to the world's.

    The recorded joint's turns, aligned with the line from hips to shoulders where that is longest and the
    arms hang; the
    left-right axis is exactly that of the two joint centres.
    """
    geometric = trunk_axes(centres, _PARTS[segment])
    length = np.linalg.norm(middle(centres, "upper_arm") - middle(centres, "thigh"), axis=1)
    hanging = hanging_arms(centres)
    straight = hanging[np.argmax(length[hanging])]
    turns = recording.world_rotations[:, recording.joint_index(joint_of(recording, segment))]
    turned = turns @ turns[straight].T @ geometric[straight]
    return frames(turned[:, :, 2], geometric[:, :, 1], keep_y=True)


def guides(
    recording: Recording, body: BodyModel, centres: Mapping[str, FloatArray],
    pelvis: FloatArray, thorax: FloatArray,
) -> Targets:  # fmt: skip
    """Targets of the turns of pelvis, thorax and head and of the directions of feet and hands.

    Args:
        recording: The skeleton's motion.
        body: Our human.
        centres: (n, 3) joint centres [m].
        pelvis: (n, 3, 3) from the pelvis' axes to the world's.
        thorax: (n, 3, 3) from the thorax' axes to the world's.
    """
    girdle = np.array(body.segment("left_upper_arm").origin) * [1.0, 0.0, 1.0]
    found: list[tuple[str, FloatArray, FloatArray]] = [
        ("pelvis", np.array([0.0, 0.0, ARM]), middle(centres, "thigh") + ARM * pelvis[:, :, 2]),
        (
            "thorax",
            girdle + np.array([ARM, 0.0, 0.0]),
            middle(centres, "upper_arm") + ARM * thorax[:, :, 0],
        ),
    ]
    found += _head(recording, body, centres, thorax, girdle)
    for side in ("left", "right"):
        for segment in (f"{side}_foot", f"{side}_hand"):
            far = far_point(recording, joint_of(recording, segment))
            if far is not None:
                bone = far - centres[segment]
                length = float(np.median(np.linalg.norm(bone, axis=1)))
                direction = np.array([0.0, 0.0, -1.0])
                if segment.endswith("foot"):
                    toes = body.segment(f"{side}_toes").origin
                    rise = rise_when_flat(centres[segment], bone, float(np.arctan2(toes[2], toes[0])))
                    direction = np.array([np.cos(rise), 0.0, np.sin(rise)])
                found.append((segment, length * direction, far))
    segments = tuple(segment for segment, _, _ in found)
    return Targets(
        tuple(f"{segment} guide" for segment in segments), segments, np.array([p for _, p, _ in found]),
        np.stack([places for _, _, places in found], axis=1), np.full(len(found), WEIGHT),
    )  # fmt: skip


def rise_when_flat(ankle: FloatArray, bone: FloatArray, ours: float) -> float:
    """Angle above the horizontal of a recorded foot's bone when the sole is flat [rad].

    The sole is taken to be flat where the ankle is lowest. An angle that is far from our foot's says
    that it never is (crawling, lying), and ours is taken.

    Args:
        ankle: (n, 3) [m]; frames that are NaN are left out.
        bone: (n, 3) from back to front [m].
        ours: Our foot's angle [rad].
    """
    known = ~np.isnan(ankle[:, 2] + bone[:, 2])
    if not known.any():
        return ours
    height, along = ankle[known, 2], bone[known]
    low = height <= np.percentile(height, LOWEST_SHARE) + LOWEST
    rise = np.arctan2(along[:, 2], np.linalg.norm(along[:, :2], axis=1))
    found = float(np.median(rise[low]))
    return found if abs(found - ours) < OTHER_FOOT else ours


def _head(
    recording: Recording, body: BodyModel, centres: Mapping[str, FloatArray], thorax: FloatArray,
    girdle: FloatArray,
) -> list[tuple[str, FloatArray, FloatArray]]:  # fmt: skip
    """Above and before the neck's base, by the line from the neck to the vertex; none without a head."""
    head = next((name for name in HEADS if name in recording.joint_names), None)
    neck = next((name for name in NECKS if name in recording.joint_names), None)
    if head is None or neck is None:
        return []
    top = far_point(recording, head)
    if top is None:
        top = recording.positions[:, recording.joint_index(head)]
    up = top - recording.positions[:, recording.joint_index(neck)]
    turns = recording.world_rotations[:, recording.joint_index(head)]
    local = Rotation.from_matrix(turns.transpose(0, 2, 1) @ thorax).mean().as_matrix()
    axes = frames(up, (turns @ local)[:, :, 1], keep_y=False)
    rise = np.array(body.segment("neck").origin) - girdle
    base = middle(centres, "upper_arm") + np.einsum("nij,j->ni", thorax, rise)
    return [
        ("neck", np.array([0.0, 0.0, ARM]), base + ARM * axes[:, :, 2]),
        ("neck", np.array([ARM, 0.0, 0.0]), base + ARM * axes[:, :, 0]),
    ]
