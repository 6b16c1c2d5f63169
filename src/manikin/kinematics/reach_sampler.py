"""Sampling of the postures of a body that hold given contacts, far out along given directions.

The unknowns are the pose of the root, the bend of the spine where a contact hangs on it, and the pitches of
rolling feet. What each contact asks of its limb is known in closed form (legs of a human) or from the limb's
sampled volume (all others). Samples move towards those that violate least, so that long strides and single
places are found as well, and then outwards by differential evolution. What holds nothing, the spine of a body
on its feet and legs that hang free, bends as is best for each direction.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import REFLECTION, hinge_line
from manikin.body.segments import SIDES, Limb
from manikin.contact import ContactKind, SolePart
from manikin.errors import BodyError
from manikin.kinematics.leg_kinematics import LegKinematics, bend
from manikin.kinematics.limb_kinematics import LimbKinematics, ReachVolume, reach_volume, rigid_reach
from manikin.numerics.spatial import FloatArray, dot, rotations

SAMPLES, ROUNDS, OUTWARD = 600, 10, 12
"""Postures of one round of sampling, rounds towards the contacts at most, and rounds outwards."""
ENOUGH, ELITE = 150, 60
"""Postures that are enough to begin the search outwards, and the best, near which the next are sampled."""
OUTERMOST = 10
"""Outermost postures along each direction, whose differences are the steps of the next round."""
RANGE_MARGIN = 0.05
"""Angle that joints keep from the ends of their ranges [rad], as the postures of contact plans do."""
VOLUME_MARGIN, LEGS_APART = 0.02, 0.10
"""Distance of effectors inside their limbs' volumes, and of the shanks' middle lines, at 1.75 m [m]; ours."""
HEEL_UP, TOES_UP = 0.9, 0.45
"""Largest pitches of a foot that stands on its toes and of one that stands on its heel [rad]."""
BEYOND = 3.0
"""Violation of a contact that is missed by a metre [rad]."""

_TURN_LOWER, _TURN_UPPER = np.array([-1.2, -0.4, -0.5]), np.array([1.2, 1.4, 0.5])
"""Yaw from the stance's heading, pitch and roll of the root [rad]."""

_SPINE_LOWER, _SPINE_UPPER = np.array([-0.38, -0.38, -0.5]), np.array([0.99, 0.38, 0.5])
"""Flexion, side bend and twist of the spine [rad]."""

_THORAX_SHARE, _LUMBAR_TWIST = 0.5, 0.3
"""Flexion and side bend of the thorax over those of the lumbar spine, and twist of this over the thorax'."""

_BENDS = np.array([[f, s, 0.0] for f in (-0.38, 0.0, 0.5, 0.99) for s in (-0.38, 0.0, 0.38)])
"""(12, 3) bends of a free spine [rad]."""

_SWINGS = np.deg2rad([
    [-20.0, 0.0, 5.0], [-5.0, 0.0, 90.0], [35.0, 0.0, 20.0], [95.0, 0.0, 100.0], [5.0, 35.0, 10.0],
    [5.0, -15.0, 10.0],
])  # fmt: skip
"""(6, 3) flexion and abduction of the hip and flexion of the knee of a leg that hangs free."""

_SPINE = ("pelvis", "lumbar", "thorax")
_SPINE_COLUMNS = slice(6, 9)
_PITCHES = 9


@dataclass(frozen=True, eq=False)
class LocalContact:
    """A contact in the heading frame of its stance, see :class:`~manikin.contact.Contact`."""

    effector: str
    kind: ContactKind
    part: SolePart
    position: FloatArray
    rotation: FloatArray
    half_length: float


class ReachBody:
    """What the sampling needs to know of a body: masses, legs, volumes of the other limbs.

    Attributes:
        legs: Closed form of a human's legs, or None.
        spine: Whether pelvis, lumbar spine and thorax move against each other; otherwise all is one part.
        scale: Size over that of a person of 1.75 m.
    """

    def __init__(self, body: BodyModel) -> None:
        self.body = body
        try:
            self.legs: LegKinematics | None = LegKinematics(body)
        except BodyError:
            self.legs = None
        self.spine = set(_SPINE) <= {segment.name for segment in body.segments}
        state = Configuration(body)
        far = max(
            (float(np.linalg.norm(state.effector_placement(e)[1] - state.q[:3])) for e in body.effectors),
            default=1.0,
        )
        self.scale = far if body.stature is None else body.stature / 1.75
        frames = _SPINE if self.spine else (body.segments[0].name,)
        self.masses, self.coms, self.origins = _trunk_masses(body, state, frames, self.legs is not None)
        if self.legs is not None:
            self.leg_masses, self.leg_coms = _leg_masses(body)
        self._volumes: dict[str, tuple[ReachVolume, float]] = {}

    def volume(self, effector: str) -> tuple[ReachVolume, float]:
        """Reach of the limb of an effector, and the distance to keep inside it [m]."""
        if effector not in self._volumes:
            limb = next((limb for limb in self.body.limbs if limb.effector == effector), None)
            if limb is None:  # as the buttocks on a seat, which move with their segment alone
                own = self.body.effector(effector)
                limb = Limb(effector, effector, (own.segment,), ContactKind.POINT)
                volume, margin = rigid_reach(limb, own.segment, own.translation, own.rotation), 0.0
            else:
                margin = VOLUME_MARGIN * self.scale if len(LimbKinematics(self.body, limb)) else 0.0
                volume = reach_volume(self.body, limb, np.random.default_rng(0))
            self._volumes[effector] = volume, margin
        return self._volumes[effector]

    def trunk(
        self, place: FloatArray, root: FloatArray, spine: FloatArray
    ) -> tuple[list[FloatArray], list[FloatArray], FloatArray]:
        """Axes and origins of the trunk's parts, and mass times centre of mass (n, 3) of all but the legs.

        Of places (n, 3) [m] and axes (n, 3, 3) of the root, and flexion, side bend, twist (n, 3) [rad].
        """
        frames, places = [root], [place]
        for number in range(1, len(self.masses)):
            share = _THORAX_SHARE if number == 2 else 1.0
            twist = (1.0 if number == 2 else _LUMBAR_TWIST) * spine[:, 2]
            places.append(places[-1] + frames[-1] @ self.origins[number])
            frames.append(frames[-1] @ bend(share * spine[:, 0], share * spine[:, 1], twist))
        parts = zip(self.masses, frames, places, self.coms, strict=True)
        com = sum(mass * (origin + frame @ com) for mass, frame, origin, com in parts)
        return frames, places, np.asarray(com)

    def legs_com(self, hips: FloatArray, thigh: FloatArray, shank: FloatArray) -> FloatArray:
        """(2, n, 3) mass times centre of mass of left and right legs, from their axes (2, n, 3, 3)."""
        assert self.legs is not None
        sides = np.array([np.ones(3), REFLECTION])[:, None]
        knee = hips - self.legs.thigh * thigh[..., 2]
        upper, lower = (
            (turn @ (com * sides)[..., None])[..., 0]
            for turn, com in zip((thigh, shank), self.leg_coms, strict=True)
        )
        return self.leg_masses[0] * (hips + upper) + self.leg_masses[1] * (knee + lower)

    @cached_property
    def bends(self) -> FloatArray:
        """(k, 3) mass times centre of mass of all but the legs, of bends of a free spine, in the root."""
        bends = _BENDS if self.spine else np.zeros((1, 3))
        return self.trunk(np.zeros(bends.shape), np.tile(np.eye(3), (len(bends), 1, 1)), bends)[2]

    @cached_property
    def swings(self) -> FloatArray:
        """(2, k, 3) mass times centre of mass of a left and a right leg that hangs free, in the pelvis."""
        assert self.legs is not None
        count = len(_SWINGS)
        angles = np.zeros((count, len(self.body.joint_names)))
        for slots in self.legs.slots:
            angles[:, slots[[0, 1, 3]]] = _SWINGS
        pelvis = np.tile(np.eye(3), (count, 1, 1))
        hips = self.legs.hips(pelvis, np.zeros((count, 3)))
        return self.legs_com(hips, *self.legs.segments(pelvis, angles))


def _trunk_masses(
    body: BodyModel, state: Configuration, frames: Sequence[str], legs: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Masses (k,) [kg], centres of mass (k, 3) and origins (k, 3) [m] of the trunk's parts.

    Everything that hangs on a part, but for legs in closed form, belongs to it as in standing.
    """
    part: dict[str, str] = {}
    for segment in body.segments:
        if segment.name in frames:
            part[segment.name] = segment.name
        elif legs and segment.name.endswith(("thigh", "leg", "foot", "toes")):
            part[segment.name] = "leg"
        else:
            part[segment.name] = part[str(segment.parent)]
    masses, coms = [], []
    for frame in frames:
        members = [segment for segment in body.segments if part[segment.name] == frame]
        masses.append(sum(segment.mass for segment in members))
        place = sum((s.mass * state.point(s.name, s.com) for s in members), np.zeros(3)) / masses[-1]
        rotation, origin = state.segment_placement(frame)
        coms.append(rotation.T @ (place - origin))
    return np.array(masses), np.array(coms), np.array([body.segment(frame).origin for frame in frames])


def _leg_masses(body: BodyModel) -> tuple[FloatArray, FloatArray]:
    """Masses of a left thigh, and of shank with foot and toes [kg], and their centres (2, 3) [m]."""
    thigh, shank, foot, toes = (body.segment(f"left_{n}") for n in ("thigh", "leg", "foot", "toes"))
    lower = shank.mass * shank.com + foot.mass * (foot.origin + foot.com)
    lower += toes.mass * (foot.origin + toes.origin + toes.com)
    mass = shank.mass + foot.mass + toes.mass
    return np.array([thigh.mass, mass]), np.array([thigh.com, lower / mass])


@dataclass(frozen=True, eq=False)
class Held:
    """Postures that hold the contacts.

    Attributes:
        unknowns: (n, d) pose of the root, bend of the spine, pitches of the feet.
        projections: (n, m) how far each is out along each direction.
        missed: Least violation where there is none [rad, or :data:`BEYOND` a metre]; 0 where there is one.
    """

    unknowns: FloatArray
    projections: FloatArray
    missed: float = 0.0


class ReachSampler:
    """The sampling of one stance in its heading frame."""

    def __init__(
        self, parts: ReachBody, contacts: Sequence[LocalContact], normals: FloatArray, outward: int = OUTWARD
    ) -> None:
        """Contacts, one for each effector; the centre of mass is sought far out along ``normals`` (m, 3)."""
        self._parts, self._contacts, self._normals, self._outward = parts, contacts, normals, outward
        self._rng = np.random.default_rng(0)
        self._feet: list[LocalContact | None] = [None, None]
        self._others: list[LocalContact] = []
        for contact in contacts:
            side = contact.effector.removesuffix("_foot")
            if parts.legs is not None and contact.effector.endswith("_foot") and side in SIDES:
                self._feet[SIDES.index(side)] = contact
            else:
                self._others.append(contact)

    def held(self) -> Held:
        """Sample towards the contacts, then outwards."""
        low, high = self._bounds()
        if np.any(low > high):
            nothing = np.zeros((0, len(low)))
            return Held(nothing, np.zeros((0, len(self._normals))), float(BEYOND * (low - high).max()))
        x = self._first(low, high)
        projections, violation = self._evaluate(x)
        for number in range(ROUNDS + OUTWARD):
            if np.count_nonzero(violation <= 0.0) >= ENOUGH:
                break
            best = np.argsort(violation, kind="stable")[:ELITE]
            if number < ROUNDS:  # in the box of the best ones, made a little wider
                first, last = x[best].min(axis=0), x[best].max(axis=0)
                wider = 0.15 * (last - first)
                a, b = np.maximum(first - wider, low), np.minimum(last + wider, high)
                fresh = self._rng.uniform(a, b, (SAMPLES, len(low)))
            else:  # few postures hold the contacts, in no box
                fresh = np.clip(self._farther(x, best[None]), low, high)
            more, beyond = self._evaluate(fresh)
            x, projections = np.vstack([x, fresh]), np.vstack([projections, more])
            violation = np.concatenate([violation, beyond])
        held = violation <= 0.0
        if not np.any(held):
            return Held(x[held], projections[held], float(violation.min()))
        x, projections = x[held], projections[held]
        for _ in range(self._outward):
            outermost = np.argpartition(-projections, min(OUTERMOST, len(x)) - 1, axis=0)[:OUTERMOST].T
            fresh = np.clip(self._farther(x, outermost), low, high)
            more, beyond = self._evaluate(fresh)
            kept, held = np.unique(outermost), beyond <= 0.0
            x, projections = np.vstack([x[kept], fresh[held]]), np.vstack([projections[kept], more[held]])
        return Held(x, projections)

    def _first(self, low: FloatArray, high: FloatArray) -> FloatArray:
        return self._rng.uniform(low, high, (2 * SAMPLES, len(low)))

    def _farther(self, x: FloatArray, outermost: NDArray[np.int64]) -> FloatArray:
        """New unknowns near those (m, k) that are outermost along each direction: differential evolution."""
        directions, count = outermost.shape
        chosen = self._rng.integers(0, count, (3, directions, -(-SAMPLES // directions)))
        first, second, third = (np.take_along_axis(outermost, each, axis=1).ravel() for each in chosen)
        step = x[second] - x[third]
        noise = 0.01 * self._rng.normal(size=step.shape)
        return x[first] + self._rng.uniform(0.3, 1.0, (len(first), 1)) * step + noise

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Box of the unknowns: place and turns of the root, bend of the spine, pitch of each foot."""
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        for contact in self._contacts:
            radius = self._radius(contact)
            low = np.maximum(low, contact.position - radius)
            high = np.minimum(high, contact.position + radius)
            if contact in self._feet and contact.rotation[2, 2] > 0.7:
                low[2] = max(low[2], contact.position[2] + 0.25 * radius)
        bends = self._parts.spine and bool(self._others)
        spine = [end if bends else np.zeros(3) for end in (_SPINE_LOWER, _SPINE_UPPER)]
        tilts = {SolePart.TOES: (0.0, HEEL_UP), SolePart.HEEL: (-TOES_UP, 0.0)}
        pitches = [(0.0, 0.0) if foot is None else tilts.get(foot.part, (0.0, 0.0)) for foot in self._feet]
        lower, upper = zip(*pitches, strict=True)
        return (
            np.concatenate([low, _TURN_LOWER, spine[0], lower]),
            np.concatenate([high, _TURN_UPPER, spine[1], upper]),
        )

    def _radius(self, contact: LocalContact) -> float:
        """Largest distance of the root from a contact [m]."""
        legs = self._parts.legs
        if contact in self._feet and legs is not None:
            foot = self._parts.body.effector(contact.effector).translation
            return legs.length + float(np.linalg.norm(legs.hip[0])) + float(np.linalg.norm(foot))
        volume, _ = self._parts.volume(contact.effector)
        far = float(np.linalg.norm(volume.vertices, axis=1).max())
        return far + float(np.linalg.norm(self._parts.origins[1:], axis=1).sum())

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far the centre of mass is out (n, m) [m], and the largest violation (n,) of unknowns (n, d)."""
        parts, place, root = self._parts, x[:, :3], rotations(x[:, 3], x[:, 4], x[:, 5])
        turned = self._normals @ root
        violation = np.zeros(len(x))
        if self._others:
            frames, places, com = parts.trunk(place, root, x[:, _SPINE_COLUMNS])
            far = com @ self._normals.T
            violation = self._of_limbs(frames, places)
        else:
            far = parts.masses.sum() * (place @ self._normals.T) + _farthest(turned, parts.bends)
        if parts.legs is not None:
            legs, beyond = self._legs(x, place, root)
            violation = np.maximum(violation, beyond)
            for side, foot in enumerate(self._feet):
                if foot is None:
                    far += parts.leg_masses.sum() * (place @ self._normals.T)
                    far += _farthest(turned, parts.swings[side])
                else:
                    far += legs[side] @ self._normals.T
        return far / parts.body.mass, violation

    def _of_limbs(self, frames: Sequence[FloatArray], places: Sequence[FloatArray]) -> FloatArray:
        """(n,) violation of the limbs that are no legs in closed form."""
        violation = np.zeros(len(places[0]))
        for contact in self._others:
            volume, margin = self._parts.volume(contact.effector)
            part = _SPINE.index(volume.segment) if self._parts.spine and volume.segment in _SPINE else 0
            local = ((contact.position - places[part])[:, None] @ frames[part])[:, 0]
            violation = np.maximum(violation, BEYOND * (margin - volume.residual(local)))
        return violation

    def _legs(self, x: FloatArray, place: FloatArray, pelvis: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mass times centre of mass (2, n, 3) of the legs, and their violation (n,) [rad]."""
        legs, n = self._parts.legs, len(x)
        assert legs is not None
        hips = legs.hips(pelvis, place)
        foot, ankle = np.empty((2, n, 3, 3)), np.empty((2, n, 3))
        for side, contact in enumerate(self._feet):
            if contact is None:
                foot[side], ankle[side] = pelvis, hips[side] - 0.5 * legs.length * pelvis[..., 2]
            else:
                foot[side], ankle[side] = self._foot(side, contact, x)
        angles, thigh, shank = legs.bent(pelvis, place, foot, ankle, np.zeros((2, n)))
        size = np.linalg.norm(ankle - hips, axis=-1)
        violation = np.zeros(n)
        for side, contact in enumerate(self._feet):
            if contact is not None:
                beyond = self._beyond(angles[side], legs.slots[side])
                violation = np.maximum(violation, np.maximum(beyond, BEYOND * (size[side] - legs.length)))
        if all(contact is not None for contact in self._feet):
            knee = hips - legs.thigh * thigh[..., 2]
            end = knee - legs.shank * shank[..., 2]
            apart = segment_distance(knee[0], end[0], knee[1], end[1])
            violation = np.maximum(violation, BEYOND * (LEGS_APART * self._parts.scale - apart))
        return self._parts.legs_com(hips, thigh, shank), violation

    def _beyond(self, angles: FloatArray, slots: np.ndarray) -> FloatArray:
        """(n,) largest angle beyond a range of a leg's hinges (n, 7); the knee's rotation is not used."""
        lower = self._parts.body.lower[slots] + RANGE_MARGIN
        upper = self._parts.body.upper[slots] - RANGE_MARGIN
        lower[3], lower[4], upper[4] = 0.0, -1.0, 1.0
        return np.maximum(lower - angles, angles - upper).max(axis=1)

    def _foot(self, side: int, contact: LocalContact, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Axes (n, 3, 3) and origin (n, 3) of a foot in contact, pitched about its toes or its heel."""
        own = self._parts.body.effector(contact.effector)
        position, rotation = self._placed(contact, x)
        if contact.part is SolePart.FULL:
            axes = rotation @ own.rotation.T
            return axes, position - axes @ own.translation
        zero = np.zeros(len(x))
        turn = rotations(zero, x[:, _PITCHES + side], zero)
        on_toes = contact.part is SolePart.TOES
        pivot = hinge_line(self._parts.body, contact.effector) if on_toes else -contact.half_length
        about = np.array([pivot or 0.0, 0.0, 0.0])
        centre = position + (rotation @ (about - turn @ about)[..., None])[..., 0]
        axes = rotation @ turn @ own.rotation.T
        return axes, centre - axes @ own.translation

    def _placed(self, contact: LocalContact, x: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Place and axes of a contact, the same for all unknowns or (n, ...)."""
        return contact.position, contact.rotation


def _farthest(directions: FloatArray, points: FloatArray) -> FloatArray:
    """(...) how far the farthest of points (k, 3) is out along directions (..., 3)."""
    far = points @ directions.reshape(-1, 3).T
    return far.max(axis=0).reshape(directions.shape[:-1])


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
