"""The angles of a posture that RULA and REBA ask for, for all frames at once.

An observer sees these angles from the side, from behind and from above; here each is defined from the segment
frames (x forward, y left, z up). All are 0 in the zero posture: upright, arms hanging, palms inward.

* trunk: the line from between the hips to the base of the neck, against the vertical, in the vertical planes
  along and across the pelvis' heading; its twist is that of the segment with the shoulders on the pelvis;
* neck: the head's axis in the frame of the segment with the shoulders;
* head: its straight ahead against the horizontal, whatever trunk and neck do;
* upper arm, elbow, forearm: directions of the segments in the frame of the segment with the shoulders;
* wrist: the forearm's direction in the frame of the hand; twist of the forearm against the upper arm.

Twists are what a rotation is left with when the shortest swing of the long axis is taken away.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.ergonomics.body_parts import parts_of, twist_about_z
from manikin.errors import BodyError
from manikin.kinematics.point_targets import SegmentPlacements
from manikin.numerics.spatial import FloatArray, dot, unit

SIDEWAYS = np.deg2rad(45.0)
"""An upper arm lifted further sideways than this has no angle in the sagittal plane worth the name; ours."""
UPRIGHT = np.deg2rad(10.0)
"""Lean of the trunk up to which a neck is taken for upright; ours."""


@dataclass(frozen=True, eq=False)
class ArmAngles:
    """One arm, (n,) each.

    Attributes:
        flexion: Of the upper arm in the sagittal plane of the chest, backwards negative [rad].
        abduction: Of the upper arm out of that plane, outward positive [rad].
        elevation: Between the upper arm and the chest's downward axis [rad].
        from_vertical: Between the upper arm and the world's downward vertical [rad].
        ahead, beside: Of the upper arm out of the vertical planes across and along the chest's heading,
            forward and outward positive [rad].
        elbow: Flexion, 0 for a straight arm [rad].
        outward: Of the forearm out of the sagittal plane of the chest, outward positive [rad].
        aside: Of the wrist from the middle plane of the chest, negative across it [m].
        wrist_flexion: Towards the palm [rad].
        wrist_deviation: Towards the thumb [rad].
        wrist_twist: Of the forearm from the middle, pronation positive [rad].
    """

    flexion: FloatArray
    abduction: FloatArray
    elevation: FloatArray
    from_vertical: FloatArray
    ahead: FloatArray
    beside: FloatArray
    elbow: FloatArray
    outward: FloatArray
    aside: FloatArray
    wrist_flexion: FloatArray
    wrist_deviation: FloatArray
    wrist_twist: FloatArray

    @property
    def raised(self) -> FloatArray:
        """(n,) angle by which an upper arm is scored, backwards negative [rad].

        Flexion in the sagittal plane, as published; of an arm lifted more than 45 degrees sideways that is
        not defined, and its elevation is taken (our choice).
        """
        return np.where(np.abs(self.abduction) > SIDEWAYS, self.elevation, self.flexion)


@dataclass(frozen=True, eq=False)
class PosturalAngles:
    """Angles of a motion, (n,) each; those of the neck are of the head against the chest.

    Attributes:
        trunk_flexion, neck_flexion: Forward positive [rad].
        trunk_side_bend, trunk_twist, neck_side_bend, neck_twist: To the left positive [rad].
        head_inclination: Of the head's straight ahead below the horizontal [rad].
        knees: Flexion by side [rad].
    """

    trunk_flexion: FloatArray
    trunk_side_bend: FloatArray
    trunk_twist: FloatArray
    neck_flexion: FloatArray
    neck_side_bend: FloatArray
    neck_twist: FloatArray
    head_inclination: FloatArray
    arms: Mapping[str, ArmAngles]
    knees: Mapping[str, FloatArray]

    def arm(self, side: str) -> FloatArray:
        """(n, 7) what an arm does [rad]: flexion, abduction, elbow, outward, and the wrist's three."""
        arm = self.arms[side]
        wrist = arm.wrist_flexion, arm.wrist_deviation, arm.wrist_twist
        return np.column_stack([arm.flexion, arm.abduction, arm.elbow, arm.outward, *wrist])

    def trunk_and_legs(self) -> FloatArray:
        """(n, 8) what trunk, neck and knees do [rad]."""
        trunk = (self.trunk_flexion, self.trunk_side_bend, self.trunk_twist)
        neck = (self.neck_flexion, self.neck_side_bend, self.neck_twist)
        return np.column_stack([*trunk, *neck, *(self.knees[side] for side in SIDES)])

    def columns_deg(self) -> dict[str, FloatArray]:
        """Every angle in degrees by its name, ``left_arm_flexion_deg`` and so on."""
        found = {name: angle for name, angle in vars(self).items() if name not in ("arms", "knees")}
        for side in SIDES:
            arm = vars(self.arms[side]).items()
            found |= {f"{side}_arm_{name}": angle for name, angle in arm if name != "aside"}
            found[f"{side}_knee_flexion"] = self.knees[side]
        return {f"{name}_deg": np.rad2deg(angle) for name, angle in found.items()}


def postural_angles(body: BodyModel, q: FloatArray, neck_upright: float = 0.0) -> PosturalAngles:
    """Measure the angles of postures.

    Args:
        body: A human: two arms and two legs of three segments, and a head.
        q: (n, nq) configurations.
        neck_upright: Flexion of an upright neck, from which that of the neck and the head's inclination are
            counted [rad]. 0 for what we plan; of recordings see :func:`upright_neck`.

    Raises:
        BodyError: If the body is no human, or the configurations are of another body.
    """
    q = np.asarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != body.nq:
        raise BodyError(f"configurations have shape {q.shape}; valid: (n, {body.nq})")
    parts = parts_of(body)
    pelvis, chest, neck, head = parts.trunk[0], parts.trunk[-1], parts.neck[0], parts.neck[-1]
    limbs = [name for side in SIDES for name in (*parts.arms[side], *parts.legs[side])]
    at = _Frames(body, q, [pelvis, chest, neck, head, *limbs])
    forward, aside = _bend(_upright_axes(at.turns[pelvis]), at.places[neck])
    looks = at.turned(head, chest)
    return PosturalAngles(
        trunk_flexion=forward, trunk_side_bend=aside, trunk_twist=twist_about_z(at.turned(chest, pelvis)),
        neck_flexion=np.arctan2(looks[:, 0, 2], looks[:, 2, 2]) - neck_upright,
        neck_side_bend=_arcsin(looks[:, 1, 2]), neck_twist=twist_about_z(looks),
        head_inclination=_below_level(at.turns[head]) - neck_upright,
        arms={side: _arm(at, parts.arms[side], chest, side) for side in SIDES},
        knees={side: _tilt(at.turned(shank, thigh)) for side, (thigh, shank, _) in parts.legs.items()},
    )  # fmt: skip


def upright_neck(body: BodyModel, q: FloatArray) -> float | None:
    """Flexion of the neck in upright standing or walking, the zero of a recording's neck [rad].

    The line from the base of a real neck to the top of the head leans forward (by 10 to 23 degrees in the
    skeletons we looked at), while the neck of our human is upright at 0. So where recorded points are
    followed an upright neck has that angle. It is taken from the recording itself: the median over the frames
    whose trunk is within 10 degrees of the vertical, or None without such a frame. A person who looks down
    all the time is not noticed. Arguments and errors are those of :func:`postural_angles`.
    """
    angles = postural_angles(body, q)
    upright = np.hypot(angles.trunk_flexion, angles.trunk_side_bend) <= UPRIGHT
    return float(np.median(angles.neck_flexion[upright])) if upright.any() else None


def _upright_axes(turn: FloatArray) -> FloatArray:
    """(n, 3, 3) forward, left and up as rows, where a segment's left is made level."""
    left = unit(turn[:, :, 1] * [1.0, 1.0, 0.0], 1e-12)
    up = np.broadcast_to([0.0, 0.0, 1.0], left.shape)
    return np.stack([np.cross(left, up), left, up], axis=1)


def _below_level(turn: FloatArray) -> FloatArray:
    """(n,) angle of a segment's x axis below the horizontal, beyond 90 degrees upside down."""
    return np.arctan2(-turn[:, 2, 0], turn[:, 2, 2])


def _bend(axes: FloatArray, line: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Flexion and side bend of a line (n, 3) in axes given as rows [rad]."""
    x, y, z = np.einsum("nij,nj->in", axes, line / np.linalg.norm(line, axis=1, keepdims=True))
    return np.arctan2(x, z), _arcsin(y)


class _Frames:
    """Rotations (n, 3, 3) of segments to the world, and their places (n, 3) from the root [m], by name."""

    def __init__(self, body: BodyModel, q: FloatArray, names: Sequence[str]) -> None:
        placed = SegmentPlacements(body, names).of(q)
        self.turns = dict(zip(names, placed.turns.transpose(0, 3, 1, 2), strict=True))
        self.places = dict(zip(names, placed.shifts.transpose(0, 2, 1), strict=True))

    def turned(self, segment: str, carrier: str) -> FloatArray:
        """(n, 3, 3) rotation of a segment in the frame of another one."""
        return np.swapaxes(self.turns[carrier], 1, 2) @ self.turns[segment]


def _arm(at: _Frames, arm: tuple[str, str, str], chest: str, side: str) -> ArmAngles:
    outward = 1.0 if side == "left" else -1.0
    upper, fore = (-at.turned(name, chest)[:, :, 2] for name in arm[:2])  # limbs hang along -z
    ahead, beside, _ = np.einsum("nij,nj->in", _upright_axes(at.turns[chest]), -at.turns[arm[0]][:, :, 2])
    away = at.places[arm[2]] - at.places[chest]
    in_upper_arm, wrist = at.turned(arm[1], arm[0]), at.turned(arm[2], arm[1])
    in_hand = wrist[:, 2, :]  # the forearm's long axis, free of a turn about it
    turn = twist_about_z(in_upper_arm) + np.arctan2(-wrist[:, 0, 1], wrist[:, 1, 1])
    return ArmAngles(
        flexion=np.arctan2(upper[:, 0], -upper[:, 2]), abduction=outward * _arcsin(upper[:, 1]),
        elevation=_tilt(at.turned(arm[0], chest)), from_vertical=_tilt(at.turns[arm[0]]),
        ahead=_arcsin(ahead), beside=outward * _arcsin(beside),
        elbow=_tilt(in_upper_arm), outward=outward * _arcsin(fore[:, 1]),
        aside=outward * dot(at.turns[chest][:, :, 1], away), wrist_flexion=-outward * _arcsin(in_hand[:, 1]),
        wrist_deviation=np.arctan2(in_hand[:, 0], in_hand[:, 2]), wrist_twist=-outward * turn,
    )  # fmt: skip


def _arcsin(value: FloatArray) -> FloatArray:
    return np.arcsin(np.clip(value, -1.0, 1.0))


def _tilt(turn: FloatArray) -> FloatArray:
    """(n,) angle between the z axes of a segment and of the frame that it is turned in [rad]."""
    x, y, z = turn[:, :, 2].T
    return np.arctan2(np.hypot(x, y), z)
