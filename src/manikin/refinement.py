"""The whole-body stage by refinement: from postures at the changes of contact to a motion and its report."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.contact_planning import ContactPlan
from manikin.scene import Scene
from manikin.spatial import FloatArray
from manikin.wholebody import KeyPostures, RefineResult
from manikin.wholebody.mid_flights import with_mid_flights
from manikin.wholebody.refine_input import KeyPath


@dataclass(frozen=True, eq=False)
class KeyedContacts:
    """What the refinement begins with.

    Attributes:
        schedule: Contacts in time.
        time: (n,) key times [s].
        q: (n, nq) postures at them.
    """

    schedule: ContactSchedule
    time: FloatArray
    q: FloatArray

    @classmethod
    def of_plan(cls, plan: ContactPlan, normal_force_cap: float) -> "KeyedContacts":
        """A contact plan, every phase as long as it has to be at least.

        Args:
            plan: Found from start and goal.
            normal_force_cap: Of every stance [N].
        """
        schedule = plan.schedule(normal_force_cap)
        return cls(schedule, *plan.keys(schedule.instants))

    @classmethod
    def of_postures(cls, schedule: ContactSchedule, postures: KeyPostures) -> "KeyedContacts":
        """Postures found at the key instants of a planned centre of mass, with its timing."""
        return cls(schedule, schedule.instants, np.array([item.q for item in postures.postures]))

    def at_pace(self, pace: float) -> "KeyedContacts":
        """The same with everything ``pace`` times as fast."""
        schedule = ContactSchedule(self.schedule.sequence, self.schedule.instants / pace)
        return KeyedContacts(schedule, self.time / pace, self.q)

    def with_lifted_feet(self, body: BodyModel, scene: Scene, padded: Sequence[str]) -> "KeyedContacts":
        """The same with postures between, see :func:`~manikin.wholebody.mid_flights.with_mid_flights`."""
        path = with_mid_flights(body, scene, self.schedule, KeyPath(self.time, self.q), padded)
        return KeyedContacts(self.schedule, path.time, path.q)


def refined_summary(result: RefineResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary of a refined motion."""
    certificate = result.certificate
    return {
        "method": "refine",
        "duration_s": result.after.duration_s,
        "max_support_error_m": certificate.max_support_error_m,
        "max_meeting_error_m": None,
        "max_com_error_m": None,
        "min_clearance_m": certificate.min_clearance_m,
        "closest_pair": list(certificate.closest_pair),
        "max_scuff_m": certificate.max_penetration_m,
        "max_joint_limit_violation_rad": certificate.max_joint_limit_violation_rad,
        "max_velocity_share": certificate.max_velocity_share,
        "max_torque_share": certificate.max_torque_share,
        "min_margin": certificate.min_margin,
        "min_zmp_distance_m": None,
        "swings": None,
        "refinement": {
            "min_contact_slack": result.contact_slack,
            "max_physics_violation_N": certificate.max_physics_violation,
            "physics_violation_falls": _fall(
                result.before.physics_violation, result.after.physics_violation
            ),
            "squared_accelerations_fall": _fall(
                result.before.squared_accelerations, result.after.squared_accelerations
            ),
            "before": result.before.as_dict(),
            "smoothed": result.smoothed.as_dict(),
            "after": result.after.as_dict(),
            "stretch": result.stretch,
            "iterations": result.iterations,
        },
        "wall_s": result.wall_time,
    }  # fmt: skip


def _fall(before: float, after: float) -> float | None:
    """How many times less there is after; None where nothing is left."""
    return before / after if after > 0.0 else None
