"""Reach envelopes: how far each hand, and both together, come from the shoulders, by the body's kinematics.

An envelope is the farthest place of the palm in each direction from the shoulder, the trunk still, of joint
angles drawn from the ranges of the arm, and of the same arms stretched. A place is within the reach of both
hands where it is within that of each. What is too near to be reached is not told.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import KDTree

from manikin.body import BodyModel, limb_named
from manikin.body.limbs import limb_origin, limb_slots, parent_segment
from manikin.body.segments import SIDES
from manikin.kinematics.limb_kinematics import LimbKinematics
from manikin.kinematics.point_targets import SegmentPlacements
from manikin.numerics.spatial import FloatArray, frozen_array, unit

SAMPLES = 10_000
"""Postures of an arm that are drawn, and that are stretched, each."""
STEP = 0.02
"""Spacing of the distances at which the reach of both hands is tested [m]."""
STRETCHED = ("elbow", "wrist")
"""Parts of the names of joints that are straight in a stretched arm."""


@cache
def _sphere() -> tuple[FloatArray, FloatArray, KDTree]:
    """Directions (642, 3), triangles between them, and the look-up of the nearest one."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    return np.array(ball.vertices), np.array(ball.faces), KDTree(ball.vertices)


@dataclass(frozen=True, eq=False)
class ReachEnvelope:
    """Farthest places in all directions from a point of the chest.

    Attributes:
        segment: Name of the segment in whose frame it is.
        origin: (3,) from where distances count: a shoulder, or the middle between both [m].
        radius: (642,) farthest place in each direction, 0 where none is reached [m].
    """

    segment: str
    origin: FloatArray
    radius: FloatArray

    def farthest(self, directions: FloatArray) -> FloatArray:
        """(n,) how far it reaches in directions (n, 3) of any length [m]."""
        return self.radius[_sphere()[2].query(unit(directions, 1e-12))[1]]

    def share(self, points: FloatArray) -> FloatArray:
        """(n,) distance of points (n, 3) of the segment's frame as a share of how far it reaches there."""
        way = points - self.origin
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.linalg.norm(way, axis=1) / self.farthest(way)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Surface in the segment's frame [m]."""
        directions, faces, _ = _sphere()
        return trimesh.Trimesh(self.origin + self.radius[:, None] * directions, faces, process=False)

    @property
    def volume(self) -> float:
        """[m^3]."""
        return float(self.mesh.volume)


@lru_cache(maxsize=8)
def reach_envelopes(body: BodyModel) -> Mapping[str, ReachEnvelope]:
    """Reach of the ``"left"`` and the ``"right"`` hand and of ``"both"``, of a body with two arms.

    The same for every call: angles are drawn with a fixed seed.
    """
    found = {side: _of_hand(body, side) for side in SIDES}
    directions, one, other = _sphere()[0], *found.values()
    middle = 0.5 * (one.origin + other.origin)
    distances = np.arange(STEP, float(max(one.radius.max(), other.radius.max())) + STEP, STEP)
    points = middle + (distances[:, None, None] * directions).reshape(-1, 3)
    both = np.all([envelope.share(points) <= 1.0 for envelope in (one, other)], axis=0)
    within = both.reshape(len(distances), -1) * distances[:, None]
    return found | {
        "both": ReachEnvelope(one.segment, middle, frozen_array(within.max(axis=0), "radius [m]"))
    }


def _of_hand(body: BodyModel, side: str) -> ReachEnvelope:
    limb, (directions, _, nearest) = limb_named(body, f"{side}_arm"), _sphere()
    chain, slots = LimbKinematics(body, limb), limb_slots(body, limb)
    drawn = chain.random_angles(np.random.default_rng(0), SAMPLES)
    stretched = drawn.copy()
    for column, slot in enumerate(slots):
        if any(part in body.joint_names[slot - 6] for part in STRETCHED):
            stretched[:, column] = np.clip(0.0, body.lower[slot - 6], body.upper[slot - 6])
    places = np.concatenate([chain.place(angles).positions for angles in (drawn, stretched)])
    radius = np.zeros(len(directions))
    np.maximum.at(radius, nearest.query(places)[1], np.linalg.norm(places, axis=1))
    origin = np.array(limb_origin(body, limb))
    return ReachEnvelope(parent_segment(body, limb), origin, frozen_array(radius, "radius [m]"))


@dataclass(frozen=True, eq=False)
class ReachUse:
    """How much of its reach each hand uses along a motion.

    Attributes:
        shares: (n,) distance from the shoulder over how far the hand reaches in that direction, by side.
        envelopes: Of each hand, and of both.
    """

    shares: Mapping[str, FloatArray]
    envelopes: Mapping[str, ReachEnvelope]

    def as_dict(self, time: FloatArray) -> dict[str, Any]:
        """Plain values of a motion at times (n,) [s]."""
        most = {side: int(share.argmax()) for side, share in self.shares.items()}
        return {
            "volume_m3": {name: envelope.volume for name, envelope in self.envelopes.items()},
            "max_share": {side: float(self.shares[side][row]) for side, row in most.items()},
            "max_at_s": {side: float(time[row]) for side, row in most.items()},
        }


def reach_use(body: BodyModel, q: FloatArray) -> ReachUse:
    """How much of its reach each hand uses in postures (n, nq)."""
    envelopes, hands = reach_envelopes(body), {side: body.effector(f"{side}_hand") for side in SIDES}
    chest = envelopes["both"].segment
    placed = SegmentPlacements(body, [chest, *(hand.segment for hand in hands.values())]).of(q)
    turns, places = placed.turns.transpose(0, 3, 1, 2), placed.shifts.transpose(0, 2, 1)
    shares = {}
    for number, (side, hand) in enumerate(hands.items(), 1):
        way = places[number] + turns[number] @ hand.translation - places[0]
        shares[side] = envelopes[side].share(np.einsum("nji,nj->ni", turns[0], way))
    return ReachUse(shares, envelopes)
