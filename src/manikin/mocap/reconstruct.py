"""A recorded motion as a motion of our human, scaled to the person."""

from collections.abc import Mapping, Sequence

import numpy as np

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.mocap.joint_centres import CENTRES, joint_centres
from manikin.mocap.marker_reconstruction import centres_of_markers, reconstruct_markers
from manikin.mocap.markers import MarkerRecording
from manikin.mocap.proportions import human_of
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recording import Recording
from manikin.mocap.skeleton_reconstruction import reconstruct_skeleton
from manikin.mocap.untold_segments import untold_upright
from manikin.spatial import FloatArray

FEWEST_FRAMES = 2


def reconstruct(
    recording: Recording | MarkerRecording,
    body: BodyModel | None = None,
    *,
    sex: str = "male",
    mass: float | None = None,
) -> Reconstruction:
    """Motion of our human that follows a recording, by inverse kinematics within joint limits.

    Of a skeleton the joint centres are followed (:mod:`manikin.mocap.skeleton_reconstruction`), of markers
    the markers themselves (:mod:`manikin.mocap.marker_reconstruction`). What no marker tells is held as in
    standing, trunk and head upright and arms hanging (:mod:`manikin.mocap.untold_segments`).

    Args:
        recording: Motion of a skeleton or of markers, at least two frames.
        body: Our human; None for one with the lengths of the recorded person. Where other clips of the
            person exist, take that of :func:`person_of` all of them: the trunk's length is told by extended
            postures only.
        sex: Table of segment masses where ``body`` is None.
        mass: Body mass where ``body`` is None [kg]; None for the one in the file, or else a usual one.

    Raises:
        InputError: If the recording has one frame only, lacks a joint, has no markers of a pelvis, or has
            left and right swapped.
        BodyError: If the person's lengths are not those of an adult.
    """
    _check(recording)
    if isinstance(recording, MarkerRecording):
        return untold_upright(reconstruct_markers(recording, body, sex, mass))
    return reconstruct_skeleton(recording, body, sex, mass)


def person_of(
    recordings: Sequence[Recording | MarkerRecording], *, sex: str = "male", mass: float | None = None
) -> BodyModel:
    """Our human with the lengths of a person of whom there are several recordings, from all their frames.

    Args:
        recordings: Of the same person, at least one.
        sex: Table of segment masses.
        mass: Body mass [kg]; None for the one in the files, or else a usual one.

    Raises:
        InputError: As :func:`reconstruct`; if there is no recording.
        BodyError: As :func:`reconstruct`.
    """
    if not recordings:
        raise InputError("no recording to take a person's lengths from; valid: at least one")
    for recording in recordings:
        _check(recording)
    each = [_centres(recording) for recording in recordings]
    everywhere = {
        name: np.concatenate([
            found.get(name, np.full((len(recording), 3), np.nan))
            for found, recording in zip(each, recordings, strict=True)
        ])
        for name in CENTRES
        if any(name in found for found in each)
    }  # fmt: skip
    subjects = [recording.subject for recording in recordings if isinstance(recording, MarkerRecording)]
    masses = [subject.mass for subject in subjects if subject.mass is not None]
    statures = [subject.stature for subject in subjects if subject.stature is not None]
    if mass is None and masses:
        mass = float(np.median(masses))
    return human_of(everywhere, sex, mass, float(np.median(statures)) if statures else None)


def _centres(recording: Recording | MarkerRecording) -> Mapping[str, FloatArray]:
    if isinstance(recording, MarkerRecording):
        return centres_of_markers(recording)
    return joint_centres(recording)


def _check(recording: Recording | MarkerRecording) -> None:
    if not isinstance(recording, Recording | MarkerRecording):
        raise InputError(
            f"reconstruction of a {type(recording).__name__}; valid: a Recording or a MarkerRecording"
        )
    if len(recording) < FEWEST_FRAMES:
        raise InputError(
            f"recording {recording.name!r} has {len(recording)} frame; valid: at least {FEWEST_FRAMES}"
        )
