"""One optimisation of the timing-free method: from a guess to a measured attempt.

Few facets of the polytopes limit a motion. The programme is given the nearest ones only, and every solution
is measured against all of them; facets found violated are added and the programme is solved again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from manikin.balance import WrenchPolytope
from manikin.contact import ContactSchedule
from manikin.numerics.spatial import FloatArray
from manikin.planning.com.com_certificate import TOLERANCE, Residuals, facet_margins, measure, phase_times
from manikin.planning.com.com_problem import END_CONDITIONS, CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.feasibility import row_slopes
from manikin.planning.com.transcription import (
    MARGIN_SCALE,
    ComProgram,
    ComStructure,
    spline_from_bezier,
    transcribe,
    written,
)

FIRST_COUNT, FIRST_FACES = 12, 6
"""Facets, and faces of the region, per phase in the first round. Without faces there may be no optimum."""

Rows = tuple[NDArray[np.int64], ...]
"""Indices of the chosen facets of each phase's polytope, or faces of its region."""


def facet_distances(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> list[FloatArray]:
    """Least distance of the pseudo-wrench from every facet of each phase [N.m] or [N]."""
    blocks = facet_margins(problem, trajectory, polytopes)
    return [np.min([block.min(axis=0) for block in phase], axis=0) for phase in blocks]


def nearest_facets(distances: Sequence[FloatArray], count: int = FIRST_COUNT) -> Rows:
    """Indices of the ``count`` facets with the smallest distances in each phase, in facet order."""
    return tuple(np.sort(np.argsort(values, kind="stable")[:count]) for values in distances)


def with_violated(
    chosen: Rows, distances: Sequence[FloatArray], margin: float, step: int = FIRST_COUNT // 2
) -> Rows:
    """Add to each phase up to ``step`` nearest facets left out so far if one is nearer than ``margin``.

    ``distances`` are those of the last solution, see :func:`facet_distances` [N.m] or [N].
    """
    grown = []
    for indices, values in zip(chosen, distances, strict=True):
        left_out = np.setdiff1d(np.arange(len(values)), indices)
        order = left_out[np.argsort(values[left_out], kind="stable")]
        added = order[:step] if len(order) and values[order[0]] < margin else order[:0]
        grown.append(np.sort(np.concatenate([indices, added])))
    return tuple(grown)


def nearest_faces(problem: CentroidalProblem, trajectory: CentroidalTrajectory) -> Rows:
    """Indices of the :data:`FIRST_FACES` faces of each phase's region to which a trajectory is nearest."""
    beyond = _beyond_faces(problem, trajectory)
    return tuple(np.sort(np.argsort(-values, kind="stable")[:FIRST_FACES]) for values in beyond)


def with_broken_faces(problem: CentroidalProblem, trajectory: CentroidalTrajectory, chosen: Rows) -> Rows:
    """Add to each phase the faces of its region that a trajectory breaks, or is about to break."""
    return tuple(
        np.union1d(faces, np.flatnonzero(beyond > -FACE_ROOM)) if (beyond > TOLERANCE).any() else faces
        for faces, beyond in zip(chosen, _beyond_faces(problem, trajectory), strict=True)
    )


def _beyond_faces(problem: CentroidalProblem, trajectory: CentroidalTrajectory) -> list[FloatArray]:
    """How far a trajectory gets beyond each face of each phase's region [m]; empty where there is none."""
    return [
        np.zeros(0) if region is None or region.empty
        else (trajectory.position(times) @ region.normals.T - region.offsets).max(axis=0)
        for region, times in zip(problem.regions, phase_times(trajectory), strict=False)
    ]  # fmt: skip


FACE_ROOM = 0.02
"""Room that a face has left where it is imposed along with broken ones [m]."""

SHORTFALL_WEIGHT = 20.0
"""Exact penalty of a margin below the required one [1/(N.m)] or [1/N]."""

DURATION_ROOM = 1e-7
"""Distance kept from the total duration [s]."""

LONGEST_PHASE = 20.0
"""Bound of a phase's duration where the problem gives none [s]; without it waiting has no end."""


@dataclass(frozen=True)
class MarginTargets:
    """Bounds that the programme keeps at its samples, a little stricter than those of the problem.

    Attributes:
        margin: Smallest margin [N.m] or [N].
        position: Distance kept from the geometric constraints and the support distance [m].
    """

    margin: float
    position: float = 3e-4

    @classmethod
    def of(cls, problem: CentroidalProblem) -> "MarginTargets":
        """Targets of the first round; the ends may lie closer to the constraints than the rest."""
        room, limit = [], problem.support_distance
        for end, com in ((0, problem.start_com), (-1, problem.goal_com)):
            room += [-float(item.violation(com)) for item in problem.geometric]
            if limit is not None:
                stance = problem.sequence[end].stance
                room += [limit - float(np.linalg.norm(com - contact.position)) for contact in stance]
            if problem.regions and (region := problem.regions[end]) is not None:
                room.append(-float(region.violation(com)))
        position = min([cls.position, *(0.5 * max(slack, 0.0) for slack in room)])
        return cls(problem.required_margin + 1e-3, position)

    def grown(self, problem: CentroidalProblem, certificate: Residuals) -> "MarginTargets":
        """Targets that make up for what the last solution broke between its samples."""
        names = {"support distance", "reach", *(constraint.name for constraint in problem.geometric)}
        measured = names & {item.requirement for item in certificate.items}
        position = max((certificate[name].value for name in measured), default=0.0)
        missing = certificate["balance margin"].value
        return replace(
            self,
            margin=self.margin + (1.6 * missing + 1e-3 if missing > 0.0 else 0.0),
            position=self.position + (1.2 * position + 1e-5 if position > TOLERANCE else 0.0),
        )


@dataclass(frozen=True, eq=False)
class Attempt:
    """Outcome of one optimisation, measured every millisecond against the whole problem.

    Attributes:
        bezier: (phases, k + 1, 3) Bezier points [m], to start again from.
        durations: (phases,) [s].
        margin: d_min at the samples over the imposed facets [N.m] or [N].
        converged: Whether the solver reports an optimum.
    """

    trajectory: CentroidalTrajectory
    certificate: Residuals
    bezier: FloatArray
    durations: FloatArray
    iterations: int
    margin: float
    converged: bool


def build_programme(problem: CentroidalProblem, facets: Rows, faces: Rows = ()) -> ComProgram:
    """The compiled optimisation of a problem, shared by all problems of the same structure."""
    phases = problem.sequence
    structure = ComStructure(
        problem.degree, problem.samples, rows=tuple(map(len, facets)),
        contacts=tuple(len(phase.stance) for phase in phases), margin_space=problem.margin_space,
        geometric=tuple(written(constraint.function) for constraint in problem.geometric),
        limited_distance=problem.support_distance is not None,
        key_planes=tuple((plane.key, plane.lead) for plane in problem.key_planes),
        loaded=tuple(number for number, phase in enumerate(phases) if phase.load is not None),
        reach=tuple(map(len, faces)),
    )  # fmt: skip
    return transcribe(structure)


def optimise(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], facets: Rows, targets: MarginTargets,
    bezier: FloatArray, durations: FloatArray, faces: Rows = (),
) -> Attempt:  # fmt: skip
    """Run the solver once from Bezier points (phases, k + 1, 3) [m] and durations (phases,) [s].

    The W_i of the phases are about ``problem.reference``; facets and faces of the regions are those imposed.
    """
    programme = build_programme(problem, facets, faces)
    lower, upper = _unknown_bounds(programme, problem)
    row_lower, row_upper = _row_bounds(programme, problem, targets)
    unknowns = programme.pack_unknowns(
        bezier - problem.reference, durations, float(durations.sum()), problem.required_margin, 10.0
    )
    solution = programme.solver(
        x0=np.clip(unknowns, lower, upper),
        p=programme.pack_parameters(_parameters(problem, polytopes, facets, faces)),
        lbx=lower, ubx=upper, lbg=row_lower, ubg=row_upper,
    )  # fmt: skip
    local, durations, margin = programme.unpack_unknowns(np.asarray(solution["x"], dtype=np.float64).ravel())
    bezier = local + problem.reference
    trajectory = trajectory_of(problem, bezier, durations)
    stats = programme.solver.stats()
    return Attempt(
        trajectory, measure(problem, trajectory, polytopes),
        bezier, durations, int(stats["iter_count"]), margin, bool(stats["success"]),
    )  # fmt: skip


def _parameters(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], facets: Rows, faces: Rows = ()
) -> dict[str, object]:
    weights, reference = problem.weights, problem.reference
    values: dict[str, object] = {
        "mass": problem.mass, "reference": reference,
        "weights": (weights.margin, weights.smoothness, weights.duration, SHORTFALL_WEIGHT),
        "velocity": weights.velocity, "acceleration": weights.acceleration, "jerk": weights.jerk,
    }  # fmt: skip
    for name in END_CONDITIONS:
        value = getattr(problem, name)
        values[name] = np.zeros(3) if value is None else value
    for index, (phase, polytope, rows) in enumerate(zip(problem.sequence, polytopes, facets, strict=True)):
        # About the world origin the rows have one length all along; then they are given with length 1.
        fixed = problem.margin_space == "wrench_about_origin"
        length = row_slopes(polytope, problem, problem.start_com)[rows] if fixed else np.ones(len(rows))
        values[f"H{index}"] = polytope.H[rows] / length[:, None]
        values[f"h{index}"] = polytope.h[rows] / length
        values[f"contacts{index}"] = [contact.position - reference for contact in phase.stance]
        if phase.load is not None:
            values[f"load{index}"] = (phase.load.mass, *phase.load.offset)
    for index, (region, rows) in enumerate(zip(problem.regions, faces, strict=False)):
        if region is not None and len(rows):
            values[f"faces{index}"] = region.normals[rows]
            values[f"ends{index}"] = region.offsets[rows] - region.normals[rows] @ reference
    for index, plane in enumerate(problem.key_planes):
        values[f"normal{index}"] = plane.normal
        values[f"offset{index}"] = plane.offset - plane.normal @ reference
    return values


def _unknown_bounds(programme: ComProgram, problem: CentroidalProblem) -> tuple[FloatArray, FloatArray]:
    phases, k = programme.structure.phases, programme.structure.degree
    low, high = (np.full((phases, k + 1, 3), bound) for bound in (-np.inf, np.inf))
    for bound in (low, high):
        bound[0, 0] = problem.start_com - problem.reference
        bound[-1, -1] = problem.goal_com - problem.reference
    total = np.inf if problem.max_duration is None else problem.max_duration - DURATION_ROOM
    lower = programme.pack_unknowns(low, problem.min_durations, 0.0, -np.inf, 0.0)
    longest = np.maximum(LONGEST_PHASE, 2.0 * problem.min_durations)
    upper = programme.pack_unknowns(high, np.minimum(problem.max_durations, longest), total, np.inf, np.inf)
    return lower, upper


def _row_bounds(
    programme: ComProgram, problem: CentroidalProblem, targets: MarginTargets
) -> tuple[FloatArray, FloatArray]:
    limit = (problem.support_distance or 0.0) - targets.position
    bounds = {
        "balance": (0.0, np.inf), "distance": (-np.inf, limit**2), "continuity": (0.0, 0.0),
        "key_plane": (-np.inf, 0.0), "reach": (-np.inf, -targets.position), "total_duration": (0.0, 0.0),
        "required_margin": (targets.margin / MARGIN_SCALE[problem.margin_space], np.inf),
    }  # fmt: skip
    ends, rows = iter(END_CONDITIONS), []
    for group, _ in programme.groups:
        if group == "end":
            free = getattr(problem, next(ends)) is None
            rows.append((-np.inf, np.inf) if free else (0.0, 0.0))
        else:
            rows.append(bounds["reach" if group.startswith("geometric") else group])
    lower, upper = np.repeat(np.transpose(rows), [count for _, count in programme.groups], axis=1)
    return lower, upper


def trajectory_of(
    problem: CentroidalProblem, bezier: FloatArray, durations: FloatArray
) -> CentroidalTrajectory:
    """The trajectory of Bezier points (phases, k + 1, 3) and durations, ends and bounds met exactly."""
    durations = np.clip(durations, problem.min_durations, problem.max_durations)
    spline = spline_from_bezier(
        bezier, durations,
        start=(problem.start_com, problem.start_velocity, problem.start_acceleration),
        goal=(problem.goal_com, problem.goal_velocity, problem.goal_acceleration),
    )  # fmt: skip
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    return CentroidalTrajectory(problem.mass, spline, ContactSchedule(problem.sequence, instants))
