"""Everything that ergonomics says about one motion, in one report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.display import Displayed
from manikin.ergonomics.assessment import PosturalAssessment, assess_posture
from manikin.ergonomics.circumstances import Circumstances
from manikin.ergonomics.effort import CumulativeEffort, cumulative_effort
from manikin.ergonomics.margin import FRICTION, LowestMargin, lowest_margin
from manikin.ergonomics.parts import parts_of
from manikin.ergonomics.strength import LOADED, JointStrength, joint_strength
from manikin.errors import BodyError
from manikin.motion import Motion
from manikin.spatial import FloatArray

NO_TORQUES = "the motion has no joint torques"
"""Reason of strength and effort of a recording without inverse dynamics."""


@dataclass(frozen=True, eq=False, repr=False)
class Ergonomics(Displayed):
    """Ergonomics of one motion; a part that could not be told is None, and ``missing`` says why.

    Attributes:
        time: (n,) [s].
        circumstances: What the motion does not tell and was given.
        posture: Angles, RULA and REBA.
        strength: Torques against strength.
        effort: Cumulative effort.
        margin: Smallest margin and its limiting contact.
        margin_series: (n,) margin of the motion, NaN where it is not known.
        missing: Reason by part: ``"posture"``, ``"strength"``, ``"effort"``, ``"margin"``.
        untold: Segments about which a recording says nothing; they were scored as in standing.
    """

    time: FloatArray
    circumstances: Circumstances
    posture: PosturalAssessment | None
    strength: JointStrength | None
    effort: CumulativeEffort | None
    margin: LowestMargin | None
    margin_series: FloatArray
    missing: Mapping[str, str]
    untold: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values (SI); see the docs page on JSON for the keys."""
        posture = self.posture
        return {
            "duration_s": float(self.time[-1] - self.time[0]),
            "frames": len(self.time),
            "circumstances": vars(self.circumstances).copy(),
            "legs_from": None if posture is None else posture.bearing.source,
            "rula": None if posture is None else posture.rula.as_dict(),
            "reba": None if posture is None else posture.reba.as_dict(),
            "strength": None if self.strength is None else _strength(self.strength),
            "effort": None if self.effort is None else _effort(self.effort),
            "margin": None if self.margin is None else _margin(self.margin),
            "missing": dict(self.missing),
            "untold": list(self.untold),
        }

    def series(self) -> dict[str, NDArray[Any]]:
        """(n,) time series by column name, the time first: scores, angles, shares, margin."""
        columns: dict[str, NDArray[Any]] = {"time_s": self.time}
        if self.posture is not None:
            for one in (self.posture.rula, self.posture.reba):
                name = one.method.lower()
                columns |= {name: one.score, **{f"{name}_{side}": one.sides[side] for side in one.sides}}
                columns[f"{name}_action_level"] = one.level
            columns |= self.posture.angles.columns_deg()
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
        rows = [",".join(columns)]
        rows += [",".join(_cell(value) for value in row) for row in zip(*columns.values(), strict=True)]
        return "\n".join(rows) + "\n"


def ergonomics_of(
    body: BodyModel,
    motion: Motion,
    *,
    schedule: ContactSchedule | None = None,
    given: Circumstances | None = None,
    fraction: float = LOADED,
    friction: float = FRICTION,
    untold: Sequence[str] = (),
    lowest: LowestMargin | None = None,
) -> Ergonomics:
    """Judge a motion, recorded, planned or executed.

    Args:
        body: Who moves; of another creature than a human there is no RULA and REBA.
        motion: Of this body.
        schedule: Its planned contacts, for the limiting contact.
        given: What the motion does not tell.
        fraction: Share of the strength above which a joint counts as loaded.
        friction: Of contacts that the schedule does not tell of.
        untold: Segments about which a recording says nothing, as
            :attr:`manikin.mocap.reconstruction.Reconstruction.neutral`; without the trunk no scores.
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
    missing: dict[str, str] = {}
    posture = None
    try:
        if parts_of(body).trunk[-1] in untold:
            missing["posture"] = "the recording says nothing about the trunk"
        else:
            posture = assess_posture(body, motion, given)
    except BodyError as error:
        missing["posture"] = f"RULA and REBA are of humans: {error}"
    strength, effort = joint_strength(body, motion, fraction), cumulative_effort(body, motion)
    for name, part in (("strength", strength), ("effort", effort)):
        if part is None:
            missing[name] = "the body has no joints" if not body.joint_names else NO_TORQUES
    margin = lowest or lowest_margin(body, motion, schedule, friction=friction)
    if margin is None:
        missing["margin"] = "the motion has no margin"
    elif margin.unknown is not None:
        missing["margin"] = f"no limiting contact: {margin.unknown}"
    return Ergonomics(
        motion.time, given or Circumstances(), posture, strength, effort, margin, motion.margin, missing,
        tuple(untold),
    )  # fmt: skip


def _strength(found: JointStrength) -> dict[str, Any]:
    worst = found.order[0]
    return {
        "max_share": float(found.peak[worst]),
        "max_joint": found.joint_names[worst],
        "max_at_s": float(found.peak_time[worst]),
        "fraction": found.fraction,
        "known_share": found.known,
        "limits": found.source,
        "joints": {
            found.joint_names[index]: {
                "limit_Nm": float(found.limit[index]),
                "max_share": float(found.peak[index]),
                "max_at_s": float(found.peak_time[index]),
                "share_of_time_above": float(found.loaded[index]),
            }
            for index in found.order
        },
    }


def _effort(found: CumulativeEffort) -> dict[str, Any]:
    return {
        "duration_s": found.duration,
        "squared_share_s": float(found.squared_share.sum()),
        "rms_share": found.mean_share,
        "positive_work_J": float(found.positive_work.sum()),
        "negative_work_J": float(found.negative_work.sum()),
        "absolute_work_J": float(found.absolute_work.sum()),
        "joints": {
            joint: {
                "squared_share_s": float(found.squared_share[index]),
                "positive_work_J": float(found.positive_work[index]),
                "negative_work_J": float(found.negative_work[index]),
            }
            for index, joint in enumerate(found.joint_names)
        },
    }


def _margin(found: LowestMargin) -> dict[str, Any]:
    limiting = found.limiting
    return {
        "min": found.value,
        "unit": found.unit,
        "at_s": found.time,
        "supports": list(found.supports),
        "limiting_contact": None if limiting is None else limiting.description,
        "effector": None if limiting is None else limiting.effector,
        "kind": None if limiting is None else limiting.kind.value,
        "stance_from": found.stance,
        "again": found.again,
        "reproduced": found.reproduced,
    }


def _cell(value: float) -> str:
    if isinstance(value, np.integer):
        return str(value)
    return "" if np.isnan(value) else f"{value:.6g}"
