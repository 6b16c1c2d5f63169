"""Trunk, neck, arms and legs of a body: their rotations and what carries the weight, frame by frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, limb_named
from manikin.body.segments import FEET, SIDES
from manikin.errors import BodyError
from manikin.motion import Motion
from manikin.motion.motion import com_velocity, effector_positions
from manikin.numerics.spatial import GRAVITY, FloatArray

Flags = NDArray[np.bool_]
EVEN = 0.3
"""A leg that carries at least this share of what both carry bears its part; ours."""
NEAR_FLOOR = 0.05
"""In a motion without contacts a sole this little above the lower one is on the ground [m]; ours."""
WALKING_SPEED = 0.4
"""Horizontal speed of the centre of mass from which a person walks [m/s]; ours."""
ARM_WEIGHT = 0.025
"""Share of the body's weight, half that of an arm, from which on a hand's support carries the arm; ours."""


@dataclass(frozen=True, eq=False)
class Bearing:
    """What carries the weight, (n,) each.

    Attributes:
        balanced: Whether both legs carry, each at least :data:`EVEN` of what both do.
        both_legs: Whether both feet are in contact.
        seated: Whether the buttocks are in contact.
        walking: Whether the centre of mass goes faster than :data:`WALKING_SPEED`.
        arms: Whether a support of the hand carries the arm, by side.
        source: ``"contacts"``, or ``"heights of the soles"`` of a motion without contacts.
    """

    balanced: Flags
    both_legs: Flags
    seated: Flags
    walking: Flags
    arms: Mapping[str, Flags]
    source: str


def bearing_of(body: BodyModel, motion: Motion) -> Bearing:
    """Find what carries the weight.

    Where the contacts of a motion are known, supports are its own, and the shares of the legs come from the
    vertical forces; where the forces are not known, from the place of the centre of mass between the feet.
    Of a motion without any contact a foot is on the ground when its sole is not more than :data:`NEAR_FLOOR`
    above the other.
    """
    known = bool(motion.contact_names) and bool(np.any(motion.support))
    places = effector_positions(body, motion, FEET)
    left_foot, right_foot = (places[name] for name in FEET)
    marked = (_contact(motion, name) for name in FEET)
    on, load = (np.column_stack(part) for part in zip(*marked, strict=True))
    if not known:
        height = np.column_stack([left_foot[:, 2], right_foot[:, 2]])
        on = height <= height.min(axis=1, keepdims=True) + NEAR_FLOOR
    total = load.sum(axis=1)
    way = (left_foot - right_foot)[:, :2]
    # Share of the way from the right foot to the left one that the centre of mass has gone.
    gone = np.einsum("ni,ni->n", (motion.com - right_foot)[:, :2], way)
    between = gone / np.maximum(np.sum(way**2, axis=1), 1e-9)
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.where(total > 0.0, load[:, 0] / total, between)
    both = on.all(axis=1)
    least = ARM_WEIGHT * (body.mass * GRAVITY)
    return Bearing(
        balanced=both & (np.minimum(left, 1.0 - left) >= EVEN),
        both_legs=np.asarray(both, dtype=bool),
        seated=_contact(motion, "buttocks")[0],
        walking=np.linalg.norm(com_velocity(motion)[:, :2], axis=1) > WALKING_SPEED,
        arms={side: _contact(motion, f"{side}_hand")[1] >= least for side in SIDES},
        source="contacts" if known else "heights of the soles",
    )


def _contact(motion: Motion, effector: str) -> tuple[Flags, FloatArray]:
    """(n,) whether an effector is in contact, and (n,) upward force on it [N], 0 where it is not known."""
    if effector not in motion.contact_names:
        return np.zeros(len(motion.time), dtype=bool), np.zeros(len(motion.time))
    column = motion.contact_names.index(effector)
    force = np.maximum(np.nan_to_num(motion.contact_force[:, column, 2]), 0.0)
    return motion.support[:, column], force


@dataclass(frozen=True)
class Parts:
    """Names of the segments that postures are judged by.

    Attributes:
        trunk: From the free root to the segment that carries the arms.
        neck: From there to the head, without the former.
        arms: Upper arm, forearm and hand of each side.
        legs: Thigh, shank and foot of each side.
    """

    trunk: tuple[str, ...]
    neck: tuple[str, ...]
    arms: dict[str, tuple[str, str, str]]
    legs: dict[str, tuple[str, str, str]]


def parts_of(body: BodyModel) -> Parts:
    """Find the parts of a human body.

    Raises:
        BodyError: If it has not two arms and two legs of three segments each, and a head.
    """
    limbs: dict[str, dict[str, tuple[str, str, str]]] = {"arm": {}, "leg": {}}
    for kind, side in product(limbs, SIDES):
        segments = limb_named(body, name := f"{side}_{kind}").segments
        if len(segments) != 3:
            raise BodyError(f"limb {name!r} has {len(segments)} segments; valid: 3, as a human's")
        limbs[kind][side] = (segments[0], segments[1], segments[2])
    carriers = {body.segment(limbs["arm"][side][0]).parent for side in SIDES}
    trunk = _chain(body, carriers.pop() or "")
    head = _chain(body, body.effector("head").segment)
    if carriers or head[: len(trunk)] != trunk or len(head) == len(trunk):
        raise BodyError(f"body {body.name!r} has no trunk with both arms and a neck; valid: a human")
    return Parts(trunk, head[len(trunk) :], limbs["arm"], limbs["leg"])


def _chain(body: BodyModel, name: str) -> tuple[str, ...]:
    """Segments from the root to one of them."""
    parent = body.segment(name).parent
    return (name,) if parent is None else (*_chain(body, parent), name)


def twist_about_z(rotation: FloatArray) -> FloatArray:
    """(n,) turn about z that rotations (n, 3, 3) are left with without the shortest swing of z [rad]."""
    return np.arctan2(rotation[:, 1, 0] - rotation[:, 0, 1], rotation[:, 0, 0] + rotation[:, 1, 1])
