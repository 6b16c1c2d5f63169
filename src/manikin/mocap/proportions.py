"""The human of a recorded person: lengths between joint centres, and the stature they tell."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, human
from manikin.body.anthropometry import Anthropometry
from manikin.mocap.anatomy import SIDES
from manikin.spatial import FloatArray

REFERENCE_STATURE = 1.75
REFERENCE_MASS = 79.0
"""Person of whom others are multiples [m], [kg]."""

_BONES = {
    "thigh": ("thigh", "leg"), "shank": ("leg", "foot"),
    "upper_arm": ("upper_arm", "forearm"), "forearm": ("forearm", "hand"),
}  # fmt: skip

UPRIGHT_SHARE = 90.0
"""Percentile of the distance of shoulders from hips that is the trunk's: a bent trunk is shorter."""


def segment_lengths(centres: Mapping[str, FloatArray]) -> dict[str, float]:
    """Lengths of a person [m] by the names of :data:`manikin.body.anthropometry.MEASURED_LENGTHS`.

    Medians over the instants and the mean of both sides; the trunk's is taken where it is
    extended and no arm is raised.

    Args:
        centres: (n, 3) joint centres [m], see :func:`manikin.mocap.joint_centres.joint_centres`.
    """

    def apart(first: str, second: str) -> float:
        return float(np.median(np.linalg.norm(centres[first] - centres[second], axis=1)))

    found = {
        name: float(np.mean([apart(f"{side}_{near}", f"{side}_{far}") for side in SIDES]))
        for name, (near, far) in _BONES.items()
    }
    found["hips"] = apart("left_thigh", "right_thigh")
    found["shoulders"] = apart("left_upper_arm", "right_upper_arm")
    length = np.linalg.norm(middle(centres, "upper_arm") - middle(centres, "thigh"), axis=1)
    upright = np.percentile(length[hanging_arms(centres)], UPRIGHT_SHARE)
    # Where arms hang in a crouch only, the trunk is never upright then.
    found["trunk"] = float(max(upright, np.median(length)))
    return found


def hanging_arms(centres: Mapping[str, FloatArray]) -> NDArray[np.int64]:
    """Instants at which no upper arm is raised, which would raise the shoulders too; all if there are none.

    An arm hangs within 60 degrees of the line from the shoulders to the hips.
    """
    down = middle(centres, "thigh") - middle(centres, "upper_arm")
    cosines = []
    for side in SIDES:
        arm = centres[f"{side}_forearm"] - centres[f"{side}_upper_arm"]
        sizes = np.linalg.norm(arm, axis=1) * np.linalg.norm(down, axis=1)
        cosines.append(np.sum(arm * down, axis=1) / np.maximum(sizes, 1e-9))
    found = np.flatnonzero(np.min(cosines, axis=0) > 0.5)
    return found if found.size else np.arange(len(down))


def middle(centres: Mapping[str, FloatArray], part: str) -> FloatArray:
    """(n, 3) midway between the left and the right joint [m]."""
    return 0.5 * (centres[f"left_{part}"] + centres[f"right_{part}"])


def human_of(centres: Mapping[str, FloatArray], sex: str = "male", mass: float | None = None) -> BodyModel:
    """Our human with the lengths of a recorded person.

    The stature is the one whose thigh, shank and trunk add up to the recorded ones.

    Args:
        centres: (n, 3) joint centres [m].
        sex: Table of the segment masses.
        mass: Body mass [kg]; None for the body mass index of 79 kg at 1.75 m.

    Raises:
        BodyError: If a length or the stature is not that of an adult.
    """
    lengths = segment_lengths(centres)
    usual = Anthropometry(REFERENCE_STATURE, REFERENCE_MASS, sex)
    height = usual.length("thigh") + usual.length("shank") + usual.shoulder_height
    stature = REFERENCE_STATURE * (lengths["thigh"] + lengths["shank"] + lengths["trunk"]) / height
    if mass is None:
        mass = REFERENCE_MASS * (stature / REFERENCE_STATURE) ** 2
    return human(stature, mass, sex, lengths=lengths)
