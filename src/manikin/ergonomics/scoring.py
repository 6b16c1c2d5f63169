"""Circumstances of a task that a motion does not contain, and the thresholds of RULA and REBA.

Both methods say "upright", "twisted", "abducted", "across the midline" without a number, but every measured
posture is a little twisted. The values here are our choice, near what an observer would notice, in degrees
as the published ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.ergonomics.postural_angles import ArmAngles
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number

Scores = NDArray[np.int64]


def looked_up(table: Scores, **steps: ArrayLike) -> Scores:
    """Entries of a table whose axes all begin with the score 1.

    Args:
        table: One axis per step.
        steps: Scores of each axis in order, arrays or numbers; their names are those of the messages.

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

WRIST_NEUTRAL = 5.0
"""Up to this a wrist is neither flexed nor extended [deg]."""

WRIST_BENT = 15.0
"""Beyond this it is strongly so [deg]; published."""

WRIST_AT_END = 60.0
"""Beyond this a forearm is turned to near the end of its range [deg], which is 80 deg to either side."""

OUTWARD = 30.0
"""A bent forearm that points further out than this works out to the side of the body [deg]."""

BENT_ELBOW = 30.0
"""Less bent arms hang; they point where the upper arm does [deg]."""


def degrees(angle: FloatArray) -> FloatArray:
    """(n,) angle in degrees, rounded to 1e-9 so that a posture on a border falls on its published side."""
    return np.asarray(np.round(np.rad2deg(angle), 9), dtype=np.float64)


def band(value: FloatArray, *borders: float) -> NDArray[np.int64]:
    """(n,) 1 up to and with the first border, 2 up to the second, and so on."""
    return 1 + np.sum([value > border for border in borders], axis=0)


def turned(angle: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a trunk or neck is twisted or bent to the side."""
    return np.abs(degrees(angle)) > TURNED


def out_of_line(arm: ArmAngles) -> NDArray[np.bool_]:
    """(n,) whether an arm works across the midline of the body or out to its side."""
    out = (degrees(arm.elbow) > BENT_ELBOW) & (degrees(arm.outward) > OUTWARD)
    return out | (arm.aside < 0.0)


def rotated(arm: ArmAngles) -> NDArray[np.bool_]:
    """(n,) whether an upper arm is turned about itself: the bent forearm points out of the sagittal plane."""
    return (degrees(arm.elbow) > BENT_ELBOW) & (np.abs(degrees(arm.outward)) > OUTWARD)


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

    def __post_init__(self) -> None:
        finite_number(self.load_kg, "load [kg]", at_least=0.0)
        finite_number(self.neck_upright_deg, "upright neck [deg]", at_least=-60.0, at_most=60.0)
        for name, value, valid in (
            ("load pattern", self.load_pattern, PATTERNS),
            ("coupling", self.coupling, COUPLINGS),
        ):
            if value not in valid:
                raise InputError(f"{name} is {value!r}; valid: {', '.join(valid)}")
