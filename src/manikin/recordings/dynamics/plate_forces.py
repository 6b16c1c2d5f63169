"""Forces and joint torques by force plates, compared with those of the recorded motion alone.

Plates measure the whole external force only while every support is wholly on one of them. The offset of a
plate is its reading without load. With the plates' forces on the feet the torques of a leg follow from its
own motion; without plates the motion gives the sum of the forces, and the shares of two feet have to be
assumed (:mod:`manikin.recordings.dynamics.recorded_forces`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from manikin.balance import zero_moment_point
from manikin.body.segments import SIDES
from manikin.contact import Contact, ContactKind, ContactSchedule
from manikin.motion import Motion
from manikin.numerics.signals import low_passed, mask_runs
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array, wrench_about
from manikin.recordings.dynamics.recorded_dynamics import (
    RecordedDynamics,
    RecordedMargins,
    margins_of_wrenches,
)
from manikin.recordings.dynamics.recorded_forces import torques_of
from manikin.recordings.readers.markers import ForcePlate

CUTOFF = 20.0
"""Low-pass of the plates, of second order, forward and backward [Hz]."""

LEAST_UNLOADED, SHORTEST = 0.1, 0.3
"""Time without load from which the offset of a plate, and time on plates from which a mass, is taken [s]."""

OVERHANG, BESIDE = 0.02, 0.1
"""How far a sole may be beyond the edge of its plate, and its centre of pressure beside a sole [m]."""

LEAST_OFFSET, STEADY = 5.0, 10.0
"""Reading without load that is taken off and said, and range of the middle half of such readings [N]."""

UNSURE = 0.03
"""Time about a support off the plates whose frames are left out: supports are known that well [s]."""


@dataclass(frozen=True, eq=False)
class PlateForces:
    """Forces by plates at the instants of a motion.

    Attributes:
        wrench: (n, 6) of all plates about the world's origin, without their offsets [N, N.m].
        covered: (n,) whether every support is on a plate, so that the wrench is all there is.
        single: (n,) whether one foot alone supports.
        of_effector: (n, c, 6) the part of it on each effector of the schedule; 0 where no plate has it.
        apart: (n,) whether the load of each is known: all is covered, and no plate carries two of them.
        alone: (n, c) whether an effector stands on a plate that carries nothing else then.
    """

    wrench: FloatArray
    covered: NDArray[np.bool_]
    single: NDArray[np.bool_]
    effectors: tuple[str, ...]
    of_effector: FloatArray
    apart: NDArray[np.bool_]
    alone: NDArray[np.bool_]


@dataclass(frozen=True)
class PlateComparison:
    """Forces of a motion beside those of plates, in frames in which all supports are on plates.

    Attributes:
        single_frames: Of them in single support.
        vertical_rms: Of the vertical force, per body weight; ``vertical_rms_single`` in single support.
        cop_rms: Distance of the centres of pressure in single support, root mean square [m].
        cop_mean: Mean offset of ours in world x and y [m].
        margin_share: Share of the frames in which the plates' wrench has a positive margin on our stances.
        margin_difference: Median of how far the margins are apart, about the centre of mass [N.m].
    """

    frames: int
    single_frames: int
    vertical_rms: float
    vertical_rms_single: float
    cop_rms: float
    cop_mean: tuple[float, float]
    margin_share: float
    margin_difference: float


def plate_forces(
    plates: Sequence[ForcePlate], times: FloatArray, schedule: ContactSchedule, cutoff: float = CUTOFF
) -> PlateForces:
    """The wrench of all plates at the instants of a motion, and where it is all there is.

    A foot is on a plate if its sole is within the plate's edges, where they are known, and its centre of
    pressure stays close to the sole for most of the support. Instants (n,) and schedule are on the clock of
    the plates [s], at least one, that are low-passed with a cutoff [Hz].
    """
    wrenches = np.array([_sampled(plate, times, cutoff) for plate in plates])
    phases, held = schedule.phase_at(times), _held(schedule)
    covered, single = np.ones(len(times), dtype=bool), np.zeros(len(times), dtype=bool)
    carried = [[one for one in held if _carries(plate, one.contact, schedule)] for plate in plates]
    on_plates = {id(one.contact) for ones in carried for one in ones}
    for number, phase in enumerate(schedule.sequence):
        begin, end = schedule.instants[number : number + 2]
        single[phases == number] = len(phase.stance) == 1
        known = [one for one in held if one.begin <= begin and one.end >= end]
        if not len(phase.stance) or not all(id(one.contact) in on_plates for one in known):
            covered[(times > begin - UNSURE) & (times < end + UNSURE)] = False
    names = schedule.sequence.effectors
    parts, apart = np.zeros((len(times), len(names), 6)), covered.copy()
    mine = np.zeros((len(times), len(names)), dtype=bool)
    for ones, each in ((ones, each) for ones, each in zip(carried, wrenches, strict=True) if ones):
        # A plate may be loaded a moment before its foot is found on it, and after.
        away = np.array([np.maximum(np.maximum(one.begin - times, times - one.end), 0.0) for one in ones])
        several = (np.sum(away == 0.0, axis=0) > 1) & each.any(axis=1)
        apart &= ~several
        for one, off in zip(ones, away, strict=True):
            mine[:, names.index(one.contact.effector)] |= (off == 0.0) & ~several
        owner = np.array([names.index(one.contact.effector) for one in ones])[np.argmin(away, axis=0)]
        parts[np.arange(len(times)), owner] += each
    return PlateForces(
        frozen_array(wrenches.sum(axis=0), "wrench"), covered, single, names,
        frozen_array(parts, "wrenches of the effectors"), apart, mine,
    )  # fmt: skip


def without_offsets(
    plates: Sequence[ForcePlate], schedule: ContactSchedule
) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """Plates without what they read while nobody touches them, and a remark on each whose offset is large.

    A plate is not loaded while no contact of the schedule is made above it, or within :data:`UNSURE` of such
    a time. Its offset is the median of its readings then, if half of these agree to :data:`STEADY`: else
    something that is not recorded loads it. Plates whose corners are not known are left as they are
    wherever anything is in contact.
    """
    held, found, remarks = _held(schedule), list[ForcePlate](), list[str]()
    for plate in plates:
        free = np.ones(len(plate), dtype=bool)
        for one in held:
            if any(plate.below(point, BESIDE) for point in one.contact.points_in_world):
                free &= (plate.time < one.begin - UNSURE) | (plate.time > one.end + UNSURE)
        free &= (plate.time >= schedule.instants[0]) & (plate.time <= schedule.instants[-1])
        along, offset = plate.force[free] @ plate.normal, 0.0
        if (
            free.sum() >= LEAST_UNLOADED * plate.rate
            and np.subtract(*np.percentile(along, (75, 25))) < STEADY
        ):
            offset = float(np.median(along))
        if abs(offset) >= LEAST_OFFSET:
            plate = replace(plate, wrenches=plate.wrenches - np.median(plate.wrenches[free], axis=0))
            remarks.append(f"{Path(plate.name).name} reads {offset:.0f} N while nobody touches it: zeroed")
        found.append(plate)
    return tuple(found), tuple(remarks)


def mass_on_plates(dynamics: RecordedDynamics, measured: PlateForces) -> float | None:
    """Mass of a person by the forces under them; None where too little of the motion is on plates.

    The impulse of the plates over all covered frames, divided by that of a body of one kilogram with the
    recorded motion of the centre of mass.
    """
    step = float(dynamics.time[1] - dynamics.time[0])
    if measured.covered.sum() * step < SHORTEST:
        return None
    per_mass = dynamics.com_acceleration[measured.covered, 2] + GRAVITY
    return float(measured.wrench[measured.covered, 2].sum() / per_mass.sum())


def compare_with_plates(
    dynamics: RecordedDynamics, margins: RecordedMargins, measured: PlateForces, height: float = 0.0
) -> PlateComparison | None:
    """Compare forces, centres of pressure and margins; None where no frame is covered in single support.

    The motion has the person's mass; centres of pressure are compared at the plates' height [m].
    """
    # A plate that is not loaded has no centre of pressure.
    both = measured.covered & measured.single & (measured.wrench[:, 2] > 0.0)
    if not both.any():
        return None
    weight = GRAVITY * dynamics.body.mass
    lift = (dynamics.vertical_force - measured.wrench[:, 2]) / weight
    apart = dynamics.zero_moment_point(height)[both] - zero_moment_point(measured.wrench[both], height)
    theirs = margins_of_wrenches(margins.polytopes, margins.phase, measured.wrench, dynamics.com).margin
    mean = apart.mean(axis=0)
    return PlateComparison(
        int(measured.covered.sum()), int(both.sum()), _rms(lift[measured.covered]), _rms(lift[both]),
        _rms(np.linalg.norm(apart, axis=1)), (float(mean[0]), float(mean[1])),
        float(np.mean(theirs[measured.covered] > 0.0)),
        float(np.median(np.abs(theirs - margins.whole_body)[measured.covered])),
    )  # fmt: skip


@dataclass(eq=False)
class _HeldPlate:
    """A contact and the time for which it is made [s]."""

    contact: Contact
    begin: float
    end: float


def _held(schedule: ContactSchedule) -> list[_HeldPlate]:
    """Contacts in the order of their beginnings; one that lasts for several phases is one."""
    found: list[_HeldPlate] = []
    for phase, (begin, end) in zip(schedule.sequence, pairwise(schedule.instants.tolist()), strict=True):
        for contact in phase.stance:
            ended = (one for one in found if one.end == begin and one.contact.effector == contact.effector)
            one = next((one for one in ended if one.contact.same_place(contact)), None)
            if one is None:
                found.append(_HeldPlate(contact, begin, end))
            else:
                one.end = end
    return found


def _sampled(plate: ForcePlate, times: FloatArray, cutoff: float) -> FloatArray:
    """(n, 6) low-passed wrench of one plate without its offset; 0 while it is not loaded."""
    wrenches, free = plate.wrenches, ~plate.pressed
    if free.sum() >= LEAST_UNLOADED * plate.rate:
        wrenches = wrenches - wrenches[free].mean(axis=0)
    if 2.0 * cutoff < plate.rate and len(plate) > 4:
        wrenches = low_passed(wrenches, cutoff, plate.rate)
    loaded = np.interp(times, plate.time, plate.pressed) > 0.5
    found = np.stack([np.interp(times, plate.time, column) for column in wrenches.T], axis=1)
    return np.where(loaded[:, None], found, 0.0)


def _carries(plate: ForcePlate, contact: Contact, schedule: ContactSchedule) -> bool:
    """Whether a plate carries a contact over the time for which it is held."""
    if contact.kind is not ContactKind.SOLE or not plate.below(contact.points_in_world, OVERHANG):
        return False
    name, held = contact.effector, [phase.stance for phase in schedule.sequence]
    mine = np.array([name in stance and stance[name].same_place(contact) for stance in held])
    alone = mine & np.array([len(stance) == 1 for stance in held])
    inside = (plate.time >= schedule.instants[0]) & (plate.time <= schedule.instants[-1])
    frames = inside & (alone if alone.any() else mine)[schedule.phase_at(plate.time)]
    if not frames.any() or np.mean(plate.pressed[frames]) < 0.5:
        return False
    local = (plate.cop[frames & plate.pressed] - contact.position) @ contact.rotation_contact_to_world
    near = np.abs(local[:, :2]) < 0.5 * np.array([contact.length, contact.width]) + BESIDE
    return bool(np.mean(near.all(axis=1)) > 0.5)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


JOINTS = ("hip_flexion", "hip_abduction", "knee_flexion", "ankle_dorsiflexion")
"""Hinges of a leg that are compared."""


@dataclass(frozen=True)
class TorqueComparison:
    """Torques of one hinge, of both sides, in frames in which the foot below it is on a plate.

    Attributes:
        joint: The hinge, without its side.
        rms: Root mean square of the difference, ours minus the plates' [N.m]; ``mean`` is its mean.
        peak: Largest magnitude of ours [N.m]; ``peak_by_plates`` is that of theirs.
    """

    joint: str
    frames: int
    rms: float
    mean: float
    peak: float
    peak_by_plates: float


def compare_torques(
    dynamics: RecordedDynamics, motion: Motion, measured: PlateForces
) -> tuple[TorqueComparison, ...]:
    """Compare the torques of legs with those by plates; none where no foot is on a plate of its own.

    The motion is of :func:`manikin.recordings.dynamics.recorded_forces.motion_on_contacts`.
    """
    theirs = torques_of(dynamics, measured.effectors, measured.of_effector)
    supports, found = dict(zip(motion.contact_names, motion.support.T, strict=True)), []
    for joint in JOINTS:
        parts = [np.zeros((2, 0))]
        for side in (side for side in SIDES if f"{side}_foot" in supports):
            rows = measured.apart & supports[f"{side}_foot"]
            column = 6 + motion.joint_names.index(f"{side}_{joint}")
            parts.append(np.stack([motion.tau[rows, column], theirs[rows, column]]))
        mine, plates = np.hstack(parts)
        if len(mine):
            apart, peaks = mine - plates, (float(np.abs(each).max()) for each in (mine, plates))
            found.append(TorqueComparison(joint, len(mine), _rms(apart), float(apart.mean()), *peaks))
    return tuple(found)


COMPONENTS = ("ahead", "aside", "up", "free moment")
"""What is compared of the force of a foot: along the way, to the foot's outer side, upwards, and about the
vertical, positive where it turns the toes outwards. So both feet have the same signs."""

LEAST_LOAD, LEAST_WAY = 0.1, 0.1
"""Vertical force per body weight from which a foot has a free moment: below, its pressure is not known. Way
of the centre of mass along the ground from which a stance has a direction [m]."""


@dataclass(frozen=True)
class ForceComparison:
    """One component of the forces of feet, while they stand on plates of their own.

    Attributes:
        component: One of :data:`COMPONENTS`; the free moment is that about the centre of pressure.
        rms: Root mean square of the difference, per body weight [-]; of the free moment [m].
        rrmse: ``rms`` over the mean of the ranges of both [-], as [Ren2008]_.
        r: Correlation of the two; None where one of them does not vary.
    """

    component: str
    frames: int
    rms: float
    rrmse: float
    r: float | None


def compare_foot_forces(
    dynamics: RecordedDynamics, motion: Motion, measured: PlateForces, height: float = 0.0
) -> tuple[ForceComparison, ...]:
    """Compare the force of each foot with its plate's, of all stances together; none without any.

    Frames count in which the foot stands by the motion and is alone on its plate. The motion is of
    :func:`manikin.recordings.dynamics.recorded_forces.motion_on_contacts`, the plates' top is at a height
    [m]. The way is that of the centre of mass over these frames, of at least :data:`LEAST_WAY`.
    """
    weight, pairs = GRAVITY * dynamics.body.mass, []
    theirs = wrench_about(measured.of_effector, np.array([0.0, 0.0, height]))
    for side, left in zip(SIDES, (1.0, -1.0), strict=True):
        if (name := f"{side}_foot") not in motion.contact_names or name not in measured.effectors:
            continue
        mine, other = motion.contact_names.index(name), measured.effectors.index(name)
        for first, stop in mask_runs(measured.alone[:, other] & motion.support[:, mine]):
            way = (dynamics.com[stop - 1] - dynamics.com[first])[:2]
            if (length := float(np.linalg.norm(way))) >= LEAST_WAY:
                both = motion.contact_force[first:stop, mine], theirs[first:stop, other]
                pairs.append([_components(one, way / length, left) for one in both])
    if not pairs:
        return ()
    ours, plates = (np.vstack(ones) / weight for ones in zip(*pairs, strict=True))
    pressed = (ours[:, 2] > LEAST_LOAD) & (plates[:, 2] > LEAST_LOAD)
    found = []
    for number, component in enumerate(COMPONENTS):
        rows = pressed if component == COMPONENTS[-1] else np.ones(len(ours), dtype=bool)
        a, b = ours[rows, number], plates[rows, number]
        if len(a) and (extent := 0.5 * float(np.ptp(a) + np.ptp(b))) > 0.0:
            varies = min(float(np.std(a)), float(np.std(b))) > 0.0
            r = float(np.corrcoef(a, b)[0, 1]) if varies else None
            found.append(ForceComparison(component, len(a), _rms(a - b), _rms(a - b) / extent, r))
    return tuple(found)


def _components(wrench: FloatArray, way: FloatArray, left: float) -> FloatArray:
    """(n, 4) components of wrenches (n, 6) about points of the ground, for a direction (2,) of length 1.

    ``left`` is 1 of a left foot and -1 of a right one.
    """
    (x, y, up), (mx, my, mz) = wrench[:, :3].T, wrench[:, 3:].T
    with np.errstate(divide="ignore", invalid="ignore"):
        free = mz + (my * y + mx * x) / up
    return np.stack([way[0] * x + way[1] * y, left * (way[0] * y - way[1] * x), up, left * free], axis=1)
