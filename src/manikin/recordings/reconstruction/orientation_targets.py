"""Targets for the rotations of segments, beside joint centres, of recorded skeletons and markers.

Each is expressed by points on our segments, as markers would be. They weigh less than joint centres because
they rest on assumptions: where the trunk is most extended, pelvis and thorax are aligned with it, or with the
vertical if the trunk has no markers; on the mean of a recording the head looks where the chest points; a sole
is flat where its ankle is lowest; in the zero posture palms point inward.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.kinematics.point_targets import PointTargets
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.marker_sets import MarkerSet, joint_of
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.proportions import (
    CENTRES,
    far_point,
    frames,
    hanging_arms,
    middle,
    trunk_axes,
)

FEWEST = 3
"""Fewest markers that define a rotation."""

_Guide = tuple[str, FloatArray, FloatArray]


def placing_targets(
    recording: MarkerRecording, found: MarkerSet, body: BodyModel, marks: Mapping[str, FloatArray],
    centres: Mapping[str, FloatArray], pelvis: FloatArray,
) -> tuple[PointTargets, FloatArray]:  # fmt: skip
    """Joint centres and guides of every frame, NaN where one is not seen, and the turns of our pelvis.

    They follow from ``marks`` (n, 3) by role [m], joint ``centres`` (n, 3) [m] and ``pelvis`` (n, 3, 3), from
    the axes of the pelvis' markers to the world's; the turns found are (n, 3, 3) from those of our pelvis.
    """
    joints = [name for name in CENTRES if name in centres and _seen(centres[name])]
    up = _trunk_up(marks, centres)
    if up is not None and not _seen(up + pelvis[:, :, 0]):
        up = None
    pelvis = _aligned_pelvis(pelvis, up, centres)
    guides = [("pelvis", ARM * _Z, middle(centres, "thigh") + ARM * pelvis[:, :, 2])]
    thorax = _thorax(cluster_turns(_of_segment(recording, found, "thorax")), centres, pelvis, up)
    if thorax is not None:
        guides += _thorax_guides(body, marks, centres, thorax)
        guides += _marked_head(cluster_turns(_of_segment(recording, found, "head")), body, centres, thorax)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        guides += _foot(side, marks, centres)
        guides += _turns_of_limbs(body, side, sign, marks, centres)
    guides = [(name, np.zeros(3), centres[name]) for name in joints] + [g for g in guides if _seen(g[2])]
    return _targets(guides, len(joints)), pelvis


def _targets(guides: Sequence[_Guide], joints: int = 0) -> PointTargets:
    """Targets of guides, after joint centres, whose weight is 1."""
    segments, points, places = zip(*guides, strict=True)
    weights = np.append(np.ones(joints), np.full(len(guides) - joints, WEIGHT))
    return PointTargets(segments, segments, np.array(points), np.stack(places, axis=1), weights)


def cluster_turns(places: FloatArray) -> FloatArray | None:
    """(n, 3, 3) turns of a rigid set of (n, k, 3) markers since the first frame in which all are seen.

    NaN where fewer than three are seen; None where there is no frame of all.
    """
    whole = np.flatnonzero(~np.isnan(places).any(axis=(1, 2)))
    if places.shape[1] < FEWEST or not whole.size:
        return None
    model, turns = places[whole[0]], np.full((len(places), 3, 3), np.nan)
    seen = ~np.isnan(places[..., 0])
    enough = np.flatnonzero(seen.sum(axis=1) >= FEWEST)
    weights = seen[enough][..., None] / seen[enough].sum(axis=1)[:, None, None]
    now = np.where(seen[enough][..., None], places[enough], 0.0)
    first = model - np.sum(weights * model, axis=1, keepdims=True)
    last = now - np.sum(weights * now, axis=1, keepdims=True)
    turns[enough] = best_turns(weights * first, last)
    return turns


def best_turns(first: FloatArray, last: FloatArray) -> FloatArray:
    """(n, 3, 3) rotations that bring vectors (n, k, 3) closest to others (n, k, 3).

    By the singular values of their products: Kabsch, "A discussion of the solution for the best rotation to
    relate two sets of vectors", Acta Crystallographica A34 (1978).
    """
    left, _, right = np.linalg.svd(last.transpose(0, 2, 1) @ first)
    left[..., 2] *= np.linalg.det(left @ right)[:, None]
    return left @ right


def _seen(places: FloatArray) -> bool:
    return not np.all(np.isnan(places[:, 0]))


def _trunk_up(marks: Mapping[str, FloatArray], centres: Mapping[str, FloatArray]) -> FloatArray | None:
    """(n, 3) from between the hips to between the shoulders, or else to the neck's base [m]."""
    hips = middle(centres, "thigh")
    if "left_upper_arm" in centres and _seen(middle(centres, "upper_arm")):
        return middle(centres, "upper_arm") - hips
    if "c7" in marks and "notch" in marks and _seen(marks["c7"] + marks["notch"]):
        return 0.5 * (marks["c7"] + marks["notch"]) - hips
    return None


def _aligned_pelvis(
    turns: FloatArray, up: FloatArray | None, centres: Mapping[str, FloatArray]
) -> FloatArray:
    """Turned about the left-right axis, by the same angle always, to the trunk or the vertical."""
    local = np.nanmedian(turns[:, 2], axis=0)
    if up is not None:
        straight = _straightest(up, centres, turns)
        local = turns[straight].T @ up[straight]
    angle = float(np.arctan2(local[0], local[2]))
    return turns @ Rotation.from_euler("y", angle).as_matrix()


def _straightest(up: FloatArray, centres: Mapping[str, FloatArray], turns: FloatArray) -> int:
    """Frame with the longest trunk and hanging arms of those in which everything is known."""
    length = np.linalg.norm(up, axis=1)
    allowed = ~np.isnan(turns[:, 0, 0]) & ~np.isnan(length)
    if "left_upper_arm" in centres:
        hanging = np.zeros(len(up), dtype=bool)
        hanging[hanging_arms(centres)] = True
        allowed = allowed & hanging if np.any(allowed & hanging) else allowed
    known = np.flatnonzero(allowed)
    return int(known[np.argsort(length[known])[int(0.9 * (len(known) - 1))]])


def _thorax(
    turns: FloatArray | None, centres: Mapping[str, FloatArray], pelvis: FloatArray, up: FloatArray | None
) -> FloatArray | None:
    """(n, 3, 3) from the axes of the thorax to the world's; None without three markers of it."""
    if turns is None or up is None:
        return None
    both = turns[:, 0, 0] + up[:, 0] + pelvis[:, 0, 0]
    if np.all(np.isnan(both)):
        return None
    if "left_upper_arm" not in centres:
        # A walking person sways over the hips, the same to both sides: the mean of the straightest half.
        length = np.where(np.isnan(both), np.nan, np.linalg.norm(up, axis=1))
        tall = length >= np.nanmedian(length)
        local = [np.einsum("nji,nj->ni", turns, axis)[tall].mean(axis=0) for axis in (up, pelvis[:, :, 1])]
        return turns @ frames(local[0][None], local[1][None], keep_y=False)[0]
    straight = _straightest(up + turns[:, :, 0] * 0.0, centres, pelvis)
    aside = centres["left_upper_arm"] - centres["right_upper_arm"]
    there = frames(up[straight][None], aside[straight][None], keep_y=True)[0]
    return turns @ turns[straight].T @ there


def _thorax_guides(
    body: BodyModel, marks: Mapping[str, FloatArray], centres: Mapping[str, FloatArray], thorax: FloatArray
) -> list[_Guide]:
    """Where the chest points, seen from the shoulders, or from the neck's base."""
    if "left_upper_arm" in centres:
        place = middle(centres, "upper_arm")
        return [("thorax", _girdle(body) + ARM * _X, place + ARM * thorax[:, :, 0])]
    # As far from the hips as in our straight trunk: markers are not where our neck begins, and a trunk that
    # is pressed together or pulled apart would bend to its limits.
    base, hips = body.segment("neck").origin, middle(centres, "thigh")
    up = 0.5 * (marks["c7"] + marks["notch"]) - hips
    place = hips + _trunk_length(body) * up / np.linalg.norm(up, axis=1, keepdims=True)
    return [("thorax", base + ARM * axis, place + ARM * thorax[:, :, k]) for k, axis in enumerate(np.eye(3))]


def _girdle(body: BodyModel) -> FloatArray:
    """(3,) between the shoulders, in the thorax [m]."""
    return body.segment("left_upper_arm").origin * [1.0, 0.0, 1.0]


def _trunk_length(body: BodyModel) -> float:
    """From the pelvis to the neck of a straight trunk [m]."""
    return float(np.linalg.norm(sum(body.segment(name).origin for name in ("neck", "thorax", "lumbar"))))


def _marked_head(
    turns: FloatArray | None, body: BodyModel, centres: Mapping[str, FloatArray], thorax: FloatArray
) -> list[_Guide]:
    """As :func:`_head`, by the turns of three markers."""
    if turns is None:
        return []
    local = turns.transpose(0, 2, 1) @ thorax
    known = ~np.isnan(local[:, 0, 0])
    if not known.any():
        return []
    axes = turns @ Rotation.from_matrix(local[known]).mean().as_matrix()
    if "left_upper_arm" in centres:
        return _head_guides(body, centres, thorax, axes)[::-1]
    place = middle(centres, "thigh") + _trunk_length(body) * thorax[:, :, 2]
    return [("neck", ARM * _X, place + ARM * axes[:, :, 0]), ("neck", ARM * _Z, place + ARM * axes[:, :, 2])]


def _head_guides(
    body: BodyModel, centres: Mapping[str, FloatArray], thorax: FloatArray, axes: FloatArray
) -> list[_Guide]:
    """Above and before the neck's base, by the axes of the head."""
    rise = body.segment("neck").origin - _girdle(body)
    base = middle(centres, "upper_arm") + np.einsum("nij,j->ni", thorax, rise)
    return [("neck", ARM * _Z, base + ARM * axes[:, :, 2]), ("neck", ARM * _X, base + ARM * axes[:, :, 0])]


def _foot(side: str, marks: Mapping[str, FloatArray], centres: Mapping[str, FloatArray]) -> list[_Guide]:
    """Direction from heel to toes, laid at the ankle."""
    heel, toe, ankle = (marks.get(f"{side}_heel"), marks.get(f"{side}_toe"), centres.get(f"{side}_foot"))
    if heel is None or toe is None or ankle is None or not _seen(heel + toe + ankle):
        return []
    rise = rise_when_flat(ankle, toe - heel, 0.0)
    point = ARM * np.array([np.cos(rise), 0.0, np.sin(rise)])
    return [(f"{side}_foot", point, ankle + _arm(toe - heel))]


def _arm(way: FloatArray) -> FloatArray:
    """(n, 3) of the length :data:`ARM` along (n, 3)."""
    return ARM * way / np.linalg.norm(way, axis=1, keepdims=True)


def _turns_of_limbs(
    body: BodyModel, side: str, sign: float, marks: Mapping[str, FloatArray],
    centres: Mapping[str, FloatArray],
) -> list[_Guide]:  # fmt: skip
    """Outer markers of knees and elbows, and both of a wrist, seen from the joints' centres."""
    guides: list[_Guide] = []
    for segment, following, role in (
        ("thigh", "leg", "knee_lateral"), ("upper_arm", "forearm", "elbow_lateral"),
    ):  # fmt: skip
        centre, marker = centres.get(f"{side}_{following}"), marks.get(f"{side}_{role}")
        if centre is not None and marker is not None and _seen(marker - centre):
            point = body.segment(f"{side}_{following}").origin + sign * ARM * _Y
            guides.append((f"{side}_{segment}", point, centre + _arm(marker - centre)))
    radius, ulna = marks.get(f"{side}_wrist_radius"), marks.get(f"{side}_wrist_ulna")
    if radius is not None and ulna is not None and _seen(radius - ulna):
        point = body.segment(f"{side}_hand").origin + ARM * _X
        guides.append((f"{side}_forearm", point, 0.5 * (radius + ulna) + _arm(radius - ulna)))
    return guides


def _of_segment(recording: MarkerRecording, found: MarkerSet, segment: str) -> FloatArray:
    """(n, k, 3) markers of a segment."""
    return recording.chosen([name for name, place in found.segments.items() if place == segment]).positions


WEIGHT, ARM = 0.05, 0.2
"""Weight of a guide, against 1 of a joint centre, and its distance from the middle of its segment's joints
[m]."""

LOWEST_SHARE, LOWEST, OTHER_FOOT = 5.0, 0.01, np.deg2rad(25.0)
"""A sole is flat up to the second [m] above the first percentile of the ankle's height; a foot's bone then
differs from ours by less than the third [rad]."""

_PARTS = {"pelvis": "thigh", "thorax": "upper_arm"}

_X, _Y, _Z = np.eye(3)

HEADS = ("head", "Head")
NECKS = ("neck", "Neck", "lowerneck")


def trunk_turns(recording: Recording, centres: Mapping[str, FloatArray], segment: str) -> FloatArray:
    """(n, 3, 3) from the axes of ``"pelvis"`` or ``"thorax"`` to the world's.

    The recorded joint's rotations, aligned with the line from hips to shoulders where that is longest and the
    arms hang; the left-right axis is exactly that of the two joint centres.
    """
    geometric = trunk_axes(centres, _PARTS[segment])
    length = np.linalg.norm(middle(centres, "upper_arm") - middle(centres, "thigh"), axis=1)
    hanging = hanging_arms(centres)
    straight = hanging[np.argmax(length[hanging])]
    turns = recording.world_rotations[:, joint_of(recording, segment)]
    turned = turns @ turns[straight].T @ geometric[straight]
    return frames(turned[:, :, 2], geometric[:, :, 1], keep_y=True)


def orientation_targets(
    recording: Recording, body: BodyModel, centres: Mapping[str, FloatArray],
    pelvis: FloatArray, thorax: FloatArray,
) -> PointTargets:  # fmt: skip
    """Targets of the turns of pelvis, thorax and head and of the directions of feet and hands.

    Joint centres (n, 3) [m]; ``pelvis`` and ``thorax`` (n, 3, 3) are from their axes to the world's.
    """
    found: list[_Guide] = [
        ("pelvis", ARM * _Z, middle(centres, "thigh") + ARM * pelvis[:, :, 2]),
        ("thorax", _girdle(body) + ARM * _X, middle(centres, "upper_arm") + ARM * thorax[:, :, 0]),
    ]
    found += _head(recording, body, centres, thorax)
    for side in SIDES:
        for segment in (f"{side}_foot", f"{side}_hand"):
            far = far_point(recording, joint_of(recording, segment))
            if far is not None:
                bone, direction = far - centres[segment], -_Z
                length = float(np.median(np.linalg.norm(bone, axis=1)))
                if segment.endswith("foot"):
                    toes = body.segment(f"{side}_toes").origin
                    rise = rise_when_flat(centres[segment], bone, float(np.arctan2(toes[2], toes[0])))
                    direction = np.array([np.cos(rise), 0.0, np.sin(rise)])
                found.append((segment, length * direction, far))
    return _targets(found)


def rise_when_flat(ankle: FloatArray, bone: FloatArray, ours: float) -> float:
    """Angle above the horizontal of a recorded foot's bone when the sole is flat [rad].

    The sole is taken to be flat where the ankle (n, 3) [m] is lowest; ``bone`` (n, 3) [m] is from back to
    front, both NaN where not known. An angle that is far from our foot's, ``ours`` [rad], says that it never
    is (crawling, lying), and ours is taken.
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
    recording: Recording, body: BodyModel, centres: Mapping[str, FloatArray], thorax: FloatArray
) -> list[_Guide]:
    """Above and before the neck's base, by the line from the neck to the vertex; none without a head."""
    known = recording.joint_names
    head, neck = (next((known.index(n) for n in names if n in known), None) for names in (HEADS, NECKS))
    if head is None or neck is None:
        return []
    top = far_point(recording, head)
    up = (recording.positions[:, head] if top is None else top) - recording.positions[:, neck]
    turns = recording.world_rotations[:, head]
    local = Rotation.from_matrix(turns.transpose(0, 2, 1) @ thorax).mean().as_matrix()
    axes = frames(up, (turns @ local)[:, :, 1], keep_y=False)
    return _head_guides(body, centres, thorax, axes)
