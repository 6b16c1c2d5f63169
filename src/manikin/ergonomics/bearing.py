"""What carries the weight in each frame: legs, seat, hands."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.ergonomics.parts import SIDES
from manikin.motion import Motion
from manikin.motion.derived import com_velocity, effector_positions
from manikin.spatial import GRAVITY, FloatArray

Flags = NDArray[np.bool_]

EVEN = 0.3
"""A leg that carries at least this share of what both carry bears its part; ours."""

NEAR_FLOOR = 0.05
"""Of a motion without contacts: a sole this little above the lower one is on the ground [m]; ours."""

WALKING_SPEED = 0.4
"""Horizontal speed of the centre of mass of somebody who walks [m/s]; ours."""

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
        source: ``"contacts"``, or ``"heights of the soles"`` of a motion that knows no contact.
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
    feet = [f"{side}_foot" for side in SIDES]
    places = effector_positions(body, motion, tuple(feet))
    height = np.column_stack([places[name][:, 2] for name in feet])
    if known:
        on = np.column_stack([_support(motion, name) for name in feet])
    else:
        on = height <= height.min(axis=1, keepdims=True) + NEAR_FLOOR
    load = np.column_stack([_vertical(motion, name) for name in feet])
    total = load.sum(axis=1)
    between = _place_between(motion.com, places[feet[0]], places[feet[1]])
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.where(total > 0.0, load[:, 0] / total, between)
    both = on.all(axis=1)
    speed = np.linalg.norm(com_velocity(motion)[:, :2], axis=1)
    weight = body.mass * GRAVITY
    return Bearing(
        balanced=both & (np.minimum(left, 1.0 - left) >= EVEN),
        both_legs=np.asarray(both, dtype=bool),
        seated=_support(motion, "buttocks"),
        walking=speed > WALKING_SPEED,
        arms={side: _vertical(motion, f"{side}_hand") >= ARM_WEIGHT * weight for side in SIDES},
        source="contacts" if known else "heights of the soles",
    )


def _support(motion: Motion, effector: str) -> Flags:
    if effector not in motion.contact_names:
        return np.zeros(len(motion.time), dtype=bool)
    return motion.support[:, motion.contact_names.index(effector)]


def _vertical(motion: Motion, effector: str) -> FloatArray:
    """(n,) upward force on an effector [N]; 0 where it is not known."""
    if effector not in motion.contact_names:
        return np.zeros(len(motion.time))
    force = motion.contact_force[:, motion.contact_names.index(effector), 2]
    return np.maximum(np.nan_to_num(force), 0.0)


def _place_between(com: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """(n,) share of the way from the right foot to the left one that the centre of mass has gone."""
    way = (left - right)[:, :2]
    return np.einsum("ni,ni->n", (com - right)[:, :2], way) / np.maximum(np.sum(way**2, axis=1), 1e-9)
