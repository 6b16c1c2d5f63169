"""What a motion and its load ask of the body, beside RULA and REBA, in one value."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.ergonomics.assessment import PosturalAssessment, assess_posture, durations, known_torques
from manikin.ergonomics.capable_share import CapableShare, capable_shares
from manikin.ergonomics.force_of_motion import ExertedOverTime, exerted_by
from manikin.ergonomics.lift_of_motion import carried, heaviest, lift_of
from manikin.ergonomics.lifting import LiftingIndex, lifting_index
from manikin.ergonomics.low_back import LowBack, low_back_load
from manikin.ergonomics.owas import Owas, owas_of
from manikin.ergonomics.reach import ReachUse, reach_use
from manikin.ergonomics.rula_reba import Circumstances
from manikin.ergonomics.sight import ZONES, Sight, sight_of
from manikin.ergonomics.static_postures import StaticPostures, static_postures
from manikin.ergonomics.working_postures import VERDICTS, WorkingPostures, working_postures
from manikin.errors import BodyError, InputError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import readable


@dataclass(frozen=True, eq=False)
class LoadAssessment:
    """Assessments of postures and loads; an unknown part is None.

    Attributes:
        owas: Of a human.
        static: Static postures, of a human.
        low_back: Load on L5/S1, of a human.
        lifting: Of a motion with a load in both hands that goes up or down.
        lift_times: Instants of the ends of that lift [s].
        capable: Who has the strength, by sex; of motions with torques.
        missing: Reason by part: ``"low_back"``, ``"lifting"``, ``"capable"``, ``"sight"``, ``"force"``.
        sight: Where the hands are in the field of view, of a human.
        reach: How much of their reach the hands use, of a human.
        working: Working postures and movements, of a human.
        force: What the hands push or pull, of a motion that does so.
    """

    owas: Owas | None
    static: StaticPostures | None
    low_back: LowBack | None
    lifting: LiftingIndex | None
    lift_times: tuple[float, float] | None
    capable: Mapping[str, CapableShare] | None
    missing: Mapping[str, str]
    sight: Sight | None = None
    reach: ReachUse | None = None
    working: WorkingPostures | None = None
    force: ExertedOverTime | None = None

    def as_dict(self, time: FloatArray) -> dict[str, Any]:
        """JSON-ready values (SI) of a motion at times (n,) [s]."""
        weight = durations(time)
        lifting = None if self.lifting is None else self.lifting.as_dict()
        if lifting is not None and self.lift_times is not None:
            lifting |= {"from_s": self.lift_times[0], "to_s": self.lift_times[1]}
        timed = {
            "owas": self.owas, "static_postures": self.static, "working_postures": self.working,
            "low_back": self.low_back, "sight": self.sight,
        }  # fmt: skip
        found = {name: None if one is None else one.as_dict(weight) for name, one in timed.items()}
        reach = None if self.reach is None else self.reach.as_dict(time)
        force = None if self.force is None else self.force.as_dict()
        found |= {"reach": reach, "lifting": lifting, "force": force, "capable": None}
        if self.capable is not None:
            found["capable"] = {sex: one.as_dict() for sex, one in self.capable.items()}
        return found

    def series(self) -> dict[str, NDArray[Any]]:
        """(n,) time series by column name."""
        columns: dict[str, NDArray[Any]] = {}
        if self.owas is not None:
            digits = self.owas.back, self.owas.arms, self.owas.legs, self.owas.load
            columns["owas_code"] = np.stack(digits, axis=1) @ [1000, 100, 10, 1]
            columns["owas_category"] = self.owas.category
        if self.static is not None:
            columns["static_posture_level"] = self.static.level
        if self.working is not None:
            for name, part in self.working.parts.items():
                columns[f"{name}_zone"] = part.zone
            columns["working_posture_level_rare"] = self.working.rare
            columns["working_posture_level_frequent"] = self.working.frequent
        if self.force is not None:
            columns["exerted_force_N"] = self.force.force
        if self.low_back is not None:
            columns["l5s1_compression_N"] = self.low_back.compression
            columns["l5s1_shear_N"] = self.low_back.shear
            columns["l5s1_flexion_moment_Nm"] = self.low_back.flexion_moment
        if self.sight is not None:
            columns |= {f"{side}_hand_sight_zone": zone for side, zone in self.sight.zones.items()}
        if self.reach is not None:
            columns |= {f"{side}_reach_share": share for side, share in self.reach.shares.items()}
        return columns


def loads_of(
    body: BodyModel, motion: Motion, posture: PosturalAssessment | None, given: Circumstances,
    schedule: ContactSchedule | None = None,
) -> LoadAssessment:  # fmt: skip
    """Assess a motion.

    Args:
        body: With what it carries all the time.
        motion: Its motion.
        posture: Its angles and what carries its weight; None where they are not known.
        given: Circumstances that the motion does not contain.
        schedule: Its contacts, with what is carried in single phases.
    """
    missing: dict[str, str] = {}
    owas, static, back, sight, reach, working = None, None, None, None, None, None
    if posture is not None:
        reach = reach_use(body, motion.q)
        try:
            sight = sight_of(body, motion.q)
        except BodyError as error:
            missing["sight"] = str(error)
        owas = owas_of(body, motion, posture.angles, posture.bearing, given.load_kg)
        static = static_postures(motion.time, posture.angles)
        working = working_postures(body, motion.time, motion.q, posture.angles, posture.bearing, given)
        back = _low_back(body, motion, schedule, given, missing)
    lifting, instants = (
        _lifting(body, motion, schedule, given, missing) if posture is not None else (None, None)
    )
    capable, rows = None, known_torques(motion)
    if body.joint_names and rows.any() and posture is not None:
        try:
            capable = capable_shares(body, motion.tau[rows, 6:], age=given.people_age)
        except BodyError as error:
            missing["capable"] = str(error)
    force = _force(motion, schedule, given, missing) if posture is not None else None
    return LoadAssessment(
        owas, static, back, lifting, instants, capable, missing, sight, reach, working, force
    )


def _low_back(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None, given: Circumstances,
    missing: dict[str, str],
) -> LowBack | None:  # fmt: skip
    try:
        found = low_back_load(body, motion, schedule, lever=given.back_lever_m)
    except BodyError as error:
        missing["low_back"] = str(error)
        return None
    if not np.any(found.known):
        missing["low_back"] = "a support of the trunk or of the arms has a force that is not known"
        return None
    return found


def _lifting(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None, given: Circumstances,
    missing: dict[str, str],
) -> tuple[LiftingIndex | None, tuple[float, float] | None]:  # fmt: skip
    """The lift, if there is a load; the reason why there is none goes to the missing."""
    if not np.any(carried(body, motion, schedule) > 0.0):
        return None, None
    frequent = {"frequency": given.lifts_per_minute, "hours": given.lifting_hours}
    try:
        lift, instants = lift_of(body, motion, schedule, **frequent, coupling=given.coupling)
    except InputError as error:
        missing["lifting"] = str(error).partition(";")[0]
        return None, None
    return lifting_index(lift), instants


def _force(
    motion: Motion, schedule: ContactSchedule | None, given: Circumstances, missing: dict[str, str]
) -> ExertedOverTime | None:
    """What is pushed or pulled; the reason why that is not known goes to the missing."""
    try:
        return exerted_by(motion, schedule, given)
    except InputError as error:
        missing["force"] = str(error).partition(";")[0]
        return None


def ergonomics_in_short(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None
) -> dict[str, Any] | None:
    """The worst scores and loads of a motion, JSON-ready; None if the body is no human."""
    given = Circumstances(load_kg=heaviest(body, schedule))
    try:
        posture = assess_posture(body, motion, given)
    except BodyError:
        return None
    loads = loads_of(body, motion, posture, given, schedule)
    found = loads.as_dict(motion.time)
    back, lift, capable, force = (found[part] for part in ("low_back", "lifting", "capable", "force"))
    working = found["working_postures"]
    return {
        "load_kg": given.load_kg, "rula_max": int(posture.rula.score.max()),
        "reba_max": int(posture.reba.score.max()), "owas_max": found["owas"]["max"],
        "owas_code": found["owas"]["code"],
        "working_postures": {how: working[how]["verdict"] for how in ("rare", "frequent")},
        "l5s1_max_compression_N": None if back is None else back["max_compression_N"],
        "l5s1_level": None if back is None else back["level"],
        "lifting_index": None if lift is None else lift["index"],
        "force_risk": None if force is None else force["risk"],
        "force_verdict": None if force is None else force["verdict"],
        "reach_max_share": max(found["reach"]["max_share"].values()),
        "capable_min_share": None if capable is None else {sex: capable[sex]["min_share"] for sex in capable},
    }  # fmt: skip


def load_lines(report: Mapping[str, Any]) -> dict[str, str]:
    """One line for each known part of :meth:`LoadAssessment.as_dict`, by its name."""
    lines = {}
    if (owas := report["owas"]) is not None:
        lines["OWAS"] = f"{owas['max']} ({owas['code']}) at {owas['max_at_s']:.2f} s: {owas['action']}"
    if (held := report["static_postures"]) is not None:
        lines["static postures"] = held["verdict"] + (f" ({held['part']})" if held["max"] > 1 else "")
    if (working := report["working_postures"]) is not None:
        lines["working postures"] = _working_line(working)
    if (force := report["force"]) is not None:
        lines["force of the hands"] = _force_line(force)
    if (back := report["low_back"]) is not None:
        lines["low back L5/S1"] = (
            f"{back['max_compression_N']:.0f} N at {back['max_at_s']:.2f} s, {back['level']}; "
            f"shear {back['max_shear_N']:.0f} N"
        )
    if (lift := report["lifting"]) is not None:
        index = "-" if lift["index"] is None else f"{lift['index']:.2f}"
        lines["lifting index"] = (
            f"{index}: {lift['load_kg']:.1f} kg, recommended {lift['recommended_kg']:.1f} kg"
        )
    if (sight := report["sight"]) is not None:
        parts = (
            f"{side} {sum(zones[str(one)] for one in ZONES if one < 2):.0%}" for side, zones in sight.items()
        )
        lines["hands seen without turning the head"] = ", ".join(parts) + " of the time"
    if (reach := report["reach"]) is not None:
        shares = (f"{side} {share:.0%}" for side, share in reach["max_share"].items())
        lines["reach used at most"] = ", ".join(shares)
    if (groups := report["capable"]) is not None:
        shares = (
            f"{group['min_share']:.0%} of {name} ({readable(group['joint'])})"
            for name, group in zip(("men", "women"), (groups["male"], groups["female"]), strict=True)
        )
        lines["strong enough"] = ", ".join(shares)
    return lines


def _working_line(report: Mapping[str, Any]) -> str:
    """Verdicts of working postures: the known one, or that of rare and that of frequent movements."""
    if (known := report["known"]) is not None:
        return _judged(known)
    rare, frequent = report["rare"], report["frequent"]
    if rare["max"] == frequent["max"]:
        return _judged(frequent)
    return f"{_judged(rare)} below 2 movements a minute; else {_judged(frequent)}"


def _judged(one: Mapping[str, Any]) -> str:
    if one["max"] == min(VERDICTS):
        return str(one["verdict"])
    where = f"{readable(one['part'])} from {one['max_at_s']:.2f} s on"
    return f"{one['verdict']} ({where}{': ' if one['condition'] else ''}{one['condition']})"


def _force_line(report: Mapping[str, Any]) -> str:
    """Risk of a push or pull with what is not known of its job."""
    kind = report["activity"].removeprefix("body_")
    best = {"frequency": "at most 0.2 times a minute", "duration": "for an hour at most"}
    assumed = " and ".join(best[name] for name in report["assumed"])
    return (
        f"{kind} of {report['force_N']:.0f} N, {report['verdict']} (risk {report['risk']:.2f}); "
        f"recommended up to {report['recommended_N']:.0f} N" + (f", done {assumed}" if assumed else "")
    )
