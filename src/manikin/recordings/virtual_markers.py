"""Markers on our human where a recording would have them, so that motions can be written as recordings.

They lie where :mod:`manikin.recordings.reconstruction.marker_reconstruction` finds the joint centres again:
hips by the regression of Harrington et al. (2007), inverted; knees, ankles, elbows and wrists midway between
two markers; shoulders below the acromion by Rab et al. (2002). Markers on the trunk, the head and the middle
of limbs are at shares of the body's own lengths, our choice. Names are those of Plug-in Gait, with ``M`` for
the inner markers of knee, ankle and elbow.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.body.skin import has_skin, segment_frames
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.recordings.reconstruction.marker_reconstruction import (
    ANKLE_WIDTH,
    ELBOW_WIDTH,
    KNEE_WIDTH,
    SHOULDER_SHARE,
)

PELVIS_DEPTH = 0.62
"""Distance of the PSIS behind the ASIS per distance of both ASIS; our choice."""
WRIST_WIDTH = 0.055
"""Distance of both markers of a wrist [m]; our choice."""


@dataclass(frozen=True, eq=False)
class VirtualMarker:
    """A point fixed to a segment.

    Attributes:
        name: As in Plug-in Gait.
        segment: Name of the segment.
        place: (3,) in the segment's frame [m].
    """

    name: str
    segment: str
    place: FloatArray


def virtual_markers(body: BodyModel) -> tuple[VirtualMarker, ...]:
    """Markers of a human.

    Raises:
        InputError: If the body is no human of 19 segments.
    """
    if not has_skin(body):
        raise InputError(f"body {body.name!r} has no anatomical landmarks; valid: a human")
    middle = [VirtualMarker(*item) for item in _middle(body)]
    sides = (("L", "left", 1.0), ("R", "right", -1.0))
    return (*middle, *(VirtualMarker(*item) for side in sides for item in _side(body, *side)))


def marker_paths(body: BodyModel, markers: tuple[VirtualMarker, ...], q: FloatArray) -> FloatArray:
    """(n, m, 3) places of markers in configurations (n, nq) in the world [m]."""
    index = {segment.name: number for number, segment in enumerate(body.segments)}
    places, carriers = np.array([m.place for m in markers]), [index[m.segment] for m in markers]
    frames = [segment_frames(body, posture) for posture in q]
    turns, origins = (np.array([frame[k] for frame in frames])[:, carriers] for k in (0, 1))
    return np.einsum("nmij,mj->nmi", turns, places) + origins


Item = tuple[str, str, FloatArray]


def _at(*place: float) -> FloatArray:
    return np.array(place)


def _middle(body: BodyModel) -> Iterator[Item]:
    top, head = body.segment("neck").origin, float(body.segment("head").com[2])
    yield "C7", "thorax", top + _at(-0.055, 0.0, 0.0)
    yield "T10", "thorax", top * 0.25 + _at(-0.095, 0.0, 0.0)
    yield "CLAV", "thorax", top * 0.85 + _at(0.06, 0.0, 0.0)
    yield "STRN", "thorax", top * 0.35 + _at(0.105, 0.0, 0.0)
    for side, aside in (("L", 0.065), ("R", -0.065)):
        yield f"{side}FHD", "head", _at(0.085, aside, head)
        yield f"{side}BHD", "head", _at(-0.085, aside, head)


def _side(body: BodyModel, letter: str, side: str, sign: float) -> Iterator[Item]:
    """Markers of one side; ``sign`` is that of its y axis."""

    def origin(part: str) -> FloatArray:
        return body.segment(f"{side}_{part}").origin

    aside = sign * np.eye(3)[1]
    hip = origin("thigh")
    width = (abs(float(hip[1])) - 0.0073) / 0.33
    depth = PELVIS_DEPTH * width
    front = hip * [1.0, 0.0, 1.0] + _at(0.24 * depth + 0.0099, 0.0, 0.30 * width + 0.0109)
    yield f"{letter}ASI", "pelvis", front + 0.5 * width * aside
    yield f"{letter}PSI", "pelvis", front + 0.2 * width * aside - _at(depth, 0.0, 0.0)
    for name, part, size in (("KNE", "leg", KNEE_WIDTH), ("ANK", "foot", ANKLE_WIDTH)):
        carrier = f"{side}_{'thigh' if part == 'leg' else 'leg'}"
        yield f"{letter}{name}", carrier, origin(part) + 0.5 * size * aside
        yield f"{letter}{name}M", carrier, origin(part) - 0.5 * size * aside
    yield f"{letter}THI", f"{side}_thigh", 0.6 * origin("leg") + 0.08 * aside
    yield f"{letter}TIB", f"{side}_leg", 0.5 * origin("foot") + 0.05 * aside
    sole, length = body.effector(f"{side}_foot").translation, float(body.sole_length or 0.24)
    yield f"{letter}HEE", f"{side}_foot", sole + _at(-0.5 * length, 0.0, 0.04)
    yield f"{letter}TOE", f"{side}_foot", origin("toes") + _at(0.0, 0.0, 0.03)
    shoulder = origin("upper_arm")
    raised = 2.0 * SHOULDER_SHARE * abs(float(shoulder[1]))
    yield f"{letter}SHO", "thorax", shoulder + _at(0.0, 0.0, raised)
    yield f"{letter}UPA", f"{side}_upper_arm", 0.6 * origin("forearm") + 0.05 * aside
    yield f"{letter}ELB", f"{side}_upper_arm", origin("forearm") + 0.5 * ELBOW_WIDTH * aside
    yield f"{letter}ELBM", f"{side}_upper_arm", origin("forearm") - 0.5 * ELBOW_WIDTH * aside
    yield f"{letter}FRM", f"{side}_forearm", 0.5 * origin("hand") + 0.04 * aside
    yield f"{letter}WRA", f"{side}_forearm", origin("hand") + _at(0.5 * WRIST_WIDTH, 0.0, 0.0)
    yield f"{letter}WRB", f"{side}_forearm", origin("hand") - _at(0.5 * WRIST_WIDTH, 0.0, 0.0)
    yield f"{letter}FIN", f"{side}_hand", body.segment(f"{side}_hand").com + 0.015 * aside
