"""What can be said before solving: Propositions 1 and 2 and the ends of the motion ([Qiu2012]_ 5.4.3).

A failure also says why a stance cannot work at all: friction too low for a slope, feet too far apart.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from manikin.balance import WrenchPolytope, admissible_com_polygon, pseudo_wrench, wrench_polytopes
from manikin.balance.margin import force_levers, wrench_levers
from manikin.contact import ContactKind, Stance, StanceSequence
from manikin.errors import InputError
from manikin.numerics.polytope import Polytope
from manikin.numerics.spatial import GRAVITY, FloatArray, rows_about, skew
from manikin.planning.com.com_problem import CentroidalProblem

FIRM_FRICTION = 0.7
"""Friction of dry shoes on a dry floor, tried where a smaller one may be the cause."""

REACH_TOLERANCE = 0.01
"""A place that misses the constraints on the CoM by less than this may be off the grid's points [m]."""

SLIPPERY = 0.2
"""Friction below this is tried otherwise where a plan fails: of ice, or of wet and smooth floors."""

_GRID = 25
_LEVELS = 15


def slipping_slope(stance: Stance, polytope: WrenchPolytope, mass: float) -> str | None:
    """Message that the friction is too low to stand still on the slopes of a stance, or None."""
    if any(contact.kind is ContactKind.GRASP for contact in stance) or not len(stance):
        return None
    slopes = [(float(np.arccos(np.clip(contact.normal[2], -1.0, 1.0))), contact) for contact in stance]
    if not all(np.tan(angle) > contact.friction for angle, contact in slopes):
        return None
    try:
        if len(admissible_com_polygon(polytope, mass)):
            return None
    except InputError:
        return None
    angle, contact = min(slopes, key=lambda item: item[0])
    return (
        f"nobody can stand on {', '.join(stance.effectors)}: a slope of {np.degrees(angle):.1f} degrees "
        f"needs a friction of at least {np.tan(angle):.2f}, {contact.effector} has {contact.friction:g}"
    )


def low_friction(
    stances: Sequence[Stance], problem: CentroidalProblem,
    measure: Callable[[Sequence[WrenchPolytope]], float], unit: str,
) -> str:  # fmt: skip
    """Message that firm friction would give some stances the required margin; empty where it would not.

    Args:
        measure: Gives their margin from their polytopes.
        unit: Of that margin; where it is not the problem's, any margin counts as enough.
    """
    least, required = least_friction(stances), problem.required_margin
    if least < FIRM_FRICTION:
        value = measure(wrench_polytopes([_firm(s) for s in stances], reference=problem.reference))
        if value > (required if unit == problem.margin_unit else VANISHING_MARGIN):
            firm = f"{FIRM_FRICTION:g} it would be {value:.2f} {unit}"
            return f"; the friction of {least:g} is too low: with {firm}"
    return ""


def least_friction(stances: Sequence[Stance]) -> float:
    """Least coefficient of the soles and points of some stances; infinite without any."""
    return min((c.friction for s in stances for c in s if c.kind is not ContactKind.GRASP), default=np.inf)


def with_firm_friction(problem: CentroidalProblem) -> CentroidalProblem:
    """Problem with the friction of every contact raised to :data:`FIRM_FRICTION` at least."""
    phases = [replace(phase, stance=_firm(phase.stance)) for phase in problem.sequence]
    return replace(problem, sequence=StanceSequence(phases))


def _firm(stance: Stance) -> Stance:
    return stance.with_contacts([
        c if c.kind is ContactKind.GRASP else replace(c, friction=max(c.friction, FIRM_FRICTION))
        for c in stance
    ])  # fmt: skip


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


ROUNDING = 1e-9
"""Slack given to comparisons of given lengths and times [m], [s]."""

VANISHING_MARGIN = 1e-6
"""Margins up to this are none, as free fall has everywhere ([Qiu2012]_ 5.21) [N.m] or [N]."""


@dataclass(frozen=True)
class Failure:
    """Why there is no trajectory.

    Attributes:
        requirement: Short name of what cannot be met: ``"durations"``, ``"weight"``, ``"intersection"``,
            ``"start balance"``, ``"goal balance"``, ``"friction"``, ``"support distance"``, ``"reach"``,
            ``"balance margin"`` or the name of a geometric constraint.
        reason: One sentence with the numbers.
        phase: Index of the phase, or None when it concerns the whole motion.
        time: Instant in the last attempt [s], or None when nothing was attempted.
        where: Contacts or place concerned.
    """

    requirement: str
    reason: str
    phase: int | None = None
    time: float | None = None
    where: str = ""


@dataclass(frozen=True, eq=False)
class Feasibility:
    """Intersections of consecutive polytopes and the first thing that cannot work.

    Attributes:
        radii: (phases - 1,) upper bound of the margin at each key instant, see :func:`margin_bounds`; about
            the world origin, the radius of the largest ball inside each intersection [N.m]. Negative
            when the intersection is empty.
        failure: Why the problem has no solution, or None when that cannot be excluded.
    """

    radii: FloatArray
    failure: Failure | None

    @property
    def radius(self) -> float:
        """Difficulty of the problem and upper bound of d_min [N.m] (Proposition 2); inf for one phase."""
        return float(self.radii.min(initial=np.inf))


def polytopes_of(problem: CentroidalProblem) -> tuple[WrenchPolytope, ...]:
    """W_i of every phase about ``problem.reference`` ([Qiu2012]_ 5.4.1; n_t polytopes for n_t phases)."""
    return wrench_polytopes([phase.stance for phase in problem.sequence], reference=problem.reference)


def intersection_radii(polytopes: Sequence[Polytope]) -> FloatArray:
    """Radius of the largest ball inside each consecutive intersection ([Qiu2012]_ 2.25, Propositions 1-2).

    The thesis says Chebyshev ball; the *inscribed* one is meant. An empty intersection has the (negative)
    radius by which the facets would have to move out.

    Returns:
        (n - 1,) of the W_i of n phases.
    """
    return np.array([_largest_distance(*both, np.ones(len(both[1]))) for both in _intersections(polytopes)])


def _intersections(polytopes: Sequence[Polytope]) -> Iterator[tuple[FloatArray, FloatArray]]:
    both = (a.intersection(b) for a, b in itertools.pairwise(polytopes))
    return ((polytope.H, polytope.h) for polytope in both)


def margin_bounds(polytopes: Sequence[Polytope]) -> FloatArray:
    """Upper bound of the margin about the CoM at each key instant, wherever the CoM is (our own).

    The margin at ``x`` is the least of ``d_i / hypot(|H1 + H2 x^|, |H2|)`` over the rows of both
    polytopes. No ``x`` makes the force part of such a screw shorter than the part along its moment, ``|H1 .
    H2| / |H2|``: with these least lengths the bound is a linear programme in the wrench. It takes the place
    of the largest ball of Proposition 2 ([Qiu2012]_ 5.4.3), which is about a fixed point. Like that one it
    is necessary, not sufficient.

    Returns:
        (n - 1,) of the W_i of n phases about one point [N.m]; negative when no wrench is in both polytopes.
    """
    return np.array([_largest_distance(*both, _least_lengths(both[0])) for both in _intersections(polytopes)])


def _least_lengths(H: FloatArray) -> FloatArray:
    """(m,) least length of rows with moments about any point."""
    force, moment = H[:, :3], np.linalg.norm(H[:, 3:], axis=1)
    turning = moment > 1e-9
    along = np.abs(np.einsum("ij,ij->i", force, H[:, 3:])) / np.where(turning, moment, 1.0)
    return np.hypot(np.where(turning, along, np.linalg.norm(force, axis=1)), moment)


def assess_feasibility(problem: CentroidalProblem, polytopes: Sequence[Polytope]) -> Feasibility:
    """Test everything that needs no optimisation, from the W_i of the phases about ``problem.reference``.

    Durations, reach of the contacts of each phase, end points, whether any phase lifts the weight, friction
    at both ends, emptiness of the intersections (Proposition 1), the bound of the margin in them against the
    required one (Proposition 2), and whether any acceleration balances the CoM at the ends.
    """
    radii, last = _bounds(problem, polytopes), len(problem.sequence) - 1
    failure = (
        _duration_failure(problem)
        or _reach_failure(problem)
        or _apart_failure(problem)
        or misplaced(problem, problem.start_com, (0,), "start CoM")
        or misplaced(problem, problem.goal_com, (last,), "goal CoM")
        or _weight_failure(problem, polytopes)
        or _slope_failure(problem, polytopes)
        or _intersection_failure(problem, radii)
        or _end_balance_failure(problem, polytopes)
    )
    return Feasibility(radii, failure)


def _bounds(problem: CentroidalProblem, polytopes: Sequence[Polytope]) -> FloatArray:
    """Upper bounds of the margin at the key instants; of forces only the sign counts."""
    if problem.margin_space != "wrench_about_origin":
        return margin_bounds(polytopes)
    return intersection_radii([Polytope(rows_about(P.H, -problem.reference), P.h) for P in polytopes])


def _largest_distance(H: FloatArray, h: FloatArray, lengths: FloatArray) -> float:
    """Largest ``d`` with ``H x + lengths d <= h`` at some x; negative when the polytope is empty."""
    cost = np.append(np.zeros(H.shape[1]), -1.0)
    result = linprog(cost, np.column_stack([H, lengths]), h, bounds=(None, None), method="highs")
    return float(result.x[-1]) if result.success else np.inf


def _duration_failure(problem: CentroidalProblem) -> Failure | None:
    shortest = float(problem.min_durations.sum())
    if problem.max_duration is None or shortest <= problem.max_duration + ROUNDING:
        return None
    return Failure(
        "durations",
        f"the phases last at least {shortest:.3f} s together, longer than max_duration "
        f"{problem.max_duration:.3f} s",
    )


def misplaced(
    problem: CentroidalProblem, com: FloatArray, phases: Sequence[int], what: str, tolerance: float = ROUNDING
) -> Failure | None:
    """Failure of a CoM (3,) [m] that is too far from a contact or breaks a constraint in a phase, or None.

    ``what`` is the position in words, and a violation up to the tolerance [m] counts as none.
    """
    limit = np.inf if problem.support_distance is None else problem.support_distance
    for phase in phases:
        for contact in problem.sequence[phase].stance:
            distance, where = float(np.linalg.norm(com - contact.position)), contact.effector
            if distance > limit + tolerance:
                reason = f"{what} is {distance:.3f} m from {where}, out of reach: the limit is {limit:.3f} m"
                return Failure("support distance", reason, phase, where=where)
    for phase in phases if problem.regions else ():
        region = problem.regions[phase]
        if region is not None and (beyond := float(region.violation(com))) > tolerance:
            where = ", ".join(problem.sequence[phase].stance.effectors)
            reason = f"{what} is {beyond:.3f} m out of this body's reach on {where} in phase {phase}"
            return Failure("reach", reason, phase, where=where)
    for constraint in problem.geometric:
        if (violation := float(constraint.violation(com))) > tolerance:
            reason = f"{what} violates '{constraint.name}' by {violation:.4f} m"
            return Failure(constraint.name, reason, phases[-1])
    return None


def _reach_failure(problem: CentroidalProblem) -> Failure | None:
    """Failure of a phase in which no CoM near enough to all contacts keeps the constraints, or None."""
    limit = problem.support_distance
    for index, phase in enumerate(problem.sequence):
        stance = phase.stance
        if limit is None or len(stance) < 2:
            continue
        missing = _least_miss(problem, np.array([contact.position for contact in stance]), limit)
        if missing > REACH_TOLERANCE:
            apart, first, second = max(
                (float(np.linalg.norm(a.position - b.position)), a.effector, b.effector)
                for b, a in itertools.combinations(stance, 2)
            )
            reason = (
                f"the step is too long: {second} and {first} are {apart:.2f} m apart in phase {index}, and "
                f"no centre of mass within {limit:.3f} m of both keeps the constraints on it "
                f"(it misses them by {missing:.2f} m)"
            )
            return Failure("support distance", reason, index, where=", ".join(stance.effectors))
    return None


def _apart_failure(problem: CentroidalProblem) -> Failure | None:
    """Failure of a change of contacts at which no CoM is in the regions of both phases, or None."""
    for key, (before, after) in enumerate(itertools.pairwise(problem.regions), start=1):
        if before is None or after is None:
            continue
        rows, bounds = np.vstack([before.normals, after.normals]), np.append(before.offsets, after.offsets)
        both = Polytope(rows, bounds)
        room = _largest_distance(both.H, both.h, np.ones(len(both)))
        if room < -REACH_TOLERANCE:
            stances = (problem.sequence[key - 1].stance, problem.sequence[key].stance)
            where = ", ".join(dict.fromkeys(name for stance in stances for name in stance.effectors))
            reason = (
                f"no centre of mass is in this body's reach both before and after the change at T_{key}, on "
                f"{where}: the two regions are {-2.0 * room:.2f} m apart"
            )
            return Failure("reach", reason, key, where=where)
    return None


def _slope_failure(problem: CentroidalProblem, polytopes: Sequence[Polytope]) -> Failure | None:
    for index in (0, len(problem.sequence) - 1):
        stance, polytope = problem.sequence[index].stance, polytopes[index]
        if isinstance(polytope, WrenchPolytope):
            reason = slipping_slope(stance, polytope, problem.mass)
            if reason is not None:
                return Failure("friction", reason, index, where=", ".join(stance.effectors))
    return None


def _weight_failure(problem: CentroidalProblem, polytopes: Sequence[Polytope]) -> Failure | None:
    """From rest to rest the mean vertical force is the weight, so some phase must be able to exceed it."""
    start, goal = problem.start_velocity, problem.goal_velocity
    if start is None or goal is None or goal[2] < start[2]:
        return None
    weight = problem.mass * GRAVITY
    lifts = [_largest_lift(polytope) for polytope in polytopes]
    best = int(np.argmax(lifts))
    if lifts[best] >= weight:
        return None
    stance = problem.sequence[best].stance
    rubbing = [contact for contact in stance if contact.friction > 0.0 and abs(contact.normal[2]) < 0.1]
    cause = "the caps on the normal forces are too small"
    if rubbing and len(rubbing) == len(stance):
        squeeze = sum(contact.normal_force_cap or 0.0 for contact in rubbing)
        pressed = f" pressed with {squeeze:.0f} N in all" if squeeze else ""
        friction = min(contact.friction for contact in rubbing)
        cause = (
            f"on walls only friction carries, and a friction of {friction:g}{pressed} is too small: "
            "more friction or a stronger squeeze is needed"
        )
    reason = (
        f"the contacts push up with {lifts[best]:.0f} N at most, in phase {best}, and the body weighs "
        f"{weight:.0f} N; {cause}"
    )
    return Failure("weight", reason, best, where=", ".join(stance.effectors))


def _largest_lift(polytope: Polytope) -> float:
    """Largest upward force of any admissible wrench [N]."""
    cost = np.zeros(polytope.dimension)
    cost[2] = -1.0
    result = linprog(cost, polytope.H, polytope.h, bounds=(None, None), method="highs")
    return -float(result.fun) if result.success else np.inf


def _intersection_failure(problem: CentroidalProblem, radii: FloatArray) -> Failure | None:
    for index, radius in enumerate(radii):
        where = f"phases {index} and {index + 1}"
        if radius < -VANISHING_MARGIN:
            reason = f"no wrench is admissible in both of {where}: their polytopes do not meet"
            reason += " (Proposition 1)"
        elif problem.margin_space != "force" and radius <= max(problem.required_margin, VANISHING_MARGIN):
            reason = (
                f"the margin between {where} is at most {radius:.2f} N.m for any wrench in both polytopes "
                f"(Proposition 2); required {problem.required_margin:.2f} N.m"
            )
        else:
            continue
        stances = [problem.sequence[number].stance for number in (index, index + 1)]
        reason += low_friction(stances, problem, lambda firm: float(_bounds(problem, firm).min()), "N.m")
        return Failure("intersection", reason, index, where=where)
    return None


def _end_balance_failure(problem: CentroidalProblem, polytopes: Sequence[Polytope]) -> Failure | None:
    for name, phase in (("start", 0), ("goal", len(problem.sequence) - 1)):
        end = problem, getattr(problem, f"{name}_com"), getattr(problem, f"{name}_acceleration")
        margin = best_margin_at(polytopes[phase], *end)
        if margin <= max(problem.required_margin, VANISHING_MARGIN):
            stance = problem.sequence[phase].stance
            held, what = ", ".join(stance.effectors), "cannot be balanced"
            if margin > VANISHING_MARGIN:
                what = f"reaches a margin of at most {margin:.2f} {problem.margin_unit}"
            reason = (
                f"{name} CoM {np.round(end[1], 3).tolist()} {what} on {held or 'no contact'}; "
                f"required {problem.required_margin:g} {problem.margin_unit}"
            )
            reason += low_friction(
                [stance], problem, lambda firm, end=end: best_margin_at(firm[0], *end), problem.margin_unit
            )
            return Failure(f"{name} balance", reason, phase, where=held)
    return None


def best_margin_at(
    polytope: Polytope, problem: CentroidalProblem, com: FloatArray, acceleration: FloatArray | None
) -> float:
    """Largest margin at a CoM position over all accelerations, or with the given one.

    At a fixed position the pseudo-wrench is linear in the acceleration: a linear programme.
    """
    slopes, arm = row_slopes(polytope, problem, com), com - problem.reference
    still = polytope.distances(pseudo_wrench(problem.mass, arm, np.zeros(3)))
    gain = problem.mass * np.vstack([np.eye(3), skew(arm)])
    if acceleration is not None:
        return float(np.min((still - polytope.H @ gain @ acceleration) / slopes))
    return _largest_distance(polytope.H @ gain, still, slopes)


def row_slopes(polytope: Polytope, problem: CentroidalProblem, com: FloatArray) -> FloatArray:
    """(..., m) change of each row per unit of the problem's margin at CoM positions (..., 3).

    Its length with moments about the CoM, or about the world origin; ``|H1 + H2 p^|`` for forces. The
    polytope is about ``problem.reference``.
    """
    place = np.asarray(com, dtype=np.float64)
    point = np.zeros_like(place) if problem.margin_space == "wrench_about_origin" else place
    arm = (point - problem.reference).reshape(-1, 3)
    lengths = force_levers if problem.margin_space == "force" else wrench_levers
    return np.maximum(lengths(polytope.H, arm), 1e-12).reshape(*place.shape[:-1], len(polytope.h))
