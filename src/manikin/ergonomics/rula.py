"""RULA, the rapid upper limb assessment ([McAtamney1993]_): step scores, tables and grand score."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.ergonomics.bearing import Bearing
from manikin.ergonomics.circumstances import Circumstances
from manikin.ergonomics.parts import SIDES
from manikin.ergonomics.postural_angles import PosturalAngles
from manikin.ergonomics.tables import Scores, checked, looked_up
from manikin.ergonomics.thresholds import (
    ABDUCTED,
    NEUTRAL,
    TURNED,
    WRIST_AT_END,
    WRIST_BENT,
    WRIST_NEUTRAL,
    band,
    degrees,
    out_of_line,
    turned,
)

TABLE_A = np.array([
    [[1, 2, 2, 2, 2, 3, 3, 3], [2, 2, 2, 2, 3, 3, 3, 3], [2, 3, 3, 3, 3, 3, 4, 4]],
    [[2, 3, 3, 3, 3, 4, 4, 4], [3, 3, 3, 3, 3, 4, 4, 4], [3, 4, 4, 4, 4, 4, 5, 5]],
    [[3, 3, 4, 4, 4, 4, 5, 5], [3, 4, 4, 4, 4, 4, 5, 5], [4, 4, 4, 4, 4, 5, 5, 5]],
    [[4, 4, 4, 4, 4, 5, 5, 5], [4, 4, 4, 4, 4, 5, 5, 5], [4, 4, 4, 5, 5, 5, 6, 6]],
    [[5, 5, 5, 5, 5, 6, 6, 7], [5, 6, 6, 6, 6, 7, 7, 7], [6, 6, 6, 7, 7, 7, 7, 8]],
    [[7, 7, 7, 7, 7, 8, 8, 9], [8, 8, 8, 8, 8, 9, 9, 9], [9, 9, 9, 9, 9, 9, 9, 9]],
]).reshape(6, 3, 4, 2)  # fmt: skip
"""Posture score of the arm by upper arm (6), lower arm (3), wrist (4) and wrist twist (2)."""

TABLE_B = np.array(
    [
        [1, 3, 2, 3, 3, 4, 5, 5, 6, 6, 7, 7],
        [2, 3, 2, 3, 4, 5, 5, 5, 6, 7, 7, 7],
        [3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 7],
        [5, 5, 5, 6, 6, 7, 7, 7, 7, 7, 8, 8],
        [7, 7, 7, 7, 7, 8, 8, 8, 8, 8, 8, 8],
        [8, 8, 8, 8, 8, 8, 8, 9, 9, 9, 9, 9],
    ]
).reshape(6, 6, 2)
"""Posture score of the body by neck (6), trunk (6) and legs (2)."""

TABLE_C = np.array(
    [
        [1, 2, 3, 3, 4, 5, 5],
        [2, 2, 3, 4, 4, 5, 5],
        [3, 3, 3, 4, 4, 5, 6],
        [3, 3, 3, 4, 5, 6, 6],
        [4, 4, 4, 5, 6, 7, 7],
        [4, 4, 5, 6, 6, 7, 7],
        [5, 5, 6, 6, 7, 7, 7],
        [5, 5, 6, 7, 7, 7, 7],
    ]
)
"""Grand score by score C of the arm (1 to 8 and more) and score D of the body (1 to 7 and more)."""

ACTIONS = {
    1: "acceptable unless held or repeated for long",
    2: "further investigation, changes may be required",
    3: "investigation and changes soon",
    4: "investigation and changes immediately",
}
"""What is to be done, by action level."""


@dataclass(frozen=True, eq=False)
class RulaSteps:
    """Scores of the parts of the body, (n,) each or numbers; those of an arm are of one side.

    Attributes:
        upper_arm: 1 to 6.
        lower_arm: 1 to 3.
        wrist: 1 to 4.
        wrist_twist: 1 or 2.
        neck: 1 to 6.
        trunk: 1 to 6.
        legs: 1 or 2.
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
    """Grand score of postures, 1 to 7.

    Args:
        steps: Of the postures.
        muscle_arm: 1 where the arm is held for more than a minute or moves more than four times a minute.
        muscle_body: The same of neck, trunk and legs.
        force: 0 to 3, see :func:`rula_force`; it counts for both.

    Returns:
        (n,), or of shape () for numbers.

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
    """Step scores of a motion, by side.

    Where the paper gives no number (upright, abducted, twisted, out to the side, end of range) those of
    :mod:`manikin.ergonomics.thresholds` are taken.

    Args:
        angles: (n,) each.
        bearing: What carries the weight.
        given: What the motion does not tell.
    """
    circumstances = given or Circumstances()
    neck, trunk = _neck(angles), _trunk(angles, bearing, circumstances)
    legs = np.where(bearing.balanced | (bearing.seated & bearing.both_legs), 1, 2)
    return {side: _arm(angles, bearing, circumstances, side, neck, trunk, legs) for side in SIDES}


def _neck(angles: PosturalAngles) -> Scores:
    flexion = degrees(angles.neck_flexion)
    score = np.where(flexion < -NEUTRAL, 4, band(flexion, 10.0, 20.0))
    return score + turned(angles.neck_twist) + turned(angles.neck_side_bend)


def _trunk(angles: PosturalAngles, bearing: Bearing, given: Circumstances) -> Scores:
    flexion = degrees(angles.trunk_flexion)
    forward, backward = band(flexion, NEUTRAL, 20.0, 60.0), band(-flexion, NEUTRAL, 20.0)
    score = np.maximum(forward, backward)
    unsupported = bearing.seated & (not given.trunk_supported)
    supported = bearing.seated & given.trunk_supported & (flexion <= NEUTRAL)
    score = np.where(supported, 1, np.where(unsupported, np.maximum(score, 2), score))
    return score + turned(angles.trunk_twist) + turned(angles.trunk_side_bend)


def _arm(
    angles: PosturalAngles,
    bearing: Bearing,
    given: Circumstances,
    side: str,
    neck: Scores,
    trunk: Scores,
    legs: Scores,
) -> RulaSteps:
    arm = angles.arms[side]
    raised, elbow = degrees(arm.raised), degrees(arm.elbow)
    upper = np.where(raised < -20.0, 2, band(raised, 20.0, 45.0, 90.0)) + (degrees(arm.abduction) > ABDUCTED)
    upper = upper + int(given.shoulder_raised) - bearing.arms[side]
    lower = np.where((elbow >= 60.0) & (elbow <= 100.0), 1, 2) + out_of_line(arm)
    bent = np.abs(degrees(arm.wrist_flexion))
    wrist = band(bent, WRIST_NEUTRAL, WRIST_BENT) + (np.abs(degrees(arm.wrist_deviation)) > TURNED)
    twist = np.where(np.abs(degrees(arm.wrist_twist)) > WRIST_AT_END, 2, 1)
    return RulaSteps(np.clip(upper, 1, 6), lower, wrist, twist, neck, trunk, legs)
