"""The way up of recorded markers, where the file does not say it or says it wrongly.

A TRC file declares no axis, and some C3D files declare the one of a screen. A person who stands or walks has
the pelvis above the feet and the feet near the ground, which is at the zero of the axis that points up.
"""

from dataclasses import replace

import numpy as np

from manikin.body.segments import SIDES
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.marker_sets import marker_set
from manikin.recordings.readers.markers import ForcePlate, MarkerRecording
from manikin.recordings.readers.text_files import UP_TO_Z

UPRIGHT, LOWEST = 0.85, (-0.15, 0.35)
"""Cosine of the way from feet to pelvis with an axis from which on it points up, and the height in which the
lowest markers then are [m]."""
TURNED = "the person stands along another axis than the file's for up: turned upright"
"""Remark on a recording that is turned."""


def upward_axis(recording: MarkerRecording) -> str | None:
    """The axis, such as ``"+y"``, along which the person of a recording stands.

    None where the pelvis and the feet are not known, are not upright along an axis, or the feet are not near
    its zero: someone who lies on the ground is upright along none.
    """
    way = _from_feet_to_pelvis(recording)
    if way is None:
        return None
    axis = int(np.argmax(np.abs(way)))
    sign = 1.0 if way[axis] > 0.0 else -1.0
    lowest = float(np.nanpercentile(sign * recording.positions[..., axis], 1.0))
    if abs(way[axis]) < UPRIGHT or not LOWEST[0] <= lowest <= LOWEST[1]:
        return None
    return ("+" if sign > 0.0 else "-") + "xyz"[axis]


def turned_upright(recording: MarkerRecording) -> MarkerRecording:
    """The recording with z up by what its markers say, with a remark where that is another axis."""
    axis = upward_axis(recording)
    if axis is None or axis == "+z":
        return recording
    turn = np.array(UP_TO_Z[axis], dtype=np.float64)
    return replace(
        recording, positions=recording.positions @ turn.T,
        plates=tuple(_turned(plate, turn) for plate in recording.plates),
        remarks=(*recording.remarks, TURNED),
    )  # fmt: skip


def _from_feet_to_pelvis(recording: MarkerRecording) -> FloatArray | None:
    """(3,) median direction, None where a marker of either is missing."""
    roles = marker_set(recording).roles
    feet = [f"{side}_{part}" for side in SIDES for part in ("ankle_lateral", "heel", "toe")]
    feet = [recording.marker(roles[name]) for name in feet if name in roles]
    pelvis = [recording.marker(roles[f"{side}_asis"]) for side in SIDES if f"{side}_asis" in roles]
    if not feet or not pelvis:
        return None
    ways = np.mean(pelvis, axis=0) - np.mean(feet, axis=0)
    ways = ways[~np.isnan(ways[:, 0])]
    if not len(ways):
        return None
    way = np.median(ways, axis=0)
    return way / max(float(np.linalg.norm(way)), 1e-9)


def _turned(plate: ForcePlate, turn: FloatArray) -> ForcePlate:
    normal = turn @ plate.normal
    wrenches = (plate.wrenches.reshape(-1, 2, 3) @ turn.T).reshape(-1, 6)
    return ForcePlate(
        plate.name, wrenches, turn @ plate.origin, plate.rate, plate.start,
        normal * (np.sign(normal[2]) or 1.0),
        None if plate.corners is None else plate.corners @ turn.T,
    )  # fmt: skip
