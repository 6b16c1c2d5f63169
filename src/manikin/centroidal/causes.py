"""Why a stance cannot work at all: friction too low for a slope, feet too far apart for the legs."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from manikin.balance import WrenchPolytope, admissible_com_polygon, wrench_polytopes
from manikin.centroidal.problem import CentroidalProblem
from manikin.contact import ContactKind, Stance, StanceSequence
from manikin.errors import InputError
from manikin.spatial import FloatArray

FIRM_FRICTION = 0.7
"""Friction of dry shoes on a dry floor, tried where a smaller one may be the cause."""

REACH_TOLERANCE = 0.01
"""A place that misses the constraints on the CoM by less than this may be off the grid's points [m]."""

SLIPPERY = 0.2
"""Friction below this is tried otherwise where a plan fails: of ice, or of wet and smooth floors."""

_GRID = 25
_LEVELS = 15


def slipping_slope(stance: Stance, polytope: WrenchPolytope, mass: float) -> str | None:
    """Say that the friction is too low to stand still on the slopes of a stance, or None."""
    if any(contact.kind is ContactKind.GRASP for contact in stance) or not len(stance):
        return None
    steepness = [(_slope(contact.normal), contact) for contact in stance]
    if not all(np.tan(angle) > contact.friction for angle, contact in steepness):
        return None
    try:
        if len(admissible_com_polygon(polytope, mass)):
            return None
    except InputError:
        return None
    angle, contact = min(steepness, key=lambda item: item[0])
    return (
        f"nobody can stand on {', '.join(stance.effectors)}: a slope of {np.degrees(angle):.1f} degrees "
        f"needs a friction of at least {np.tan(angle):.2f}, {contact.effector} has {contact.friction:g}"
    )


def _slope(normal: FloatArray) -> float:
    """Angle of a surface to the horizontal [rad]."""
    return float(np.arccos(np.clip(normal[2], -1.0, 1.0)))


def low_friction(
    stances: Sequence[Stance],
    problem: CentroidalProblem,
    measure: Callable[[Sequence[WrenchPolytope]], float],
) -> str:
    """Say that a quantity would suffice with firm friction; empty when friction is not the cause.

    Args:
        stances: What the quantity depends on.
        problem: Where it occurs.
        measure: The quantity from the stances' polytopes; it suffices above the required margin.
    """
    least = least_friction(stances)
    if least >= FIRM_FRICTION:
        return ""
    firm = wrench_polytopes([_firm(s) for s in stances], reference=problem.reference)
    value = measure(firm)
    if value <= problem.required_margin:
        return ""
    return f"; the friction of {least:g} is too low: with {FIRM_FRICTION:g} it would be {value:.2f} N.m"


def least_friction(stances: Sequence[Stance]) -> float:
    """Least coefficient of the soles and points of some stances; infinite without any."""
    return min((c.friction for s in stances for c in s if c.kind is not ContactKind.GRASP), default=np.inf)


def with_firm_friction(problem: CentroidalProblem) -> CentroidalProblem:
    """The same problem with friction of :data:`FIRM_FRICTION` at least."""
    phases = [replace(phase, stance=_firm(phase.stance)) for phase in problem.sequence]
    return replace(problem, sequence=StanceSequence(phases))


def _firm(stance: Stance) -> Stance:
    contacts = [
        contact
        if contact.kind is ContactKind.GRASP
        else replace(contact, friction=max(contact.friction, FIRM_FRICTION))
        for contact in stance
    ]
    return stance.with_contacts(contacts)


def out_of_reach(problem: CentroidalProblem, phase: int) -> str | None:
    """Say that no CoM is near enough to all contacts of a phase and keeps the constraints, or None."""
    stance, limit = problem.sequence[phase].stance, problem.support_distance
    if limit is None or len(stance) < 2:
        return None
    apart, first, second = max(
        (float(np.linalg.norm(a.position - b.position)), a.effector, b.effector)
        for i, a in enumerate(stance)
        for b in stance.contacts[:i]
    )
    missing = _least_miss(problem, np.array([contact.position for contact in stance]), limit)
    if missing <= REACH_TOLERANCE:
        return None
    return (
        f"the step is too long: {second} and {first} are {apart:.2f} m apart in phase {phase}, and no "
        f"centre of mass within {limit:.3f} m of both keeps the constraints on it "
        f"(it misses them by {missing:.2f} m)"
    )


def _least_miss(problem: CentroidalProblem, places: FloatArray, limit: float) -> float:
    """Least violation of distance and constraints over a grid of CoM positions above the contacts [m]."""
    low, high = places.max(axis=0) - limit, places.min(axis=0) + limit
    axes = [np.linspace(min(a, b), max(a, b), _GRID) for a, b in zip(low[:2], high[:2], strict=True)]
    x, y = (grid.ravel() for grid in np.meshgrid(*axes))
    flat = np.linalg.norm(np.stack([x, y], axis=1)[:, None] - places[:, :2], axis=2)
    tops = places[:, 2] + np.sqrt(np.maximum(limit**2 - flat**2, 0.0))
    top, far = tops.min(axis=1), np.maximum(flat - limit, 0.0).max(axis=1)
    worst = np.inf
    for depth in np.linspace(0.0, 0.3 * limit, _LEVELS):
        position = np.stack([x, y, top - depth], axis=1)
        violation = [far, *(constraint.violation(position) for constraint in problem.geometric)]
        worst = min(worst, float(np.max(violation, axis=0).min()))
    return worst
