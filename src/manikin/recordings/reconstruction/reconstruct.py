"""A recorded motion as a motion of our human, scaled to the person.

Segments that the recording does not observe are held as people hold them: trunk and head upright, arms
hanging, turned to where the segment that carries them heads. An unmeasured trunk that was fixed to the pelvis
would tip with it, and the centre of mass too.

People tilt the trunk so that the head moves evenly (Menz, Lord and Fitzpatrick, "Acceleration patterns of the
head and pelvis when walking on level and irregular surfaces", Gait & Posture 18, 2003). In walks with markers
on the trunk its upper end has a third of the pelvis' acceleration along the walk, and follows it sideways. An
unmeasured trunk therefore tilts forward and back such that a third remains.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.joint_volume import ball_angles, ball_rotation
from manikin.errors import InputError
from manikin.kinematics.point_targets import origin_targets
from manikin.kinematics.tracking import follow
from manikin.numerics.spatial import FloatArray
from manikin.recordings.dynamics.recorded_dynamics import smooth
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.marker_reconstruction import centres_of_markers, reconstruct_markers
from manikin.recordings.reconstruction.orientation_targets import orientation_targets, trunk_turns
from manikin.recordings.reconstruction.proportions import (
    CENTRES,
    Reconstruction,
    analytic_ik,
    human_of,
    joint_centres,
)
from manikin.recordings.reconstruction.skeleton_cleaning import without_joint_jumps

UPRIGHT = ("lumbar", "thorax", "neck", "left_upper_arm", "right_upper_arm")
"""Segments on ball joints, from the pelvis outward, that are upright or hang unless they are recorded."""

_TILTED = ("lumbar", "thorax")

CALMED_SHARE, LARGEST_TILT = 1.0 / 3.0, np.deg2rad(10.0)
"""Share of the pelvis' fast motion forward and back that the upper end of an unmeasured trunk has too, and
largest tilt of it [rad]."""

SLOW = 1.0
"""Slower motion of the pelvis takes the trunk along [Hz]: below the frequency of steps."""


def unmeasured_upright(found: Reconstruction) -> Reconstruction:
    """A reconstruction with unmeasured trunk, neck and upper arms as in upright standing.

    Angles are kept to the limits of their hinges, elbows and wrists to standing. Nothing followed moves.
    """
    body, standing = found.body, found.body.standing_posture()
    if not set(UPRIGHT) & set(found.neutral):
        return found
    q = np.array(found.q)
    turns = {body.segments[0].name: Rotation.from_quat(q[:, 3:7]).as_matrix()}
    tilts = _calming_tilts(found, turns[body.segments[0].name])
    for name in UPRIGHT:
        segment = body.segment(name)
        axes = np.array([hinge.axis for hinge in segment.hinges])
        places = [7 + body.joint_index(hinge.name) for hinge in segment.hinges]
        carrier = turns[segment.parent or ""]
        if name in found.neutral:
            upright = _heading(carrier) @ tilts if name in _TILTED else _heading(carrier)
            wanted = upright @ ball_rotation(axes, standing[places])
            angles = ball_angles(axes, carrier.transpose(0, 2, 1) @ wanted, standing[places])
            limits = [(hinge.lower, hinge.upper) for hinge in segment.hinges]
            q[:, places] = np.clip(angles, *np.transpose(limits))
        turns[name] = carrier @ ball_rotation(axes, q[:, places])
    return replace(found, q=q)


def _calming_tilts(found: Reconstruction, pelvis: FloatArray) -> FloatArray:
    """(n, 3, 3) tilts of the trunk about the left axis; none where it is measured or clips are short."""
    n, rate = len(found.q), found.rate
    if not set(_TILTED) <= set(found.neutral) or n * SLOW < rate or rate <= 2.0 * SLOW:
        return np.tile(np.eye(3), (n, 1, 1))
    place = found.q[:, :2]
    fast = place - smooth(place, rate, np.full(n, SLOW))
    ahead = np.einsum("ij,ij->i", fast, _heading(pelvis)[:, :2, 0])
    length = sum(float(found.body.segment(name).origin[2]) for name in ("thorax", "neck"))
    tilt = np.clip((CALMED_SHARE - 1.0) * ahead / length, -LARGEST_TILT, LARGEST_TILT)
    return Rotation.from_rotvec(tilt[:, None] * [0.0, 1.0, 0.0]).as_matrix()


def _heading(turns: FloatArray) -> FloatArray:
    """(n, 3, 3) turns about the vertical to where the x axes of rotations point."""
    yaw = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    return Rotation.from_rotvec(yaw[:, None] * [0.0, 0.0, 1.0]).as_matrix()


def reconstruct(
    recording: Recording | MarkerRecording, body: BodyModel | None = None, *, sex: str = "male",
    mass: float | None = None,
) -> Reconstruction:  # fmt: skip
    """Motion of our human that follows a recording, by inverse kinematics within joint limits.

    Of a skeleton hips, knees, ankles, shoulders, elbows and wrists are followed; the rotations of pelvis,
    thorax, head, feet and hands count less. Our shoulders are fixed in the thorax: movements of a recorded
    shoulder girdle remain as residuals; frames in which a joint is elsewhere are filled
    (:mod:`manikin.recordings.reconstruction.skeleton_cleaning`). Of markers the markers themselves are
    followed (:mod:`manikin.recordings.reconstruction.marker_reconstruction`). Unmeasured segments are held
    as in standing, trunk and head upright and arms hanging.

    Args:
        recording: Motion of a skeleton or of markers, at least two frames.
        body: Our human; None for one with the lengths of the recorded person. With several clips of the
            person use :func:`person_of`: only extended postures show the trunk's length.
        sex: Table of segment masses where ``body`` is None.
        mass: Body mass where ``body`` is None [kg]; None for the one in the file, or else a usual one.

    Raises:
        InputError: If there is one frame only, no joint or pelvis, or left and right are swapped.
        BodyError: If the person's lengths are not those of an adult.
    """
    _check(recording)
    if isinstance(recording, MarkerRecording):
        return unmeasured_upright(reconstruct_markers(recording, body, sex, mass))
    recording, repairs = without_joint_jumps(recording)
    centres = joint_centres(recording)
    person = human_of(centres, sex, mass) if body is None else body
    pelvis, thorax = (trunk_turns(recording, centres, name) for name in ("pelvis", "thorax"))
    wanted = origin_targets(centres, CENTRES)
    followed = wanted.and_these(orientation_targets(recording, person, centres, pelvis, thorax))
    q, residual = follow(person, followed, analytic_ik(person, centres, pelvis, thorax), recording.rate)
    residual = residual[:, : len(wanted.names)]
    return Reconstruction(person, recording.time, q, wanted, residual, repairs=repairs)


def person_of(
    recordings: Sequence[Recording | MarkerRecording], *, sex: str = "male", mass: float | None = None
) -> BodyModel:
    """Our human with the lengths of a person of whom there are several recordings, from all their frames.

    Sex, mass and errors are as of :func:`reconstruct`; InputError if there is no recording.
    """
    if not recordings:
        raise InputError("no recording to take a person's lengths from; valid: at least one")
    for recording in recordings:
        _check(recording)
    marked = [one for one in recordings if isinstance(one, MarkerRecording)]
    each = [
        centres_of_markers(one) if isinstance(one, MarkerRecording) else joint_centres(one)
        for one in recordings
    ]
    unknown = [np.full((len(recording), 3), np.nan) for recording in recordings]
    everywhere = {
        name: np.concatenate([found.get(name, none) for found, none in zip(each, unknown, strict=True)])
        for name in CENTRES
        if any(name in found for found in each)
    }
    masses = [one.subject.mass for one in marked if one.subject.mass is not None]
    statures = [one.subject.stature for one in marked if one.subject.stature is not None]
    if mass is None and masses:
        mass = float(np.median(masses))
    return human_of(everywhere, sex, mass, float(np.median(statures)) if statures else None)


def _check(recording: Recording | MarkerRecording) -> None:
    if not isinstance(recording, Recording | MarkerRecording):
        given = type(recording).__name__
        raise InputError(f"reconstruction of a {given}; valid: a Recording or a MarkerRecording")
    if len(recording) < 2:
        raise InputError(f"recording {recording.name!r} has {len(recording)} frame; valid: at least 2")
