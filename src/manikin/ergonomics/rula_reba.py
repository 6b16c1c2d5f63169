"""RULA ([McAtamney1993]_) and REBA ([Hignett2000]_), assessments of upper limbs and of the entire body.

Both methods say "upright", "twisted", "abducted", "across the midline" without a number, but every measured
posture is a little twisted. Thresholds here are our choice, near what an observer would notice, in degrees
as the published ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.ergonomics.body_parts import Bearing
from manikin.ergonomics.postural_angles import ArmAngles, PosturalAngles
from manikin.errors import InputError
from manikin.limits import AGE_RANGE
from manikin.numerics.spatial import FloatArray, finite_number

Scores = NDArray[np.int64]


def looked_up(table: Scores, **steps: ArrayLike) -> Scores:
    """Entries of a table whose axes all begin with the score 1, by scores named as in messages, in order.

    Raises:
        InputError: If a score is no whole number from 1 to the length of its axis.
    """
    places = [
        checked(score, 1, size, name) - 1
        for (name, score), size in zip(steps.items(), table.shape, strict=True)
    ]
    return table[tuple(np.broadcast_arrays(*places))]


def checked(score: ArrayLike, least: int, largest: int, name: str) -> Scores:
    """Scores as whole numbers.

    Raises:
        InputError: If one of them is none, or not from the least to the largest.
    """
    values = np.asarray(score)
    wrong = values[~((values >= least) & (values <= largest) & (values == np.round(values)))]
    if np.size(wrong):
        said = name.replace("_", " ")
        raise InputError(f"{said} score is {wrong[0]}; valid: whole numbers from {least} to {largest}")
    return values.astype(np.int64)


NEUTRAL = 5.0
"""Up to this trunk and neck are upright [deg]."""
TURNED = 10.0
"""Beyond this trunk and neck are twisted or bent to the side, and a wrist is deviated [deg]."""
ABDUCTED = 20.0
"""Beyond this an upper arm is abducted [deg]; a hanging arm stands off by up to 15."""
WRIST_NEUTRAL, WRIST_BENT = 5.0, 15.0
"""Up to this a wrist is neither flexed nor extended; beyond the second, published, strongly so [deg]."""
WRIST_AT_END = 60.0
"""Beyond this a forearm is turned to near the end of its range [deg], which is 80 deg to either side."""
OUTWARD, BENT_ELBOW = 30.0, 30.0
"""A bent forearm that points further out than this works out to the side of the body; arms that are less bent
than the second hang, and point where the upper arm does [deg]."""


def degrees(angle: FloatArray) -> FloatArray:
    """(n,) angle in degrees, rounded to 1e-9 so that a posture on a border falls on its published side."""
    return np.asarray(np.round(np.rad2deg(angle), 9), dtype=np.float64)


def band(value: FloatArray, *borders: float) -> NDArray[np.int64]:
    """(n,) 1 up to and with the first border, 2 up to the second, and so on."""
    return 1 + np.sum([value > border for border in borders], axis=0)


def turned(angle: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a trunk or neck is twisted or bent to the side, or a wrist deviated."""
    return np.abs(degrees(angle)) > TURNED


def _out(arm: ArmAngles, outward: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a bent forearm points out of the sagittal plane by an angle (n,) [rad]."""
    return (degrees(arm.elbow) > BENT_ELBOW) & (degrees(outward) > OUTWARD)


def _bent_trunk(angles: PosturalAngles) -> Scores:
    """Score of the trunk's flexion, the same in both methods."""
    flexion = degrees(angles.trunk_flexion)
    return np.maximum(band(flexion, NEUTRAL, 20.0, 60.0), band(-flexion, NEUTRAL, 20.0))


def _raised_arm(arm: ArmAngles) -> Scores:
    """Score of an upper arm's flexion, the same in both methods."""
    raised = degrees(arm.raised)
    return np.where(raised < -20.0, 2, band(raised, 20.0, 45.0, 90.0))


def _lower_arm(arm: ArmAngles) -> Scores:
    """Score of an elbow, the same in both methods."""
    elbow = degrees(arm.elbow)
    return np.where((elbow >= 60.0) & (elbow <= 100.0), 1, 2)


PATTERNS = ("intermittent", "static", "shock")
COUPLINGS = ("good", "fair", "poor", "unacceptable")


@dataclass(frozen=True)
class Circumstances:
    """Circumstances of a task; the default is nothing in the hands, done once.

    Attributes:
        load_kg: Load or force on hands or back [kg].
        load_pattern: ``"intermittent"``; ``"static"``, for repeated ones too; or ``"shock"``, also for a
            force that builds up rapidly.
        coupling: Hold on the load, one of :data:`COUPLINGS` ([Hignett2000]_ Table 2).
        static: Whether the posture is held for more than a minute, of a motion too short to show it.
        repeated: Whether an action is repeated more than four times a minute.
        rapid: Whether the action causes rapid large changes of posture, or stands on an unstable base.
        shoulder_raised: Whether a shoulder is raised: our bodies have no shoulder girdle to show it.
        trunk_supported: Whether the trunk of somebody seated is well supported.
        neck_upright_deg: Flexion of the body's neck when it is upright; of a recording see
            :func:`manikin.ergonomics.postural_angles.upright_neck` [deg].
        lifts_per_minute, lifting_hours: How often a load is lifted, and for how long at a stretch [h].
        people_age: Age of the people whose strength is compared [years]; None for that of the body.
        back_lever_m: Lever of the back's muscles about L5/S1 [m].
        cycles_per_minute: How often the motion is made; None where it is not known.
        job_hours: For how long such motions are made at a stretch [h]; None where it is not known.
        domestic: Whether what is pushed or pulled is used at home, not by workers.
    """

    load_kg: float = 0.0
    load_pattern: str = "intermittent"
    coupling: str = "good"
    static: bool = False
    repeated: bool = False
    rapid: bool = False
    shoulder_raised: bool = False
    trunk_supported: bool = False
    neck_upright_deg: float = 0.0
    lifts_per_minute: float = 0.2
    lifting_hours: float = 1.0
    people_age: float | None = None
    back_lever_m: float = 0.05
    cycles_per_minute: float | None = None
    job_hours: float | None = None
    domestic: bool = False

    def __post_init__(self) -> None:
        finite_number(self.load_kg, "load [kg]", at_least=0.0)
        finite_number(self.neck_upright_deg, "upright neck [deg]", at_least=-60.0, at_most=60.0)
        finite_number(self.lifts_per_minute, "lifts per minute", at_least=0.0)
        finite_number(self.lifting_hours, "hours of lifting", above=0.0, at_most=8.0)
        finite_number(self.back_lever_m, "lever of the back's muscles [m]", at_least=0.03, at_most=0.09)
        if self.cycles_per_minute is not None:
            finite_number(self.cycles_per_minute, "cycles per minute", at_least=0.0)
        if self.job_hours is not None:
            finite_number(self.job_hours, "hours of the job", above=0.0, at_most=8.0)
        if self.people_age is not None:
            finite_number(
                self.people_age, "age of the people [years]", at_least=AGE_RANGE[0], at_most=AGE_RANGE[1]
            )
        for name, value, valid in (
            ("load pattern", self.load_pattern, PATTERNS),
            ("coupling", self.coupling, COUPLINGS),
        ):
            if value not in valid:
                raise InputError(f"{name} is {value!r}; valid: {', '.join(valid)}")


REBA_TABLE_A = np.array([
    [[1, 2, 3, 4], [1, 2, 3, 4], [3, 3, 5, 6]],
    [[2, 3, 4, 5], [3, 4, 5, 6], [4, 5, 6, 7]],
    [[2, 4, 5, 6], [4, 5, 6, 7], [5, 6, 7, 8]],
    [[3, 5, 6, 7], [5, 6, 7, 8], [6, 7, 8, 9]],
    [[4, 6, 7, 8], [6, 7, 8, 9], [7, 8, 9, 9]],
])  # fmt: skip
"""Posture score of the body by trunk (5), neck (3) and legs (4)."""

REBA_TABLE_B = np.array([
    [[1, 2, 2], [1, 2, 3]],
    [[1, 2, 3], [2, 3, 4]],
    [[3, 4, 5], [4, 5, 5]],
    [[4, 5, 5], [5, 6, 7]],
    [[6, 7, 8], [7, 8, 8]],
    [[7, 8, 8], [8, 9, 9]],
])  # fmt: skip
"""Posture score of the arm by upper arm (6), lower arm (2) and wrist (3)."""

REBA_TABLE_C = np.array([
    [1, 1, 1, 2, 3, 3, 4, 5, 6, 7, 7, 7],
    [1, 2, 2, 3, 4, 4, 5, 6, 6, 7, 7, 8],
    [2, 3, 3, 3, 4, 5, 6, 7, 7, 8, 8, 8],
    [3, 4, 4, 4, 5, 6, 7, 8, 8, 9, 9, 9],
    [4, 4, 4, 5, 6, 7, 8, 8, 9, 9, 9, 9],
    [6, 6, 6, 7, 8, 8, 9, 9, 10, 10, 10, 10],
    [7, 7, 7, 8, 9, 9, 9, 10, 10, 11, 11, 11],
    [8, 8, 8, 9, 10, 10, 10, 10, 10, 11, 11, 11],
    [9, 9, 9, 10, 10, 10, 11, 11, 11, 12, 12, 12],
    [10, 10, 10, 11, 11, 11, 11, 12, 12, 12, 12, 12],
    [11, 11, 11, 11, 12, 12, 12, 12, 12, 12, 12, 12],
    [12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12],
])  # fmt: skip
"""Score C by score A of the body and score B of the arm, 1 to 12 each."""

RISKS = {0: "negligible", 1: "low", 2: "medium", 3: "high", 4: "very high"}
"""Risk by action level."""
_LEVEL_BEGINS = (2, 4, 8, 11)
_SLIGHT, _KNEE, _DEEP_KNEE, _HANGING = 20.0, 30.0, 60.0, 20.0


@dataclass(frozen=True, eq=False)
class RebaSteps:
    """Scores of the parts of the body, (n,) each or numbers; those of an arm are of one side.

    Trunk 1 to 5, neck 1 to 3, legs 1 to 4, upper arm 1 to 6, lower arm 1 or 2, wrist 1 to 3.
    """

    trunk: ArrayLike
    neck: ArrayLike
    legs: ArrayLike
    upper_arm: ArrayLike
    lower_arm: ArrayLike
    wrist: ArrayLike


def reba_score(
    steps: RebaSteps, *, load: ArrayLike = 0, coupling: ArrayLike = 0, activity: ArrayLike = 0
) -> Scores:
    """(n,) REBA score of postures, 1 to 15; of shape () for numbers.

    Args:
        load: 0 to 3, see :func:`reba_load`.
        coupling: 0 (good) to 3 (unacceptable).
        activity: 0 to 3: 1 each for what is held for more than a minute, small movements repeated more than
            four times a minute, and rapid large changes of posture or an unstable base.

    Raises:
        InputError: If a score is not among those of its part.
    """
    score_a = checked(load, 0, 3, "load") + looked_up(
        REBA_TABLE_A, trunk=steps.trunk, neck=steps.neck, legs=steps.legs
    )
    score_b = checked(coupling, 0, 3, "coupling") + looked_up(
        REBA_TABLE_B, upper_arm=steps.upper_arm, lower_arm=steps.lower_arm, wrist=steps.wrist
    )
    return looked_up(REBA_TABLE_C, score_a=score_a, score_b=score_b) + checked(activity, 0, 3, "activity")


def reba_load(load_kg: float, pattern: str = "intermittent") -> int:
    """Load score: 0 below 5 kg, 1 up to 10 kg, 2 above; one more for shocks."""
    return int(load_kg >= 5.0) + int(load_kg > 10.0) + int(pattern == "shock")


def reba_action_level(score: ArrayLike) -> Scores:
    """Action level, 0 to 4, of scores 1 to 15."""
    return np.searchsorted(_LEVEL_BEGINS, np.asarray(score), side="right")


def reba_steps(
    angles: PosturalAngles, bearing: Bearing, given: Circumstances | None = None
) -> Mapping[str, RebaSteps]:
    """Step scores of a motion, (n,) each, by side.

    Ours: an arm is assisted by gravity when it hangs, within 20 degrees of the vertical, from a trunk that is
    bent by more than that.
    """
    given = given or Circumstances()
    trunk = _bent_trunk(angles) + (turned(angles.trunk_twist) | turned(angles.trunk_side_bend))
    flexion = degrees(angles.neck_flexion)
    neck = np.where((flexion > _SLIGHT) | (flexion < -NEUTRAL), 2, 1)
    neck = neck + (turned(angles.neck_twist) | turned(angles.neck_side_bend))
    legs, leaning, found = _legs(angles, bearing), degrees(angles.trunk_flexion) > _SLIGHT, {}
    for side, arm in angles.arms.items():
        upper = _raised_arm(arm) + ((degrees(arm.abduction) > ABDUCTED) | _out(arm, np.abs(arm.outward)))
        hangs = (degrees(arm.from_vertical) <= _HANGING) & leaning
        upper = np.clip(upper + int(given.shoulder_raised) - (bearing.arms[side] | hangs), 1, 6)
        turned_hand = turned(arm.wrist_deviation) | (np.abs(degrees(arm.wrist_twist)) > WRIST_AT_END)
        wrist = band(np.abs(degrees(arm.wrist_flexion)), WRIST_BENT) + turned_hand
        found[side] = RebaSteps(trunk, neck, legs, upper, _lower_arm(arm), wrist)
    return found


def _legs(angles: PosturalAngles, bearing: Bearing) -> Scores:
    """Both legs, walking or sitting 1, else 2; more for bent knees of those who do not sit.

    While walking the straighter knee counts, as the swinging leg is bent without carrying (ours).
    """
    score = np.where(bearing.balanced | bearing.walking | bearing.seated, 1, 2)
    knees = np.array([degrees(angle) for angle in angles.knees.values()])
    knee = np.where(bearing.walking, knees.min(axis=0), knees.max(axis=0))
    bent = (knee >= _KNEE).astype(np.int64) + (knee > _DEEP_KNEE)
    return score + np.where(bearing.seated, 0, bent)


TABLE_A = np.array([
    [[1, 2, 2, 2, 2, 3, 3, 3], [2, 2, 2, 2, 3, 3, 3, 3], [2, 3, 3, 3, 3, 3, 4, 4]],
    [[2, 3, 3, 3, 3, 4, 4, 4], [3, 3, 3, 3, 3, 4, 4, 4], [3, 4, 4, 4, 4, 4, 5, 5]],
    [[3, 3, 4, 4, 4, 4, 5, 5], [3, 4, 4, 4, 4, 4, 5, 5], [4, 4, 4, 4, 4, 5, 5, 5]],
    [[4, 4, 4, 4, 4, 5, 5, 5], [4, 4, 4, 4, 4, 5, 5, 5], [4, 4, 4, 5, 5, 5, 6, 6]],
    [[5, 5, 5, 5, 5, 6, 6, 7], [5, 6, 6, 6, 6, 7, 7, 7], [6, 6, 6, 7, 7, 7, 7, 8]],
    [[7, 7, 7, 7, 7, 8, 8, 9], [8, 8, 8, 8, 8, 9, 9, 9], [9, 9, 9, 9, 9, 9, 9, 9]],
]).reshape(6, 3, 4, 2)  # fmt: skip
"""Posture score of the arm by upper arm (6), lower arm (3), wrist (4) and wrist twist (2)."""

TABLE_B = np.array([
    [1, 3, 2, 3, 3, 4, 5, 5, 6, 6, 7, 7],
    [2, 3, 2, 3, 4, 5, 5, 5, 6, 7, 7, 7],
    [3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 7],
    [5, 5, 5, 6, 6, 7, 7, 7, 7, 7, 8, 8],
    [7, 7, 7, 7, 7, 8, 8, 8, 8, 8, 8, 8],
    [8, 8, 8, 8, 8, 8, 8, 9, 9, 9, 9, 9],
]).reshape(6, 6, 2)  # fmt: skip
"""Posture score of the body by neck (6), trunk (6) and legs (2)."""

TABLE_C = np.array([
    [1, 2, 3, 3, 4, 5, 5],
    [2, 2, 3, 4, 4, 5, 5],
    [3, 3, 3, 4, 4, 5, 6],
    [3, 3, 3, 4, 5, 6, 6],
    [4, 4, 4, 5, 6, 7, 7],
    [4, 4, 5, 6, 6, 7, 7],
    [5, 5, 6, 6, 7, 7, 7],
    [5, 5, 6, 7, 7, 7, 7],
])  # fmt: skip
"""Grand score by score C of the arm (1 to 8 and more) and score D of the body (1 to 7 and more)."""

ACTIONS = {
    1: "acceptable unless held or repeated for long", 2: "further investigation, changes may be required",
    3: "investigation and changes soon", 4: "investigation and changes immediately",
}  # fmt: skip
"""What is to be done, by action level."""


@dataclass(frozen=True, eq=False)
class RulaSteps:
    """Scores of the parts of the body, (n,) each or numbers; those of an arm are of one side.

    Upper arm 1 to 6, lower arm 1 to 3, wrist 1 to 4, its twist 1 or 2, neck and trunk 1 to 6, legs 1 or 2.
    """

    upper_arm: ArrayLike
    lower_arm: ArrayLike
    wrist: ArrayLike
    wrist_twist: ArrayLike
    neck: ArrayLike
    trunk: ArrayLike
    legs: ArrayLike


def rula_score(
    steps: RulaSteps, *, muscle_arm: ArrayLike = 0, muscle_body: ArrayLike = 0, force: ArrayLike = 0
) -> Scores:
    """(n,) grand score of postures, 1 to 7; of shape () for numbers.

    Args:
        muscle_arm: 1 where the arm is held for more than a minute or moves more than four times a minute.
        muscle_body: The same of neck, trunk and legs.
        force: 0 to 3, see :func:`rula_force`; it counts for both.

    Raises:
        InputError: If a score is not among those of its part.
    """
    added = checked(force, 0, 3, "force")
    score_c = added + checked(muscle_arm, 0, 1, "muscle use") + looked_up(
        TABLE_A, upper_arm=steps.upper_arm, lower_arm=steps.lower_arm, wrist=steps.wrist,
        wrist_twist=steps.wrist_twist,
    )  # fmt: skip
    score_d = added + checked(muscle_body, 0, 1, "muscle use") + looked_up(
        TABLE_B, neck=steps.neck, trunk=steps.trunk, legs=steps.legs
    )  # fmt: skip
    return looked_up(TABLE_C, score_c=np.minimum(score_c, 8), score_d=np.minimum(score_d, 7))


def rula_force(load_kg: float, pattern: str = "intermittent") -> int:
    """Force score: 0 below 2 kg, 1 up to 10 kg, 2 above; one more where static or repeated; 3 for shocks."""
    if pattern == "shock":
        return 3
    return int(load_kg >= 2.0) + int(load_kg > 10.0) + int(pattern == "static" and load_kg >= 2.0)


def rula_action_level(score: ArrayLike) -> Scores:
    """Action level, 1 to 4, of grand scores 1 to 7."""
    return (np.asarray(score) + 1) // 2


def rula_steps(
    angles: PosturalAngles, bearing: Bearing, given: Circumstances | None = None
) -> Mapping[str, RulaSteps]:
    """Step scores of a motion, (n,) each, by side."""
    given = given or Circumstances()
    flexion = degrees(angles.neck_flexion)
    neck = np.where(flexion < -NEUTRAL, 4, band(flexion, 10.0, 20.0))
    neck = neck + turned(angles.neck_twist) + turned(angles.neck_side_bend)
    trunk = _sitting_trunk(angles, bearing, given)
    legs, found = np.where(bearing.balanced | (bearing.seated & bearing.both_legs), 1, 2), {}
    for side, arm in angles.arms.items():
        upper = _raised_arm(arm) + (degrees(arm.abduction) > ABDUCTED)
        upper = np.clip(upper + int(given.shoulder_raised) - bearing.arms[side], 1, 6)
        lower = _lower_arm(arm) + (_out(arm, arm.outward) | (arm.aside < 0.0))  # or across the midline
        bent = np.abs(degrees(arm.wrist_flexion))
        wrist = band(bent, WRIST_NEUTRAL, WRIST_BENT) + turned(arm.wrist_deviation)
        twist = np.where(np.abs(degrees(arm.wrist_twist)) > WRIST_AT_END, 2, 1)
        found[side] = RulaSteps(upper, lower, wrist, twist, neck, trunk, legs)
    return found


def _sitting_trunk(angles: PosturalAngles, bearing: Bearing, given: Circumstances) -> Scores:
    """Score of a trunk in RULA, of who sits with or without support, too."""
    score = _bent_trunk(angles)
    unsupported = bearing.seated & (not given.trunk_supported)
    supported = bearing.seated & given.trunk_supported & (degrees(angles.trunk_flexion) <= NEUTRAL)
    score = np.where(supported, 1, np.where(unsupported, np.maximum(score, 2), score))
    return score + turned(angles.trunk_twist) + turned(angles.trunk_side_bend)
