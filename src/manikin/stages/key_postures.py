"""Between centre of mass and whole body: postures at the key instants, and other plans where one fails."""

from dataclasses import dataclass, replace

from manikin.centroidal import CentroidalResult, CentroidalTrajectory
from manikin.contact import ContactSchedule, StanceSequence
from manikin.stages.centroidal import centroidal_summary, report_centre_of_mass
from manikin.stages.context import RunContext
from manikin.stages.report import Report, place
from manikin.stages.world_frame import reason_in_world
from manikin.wholebody import (
    Eligibility,
    KeyPostures,
    continue_seated,
    find_eligible_plan,
    find_key_postures,
)

KEY_ROOM = 0.5
"""Share of the fit's distance from the ends of the joint ranges that key postures keep."""

KEY_TOLERANCES = (1.0e-3, 2.0e-4)
"""How exact key postures are [m]: as exact as the finished motion has to be; and more, where no motion is
found although each posture was just within reach."""


@dataclass(frozen=True, eq=False)
class KeyedPlan:
    """A plan of the centre of mass with its key postures.

    Attributes:
        centroidal: The plan, the last one where it was planned again.
        trajectory: It on the real supports; None where it cannot be done.
        postures: Its key postures, or None.
        replans: Plans tried after the first one.
    """

    centroidal: CentroidalResult
    trajectory: CentroidalTrajectory | None = None
    postures: KeyPostures | None = None
    replans: int = 0


def with_key_postures(context: RunContext, report: Report, planned: CentroidalResult) -> KeyedPlan:
    """Find the key postures of a plan, or of another one where a posture fails.

    Args:
        context: With supports.
        report: Takes the ``centroidal`` block anew.
        planned: The plan; it is returned as it is where it failed.
    """
    if planned.trajectory is None:
        return KeyedPlan(planned)
    return _reported(report, _tested(context, report, planned, KEY_TOLERANCES[0]))


def with_stricter_key_postures(
    context: RunContext, report: Report, planned: CentroidalResult, before: KeyedPlan
) -> KeyedPlan | None:
    """Another plan where no motion was found and a key posture is only just within reach, or None.

    Args:
        context: With supports.
        report: Has the failure of the whole body, which is forgotten where there is another plan.
        planned: The first plan.
        before: What was found for it.
    """
    if planned.trajectory is None:
        return None
    failure = report.failure
    found = _tested(context, report, planned, KEY_TOLERANCES[1])
    if found.failure is not None or found.trajectory is None or found.replans <= before.replans:
        report.failure = failure
        return None
    report.failure = None
    return _reported(report, found)


def _tested(context: RunContext, report: Report, planned: CentroidalResult, tolerance: float) -> Eligibility:
    """The plan, or another one where a key posture fails."""
    # The fit keeps its distance from the ends of the ranges: the key postures leave room for that,
    # if they can.
    found = _eligible(context, report, planned, KEY_ROOM * context.settings.fit.joint_buffer, tolerance)
    if found.failure is not None or (found.trajectory is None and found.replans > 0):
        report.failure = None  # of a seated part that did not fit another plan
        found = _eligible(context, report, planned, 0.0, tolerance)
    return found


def _eligible(
    context: RunContext, report: Report, planned: CentroidalResult, range_margin: float, tolerance: float
) -> Eligibility:
    """Test the key postures of a plan, and plan again where they fail."""

    def realise(trajectory: CentroidalTrajectory) -> CentroidalTrajectory | None:
        return _on_real_supports(context, report, trajectory)

    def look(trajectory: CentroidalTrajectory) -> KeyPostures:
        return find_key_postures(
            context.body, context.scene, trajectory, manner=context.settings.manner,
            requirements=context.settings.requirements, range_margin=range_margin,
            tolerance=tolerance, known=context.known_postures,
            padded=() if context.plan is None else context.padded,
        )  # fmt: skip

    return find_eligible_plan(planned, realise, look, replan=not context.is_recorded)


def _on_real_supports(
    context: RunContext, report: Report, planned: CentroidalTrajectory
) -> CentroidalTrajectory | None:
    """The plan on the real soles, friction and caps, with the seated part where there is one."""
    real, seat = context.scenario.build_sequence(), context.scenario.seated_from
    standing = real if seat is None else StanceSequence(real.phases[:seat])
    trajectory = replace(planned, schedule=ContactSchedule(standing, planned.schedule.instants))
    if seat is None:
        return trajectory
    sitting = StanceSequence(real.phases[seat:])
    continuation = continue_seated(context.body, context.scene, trajectory, sitting)
    if continuation.failure is not None:
        report.fail("wholebody", continuation.failure, trajectory.duration, f"phase {seat}")
    return continuation.trajectory


def _in_world(found: KeyPostures, report: Report) -> KeyPostures:
    transform = report.transform
    postures = [
        replace(
            item, com=transform.points(item.com), q=transform.poses(item.q),
            reason=None if item.reason is None else reason_in_world(item.reason, transform),
        )
        for item in found.postures
    ]  # fmt: skip
    return replace(found, postures=tuple(postures))


def _reported(report: Report, found: Eligibility) -> KeyedPlan:
    """Report a plan that was tested, and return it with its trajectory if it can be done."""
    postures = None if found.postures is None else _in_world(found.postures, report)
    block = centroidal_summary(found.centroidal) | {
        "replans": found.replans,
        "key_postures": None if postures is None else postures.summary(),
    }
    report_centre_of_mass(report, found.centroidal, block)
    if postures is not None:
        report.keep("key_postures", postures.to_dict())
    trajectory = found.trajectory
    if found.failure is not None:
        trajectory, failed = None, found.failure.posture
        where = place(failed.phase, ", ".join(failed.contacts))
        report.fail(found.failure.stage, found.failure.reason, failed.time, where)
    return KeyedPlan(found.centroidal, trajectory, found.postures, found.replans)
