"""What an adapted motion has to keep to be proved, and what of the recording has changed in it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.analysis.adaptation import Adaptation
from manikin.analysis.motion_transfer import Hold, holds_of
from manikin.balance import motion_margin
from manikin.balance.motion_margin import MotionMargin
from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.spatial import FloatArray
from manikin.runtime.requirement import Requirement, RequirementTable, requirement_table


@dataclass(frozen=True)
class AdaptationLimits:
    """Limits that an executed adaptation must keep to be proved; ours, but what its attributes say.

    A recorded motion is out of balance for instants itself, at landings above all. So a share of the control
    steps has to have a positive margin, and not all of them as in a motion that is planned from rest to rest.

    Attributes:
        balanced: Least share of the control steps with a positive margin.
        com_rms_error: RMS distance of the CoM from its plan [m].
        contact_error: Largest distance of an effector from its plan [m].
        slip: Farthest way of an effector along its surface while in contact [m].
        penetration: Deepest penetration of any contact [m].
        posture: RMS difference of the joint angles from the recorded ones [deg].
    """

    balanced: float = 0.95
    com_rms_error: float = 0.015
    contact_error: float = 0.02
    slip: float = 0.005
    penetration: float = 0.002
    posture: float = 10.0

    def table(self, result: Adaptation) -> RequirementTable | None:
        """Every requirement with its measured value; None of what was not executed."""
        ran, adapted = result.execution, result.adapted
        if ran is None or adapted is None:
            return None
        touches = ran.counted_touches
        first = (touches[0].time, f"{touches[0].segment} on {touches[0].other}") if touches else (None, "")
        missing = result.schedule.duration - ran.motion.duration
        fallen = ran.failure_time_s if ran.fell else None
        balanced = float(np.mean(ran.motion.margin > 0.0))
        lowest = float(ran.motion.time[np.argmin(ran.motion.margin)])
        bend = float(np.degrees(adapted.posture_rms))
        return requirement_table([
            Requirement("fell", "falls", "", float(ran.fell), "<=", 0.0, fallen),
            Requirement("unplanned_touches", "unplanned touches", "", float(len(touches)), "<=", 0.0, *first),
            Requirement("missing_s", "part of the motion not executed", "s", missing, "<=", 0.02),
            Requirement("share_positive_margin", "share of positive margins, executed", "", balanced, ">=",
                        self.balanced, lowest),
            Requirement("com_rms_error_m", "RMS error of the centre of mass", "m", ran.com_rms_error_m, "<=",
                        self.com_rms_error),
            Requirement("max_foot_error_m", "error", "m", ran.max_foot_error_m, "<=", self.contact_error,
                        ran.worst_effector_time_s, ran.worst_effector),
            Requirement("max_slip_m", "slip", "m", ran.max_slip_m, "<=", self.slip),
            Requirement("max_penetration_m", "penetration", "m", ran.max_penetration_m, "<=",
                        self.penetration),
            Requirement("posture_rms_deg", "RMS difference of the joint angles", "deg", bend, "<=",
                        self.posture),
        ])  # fmt: skip


def changes_of(result: Adaptation) -> dict[str, Any]:
    """Plain values of what has changed from the recording to the plan and its execution, in SI units."""
    source, planned, ran = result.source, result.planned, result.execution
    recorded, kept = margins_of_recording(result), result.recorded
    contacts = [_contact(result, was, now) for was, now in _pairs(result)]
    away = None if planned is None else _angles_away(result, planned)
    worst = None if away is None else int(np.argmax(away.max(axis=0)))
    hinges = _compared(result.body)
    return {
        "body": {"recorded": source.body.signature(), "adapted": result.body.signature()},
        "contacts": contacts, "max_moved_m": max((c["moved_m"] for c in contacts), default=0.0),
        "duration_s": {"recorded": kept.duration, "planned": result.schedule.duration},
        "phase_durations_s": {
            "recorded": source.schedule.durations.tolist(), "planned": result.schedule.durations.tolist(),
        },
        "joints": None if away is None or worst is None else {
            "rms_deg": float(np.degrees(np.sqrt(np.mean(away**2)))),
            "max_deg": float(np.degrees(away.max())), "max_joint": result.body.joint_names[hinges[worst]],
        },
        "com_rms_m": result.as_dict()["com_rms_m"],
        "min_margin_Nm": {
            "recorded": float(recorded.margin.min()),
            "planned": None if planned is None else float(planned.margin.min()),
            "executed": None if ran is None else ran.min_margin,
        },
        "share_positive_margin": {
            "recorded": float(np.mean(recorded.margin > 0.0)),
            "planned": None if planned is None else float(np.mean(planned.margin > 0.0)),
            "executed": None if ran is None else float(np.mean(ran.motion.margin > 0.0)),
        },
        "max_torque_share": {
            "planned": None if result.adapted is None
            else result.adapted.certificate.value("max_torque_share"),
            "executed": None if ran is None else ran.max_limit_use,
        },
        "requirements": [] if (table := AdaptationLimits().table(result)) is None
        else [row.as_dict("execution") for row in table],
    }  # fmt: skip


def margins_of_recording(result: Adaptation) -> MotionMargin:
    """Margins of the recorded motion on its own stances, with its angular momentum."""
    source, moved = result.source, result.recorded
    found = centroidal_motion(source.body, source.q, moved.v, moved.a)
    stances = [phase.stance for phase in source.schedule.sequence]
    return motion_margin(stances, source.schedule.phase_at(source.time), found.wrench, found.com)


def _pairs(result: Adaptation) -> list[tuple[Hold, Hold]]:
    """Contacts of the recording beside those of the plan."""
    planned = {(hold.effector, hold.first): hold for hold in holds_of(result.schedule)}
    known = {(hold.effector, hold.first): hold for hold in result.source.holds}
    return [(known[key], planned[key]) for key in known if key in planned]


def _contact(result: Adaptation, was: Hold, now: Hold) -> dict[str, Any]:
    """One contact before and after; ways are seen in the scene's frame."""
    place = result.carried.transform.points(was.contact.position)
    start = float(result.source.schedule.instants[0])
    return {
        "effector": was.effector, "kind": str(was.contact.kind), "recorded_m": place.tolist(),
        "planned_m": now.contact.position.tolist(),
        "moved_m": float(np.linalg.norm(now.contact.position - place)),
        "recorded_s": [was.start - start, was.end - start], "planned_s": [now.start, now.end],
    }  # fmt: skip


def _compared(body: BodyModel) -> list[int]:
    """Hinges but those of the toes, which no recording shows."""
    return [k for k, name in enumerate(body.joint_names) if "toe" not in name]


def _angles_away(result: Adaptation, planned: Motion) -> FloatArray:
    """(n, hinges) absolute differences from the recorded angles [rad]."""
    hinges = [7 + k for k in _compared(result.body)]
    time = np.interp(planned.time, result.schedule.instants, result.recording.key_times)
    source = np.array([np.interp(time, result.carried.own_time, result.carried.q[:, k]) for k in hinges]).T
    return np.abs(planned.q[:, hinges] - source)


def flat_changes(changes: dict[str, Any]) -> dict[str, str]:
    """The table of what has changed, as texts by their labels."""
    lasts, joints, contacts = changes["duration_s"], changes["joints"], changes["contacts"]
    moved = [c for c in contacts if c["moved_m"] > 1e-3]
    rows = {
        "duration": f"{lasts['recorded']:.2f} s recorded, {lasts['planned']:.2f} s planned",
        "contacts": f"{len(moved)} of {len(contacts)} moved, at most {1e3 * changes['max_moved_m']:.0f} mm",
    }
    if joints is not None:
        rows["joint angles"] = (
            f"{joints['rms_deg']:.1f} deg off the recorded ones (RMS), at most {joints['max_deg']:.0f} deg "
            f"({joints['max_joint']})"
        )
    for key, label, unit in (
        ("share_positive_margin", "in balance", ""), ("min_margin_Nm", "least margin", " N.m"),
        ("max_torque_share", "largest torque share", ""),
    ):  # fmt: skip
        known = {name: value for name, value in changes[key].items() if value is not None}
        rows[label] = ", ".join(f"{value:.3g}{unit} {name}" for name, value in known.items())
    return rows
