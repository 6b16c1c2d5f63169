"""Published proportions of the adult body and their scaling to one person.

What comes from where:

* Segment masses, centres of mass, radii of gyration and lengths: de Leva, "Adjustments to
  Zatsiorsky-Seluyanov's segment inertia parameters", J. Biomech. 29(9), 1996, Table 4 (61.9 kg, 1.735 m
  women; 73.0 kg, 1.741 m men). Joint-centre rows are used: VERT-CERV for head and neck, CERV-XYPH, XYPH-OMPH
  and OMPH-MIDH for the trunk, KJC-AJC for the shank, WJC-DAC3 for the hand.
* Height of the shoulder joints above the hip joints: the MIDS-MIDH length of the same table.
* Hip breadth 0.191 H: Drillis and Contini (1966), as reprinted in Winter, "Biomechanics and Motor Control of
  Human Movement", 4th ed. 2009, Fig. 4.1. The same figure has the malleolus at 0.039 H.

Our choices, for want of one table that fits the others:

* Ankle joint 0.043 H above the sole (0.075 m at 1.75 m): Drillis and Contini's bare malleolus plus a thin
  shoe sole, well below the 0.10 m of [Qiu2012]_ Fig. 6.7.
* de Leva's vertical lengths are curve and landmark distances; with the ankle they add up to 1.003 H (women)
  and 1.024 H (men). Legs, trunk, neck and head are scaled by one common factor, so that sole to vertex is the
  stature exactly. Arms and feet keep their lengths.
* Distances between hip joint centres 0.100 H and between shoulder joint centres 0.210 H (men) and 0.200 H
  (women), both well inside the breadths over the flesh.
* The neck is the lower third of VERT-CERV and has a fifth of the head-and-neck mass, as an upright cylinder;
  the head has the rest, so that both together keep de Leva's mass, centre of mass and radii of gyration.
* The toes are the front 27 % of the foot (the metatarsal heads lie at about 73 % of its length from the heel)
  with a tenth of its mass, as a box; both together keep de Leva's foot. Its centre of mass is at 0.4 of the
  ankle's height. The fingers are rigid in the hand.
* The sole is 0.16 H x 0.12/1.75 H, the shoe of [Qiu2012]_ 5.4.4 at 1.75 m; de Leva's bare foot lies in its
  middle. The ankle is above 26 % of the sole's length from the heel.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from manikin.errors import BodyError
from manikin.limits import BODY_MASS_INDEX_RANGE, MASS_RANGE, STATURE_RANGE
from manikin.numerics.spatial import FloatArray, finite_number

SOLE_LENGTH_RANGE, SOLE_WIDTH_RANGE = (0.12, 0.40), (0.05, 0.16)
"""Accepted size of the soles [m]; that of the person is in :mod:`manikin.limits`."""
ANKLE_HEIGHT, NECK_RADIUS = 0.043, 0.034
"""Ankle joint above the sole and radius of the neck, per stature."""
ANKLE_FROM_HEEL, TOE_HINGE_FROM_HEEL = 0.26, 0.73
"""Ankle joint and metatarsal line in front of the heel, per sole length."""
TOES_MASS_SHARE, NECK_MASS_SHARE = 0.10, 0.20
"""Mass of the toes per mass of the foot, and of the neck per mass of head and neck."""
NECK_LENGTH_SHARE = 1.0 / 3.0
"""Length of the neck per cervicale-vertex length."""
HIP_JOINT_DISTANCE, HIP_BREADTH = 0.100, 0.191
"""Distance of the hip joint centres and breadth of the hips over the flesh, per stature."""
SEAT_DEPTH = 0.07
"""Depth of the pressed buttocks below the hip joints, per stature (our choice)."""

MEASURED_LENGTHS: Mapping[str, tuple[float, float]] = MappingProxyType({
    "hips": (0.04, 0.40), "thigh": (0.15, 0.70), "shank": (0.15, 0.70), "trunk": (0.20, 0.80),
    "shoulders": (0.12, 0.60), "upper_arm": (0.10, 0.50), "forearm": (0.08, 0.50),
    "head_and_neck": (0.15, 0.40), "seat_depth": (0.04, 0.20), "hip_breadth": (0.20, 0.70),
})  # fmt: skip
"""Lengths that may be given instead of scaled, most of them between joint centres, and what is accepted [m].

``hips`` and ``shoulders`` are the distances of the left joint from the right one, ``trunk`` is the
height of the shoulder joints above the hip joints, ``head_and_neck`` reaches from C7 to the vertex,
``seat_depth`` from the hip joints down to a seat, ``hip_breadth`` is measured over the flesh.
"""


class Sex(StrEnum):
    """Which of the two published tables is scaled."""

    MALE = "male"
    FEMALE = "female"


@dataclass(frozen=True)
class SegmentParameters:
    """One row of de Leva's Table 4 for one sex.

    Attributes:
        mass: Fraction of the body mass.
        length: [m] for the mean stature of the sample.
        com: Distance of the centre of mass from the first-named landmark, per length.
        radii: Of gyration about the sagittal (fore-aft), transverse and longitudinal axes, per length.
    """

    mass: float
    length: float
    com: float
    radii: tuple[float, float, float]


SAMPLE_STATURE = {Sex.FEMALE: 1.735, Sex.MALE: 1.741}
"""Mean stature of the samples behind Table 4 [m]."""

SHOULDER_HEIGHT = {Sex.FEMALE: 0.4979, Sex.MALE: 0.5155}
"""MIDS-MIDH: shoulder joints above the hip joints [m], for the mean stature."""

SHOULDER_JOINT_DISTANCE = {Sex.FEMALE: 0.200, Sex.MALE: 0.210}
"""Distance of the shoulder joint centres, per stature (our choice)."""

HAND_METACARPAL_LENGTH = {Sex.FEMALE: 0.0780, Sex.MALE: 0.0862}
"""WJC-MET3: wrist to the third knuckle [m], for the mean stature."""

DE_LEVA: dict[Sex, dict[str, SegmentParameters]] = {
    Sex.FEMALE: {
        "head_and_neck": SegmentParameters(0.0668, 0.2437, 0.4841, (0.271, 0.295, 0.261)),
        "upper_trunk": SegmentParameters(0.1545, 0.2280, 0.5050, (0.466, 0.314, 0.449)),
        "middle_trunk": SegmentParameters(0.1465, 0.2053, 0.4512, (0.433, 0.354, 0.415)),
        "lower_trunk": SegmentParameters(0.1247, 0.1815, 0.4920, (0.433, 0.402, 0.444)),
        "upper_arm": SegmentParameters(0.0255, 0.2751, 0.5754, (0.278, 0.260, 0.148)),
        "forearm": SegmentParameters(0.0138, 0.2643, 0.4559, (0.261, 0.257, 0.094)),
        "hand": SegmentParameters(0.0056, 0.1701, 0.3427, (0.244, 0.208, 0.154)),
        "thigh": SegmentParameters(0.1478, 0.3685, 0.3612, (0.369, 0.364, 0.162)),
        "shank": SegmentParameters(0.0481, 0.4386, 0.4352, (0.267, 0.263, 0.092)),
        "foot": SegmentParameters(0.0129, 0.2283, 0.4014, (0.299, 0.279, 0.139)),
    },
    Sex.MALE: {
        "head_and_neck": SegmentParameters(0.0694, 0.2429, 0.5002, (0.303, 0.315, 0.261)),
        "upper_trunk": SegmentParameters(0.1596, 0.2421, 0.5066, (0.505, 0.320, 0.465)),
        "middle_trunk": SegmentParameters(0.1633, 0.2155, 0.4502, (0.482, 0.383, 0.468)),
        "lower_trunk": SegmentParameters(0.1117, 0.1457, 0.6115, (0.615, 0.551, 0.587)),
        "upper_arm": SegmentParameters(0.0271, 0.2817, 0.5772, (0.285, 0.269, 0.158)),
        "forearm": SegmentParameters(0.0162, 0.2689, 0.4574, (0.276, 0.265, 0.121)),
        "hand": SegmentParameters(0.0061, 0.1879, 0.3624, (0.288, 0.235, 0.184)),
        "thigh": SegmentParameters(0.1416, 0.4222, 0.4095, (0.329, 0.329, 0.149)),
        "shank": SegmentParameters(0.0433, 0.4403, 0.4395, (0.251, 0.246, 0.102)),
        "foot": SegmentParameters(0.0137, 0.2581, 0.4415, (0.257, 0.245, 0.124)),
    },
}
"""de Leva (1996), Table 4."""

_PAIRED = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
_VERTICAL = ("head_and_neck", "upper_trunk", "middle_trunk", "lower_trunk", "thigh", "shank")
_TRUNK = ("upper_trunk", "middle_trunk", "lower_trunk")


@dataclass(frozen=True, eq=False)
class Anthropometry:
    """Dimensions and inertias of one person, scaled from the published tables.

    Attributes:
        stature: Sole to vertex [m].
        mass: Body mass [kg].
        sex: Which table was scaled.
        sole_length: [m].
        sole_width: [m].
        lengths: Measured lengths [m] by the names of :data:`MEASURED_LENGTHS`; the stature scales the
            others, and then is no longer exactly sole to vertex.
    """

    stature: float
    mass: float
    sex: Sex
    sole_length: float
    sole_width: float
    lengths: Mapping[str, float]

    def __init__(
        self, stature: float, mass: float, sex: str, *, sole_length: float | None = None,
        sole_width: float | None = None, lengths: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        if sex not in list(Sex):
            raise BodyError(f"body sex is {sex!r}; valid: {', '.join(Sex)}")
        height = _within(stature, "body stature [m]", STATURE_RANGE)
        weight = _within(mass, "body mass [kg]", MASS_RANGE)
        index = weight / height**2
        low, high = BODY_MASS_INDEX_RANGE
        if not low <= index <= high:
            raise BodyError(
                f"body mass {weight:g} kg at stature {height:g} m is {index:.1f} kg/m^2; "
                f"valid: {low:g} to {high:g} kg/m^2"
            )
        length = 0.16 * height if sole_length is None else sole_length
        width = 0.12 / 1.75 * height if sole_width is None else sole_width
        length = _within(length, "body sole_length [m]", SOLE_LENGTH_RANGE)
        width = _within(width, "body sole_width [m]", SOLE_WIDTH_RANGE)
        values = (height, weight, Sex(sex), length, width, _measured(lengths or {}))
        for item, value in zip(fields(self), values, strict=True):
            object.__setattr__(self, item.name, value)

    @property
    def table(self) -> dict[str, SegmentParameters]:
        """Rows of de Leva's table for this sex."""
        return DE_LEVA[self.sex]

    @property
    def ankle_height(self) -> float:
        """Ankle joint above the sole [m]."""
        return ANKLE_HEIGHT * self.stature

    @property
    def vertical_scale(self) -> float:
        """Factor from the table's vertical lengths [m] to this person's."""
        return (self.stature - self.ankle_height) / sum(self.table[name].length for name in _VERTICAL)

    def length(self, name: str) -> float:
        """Length of a table segment [m]: as measured, else vertical ones fitted to the stature."""
        if name in self.lengths:
            return self.lengths[name]
        if name in _TRUNK and "trunk" in self.lengths:
            return self.table[name].length * self.lengths["trunk"] / SHOULDER_HEIGHT[self.sex]
        scale = self.vertical_scale if name in _VERTICAL else self.stature / SAMPLE_STATURE[self.sex]
        return self.table[name].length * scale

    def segment_mass(self, name: str) -> float:
        """Mass of a table segment [kg], one side only for paired segments."""
        total = sum(row.mass * (2.0 if key in _PAIRED else 1.0) for key, row in self.table.items())
        return self.mass * self.table[name].mass / total

    def com_from_start(self, name: str) -> float:
        """Distance of the centre of mass from the first-named landmark [m]."""
        return self.table[name].com * self.length(name)

    def moments(self, name: str) -> FloatArray:
        """(3,) moments of inertia about sagittal, transverse, longitudinal axes [kg.m^2]."""
        radii = np.array(self.table[name].radii) * self.length(name)
        return self.segment_mass(name) * radii**2

    @property
    def shoulder_height(self) -> float:
        """Shoulder joints above the hip joints [m]."""
        return self.lengths.get("trunk", SHOULDER_HEIGHT[self.sex] * self.vertical_scale)

    @property
    def shoulder_distance(self) -> float:
        """Distance between the shoulder joint centres [m]."""
        return self.lengths.get("shoulders", SHOULDER_JOINT_DISTANCE[self.sex] * self.stature)

    @property
    def hip_distance(self) -> float:
        """Distance between the hip joint centres [m]."""
        return self.lengths.get("hips", HIP_JOINT_DISTANCE * self.stature)

    @property
    def hip_breadth(self) -> float:
        """Breadth of the hips over the flesh [m]."""
        return self.lengths.get("hip_breadth", HIP_BREADTH * self.stature * self.girth)

    @property
    def seat_depth(self) -> float:
        """Depth of a seat below the hip joints [m]."""
        return self.lengths.get("seat_depth", SEAT_DEPTH * self.stature)

    @property
    def knuckle_distance(self) -> float:
        """Wrist joint to the third knuckle [m]."""
        return HAND_METACARPAL_LENGTH[self.sex] * self.stature / SAMPLE_STATURE[self.sex]

    @property
    def girth(self) -> float:
        """Thickness of the flesh relative to 79 kg at 1.75 m, kept within 12 % of it."""
        index = self.mass / self.stature**2
        return float(np.clip(np.sqrt(index / (79.0 / 1.75**2)), 0.88, 1.12))


def _within(value: object, name: str, limits: tuple[float, float]) -> float:
    return finite_number(value, name, at_least=limits[0], at_most=limits[1], error=BodyError)


def _measured(lengths: Mapping[str, float]) -> Mapping[str, float]:
    unknown = set(lengths) - set(MEASURED_LENGTHS)
    if unknown:
        raise BodyError(f"body length of {min(unknown)!r}; valid: {', '.join(MEASURED_LENGTHS)}")
    return MappingProxyType({
        name: _within(value, f"body length of {name} [m]", MEASURED_LENGTHS[name])
        for name, value in lengths.items()
    })  # fmt: skip
