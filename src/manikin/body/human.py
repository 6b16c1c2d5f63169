"""A human scaled from stature, mass and sex: 19 segments, 45 degrees of freedom."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from manikin.body.anthropometry import (
    ANKLE_FROM_HEEL,
    MEASURED_LENGTHS,
    NECK_LENGTH_SHARE,
    NECK_MASS_SHARE,
    NECK_RADIUS,
    TOE_HINGE_FROM_HEEL,
    TOES_MASS_SHARE,
    Anthropometry,
)
from manikin.body.dimensions import lengths_of
from manikin.body.human_parts import (
    ALONG_X,
    HUMAN_HINGES,
    across,
    arms_and_legs,
    cuboid_inertia,
    cylinder_inertia,
    human_hinges,
    off_axis,
    palm_rotation,
    upright_capsule,
)
from manikin.body.model import OFF_AXIS, BodyModel
from manikin.body.segments import Effector, Segment, Shape, ShapeKind
from manikin.body.strength import DEFAULT_AGE, HANDS, carrying, hinge_strength
from manikin.errors import BodyError
from manikin.limits import AGE_RANGE
from manikin.numerics.spatial import FloatArray, finite_number, rotation_from_rpy, skew

_SOFT_PAIRS = frozenset(frozenset(pair) for pair in (
    # One short link apart: the shapes overlap in ordinary postures.
    ("pelvis", "thorax"), ("lumbar", "neck"), ("thorax", "head"),
    ("left_leg", "left_toes"), ("right_leg", "right_toes"),
    # Belly and thigh are soft and press against each other in every deep crouch.
    ("lumbar", "left_thigh"), ("lumbar", "right_thigh"),
))  # fmt: skip

_ARM_SPREAD = np.deg2rad(14.0)

_SIDES = (("left", 1.0), ("right", -1.0))

# Shares of the stature; our choice.
SEAT_LENGTH = 0.08
"""Length, back to front, of the patch that presses on a seat."""
BUTTOCK_RADIUS = 0.027
"""Radius of the buttocks' lines and of their ends, on which a leaning body rolls."""
SEAT_WIDTH = 0.14
"""Distance between the two lines that press on a seat."""

FRONT_OF_KNEE = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""Rotation from the knee's effector to the lower leg."""

KNEELING = FRONT_OF_KNEE @ rotation_from_rpy(0.0, -np.deg2rad(6.0), 0.0)
"""The same of one who kneels, the shank a little up to the foot, which is clear of the ground; our choice."""

THIGH_ABOVE_SEAT = 0.002
"""Least distance of a level thigh to the seat below it [m]."""

SKIN = 0.005
"""Distance of the effectors of knees and wrists to the shapes behind them, which need not be level [m]."""

_STANDING_DEG = MappingProxyType(
    {"hip_flexion": 2.0, "knee_flexion": 10.0, "ankle_dorsiflexion": 8.0, "elbow_flexion": 15.0}
)
"""Upright trunk over slightly bent knees, the centre of mass over the middle of the foot."""


def human(
    stature: float = 1.75, mass: float = 79.0, sex: str = "male", *, age: float = DEFAULT_AGE,
    strength: float = 1.0, sole_length: float | None = None, sole_width: float | None = None,
    lengths: Mapping[str, float] | None = None, dimensions: Mapping[str, float] | None = None,
    off_axis_masses: bool = False,
) -> BodyModel:  # fmt: skip
    """Make a human body of 19 segments and 45 degrees of freedom ([Qiu2012]_ Table 2.1, B.1).

    The free pelvis carries the legs and the spine (lumbar, thorax, neck, 3 hinges each; the head is rigid on
    the neck). Shoulders and hips have 3 hinges, elbows, wrists, knees and ankles 2, toes 1. Proportions and
    inertias: :mod:`manikin.body.anthropometry`; axes, ranges and speeds: :mod:`manikin.body.human_parts`;
    strengths: :mod:`manikin.body.strength`.

    In the zero posture the body stands upright with hanging arms, palms inward, and all segment frames
    parallel to the world. A segment's frame lies in its proximal joint, the pelvis' midway between the hip
    joints, the lumbar's and thorax' at the height of navel and xiphoid (the borders of de Leva's trunk
    parts), the neck's at C7.

    Effectors: ``left_foot``, ``right_foot`` (sole centre, x to the toes, z up), ``left_hand``, ``right_hand``
    (palm centre, x along the fingers, z out of the back of the hand: parallel to the world when the palm lies
    on a table, fingers forward), ``left_wrist``, ``right_wrist`` (heel of the hand, before the forearm's
    round end, axes as the palm), ``left_knee``, ``right_knee`` (before the thigh's round end, z through the
    joint, backwards), ``head`` (vertex), ``pelvis`` (its segment frame) and ``buttocks`` (middle of what
    presses on a seat, axes as the pelvis). Limbs: ``left_arm``, ``right_arm``, ``left_leg``, ``right_leg``;
    knees, elbows and the pelvis too with :func:`manikin.body.limbs.with_further_contacts`.

    Collision shapes are the flesh made slim: the breadth over the hips is Winter's 0.191 H, all other
    breadths and girths are our choice. They scale with stature and (within 12 %) with the square root of the
    body mass index, so that limbs standing side by side stay 2 cm apart.

    Args:
        stature: Sole to vertex [m], 0.90 to 2.10; below 1.40 with an adult's shares of the masses.
        mass: Body mass [kg], 12 to 160, with a body mass index of 10 to 60 kg/m^2.
        sex: ``"male"`` or ``"female"``.
        age: 18 to 90 [years]; strength depends on it, nothing else.
        strength: Torque limits relative to those of a healthy adult of that sex, size and age.
        sole_length: Length of the sole [m], 0.12 to 0.40; None for 0.16 of the stature.
        sole_width: Width of the sole [m], 0.05 to 0.16; None for 0.12/1.75 of the stature.
        lengths: Measured lengths [m] instead of scaled ones, by the names of
            :data:`manikin.body.anthropometry.MEASURED_LENGTHS`; the stature scales the others, the foot,
            the head and the flesh.
        dimensions: Outer dimensions [m] instead of scaled ones, by the names of
            :data:`manikin.body.dimensions.DIMENSIONS`, such as ``sitting_height``; lengths that are given
            go before what follows from them.
        off_axis_masses: Whether centres of mass lie off the lines between joints, as
            :mod:`manikin.body.human_parts` says, instead of on them.

    Raises:
        BodyError: If a value is out of its range.
    """
    size = Anthropometry(stature, mass, sex, sole_length=sole_length, sole_width=sole_width)
    wanted = {**lengths_of(size, dimensions or {}), **(lengths or {})}
    size = Anthropometry(stature, mass, sex, sole_length=sole_length, sole_width=sole_width, lengths=wanted)
    finite_number(age, "age [years]", at_least=AGE_RANGE[0], at_most=AGE_RANGE[1], error=BodyError)
    finite_number(strength, "strength", above=0.0, error=BodyError)
    builder = _HumanBuilder(size, off_axis_masses, age, strength)
    effectors = {effector.name: effector for effector in builder.effectors()}
    return BodyModel(
        "human", builder.segments(), effectors, standing_angles(), _SOFT_PAIRS, size.stature, str(size.sex),
        size.sole_length, size.sole_width, nominal_mass=size.mass,
        limbs=arms_and_legs(("upper_arm", "forearm", "hand"), ("thigh", "leg", "foot")), age=age,
        strength=strength, lengths=size.lengths, off_axis_masses=off_axis_masses,
    )  # fmt: skip


def body_from_signature(signature: Mapping[str, object]) -> BodyModel:
    """Make the body that :meth:`BodyModel.signature` described; BodyError if a value is missing or wrong."""
    model = signature.get("model")
    if model != "human":
        raise BodyError(f"body model is {model!r}; valid: human")
    wanted = ("stature", "mass", "sex", "sole_length", "sole_width")
    missing = [key for key in wanted if key not in signature]
    if missing:
        raise BodyError(f"body signature has no {missing[0]!r}; valid: {', '.join(wanted)}")
    given = (*wanted, "age", "strength")
    values: dict[str, Any] = {key: signature[key] for key in given if key in signature}
    measured: dict[str, Any] = {
        name: signature[f"{name}_length"] for name in MEASURED_LENGTHS if f"{name}_length" in signature
    }
    masses = signature.get("masses")
    if masses not in (None, OFF_AXIS):
        raise BodyError(f"body masses are {masses!r}; valid: {OFF_AXIS}, or none")
    body = human(**values, lengths=measured, off_axis_masses=masses == OFF_AXIS)
    for hand, effectors in HANDS.items():
        load = signature.get(f"{effectors[0]}_load")
        if len(effectors) == 1 and load is not None:
            body = carrying(body, cast("float", load), hand)
    return body


def standing_angles() -> dict[str, float]:
    """Angles [rad]; the arms hang 14 degrees away from the trunk, straight to the side."""
    angles = {name: float(np.deg2rad(value)) for name, value in _STANDING_DEG.items()}
    arm = np.array([0.0, np.sin(_ARM_SPREAD), -np.cos(_ARM_SPREAD)])
    lift, spread = (np.array(entry.axis) for entry in HUMAN_HINGES["upper_arm"][:2])
    angles["shoulder_flexion"] = float(np.arctan2(arm @ spread, -arm[2]))
    angles["shoulder_abduction"] = float(np.arcsin(arm @ -lift))
    return {f"{side}_{name}": angle for side in ("left", "right") for name, angle in angles.items()}


@dataclass(frozen=True, eq=False)
class _Inertia:
    """Mass, centre and rotational inertia about the centre, in one frame."""

    mass: float
    com: FloatArray
    moments: FloatArray

    def without(self, part: "_Inertia") -> "_Inertia":
        """The rest when ``part`` is cut away, both in this frame."""
        mass = self.mass - part.mass
        com = (self.mass * self.com - part.mass * part.com) / mass
        return _Inertia(mass, com, self.about(com) - part.about(com))

    def about(self, place: FloatArray) -> FloatArray:
        """Inertia about another point (parallel axes), (3, 3)."""
        arm = skew(self.com - place)
        return self.moments - self.mass * arm @ arm


class _HumanBuilder:
    """Segments and effectors of given dimensions and strength."""

    def __init__(self, size: Anthropometry, off_axis_masses: bool, age: float, strength: float) -> None:
        self.size, self.off_axis_masses, self.age, self.strength = size, off_axis_masses, age, strength
        self.stature, self.girth = size.stature, size.girth
        self._seat_x = -0.017 * self.stature  # the buttocks' middle, behind the hip joints
        self._hand_thickness = 0.016 * self.stature
        self._arm_radius = 0.025 * self.stature * self.girth
        # A thigh that lies on a seat is pressed flat.
        self._thigh_radius = min(0.038 * self.stature * self.girth, size.seat_depth - THIGH_ABOVE_SEAT)
        self._shank_radius = 0.029 * self.stature * self.girth
        # Height of the shoulder joints above the thorax' origin.
        self._shoulder_in_thorax = (
            size.shoulder_height - size.length("lower_trunk") - size.length("middle_trunk")
        )

    def segments(self) -> tuple[Segment, ...]:
        arms = [part for side, sign in _SIDES for part in self._arm(side, sign)]
        legs = [part for side, sign in _SIDES for part in self._leg(side, sign)]
        return (*self._trunk(), *self._neck_and_head(), *arms, *legs)

    def effectors(self) -> list[Effector]:
        size = self.size
        head_length = (1.0 - NECK_LENGTH_SHARE) * size.length("head_and_neck")
        effectors = [
            Effector("pelvis", "pelvis", np.zeros(3)),
            Effector("head", "head", np.array([0.0, 0.0, head_length])),
            Effector("buttocks", "pelvis", np.array([self._seat_x, 0.0, -size.seat_depth])),
        ]
        for side, sign in _SIDES:
            sole = np.array([(0.5 - ANKLE_FROM_HEEL) * size.sole_length, 0.0, -size.ankle_height])
            palm = np.array([0.0, -sign * 0.5 * self._hand_thickness, -0.8 * size.knuckle_distance])
            turn = palm_rotation(sign)
            wrist = -(0.8 * self._arm_radius + SKIN) * turn[:, 2]
            knee = -(self._thigh_radius + SKIN) * KNEELING[:, 2]
            effectors += [
                Effector(f"{side}_foot", f"{side}_foot", sole),
                Effector(f"{side}_hand", f"{side}_hand", palm, turn),
                Effector(f"{side}_wrist", f"{side}_hand", wrist, turn),
                Effector(f"{side}_knee", f"{side}_leg", knee, KNEELING),
            ]
        return effectors

    def _strength(self, hinge: str) -> tuple[float, float]:
        size = self.size
        against, along = hinge_strength(hinge, size.mass, size.stature, str(size.sex), self.age)
        return self.strength * against, self.strength * along

    def _trunk(self) -> tuple[Segment, ...]:
        """Pelvis, lumbar spine and thorax."""
        stature, girth, shoulders = self.stature, self.girth, self.size.shoulder_distance
        lower, middle, upper = (self.size.length(f"{part}_trunk") for part in ("lower", "middle", "upper"))
        hips = across("hips", 0.060 * stature, self.size.hip_breadth, 0.35 * lower)
        waist = across("waist", 0.058 * stature, 0.77 * shoulders * girth, 0.5 * middle)
        chest = across("chest", 0.062 * stature, 0.80 * shoulders * girth, 0.4 * upper)
        girdle = across("shoulders", 0.035 * stature, shoulders, self._shoulder_in_thorax)
        # Two short capsules from back to front; their lowest lines are what a seat carries.
        radius, half = BUTTOCK_RADIUS * stature, 0.5 * SEAT_LENGTH * stature
        height, aside = radius - self.size.seat_depth, 0.5 * SEAT_WIDTH * stature
        buttocks = [
            Shape(
                f"{side}_buttock", ShapeKind.CAPSULE, (radius, 2 * half),
                (self._seat_x, sign * aside, height), ALONG_X,
            )
            for side, sign in _SIDES
        ]  # fmt: skip
        return (
            self._trunk_segment("pelvis", None, "lower_trunk", 0.0, (hips, *buttocks)),
            self._trunk_segment("lumbar", "pelvis", "middle_trunk", lower, (waist,)),
            self._trunk_segment("thorax", "lumbar", "upper_trunk", middle, (chest, girdle)),
        )

    def _trunk_segment(
        self, name: str, parent: str | None, row: str, height: float, shapes: tuple[Shape, ...]
    ) -> Segment:
        """Trunk part whose origin is its lower border; the table measures from the upper one."""
        size, origin = self.size, np.array([0.0, 0.0, height])
        com = self._com(row, size.length(row) - size.com_from_start(row))
        hinges = human_hinges(name, "", self._strength) if parent else ()
        inertia = np.diag(size.moments(row))
        return Segment(name, parent, origin, hinges, size.segment_mass(row), com, inertia, shapes)

    def _neck_and_head(self) -> tuple[Segment, Segment]:
        """Neck; head with a skull reaching up to the vertex and a jaw below it."""
        row, size, stature = "head_and_neck", self.size, self.stature
        length, moments = size.length(row), np.diag(size.moments(row))
        neck_length = NECK_LENGTH_SHARE * length
        both = _Inertia(size.segment_mass(row), self._com(row, length - size.com_from_start(row)), moments)
        neck_mass = NECK_MASS_SHARE * both.mass
        neck_moments = cylinder_inertia(neck_mass, NECK_RADIUS * stature, neck_length)
        neck = _Inertia(neck_mass, self._com(row, 0.5 * neck_length), neck_moments)
        head = both.without(neck)
        base, top = np.array([0.0, 0.0, size.length("upper_trunk")]), np.array([0.0, 0.0, neck_length])
        hinges = human_hinges("neck", "", self._strength)
        throat = upright_capsule("neck", NECK_RADIUS * stature, 0.0, neck_length)
        radius, half, jaw_radius = 0.044 * stature, 0.0125 * stature, 0.036 * stature
        middle = (half, 0.0, length - neck_length - radius)
        skull = Shape("skull", ShapeKind.CAPSULE, (radius, 2 * half), middle, ALONG_X)
        jaw = Shape("jaw", ShapeKind.SPHERE, (jaw_radius,), (0.75 * jaw_radius, 0.0, 0.45 * jaw_radius))
        return (
            Segment("neck", "thorax", base, hinges, neck.mass, neck.com, neck.moments, (throat,)),
            Segment("head", "neck", top, (), head.mass, head.com - top, head.moments, (skull, jaw)),
        )

    def _arm(self, side: str, sign: float) -> list[Segment]:
        size, stature = self.size, self.stature
        shoulder = (0.0, 0.5 * sign * size.shoulder_distance, self._shoulder_in_thorax)
        upper, lower, hand = (size.length(row) for row in ("upper_arm", "forearm", "hand"))
        upper_shape = upright_capsule("arm", self._arm_radius, 0.0, -upper)
        lower_shape = upright_capsule("arm", 0.8 * self._arm_radius, 0.0, -lower)
        extents = (0.048 * stature, self._hand_thickness, hand)
        palm = Shape("palm", ShapeKind.BOX, extents, (0.0, 0.0, -0.5 * hand))
        elbow, wrist = (0.0, 0.0, -upper), (0.0, 0.0, -lower)
        return [
            self._limb(side, "upper_arm", "thorax", "upper_arm", shoulder, upper_shape),
            self._limb(side, "forearm", f"{side}_upper_arm", "forearm", elbow, lower_shape, sideways=True),
            self._limb(side, "hand", f"{side}_forearm", "hand", wrist, palm, sideways=True),
        ]

    def _leg(self, side: str, sign: float) -> list[Segment]:
        thigh, shank = self.size.length("thigh"), self.size.length("shank")
        hip, knee = (0.0, 0.5 * sign * self.size.hip_distance, 0.0), (0.0, 0.0, -thigh)
        thigh_shape = upright_capsule("thigh", self._thigh_radius, 0.0, -thigh)
        shank_shape = upright_capsule("shank", self._shank_radius, 0.0, 0.012 * self.stature - shank)
        return [
            self._limb(side, "thigh", "pelvis", "thigh", hip, thigh_shape),
            self._limb(side, "leg", f"{side}_thigh", "shank", knee, shank_shape),
            *self._foot_and_toes(side, (0.0, 0.0, -shank)),
        ]

    def _foot_and_toes(self, side: str, ankle: tuple[float, float, float]) -> list[Segment]:
        """Foot and toes share de Leva's foot; their soles make one flat rectangle."""
        size = self.size
        heel, tip = -ANKLE_FROM_HEEL * size.sole_length, (1.0 - ANKLE_FROM_HEEL) * size.sole_length
        hinge_x = heel + TOE_HINGE_FROM_HEEL * size.sole_length
        toe_height, foot_height = 0.022 * self.stature, 0.034 * self.stature
        hinge = np.array([hinge_x, 0.0, 0.5 * toe_height - size.ankle_height])

        bare_length = size.length("foot")
        bare_heel = heel + 0.5 * (size.sole_length - bare_length)
        com = np.array([bare_heel + size.com_from_start("foot"), 0.0, -0.6 * size.ankle_height])
        vertical, transverse, longitudinal = size.moments("foot")
        both = _Inertia(size.segment_mass("foot"), com, np.diag([longitudinal, transverse, vertical]))
        bare_toes = (1.0 - TOE_HINGE_FROM_HEEL) * bare_length
        toe_mass = TOES_MASS_SHARE * both.mass
        toe_com = np.array([bare_heel + bare_length - 0.5 * bare_toes, 0.0, hinge[2]])
        toe_extents = np.array([bare_toes, 0.05 * self.stature, toe_height])
        toes = _Inertia(toe_mass, toe_com, cuboid_inertia(toe_mass, toe_extents))
        foot = both.without(toes)

        toe_centre = (0.5 * (tip - hinge_x), 0.0, 0.0)
        toe_box = Shape("sole", ShapeKind.BOX, (tip - hinge_x, size.sole_width, toe_height), toe_centre)
        foot_centre = (0.5 * (heel + hinge_x), 0.0, 0.5 * foot_height - size.ankle_height)
        foot_box = Shape("sole", ShapeKind.BOX, (hinge_x - heel, size.sole_width, foot_height), foot_centre)
        return [
            Segment(
                f"{side}_foot", f"{side}_leg", np.array(ankle), human_hinges("foot", side, self._strength),
                foot.mass, foot.com, foot.moments, (foot_box,),
            ),
            Segment(
                f"{side}_toes", f"{side}_foot", hinge, human_hinges("toes", side, self._strength),
                toes.mass, toe_com - hinge, toes.moments, (toe_box,),
            ),
        ]  # fmt: skip

    def _limb(
        self, side: str, name: str, parent: str, row: str, origin: ArrayLike, shape: Shape,
        sideways: bool = False,
    ) -> Segment:  # fmt: skip
        """Limb part hanging down from its joint; ``sideways``, the table's fore-aft axis is our y."""
        size = self.size
        sagittal, transverse, longitudinal = size.moments(row)
        x, y = (transverse, sagittal) if sideways else (sagittal, transverse)
        return Segment(
            f"{side}_{name}", parent, np.array(origin), human_hinges(name, side, self._strength),
            size.segment_mass(row), self._com(row, -size.com_from_start(row), side),
            np.diag([x, y, longitudinal]), (shape,),
        )  # fmt: skip

    def _com(self, row: str, height: float, side: str = "") -> FloatArray:
        """(3,) centre of mass of a part at a height above its joint [m]."""
        aside = off_axis(self.size, row, side) if self.off_axis_masses else np.zeros(3)
        return np.array([0.0, 0.0, height]) + aside
