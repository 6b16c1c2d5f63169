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
    extended and no arm is raised. Lengths of which a joint is missing are left out.

    Args:
        centres: (n, 3) joint centres [m], see :func:`manikin.mocap.joint_centres.joint_centres`; NaN where
            one is not known.
    """

    def apart(first: str, second: str) -> float:
        if first not in centres or second not in centres:
            return np.nan
        distance = np.linalg.norm(centres[first] - centres[second], axis=1)
        return float(np.median(distance[~np.isnan(distance)])) if not np.all(np.isnan(distance)) else np.nan

    pairs = {
        name: [(f"{side}_{near}", f"{side}_{far}") for side in SIDES] for name, (near, far) in _BONES.items()
    }
    pairs |= {
        "hips": [("left_thigh", "right_thigh")],
        "shoulders": [("left_upper_arm", "right_upper_arm")],
    }
    lengths = {name: [apart(*pair) for pair in both] for name, both in pairs.items()}
    found = {name: float(np.nanmean(both)) for name, both in lengths.items() if not np.all(np.isnan(both))}
    if "hips" in found and "shoulders" in found:
        length = np.linalg.norm(middle(centres, "upper_arm") - middle(centres, "thigh"), axis=1)
        if not np.all(np.isnan(length)):
            found["trunk"] = _trunk(centres, length)
    return found


def _trunk(centres: Mapping[str, FloatArray], length: FloatArray) -> float:
    """Where it is extended and no arm is raised [m]."""
    upright = np.percentile(length[hanging_arms(centres)], UPRIGHT_SHARE)
    # Where arms hang in a crouch only, the trunk is never upright then.
    return float(max(upright, np.median(length[~np.isnan(length)])))


def hanging_arms(centres: Mapping[str, FloatArray]) -> NDArray[np.int64]:
    """Instants at which no upper arm is raised, which would raise the shoulders too; all if there are none.

    An arm hangs within 60 degrees of the line from the shoulders to the hips. Instants at which shoulders or
    hips are not known are none; an arm whose elbow is not known counts as hanging.
    """
    down = middle(centres, "thigh") - middle(centres, "upper_arm")
    cosines = []
    known = ~np.isnan(down[:, 0])
    for side in SIDES:
        arm = centres.get(f"{side}_forearm", np.full_like(down, np.nan)) - centres[f"{side}_upper_arm"]
        sizes = np.linalg.norm(arm, axis=1) * np.linalg.norm(down, axis=1)
        cosine = np.sum(arm * down, axis=1) / np.maximum(sizes, 1e-9)
        cosines.append(np.where(np.isnan(cosine), 1.0, cosine))
    found = np.flatnonzero((np.min(cosines, axis=0) > 0.5) & known)
    return found if found.size else np.flatnonzero(known)


def middle(centres: Mapping[str, FloatArray], part: str) -> FloatArray:
    """(n, 3) midway between the left and the right joint [m]."""
    return 0.5 * (centres[f"left_{part}"] + centres[f"right_{part}"])


def human_of(
    centres: Mapping[str, FloatArray],
    sex: str = "male",
    mass: float | None = None,
    stature: float | None = None,
) -> BodyModel:
    """Our human with the lengths of a recorded person, its masses off the lines between joints.

    Args:
        centres: (n, 3) joint centres [m]; what is missing is scaled with the stature.
        sex: Table of the segment masses.
        mass: Body mass [kg]; None for the body mass index of 79 kg at 1.75 m.
        stature: Sole to vertex [m]; None for the one whose thigh, shank and trunk add up to theirs.

    Raises:
        BodyError: If a length or the stature is not that of an adult.
    """
    lengths = segment_lengths(centres)
    if stature is None:
        usual = Anthropometry(REFERENCE_STATURE, REFERENCE_MASS, sex)
        heights = {
            "thigh": usual.length("thigh"),
            "shank": usual.length("shank"),
            "trunk": usual.shoulder_height,
        }
        known = [name for name in heights if name in lengths]
        share = sum(lengths[n] for n in known) / sum(heights[n] for n in known) if known else 1.0
        stature = REFERENCE_STATURE * share
    if mass is None:
        mass = REFERENCE_MASS * (stature / REFERENCE_STATURE) ** 2
    return human(stature, mass, sex, lengths=lengths, off_axis_masses=True)
