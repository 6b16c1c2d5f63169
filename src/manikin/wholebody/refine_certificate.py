"""Certificate of a refined motion, measured afresh on its dense samples."""

from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.requirement import Requirement, RequirementTable, Sense, requirement_table
from manikin.scene import Proximity
from manikin.spatial import FloatArray
from manikin.wholebody.certificate import support_errors
from manikin.wholebody.refine_obstacles import RefineObstacles


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
