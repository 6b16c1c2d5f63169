"""Refinement stage: a motion of all joints through postures at the changes of contact."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactModel, ContactSchedule
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.context import Report, RunContext
from manikin.pipeline.stages.whole_body_stage import certificate_summary, report_whole_body
from manikin.planning.contacts import ContactPlan
from manikin.planning.whole_body import KeyPostures, RefineResult, RefineScales, RefineSettings, refine_motion
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.swing_planner import with_mid_flights
from manikin.scene import Scene


@dataclass(frozen=True, eq=False)
class KeyedContacts:
    """Initial guess of the refinement.

    Attributes:
        schedule: Contacts in time.
        time: (n,) key times [s].
        q: (n, nq) postures at them.
    """

    schedule: ContactSchedule
    time: FloatArray
    q: FloatArray

    @classmethod
    def of_plan(cls, plan: ContactPlan, model: ContactModel) -> "KeyedContacts":
        """A contact plan, every phase as long as it has to be at least.

        Args:
            plan: Found from start and goal.
            model: Contact model of every stance.
        """
        schedule = plan.schedule(model)
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
        """The same with postures between, see ``with_mid_flights``."""
        path = with_mid_flights(body, scene, self.schedule, KeyPath(self.time, self.q), padded)
        return KeyedContacts(self.schedule, path.time, path.q)


def refine_contacts(context: RunContext, report: Report, keyed: KeyedContacts) -> RefineResult:
    """Refine the motion through key postures, at the scenario's pace.

    Args:
        report: Takes the ``wholebody`` block.
        keyed: Contacts with a posture at each change.
    """
    report.progress("wholebody", 0.0)
    body, scene, padded = context.body, context.scene, context.padded
    keyed = keyed.at_pace(context.scenario.file.wholebody.pace).with_lifted_feet(body, scene, padded)
    options = context.scenario.file.wholebody
    settings = RefineSettings(
        scales=RefineScales.of(body),
        contact_variables=options.contact_variables,
        speed_share=options.speed_share,
    )
    result = refine_motion(
        body, scene, keyed.time, keyed.q, keyed.schedule, settings=settings,
        padded=padded, progress=lambda share: report.progress("wholebody", share),
    )  # fmt: skip
    block = refined_summary(result) | {"seed_matters": context.plan is not None}
    report_whole_body(context, report, result.schedule, result, block)
    return result


def refined_summary(result: RefineResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary of a refined motion."""
    certificate = result.certificate
    return {
        "method": "refine",
        "duration_s": result.after.duration_s,
        **certificate_summary(certificate),
        "max_meeting_error_m": None,
        "max_com_error_m": None,
        "max_scuff_m": certificate.value("max_penetration_m"),
        "impacts": [],
        "min_margin": certificate.value("min_margin"),
        "swings": None,
        "refinement": {
            "min_contact_slack": result.contact_slack,
            "max_physics_violation_N": certificate.value("max_physics_violation"),
            "physics_violation_falls": _fall(
                result.before.physics_violation, result.after.physics_violation
            ),
            "squared_accelerations_fall": _fall(
                result.before.squared_accelerations, result.after.squared_accelerations
            ),
            "before": result.before.as_dict(),
            "smoothed": result.smoothed.as_dict(),
            "after": result.after.as_dict(),
            "least_contact_variable": min(
                (value for phase in result.variables for value in phase.values()), default=None
            ),
            "released_contacts": [{"phase": phase, "effector": name} for phase, name in result.released],
            "stretch": result.stretch,
            "iterations": result.iterations,
        },
        "wall_s": result.wall_time,
    }  # fmt: skip


def _fall(before: float, after: float) -> float | None:
    """Ratio of the values before and after; None if nothing is left."""
    return before / after if after > 0.0 else None
