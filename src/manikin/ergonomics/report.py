"""Ergonomics of one motion: scores, loads, strength, effort, and the lowest margin with its contact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.balance import WrenchPolytope, stability_margins, wrench_polytopes
from manikin.balance.wrench import LimitingConstraint
from manikin.balance.zmp import contact_wrench
from manikin.body import BodyModel, Configuration
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import ContactSchedule, Stance, default_normal_force_cap
from manikin.contact.from_motion import stance_at
from manikin.ergonomics import assessment
from manikin.ergonomics.assessment import LOADED, CumulativeEffort, JointStrength, PosturalAssessment
from manikin.ergonomics.body_parts import parts_of
from manikin.ergonomics.load_report import LoadAssessment, loads_of
from manikin.ergonomics.rula_reba import Circumstances
from manikin.errors import BodyError
from manikin.motion import Motion
from manikin.motion.dynamics import CarriedForces, centroidal_motion
from manikin.numerics.spatial import FloatArray, finite_number, wrench_about
from manikin.runtime.display import Displayed
from manikin.runtime.files import csv_text

FRICTION = 0.8
"""Coefficient of friction of contacts that are known by the motion alone."""
AGREES = 0.5
"""Difference up to which a margin counts as reproduced [N.m]."""


@dataclass(frozen=True, eq=False)
class LowestMargin:
    """Smallest margin of a motion.

    Attributes:
        value: In ``unit``: ``"N.m"``, or ``"N"`` of a point mass planned in the force space.
        time: When [s].
        supports: Effectors in contact then.
        limiting: Nearest face of the wrench polytope then, in words; None with its reason in ``unknown``.
        again: Margin that the stance gives, to compare with ``value`` [N.m]; None without a stance.
        stance: ``"planned contacts"`` or ``"effectors in contact"``: from what the stance was rebuilt.
    """

    value: float
    unit: str
    time: float
    supports: tuple[str, ...]
    limiting: LimitingConstraint | None = None
    again: float | None = None
    stance: str | None = None
    unknown: str | None = None

    @property
    def reproduced(self) -> bool:
        """Whether the stance found gives the margin of the motion, within :data:`AGREES` or 1 %."""
        return self.again is not None and abs(self.again - self.value) <= max(AGREES, 0.01 * abs(self.value))


def lowest_margin(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None, *, friction: float = FRICTION
) -> LowestMargin | None:
    """Find the smallest margin and its limiting contact; None if the margin is not known at any instant.

    With the planned contacts the stance is the one among the phase of that instant and its neighbours (an
    executed motion may be late) that gives the margin of the motion best. Without them it is rebuilt from the
    effectors in contact with a friction: soles as large as the body's, points at the hands, the patch of the
    buttocks.

    Raises:
        InputError: If the friction is not above 0.
    """
    finite_number(friction, "friction", above=0.0)
    if not np.isfinite(motion.margin).any():
        return None
    row = int(np.nanargmin(motion.margin))
    held = zip(motion.contact_names, motion.support[row], strict=True)
    supports = tuple(name for name, touches in held if touches)
    found = LowestMargin(float(motion.margin[row]), motion.margin_unit, float(motion.time[row]), supports)
    if motion.margin_unit != "N.m" or body.is_point_mass:
        return replace(found, unknown="the margin of a point mass in the force space has no stance")
    com, wrench = _dynamic_wrench(body, motion, row, schedule)
    if schedule is None:
        source, on, wrenches = "effectors in contact", "in contact", [wrench]
        stances = [rebuilt_stance(body, motion, row, friction)]
    else:
        source, on = "planned contacts", "planned to be in contact"
        stances = _planned_stances(body, schedule, found.time)
        wrenches = [*_measured_wrench(motion, schedule, row), wrench]
    polytopes = wrench_polytopes([stance for stance in stances if len(stance)])
    if not polytopes:
        return replace(found, unknown=f"nothing is {on} at that instant")
    W, wrench = min(product(polytopes, wrenches), key=lambda pair: abs(_margin_of(*pair, com) - found.value))
    limiting = W.limiting(wrench_about(wrench, W.reference), com)
    return replace(found, limiting=limiting, again=_margin_of(W, wrench, com), stance=source)


def rebuilt_stance(body: BodyModel, motion: Motion, row: int, friction: float = FRICTION) -> Stance:
    """Contacts of one frame at the poses of the effectors; effectors that can make none are left out."""
    configuration, sizes = Configuration(body, motion.q[row]), {}
    if body.stature is not None:
        sizes["buttocks"] = SEAT_LENGTH * body.stature, SEAT_WIDTH * body.stature
    if body.sole_length is not None and body.sole_width is not None:
        feet = [name for name in motion.contact_names if name.endswith("foot")]
        sizes |= dict.fromkeys(feet, (body.sole_length, body.sole_width))
    placements = {
        name: configuration.effector_placement(name)
        for name, held in zip(motion.contact_names, motion.support[row], strict=True)
        if held and name in body.effectors
    }
    return stance_at(placements, sizes, friction, default_normal_force_cap(body.mass))


def _planned_stances(body: BodyModel, schedule: ContactSchedule, time: float) -> list[Stance]:
    """Of the phase at an instant [s] and its neighbours."""
    phase, phases = int(schedule.phase_at(time)), schedule.sequence
    near = [number for number in (phase, phase - 1, phase + 1) if 0 <= number < len(phases)]
    return [phases[number].stance.bounded(body.mass) for number in near]


def _measured_wrench(motion: Motion, schedule: ContactSchedule, row: int) -> list[FloatArray]:
    """The (6,) sum of the motion's contact forces in one frame; none where it is not known."""
    frame = replace(motion, **{name: array[row : row + 1] for name, array in motion.arrays().items()})
    measured = contact_wrench(frame, schedule)[0]
    return [measured] if np.isfinite(measured).all() and measured.any() else []


def _margin_of(W: WrenchPolytope, wrench: FloatArray, com: FloatArray) -> float:
    """Margin about the CoM of a wrench (6,) about the world's origin [N.m]."""
    return float(stability_margins(W, wrench_about(wrench, W.reference), com).wrench_about_com)


def _dynamic_wrench(
    body: BodyModel, motion: Motion, row: int, schedule: ContactSchedule | None = None
) -> tuple[FloatArray, FloatArray]:
    """CoM (3,) and (6,) wrench about the world's origin that the motion needs of its contacts [N, N.m]."""
    rows = slice(row, row + 1)
    states = motion.q[rows], motion.v[rows], motion.a[rows]
    found = centroidal_motion(body, *states)
    load = None if schedule is None else CarriedForces.of(body, schedule, motion.time[rows], *states)
    return found.com[0], found.wrench[0] + (0.0 if load is None else load.wrench[0])


NO_TORQUES = "the motion has no joint torques"
"""Reason of strength and effort of a recording without inverse dynamics."""


@dataclass(frozen=True, eq=False, repr=False)
class Ergonomics(Displayed):
    """Ergonomics of one motion; an unknown part is None, and ``missing`` says why.

    Attributes:
        time: (n,) [s].
        circumstances: Given by the observer.
        margin_series: (n,) margin of the motion, NaN where it is not known.
        loads: OWAS, static postures, the low back, the lifting equation, who has the strength.
        missing: Reason by part: ``"posture"``, ``"strength"``, ``"effort"``, ``"margin"``, and those of
            :class:`~manikin.ergonomics.load_report.LoadAssessment`.
        untold: Segments that the recording does not observe; they were scored as in standing.
    """

    time: FloatArray
    circumstances: Circumstances
    posture: PosturalAssessment | None
    strength: JointStrength | None
    effort: CumulativeEffort | None
    margin: LowestMargin | None
    margin_series: FloatArray
    loads: LoadAssessment
    missing: Mapping[str, str]
    untold: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values (SI); see the docs page on JSON for the keys."""
        posture = self.posture
        return {
            "duration_s": float(self.time[-1] - self.time[0]), "frames": len(self.time),
            "circumstances": vars(self.circumstances).copy(),
            "legs_from": None if posture is None else posture.bearing.source,
            "rula": None if posture is None else posture.rula.as_dict(),
            "reba": None if posture is None else posture.reba.as_dict(),
            **self.loads.as_dict(self.time),
            "strength": None if self.strength is None else _strength(self.strength),
            "effort": None if self.effort is None else _effort(self.effort),
            "margin": None if self.margin is None else _margin(self.margin),
            "missing": dict(self.missing), "untold": list(self.untold),
        }  # fmt: skip

    def series(self) -> dict[str, NDArray[Any]]:
        """(n,) time series by column name, the time first: scores, angles, shares, margin."""
        columns: dict[str, NDArray[Any]] = {"time_s": self.time}
        if self.posture is not None:
            for one in (self.posture.rula, self.posture.reba):
                name = one.method.lower()
                columns |= {name: one.score, **{f"{name}_{side}": one.sides[side] for side in one.sides}}
                columns[f"{name}_action_level"] = one.level
            columns |= self.posture.angles.columns_deg()
        columns |= self.loads.series()
        if self.strength is not None:
            columns["largest_torque_share"] = self.strength.largest
            for number, joint in enumerate(self.strength.joint_names):
                columns[f"{joint}_torque_share"] = self.strength.share[:, number]
        if np.isfinite(self.margin_series).any():
            unit = "N" if self.margin is not None and self.margin.unit == "N" else "Nm"
            columns[f"margin_{unit}"] = self.margin_series
        return columns

    def csv(self) -> str:
        """The series as comma-separated text with a header; unknown values are empty."""
        columns = self.series()
        rows = zip(*columns.values(), strict=True)
        return csv_text(tuple(columns), ([_cell(value) for value in row] for row in rows))


def ergonomics_of(
    body: BodyModel, motion: Motion, *, schedule: ContactSchedule | None = None,
    given: Circumstances | None = None, fraction: float = LOADED, friction: float = FRICTION,
    untold: Sequence[str] = (), lowest: LowestMargin | None = None,
) -> Ergonomics:  # fmt: skip
    """Judge a motion, recorded, planned or executed; RULA and REBA exist for humans only.

    Args:
        schedule: Its planned contacts, for the limiting contact.
        given: Circumstances that the motion does not contain.
        fraction: Share of the strength above which a joint counts as loaded.
        friction: Of contacts without a schedule.
        untold: Segments that a recording does not observe; without the trunk there are no scores.
        lowest: The lowest margin, where it is known already.

    Raises:
        BodyError: If the motion is of another body.
        InputError: If a value is out of its range.
    """
    if motion.joint_names != body.joint_names:
        raise BodyError(
            f"motion has {len(motion.joint_names)} joints, not those of body {body.name!r}; "
            "valid: a motion of this body"
        )
    missing, posture = {}, None
    try:
        if parts_of(body).trunk[-1] in untold:
            missing["posture"] = "the recording says nothing about the trunk"
        else:
            posture = assessment.assess_posture(body, motion, given)
    except BodyError as error:
        missing["posture"] = f"RULA and REBA are of humans: {error}"
    strength = assessment.joint_strength(body, motion, fraction)
    effort = assessment.cumulative_effort(body, motion)
    for name, part in (("strength", strength), ("effort", effort)):
        if part is None:
            missing[name] = "the body has no joints" if not body.joint_names else NO_TORQUES
    margin = lowest or lowest_margin(body, motion, schedule, friction=friction)
    if margin is None:
        missing["margin"] = "the motion has no margin"
    elif margin.unknown is not None:
        missing["margin"] = f"no limiting contact: {margin.unknown}"
    circumstances = given or Circumstances()
    loads = loads_of(body, motion, posture, circumstances, schedule)
    found = posture, strength, effort, margin, motion.margin, loads, missing | dict(loads.missing)
    return Ergonomics(motion.time, circumstances, *found, tuple(untold))


def _strength(found: JointStrength) -> dict[str, Any]:
    worst = found.order[0]
    joints = {
        "limit_Nm": found.limit, "max_share": found.peak, "max_at_s": found.peak_time,
        "share_of_time_above": found.loaded,
    }  # fmt: skip
    return {
        "max_share": float(found.peak[worst]), "max_joint": found.joint_names[worst],
        "max_at_s": float(found.peak_time[worst]), "fraction": found.fraction, "known_share": found.known,
        "limits": found.source,
        "joints": {found.joint_names[index]: _row(joints, index) for index in found.order},
    }  # fmt: skip


def _row(columns: Mapping[str, FloatArray], index: int) -> dict[str, float]:
    """One joint's values of columns (j,) each, by their names."""
    return {name: float(values[index]) for name, values in columns.items()}


def _effort(found: CumulativeEffort) -> dict[str, Any]:
    joints = {"squared_share_s": found.squared_share, "positive_work_J": found.positive_work}
    joints["negative_work_J"] = found.negative_work
    return {
        "duration_s": found.duration, "squared_share_s": float(found.squared_share.sum()),
        "rms_share": found.mean_share, "positive_work_J": float(found.positive_work.sum()),
        "negative_work_J": float(found.negative_work.sum()),
        "absolute_work_J": float(found.absolute_work.sum()),
        "joints": {name: _row(joints, index) for index, name in enumerate(found.joint_names)},
    }  # fmt: skip


def _margin(found: LowestMargin) -> dict[str, Any]:
    limiting = found.limiting
    return {
        "min": found.value, "unit": found.unit, "at_s": found.time, "supports": list(found.supports),
        "limiting_contact": None if limiting is None else limiting.description,
        "effector": None if limiting is None else limiting.effector,
        "kind": None if limiting is None else limiting.kind.value, "stance_from": found.stance,
        "again": found.again, "reproduced": found.reproduced,
    }  # fmt: skip


def _cell(value: float) -> str:
    if isinstance(value, np.integer):
        return str(value)
    return "" if np.isnan(value) else f"{value:.6g}"
