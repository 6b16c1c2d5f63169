"""A motion on its contacts, carried over to another body or another place.

Contacts keep their kind and their order. Another body of the same build makes the same angles; steps scale
with the length of its legs and times with the root of it, so that the motion is dynamically similar. In
another place each contact lies on the level surface nearest to where it was, the whole of it, and what has
been left moves with the contacts that are held: the seat's way counts before that of the feet. The legs are
fitted to the contacts later (:mod:`manikin.analysis.posture_adaptation`). All this is our own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from scipy.ndimage import gaussian_filter1d

from manikin.analysis.contact_adaptation import RAISED, effector_placements, scene_under
from manikin.body import BodyModel, human
from manikin.body.limbs import with_knees_and_elbows
from manikin.body.strength import DEFAULT_AGE
from manikin.contact import Contact, ContactKind, ContactModel, ContactSchedule, Phase, Stance, StanceSequence
from manikin.errors import InputError, ManikinError
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import IDENTITY, FloatArray, PlanarTransform, frozen_array
from manikin.recordings.supports.body_supports import SEAT
from manikin.runtime.display import Displayed
from manikin.scene import Scene, Surface

SAME_PLACE = 0.3
"""Distance over the floor within which raised contacts are of one piece of furniture [m]."""

FARTHEST, GRID = 0.24, 0.02
"""Distance over the floor by which a contact is moved at most to lie on a surface, and its steps [m]."""

HIGHEST = 0.45
"""Height above, or below, where it is expected at which a contact finds its surface at most [m]."""

LEVEL = 0.9995
"""Cosine of the tilt up to which a surface is level."""

BLENDING = 0.2
"""Width of the bell over which the body passes from the way of one contact to that of the next [s]."""

IMPORTANCE = {SEAT: 20.0, "left_hand": 0.2, "right_hand": 0.2}
"""Importance of the ways of contacts for that of the body, which sits on a seat; of any other 1."""


class NoPlaceError(ManikinError):
    """A contact finds no surface that could carry it near where it was."""


@dataclass(frozen=True, eq=False, repr=False)
class MotionOnContacts(Displayed):
    """Postures of a body in time, the contacts that they are made on, and what these lie on.

    Attributes:
        schedule: Contacts in time.
        time: (n,) instants on the clock of the schedule [s].
        q: (n, nq) postures.
        floor: Height of the ground [m].
        transform: From the frame of the recording to the scene's.
    """

    body: BodyModel
    scene: Scene
    schedule: ContactSchedule
    time: FloatArray
    q: FloatArray
    floor: float
    transform: PlanarTransform = IDENTITY

    @cached_property
    def com(self) -> FloatArray:
        """(n, 3) centre of mass [m]."""
        model = self.body.pinocchio
        data = model.createData()
        return np.array([pin.centerOfMass(model, data, one).copy() for one in self.q])

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        lasts = f"{self.time[-1] - self.time[0]:.2f} s"
        return {"body": self.body.name, "duration": lasts, "contacts": str(len(self.holds))}

    @property
    def own_time(self) -> FloatArray:
        """(n,) instants, 0 at the first [s]."""
        return self.time - self.time[0]

    @cached_property
    def holds(self) -> tuple["Hold", ...]:
        """Contacts from touch-down to lift-off, by the time of the touch-down."""
        return tuple(sorted(holds_of(self.schedule), key=lambda hold: hold.start))

    def slowed(self, factor: float) -> "MotionOnContacts":
        """The same at another pace: all times are multiplied."""
        if factor == 1.0:
            return self
        start = self.schedule.instants[0]
        time, instants = (start + factor * (part - start) for part in (self.time, self.schedule.instants))
        timed = [
            replace(phase, min_duration=factor * phase.min_duration, max_duration=_times(phase, factor))
            for phase in self.schedule.sequence
        ]
        return replace(self, time=time, schedule=ContactSchedule(StanceSequence(timed), instants))


@dataclass(frozen=True, eq=False)
class Hold:
    """One contact of an effector from touch-down to lift-off [s], in phases from the first to before stop."""

    effector: str
    first: int
    stop: int
    start: float
    end: float
    contact: Contact


def holds_of(schedule: ContactSchedule) -> Iterator[Hold]:
    """Every contact of every effector; at its place while parts of a foot change."""
    for name in schedule.sequence.effectors:
        held = np.array([name in phase.stance for phase in schedule.sequence])
        for first, stop in mask_runs(held):
            start, end = float(schedule.instants[first]), float(schedule.instants[stop])
            yield Hold(name, first, stop, start, end, schedule.sequence[first].stance[name])


def body_like(
    body: BodyModel, *, stature: float | None = None, mass: float | None = None, sex: str | None = None,
    age: float | None = None, strength: float | None = None,
) -> BodyModel:  # fmt: skip
    """A person of the proportions of a recorded one, with another size; what is None stays.

    Without a mass it keeps the body mass index.

    Raises:
        BodyError: If a value is out of range.
    """
    if body.stature is None or body.sex is None:
        raise InputError(f"body is {body.name!r}; valid: a human")
    share = 1.0 if stature is None else stature / body.stature
    return human(
        body.stature * share, body.own_mass * share**2 if mass is None else mass, sex or body.sex,
        age=age or body.age or DEFAULT_AGE, strength=body.strength if strength is None else strength,
        sole_length=_scaled(body.sole_length, share), sole_width=_scaled(body.sole_width, share),
        lengths={name: share * length for name, length in body.lengths.items()},
        off_axis_masses=body.off_axis_masses,
    )  # fmt: skip


def carried_over(
    motion: MotionOnContacts, body: BodyModel | None = None, scene: Scene | None = None,
    transform: PlanarTransform | None = None,
) -> MotionOnContacts:  # fmt: skip
    """A motion on another body, in another place, or both; the same motion of what is None.

    Args:
        body: A human; a recorded person if None.
        scene: What its contacts are to lie on; where they were if None.
        transform: From the frame of the recording to that of the scene.

    Raises:
        InputError: If the body has other joints.
        NoPlaceError: If a contact finds no surface.
    """
    if body is None and scene is None and transform is None:
        return motion
    moved = motion if transform is None else _transformed(motion, transform)
    other = _with_effectors(moved.body if body is None else body, moved.schedule)
    scale = leg_length(other) / leg_length(moved.body)
    anchor = _anchor(moved)
    along = 1.0 if anchor is None else scale
    centre = np.zeros(3) if anchor is None else anchor
    places = {hold: centre + (hold.contact.position - centre) * [along, along, 1.0] for hold in moved.holds}
    if scene is not None:
        places = _on_surfaces(moved, other, scene, places)
    schedule = with_places(moved, places, other)
    floor = moved.floor if scene is None else _floor_of(scene, moved.floor)
    q = np.tile(other.zero_posture(), (len(moved.q), 1))
    q[:, :2] = centre[:2] + along * (moved.q[:, :2] - centre[:2])
    q[:, 2] = floor + scale * (moved.q[:, 2] - moved.floor)
    q[:, 3:7] = moved.q[:, 3:7]
    q[:, 7:] = np.clip(moved.q[:, _hinges(moved.body, other)], other.lower, other.upper)
    carried = MotionOnContacts(
        other, scene_under(schedule, floor) if scene is None else scene, schedule, moved.time, q, floor,
        moved.transform,
    )  # fmt: skip
    q[:, :3] += _way(moved, carried, np.array([along, along, scale]), BLENDING)
    return carried.slowed(float(np.sqrt(scale)))


def leg_length(body: BodyModel) -> float:
    """Height of the pelvis above the soles in the zero posture [m]; InputError of a body without feet."""
    if "left_foot" not in body.effectors:
        raise InputError(f"body {body.name!r} has no left_foot; valid: a human")
    zero = body.zero_posture()[None]
    return float(zero[0, 2] - effector_placements(body, zero, "left_foot")[0][0, 2])


def _transformed(motion: MotionOnContacts, transform: PlanarTransform) -> MotionOnContacts:
    """The same motion, seen from another frame; what it lies on follows."""
    schedule = motion.schedule.moved(transform)
    return replace(
        motion, schedule=schedule, q=transform.poses(motion.q), scene=scene_under(schedule, motion.floor),
        transform=transform,
    )  # fmt: skip


def _with_effectors(body: BodyModel, schedule: ContactSchedule) -> BodyModel:
    """With knees and elbows that may touch where the motion is made on them; InputError of no human."""
    if body.stature is None or body.sex is None:
        raise InputError(f"body is {body.name!r}; valid: a human")
    return body if set(schedule.sequence.effectors) <= set(body.effectors) else with_knees_and_elbows(body)


def _hinges(body: BodyModel, other: BodyModel) -> list[int]:
    """Places in postures of a body of the hinges of another one, by their names."""
    missing = [name for name in other.joint_names if name not in body.joint_names]
    if missing or len(other.joint_names) != len(body.joint_names):
        what = missing[0] if missing else f"{len(other.joint_names)} joints"
        raise InputError(f"body {other.name!r} has {what}, the recorded person not; valid: a human")
    return [7 + body.joint_index(name) for name in other.joint_names]


def _anchor(motion: MotionOnContacts) -> FloatArray | None:
    """(3,) place from which steps scale: raised contacts, else the first stance; None where they cannot."""
    raised = [h.contact.position for h in motion.holds if h.contact.position[2] >= motion.floor + RAISED]
    if not raised:
        return np.mean([c.position for c in motion.schedule.sequence[0].stance], axis=0)
    middle = np.mean(raised, axis=0)
    one = all(np.hypot(*(place - middle)[:2]) < SAME_PLACE for place in raised)
    return middle if one else None


def _floor_of(scene: Scene, floor: float) -> float:
    """Height of the lowest level surface [m]; ``floor`` of a scene without one."""
    return min((float(s.polygon[0, 2]) for s in _level(scene)), default=floor)


def _level(scene: Scene) -> list[Surface]:
    return [surface for surface in scene.surfaces if surface.normal[2] >= LEVEL]


def _on_surfaces(
    motion: MotionOnContacts, body: BodyModel, scene: Scene, places: dict[Hold, FloatArray]
) -> dict[Hold, FloatArray]:
    """Places on the scene. A foot's is expected as much higher as its last contact is."""
    surfaces, found = _level(scene), dict[Hold, FloatArray]()
    base = _floor_of(scene, motion.floor) - motion.floor
    rise = base
    for hold in motion.holds:
        contact, place = hold.contact, places[hold]
        if contact.kind is ContactKind.GRASP:
            found[hold] = place + np.array([0.0, 0.0, rise])
            continue
        expected = place + np.array([0.0, 0.0, base if hold.effector == SEAT else rise])
        points = _resized(contact, motion.body, body).points @ contact.rotation_contact_to_world.T
        lies = _nearest_place(surfaces, expected, points)
        if lies is None:
            where = f"{hold.effector} at {np.round(expected, 2).tolist()} m, {hold.start:.2f} s"
            raise NoPlaceError(
                f"{where}: no level surface carries the whole contact within {FARTHEST:g} m and at most "
                f"{HIGHEST:g} m above or below"
            )
        found[hold] = lies
        rise = rise if hold.effector == SEAT else float(lies[2] - place[2])
    return found


def _nearest_place(
    surfaces: Sequence[Surface], expected: FloatArray, points: FloatArray
) -> FloatArray | None:
    """(3,) nearest place on the topmost surface for a contact with points (k, 3) about its origin, or None.

    A place where a part of it would lie on one surface, and a part on another or on nothing, is none.
    """
    ticks = np.arange(-FARTHEST, FARTHEST + 1e-9, GRID)
    ways = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    ways = ways[np.argsort(np.hypot(*ways.T), kind="stable")]
    ways = np.column_stack([ways, np.zeros(len(ways))])[np.hypot(*ways.T) <= FARTHEST + 1e-9]
    inner = np.vstack([points, 0.5 * (points + np.roll(points, 1, axis=0)), points.mean(axis=0)])
    tops = np.full(len(ways), -np.inf)
    whole = np.zeros(len(ways), dtype=bool)
    for surface in surfaces:
        height = float(surface.polygon[0, 2])
        if abs(height - expected[2]) > HIGHEST:
            continue
        held = surface.holds((expected + ways[:, None] + 0.998 * inner).reshape(-1, 3)).reshape(len(ways), -1)
        higher = held.any(axis=1) & (height > tops + 1e-6)
        tops[higher], whole[higher] = height, held[higher].all(axis=1)
    usable = np.flatnonzero(whole)
    if len(usable) == 0:
        return None
    first = usable[0]
    return np.array([*(expected + ways[first])[:2], tops[first]])


def with_places(
    motion: MotionOnContacts, places: Mapping[Hold, FloatArray], body: BodyModel | None = None
) -> ContactSchedule:
    """The schedule with contacts at other places (3,) [m], and of another body's size."""
    other = motion.body if body is None else body
    at = {(hold.effector, k): place for hold, place in places.items() for k in range(hold.first, hold.stop)}
    weight, phases = other.mass / motion.body.mass, []
    for number, phase in enumerate(motion.schedule.sequence):
        contacts = []
        for contact in phase.stance:
            place = at.get((contact.effector, number), contact.position)
            position = frozen_array(place, "contact position [m]", (3,))
            contacts.append(replace(_resized(contact, motion.body, other), position=position))
        model, cap = phase.stance.model, phase.stance.normal_force_cap
        model = model if cap is None else ContactModel(model.friction, weight * cap)
        phases.append(replace(phase, stance=Stance(contacts, model=model)))
    return ContactSchedule(StanceSequence(phases), motion.schedule.instants)


def _resized(contact: Contact, body: BodyModel, other: BodyModel) -> Contact:
    """A contact of another body's size: soles by their lengths and widths, anything else by the stature."""
    share = np.full(3, (other.stature or 1.0) / (body.stature or 1.0))
    if contact.effector.endswith("foot") and body.sole_length and body.sole_width:
        share[0] = (other.sole_length or body.sole_length) / body.sole_length
        share[1] = (other.sole_width or body.sole_width) / body.sole_width
    points = frozen_array(contact.points * share, "contact points [m]", (None, 3))
    return replace(contact, points=points)


def _way(motion: MotionOnContacts, carried: MotionOnContacts, scale: FloatArray, width: float) -> FloatArray:
    """(n, 3) way of the body beyond the scaled one, from what its contacts lack in postures of both [m]."""
    n, step = len(motion.time), float(np.median(np.diff(motion.time)))
    total, ways = np.full(n, 1e-12), np.zeros((n, 3))
    phases = motion.schedule.phase_at(motion.time)
    before = {name: effector_placements(motion.body, motion.q, name)[0] for name in _names(motion)}
    after = {name: effector_placements(carried.body, carried.q, name)[0] for name in _names(motion)}
    new = {(hold.effector, hold.first): hold.contact for hold in holds_of(carried.schedule)}
    for hold in motion.holds:
        rows = (phases >= hold.first) & (phases < hold.stop)
        if not rows.any():
            continue
        lacked = hold.contact.position - before[hold.effector][rows]
        lacks = new[hold.effector, hold.first].position - after[hold.effector][rows]
        way = np.median(lacks - scale * lacked, axis=0)
        bell = gaussian_filter1d(rows.astype(np.float64), width / step, mode="nearest", truncate=8.0)
        weight = IMPORTANCE.get(hold.effector, 1.0) * bell
        total += weight
        ways += weight[:, None] * way
    return ways / total[:, None]


def _names(motion: MotionOnContacts) -> tuple[str, ...]:
    return motion.schedule.sequence.effectors


def _scaled(value: float | None, share: float) -> float | None:
    return None if value is None else share * value


def _times(phase: Phase, factor: float) -> float | None:
    return None if phase.max_duration is None else factor * phase.max_duration
