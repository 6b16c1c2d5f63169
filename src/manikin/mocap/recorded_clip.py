"""What statistics need of one recorded motion, as a plain value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.segments import Shape, ShapeKind
from manikin.errors import InputError
from manikin.mocap.phase_sequence import PhaseSequence
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_motion import CUTOFF, smoothed
from manikin.mocap.recorded_supports import RecordedSupports
from manikin.mocap.supports import supports_of
from manikin.spatial import FloatArray, frozen_array

PARTS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"head": ("head", "neck"), "trunk": ("pelvis", "lumbar", "thorax")}
)
"""Parts of a person that pass under something, and their segments."""


@dataclass(frozen=True, eq=False)
class RecordedClip:
    """One recorded motion, on one clock.

    Attributes:
        name: Of the recording.
        group: What it is compared with: a person, a condition.
        supports: When and where which effectors support.
        time: (n,) instants, rising [s].
        com: (n, 3) centre of mass in the world [m].
        tops: (n, 3) highest point of each part of the body, by its name [m]; may be empty.
        standing_com: Height of the centre of mass in standing [m]; None if it is not known.
    """

    name: str
    group: str
    supports: RecordedSupports
    time: FloatArray
    com: FloatArray
    tops: Mapping[str, FloatArray]
    standing_com: float | None = None

    def __post_init__(self) -> None:
        where, n = f"clip {self.name!r}", len(self.time)
        object.__setattr__(self, "time", frozen_array(self.time, f"{where} time", (n,)))
        if not n or np.any(np.diff(self.time) <= 0.0):
            raise InputError(f"{where} has {n} instants that do not rise; valid: at least one, rising")
        object.__setattr__(self, "com", frozen_array(self.com, f"{where} com", (n, 3)))
        tops = {
            name: frozen_array(top, f"{where} top of {name!r}", (n, 3)) for name, top in self.tops.items()
        }
        object.__setattr__(self, "tops", MappingProxyType(tops))

    @property
    def floor(self) -> float:
        """Height of the lowest surface found; that of the world's origin if none was [m]."""
        return self.supports.surfaces[0] if self.supports.surfaces else 0.0

    @property
    def phases(self) -> PhaseSequence:
        """Phases of all supports."""
        return PhaseSequence.of(self.name, self.group, self.supports)


def clip_of(
    found: Reconstruction,
    name: str,
    group: str,
    *,
    start: float = 0.0,
    cutoff: float = CUTOFF,
    supports: RecordedSupports | None = None,
) -> RecordedClip:
    """Supports, centre of mass and highest points of a reconstructed recording.

    Args:
        found: At least four instants at an even rate, not yet smoothed.
        name: Of the recording.
        group: What it is compared with.
        start: What the first frame of the recording is on its clock [s].
        cutoff: Of the postures [Hz], see :func:`~manikin.mocap.recorded_motion.smoothed`.
        supports: Where they are known; those of :func:`~manikin.mocap.supports.supports_of` if None.

    Raises:
        InputError: As these two.
    """
    known = supports_of(found, start=start) if supports is None else supports
    still = smoothed(found, cutoff)
    com, tops = com_and_tops(still.body, still.q)
    standing, _ = com_and_tops(still.body, still.body.standing_posture()[None])
    return RecordedClip(
        name, group, known, known.start + still.time - still.time[0], com, tops, float(standing[0, 2])
    )


def com_and_tops(
    body: BodyModel, postures: FloatArray, parts: Mapping[str, Sequence[str]] = PARTS
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Centre of mass, and highest point of some parts of a body.

    Args:
        body: The body; parts of which it has no segment are left out.
        postures: (n, nq).
        parts: Segments of each part.

    Returns:
        (n, 3) centres of mass and (n, 3) highest points by part [m].
    """
    model, data = body.pinocchio, body.pinocchio.createData()
    have = {segment.name: segment for segment in body.segments}
    shapes = {
        part: [(body.segment_frame(one), shape) for one in names if one in have for shape in have[one].shapes]
        for part, names in parts.items()
    }
    com = np.empty((len(postures), 3))
    tops = {part: np.empty((len(postures), 3)) for part, known in shapes.items() if known}
    for number, q in enumerate(postures):
        com[number] = pin.centerOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        for part, top in tops.items():
            each = [_top(shape, data.oMf[frame]) for frame, shape in shapes[part]]
            top[number] = max(each, key=lambda point: point[2])
    return com, tops


def _top(shape: Shape, place: pin.SE3) -> FloatArray:
    """(3,) highest point of a shape of a segment [m]."""
    turn, centre = place.rotation @ shape.rotation, place.act(np.array(shape.translation))
    if shape.kind == ShapeKind.BOX:
        return centre + turn @ (np.where(turn[2] < 0.0, -0.5, 0.5) * shape.size)
    up = np.array([0.0, 0.0, float(shape.size[0])])
    if shape.kind == ShapeKind.SPHERE:
        return centre + up
    return centre + up + turn[:, 2] * np.copysign(0.5 * float(shape.size[1]), turn[2, 2])
