"""Motions of operations as one motion: measured, certified and reported, with the interval of each one."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.balance import wrench_polytopes
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel, Configuration
from manikin.body.segments import HANDS
from manikin.body.strength import hand_masses
from manikin.contact import CarriedLoad, ContactSchedule, StanceSequence
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, PlanarTransform, frozen_array
from manikin.pipeline.stages.context import Report
from manikin.pipeline.stages.execution_stage import PlannedMotion
from manikin.planning.whole_body import HandCourse, HeldObject
from manikin.planning.whole_body.handling import CourseKind
from manikin.planning.whole_body.swing_path import Pose
from manikin.runtime.requirement import Requirement, RequirementTable

PALM_TOLERANCE = 0.005
"""Largest distance of a palm from its place on what it takes or holds [m]."""
LOOKED_AT = 5
"""Every so many samples of a motion the palms are measured."""


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object where it is: at rest, or in the hands.

    Attributes:
        sizes: (3,) depth, breadth and height as it faces the body [m].
        place: (4,) position of its middle [m] and direction of its depth [rad].
        turned: Its yaw less that direction [rad].
    """

    thing: HeldObject
    sizes: FloatArray
    place: FloatArray
    turned: float

    @property
    def holds(self) -> dict[str, Pose]:
        """Places of both palms in its frame."""
        return self.thing.holds(self.sizes)

    @property
    def yaw(self) -> float:
        """[rad]."""
        return float(self.place[3]) + self.turned


@dataclass(frozen=True, eq=False)
class OperationMotion:
    """One planned motion of an operation.

    Attributes:
        operation: Number of the operation.
        name: Of it, with its object.
        states: Times from the start of the motion (n,) [s], configurations, velocities and accelerations.
        schedule: Contacts in its own time.
        report: Of its plan.
        course: Of the hands; None where they have none.
        held: What is in the hands; None for nothing.
    """

    operation: int
    name: str
    states: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    schedule: ContactSchedule
    report: Report
    course: HandCourse | None
    held: PlacedObject | None

    @property
    def duration(self) -> float:
        """[s]."""
        return self.schedule.duration

    @property
    def q(self) -> FloatArray:
        """(n, nq) configurations."""
        return self.states[1]


def begins(parts: Sequence[OperationMotion]) -> list[float]:
    """Times at which motions begin one after the other, and at which the last one ends [s]."""
    return [0.0, *np.cumsum([part.duration for part in parts]).tolist()]


def joined(body: BodyModel, parts: Sequence[OperationMotion]) -> PlannedMotion:
    """Motions from rest to rest as one, with what is carried in its phases, measured anew."""
    phases, instants, states = [], [0.0], []
    for begin, part in zip(begins(parts)[:-1], parts, strict=True):
        load = None if part.held is None else _load(body, part)
        phases += [replace(phase, load=load) for phase in part.schedule.sequence]
        instants += (part.schedule.instants[1:] - part.schedule.instants[0] + begin).tolist()
        time, *rest = part.states
        kept = slice(1 if states else 0, None)
        states.append([(time + begin)[kept], *(rows[kept] for rows in rest)])
    schedule = ContactSchedule(StanceSequence(phases), np.array(instants))
    polytopes = list(wrench_polytopes([phase.stance for phase in schedule.sequence]))
    motion, _ = full_motion(
        body, schedule, polytopes, *(np.concatenate(x) for x in zip(*states, strict=True))
    )
    return PlannedMotion(schedule, motion)


def _load(body: BodyModel, part: OperationMotion) -> CarriedLoad:
    assert part.held is not None
    masses, state = hand_masses(body, part.held.thing.mass), Configuration(body, part.q[0])
    hands = np.mean([state.effector_placement(name)[1] for name in masses], axis=0)
    return CarriedLoad(masses, frozen_array(hands - state.com, "offset of the load [m]", (3,)))


def report_operations(
    report: Report, body: BodyModel, parts: Sequence[OperationMotion], motion: Motion,
    places: Sequence[Sequence[PlacedObject]],
) -> None:  # fmt: skip
    """Report the worst value of every requirement, and the interval, load and margins of each operation.

    Args:
        report: Of the whole run.
        body: With empty hands.
        parts: Motions of the operations.
        motion: All of them as one.
        places: Objects that were taken up, where they are at the end of each operation.
    """
    for stage in ("centroidal", "wholebody"):
        worst = dict[str, Requirement]()
        for begin, part in zip(begins(parts)[:-1], parts, strict=True):
            rows = [_timed(row, part, begin) for row in part.report.table(stage)]
            for row in [*rows, *(_palms(body, part, begin) if stage == "wholebody" else ())]:
                if row.key not in worst or _slack(row) < _slack(worst[row.key]):
                    worst[row.key] = row
        report.require(stage, RequirementTable(tuple(worst.values())))
    objects = [[_in_world(item, report.transform) for item in there] for there in places]
    blocks = [
        block | {"objects": there}
        for block, there in zip(_intervals(body, parts, motion), objects, strict=False)
    ]
    report.finish("operations", {"list": blocks, "objects": objects[-1] if objects else []})


def _in_world(item: PlacedObject, transform_task_to_world: PlanarTransform) -> dict[str, Any]:
    """An object in plain values, where it is in the world."""
    return {
        "name": item.thing.name, "mass_kg": item.thing.mass,
        "position": transform_task_to_world.points(item.place[:3]).tolist(),
        "yaw_deg": transform_task_to_world.turned(math.degrees(item.yaw)),
    }  # fmt: skip


def _timed(row: Requirement, part: OperationMotion, begin: float) -> Requirement:
    """A requirement of one motion as one of the whole."""
    when = None if row.time_s is None else row.time_s + begin
    return replace(row, time_s=when, where=f"{part.name}: {row.where}" if row.where else part.name)


def _intervals(body: BodyModel, parts: Sequence[OperationMotion], motion: Motion) -> Iterator[dict[str, Any]]:
    """Each operation in plain values."""
    times, share = begins(parts), body.torque_share(motion.tau[:, 6:]).max(axis=1)
    for number in sorted({part.operation for part in parts}):
        mine = [k for k, part in enumerate(parts) if part.operation == number]
        first, last = times[mine[0]], times[mine[-1] + 1]
        during = (motion.time >= first - 1e-9) & (motion.time <= last + 1e-9)
        loads = [part.held.thing.mass for k in mine if (part := parts[k]).held is not None]
        yield {
            "operation": parts[mine[0]].name, "start_s": first, "end_s": last,
            "load_kg": max(loads, default=0.0), "min_margin": float(motion.margin[during].min()),
            "max_torque_share": float(share[during].max()),
        }  # fmt: skip


def _palms(body: BodyModel, part: OperationMotion, begin: float) -> Iterator[Requirement]:
    """Largest distance of palms from their places on what they take or hold, if any."""
    if part.held is not None:
        rows = np.arange(len(part.q))[::LOOKED_AT]
    elif part.course is not None:
        rows = np.array([-1 if part.course.kind is CourseKind.TAKE else 0])
    else:
        return
    error = np.array([_palm_error(body, part, int(row)) for row in rows])
    worst = int(np.argmax(error))
    when = begin + float(part.states[0][rows[worst]])
    yield Requirement("max_palm_error_m", "distance of a palm from its place", "m", float(error[worst]), "<=",
                      PALM_TOLERANCE, when, part.name)  # fmt: skip


def _palm_error(body: BodyModel, part: OperationMotion, row: int) -> float:
    """Distance of palms from their places in a sample, or of their distance from a breadth [m]."""
    state = Configuration(body, part.q[row])
    if part.held is not None:
        left, right = (state.effector_placement(hand)[1] for hand in HANDS)
        return abs(float(np.linalg.norm(left - right)) - float(part.held.sizes[1]))
    assert part.course is not None
    wanted = part.course.targets(np.array([1.0 if part.course.kind is CourseKind.TAKE else 0.0]))
    return max(
        float(np.linalg.norm(state.effector_placement(hand)[1] - target.position[0]))
        for hand, target in wanted.items()
    )


def _slack(row: Requirement) -> float:
    """How far a requirement is from its limit, negative where it is broken, relative to the limit."""
    room = row.limit - row.measured if row.sense == "<=" else row.measured - row.limit
    return room / max(abs(row.limit), 1e-9) if math.isfinite(room) else -math.inf
