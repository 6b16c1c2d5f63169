"""The lift that a motion with a load in both hands makes, for the lifting equation.

Its ends are the frames in which the loaded hands are lowest and highest, in the order of time (ours; a
motion does not say where it grasps and lets go). Heights are above the lower sole, which is the floor
unless both feet are in the air. Straight ahead is the mean of the feet's directions (ours): the manual takes
the middle plane of the neutral posture, whatever the trunk does. Both ends count, as if the load had to be
placed with care.
"""

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import limb_named
from manikin.body.segments import HANDS, SIDES
from manikin.contact import ContactSchedule
from manikin.ergonomics.lifting import COUPLING, LEAST_FREQUENCY, LEAST_TRAVEL, HandPlace, Lift
from manikin.errors import InputError
from manikin.kinematics.point_targets import SegmentPlacements
from manikin.motion import Motion
from manikin.motion.motion import effector_positions
from manikin.numerics.spatial import FloatArray, unit

BETWEEN_FEET = 0.10
"""Hands that are nearer to the ankles than this along the floor are straight ahead [m]; ours."""

LEVEL_FEET = 0.10
"""At the ends of a lift one sole is not higher above the other than this [m]; ours."""
TWO_STEPS = 1.0
"""The ankles go no further than this between its ends [m]; ours, the manual allows one or two steps."""


def lift_of(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None, *,
    frequency: float = LEAST_FREQUENCY, hours: float = 1.0, coupling: str = "good",
) -> tuple[Lift, tuple[float, float]]:  # fmt: skip
    """The lift, and the instants of its ends [s].

    Args:
        body: A human, with what it carries all the time.
        motion: Its motion.
        schedule: Contacts with what is carried in single phases.
        frequency: Lifts per minute.
        hours: Of lifting at a stretch [h].
        coupling: As of REBA; ``"unacceptable"`` counts as ``"poor"``.

    Raises:
        InputError: If there is no load in both hands, they move by less than 25 cm up or down, or the person
            climbs or walks meanwhile.
    """
    loads = carried(body, motion, schedule)
    both = np.all(loads > 0.0, axis=1)
    if not both.any():
        reason = "the load is in one hand" if np.any(loads > 0.0) else "nothing is in the hands"
        raise InputError(f"{reason}; valid: a load in both hands")
    base, unevenness, places, straight = _ankles_and_hands(body, motion)
    rows = np.flatnonzero(both)
    height = places[rows, 2]
    first, last = sorted((int(rows[height.argmin()]), int(rows[height.argmax()])))
    if abs(places[last, 2] - places[first, 2]) < LEAST_TRAVEL:
        raise InputError("the loaded hands go up and down by less than 25 cm; valid: a lift")
    if unevenness[[first, last]].max() > LEVEL_FEET:
        raise InputError("one foot is on a step at an end of the lift; valid: both on level ground")
    if np.linalg.norm((base[last] - base[first])[:2]) > TWO_STEPS:
        raise InputError("the person walks between the ends of the lift; valid: at most two steps")
    ends = [_place(places[row], straight[row]) for row in (first, last)]
    hold = coupling if coupling in COUPLING else "poor"
    load = float(loads[rows].sum(axis=1).max())
    lift = Lift(load, ends[0], ends[1], frequency=frequency, hours=hours, coupling=hold)
    return lift, (float(motion.time[first]), float(motion.time[last]))


def carried(body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None) -> FloatArray:
    """(n, 2) what the left and the right hand carry in each frame [kg]."""
    found = np.tile([body.loads.get(name, 0.0) for name in HANDS], (len(motion.time), 1))
    if schedule is not None:
        phases = schedule.phase_at(motion.time)
        for number, phase in enumerate(schedule.sequence):
            if phase.load is not None:
                found[phases == number] += [phase.load.masses.get(name, 0.0) for name in HANDS]
    return found


def heaviest(body: BodyModel, schedule: ContactSchedule | None = None) -> float:
    """Largest load that the hands carry at any time, all the time or in single phases [kg]."""
    phases = () if schedule is None else schedule.sequence
    most = max((phase.load.mass for phase in phases if phase.load is not None), default=0.0)
    return float(sum(body.loads.values()) + most)


def _ankles_and_hands(
    body: BodyModel, motion: Motion
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """From the ankles to the hands, and straight ahead.

    Returns:
        (n, 3) the middle of the ankles, level with the lower sole [m].
        (n,) height of the upper sole above the lower one [m].
        (n, 3) from the middle of the ankles, level with the lower sole, to that of the hands [m].
        (n, 2) unit directions straight ahead.
    """
    hands = effector_positions(body, motion, HANDS)
    soles = effector_positions(body, motion, tuple(f"{side}_foot" for side in SIDES))
    feet = [limb_named(body, f"{side}_leg").segments[-1] for side in SIDES]
    placed = SegmentPlacements(body, feet).of(motion.q)
    ankles = placed.shifts.transpose(0, 2, 1) + motion.q[None, :, :3]
    ahead = placed.turns.transpose(0, 3, 1, 2)[:, :, :2, 0].mean(axis=0)
    base = ankles.mean(axis=0)
    heights = np.array([place[:, 2] for place in soles.values()])
    base[:, 2] = heights.min(axis=0)
    middle = np.mean([hands[name] for name in HANDS], axis=0)
    return base, np.ptp(heights, axis=0), middle - base, unit(ahead)


def _place(away: FloatArray, ahead: FloatArray) -> HandPlace:
    forward = float(away[:2] @ ahead)
    aside = float(ahead[0] * away[1] - ahead[1] * away[0])
    height = max(float(away[2]), 0.0)
    distance = float(np.hypot(forward, aside))
    turn = abs(float(np.arctan2(aside, forward))) if distance >= BETWEEN_FEET else 0.0
    return HandPlace(distance, height, turn)
