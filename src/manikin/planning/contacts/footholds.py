"""Places on which a sole can lie: candidates of a footstep search, snapped to the surfaces of a scene.

A candidate is a place and a heading seen from above.  It is put onto every surface below it; where a part
of the sole would hang over an edge, or something stands in its way, it is shifted by up to :data:`SHIFT` to
where more of it lies.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import coal
import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.segments import FEET
from manikin.contact import Contact, sole
from manikin.errors import ContactError
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.guide.ground import ON_PLANE, Ground
from manikin.scene import Scene
from manikin.scene.collision import CollisionPart, collision_parts, column_is_clear
from manikin.scene.footing import WHOLE, FootingTable, Places

SHIFT = 0.08  # longest shift of a candidate along the sole [m]; half of it across; our choice
STEEPEST = math.radians(30.0)  # largest slope of a surface to stand on [rad]; our choice
FOOT_HEIGHT = 0.10  # height above a sole that has to be free for the foot [m]; our choice
FOOT_CLEARANCE = 0.015  # distance of the foot to what stands beside it [m]; our choice
FLOWN = 0.45  # height from which on a foot passes beside what is there, at 1.75 m [m]; our choice
BESIDE = (0.0, 0.05, -0.05, 0.1, -0.1, 0.15, -0.15)  # offsets of its way to the left [m]; our choice
_PASSED = np.array([0.25, 0.5, 0.75])  # shares of a flight at which a foot needs room
_REQUEST = coal.CollisionRequest()
_CLEAR = coal.CollisionRequest()
_CLEAR.security_margin = FOOT_CLEARANCE
_SHIFTS = np.array(
    [[x, 0.0] for x in (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0)]
    + [[x, y] for y in (-0.5, 0.5) for x in (0.0, 0.5, -0.5)]
)
_CORNERS = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
_NEAR = np.arange(-12, 13) * 0.02, np.arange(-3, 4) * 0.02  # around a wanted place, along and across [m]
_HEIGHT_WEIGHT = 0.7  # what a difference in height counts beside one along the ground


@dataclass(frozen=True, eq=False)
class Foothold:
    """Place of a sole.

    Attributes:
        position: (3,) of the sole's middle in the world [m].
        yaw: Heading of the toes [rad].
        rotation: (3, 3) sole-to-world; z along the surface's normal.
        share: Share of its area that lies on the surface.
        surface: Number of the surface; -1 for one that was given.
    """

    position: FloatArray
    yaw: float
    rotation: FloatArray
    share: float = 1.0
    surface: int = -1


Feet = tuple[Foothold, Foothold]
"""Left and right foothold."""


def feet_of(contacts: Mapping[str, Contact]) -> Feet:
    """Left and right foothold of contacts that are given."""
    left, right = (contacts[foot] for foot in FEET)
    turns = left.rotation_contact_to_world, right.rotation_contact_to_world
    return Foothold(left.position, left.yaw, turns[0]), Foothold(right.position, right.yaw, turns[1])


def heading_between(left: Foothold, right: Foothold) -> float:
    """Heading of a body on two footholds [rad]."""
    return math.atan2(math.sin(left.yaw) + math.sin(right.yaw), math.cos(left.yaw) + math.cos(right.yaw))


@dataclass(frozen=True, eq=False)
class Laid:
    """Footholds as arrays: positions (k, 3) [m], yaws (k,) [rad], shares (k,) and surfaces (k,)."""

    positions: FloatArray
    yaws: FloatArray
    rotations: FloatArray
    shares: FloatArray
    surfaces: NDArray[np.int64]


class Footholds:
    """Finds places of soles in one scene; one instance works on buffers of its own.

    Attributes:
        ground: Surfaces to stand on.
        size: Length and width of the sole [m].
        steepest: Largest slope of a surface to stand on [rad].
    """

    def __init__(
        self, body: BodyModel, scene: Scene, size: tuple[float, float] | None = None,
        steepest: float = STEEPEST,
    ) -> None:  # fmt: skip
        """Prepare a scene; the size of the soles is the body's when omitted.

        Raises:
            ContactError: If the body has no soles.
        """
        if body.sole_length is None or body.sole_width is None:
            raise ContactError(f"body {body.name!r} has no soles; valid: a body that stands on feet")
        self.size, self.steepest = size or (body.sole_length, body.sole_width), steepest
        self.ground = Ground(scene, steepest)
        self._table = FootingTable(self.ground.surfaces, 0.5 * np.array(self.size) * _CORNERS)
        self._parts = parts = [part for item in scene for part in collision_parts(item)]
        bounds = np.array([part.world_bounds for part in parts]).reshape(-1, 2, 3)
        self._low, self._high, self._lift = bounds[:, 0], bounds[:, 1], FLOWN * (body.stature or 1.75) / 1.75
        self._reach = 0.5 * float(np.linalg.norm([*self.size, FOOT_HEIGHT])) + 2.0 * FOOT_CLEARANCE
        self._foot = coal.Box(*self.size, FOOT_HEIGHT)
        self._wide_foot = coal.Box(*(side + 2.0 * FOOT_CLEARANCE for side in self.size), FOOT_HEIGHT)

    def faces(self, one: Foothold, other: Foothold) -> bool:
        """Whether what the higher of two is on goes on beside it, so that the lower one is behind it."""
        low, high = sorted((one, other), key=lambda hold: float(hold.position[2]))
        aside = rotation_from_yaw(high.yaw)[:, 1]
        beside = high.position + ((low.position - high.position) @ aside) * aside
        return bool((np.abs(self.ground.levels(beside[None, :2])[1] - beside[2]) < ON_PLANE).any())

    def lay(self, places: FloatArray, yaws: FloatArray, level: float, rise: float) -> Laid:
        """Footholds at or near candidates.

        Args:
            places: (k, 2) middles of soles seen from above [m].
            yaws: (k,) headings of the toes [rad].
            level: Height from which the foot comes [m].
            rise: Largest difference in height to there [m].
        """
        put = self._table.under(places, yaws, level - rise, level + rise)
        put = put[self._table.near(put, SHIFT * float(np.linalg.norm(_SHIFTS, axis=1).max()))]
        value = self._lies(put)
        partly = np.flatnonzero(value < WHOLE)
        if len(partly):
            turn = put.rotations[partly, :2, 0]
            turn /= np.linalg.norm(turn, axis=1, keepdims=True)
            side = np.stack([-turn[:, 1], turn[:, 0]], axis=-1)
            away = SHIFT * (_SHIFTS[:, :1] * turn[:, None] + _SHIFTS[:, 1:] * side[:, None])
            moved = self._moved(put, np.repeat(partly, len(_SHIFTS)), away.reshape(-1, 2))
            lies = self._lies(moved).reshape(len(partly), -1)
            # A shift has to gain something.
            pick = np.argmax(lies - 0.2 * SHIFT * np.linalg.norm(_SHIFTS, axis=1), axis=1)
            each = np.arange(len(partly))
            put.positions[partly] = moved.positions[each * len(_SHIFTS) + pick]
            value[partly] = lies[each, pick]
        chosen = np.flatnonzero(value > 0.0)
        return Laid(
            put.positions[chosen], yaws[put.rows[chosen]], put.rotations[chosen], value[chosen],
            put.numbers[chosen],
        )  # fmt: skip

    def hold(self, laid: Laid, row: int) -> Foothold:
        """One of several footholds."""
        return Foothold(
            laid.positions[row], float(laid.yaws[row]), laid.rotations[row], float(laid.shares[row]),
            int(laid.surfaces[row]),
        )  # fmt: skip

    def is_free(self, hold: Foothold) -> bool:
        """Whether the foot there keeps its clearance to the scene.

        What it stands on may be as near as it is, but not beside the foot.
        """
        touched = self._table.surfaces[hold.surface].obstacles if hold.surface >= 0 else ()
        middle = hold.position + 0.5 * FOOT_HEIGHT * hold.rotation[:, 2]
        for part in self._near(middle - self._reach, middle + self._reach):
            on = part.obstacle in touched
            foot, request, lift = (self._wide_foot, _REQUEST, 2e-3) if on else (self._foot, _CLEAR, 0.0)
            above = (0.5 * FOOT_HEIGHT + lift) * hold.rotation[:, 2]
            if part.meets(foot, coal.Transform3s(hold.rotation, hold.position + above), request):
                return False
        return True

    def _near(self, low: FloatArray, high: FloatArray) -> list[CollisionPart]:
        """Parts whose bounds meet a box with the world's axes, by its corners (3,) [m]."""
        near = ((self._low <= high) & (self._high >= low)).all(axis=1)
        return [self._parts[number] for number in np.flatnonzero(near)]

    def passes(self, left: Foothold, reached: Foothold, standing: Foothold) -> bool:
        """Whether a foot on its way passes beside what is too high to step over, and the other foot."""
        ends, radius = np.array([left.position, reached.position]), 0.5 * self.size[1] + FOOT_CLEARANCE
        low, wide = float(ends[:, 2].max()) + self._lift, max(BESIDE) + 0.5 * self.size[0]
        high = low + 3.0 * radius
        corners = [*(ends.min(axis=0) - wide)[:2], low], [*(ends.max(axis=0) + wide)[:2], high]
        near = [part for part in self._near(*np.array(corners)) if low < part.world_bounds[1][2] < np.inf]
        # Places seen from above are complex numbers.
        start, end, other = (complex(*hold.position[:2]) for hold in (left, reached, standing))
        if not near or start == end:
            return True
        bows = np.multiply.outer(BESIDE, 4.0j * _PASSED * (1.0 - _PASSED)) * (end - start) / abs(end - start)
        yaws = np.interp(_PASSED, [0.0, 1.0], np.unwrap([left.yaw, reached.yaw]))
        parts = (0.5 * self.size[0] - radius) * np.array([-1.0, 0.0, 1.0])
        feet = (start + _PASSED * (end - start) + bows)[..., None] + np.exp(1j * yaws[:, None]) * parts
        apart = np.abs(feet[..., None] - other - np.exp(1j * standing.yaw) * parts).min(axis=(1, 2, 3))
        feet = feet[apart > 2.0 * radius - FOOT_CLEARANCE]
        places = np.column_stack([feet.real.ravel(), feet.imag.ravel(), np.zeros(feet.size)])
        return bool(column_is_clear(near, places, (radius, low, high)).reshape(-1, 9).all(axis=1).any())

    def near(self, foot: str, wanted: FloatArray, yaw: float, friction: float) -> Iterator[Contact]:
        """Contacts of a foot around a place (3,) of its sole's middle [m], the nearest first.

        The toes head to ``yaw`` [rad]; the friction is a Coulomb coefficient.
        """
        c, s = math.cos(yaw), math.sin(yaw)
        grid = np.stack(np.meshgrid(_NEAR[0], _NEAR[1], indexing="ij"), axis=-1).reshape(-1, 2)
        places = wanted[:2] + grid @ np.array([[c, s], [-s, c]])
        laid = self.lay(places, np.full(len(places), yaw), float(wanted[2]), np.inf)
        away = (laid.positions - wanted) * [1.0, 1.0, _HEIGHT_WEIGHT]
        cost = np.linalg.norm(away, axis=1) + 0.1 * (1.0 - laid.shares)
        for row in np.argsort(cost, kind="stable"):
            hold = self.hold(laid, int(row))
            if self.is_free(hold):
                yield self.contact(foot, hold, friction)

    def contact(self, foot: str, hold: Foothold, friction: float) -> Contact:
        """Contact of a foot on a foothold, with a Coulomb coefficient."""
        (length, width), polygon = self.size, None
        if hold.share < WHOLE:
            polygon = self._table.polygon(hold.surface, hold.position, hold.rotation)
        return sole(
            foot, hold.position, length=length, width=width, friction=friction, rotation=hold.rotation,
            polygon=polygon,
        )  # fmt: skip

    def _lies(self, put: Places) -> FloatArray:
        """(k,) share of each sole on its surface; 0 where it cannot stand or something is in its way."""
        shares = self._table.standing(put)
        some = np.flatnonzero(shares)
        shares[some[self._blocked(put[some])]] = 0.0
        return shares

    def _blocked(self, put: Places) -> NDArray[np.bool_]:
        """(k,) whether another surface rises in the way of each foot, seen from above."""
        blocked = np.zeros(len(put.rows), dtype=bool)
        yaws = np.arctan2(put.rotations[:, 1, 0], put.rotations[:, 0, 0])
        height = put.positions[:, 2]
        over = self._table.under(put.positions[:, :2], yaws, height + ON_PLANE, height + 2.0 * FOOT_HEIGHT)
        blocked[over.rows[self._table.meets(over)]] = True
        return blocked

    def _moved(self, put: Places, rows: NDArray[np.int64], away: FloatArray) -> Places:
        """Some places moved by (k, 2) seen from above [m], on their surfaces."""
        rotations = put.rotations[rows]
        normals = rotations[:, :, 2]
        rise = -np.einsum("ki,ki->k", normals[:, :2], away) / normals[:, 2]
        positions = put.positions[rows] + np.column_stack([away, rise])
        return Places(put.rows[rows], put.numbers[rows], positions, rotations)
