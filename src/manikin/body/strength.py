"""Largest voluntary joint torques of the human body, by direction, sex and age.

Two kinds of published values are used:

* Hips, knees and ankles in the sagittal plane: ``C_1 m g h`` with the peak isometric coefficient ``C_1`` of
  [Anderson2007]_ Table 3 for three age groups of each sex. Between the ages that stand for the groups it
  changes linearly (our choice of the ages), outside of them it stays.
* All other joints: N.m per kilogram of body mass of young men. A torque that was printed in N.m is divided by
  :data:`PRINTED_FOR` (ours). Women have the share of :class:`Women` of the men's value; both fall with age as
  :func:`age_factor` says ([DanneskioldSamsoe2009]_).

The values are means of healthy adults, who differ among themselves by 20 to 30 % of the mean
([Benfica2018]_). They are peaks over the joint's range at rest: the limits do not fall with the angle or with
the speed of shortening, and they do not rise in lengthening, although [Anderson2007]_ gives all three for the
leg.

Also a load in the hands: a point mass at the palms that moves with them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum, StrEnum
from types import MappingProxyType

import numpy as np

from manikin.body.model import BodyModel
from manikin.body.segments import Segment
from manikin.errors import BodyError
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number

DEFAULT_AGE = 30.0
"""Age of a body that was given none, and accepted ages [years]."""

PRINTED_FOR = 79.0
"""Mass that a printed torque of men is divided by [kg]; ours, the groups' masses were not printed with it."""

GROUP_AGES = (21.5, 60.0, 70.0)
"""Ages that stand for the groups 18-25, 55-65 and over 65 of [Anderson2007]_ [years]; ours."""

MEAN_MEN_PER_WOMEN = 85.52 / 67.76
"""Mean mass of men over that of women (ANSUR II): ratios of torques times it are per kg."""


class Grade(StrEnum):
    """Origin of a value: the paper or its abstract, a quotation by others, or our estimate."""

    PAPER = "paper"
    QUOTED = "quoted"
    ESTIMATE = "estimate"


class Women(Enum):
    """Women's torque per kg over men's in a part of the body.

    Torques: 1/1.75, the middle of [DanneskioldSamsoe2009]_ (men 1.5 to 2 times as strong); shoulder 0.5
    (Clin. Biomech. 1989, doi 10.1016/0268-0033(89)90046-6, and :data:`SHOULDER_STUDY`); forearm 1/1.7
    (Axelsson et al. 2018); wrist 0.786 per kg (J. Funct. Morphol. Kinesiol. 10:377, 2025); abduction of the
    hip 1.13 and 1.29 per kg (Sugimoto et al. 2014).
    """

    GENERAL = MEAN_MEN_PER_WOMEN / 1.75
    SHOULDER = MEAN_MEN_PER_WOMEN * 0.5
    FOREARM = MEAN_MEN_PER_WOMEN / 1.7
    WRIST = 0.786
    ABDUCTION = 1.13 / 1.29


ANDERSON = "Anderson et al. 2007, Table 3"
HARBO = "Harbo et al. 2012, men of 25 y, 1.80 m, 80 kg"
STOBBE = "Stobbe 1982, medians, in Chaffin and Andersson"
FICE = "Fice et al. 2014"
DELP = "Delp et al. 1996"
ABDUCTION = "1.29 standing (Sugimoto et al. 2014), 30 % more lying on the side (Cerda Vega et al. 2018)"
HIP_STUDY = "isometric hip study of 30 people, PMC11329127"
SHOULDER_STUDY = "static at 0 deg, 26 men (Dynamic shoulder flexion strength ...)"


@dataclass(frozen=True)
class LegStrength:
    """Peak isometric ``C_1`` of one direction of a leg's joint, for :data:`GROUP_AGES` of men and women."""

    male: tuple[float, float, float]
    female: tuple[float, float, float]

    source = ANDERSON
    grade = Grade.QUOTED

    def torque(self, mass: float, stature: float, sex: str, age: float) -> float:
        """Torque of a person [N.m]."""
        groups = self.female if sex == "female" else self.male
        return float(np.interp(age, GROUP_AGES, groups)) * mass * GRAVITY * stature


@dataclass(frozen=True)
class MassStrength:
    """Strength of one direction of a joint per kilogram of body mass.

    Attributes:
        per_kg: Of young men [N.m/kg].
        source: Where it is from.
        grade: How it was come by.
        women: What women's share is.
    """

    per_kg: float
    source: str
    grade: Grade
    women: Women = Women.GENERAL

    def torque(self, mass: float, stature: float, sex: str, age: float) -> float:  # noqa: ARG002
        """Torque of a person [N.m]."""
        share = self.women.value if sex == "female" else 1.0
        return self.per_kg * mass * share * age_factor(sex, age)


DirectionStrength = LegStrength | MassStrength


def _printed(torque: float, source: str, grade: Grade, women: Women = Women.GENERAL) -> MassStrength:
    return MassStrength(torque / PRINTED_FOR, source, grade, women)


def _estimate(per_kg: float, why: str) -> MassStrength:
    return MassStrength(per_kg, why, Grade.ESTIMATE)


def _harbo(per_kg: float, women: Women = Women.GENERAL) -> MassStrength:
    return MassStrength(per_kg, HARBO, Grade.QUOTED, women)


_TRUNK_TURN = _estimate(1.25, "young men, quoted without a source")
_TRUNK_SIDE = _printed(159.0, STOBBE, Grade.QUOTED)
_TRUNK_BEND, _TRUNK_EXTEND = (_printed(value, STOBBE, Grade.QUOTED) for value in (143.0, 234.0))
_THORAX_EXTEND, _THORAX_BEND, _THORAX_SIDE, _THORAX_TURN = (
    _estimate(0.75 * lumbar.per_kg, "0.75 of the lumbar's: the same muscles, fewer of them")
    for lumbar in (_TRUNK_EXTEND, _TRUNK_BEND, _TRUNK_SIDE, _TRUNK_TURN)
)
_KNEE_TURN = _estimate(0.70, "muscles 0.35 (Armour et al. 2004, quoted), as much by the ligaments under load")
_FOOT_SIDE = "quoted without a source"

HUMAN_STRENGTH: Mapping[str, tuple[DirectionStrength, DirectionStrength]] = MappingProxyType({
    "lumbar_flexion": (_TRUNK_EXTEND, _TRUNK_BEND),
    "lumbar_side_bend": (_TRUNK_SIDE, _TRUNK_SIDE),
    "lumbar_rotation": (_TRUNK_TURN, _TRUNK_TURN),
    "thorax_flexion": (_THORAX_EXTEND, _THORAX_BEND),
    "thorax_side_bend": (_THORAX_SIDE, _THORAX_SIDE),
    "thorax_rotation": (_THORAX_TURN, _THORAX_TURN),
    "neck_flexion": (_printed(51.0, FICE, Grade.PAPER), _printed(30.0, FICE, Grade.PAPER)),
    "neck_side_bend": (_printed(32.0, FICE, Grade.PAPER), _printed(32.0, FICE, Grade.PAPER)),
    "neck_rotation": (_printed(13.0, FICE, Grade.PAPER), _printed(13.0, FICE, Grade.PAPER)),
    "shoulder_flexion": (
        _harbo(1.25, Women.SHOULDER), _printed(89.9, SHOULDER_STUDY, Grade.PAPER, Women.SHOULDER),
    ),
    "shoulder_abduction": (_harbo(1.07, Women.SHOULDER), _harbo(0.84, Women.SHOULDER)),
    "shoulder_rotation": (
        _printed(33.0, STOBBE, Grade.QUOTED, Women.SHOULDER),
        _printed(52.0, STOBBE, Grade.QUOTED, Women.SHOULDER),
    ),
    "elbow_flexion": (_harbo(0.61), _harbo(0.67)),
    "forearm_pronation": (
        MassStrength(0.127, "PMC9515161, supination", Grade.QUOTED, Women.FOREARM),
        MassStrength(0.076, "PMC9515161, pronation", Grade.QUOTED, Women.FOREARM),
    ),
    "wrist_flexion": (_harbo(0.155, Women.WRIST), _harbo(0.33, Women.WRIST)),
    "wrist_radial_deviation": (
        _printed(9.5, DELP, Grade.PAPER, Women.WRIST), _printed(11.0, DELP, Grade.PAPER, Women.WRIST),
    ),
    "hip_flexion": (
        LegStrength((0.161, 0.171, 0.144), (0.181, 0.140, 0.138)),
        LegStrength((0.113, 0.107, 0.101), (0.127, 0.091, 0.081)),
    ),
    "hip_abduction": (
        MassStrength(1.08, HIP_STUDY, Grade.QUOTED),
        MassStrength(1.30 * 1.29, ABDUCTION, Grade.PAPER, Women.ABDUCTION),
    ),
    "hip_rotation": (
        MassStrength(0.66, HIP_STUDY, Grade.QUOTED), MassStrength(0.72, HIP_STUDY, Grade.QUOTED),
    ),
    "knee_flexion": (
        LegStrength((0.163, 0.156, 0.137), (0.159, 0.128, 0.124)),
        LegStrength((0.087, 0.081, 0.069), (0.080, 0.060, 0.060)),
    ),
    "knee_rotation": (_KNEE_TURN, _KNEE_TURN),
    "ankle_dorsiflexion": (
        LegStrength((0.095, 0.114, 0.106), (0.104, 0.093, 0.125)),
        LegStrength((0.033, 0.028, 0.029), (0.027, 0.024, 0.022)),
    ),
    "ankle_inversion": (_estimate(0.42, _FOOT_SIDE), _estimate(0.46, _FOOT_SIDE)),
    "toe_extension": (
        _estimate(0.63, "toe flexors and plantar fascia together"), _estimate(0.13, "a fifth of the flexors"),
    ),
})  # fmt: skip
"""Strength against and along the positive direction of each hinge, by its name without the side.

A hinge's first entry bounds its negative torque, so that of ``knee_flexion`` is the knee's extension.
"""


VARIATION, ARM_VARIATION, KNEE_VARIATION = 0.25, 0.277, 0.189
"""Standard deviation over the mean of the strength of healthy adults of one sex: the middle of the 20 to 30 %
of [Benfica2018]_; of an arm ([LaDelfa2017]_); of the knee's extension, isometric, untrained men
([Stebbings2014]_)."""

_ARM_JOINTS, _KNEE_EXTENSION = ("shoulder", "elbow", "forearm", "wrist"), "knee_flexion"


def variation(name: str) -> float:
    """Standard deviation over the mean of a hinge's strength, a key of :data:`HUMAN_STRENGTH`."""
    if name.startswith(_ARM_JOINTS):
        return ARM_VARIATION
    return KNEE_VARIATION if name == _KNEE_EXTENSION else VARIATION


def age_factor(sex: str, age: float) -> float:
    """Strength over that of the young ([DanneskioldSamsoe2009]_).

    Men lose linearly from 25 years on and have 54 to 89 % at 75, women from 40 years on and have 48 to 92 %
    at 75, by joint; here the middle of these.
    """
    start, left = (40.0, 0.5 * (0.48 + 0.92)) if sex == "female" else (25.0, 0.5 * (0.54 + 0.89))
    return 1.0 - (1.0 - left) * max(0.0, age - start) / (75.0 - start)


def hinge_strength(
    name: str, mass: float, stature: float, sex: str, age: float = DEFAULT_AGE
) -> tuple[float, float]:
    """Torques of a hinge, a key of :data:`HUMAN_STRENGTH`, against and along its positive direction [N.m].

    Both are sizes, of a person of a mass [kg], a stature [m], a sex ("male", "female") and an age [years].
    """
    against, along = HUMAN_STRENGTH[name]
    return against.torque(mass, stature, sex, age), along.torque(mass, stature, sex, age)


HANDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"left": ("left_hand",), "right": ("right_hand",), "both": ("left_hand", "right_hand")}
)
"""Effectors that carry a load, by the word for them; both hands carry half each."""


def carrying(body: BodyModel, mass: float, hand: str = "both") -> BodyModel:
    """Return the body with a load in its hands.

    The load is a point mass at the origin of each hand's effector (the middle of the palm), rigidly held: it
    has no size, no inertia of its own and meets nothing. It is part of the hand's segment, and thereby of
    all masses, inertias, torques, forces and margins. The strength stays that of the body alone.

    Args:
        body: With the effectors ``left_hand`` and ``right_hand``; BodyError if it has no such hand.
        mass: Of the load [kg], not negative; 0 returns the body as it is.
        hand: ``"left"``, ``"right"`` or ``"both"``.
    """
    return with_masses(body, hand_masses(body, mass, hand))


def hand_masses(body: BodyModel, mass: float, hand: str = "both") -> dict[str, float]:
    """What each hand of a body carries of a load [kg], by the name of its effector; see :func:`carrying`."""
    finite_number(mass, "load [kg]", at_least=0.0, error=BodyError)
    if hand not in HANDS:
        raise BodyError(f"hand of the load is {hand!r}; valid: {', '.join(HANDS)}")
    if mass == 0.0:
        return {}
    missing = [name for name in HANDS[hand] if name not in body.effectors]
    if missing:
        raise BodyError(f"body {body.name!r} has no {missing[0]} to carry a load; valid: a body with hands")
    return dict.fromkeys(HANDS[hand], mass / len(HANDS[hand]))


def with_masses(body: BodyModel, masses: Mapping[str, float]) -> BodyModel:
    """The body with point masses [kg] at the origins of effectors, as parts of their segments."""
    if not masses:
        return body
    loads = dict(body.loads)
    segments = {segment.name: segment for segment in body.segments}
    for name, share in masses.items():
        effector = body.effector(name)
        segments[effector.segment] = _with_point(segments[effector.segment], share, effector.translation)
        loads[name] = loads.get(name, 0.0) + share
    nominal = None if body.nominal_mass is None else body.nominal_mass + sum(masses.values())
    return replace(body, segments=tuple(segments.values()), loads=loads, nominal_mass=nominal)


def _with_point(segment: Segment, mass: float, position: FloatArray) -> Segment:
    """The segment with a point mass [kg] at a position (3,) in its frame [m]."""
    total = segment.mass + mass
    com = (segment.mass * segment.com + mass * position) / total
    apart = position - segment.com
    square = segment.mass * mass / total * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    return replace(segment, mass=total, com=com, inertia=segment.inertia + square)
