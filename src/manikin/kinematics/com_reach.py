"""Reach of the centre of mass over given contacts, from the body's own kinematics.

A stance leaves the centre of mass a region: each leg ends at its hip, hips and shoulders are where pelvis and
trunk put them, and every joint has its range.  The region is found by sampling: poses of the root, bends of
the trunk, pitches of rolling feet and the legs that hang free; what each contact then asks of its limb is
known in closed form (legs of a human) or from the limb's sampled volume (all others).  Samples move towards
those that violate least, so that long strides and single places are found as well, and then outwards along
the normals of the region.  The region itself is a convex polytope with given normals: linear in a plan of the
centre of mass.

No obstacle and no balance is looked at.  Tonneau et al., "2PAC", ACM Trans. Graph. 37(5), 2018, have such
regions for each contact of a robot alone; the common sampling of all contacts, which couples them by heading
and lean of one trunk, is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import REFLECTION, hinge_line
from manikin.body.segments import Limb
from manikin.contact import Contact, ContactKind, SolePart
from manikin.errors import BodyError
from manikin.kinematics.leg_kinematics import HINGES, LegKinematics
from manikin.kinematics.limb_kinematics import LimbKinematics, ReachVolume, reach_volume
from manikin.numerics.spatial import FloatArray, dot, frozen_array, matrix, rotations

SAMPLES = 1500
"""Postures of one round of sampling."""

ROUNDS = 8
"""Rounds of sampling towards the contacts at most."""

ENOUGH = 250
"""Postures that are enough to begin the search for the region's faces."""

ELITE = 120
"""Postures that violate least, from whose neighbourhood the next round is sampled."""

OUTWARD = 8
"""Rounds of sampling about the outermost postures of each face."""

OUTERMOST = 16
"""Outermost postures of each face whose neighbourhoods are sampled."""

RANGE_MARGIN = 0.05
"""Angle that joints keep from the ends of their ranges [rad], as the postures of contact plans do."""

VOLUME_MARGIN = 0.02
"""Distance that effectors keep inside their limbs' volumes [m], of a body of 1.75 m."""

LEGS_APART = 0.10
"""Least distance of the shanks' middle lines [m], of a body of 1.75 m; our choice, a slim shank's breadth."""

HEEL_UP = 0.9
"""Largest pitch of a foot that stands on its toes [rad]."""

TOES_UP = 0.45
"""Largest pitch of a foot that stands on its heel [rad]."""

_LOWER = np.array([-1.2, -0.4, -0.5, -0.38, -0.38, -0.5])
_UPPER = np.array([1.2, 1.4, 0.5, 0.99, 0.38, 0.5])
"""Yaw from the stance's heading, pitch and roll of the root; flexion, side bend, twist of the trunk [rad]."""

_SWING_LOWER, _SWING_UPPER = np.array([-0.35, 0.05]), np.array([1.7, 2.1])
"""Flexion of hip and knee of a leg that hangs free [rad]."""

_THORAX_SHARE = 0.5
"""Bend of the thorax over that of the lumbar spine."""

_SIDES = ("left", "right")
BEYOND = 3.0
"""Violation of a leg that misses its foot by a metre [rad]."""


def _template() -> FloatArray:
    """(26, 3) unit vectors towards the faces, edges and corners of a cube."""
    grid = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    vectors = grid[np.abs(grid).sum(axis=1) > 0.0]
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


NORMALS = frozen_array(_template(), "normals")
"""(26, 3) normals of a region in the heading frame of its stance."""


@dataclass(frozen=True, eq=False)
class ComRegion:
    """Convex region of the centre of mass over a stance, in the world.

    Attributes:
        normals: (m, 3) unit outward normals.
        offsets: (m,) the region is ``normals @ p <= offsets`` [m].
        heading: (2,) least and largest heading of the root found there [rad], from that of the stance.
        lean: (2,) least and largest pitch of the trunk found there [rad].
        missed: Least violation found where no posture holds the contacts [rad, or 3 rad a metre]; 0 where
            there is one. An empty region has no rows.
    """

    normals: FloatArray
    offsets: FloatArray
    heading: FloatArray
    lean: FloatArray
    missed: float = 0.0

    @classmethod
    def everywhere(cls) -> "ComRegion":
        """The region without a face."""
        return cls(np.zeros((0, 3)), np.zeros(0), np.zeros(2), np.zeros(2))

    @property
    def empty(self) -> bool:
        """Whether no posture was found that holds the contacts."""
        return self.missed > 0.0

    def including(self, points: ArrayLike) -> "ComRegion":
        """The region with its faces moved out to points (..., 3) where a posture is known [m]."""
        ends = np.reshape(np.asarray(points, dtype=np.float64), (-1, 3)) @ self.normals.T
        return replace(self, offsets=np.maximum(self.offsets, ends.max(axis=0, initial=-np.inf)))

    def violation(self, points: ArrayLike) -> FloatArray:
        """(...) largest distance of (..., 3) points beyond a face [m]; negative is room."""
        places = np.asarray(points, dtype=np.float64)
        if self.empty:
            return np.full(places.shape[:-1], np.inf)
        return np.max(places @ self.normals.T - self.offsets, axis=-1, initial=-np.inf)

    def contains(self, points: ArrayLike, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """(...) whether (..., 3) points are inside or at most ``tolerance`` [m] beyond a face."""
        return self.violation(points) <= tolerance


class ComReach:
    """Regions of the centre of mass of one body over any of its stances.

    Use :meth:`of`, which keeps what was computed for a body.
    """

    def __init__(self, body: BodyModel) -> None:
        """Prepare a body: masses of its parts, volumes of its limbs."""
        self.body = body
        standing = Configuration(body)
        self._standing = {
            name: np.array(standing.effector_placement(name)[1] - standing.q[:3]) for name in body.effectors
        }
        far = max((float(np.linalg.norm(place)) for place in self._standing.values()), default=1.0)
        self.scale = body.stature / 1.75 if body.stature is not None else far
        try:
            self._legs: LegKinematics | None = LegKinematics(body)
        except BodyError:
            self._legs = None
        self._parts = _TrunkParts.of(body, self._legs is not None)
        self._limbs = {limb.effector: limb for limb in body.limbs}
        self._volumes: dict[str, ReachVolume] = {}
        self._regions: dict[tuple[object, ...], ComRegion] = {}

    @staticmethod
    def of(body: BodyModel) -> "ComReach":
        """The regions of a body, prepared once."""
        return _reach_of(body)

    def region(self, contacts: Sequence[Contact]) -> ComRegion:
        """Region of the centre of mass with all contacts held.

        Postures keep :data:`RANGE_MARGIN` from the ends of the joint ranges; feet that stand on their toes or
        heels may pitch about them. Equal stances are computed once, wherever they stand.

        Args:
            contacts: Of one stance, one for each effector.
        """
        if not contacts:
            return ComRegion.everywhere()
        frame, origin = self._heading_frame(contacts)
        local = [_in_frame(contact, frame, origin) for contact in contacts]
        key = tuple(
            (c.effector, str(c.part), *np.round(c.position, 4), *np.round(c.rotation.ravel(), 4))
            for c in local
        )
        if key not in self._regions:
            self._regions[key] = ReachSampler(self, local).region()
        found = self._regions[key]
        normals = found.normals @ frame.T
        return ComRegion(normals, found.offsets + normals @ origin, found.heading, found.lean, found.missed)

    def _heading_frame(self, contacts: Sequence[Contact]) -> tuple[FloatArray, FloatArray]:
        """Axes and origin of the stance: the middle of its contacts, heading as standing fits them best."""
        places = np.array([contact.position for contact in contacts])
        own = np.array([self._standing[contact.effector] for contact in contacts])
        origin = places.mean(axis=0)
        apart, own_apart = places - origin, own - own.mean(axis=0)
        turn = np.sum((apart @ [1.0, 1j, 0.0]) * np.conj(own_apart @ [1.0, 1j, 0.0]))
        for contact in contacts:
            if contact.kind is ContactKind.SOLE:
                turn += 0.3 * self.scale**2 * np.exp(1j * contact.yaw)
        if abs(turn) < 1e-9:
            turn = np.exp(1j * contacts[0].yaw)
        yaw = float(np.angle(turn))
        return rotations(np.array(yaw), np.array(0.0), np.array(0.0)), origin

    def volume(self, effector: str) -> ReachVolume:
        """Reach of the limb of an effector, in the frame of the segment to which it is fixed."""
        if effector not in self._volumes:
            limb = self._limbs.get(effector)
            if limb is None:
                raise BodyError(f"no limb has effector {effector!r}; valid: {', '.join(self._limbs)}")
            self._volumes[effector] = reach_volume(self.body, limb, np.random.default_rng(0))
        return self._volumes[effector]


@lru_cache(maxsize=16)
def _reach_of(body: BodyModel) -> ComReach:
    return ComReach(body)


@dataclass(frozen=True, eq=False)
class LocalContact:
    """A contact in the heading frame of its stance, see :class:`~manikin.contact.Contact`."""

    effector: str
    kind: ContactKind
    part: SolePart
    position: FloatArray
    rotation: FloatArray
    half_length: float


def _in_frame(contact: Contact, frame: FloatArray, origin: FloatArray) -> LocalContact:
    position = (contact.position - origin) @ frame
    rotation = frame.T @ contact.rotation_contact_to_world
    return LocalContact(contact.effector, contact.kind, contact.part, position, rotation, contact.length / 2)


@dataclass(frozen=True, eq=False)
class _TrunkParts:
    """Masses of a body but for its legs: of pelvis, lumbar spine and the rest, each a rigid part.

    Attributes:
        spine: Whether the body has a human's spine; otherwise all is one part.
        masses: (3,) [kg].
        coms: (3, 3) centre of mass of each in its frame [m].
        origins: (3, 3) origin of each in the frame of the one before [m].
        legs: Masses of thigh, shank with foot and toes [kg], and their centres in their frames (2, 3) [m].
        total: Of the whole body [kg].
    """

    spine: bool
    masses: FloatArray
    coms: FloatArray
    origins: FloatArray
    legs: tuple[FloatArray, FloatArray]
    total: float

    @classmethod
    def of(cls, body: BodyModel, legs: bool) -> "_TrunkParts":
        frames = ["pelvis", "lumbar", "thorax"]
        names = {segment.name for segment in body.segments}
        spine = set(frames) <= names
        if not spine:
            frames = [body.segments[0].name]
        q = np.array(body.standing_posture())
        state = Configuration(body, q)
        groups: dict[str, str] = {}
        for segment in body.segments:
            if segment.name in frames:
                groups[segment.name] = segment.name
            elif legs and segment.name.endswith(("thigh", "leg", "foot", "toes")):
                groups[segment.name] = "leg"
            else:
                groups[segment.name] = groups[str(segment.parent)]
        masses, coms = np.zeros(3), np.zeros((3, 3))
        for number, frame in enumerate(frames):
            members = [s for s in body.segments if groups[s.name] == frame]
            masses[number] = sum(s.mass for s in members)
            place = sum(s.mass * state.point(s.name, s.com) for s in members) / masses[number]
            rotation, origin = state.segment_placement(frame)
            coms[number] = rotation.T @ (place - origin)
        origins = np.zeros((3, 3))
        for number, frame in enumerate(frames[1:], start=1):
            origins[number] = body.segment(frame).origin
        leg_masses, leg_coms = np.zeros(2), np.zeros((2, 3))
        if legs:
            thigh, shank, foot, toes = (body.segment(f"left_{n}") for n in ("thigh", "leg", "foot", "toes"))
            leg_masses = np.array([thigh.mass, shank.mass + foot.mass + toes.mass])
            lower = shank.mass * shank.com + foot.mass * (foot.origin + foot.com)
            lower = lower + toes.mass * (foot.origin + toes.origin + toes.com)
            leg_coms = np.array([thigh.com, lower / leg_masses[1]])
        return cls(spine, masses, coms, origins, (leg_masses, leg_coms), body.mass)


class ReachSampler:
    """The sampling of one stance in its heading frame."""

    outward = OUTWARD

    def __init__(self, reach: ComReach, contacts: Sequence[LocalContact]) -> None:
        self._reach, self._contacts = reach, contacts
        self._body, self._legs, self._parts = reach.body, reach._legs, reach._parts
        self._scale = reach.scale
        self._rng = np.random.default_rng(0)
        self._feet: list[LocalContact | None] = [None, None]
        self._others: list[LocalContact] = []
        for contact in contacts:
            side = contact.effector.removesuffix("_foot")
            if self._legs is not None and contact.effector.endswith("_foot") and side in _SIDES:
                self._feet[_SIDES.index(side)] = contact
            else:
                self._others.append(contact)

    def region(self) -> ComRegion:
        """Sample towards the contacts, then outwards along the normals."""
        low, high = self._bounds()
        if np.any(low > high):
            return ComRegion(*_nothing(), missed=float(BEYOND * (low - high).max()))
        x, com, missed = self.held(low, high, NORMALS)
        if missed > 0.0:
            return ComRegion(*_nothing(), missed=missed)
        yaw, lean = x[:, 3], x[:, 4]
        return ComRegion(
            NORMALS, (com @ NORMALS.T).max(axis=0), np.array([yaw.min(), yaw.max()]),
            np.array([lean.min(), lean.max()]),
        )  # fmt: skip

    def held(
        self, low: FloatArray, high: FloatArray, normals: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Unknowns (n, d) that hold the contacts, what is measured of them (n, k), and the violation missed.

        Args:
            low: (d,) least unknowns.
            high: (d,) largest ones.
            normals: (m, k) along which they are sought far out.
        """
        x = self._first(low, high)
        measured, violation = self.measured(x)
        for _ in range(ROUNDS):
            if np.count_nonzero(violation <= 0.0) >= ENOUGH:
                break
            best = x[np.argsort(violation, kind="stable")[:ELITE]]
            width = best.max(axis=0) - best.min(axis=0)
            a, b = best.min(axis=0) - 0.15 * width, best.max(axis=0) + 0.15 * width
            fresh = self._rng.uniform(np.maximum(a, low), np.minimum(b, high), (SAMPLES, len(low)))
            more, beyond = self.measured(fresh)
            x, measured = np.vstack([x, fresh]), np.vstack([measured, more])
            violation = np.concatenate([violation, beyond])
        held = violation <= 0.0
        if not np.any(held):
            return x[held], measured[held], float(violation.min())
        x, measured = x[held], measured[held]
        for _ in range(self.outward):
            fresh = np.clip(self._outward(x, measured, normals), low, high)
            more, beyond = self.measured(fresh)
            x, measured = np.vstack([x, fresh[beyond <= 0.0]]), np.vstack([measured, more[beyond <= 0.0]])
        return x, measured, 0.0

    def _first(self, low: FloatArray, high: FloatArray) -> FloatArray:
        return self._rng.uniform(low, high, (SAMPLES, len(low)))

    def measured(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is sought far out (n, k), the centre of mass, and the violation (n,) of unknowns (n, d)."""
        return self.evaluate(x)

    def _outward(self, x: FloatArray, com: FloatArray, normals: FloatArray) -> FloatArray:
        """New unknowns near those that are outermost along each normal: differential evolution."""
        count = min(OUTERMOST, len(x))
        order = np.argpartition(-(com @ normals.T), count - 1, axis=0)[:count].T
        copies = SAMPLES // len(normals)
        first, second, third = (
            np.take_along_axis(order, self._rng.integers(0, count, (len(order), copies)), axis=1).ravel()
            for _ in range(3)
        )
        step = x[second] - x[third]
        return (
            x[first]
            + self._rng.uniform(0.3, 1.0, (len(first), 1)) * step
            + 0.02 * self._rng.normal(size=step.shape)
        )

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Box of the unknowns: place and yaw of the root, bends, and two of each leg."""
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        for contact in self._contacts:
            radius = self._radius(contact)
            low, high = (
                np.maximum(low, contact.position - radius),
                np.minimum(high, contact.position + radius),
            )
            if contact in self._feet and contact.rotation[2, 2] > 0.7:
                low[2] = max(low[2], contact.position[2] + 0.25 * radius)
        lower, upper = [low, _LOWER], [high, _UPPER]
        for foot in self._feet if self._legs is not None else ():
            if foot is None:
                lower.append(_SWING_LOWER)
                upper.append(_SWING_UPPER)
            else:
                least, most = {SolePart.TOES: (0.0, HEEL_UP), SolePart.HEEL: (-TOES_UP, 0.0)}.get(
                    foot.part, (0.0, 0.0)
                )
                lower.append(np.array([least, 0.0]))
                upper.append(np.array([most, 0.0]))
        return np.concatenate(lower), np.concatenate(upper)

    def _radius(self, contact: LocalContact) -> float:
        """Largest distance of the root from a contact [m]."""
        if contact in self._feet and self._legs is not None:
            foot = self._body.effector(contact.effector).translation
            return self._legs.length + float(np.linalg.norm(self._legs.hip[0])) + float(np.linalg.norm(foot))
        volume = self._reach.volume(contact.effector)
        far = float(np.linalg.norm(volume.vertices, axis=1).max())
        return far + (float(np.linalg.norm(self._parts.origins, axis=1).sum()))

    def evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Centre of mass (n, 3) [m] and largest violation of a contact (n,) [rad] of unknowns (n, d)."""
        place, pelvis = x[:, :3], rotations(x[:, 3], x[:, 4], x[:, 5])
        frames, places, com = self._trunk(x, place, pelvis)
        violation = np.zeros(len(x))
        if self._legs is not None:
            moved, beyond = self._leg_part(x, place, pelvis)
            com, violation = com + moved, beyond
        for contact in self._others:
            volume = self._reach.volume(contact.effector)
            index = {"lumbar": 1, "thorax": 2}.get(volume.segment, 0) if self._parts.spine else 0
            local = ((contact.position - places[index])[:, None] @ frames[index])[:, 0]
            residual = volume.residual(local) - self._margin(contact)
            violation = np.maximum(violation, -BEYOND * residual)
        return com / self._parts.total, violation

    def _margin(self, contact: LocalContact) -> float:
        rigid = not any(limb.effector == contact.effector and self._moves(limb) for limb in self._body.limbs)
        return 0.0 if rigid else VOLUME_MARGIN * self._scale

    def _moves(self, limb: Limb) -> bool:
        return len(LimbKinematics(self._body, limb)) > 0

    def _trunk(
        self, x: FloatArray, place: FloatArray, pelvis: FloatArray
    ) -> tuple[list[FloatArray], list[FloatArray], FloatArray]:
        """Axes and origins of pelvis, lumbar spine and thorax; mass times centre of mass of all but legs."""
        parts = self._parts
        frames, places = [pelvis], [place]
        if parts.spine:
            for number, share in ((1, 1.0), (2, _THORAX_SHARE)):
                bend = share * x[:, 6]
                turn = _bend(bend, share * x[:, 7], (1.0 if number == 2 else 0.3) * x[:, 8])
                places.append(places[-1] + frames[-1] @ parts.origins[number])
                frames.append(frames[-1] @ turn)
        com = sum(parts.masses[i] * (places[i] + frames[i] @ parts.coms[i]) for i in range(len(frames)))
        return frames, places, np.asarray(com)

    def _leg_part(
        self, x: FloatArray, place: FloatArray, pelvis: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Mass times centre of mass (n, 3) of both legs, and their violation (n,) [rad]."""
        legs, n = self._legs, len(x)
        assert legs is not None
        foot = np.empty((2, n, 3, 3))
        ankle = np.empty((2, n, 3))
        for side, contact in enumerate(self._feet):
            if contact is None:
                foot[side], ankle[side] = np.eye(3), place - [0.0, 0.0, 0.5 * legs.length]
                continue
            foot[side], ankle[side] = self._foot(side, contact, x)
        angles = legs.angles(pelvis, place, foot, ankle, np.zeros((n, len(self._body.joint_names))))
        hips = legs.hips(pelvis, place)
        size = np.linalg.norm(ankle - hips, axis=-1)
        violation = np.zeros(n)
        for side, contact in enumerate(self._feet):
            own = angles[:, legs.slots[side]]
            if contact is None:
                swing = np.zeros((n, len(HINGES)))
                swing[:, 0], swing[:, 3] = x[:, 9 + 2 * side], x[:, 10 + 2 * side]
                angles[:, legs.slots[side]] = swing
                continue
            lower = self._body.lower[legs.slots[side]] + RANGE_MARGIN
            upper = self._body.upper[legs.slots[side]] - RANGE_MARGIN
            lower[4], upper[4] = -1.0, 1.0  # the knee's rotation is not used
            lower[3] = 0.0
            beyond = np.maximum(lower - own, own - upper).max(axis=1)
            short = BEYOND * (size[side] - legs.length)
            violation = np.maximum(violation, np.maximum(beyond, short))
        thigh, shank = legs.segments(pelvis, angles)
        masses, coms = self._parts.legs
        knee = hips - legs.thigh * thigh[..., 2]
        sides = np.array([np.ones(3), REFLECTION])[:, None]
        moved = masses[0] * (hips + _applied(thigh, coms[0] * sides))
        moved = moved + masses[1] * (knee + _applied(shank, coms[1] * sides))
        if all(contact is not None for contact in self._feet):
            end = knee - legs.shank * shank[..., 2]
            apart = segment_distance(knee[0], end[0], knee[1], end[1])
            violation = np.maximum(violation, BEYOND * (LEGS_APART * self._scale - apart))
        return moved.sum(axis=0), violation

    def _foot(self, side: int, contact: LocalContact, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Axes (n, 3, 3) and origin (n, 3) of a foot in contact, pitched about its toes or its heel."""
        own = self._body.effector(contact.effector)
        position, rotation = self._placed(contact, x)
        if contact.part is SolePart.FULL:
            axes = rotation @ own.rotation.T
            return axes, position - axes @ own.translation
        turn = _pitch(x[:, 9 + 2 * side])
        pivot = 0.0
        if contact.part is SolePart.TOES:
            pivot = hinge_line(self._body, contact.effector) or 0.0
        elif contact.part is SolePart.HEEL:
            pivot = -contact.half_length
        about = np.array([pivot, 0.0, 0.0])
        centre = position + (rotation @ (about - turn @ about)[..., None])[..., 0]
        axes = rotation @ turn @ own.rotation.T
        return axes, centre - axes @ own.translation

    def _placed(self, contact: LocalContact, x: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Place and axes of a contact, the same for all unknowns or (n, ...)."""
        return contact.position, contact.rotation


def _nothing() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    return np.zeros((0, 3)), np.zeros(0), np.zeros(2), np.zeros(2)


def _applied(turns: FloatArray, vectors: FloatArray) -> FloatArray:
    """(2, n, 3) vectors (2, 1, 3) turned by (2, n, 3, 3)."""
    return (turns @ vectors[..., None])[..., 0]


def _pitch(angle: FloatArray) -> FloatArray:
    zero = np.zeros_like(angle)
    return rotations(zero, angle, zero)


def _bend(flexion: FloatArray, side_bend: FloatArray, twist: FloatArray) -> FloatArray:
    """(n, 3, 3) turns about y, then x, then z, as the hinges of the spine are."""
    cy, sy = np.cos(flexion), np.sin(flexion)
    cx, sx = np.cos(side_bend), np.sin(side_bend)
    cz, sz = np.cos(twist), np.sin(twist)
    return matrix([
        [cy * cz + sy * sx * sz, -cy * sz + sy * sx * cz, sy * cx],
        [cx * sz, cx * cz, -sx],
        [-sy * cz + cy * sx * sz, sy * sz + cy * sx * cz, cy * cx],
    ])  # fmt: skip


def segment_distance(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(n,) distance of the segments from a to b and from c to d, (n, 3) each [m]."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    determinant = np.maximum(uu * vv - uv * uv, 1e-12)
    s = np.clip((uv * vw - vv * uw) / determinant, 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    gap = w + s[:, None] * u - t[:, None] * v
    return np.sqrt(dot(gap, gap))
