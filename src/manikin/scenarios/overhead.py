"""Constraints on the CoM's height from the overhead obstacles of a scene."""

from collections.abc import Sequence

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.centroidal import GeometricConstraint
from manikin.centroidal.overhead import CeilingHeight, Zone, height_below
from manikin.contact import Contact, ContactKind, StanceSequence
from manikin.posture.fold import HEAD_CLEARANCE, fold_under, lowest_ceiling
from manikin.scene import Box, HalfSpace, Mesh, Obstacle, Plane, Scene
from manikin.spatial import FloatArray

HOVERING = 0.3
"""What leaves at least this above the supports is overhead, what leaves less is stepped over [m]."""

ONSET = 0.15
"""Distance within which the body comes down before an obstacle, for a stature of 1.75 m [m]."""

_REFERENCE_STATURE = 1.75


def overhead_constraints(
    body: BodyModel, scene: Scene, sequence: StanceSequence, names: Sequence[str] | None = None
) -> tuple[GeometricConstraint, ...]:
    """Bound the CoM's height below each overhead obstacle that a standing body would touch.

    Args:
        body: The body, whose own postures say how high its CoM may be ([Qiu2012]_ 8.2.2).
        scene: The obstacles; planes and half-spaces have no edge and are left out.
        sequence: The stances; their soles say how high the ground is and where the body faces.
        names: Of the obstacles to pass below; all that hover over the supports when omitted.
    """
    soles = _soles(sequence)
    found = []
    for obstacle in scene:
        if isinstance(obstacle.shape, (Plane, HalfSpace)) or (names is not None and obstacle.name not in names):
            continue
        constraint = _constraint(body, obstacle, soles, names is not None)
        if constraint is not None:
            found.append(constraint)
    return tuple(found)


def _constraint(
    body: BodyModel, obstacle: Obstacle, soles: Sequence[Contact], named: bool
) -> GeometricConstraint | None:
    standing = Configuration(body, body.standing_posture())
    stature = float(standing.effector_placement("head")[1][2])
    scale = stature / _REFERENCE_STATURE
    outline, underside = _outline(obstacle), float(obstacle.bounds[0][2])
    headings = sorted({round(contact.yaw, 6) for contact in soles})
    level = _level(soles, outline, stature)
    free = underside - level
    if free >= stature + HEAD_CLEARANCE or not (named or free >= HOVERING):
        return None
    fold = fold_under(body, free)
    footprint = _upright_footprint(scale) if fold is None else fold.footprint
    zone = Zone.below(outline, [_turned(footprint, yaw) for yaw in headings], ONSET * scale)
    top = level + 1.1 * float(standing.com[2])
    if fold is None:
        reason = (
            f"'{obstacle.name}' leaves {free:.2f} m above the supports; this body folds to no less than "
            f"{lowest_ceiling(body):.2f} m on its feet"
        )
        return height_below(obstacle.name, CeilingHeight(zone, top, level), reason)
    return height_below(obstacle.name, CeilingHeight(zone, top, level + fold.com_height))


def _soles(sequence: StanceSequence) -> list[Contact]:
    return [contact for phase in sequence for contact in phase.stance if contact.kind is ContactKind.SOLE]


def _level(soles: Sequence[Contact], outline: FloatArray, reach: float) -> float:
    """Height of the highest sole within reach of the obstacle, or of the lowest of all [m]."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    heights = []
    for contact in soles:
        beyond = np.maximum(np.maximum(low - contact.position[:2], contact.position[:2] - high), 0.0)
        if float(np.linalg.norm(beyond)) < 0.25 * reach:
            heights.append(float(contact.position[2]))
    return max(heights, default=min((float(contact.position[2]) for contact in soles), default=0.0))


def _outline(obstacle: Obstacle) -> FloatArray:
    """(n, 2) points whose convex hull is the obstacle seen from above [m]."""
    if isinstance(obstacle.shape, Box):
        signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
        return obstacle.to_world(0.5 * signs * obstacle.shape.size)[:, :2]
    if isinstance(obstacle.shape, Mesh):
        return obstacle.to_world(obstacle.shape.vertices)[:, :2]
    (x0, y0, _), (x1, y1, _) = obstacle.bounds
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _upright_footprint(scale: float) -> FloatArray:
    """Rectangle that an upright trunk covers."""
    return 0.2 * scale * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def _turned(points: FloatArray, yaw: float) -> FloatArray:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[cosine, sine], [-sine, cosine]])
