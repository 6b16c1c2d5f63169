"""Postures inside the flights of effectors: along a curve that is clear, not swung around.

The key postures of a contact plan lie at the changes of contact, at most with one between.  Joined by
lines they drag an effector through what it leaves, reaches or passes, and an optimisation that pushes it
out may as well swing the limb aside as bend it, or be caught on the wrong side.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import ContactSchedule, Swing
from manikin.posture import Placement, PostureProblem, SolverSettings, generate_posture
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.birrt import Feasible
from manikin.wholebody.effector_clearance import EffectorClearance
from manikin.wholebody.flight_search import ClearFlight, search_swing
from manikin.wholebody.flights import hangs, standing_during, touch_pairs
from manikin.wholebody.path import Pose
from manikin.wholebody.refine_input import KeyPath
from manikin.wholebody.refine_scales import RefineScales
from manikin.wholebody.swing import SwingLimits, plan_swing
from manikin.wholebody.swing_curve import SwingCurve

SHARES = (0.25, 0.5, 0.75)
"""Shares of a flight at which a posture is looked for; our choice."""

SAME_TIME = 0.01
"""A given posture this near to a new one is replaced by it [s]."""

DEPARTURE = 0.1
"""Distance that a given path has to gain per metre from a contact to count as clear."""

LOOKS = 13
"""Instants at which the given path is looked at: a flight that is clear already needs no curve."""

TIME_STEP = 0.02
"""Spacing of the instants at which a curve is checked [s]: it is a beginning, not the motion."""

SEARCHES = 600
"""Most random poses of a search for a way around."""

ROOM = 0.01
"""Distance that such a way keeps in addition, so that rounding its corners stays clear [m]."""

REFINEMENTS = 20
"""Most steps by which a curve is improved."""

TURN_WEIGHT = 0.3
"""Weight of the effector's attitude on its curve, which is wished, not required [1/rad^2]."""

COM_WEIGHT = 30.0
"""Weight of a centre of mass between those at both ends [1/m^2]."""

SETTINGS = SolverSettings(tolerance=1e-3, explain=False)
"""A flight without such a posture needs no reason, and a guess no exact contacts."""

POSTURE_SHARE = 0.75
"""Share of the wanted distance that such a posture keeps from everything that is not touched."""


def with_mid_flights(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, path: KeyPath, padded: Sequence[str] = ()
) -> KeyPath:
    """Add postures along a clear curve inside each flight from a contact to another one.

    Args:
        body: The body.
        scene: The obstacles and the floor.
        schedule: Contacts in time.
        path: Key configurations at least at both ends of each flight.
        padded: Obstacles that any part of the body may lean on.

    Returns:
        The path with the postures that were found; a flight for which there is none stays as it is.
    """
    proximity, distance = Proximity(body, scene), RefineScales.of(body).safe_distance
    limits = SwingLimits(clearance=distance, time_step=TIME_STEP)
    leaning = frozenset((segment.name, name) for segment in body.segments for name in padded)
    keys = dict(zip(path.time.tolist(), path.q, strict=True))
    for swing in schedule.sequence.swings():
        if swing.start is None or swing.end is None or not hangs(body, swing.effector):
            continue
        curve = _curve(body, scene, schedule, path, swing, limits)
        if curve is None:
            continue
        touched = leaning.union(
            *(touch_pairs(body, scene, item) for item in standing_during(schedule, swing))
        )
        for share in SHARES:
            time = curve.start_time + share * curve.duration
            pose, guess = curve.at(time), path.at(np.array([time]))[0]
            com = Configuration(body, guess).com
            problem = PostureProblem(
                body, tuple(schedule.stance_at(time)),
                {swing.effector: Placement(pose.position, pose.rotation, TURN_WEIGHT)},
                com=np.array([com[0], com[1], np.nan]), com_weight=COM_WEIGHT,
                proximity=proximity, clearance=POSTURE_SHARE * distance, ignore=touched, reference=guess,
            )  # fmt: skip
            found = generate_posture(problem, guess, settings=SETTINGS)
            if found.succeeded:
                keys = {other: q for other, q in keys.items() if abs(other - time) > SAME_TIME}
                keys[time] = found.q
    times = sorted(keys)
    return KeyPath(times, np.array([keys[time] for time in times]))


def _curve(
    body: BodyModel,
    scene: Scene,
    schedule: ContactSchedule,
    path: KeyPath,
    swing: Swing,
    limits: SwingLimits,
) -> SwingCurve | None:
    """A curve of the effector that keeps off everything; None where there is none, or none is needed."""
    assert swing.start is not None
    assert swing.end is not None
    start, end = schedule.swing_interval(swing)
    times = np.linspace(start, end, LOOKS)
    given = path.at(times)
    coms = np.array([Configuration(body, q).com for q in given])

    def com(time: float) -> FloatArray:
        return np.array([np.interp(time, times, column) for column in coms.T])

    clearance = EffectorClearance(body, scene, swing.effector, standing_during(schedule, swing), com)
    first, last = (Pose(item.position, item.rotation_contact_to_world) for item in (swing.start, swing.end))
    is_clear = ClearFlight(clearance, first, last, start, end, replace(limits, departure=DEPARTURE))
    between = zip(times[1:-1].tolist(), given[1:-1], strict=True)
    if all(is_clear(time, _pose(body, q, swing)) for time, q in between):
        return None
    plan = plan_swing(
        first, last, start, end, clearance, limits=limits,
        start_normal=swing.start.normal, end_normal=swing.end.normal, refine=REFINEMENTS,
    )  # fmt: skip
    return plan.curve if plan.succeeded else _searched(clearance, first, last, (start, end), limits)


def _searched(
    clearance: EffectorClearance, first: Pose, last: Pose, interval: tuple[float, float], limits: SwingLimits
) -> SwingCurve | None:
    """A curve found by the Bi-RRT, which asks for a clear effector only; its draws are always the same."""

    def check(extra: float) -> Feasible:
        is_clear = ClearFlight(clearance, first, last, *interval, limits, extra)

        def feasible(pose: Pose, time: float, _hint: object) -> FloatArray | None:
            return np.zeros(0) if is_clear(time, pose) else None

        return feasible

    found = search_swing(
        first, last, *interval, check(0.0), np.random.default_rng(0), roomy=check(ROOM), iterations=SEARCHES
    )
    return found.curve


def _pose(body: BodyModel, q: FloatArray, swing: Swing) -> Pose:
    rotation, position = Configuration(body, q).effector_placement(swing.effector)
    return Pose(np.array(position), np.array(rotation))
