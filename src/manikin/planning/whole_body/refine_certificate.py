"""Certificate of a refined motion, measured afresh on its dense samples.

Also here. What a refinement is asked for and what it finds. A refined motion at dense samples, with what is
measured on them. Balance asked of linear programs, without polytopes or generators of forces.

At each instant the contacts must supply the wrench that the whole body needs.  The program finds contact
wrenches that do so and stay as far as they can inside the limits of every contact ([Qiu2012]_ 4.2.2):

    max s   such that   sum_i G_i w_i = b,   A_i w_i + s <= b_i,   sum of normal forces + s <= cap

``s >= 0`` exactly where the margin of ``b`` in the stance's wrench polytope is not negative.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_diag, coo_array, vstack

from manikin.balance import MotionMargin
from manikin.balance.friction import contact_limits
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind, ContactSchedule, FrictionModel, Stance
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.spatial import FloatArray, finite_number, wrench_map
from manikin.planning.whole_body.contact_variables import Variables
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.refine_measures import (
    RefineMeasures,
    RefineObstacles,
    balance_of,
    sample_uniformly,
)
from manikin.planning.whole_body.refine_physics import MarginCost, centre_of
from manikin.planning.whole_body.whole_body_certificate import WholeBodyFailure, support_errors
from manikin.runtime.display import Displayed
from manikin.runtime.requirement import Requirement, RequirementTable, Sense, requirement_table
from manikin.scene import Proximity, Scene

TOGETHER = 50
"""Instants that one program holds side by side."""


def contact_slack(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> FloatArray:
    """(n,) room that the limits of all contacts have in common, in the units of their rows [N, N.m].

    Args:
        schedule: Contacts in time.
        time: (n,) [s].
        wrench: (n, 6) needed by the whole body, about the world origin.

    Returns:
        Negative where no admissible contact forces supply the wrench; minus infinity without any contact.
    """
    phases, slack = schedule.phase_at(time), np.full(len(time), -np.inf)
    for number, phase in enumerate(schedule.sequence):
        rows = np.flatnonzero(phases == number)
        if len(phase.stance) == 0:
            continue
        program = _Program(phase.stance)
        edges = [*range(0, len(rows), TOGETHER), len(rows)]
        for start, end in pairwise(edges):
            slack[rows[start:end]] = program.solve(wrench[rows[start:end]])
    return slack


class _Program:
    """The program of one stance; its unknowns are the contacts' wrenches and the slack."""

    def __init__(self, stance: Stance) -> None:
        self._centre = centre_of(stance)
        parts = [_limits(contact, stance.friction_model) for contact in stance]
        maps = [_map(contact, self._centre) for contact in stance]
        self._balance = np.hstack([*maps, np.zeros((6, 1))])
        limits = np.zeros((sum(len(part[1]) for part in parts), self._balance.shape[1]))
        row = column = 0
        for (left, right), item in zip(parts, maps, strict=True):
            width = item.shape[1]
            limits[row : row + len(right), column : column + width] = left[:, :width]
            row, column = row + len(right), column + width
        limits[:, -1] = 1.0
        bound = np.concatenate([right for _, right in parts])
        if stance.normal_force_cap is not None:
            limits, bound = self._capped(stance, maps, limits, bound)
        self._limits, self._bound = limits, bound

    def _capped(
        self, stance: Stance, maps: list[FloatArray], limits: FloatArray, bound: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        row, column = np.zeros(limits.shape[1]), 0
        for contact, item in zip(stance, maps, strict=True):
            row[column + 2] = contact.kind is not ContactKind.GRASP
            column += item.shape[1]
        row[-1] = 1.0
        return np.vstack([limits, row]), np.append(bound, stance.normal_force_cap or 0.0)

    def solve(self, wrench: FloatArray) -> FloatArray:
        """(n,) slack at wrenches (n, 6) about the world origin."""
        n, width = len(wrench), self._balance.shape[1]
        cost = np.tile(np.append(np.zeros(width - 1), -1.0), n)
        equal = block_diag([coo_array(self._balance)] * n)
        below = block_diag([coo_array(self._limits)] * n)
        wanted = (wrench @ wrench_map(self._centre).T).ravel()
        found = linprog(
            cost, A_ub=vstack([below]), b_ub=np.tile(self._bound, n), A_eq=equal, b_eq=wanted,
            bounds=(None, None), method="highs",
        )  # fmt: skip
        if found.status != 0:  # too few directions of force: no slack whatever its size
            return self._one_by_one(wrench)
        return found.x[width - 1 :: width]

    def _one_by_one(self, wrench: FloatArray) -> FloatArray:
        if len(wrench) == 1:
            return np.array([-np.inf])
        return np.concatenate([self.solve(row[None]) for row in wrench])


def _map(contact: Contact, centre: FloatArray) -> FloatArray:
    """(6, 3 or 6) from a contact's wrench in the frame of its limits to one about the centre."""
    grasped = contact.kind is ContactKind.GRASP
    rotation = np.eye(3) if grasped else contact.rotation_contact_to_world
    moved = wrench_map(centre - contact.position) @ np.kron(np.eye(2), rotation)
    forces_only = contact.kind is ContactKind.POINT or (grasped and contact.max_moment == 0.0)
    return moved[:, :3] if forces_only else moved


def _limits(contact: Contact, model: FrictionModel) -> tuple[FloatArray, FloatArray]:
    """Rows (k, 6) and bounds (k,) of a contact, without those of moments that it does not have."""
    limits = contact_limits(contact, model)
    if contact.kind is ContactKind.GRASP and contact.max_moment == 0.0:
        kept = np.any(limits.A[:, :3] != 0.0, axis=1)
        return limits.A[kept], limits.b[kept]
    return limits.A, limits.b


@dataclass(frozen=True)
class RefineRequirements:
    """What a refined motion must keep to count as a success.

    Attributes:
        support_error: Largest distance of an effector from its contact [m].
        support_turn: Largest angle of a sole from its contact [rad].
        clearance: Least distance between what is not in contact, flights away from their supports
            included [m].
        penetration: Largest depth of anything in anything but what it holds on to, flights included [m].
        joint_limit: Largest violation of a joint range [rad].
        velocity_share: Largest share of a joint's velocity limit.
        physics_violation: Largest wrench that no admissible contact force supplies [N].
        margin: Least margin of the whole body's wrench, where the stance's wrenches fill a volume [N.m].
        torque_share: Largest share of a joint's torque limit.
    """

    support_error: float = 1.0e-3
    support_turn: float = 5.0e-3
    clearance: float = 0.0
    penetration: float = 1.0e-3
    joint_limit: float = 1.0e-9
    velocity_share: float = 1.0
    physics_violation: float = 1.0
    margin: float = 0.0
    torque_share: float = 1.0


@dataclass(frozen=True)
class RefineResiduals:
    """Largest violations of a refined motion.

    Attributes:
        max_support_error_m: Distance of an effector from its contact [m].
        max_support_turn_rad: Angle of a sole from its contact [rad].
        min_clearance_m: Least counted distance [m].
        closest_pair: Names of the shapes at that distance.
        max_penetration_m: Depth of anything in anything but what it holds on to [m].
        max_joint_limit_violation_rad: Violation of a joint range [rad].
        max_velocity_share: Largest share of a joint's velocity limit.
        max_physics_violation: Wrench that no admissible contact force supplies, about the stance's mean
            contact point with 1 m [N].
        min_margin: Least margin of the whole body's wrench about the CoM, over the stances whose
            wrenches fill a volume; infinite without any [N.m].
        min_force_at_com_N: Smallest force at the CoM that would end balance, over the same stances; None
            where it was not measured or no force does [N].
        min_zmp_distance_m: Least distance of the ZMP to the edge of the support polygon [m]; None where it
            was not measured or no stance spans one plane.
        max_torque_share: Largest share of a joint's torque limit.
        tightest_joint: Name of that joint.
        worst_times_s: When each of the errors is largest [s], by field name.
    """

    max_support_error_m: float
    max_support_turn_rad: float
    min_clearance_m: float
    closest_pair: tuple[str, str]
    max_penetration_m: float
    max_joint_limit_violation_rad: float
    max_velocity_share: float
    max_physics_violation: float
    min_margin: float
    max_torque_share: float
    tightest_joint: str
    worst_times_s: dict[str, float]
    min_force_at_com_N: float | None = None
    min_zmp_distance_m: float | None = None

    def table(self, requirements: RefineRequirements) -> RequirementTable:
        """Every requirement with its measured value; keys are the names of the fields."""
        r, pair = requirements, " and ".join(self.closest_pair)
        return requirement_table([
            self._row("max_support_error_m", "support error", "m", r.support_error),
            self._row("max_support_turn_rad", "support turn", "rad", r.support_turn),
            self._row("min_clearance_m", "clearance", "m", r.clearance, ">=", pair),
            self._row("max_penetration_m", "penetration", "m", r.penetration),
            self._row("max_joint_limit_violation_rad", "joint range violation", "rad", r.joint_limit),
            self._row("max_velocity_share", "share of a velocity limit", "", r.velocity_share),
            self._row("max_physics_violation", "wrench without contact force", "N", r.physics_violation),
            None if self.min_margin == np.inf
            else self._row("min_margin", "margin of the whole body", "N.m", r.margin, ">="),
            self._row("max_torque_share", "share of a torque limit", "", r.torque_share,
                      where=self.tightest_joint),
        ])  # fmt: skip

    def _row(
        self, key: str, name: str, unit: str, limit: float, sense: Sense = "<=", where: str = ""
    ) -> Requirement:
        time = self.worst_times_s.get(key)
        return Requirement(key, name, unit, float(getattr(self, key)), sense, limit, time, where)


def certify_refined(
    body: BodyModel,
    proximity: Proximity,
    schedule: ContactSchedule,
    obstacles: RefineObstacles,
    motion: Motion,
    violation: FloatArray,
    flat: tuple[bool, ...],
) -> RefineResiduals:
    """Measure a motion against its contacts, limits and obstacles.

    Args:
        body: The body.
        proximity: Distances to the scene and within the body.
        schedule: Contacts in time.
        obstacles: What may touch at the motion's samples.
        motion: The motion, densely sampled.
        violation: (n,) its physics violation [N].
        flat: Of each phase, whether its stance's wrenches fill no volume.
    """
    support, turn = support_errors(body, schedule, motion)
    angles = motion.q[:, 7:]
    limit = np.maximum(body.lower - angles, angles - body.upper).max(axis=1, initial=0.0)
    margin = np.where(np.array(flat)[schedule.phase_at(motion.time)], np.inf, motion.margin)
    share = body.torque_share(motion.tau[:, 6:])
    series = {
        "max_support_error_m": support, "max_support_turn_rad": turn,
        "max_joint_limit_violation_rad": limit,
        "max_velocity_share": (np.abs(motion.v[:, 6:]) / body.velocity_limit).max(axis=1, initial=0.0),
        "max_torque_share": share.max(axis=1, initial=0.0),
        "max_physics_violation": violation,
    }  # fmt: skip
    times = {name: float(motion.time[int(np.argmax(values))]) for name, values in series.items()}
    times["min_margin"] = float(motion.time[int(np.argmin(margin))])
    apart = proximity.minimum_over(motion.q, obstacles.during_flights(), tolerance=1e-5)
    flying = proximity.minimum_over(motion.q, obstacles.touching(), tolerance=1e-5)
    times["min_clearance_m"] = float(motion.time[apart.sample])
    times["max_penetration_m"] = float(motion.time[flying.sample])
    return RefineResiduals(
        **{name: float(values.max()) for name, values in series.items()},
        min_clearance_m=float(apart.distance),
        closest_pair=apart.pair or ("", ""),
        max_penetration_m=max(0.0, -float(flying.distance)),
        min_margin=float(margin.min()),
        tightest_joint=body.joint_names[int(np.argmax(share.max(axis=0)))],
        worst_times_s=times,
    )


@dataclass(frozen=True)
class RefineSettings:
    """Options of :func:`refine_motion`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        samples_per_span: Samples between two knots.
        sampling: Spacing of the finished motion's samples, at which it is certified [s].
        scales: Weights and limits of the fit.
        requirements: What the finished motion must keep.
        retime: Whether the motion may be slowed down.
        friction_share: Share of the friction with which the margin is wanted; the certificate has all of it.
        contact_variables: Whether contacts that the motion does not need, and whose effectors are not there,
            are let go; else all contacts of the sequence are held.
        speed_share: Share of the velocity limits up to which phases are shortened, as far as every
            requirement is kept; None leaves them as they are.
    """

    knot_spacing: float = 0.1
    samples_per_span: int = 3
    sampling: float = 5.0e-3
    scales: RefineScales = field(default_factory=RefineScales)
    requirements: RefineRequirements = field(default_factory=RefineRequirements)
    retime: bool = True
    friction_share: float = 0.8
    contact_variables: bool = True
    speed_share: float | None = None

    def __post_init__(self) -> None:
        if self.speed_share is not None:
            share = finite_number(self.speed_share, "refinement speed_share", above=0.0)
            if share > 1.0:
                raise InputError(f"refinement speed_share is {share:g}; valid: at most 1")


@dataclass(frozen=True, eq=False, repr=False)
class RefineResult(Displayed):
    """A refined motion, or the best attempt and what it breaks.

    Attributes:
        motion: Densely sampled; its time begins where the input's does.
        spline: The motion in closed form.
        schedule: The contacts in the motion's own time, without those that were let go.
        before: The input at the motion's own timing, joined by interpolation.
        smoothed: The spline through the input from which the optimisation begins.
        after: The refined motion.
        certificate: Measured on the samples of the motion.
        requirements: What the certificate and the contacts' limits were held against.
        contact_slack: Room that all limits of the contacts have in common, the least at samples 10 ms
            apart, by linear programs, see :mod:`manikin.planning.whole_body.refine_certificate` [N, N.m].
        failure: Why it is no success, or None.
        variables: Of each phase, the contact variable of each contact of the input's sequence, in [0, 1].
        released: Phases and effectors of the contacts that were let go.
        stretch: Duration of the motion relative to the input's.
        iterations: Gauss-Newton steps.
        wall_time: [s].
    """

    motion: Motion
    spline: ConfigurationSpline
    schedule: ContactSchedule
    before: RefineMeasures
    smoothed: RefineMeasures
    after: RefineMeasures
    certificate: RefineResiduals
    requirements: RequirementTable
    contact_slack: float
    failure: WholeBodyFailure | None
    variables: Variables
    released: tuple[tuple[int, str], ...]
    stretch: float
    iterations: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether every requirement is kept."""
        return self.failure is None


def sampled_motion(
    body: BodyModel,
    schedule: ContactSchedule,
    rooms: Sequence[MarginCost],
    spline: ConfigurationSpline,
    sampling: float,
) -> tuple[Motion, FloatArray, MotionMargin]:
    """Sample a spline with its contact forces and torques.

    Args:
        body: The body.
        schedule: Contacts in time.
        rooms: Wrench polytope of each phase.
        spline: The motion.
        sampling: Spacing of the samples [s].

    Returns:
        The motion, (n,) its physics violation [N] and its margins.
    """
    time = sample_uniformly(schedule, sampling)
    polytopes = [room.polytope for room in rooms]
    motion, wrench = full_motion(body, schedule, polytopes, time, *spline.evaluate(time))
    balance, violation = balance_of(schedule, tuple(rooms), time, wrench, motion.com)
    return motion, violation, balance


def certified_motion(
    body: BodyModel,
    scene: Scene,
    proximity: Proximity,
    schedule: ContactSchedule,
    rooms: Sequence[MarginCost],
    spline: ConfigurationSpline,
    sampling: float,
    padded: Sequence[str] = (),
) -> tuple[Motion, RefineResiduals]:
    """Sample a spline and measure it against everything that is required.

    Args:
        body: The body.
        scene: Its surroundings.
        proximity: Distances to the scene and within the body.
        schedule: Contacts in time.
        rooms: Wrench polytope of each phase.
        spline: The motion.
        sampling: Spacing of the samples [s].
        padded: Obstacles that any part of the body may lean on.
    """
    motion, violation, balance = sampled_motion(body, schedule, rooms, spline, sampling)
    obstacles = RefineObstacles(body, scene, schedule, motion.time, padded)
    flat = tuple(room.is_flat for room in rooms)
    found = certify_refined(body, proximity, schedule, obstacles, motion, violation, flat)
    force = np.where(np.array(flat)[schedule.phase_at(motion.time)], np.inf, balance.force)
    found = replace(
        found,
        min_force_at_com_N=replace(balance, force=force).min_force,
        min_zmp_distance_m=balance.min_zmp_distance,
    )
    return motion, found


def least_slack(
    body: BodyModel, schedule: ContactSchedule, spline: ConfigurationSpline, time: FloatArray
) -> tuple[float, float]:
    """Least slack of the contacts' limits at samples (n,) [s] of a motion, and when [s]."""
    wrench = centroidal_motion(body, *spline.evaluate(time)).wrench
    slack = contact_slack(schedule, time, wrench)
    worst = int(np.argmin(slack))
    return float(slack[worst]), float(time[worst])
