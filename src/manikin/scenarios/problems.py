"""Problems of the centre-of-mass planners that a scenario states, with its constraints and recordings."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactKind, ContactSchedule, StanceSequence
from manikin.errors import InputError
from manikin.kinematics.com_reach import ComReach, ComRegion
from manikin.kinematics.fold import HEAD_CLEARANCE, fold_under, lowest_ceiling
from manikin.motion.file import MotionFile, read_motions
from manikin.motion.motion import phases_of
from manikin.numerics.spatial import IDENTITY, FloatArray, PlanarTransform
from manikin.planning.com import (
    CentroidalProblem,
    GeometricConstraint,
    KeyframeProblem,
    KeyPlane,
    RecordedCom,
    Weights,
    height_band,
)
from manikin.planning.com.com_constraints import CeilingHeight, Zone, height_below, keep_out
from manikin.scenarios.expressions import SupportLevel
from manikin.scenarios.values import ScenarioValues, build_body
from manikin.scenarios.world import build_scene, stance_sequence
from manikin.scene import Box, HalfSpace, Mesh, Obstacle, Plane, Scene

HOVERING = 0.3
"""Least height above the supports of an obstacle that is overhead [m]; a lower one is stepped over."""
ONSET = 0.10
"""Distance within which the body comes down before an obstacle, for a stature of 1.75 m [m]."""
NEAR = 0.45
"""Soles this close to an obstacle, seen from above, carry the body below it [m]."""

_REFERENCE_STATURE = 1.75


def overhead_constraints(
    body: BodyModel, scene: Scene, sequence: StanceSequence, ends: tuple[FloatArray, FloatArray],
    names: Sequence[str] | None,
) -> tuple[GeometricConstraint, ...]:  # fmt: skip
    """Bound the CoM's height below each overhead obstacle that a standing body would touch.

    The body's own postures say how high its CoM may be ([Qiu2012]_ 8.2.2), the soles of the stances how high
    the ground is and where the body faces. Planes and half-spaces have no edge and are left out.

    Args:
        ends: CoM at the start and at the goal (3,) [m].
        names: Of the obstacles to pass below; if None, all that hover over the way from the start by the
            middles of the stances to the goal.
    """
    stances = [[c for c in phase.stance if c.kind is ContactKind.SOLE] for phase in sequence]
    soles = [contact for stance in stances for contact in stance]
    middles = [np.mean([c.position[:2] for c in stance], axis=0) for stance in stances if stance]
    way = list(itertools.pairwise([ends[0][:2], *middles, ends[1][:2]]))
    result = []
    for obstacle in scene:
        if not isinstance(obstacle.shape, (Plane, HalfSpace)):
            passed = _passed_below(obstacle, soles, way) if names is None else obstacle.name in names
            if passed and (constraint := _constraint(body, obstacle, soles)) is not None:
                result.append(constraint)
    return tuple(result)


def _passed_below(
    obstacle: Obstacle, soles: Sequence[Contact], way: Sequence[tuple[FloatArray, FloatArray]]
) -> bool:
    """Whether an obstacle hovers over a coarse way of the CoM, in pieces between points (2,)."""
    outline = _outline(obstacle)
    if float(obstacle.bounds[0][2]) - _level(soles, outline) < HOVERING:
        return False
    zone = Zone.below(outline, (), ONSET)
    return any(zone.crosses(a, b) for a, b in way)


def _constraint(body: BodyModel, obstacle: Obstacle, soles: Sequence[Contact]) -> GeometricConstraint | None:
    standing = Configuration(body, body.standing_posture())
    stature = float(standing.effector_placement("head")[1][2])
    scale = stature / _REFERENCE_STATURE
    outline, underside = _outline(obstacle), float(obstacle.bounds[0][2])
    headings = sorted({round(contact.yaw, 6) for contact in soles})
    level = _level(soles, outline)
    free = underside - level
    if free >= stature + HEAD_CLEARANCE:
        return None
    fold = fold_under(body, free)
    upright = 0.2 * scale * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    footprint = upright if fold is None else fold.footprint
    zone = Zone.below(outline, [_turned(footprint, yaw) for yaw in headings], ONSET * scale)
    top = level + 1.1 * float(standing.com[2])
    if fold is None:
        reason = (
            f"'{obstacle.name}' leaves {free:.2f} m above the supports; this body folds to no less than "
            f"{lowest_ceiling(body):.2f} m on its feet"
        )
        return keep_out(obstacle.name, zone, reason)
    return height_below(obstacle.name, CeilingHeight(zone, top, level + fold.com_height))


def _level(soles: Sequence[Contact], outline: FloatArray) -> float:
    """Height of the highest sole near the obstacle, or of the lowest of all [m]."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    heights = []
    for contact in soles:
        beyond = np.maximum(np.maximum(low - contact.position[:2], contact.position[:2] - high), 0.0)
        if float(np.linalg.norm(beyond)) < NEAR:
            heights.append(float(contact.position[2]))
    return max(heights, default=min((float(contact.position[2]) for contact in soles), default=0.0))


def _outline(obstacle: Obstacle) -> FloatArray:
    """(n, 2) points whose convex hull is the obstacle seen from above [m]."""
    if isinstance(obstacle.shape, Box):
        signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
        return obstacle.to_world(0.5 * signs * obstacle.shape.size)[:, :2]
    if isinstance(obstacle.shape, Mesh):
        return obstacle.to_world(obstacle.shape.vertices)[:, :2]
    (x0, y0, _), (x1, y1, _) = obstacle.bounds
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _turned(points: FloatArray, yaw: float) -> FloatArray:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


SAME_PLACE = 0.01
"""Distance up to which a recorded contact is that of the scenario [m]."""


def load_recording(
    path: Path, sequence: StanceSequence, stature: float, level: SupportLevel,
    transform_recording_to_world: PlanarTransform,
) -> RecordedCom:  # fmt: skip
    """Read the CoM of a motion file and lay its timing over the stances of a scenario.

    The executed motion is taken, or else the planned one. Its phases are those of the file's schedule, or
    else of its support table. For a body of another ``stature`` [m] the heights above the supports, whose
    ``level`` is that below the CoM, are scaled, see :mod:`manikin.scenarios.expressions`.

    Raises:
        InputError: If the file cannot be read, or the motion was recorded on other supports or is not usable.
    """
    content = read_motions(path)
    motion = next(reversed(content.motions.values()))
    table = phases_of(motion, content.schedule)
    wanted = [sorted(phase.stance.effectors) for phase in sequence]
    result = [sorted(names) for names in table.supports]
    if result != wanted:
        raise InputError(f"{path}: {_difference(result, wanted)}; valid: a motion on the scenario's supports")
    if content.schedule is not None:
        _check_places(path, content.schedule, sequence, transform_recording_to_world)
    com = _scaled(transform_recording_to_world.points(motion.com), content, stature, level)
    return RecordedCom(motion.time, com, sequence, table.instants)


def _difference(found: list[list[str]], wanted: list[list[str]]) -> str:
    """Say the first phase whose contacts are others than the scenario's."""
    if not any(found):
        return "was recorded without any support"
    if len(found) != len(wanted):
        return f"was recorded with {len(found)} phases, the scenario has {len(wanted)}"
    number = next(i for i, pair in enumerate(zip(found, wanted, strict=True)) if pair[0] != pair[1])
    names, others = (", ".join(contacts[number]) or "nothing" for contacts in (found, wanted))
    return f"was recorded on {names} in phase {number}, the scenario stands on {others}"


def _check_places(
    path: Path, schedule: ContactSchedule, sequence: StanceSequence, transform: PlanarTransform
) -> None:
    for number, (recorded, phase) in enumerate(zip(schedule.sequence, sequence, strict=True)):
        for contact in phase.stance:
            place = transform.points(recorded.stance[contact.effector].position)
            if np.linalg.norm(place - contact.position) > SAME_PLACE:
                there, here = (np.round(item, 3).tolist() for item in (place, contact.position))
                raise InputError(
                    f"{path}: {contact.effector} was recorded at {there} in phase {number}, the scenario has "
                    f"it at {here}; valid: a motion on the scenario's supports"
                )


def _scaled(com: FloatArray, content: MotionFile, stature: float, level: SupportLevel) -> FloatArray:
    recorded = None if content.body is None else content.body.stature
    if recorded is None or recorded == stature:
        return com
    base = level(com[:, 0], com[:, 1])
    return np.column_stack([com[:, :2], base + stature / recorded * (com[:, 2] - base)])


BEND = 0.12
"""How far below its greatest height the CoM is kept where nothing asks for more, over its standing height."""


def centroidal_problem(values: ScenarioValues, *, upright: bool = True) -> CentroidalProblem:
    """Build the problem of the timing-free planner, with every height scaled to the body.

    The phases at the end in which the body sits are left out: there the centre of mass is not what keeps the
    balance ([Qiu2012]_ 7.2.2).

    Args:
        upright: Whether a person whose file bounds the CoM by nothing bends no more than supports and
            overhead obstacles ask for: a low CoM has larger margins, on legs that cannot hold it.

    Raises:
        ScenarioError: If the supports or a centre of mass are missing, or a value is out of range.
    """
    options, seat = values.file.planning, values.seated_from
    rest = np.zeros(3) if options.zero_end_accelerations else None
    velocity = (0.0, 0.0, 0.0) if seat is None else values.file.task.goal.velocity_m_s
    given: dict[str, Any] = {"degree": options.degree, "samples": options.samples}
    sequence = _standing(values, planning=True)
    upright = upright and values.keeps_upright
    ceilings = [phase.com_below for phase in values.explicit_supports().phases[:seat]]
    geometric = _height_constraints(values, automatic=upright and not any(ceilings))
    with values.refusing(("planning",)):
        return CentroidalProblem(
            values.moved_mass, sequence, values.start_com, values.goal_com,
            goal_velocity=None if velocity is None else np.array(velocity),
            start_acceleration=rest, goal_acceleration=rest if seat is None else None,
            margin_space=options.margin_space, required_margin=values.required_margin,
            support_distance=values.max_support_distance,
            regions=_regions(values, sequence, geometric if upright else None),
            geometric=geometric, key_planes=_key_planes(values, sequence), rests=_rests(values, sequence),
            max_duration=options.max_duration_s,
            weights=Weights(**options.weights.model_dump(exclude_none=True)),
            **{key: value for key, value in given.items() if value is not None},
        )  # fmt: skip


def keyframe_problem(values: ScenarioValues) -> KeyframeProblem | None:
    """Build the problem of the keyframe-based planner; None when the file asks for another one.

    ScenarioError if the recording cannot be read or was made on other supports.
    """
    options = values.file.planning
    if options.method != "keyframes" or options.recording is None:
        return None
    path, sequence = values.find_file(options.recording), stance_sequence(values, planning=True)
    with values.refusing(("planning", "recording")):
        frame = options.recording_frame
        recording = load_recording(
            path, sequence, values.file.body.stature_m, values.support_level(),
            IDENTITY if frame is None else frame.transform_to_world(),
        )  # fmt: skip
        return KeyframeProblem.of(centroidal_problem(values), recording, options.control_points)


def _standing(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """The stances before the body sits: all, where it does not."""
    sequence, seat = stance_sequence(values, planning=planning), values.seated_from
    return sequence if seat is None else StanceSequence(sequence.phases[: sequence.begins[seat]])


def _key_planes(values: ScenarioValues, sequence: StanceSequence) -> tuple[KeyPlane, ...]:
    """Faces of the boxes in which phases want the centre of mass to be when they begin."""
    planes: list[KeyPlane] = []
    phases = values.explicit_supports().phases[: values.seated_from]
    if all(phase.com_near is None for phase in phases):
        return ()
    for key, phase in zip(sequence.begins, phases, strict=True):
        if phase.com_near is not None:
            sides = zip(np.eye(3), phase.com_near, phase.com_within_m, strict=True)
            for lead, side, sign in itertools.product(sorted({0.0, phase.com_lead_s}), sides, (1.0, -1.0)):
                axis, middle, room = side
                planes.append(KeyPlane(key, sign * axis, sign * middle + room, lead))
    return tuple(planes)


def _rests(values: ScenarioValues, sequence: StanceSequence) -> tuple[FloatArray | None, ...]:
    """CoM of the posture in which each phase before a seat begins, where the file has one."""
    phases = values.explicit_supports().phases[: values.seated_from]
    rests: list[FloatArray | None] = [None] * len(sequence)
    if any(phase.com_near is not None for phase in phases):
        for key, phase in zip(sequence.begins, phases, strict=True):
            rests[key] = None if phase.com_near is None else np.array(phase.com_near)
    return tuple(rests)


def _regions(
    values: ScenarioValues, sequence: StanceSequence, ceilings: Sequence[GeometricConstraint] | None
) -> tuple[ComRegion | None, ...]:
    """Where the body's postures have the CoM in each phase, with the places and below the planes of the file.

    With ``ceilings`` they are cut :data:`BEND` below the least height that a phase, those beside it and the
    ceilings over it allow.

    At those, and on stances on which sampling finds no posture, the full search for key postures judges.
    A largest distance from the supports that the file gives takes the place of all regions.
    """
    given = [phase.com_below for phase in values.explicit_supports().phases[: values.seated_from]]
    planes = [None] * len(sequence)
    if any(given):
        lasts = np.diff([*sequence.begins, len(sequence)])
        planes = [plane for plane, parts in zip(given, lasts, strict=True) for _ in range(parts)]
    free = ComRegion.everywhere()
    if values.is_point_mass or values.max_support_distance is not None:
        bounded = tuple(plane and free.below(plane.position, plane.normal) for plane in planes)
        return bounded if any(planes) else ()
    body = build_body(values)
    reach, inner = ComReach.of(body), _rests(values, sequence)[1:]
    known = [values.start_com, *inner, values.goal_com]
    found = [reach.region(phase.stance.contacts) for phase in sequence]
    tops = [region.top for region in found]
    for number, phase in enumerate(sequence):
        middle = np.append(np.mean([contact.position[:2] for contact in phase.stance], axis=0), 0.0)
        for ceiling in ceilings or ():
            if not ceiling.impassable:
                tops[number] = min(tops[number], -float(ceiling.violation(middle)))
        if (plane := planes[number]) is not None:
            down = (middle - plane.position) @ plane.normal / plane.normal[2]
            tops[number] = min(tops[number], float(middle[2] - down))
    bend = BEND * float(Configuration(body, body.standing_posture()).com[2])
    regions: list[ComRegion | None] = []
    for number, region in enumerate(found):
        if ceilings is not None:
            region = region.above(min(tops[max(0, number - 1) : number + 2]) - bend)
        places = [place for place in known[number : number + 2] if place is not None]
        within = free if region.empty else region.including(places)
        if (plane := planes[number]) is not None:
            within = within.below(plane.position, plane.normal)
        regions.append(within if len(within.offsets) else None)
    return tuple(regions)


def _height_constraints(values: ScenarioValues, *, automatic: bool) -> tuple[GeometricConstraint, ...]:
    band, wanted = values.height_band, "automatic" if automatic else values.constraint("overhead")
    result = () if band is None else height_band(band.lower, band.upper)
    if wanted is None:
        return result
    names = None if wanted == "automatic" else tuple(wanted)
    body, scene, stances = build_body(values), build_scene(values), _standing(values)
    ends = values.start_com, values.goal_com
    return (*result, *overhead_constraints(body, scene, stances, ends, names))
