"""The limbs of a body: which joints move an effector, where the chain begins and ends, and its reflection.

Knees, elbows and the pelvis are further contacts of a human ([Tonneau2015]_ 5.4.1, left open there): the knee
in front of the origin of the lower leg, the elbow behind that of the forearm, each on the thickest shape of
the joint. Their z axes, the normals of contacts, point through the joint, backwards and forwards. What a
human sits on, the effector ``buttocks``, belongs to the root: no joint moves it, so its limb has none.
"""

from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body.configuration import Configuration
from manikin.body.human import FRONT_OF_KNEE, SEAT_LENGTH, SEAT_WIDTH, SKIN
from manikin.body.human_parts import ALONG_X
from manikin.body.model import BodyModel, look_up
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray

BEFORE_TIP = 1e-3
"""Distance of a segment's shapes to its effector from which they end before it [m]."""


def hanging_segment(body: BodyModel, segment: str) -> Segment | None:
    """Last segment of a limb when it hangs on ``segment``, as toes on a foot, or None."""
    children = [candidate for candidate in body.segments if candidate.parent == segment]
    if len(children) != 1 or not children[0].hinges:
        return None
    leaf = all(candidate.parent != children[0].name for candidate in body.segments)
    return children[0] if leaf else None


def stature_of(body: BodyModel) -> float:
    """Stature of a body that stands on feet [m].

    Raises:
        BodyError: If the body has none, as creatures have.
    """
    if body.stature is None:
        raise BodyError(f"body {body.name!r} has no stature; valid: a human")
    return body.stature


def hangs(body: BodyModel, effector: str) -> bool:
    """Whether an effector is at the end of a limb, so that it can reach by itself."""
    return body.effector(effector).segment != body.segments[0].name


def end_segments(body: BodyModel, effector: str) -> tuple[str, ...]:
    """Names of the segments with which an effector touches: its own, and what hangs on it or meets it."""
    own, parent = body.effector(effector).segment, _meeting(body, effector)
    if parent is not None:
        return own, parent
    hanging = hanging_segment(body, own)
    return (own,) if hanging is None else (own, hanging.name)


def _meeting(body: BodyModel, effector: str) -> str | None:
    """Segment that meets that of an effector in the joint with which it touches, or None."""
    frame = body.effector(effector)
    own = body.segment(frame.segment)
    shapes = () if own.parent is None else body.segment(own.parent).shapes
    near = (shape.distance_to(own.origin + frame.translation) for shape in shapes)
    return own.parent if any(distance < SKIN + BEFORE_TIP for distance in near) else None


def ends_before_tip(body: BodyModel, effector: str) -> bool:
    """Whether an effector touches in a point, and all shapes with which it does end before that."""
    frame, meeting = body.effector(effector), _meeting(body, effector)
    kinds = {limb.kind for limb in body.limbs if limb.effector == effector}
    if not (kinds == {ContactKind.POINT} or (meeting is not None and not kinds)):
        return False
    own = [shape.distance_to(frame.translation) for shape in body.segment(frame.segment).shapes]
    if meeting is not None:
        place = body.segment(frame.segment).origin + frame.translation
        own += [shape.distance_to(place) for shape in body.segment(meeting).shapes]
    return bool(own) and min(own) > BEFORE_TIP


TIP_RADIUS = 0.008
"""Radius of the balls of :func:`with_round_tips`, as a share of the stature; our choice."""


def with_round_tips(body: BodyModel, effectors: Iterable[str]) -> BodyModel:
    """The human with a ball at each effector :data:`SKIN` or more before its segment: heel of hand, kneecap.

    Joints, masses and effectors are the same. A kneecap is fixed to the shank, whatever the thigh does;
    without it, the round end of the thigh rolls on the ground by its whole turn, and an edge of the hand
    touches beside the effector's point.
    """
    added: dict[str, Shape] = {}
    for name in effectors if body.stature is not None else ():
        frame, radius = body.effector(name), TIP_RADIUS * (body.stature or 0.0)
        shapes = body.segment(frame.segment).shapes
        if min((shape.distance_to(frame.translation) for shape in shapes), default=0.0) > SKIN - 1e-9:
            middle = frame.translation + radius * frame.rotation[:, 2]
            added[frame.segment] = Shape("tip", ShapeKind.SPHERE, (radius,), middle)
    segments = (
        replace(item, shapes=(*item.shapes, added[item.name])) if item.name in added else item
        for item in body.segments
    )
    return replace(body, segments=tuple(segments)) if added else body


def toe_hinge(body: BodyModel, effector: str) -> FloatArray | None:
    """(3,) hinge of the segment that hangs on an effector's, in the effector's frame [m], or None."""
    frame = body.effector(effector)
    hanging = hanging_segment(body, frame.segment)
    return None if hanging is None else frame.rotation.T @ (hanging.origin - frame.translation)


def hinge_line(body: BodyModel, effector: str) -> float | None:
    """Place where the hinge of the hanging segment crosses the effector's x axis [m], or None."""
    hinge = toe_hinge(body, effector)
    return None if hinge is None else float(hinge[0])


def carrying_segment(body: BodyModel, effector: str, point: FloatArray) -> str:
    """Name of the segment, the hanging one beyond its hinge, that carries a point (3,) of an effector [m]."""
    own = body.effector(effector).segment
    hanging, line = hanging_segment(body, own), hinge_line(body, effector)
    return hanging.name if hanging is not None and line is not None and point[0] > line else own


def mirrored_name(name: str) -> str:
    """Name of the same part on the other side; one in the middle keeps its name."""
    side, _, part = name.partition("_")
    return {"left": f"right_{part}", "right": f"left_{part}"}.get(side, name)


def of_both_sides(body: BodyModel, angles: dict[str, float]) -> dict[str, float]:
    """Angles by the full names of a body's hinges, of both sides where a name has none."""
    return {name: value for name in body.joint_names for key, value in angles.items() if name.endswith(key)}


def mirrored_hinges(body: BodyModel) -> tuple[NDArray[np.int64], FloatArray]:
    """Hinges on the other side (nv - 6,) and factors (nv - 6,), 1 or -1, of the mirrored posture.

    It is ``factors * angles[..., indices]``; BodyError if a hinge has no counterpart with a reflected axis.
    """
    count = len(body.hinges)
    indices, factors = np.empty(count, dtype=np.int64), np.empty(count)
    for place, hinge in enumerate(body.hinges):
        other = mirrored_name(hinge.name)
        if other not in body.joint_names:
            raise BodyError(f"hinge {hinge.name!r} has no counterpart; valid: a body of two equal sides")
        indices[place] = body.joint_index(other)
        # An axis of rotation keeps its y component under the reflection and changes the others' signs.
        along = float(-REFLECTION * body.hinges[indices[place]].axis @ hinge.axis)
        if abs(abs(along) - 1.0) > 1e-9:
            raise BodyError(f"axes of {hinge.name!r} and {other!r} are no reflections of each other")
        factors[place] = np.sign(along)
    return indices, factors


def mirrored(body: BodyModel, q: ArrayLike) -> FloatArray:
    """(..., nq) postures reflected in the world's plane y = 0; BodyError if the body's sides differ."""
    posture = np.asarray(q, dtype=np.float64)
    if posture.ndim == 0 or posture.shape[-1] != body.nq:
        raise BodyError(f"posture has shape {posture.shape}; valid: (..., {body.nq})")
    indices, factors = mirrored_hinges(body)
    reflected = posture.copy()
    reflected[..., [1, 3, 5]] *= -1.0
    reflected[..., 7:] = factors * posture[..., 7:][..., indices]
    return reflected


_JOINTS = (("knee", ("thigh", "leg"), 1.0), ("elbow", ("upper_arm", "forearm"), -1.0))
"""Contact, the segments of the limb, where the contact is seen from the joint."""

FURTHER = ("knees", "elbows", "pelvis")
"""Kinds of further contacts."""


def with_further_contacts(body: BodyModel, kinds: Collection[str] = FURTHER) -> BodyModel:
    """Give a human further limbs.

    Args:
        body: Like that of :func:`manikin.body.human`; BodyError if it lacks the parts.
        kinds: Of :data:`FURTHER`: ``left_knee`` and ``right_knee``, ``left_elbow`` and ``right_elbow``,
            ``pelvis``.
    """
    unknown = sorted(set(kinds) - set(FURTHER))
    if unknown:
        raise BodyError(f"further contact is {unknown[0]!r}; valid: {', '.join(FURTHER)}")
    effectors, limbs = dict(body.effectors), list(body.limbs)
    for joint, parts, ahead in _JOINTS:
        if f"{joint}s" not in kinds:
            continue
        for side, other in (("left", "right"), ("right", "left")):
            chain = tuple(f"{side}_{part}" for part in parts)
            name = f"{side}_{joint}"
            effectors.setdefault(name, _effector(body, name, chain, ahead))
            limbs.append(Limb(name, name, chain, ContactKind.POINT, f"{other}_{joint}"))
    if "pelvis" in kinds:
        limbs.append(_pelvis(body))
    return replace(body, effectors=effectors, limbs=tuple(limbs))


def with_knees_and_elbows(body: BodyModel) -> BodyModel:
    """Give a human the effectors and limbs ``left_knee``, ``right_knee``, ``left_elbow``, ``right_elbow``."""
    return with_further_contacts(body, ("knees", "elbows"))


def _pelvis(body: BodyModel) -> Limb:
    """Limb that presses on a seat: a patch of the root, with no joint between."""
    if body.stature is None or "buttocks" not in body.effectors:
        raise BodyError(f"body {body.name!r} has no buttocks; valid: a human")
    patch = (SEAT_LENGTH * body.stature, SEAT_WIDTH * body.stature)
    return Limb("pelvis", "buttocks", (body.effector("buttocks").segment,), ContactKind.SOLE, patch=patch)


def _effector(body: BodyModel, name: str, chain: tuple[str, ...], ahead: float) -> Effector:
    shapes = [shape for part in chain for shape in body.segment(part).shapes]
    radii = [float(shape.size[0]) for shape in shapes if shape.kind is ShapeKind.CAPSULE]
    if not radii:
        raise BodyError(f"{name} has no round shape around it; valid: a body with capsules for limbs")
    turn = FRONT_OF_KNEE if ahead > 0.0 else ALONG_X
    return Effector(name, chain[-1], np.array([ahead * max(radii), 0.0, 0.0]), turn)


PELVIS = "pelvis"
"""Effector of a human's root."""


def with_root(body: BodyModel) -> tuple[BodyModel, str]:
    """The body, and the name of the effector at the origin of its root; one is added where there is none.

    Configurations are the same for both bodies.
    """
    if PELVIS in body.effectors:
        return body, PELVIS
    name = segment = body.segments[0].name
    while name in body.effectors:
        name += "_root"
    return replace(body, effectors={**body.effectors, name: Effector(name, segment, np.zeros(3))}), name


REFLECTION = np.array([1.0, -1.0, 1.0])
"""Factors of the coordinates of a point under reflection in the sagittal plane."""


def limb_named(body: BodyModel, name: str) -> Limb:
    """Limb by name; BodyError if there is none."""
    return look_up({limb.name: limb for limb in body.limbs}, name, "limb")


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


def moving_segments(body: BodyModel, limb: Limb) -> set[str]:
    """Segments of the limb and what hangs on them; of one on the trunk, the root alone."""
    moving = set(limb.segments)
    if body.segments[0].name in moving:
        return moving
    for segment in body.segments:
        if segment.parent in moving:
            moving.add(segment.name)
    return moving


def limb_slots(body: BodyModel, limb: Limb) -> np.ndarray:
    """(k,) places of the limb's hinges in the configuration vector ``q``."""
    return np.array([7 + body.joint_index(hinge.name) for hinge in limb_hinges(body, limb)], dtype=np.int64)


def limb_placement(state: Configuration, limb: Limb) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) from the limb's frame to the world's, and its origin (3,) [m]."""
    parent = parent_segment(state.body, limb)
    rotation, _ = state.segment_placement(parent)
    return rotation, state.point(parent, limb_origin(state.body, limb))


def are_mirrored(body: BodyModel, first: Limb, second: Limb) -> bool:
    """Whether equal angles of two limbs are postures reflected in the sagittal plane.

    Both must hang on the same segment, with reflected origins, axes and effectors and equal ranges.
    """
    if len(first.segments) != len(second.segments):
        return False
    pairs = zip(first.segments, second.segments, strict=True)
    end, other = body.effector(first.effector), body.effector(second.effector)
    return (
        parent_segment(body, first) == parent_segment(body, second)
        and all(_segments_mirrored(body.segment(a), body.segment(b)) for a, b in pairs)
        and _close(REFLECTION * end.translation, other.translation)
        and _close(np.outer(REFLECTION, REFLECTION) * end.rotation, other.rotation)
    )


def _segments_mirrored(first: Segment, second: Segment) -> bool:
    same_count = len(first.hinges) == len(second.hinges)
    return (same_count and _close(REFLECTION * first.origin, second.origin)) and all(
        _close(-REFLECTION * a.axis, b.axis) and (a.lower, a.upper) == (b.lower, b.upper)
        for a, b in zip(first.hinges, second.hinges, strict=True)
    )


def _close(first: FloatArray, second: FloatArray) -> bool:
    return np.allclose(first, second, rtol=0.0, atol=1e-12)
