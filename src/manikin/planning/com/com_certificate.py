"""Every requirement of a trajectory measured afresh, every millisecond, without the solver."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.balance import WrenchPolytope, least_zmp_distance
from manikin.kinematics.com_reach import ComRegion
from manikin.numerics.spatial import FloatArray
from manikin.planning.com.com_problem import CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.feasibility import row_slopes
from manikin.runtime.requirement import Requirement, RequirementTable, requirement_table

STEP = 1e-3
"""Distance of the instants at which a trajectory is measured [s]."""

TOLERANCE = 1e-6
"""Violation up to which a requirement counts as met [SI unit of the requirement]."""

_BLOCK = 1024

UNIT_SCALE = {"m": 0.01, "m/s": 0.01, "m/s^2": 0.1, "s": 0.01, "N.m": 10.0, "N": 100.0}
"""Violations that are about equally bad, to compare requirements of different units."""


@dataclass(frozen=True)
class Residual:
    """Largest violation of one requirement.

    Attributes:
        requirement: ``"balance margin"``, ``"support distance"``, ``"reach"``, ``"phase duration"``,
            ``"total duration"``, ``"start position"``, ... or the name of a geometric constraint.
        value: Largest violation [``unit``]; negative is what is left to spare.
        phase: Where it happens, or None for the whole motion.
        time: When it happens [s], or None.
    """

    requirement: str
    value: float
    unit: str
    phase: int | None = None
    time: float | None = None

    @property
    def severity(self) -> float:
        """Violation in units of :data:`UNIT_SCALE`."""
        return self.value / UNIT_SCALE[self.unit]

    def __str__(self) -> str:
        place = "" if self.phase is None else f" in phase {self.phase}"
        instant = "" if self.time is None else f" at {self.time:.3f} s"
        return f"{self.requirement} violated by {self.value:.3g} {self.unit}{place}{instant}"


@dataclass(frozen=True)
class Residuals:
    """Violations of all requirements and the smallest margin.

    Attributes:
        items: One entry per requirement.
        min_margin: Smallest margin [N.m] or [N].
        limiting_phase: Phase of the smallest margin.
        limiting_time: Instant of the smallest margin [s].
        min_zmp_distance: Least distance of the ZMP to the edge of the support polygon, negative
            outside [m]; of the phases whose contacts lie in one plane, None without any.
    """

    items: tuple[Residual, ...]
    min_margin: float
    limiting_phase: int
    limiting_time: float
    min_zmp_distance: float | None = None

    def __getitem__(self, requirement: str) -> Residual:
        for item in self.items:
            if item.requirement == requirement:
                return item
        raise KeyError(f"no residual {requirement!r}; valid: {[item.requirement for item in self.items]}")

    @property
    def largest(self) -> Residual:
        """The most violated requirement, units compared by :data:`UNIT_SCALE`."""
        return max(self.items, key=lambda item: item.severity)

    def within(self, tolerance: float = TOLERANCE) -> bool:
        """Whether every requirement is met."""
        return all(item.value <= tolerance for item in self.items)

    def table(self, problem: CentroidalProblem) -> RequirementTable:
        """The margin, the total duration, and the most violated of the other requirements of a problem."""
        others = [item for item in self.items if item.requirement not in ("balance margin", "total duration")]
        worst = max(others, key=lambda item: item.severity, default=None)
        duration = next((item for item in self.items if item.requirement == "total duration"), None)
        longest = problem.max_duration
        return requirement_table([
            Requirement("min_margin", "margin of the centre of mass", problem.margin_unit, self.min_margin,
                        ">=", problem.required_margin, self.limiting_time, f"phase {self.limiting_phase}",
                        TOLERANCE),
            None if duration is None or longest is None
            else Requirement("duration_s", "duration", "s", duration.value + longest, "<=", longest,
                             tolerance=TOLERANCE),
            None if worst is None
            else Requirement("max_violation", "violation of a constraint", worst.unit, max(worst.value, 0.0),
                             "<=", TOLERANCE, worst.time, worst.requirement),
        ])  # fmt: skip

    @property
    def rank(self) -> tuple[float, float]:
        """Order of quality, the smaller the better: worst of the other violations, then the margin.

        Violations within :data:`TOLERANCE` count as none.
        """
        others = [item for item in self.items if item.requirement != "balance margin"]
        worst = max((item.severity for item in others if item.value > TOLERANCE), default=0.0)
        return worst, -self.min_margin


def phase_times(trajectory: CentroidalTrajectory) -> list[FloatArray]:
    """Instants of each phase: both its ends and every multiple of :data:`STEP` between them [s]."""
    times = []
    for start, end in itertools.pairwise(trajectory.schedule.instants):
        grid = STEP * np.arange(np.floor(start / STEP) + 1, np.ceil(end / STEP))
        times.append(np.concatenate([[start], grid[(grid > start) & (grid < end)], [end]]))
    return times


def phase_margins(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> list[FloatArray]:
    """Margin at the instants of :func:`phase_times`; at key instants in both polytopes [N.m] or [N]."""
    blocks = facet_margins(problem, trajectory, polytopes)
    return [np.concatenate([block.min(axis=1) for block in phase]) for phase in blocks]


def facet_margins(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> Iterator[Iterator[FloatArray]]:
    """Of each phase (n, facets) distances to the facets at :func:`phase_times`, in blocks [N.m] or [N]."""

    def blocks(phase: int, polytope: WrenchPolytope, times: FloatArray) -> Iterator[FloatArray]:
        for part in np.split(times, range(_BLOCK, len(times), _BLOCK)):
            distances = polytope.distances(trajectory.pseudo_wrench(part, problem.reference, phase))
            yield distances / row_slopes(polytope, problem, trajectory.position(part))

    pairs = zip(polytopes, phase_times(trajectory), strict=True)
    return (blocks(phase, *pair) for phase, pair in enumerate(pairs))


def measure(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> Residuals:
    """Measure every requirement of ``problem`` on any trajectory through as many phases.

    The polytopes W_i of the phases are about ``problem.reference``.
    """
    times = phase_times(trajectory)
    margins = phase_margins(problem, trajectory, polytopes)
    lowest = [float(values.min()) for values in margins]
    phase = int(np.argmin(lowest))
    time = float(times[phase][np.argmin(margins[phase])])
    lack, unit = problem.required_margin - lowest[phase], problem.margin_unit
    balance = Residual("balance margin", lack, unit, phase, time)
    items = (balance, *_end_residuals(problem, trajectory), *_residuals(problem, trajectory, times))
    zmp = least_zmp_distance(
        (part.stance, trajectory.pseudo_wrench(instants, phase=number))
        for number, (part, instants) in enumerate(zip(problem.sequence, times, strict=True))
    )
    return Residuals(items, lowest[phase], phase, time, zmp)


def _end_residuals(problem: CentroidalProblem, trajectory: CentroidalTrajectory) -> Iterator[Residual]:
    units = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
    for end, time, phase in (("start", 0.0, 0), ("goal", trajectory.duration, len(problem.sequence) - 1)):
        for name, unit in units.items():
            value = getattr(problem, f"{end}_{'com' if name == 'position' else name}")
            if value is not None:
                error = float(np.abs(getattr(trajectory, name)(time) - value).max())
                yield Residual(f"{end} {name}", error, unit, phase, time)


def position_excess(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, times: Sequence[FloatArray]
) -> Iterator[tuple[str, list[FloatArray]]]:
    """Name of each constraint on the position and its violation at the instants of each phase [m]."""
    positions = [trajectory.position(instants) for instants in times]
    if problem.support_distance is not None:
        excess = []
        for p, phase in zip(positions, problem.sequence, strict=True):
            away = [np.linalg.norm(p - c.position, axis=1) for c in phase.stance] or [np.zeros(len(p))]
            excess.append(np.max(away, axis=0) - problem.support_distance)
        yield "support distance", excess
    if problem.regions:
        regions = [region or ComRegion.everywhere() for region in problem.regions]
        yield "reach", [region.violation(p) for p, region in zip(positions, regions, strict=True)]
    for constraint in problem.geometric:
        yield constraint.name, [constraint.violation(p) for p in positions]


def _residuals(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, times: list[FloatArray]
) -> Iterator[Residual]:
    """Those of positions, then those of durations."""
    for requirement, excess in position_excess(problem, trajectory, times):
        phase = int(np.argmax([values.max() for values in excess]))
        worst = int(np.argmax(excess[phase]))
        yield Residual(requirement, float(excess[phase][worst]), "m", phase, float(times[phase][worst]))
    for index, plane in enumerate(problem.key_planes):
        time = float(trajectory.schedule.instants[plane.key])
        beyond = plane.violation(trajectory.position(time) + plane.lead * trajectory.velocity(time))
        yield Residual(f"key plane {index} at T_{plane.key}", float(beyond), "m", plane.key - 1, time)
    durations, instants = trajectory.schedule.durations, trajectory.schedule.instants
    excess = np.maximum(problem.min_durations - durations, durations - problem.max_durations)
    phase = int(np.argmax(excess))
    yield Residual("phase duration", float(excess[phase]), "s", phase, float(instants[phase]))
    if problem.max_duration is not None:
        yield Residual("total duration", trajectory.duration - problem.max_duration, "s")
