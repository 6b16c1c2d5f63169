"""The limbs of a body: which joints move an effector, and where the chain begins."""

import numpy as np

from manikin.body.configuration import Configuration
from manikin.body.model import BodyModel
from manikin.body.segments import Hinge, Limb, Segment
from manikin.errors import BodyError
from manikin.spatial import FloatArray

REFLECTION = np.array([1.0, -1.0, 1.0])
"""What the reflection in the sagittal plane does to the coordinates of a point."""

__all__ = [
    "REFLECTION",
    "Limb",
    "are_mirrored",
    "limb_hinges",
    "limb_named",
    "limb_origin",
    "limb_placement",
    "limb_slots",
    "limbs_of",
    "parent_segment",
]


def limbs_of(body: BodyModel) -> tuple[Limb, ...]:
    """Return the limbs of a body, in its own order; none for a point mass."""
    return body.limbs


def limb_named(body: BodyModel, name: str) -> Limb:
    """Limb by name.

    Raises:
        BodyError: If there is none.
    """
    for limb in body.limbs:
        if limb.name == name:
            return limb
    raise BodyError(f"no limb {name!r}; valid: {', '.join(limb.name for limb in body.limbs) or 'none'}")


def parent_segment(body: BodyModel, limb: Limb) -> str:
    """Name of the segment to which the limb is fixed; of one on the trunk that is the root itself."""
    return body.segment(limb.segments[0]).parent or limb.segments[0]


def limb_origin(body: BodyModel, limb: Limb) -> FloatArray:
    """(3,) origin of the limb's frame in the segment to which it is fixed [m]."""
    first = body.segment(limb.segments[0])
    return np.zeros(3) if first.parent is None else np.array(first.origin)


def is_further(body: BodyModel, limb: Limb) -> bool:
    """Whether a limb is a contact beside those that end the body: on the trunk, or on the way of another."""
    return body.segment(limb.segments[0]).parent is None or any(
        len(other.segments) > len(limb.segments) and other.segments[: len(limb.segments)] == limb.segments
        for other in body.limbs
    )


def limb_hinges(body: BodyModel, limb: Limb) -> tuple[Hinge, ...]:
    """Return the hinges of a limb, from its root to its effector."""
    return tuple(hinge for name in limb.segments for hinge in body.segment(name).hinges)


def limb_slots(body: BodyModel, limb: Limb) -> np.ndarray:
    """(k,) places of the limb's hinges in the configuration vector ``q``."""
    return np.array([7 + body.joint_index(hinge.name) for hinge in limb_hinges(body, limb)], dtype=np.int64)


def limb_placement(state: Configuration, limb: Limb) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) from the limb's frame to the world's, and its origin (3,) [m]."""
    parent = parent_segment(state.body, limb)
    rotation, _ = state.segment_placement(parent)
    return rotation, state.point(parent, limb_origin(state.body, limb))


def are_mirrored(body: BodyModel, first: Limb, second: Limb, tolerance: float = 1e-12) -> bool:
    """Whether equal angles of two limbs are postures reflected in the sagittal plane.

    Both must hang on the same segment and have reflected origins, axes and effectors and equal
    ranges. An axis of rotation keeps its y component and changes the sign of the others.
    """
    if len(first.segments) != len(second.segments):
        return False
    if parent_segment(body, first) != parent_segment(body, second):
        return False
    pairs = zip(first.segments, second.segments, strict=True)
    one, other = body.effector(first.effector), body.effector(second.effector)
    reflected = np.outer(REFLECTION, REFLECTION) * one.rotation
    return (
        all(_segments_mirrored(body.segment(a), body.segment(b), tolerance) for a, b in pairs)
        and np.allclose(REFLECTION * one.translation, other.translation, rtol=0.0, atol=tolerance)
        and np.allclose(reflected, other.rotation, rtol=0.0, atol=tolerance)
    )


def _segments_mirrored(first: Segment, second: Segment, tolerance: float) -> bool:
    if len(first.hinges) != len(second.hinges):
        return False
    close = np.allclose(REFLECTION * first.origin, second.origin, rtol=0.0, atol=tolerance)
    return close and all(
        np.allclose(-REFLECTION * a.axis, b.axis, rtol=0.0, atol=tolerance)
        and (a.lower, a.upper) == (b.lower, b.upper)
        for a, b in zip(first.hinges, second.hinges, strict=True)
    )
