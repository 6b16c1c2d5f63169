"""Outer dimensions of a person, as anthropometric surveys give them, and the lengths that follow from them.

Means that place the landmarks: 2012 Anthropometric Survey of U.S. Army Personnel (ANSUR II; Gordon et al.,
NATICK/TR-15/007, 4082 men and 1986 women), computed from its public data.

* The trochanterion lies at the height of the hip joints. Its mean height and the mean sitting height together
  exceed the mean stature by 63 mm (men) and 74 mm (women): so deep is a seat below the hip joints, per
  stature, where a body is given only one of the two. Given both, the seat's depth is what they leave.
* Acromion and radial styloid lie beyond the joints of shoulder and wrist by what the mean dimensions exceed
  the scaled distances of the joints (ours).
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from manikin.body.anthropometry import Anthropometry, Sex
from manikin.body.model import BodyModel
from manikin.errors import BodyError
from manikin.numerics.spatial import finite_number

DIMENSIONS: Mapping[str, tuple[float, float]] = MappingProxyType({
    "sitting_height": (0.60, 1.20), "leg_length": (0.55, 1.20), "arm_length": (0.35, 0.85),
    "shoulder_breadth": (0.25, 0.55), "hip_breadth": (0.20, 0.70),
})  # fmt: skip
"""Dimensions that may be given, and what is accepted [m].

``sitting_height`` from the seat to the vertex, ``leg_length`` from the ground to the hip joints of one who
stands, ``arm_length`` from the acromion to the radial styloid, ``shoulder_breadth`` between the acromia,
``hip_breadth`` over the flesh.
"""

SEAT_DEPTHS = {Sex.MALE: 0.06301 / 1.75621, Sex.FEMALE: 0.07351 / 1.62847}
"""Mean sitting height and trochanterion height less stature, per stature."""

BEYOND_ARM = {
    Sex.MALE: 0.60312 / 1.75621 - (0.2817 + 0.2689) / 1.741,
    Sex.FEMALE: 0.55253 / 1.62847 - (0.2751 + 0.2643) / 1.735,
}
"""Mean length from acromion to radial styloid less that from joint to joint, per stature."""

BEYOND_SHOULDERS = {Sex.MALE: 0.41568 / 1.75621 - 0.210, Sex.FEMALE: 0.36535 / 1.62847 - 0.200}
"""Mean breadth between the acromia less the distance of the shoulder joints, per stature."""

_SPINE = ("lower_trunk", "middle_trunk", "upper_trunk", "head_and_neck")


def lengths_of(size: Anthropometry, dimensions: Mapping[str, float]) -> dict[str, float]:
    """Lengths [m], by the names of ``MEASURED_LENGTHS``, of a body with the dimensions and the same stature.

    Args:
        size: The scaled body, nothing measured.
        dimensions: Dimensions [m] by the names of :data:`DIMENSIONS`.

    Raises:
        BodyError: If a name is unknown, a value is out of its range, or values contradict each other.
    """
    unknown = set(dimensions) - set(DIMENSIONS)
    if unknown:
        raise BodyError(f"body dimension is {min(unknown)!r}; valid: {', '.join(DIMENSIONS)}")
    for name, value in dimensions.items():
        low, high = DIMENSIONS[name]
        finite_number(value, f"body {name} [m]", at_least=low, at_most=high, error=BodyError)
    lengths = _upright_lengths(size, dimensions.get("sitting_height"), dimensions.get("leg_length"))
    if "arm_length" in dimensions:
        joints = dimensions["arm_length"] - BEYOND_ARM[size.sex] * size.stature
        factor = joints / (size.length("upper_arm") + size.length("forearm"))
        lengths |= {name: factor * size.length(name) for name in ("upper_arm", "forearm")}
    if "shoulder_breadth" in dimensions:
        lengths["shoulders"] = dimensions["shoulder_breadth"] - BEYOND_SHOULDERS[size.sex] * size.stature
    if "hip_breadth" in dimensions:
        lengths["hip_breadth"] = dimensions["hip_breadth"]
    return lengths


def _upright_lengths(size: Anthropometry, sitting: float | None, legs: float | None) -> dict[str, float]:
    """Lengths along the upright body, whose sum is the stature."""
    if sitting is None and legs is None:
        return {}
    seat = SEAT_DEPTHS[size.sex] * size.stature
    if sitting is not None and legs is not None:
        seat = sitting + legs - size.stature
        if not 0.03 <= seat / size.stature <= 0.10:
            raise BodyError(
                f"body sitting_height {sitting:g} m and leg_length {legs:g} m exceed the stature "
                f"{size.stature:g} m by {seat:.3f} m, the depth of the seat below the hip joints; "
                f"valid: {0.03 * size.stature:.3f} to {0.10 * size.stature:.3f} m"
            )
    hips = legs if legs is not None else size.stature - (sitting or 0.0) + seat
    spine = (size.stature - hips) / sum(size.length(name) for name in _SPINE)
    leg = (hips - size.ankle_height) / (size.length("thigh") + size.length("shank"))
    return {
        "trunk": spine * size.shoulder_height, "head_and_neck": spine * size.length("head_and_neck"),
        "thigh": leg * size.length("thigh"), "shank": leg * size.length("shank"), "seat_depth": seat,
    }  # fmt: skip


def measured_dimensions(body: BodyModel) -> dict[str, float]:
    """Stature and the dimensions of :data:`DIMENSIONS` of a human, measured on its segments [m].

    Raises:
        BodyError: If the body is not a human.
    """
    if body.stature is None or body.sex is None or "buttocks" not in body.effectors:
        raise BodyError(f"body {body.name!r} has no dimensions to measure; valid: a human")
    places: dict[str, np.ndarray] = {}
    for segment in body.segments:
        places[segment.name] = segment.origin + places.get(segment.parent or "", np.zeros(3))

    def effector(name: str) -> np.ndarray:
        item = body.effectors[name]
        return places[item.segment] + item.translation

    vertex, sole, sex = effector("head")[2], effector("left_foot")[2], Sex(body.sex)
    shoulder, wrist = places["left_upper_arm"], places["left_hand"]
    hips = next(shape for shape in body.segments[0].shapes if shape.name == "hips")
    return {
        "stature": float(vertex - sole), "sitting_height": float(vertex - effector("buttocks")[2]),
        "leg_length": float(places["left_thigh"][2] - sole),
        "arm_length": float(np.linalg.norm(shoulder - wrist)) + BEYOND_ARM[sex] * body.stature,
        "shoulder_breadth": float(2.0 * shoulder[1]) + BEYOND_SHOULDERS[sex] * body.stature,
        "hip_breadth": float(hips.size[1] + 2.0 * hips.size[0]),
    }  # fmt: skip
