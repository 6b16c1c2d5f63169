"""Scene of a scenario, its stances and whether they fit, and the posture of its body at the start."""

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.body.anthropometry import TOE_HINGE_FROM_HEEL
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.body.limbs import hinge_line
from manikin.body.strength import hand_masses
from manikin.contact import (
    CarriedLoad,
    Contact,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    point,
    roll_feet,
    rolling_front,
    sole,
    soles_overlap,
)
from manikin.errors import ScenarioError
from manikin.numerics.spatial import (
    FloatArray,
    finite_number,
    frozen_array,
    rotation_from_normal,
    rotation_from_rpy,
    turned_root,
)
from manikin.planning.contacts import ContactRules, Endpoints, Habit, PostureFinder, PostureFinderSettings
from manikin.planning.whole_body.posture_style import READY, posture_style_of
from manikin.scenarios.sections.support_sections import ContactSection, SoleSection
from manikin.scenarios.sections.task_sections import ObstacleSection
from manikin.scenarios.values import ScenarioValues, build_body
from manikin.scene import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Obstacle,
    Plane,
    Scene,
    Sphere,
    load_mesh,
    mesh_place,
)  # fmt: skip
from manikin.scene.obstacle import Shape


def build_contact(
    effector: str, entry: ContactSection, friction: float, default_sole: SoleSection, *,
    planning: bool = False, force_cap: float | None = None,
) -> Contact:  # fmt: skip
    """Build one contact from its section; ContactError if a value is out of its range.

    Coulomb coefficient, sole size and cap on the normal force [N] are for where the contact gives none.

    Args:
        planning: Let ``default_sole`` shrink a sole the contact gives itself.
    """
    kind = entry.kind_for(effector)
    if kind == "grasp":
        turn = None if entry.rpy_deg is None else rotation_from_rpy(*np.radians(entry.rpy_deg))
        force = (planning and entry.planning_max_force_N) or entry.max_force_N or 0.0
        moment = entry.max_moment_Nm or 0.0
        return grasp(effector, entry.position, max_force=force, max_moment=moment, rotation=turn)
    friction = entry.friction or friction
    force_cap = entry.normal_force_cap_N or force_cap
    if kind == "point":
        return point(
            effector, entry.position, friction=friction,
            rotation=rotation_from_normal(entry.normal or (0.0, 0.0, 1.0), math.radians(entry.yaw_deg)),
            normal_force_cap=force_cap,
        )  # fmt: skip
    sizes = [entry.sole or default_sole, *([default_sole] if planning else [])]
    made = sole(
        effector, entry.position, math.radians(entry.yaw_deg),
        length=min(size.length_m for size in sizes), width=min(size.width_m for size in sizes),
        polygon=entry.polygon, friction=friction, normal=entry.normal, normal_force_cap=force_cap,
        torsion_limit=entry.torsion_limit_Nm, settle=entry.settle_s or 0.0,
    )  # fmt: skip
    return made if entry.edge_radius_m is None else rolling_front(made, entry.edge_radius_m)


PATCH_WIDTH = 0.7
"""Width of the front of a sole that has to lie on a hold, relative to the sole's."""
HINGE_ROOM = 0.005
"""Distance of that part to the hinge of the toes, which would give way [m]."""


def contact_rules(values: ScenarioValues, body: BodyModel) -> ContactRules:
    """Rules of the file's ``contacts`` for its body; one without soles has no front of them."""
    options, patch, end = values.contacts, None, None
    if body.sole_length and body.sole_width and body.stature is not None:
        hinge = hinge_line(body, "left_foot")
        end = (0.5 * body.sole_length if hinge is None else hinge) - HINGE_ROOM  # without toes, of the tip
        if options.forefoot_m is not None:
            patch = (end - options.forefoot_m, end, PATCH_WIDTH * body.sole_width)
    return ContactRules(friction_of(values), options.grasp_force_N, 0.0, patch, end)


def friction_of(values: ScenarioValues) -> float:
    """Coulomb coefficient of the file's supports, or of its contacts where those are found."""
    supports = values.file.supports
    return values.contacts.friction if supports is None else supports.friction


def stance_sequence(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """Build the stances of the explicit supports; feet that roll have heel and toe phases.

    With ``planning`` they have the smaller soles, friction and force caps that planning balances on.
    ScenarioError if there are no supports, or a contact slides between phases.
    """
    sequence, supports = flat_sequence(values, planning=planning), values.explicit_supports()
    if supports.foot != "rolling":
        return sequence
    with values.refusing(("supports", "foot")):
        other = flat_sequence(values, planning=not planning)
        return roll_feet(sequence, (TOE_HINGE_FROM_HEEL - 0.5) * supports.sole.length_m, other)


def flat_sequence(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """Build the stances as the file lists them, with full soles; otherwise as :func:`stance_sequence`."""
    supports, model = values.explicit_supports(), values.contact_model
    cap = (planning and supports.planning_normal_force_cap_N) or supports.normal_force_cap_N
    if cap is not None:
        model = replace(model, normal_force_cap=cap)
    with values.refusing(("supports", "phases")):
        phases, held = [], zip(supports.resolved_phases(), carried_loads(values), strict=True)
        for section, (contacts, load) in zip(supports.phases, held, strict=True):
            stance = Stance([_contact(values, *item, planning) for item in contacts.items()], model=model)
            phases.append(Phase(stance, section.min_duration_s, section.max_duration_s, load))
        return StanceSequence(phases)


def carried_loads(values: ScenarioValues) -> list[CarriedLoad | None]:
    """What each phase of the supports carries beside the body; ScenarioError if a phase does not exist."""
    load, phases = values.file.body.load, values.explicit_supports().phases
    if load is None or load.lasts:
        return [None] * len(phases)
    first = 0 if load.from_phase is None else load.from_phase
    last = len(phases) - 1 if load.until_phase is None else load.until_phase
    for key, number, least in (("from_phase", first, 0), ("until_phase", last, first)):
        if not least <= number < len(phases):
            problem = f"is {number}; valid: {least} to {len(phases) - 1}, phases of the supports"
            raise values.error(("body", "load", key), problem)
    body = build_body(values)
    masses = hand_masses(body, load.mass_kg, load.hand)
    ready = Configuration(body, READY.posture(body))
    hands = np.mean([ready.effector_placement(name)[1] for name in masses], axis=0)
    ahead = rotation_from_rpy(0.0, 0.0, math.radians(values.start_heading_deg))
    carried = CarriedLoad(masses, frozen_array(ahead @ (hands - ready.com), "offset of the load [m]", (3,)))
    return [carried if first <= number <= last else None for number in range(len(phases))]


def check_contacts(values: ScenarioValues, scene: Scene) -> None:
    """Raise a ScenarioError for the first contact that is off every surface or overlaps another."""
    for number, stance in enumerate(phase.stance for phase in flat_sequence(values)):
        for first, second in combinations(stance, 2):
            if soles_overlap(first, second):
                problem = f"overlaps {first.effector}; valid: soles that lie side by side"
                raise values.error(("supports", "phases", number, second.effector), problem)
        for contact in stance:
            with values.refusing(("supports", "phases", number, contact.effector)):
                scene.touched_obstacles(contact)


def _contact(values: ScenarioValues, effector: str, entry: ContactSection, planning: bool) -> Contact:
    supports = values.explicit_supports()
    friction, default_sole = supports.friction, supports.sole
    if planning:
        friction = supports.planning_friction or friction
        default_sole = supports.planning_sole or default_sole
    if effector == "buttocks":
        stature = values.file.body.stature_m  # the rectangle of the buttocks that presses on a seat
        default_sole = SoleSection(length_m=SEAT_LENGTH * stature, width_m=SEAT_WIDTH * stature)
    cap = supports.contact_normal_force_cap_N
    if entry.polygon is None or not planning:
        return build_contact(effector, entry, friction, default_sole, planning=planning, force_cap=cap)
    # What touches of a sole over an edge is drawn together about its own middle, as a whole sole is.
    real = entry.sole or (default_sole if effector == "buttocks" else supports.sole)
    made = build_contact(effector, entry, friction, real, force_cap=cap)
    shares = (min(1.0, default_sole.length_m / real.length_m), min(1.0, default_sole.width_m / real.width_m))
    points = made.centre + np.array([*shares, 1.0]) * (made.points - made.centre)
    return replace(made, points=frozen_array(points, "points of a sole [m]", (None, 3)))


def _shape(entry: ObstacleSection, folder: Path) -> Shape:
    for given, kind in ((entry.box, Box), (entry.plane, Plane), (entry.half_space, HalfSpace)):
        if given is not None:
            return kind(given)
    for given, kind in ((entry.cylinder, Cylinder), (entry.capsule, Capsule)):
        if given is not None:
            return kind(given.radius_m, given.length_m)
    if entry.sphere is not None:
        return Sphere(entry.sphere.radius_m)
    path = mesh_place(str(entry.mesh), folder)
    return load_mesh(path, unit=entry.unit, scale=entry.scale or 1.0, convex=entry.convex or "no")


CLIMBING = "climbing"
"""Name of the posture of one who hangs on holds: where the root is, with whatever contacts are there."""


def start_posture(
    values: ScenarioValues, body: BodyModel, scene: Scene, *, at: tuple[float, float] | None = None,
    heading_deg: float | None = None, posture: str | None = None,
) -> FloatArray:  # fmt: skip
    """(nq,) configuration at the start: a posture turned and moved to its place.

    A standing body is the standing posture as it is: its root at the place, or its centre of mass over
    the file's, its soles at the height of the supports or of the floor. A seated or crouched one is what
    planning would start from (:class:`manikin.planning.contacts.Endpoints`); a climbing one is the reference
    near which planning would seek holds.

    Args:
        at: Where to stand, x and y [m]; the file's own place when omitted.
        heading_deg: Where to face, counter-clockwise from world x [deg]; the file's own, or that of
            its feet, when omitted.
        posture: Name of a posture; the file's own, or standing, when omitted.

    Raises:
        ScenarioError: If the posture is not known, does not exist there, or the file gives no place.
        InputError: If a number is not finite.
    """
    start = values.file.task.start
    name = posture or start.posture or Habit.STANDING
    if name not in (*Habit, CLIMBING):
        raise ScenarioError(f"posture is {name!r}; valid: {', '.join((*Habit, CLIMBING))}")
    heading_deg = None if heading_deg is None else finite_number(heading_deg, "heading [deg]")
    at = None if at is None else (finite_number(at[0], "at x [m]"), finite_number(at[1], "at y [m]"))
    yaw = float(np.deg2rad(values.start_heading_deg if heading_deg is None else heading_deg))
    place = at or start.at
    if name != Habit.STANDING:
        spot = np.array(values.start_com[:2] if place is None else place)
        if name == CLIMBING:
            level = values.start_level if start.height_m is None else start.height_m
            return carried_to(posture_style_of(CLIMBING).posture(body), spot, yaw, level)
        settings = PostureFinderSettings(friction_model=values.contact_model.friction)
        endpoints = Endpoints(PostureFinder(body, scene, settings=settings), friction_of(values))
        result = endpoints.find(spot, yaw, Habit(name), start.height_m)
        if result.stage is None:
            raise ScenarioError(f"{values.source}: {result.failure}; valid: another place or posture")
        return np.array(result.stage.q)
    q = turned_root(body.standing_posture(), yaw)
    q[2] += values.start_level
    q[:2] = place if place is not None else q[:2] + values.start_com[:2] - Configuration(body, q).com[:2]
    return q


def carried_to(q: FloatArray, at: ArrayLike, yaw: float, level: float) -> FloatArray:
    """(nq,) a posture made for the ground at the origin, at a place x and y and a level [m], turned [rad]."""
    posture = turned_root(q, yaw)
    posture[:2] = at
    posture[2] += level
    return posture


def build_scene(values: ScenarioValues) -> Scene:
    """Build the obstacles and the floor; ScenarioError if a mesh cannot be read or a shape is degenerate."""
    obstacles = []
    for index, entry in enumerate(values.file.scene):
        with values.refusing(("scene", index)):
            rotation = rotation_from_rpy(*np.radians(entry.rpy_deg))
            shape = _shape(entry, values.folder)
            obstacles.append(Obstacle(entry.name, shape, rotation, entry.position))
    return Scene(obstacles, floor_height=values.file.floor_height_m)
