"""Places of one foot relative to the other for which one posture of the body holds both.

The set is sampled like a region of the centre of mass (:mod:`manikin.kinematics.reach_sampler`), the place of
the second foot being one more unknown. Of humans it scales with the stature; the sets of both sexes in
:data:`SHIPPED` are read, and ``docs/step_reach.py`` makes the file.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind, SolePart
from manikin.errors import BodyError
from manikin.kinematics.reach_sampler import (
    BEYOND,
    SAMPLES,
    LocalContact,
    ReachBody,
    ReachSampler,
    segment_distance,
)
from manikin.numerics.spatial import FloatArray, frozen_array, rotations

Heels = Literal["down", "standing up", "both up"]
"""Feet that may stand on their toes: none, the one that stays, or both."""

HEELS: tuple[Heels, ...] = get_args(Heels)

Rest = Literal["anywhere", "standing", "moved"]
"""Foot over which the centre of mass is, so that the body may rest on it alone while the other one lands or
leaves; or anywhere."""

REST_INSET = 0.035
"""Distance of a resting centre of mass from the sole's edges [m], of a body of 1.75 m; our choice."""

SHIPPED: tuple[tuple[Heels, Rest], ...] = (
    *((heels, "anywhere") for heels in HEELS), ("down", "standing"), ("down", "moved"),
)  # fmt: skip
"""Sets that are shipped, of a man and a woman of :data:`STATURE`."""

FILE = Path(__file__).with_name("step_reach.npz")
"""File with them."""

STATURE = 1.75
"""Stature of the bodies whose sets are shipped [m]."""
TURN_LENGTH = 0.4
"""Length that counts as much as a turn by one radian among places of a foot [m/rad]."""
FACES = 100
"""Directions in which a set of places is sampled to its end."""


@dataclass(frozen=True, eq=False)
class StepReach:
    """Places of one foot relative to the other for which one posture holds both, on level soles.

    A place is ``(dx, dy, dz, dyaw)`` in the heading frame of the standing foot [m, rad].  The set is taken to
    be convex.

    Attributes:
        A: (m, 4) outward rows for the right foot, relative to the left one.
        b: (m,) the set is ``A @ place <= b``; a row is a length [m].
    """

    A: FloatArray
    b: FloatArray

    @classmethod
    def sampled(
        cls, body: BodyModel, heels: Heels = "down", rest: Rest = "anywhere", rounds: int = 200
    ) -> "StepReach":
        """Sample the set of a body, see :meth:`of`, in some rounds of sampling outwards; a second."""
        return cls(*_StepSampler(ReachBody(body), heels, rest, rounds).polytope())

    @staticmethod
    @lru_cache(maxsize=64)
    def of(body: BodyModel, heels: Heels = "down", rest: Rest = "anywhere") -> "StepReach":
        """The set of a body, computed once; a human of usual proportions has the shipped one, if there is.

        Args:
            heels: Which feet may stand on their toes: none, the standing one, or both.
            rest: Over which foot the centre of mass is: ``"standing"`` for the moved foot to land or leave,
                ``"moved"`` for the standing one to leave after it.

        Raises:
            BodyError: If the body has no legs like those of a human.
        """
        if body.stature is None or body.sex is None or body.lengths or (heels, rest) not in SHIPPED:
            return StepReach.sampled(body, heels, rest)
        scale = body.stature / STATURE
        with np.load(FILE, allow_pickle=False) as table:
            A, b = (table[f"{body.sex}/{heels}/{rest}/{part}"] for part in "Ab")
        # Lengths grow with the body and turns do not.
        A = frozen_array(A.astype(np.float64) * [1.0, 1.0, 1.0, scale], "A")
        return StepReach(A, frozen_array(scale * b.astype(np.float64), "b"))

    @staticmethod
    @lru_cache(maxsize=64)
    def at_rest(body: BodyModel) -> "StepReach":
        """Places at which the body can rest on either foot, on flat soles."""
        ends = [StepReach.of(body, "down", rest) for rest in ("standing", "moved")]
        A, b = np.vstack([end.A for end in ends]), np.concatenate([end.b for end in ends])
        return StepReach(frozen_array(A, "A"), frozen_array(b, "b"))

    def room(self, places: ArrayLike, foot: str = "right_foot") -> FloatArray:
        """(k,) least distance of places (k, 4) of a foot to the end of the set [m]; negative outside."""
        given = np.asarray(places, dtype=np.float64)
        of_right = given * [1.0, -1.0, 1.0, -1.0] if foot == "left_foot" else given
        return np.min(self.b - of_right @ self.A.T, axis=-1)

    def contains(self, places: ArrayLike, foot: str = "right_foot", margin: float = 0.0) -> NDArray[np.bool_]:
        """(k,) whether places (k, 4) of a foot are at least ``margin`` [m] inside."""
        return self.room(places, foot) >= margin

    def between(self, standing: Contact, candidates: Sequence[Contact]) -> FloatArray:
        """(k,) :meth:`room` of contacts of the other foot."""
        frame = rotations(np.array(standing.yaw), np.array(0.0), np.array(0.0))
        apart = np.array([candidate.position for candidate in candidates]) - standing.position
        turns = np.array([candidate.yaw for candidate in candidates]) - standing.yaw
        turns = np.arctan2(np.sin(turns), np.cos(turns))
        foot = "left_foot" if standing.effector == "right_foot" else "right_foot"
        return self.room(np.column_stack([apart @ frame, turns]), foot)


class _StepSampler(ReachSampler):
    """The sampling of places of the right foot, the last four unknowns, with the left one at the origin."""

    def __init__(self, parts: ReachBody, heels: Heels, rest: Rest, rounds: int) -> None:
        body, scale = parts.body, parts.scale
        if parts.legs is None:
            raise BodyError(f"body {body.name!r} has no legs like those of a human; valid: a human")
        half = 0.5 * (body.sole_length or 0.28 * scale)
        left = SolePart.FULL if heels == "down" else SolePart.TOES
        right = SolePart.TOES if heels == "both up" else SolePart.FULL
        self._moved = LocalContact("right_foot", ContactKind.SOLE, right, np.zeros(3), np.eye(3), half)
        standing = LocalContact("left_foot", ContactKind.SOLE, left, np.zeros(3), np.eye(3), half)
        directions = np.random.default_rng(0).normal(size=(FACES, 4))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        super().__init__(parts, [standing, self._moved], directions, rounds)
        self._width = body.sole_width or 0.12 * scale
        self._half = half - 0.5 * self._width
        inset = REST_INSET * scale
        self._alike = heels != "standing up" and rest == "anywhere"
        self._rest, self._room = rest, np.array([half - inset, max(0.5 * self._width - inset, 0.0)])

    def polytope(self) -> tuple[FloatArray, FloatArray]:
        """Rows and offsets of the set of places."""
        held = self.held()
        if held.missed > 0.0:
            raise BodyError(f"body {self._parts.body.name!r} cannot stand on both feet; valid: legs that can")
        outermost = np.unique(np.argmax(held.projections, axis=0))
        places = self._places(held.unknowns[outermost])
        if self._alike:  # what one foot reaches from the other, the other reaches from it
            places = np.vstack([places, _from_the_other(places)])
        rows = ConvexHull(places).equations
        A = rows[:, :4] * [1.0, 1.0, 1.0, TURN_LENGTH]
        lengths = np.linalg.norm(rows[:, :4], axis=1)
        return frozen_array(A / lengths[:, None], "A"), frozen_array(-rows[:, 4] / lengths, "b")

    @staticmethod
    def _places(x: FloatArray) -> FloatArray:
        """(n, 4) places, the turn as a length [m]."""
        return x[:, -4:] * [1.0, 1.0, 1.0, TURN_LENGTH]

    def _first(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """About standing upright."""
        scale, middle = self._parts.scale, np.zeros(len(low))
        middle[:3] = 0.0, -0.1 * scale, 0.8 * self._radius(self._moved)
        middle[-3] = -0.22 * scale
        fresh = middle + 0.08 * (high - low) * self._rng.normal(size=(2 * SAMPLES, len(low)))
        return np.clip(fresh, low, high)

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far the places are out (n, m), and the largest violation (n,) of unknowns (n, d)."""
        parts, root = self._parts, rotations(x[:, 3], x[:, 4], x[:, 5])
        legs, violation = self._legs(x, x[:, :3], root)
        place, rotation = self._placed(self._moved, x)
        if self._rest != "anywhere":
            # Of the bends of the spine, (n, k, 3).
            upper = parts.masses.sum() * x[:, None, :3] + parts.bends @ np.swapaxes(root, -1, -2)
            com = (upper + legs.sum(axis=0)[:, None]) / parts.body.mass
            if self._rest == "moved":
                com = (com - place[:, None]) @ rotation
            over = np.maximum(np.abs(com[..., :2]) - self._room, 0.0)
            violation = np.maximum(violation, BEYOND * np.hypot(over[..., 0], over[..., 1]).min(axis=-1))
        along, here = self._half * rotation[..., 0], np.tile([self._half, 0.0, 0.0], (len(x), 1))
        apart = segment_distance(place - along, place + along, -here, here)
        violation = np.maximum(violation, BEYOND * (self._width - apart))
        return self._places(x) @ self._normals.T, violation

    def _placed(self, contact: LocalContact, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        if contact is not self._moved:
            return contact.position, contact.rotation
        zero = np.zeros(len(x))
        return x[:, -4:-1], rotations(x[:, -1], zero, zero)

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        low, high = super()._bounds()
        radius, scale = self._radius(self._moved), self._parts.scale
        low[:3], high[:3] = (-radius, -radius, 0.25 * radius), radius
        far = np.array([1.3 * scale, 1.0 * scale, 0.9 * scale, 1.5])
        return np.concatenate([low, -far]), np.concatenate([high, far * [1.0, 0.0, 1.0, 1.0]])


def _from_the_other(places: FloatArray) -> FloatArray:
    """(n, 4) places of the foot that stood in the frame of the other, mirrored; the turn as a length [m]."""
    turn = places[:, 3] / TURN_LENGTH
    c, s = np.cos(turn), np.sin(turn)
    ahead, aside = c * places[:, 0] + s * places[:, 1], c * places[:, 1] - s * places[:, 0]
    return np.column_stack([-ahead, aside, -places[:, 2], places[:, 3]])
