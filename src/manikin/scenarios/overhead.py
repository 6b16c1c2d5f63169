"""Constraints on the CoM's height from the overhead obstacles of a scene."""

import itertools
from collections.abc import Sequence

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.centroidal import GeometricConstraint
from manikin.centroidal.overhead import CeilingHeight, Zone, height_below, keep_out
from manikin.contact import Contact, ContactKind, StanceSequence
from manikin.posture.fold import HEAD_CLEARANCE, fold_under, lowest_ceiling
from manikin.scene import Box, HalfSpace, Mesh, Obstacle, Plane, Scene
from manikin.spatial import FloatArray

HOVERING = 0.3
"""What leaves at least this above the supports is overhead, what leaves less is stepped over [m]."""

ONSET = 0.10
"""Distance within which the body comes down before an obstacle, for a stature of 1.75 m [m]."""

NEAR = 0.45
"""Soles this close to an obstacle, seen from above, carry the body below it [m]."""

_REFERENCE_STATURE = 1.75


def overhead_constraints(
    body: BodyModel,
    scene: Scene,
    sequence: StanceSequence,
    ends: tuple[FloatArray, FloatArray],
    names: Sequence[str] | None = None,
) -> tuple[GeometricConstraint, ...]:
    """Bound the CoM's height below each overhead obstacle that a standing body would touch.

    Args:
        body: The body, whose own postures say how high its CoM may be ([Qiu2012]_ 8.2.2).
        scene: The obstacles; planes and half-spaces have no edge and are left out.
        sequence: The stances; their soles say how high the ground is and where the body faces.
        ends: CoM at the start and at the goal (3,) [m].
        names: Of the obstacles to pass below; when omitted, all that hover over the way from the
            start by the middles of the stances to the goal.
    """
    soles = _soles(sequence)
    finite = [item for item in scene if not isinstance(item.shape, (Plane, HalfSpace))]
    if names is None:
        way = _way(sequence, ends)
        chosen = [item for item in finite if _hovers(item, soles) and _over(item, way)]
    else:
        chosen = [item for item in finite if item.name in names]
    found = (_constraint(body, obstacle, soles) for obstacle in chosen)
    return tuple(constraint for constraint in found if constraint is not None)


def _way(sequence: StanceSequence, ends: tuple[FloatArray, FloatArray]) -> list[FloatArray]:
    """Points (2,) of a coarse way of the CoM."""
    stances = [[c.position[:2] for c in phase.stance if c.kind is ContactKind.SOLE] for phase in sequence]
    return [ends[0][:2], *(np.mean(soles, axis=0) for soles in stances if soles), ends[1][:2]]


def _over(obstacle: Obstacle, way: Sequence[FloatArray]) -> bool:
    zone = Zone.below(_outline(obstacle), (), ONSET)
    return any(zone.crosses(a, b) for a, b in itertools.pairwise(way))


def _hovers(obstacle: Obstacle, soles: Sequence[Contact]) -> bool:
    return float(obstacle.bounds[0][2]) - _level(soles, _outline(obstacle)) >= HOVERING


def _constraint(body: BodyModel, obstacle: Obstacle, soles: Sequence[Contact]) -> GeometricConstraint | None:
    standing = Configuration(body, body.standing_posture())
    stature = float(standing.effector_placement("head")[1][2])
    scale = stature / _REFERENCE_STATURE
    outline, underside = _outline(obstacle), float(obstacle.bounds[0][2])
    headings = sorted({round(contact.yaw, 6) for contact in soles})
    level = _level(soles, outline)
    free = underside - level
    if free >= stature + HEAD_CLEARANCE:
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
        return keep_out(obstacle.name, zone, reason)
    return height_below(obstacle.name, CeilingHeight(zone, top, level + fold.com_height))


def _soles(sequence: StanceSequence) -> list[Contact]:
    return [contact for phase in sequence for contact in phase.stance if contact.kind is ContactKind.SOLE]


def _level(soles: Sequence[Contact], outline: FloatArray) -> float:
    """Height of the highest sole near the obstacle, or of the lowest of all [m]."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    heights = []
    for contact in soles:
        beyond = np.maximum(np.maximum(low - contact.position[:2], contact.position[:2] - high), 0.0)
        if float(np.linalg.norm(beyond)) < NEAR:
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
