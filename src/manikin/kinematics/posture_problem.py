"""Requirements and preferences of a posture."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body.configuration import Configuration
from manikin.body.limbs import end_segments, ends_before_tip, hanging_segment, hangs, toe_hinge
from manikin.body.model import BodyModel
from manikin.body.natural_range import LearntJoint, learnt_joints
from manikin.contact import Contact, ContactKind, SolePart
from manikin.errors import BodyError, InputError
from manikin.kinematics.posture_terms import (
    ComTerm,
    EdgeTerm,
    Linearised,
    PositionTerm,
    PostureRequirement,
    ReferenceTerm,
    RotationTerm,
    Term,
    UprightTerm,
)
from manikin.kinematics.reach_sampler import HEEL_UP, TOES_UP
from manikin.numerics.spatial import FloatArray, check_rotation, finite_number, frozen_array
from manikin.scene.distance import NOTHING, Ignored, Proximity
from manikin.scene.spheres import SphereProximity

LEANT = (0.08, 0.8)
"""Pitches of what rolls on its front edge [rad]; with less, what is behind the edge would carry too."""


@dataclass(frozen=True, eq=False)
class LearntRangeTerm:
    """Violation of each ball joint's learnt volume: ``r = min(d(q) - margin, 0)`` [rad].

    ``d`` is the signed distance of its three angles to the surface of the volume ([Tonneau2015]_ 4.3.3).
    """

    body: BodyModel
    margin: float = 0.0

    @cached_property
    def joints(self) -> tuple[LearntJoint, ...]:
        """The ball joints of the body that have a volume."""
        return learnt_joints(self.body)

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`~manikin.kinematics.posture_terms.Term`."""
        angles = configuration.q[7:]
        residual, jacobian = np.zeros(len(self.joints)), np.zeros((len(self.joints), self.body.nv))
        for row, joint in enumerate(self.joints):
            own, volume = angles[joint.hinges], joint.range.volume
            missing = float(volume.distance(own)) - self.margin
            if missing < 0.0:
                residual[row] = missing
                jacobian[row, 6:][joint.hinges] = volume.gradient(own)
        return Linearised(residual, jacobian)

    def describe(self, residual: FloatArray) -> str:
        """See :class:`~manikin.kinematics.posture_terms.Term`."""
        worst = int(np.argmin(residual))
        beyond = np.rad2deg(-residual[worst])
        return f"'{self.joints[worst].segment}' is {beyond:.1f} deg beyond its learnt range"


@dataclass(frozen=True, eq=False)
class Placement:
    """Required or wished pose of an effector that touches nothing.

    Attributes:
        position: (3,) [m], or None to leave it free.
        rotation: (3, 3) effector-to-world, or None to leave it free.
        rotation_weight: None when the rotation is required; otherwise it is only wished, with this weight
            [1/rad^2] beside those of :class:`Preferences`.
        position_weight: The same of the position [1/m^2].
    """

    position: FloatArray | None = None
    rotation: FloatArray | None = None
    rotation_weight: float | None = None
    position_weight: float | None = None

    def __post_init__(self) -> None:
        if self.position is not None:
            object.__setattr__(self, "position", frozen_array(self.position, "placement position [m]", (3,)))
        if self.rotation is not None:
            object.__setattr__(self, "rotation", check_rotation(self.rotation, "placement rotation"))


@dataclass(frozen=True)
class Preferences:
    """Weights of squared deviations, for the freedom that the requirements of a posture leave.

    The values are our choice, by eye.

    Attributes:
        hinge: Of every hinge's distance from the reference [1/rad^2].
        hinges: Replaces ``hinge`` for hinges whose name contains the key, the first one that fits.
        pelvis, trunk, head: Of the tilts of pelvis, thorax and head.
        arms: Of the upper arms' deviation from hanging.
        grasp: Of a grasping hand's deviation from the orientation its contact gives [1/rad^2].
        damping: Of every change in one iteration; keeps the problem regular.
    """

    hinge: float = 0.1
    hinges: Mapping[str, float] = field(default_factory=lambda: {
        "knee_flexion": 0.01, "hip_flexion": 0.01, "ankle_dorsiflexion": 0.02, "knee_rotation": 1.0,
        "hip_abduction": 0.1, "hip_rotation": 0.3, "ankle_inversion": 0.3, "toe_extension": 20.0,
        "lumbar": 0.3, "thorax": 0.4, "neck": 0.2, "_rotation": 0.3, "side_bend": 0.6,
        "shoulder_flexion": 0.02, "shoulder_abduction": 0.1, "shoulder_rotation": 0.1,
        "elbow": 0.1, "wrist": 0.3, "forearm": 0.2,
    })  # fmt: skip
    pelvis: float = 0.1
    trunk: float = 0.2
    head: float = 0.6
    arms: float = 0.1
    grasp: float = 0.3
    damping: float = 1e-3


@dataclass(frozen=True, eq=False)
class PostureProblem:
    """Requirements and preferences of one posture.

    Attributes:
        contacts: Contacts held: a sole's whole pose, a point's or grasp's position; a sole of which only heel
            or toes touch pitches about them.
        placements: Further effectors that must be somewhere, by name.
        com: (3,) centre of mass [m]; NaN leaves an axis free; None leaves it wholly free.
        com_weight: None when it is required; otherwise it is only wished, with this weight [1/m^2].
        proximity: Measures distances of this body in a scene, exactly or between bounding
            spheres ([Qiu2012]_ 6.2.2, Appendix F); None without obstacles.
        clearance: Distance to keep to obstacles [m].
        self_clearance: Distance to keep between body parts [m].
        ignore: Pairs (segment, obstacle) or (segment, segment) that may touch.
        touching: Distances to keep of pairs (segment, obstacle) that may touch, negative inside [m]; they
            count before what is ignored.
        range_margin: Angle to keep from the ends of the hinge ranges [rad].
        learnt_margin: Angle to keep to the surface of the learnt volumes of hips and shoulders, inside [rad];
            None where the ranges of their hinges are all that counts.
        reference: (nq,) posture to stay near, with its root ignored; standing when omitted.
        preferences: Weights of what is not required.
        upright: Whether pelvis, trunk, head and arms should be upright (a human habit).
    """

    body: BodyModel
    contacts: tuple[Contact, ...] = ()
    placements: Mapping[str, Placement] = field(default_factory=dict)
    com: FloatArray | None = None
    com_weight: float | None = None
    proximity: Proximity | SphereProximity | None = None
    clearance: float = 0.02
    self_clearance: float = 0.005
    ignore: Ignored = NOTHING
    touching: Mapping[tuple[str, str], float] = field(default_factory=dict)
    range_margin: float = 0.0
    learnt_margin: float | None = None
    reference: FloatArray | None = None
    preferences: Preferences = field(default_factory=Preferences)
    upright: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "placements", dict(self.placements))
        for name in [contact.effector for contact in self.contacts] + list(self.placements):
            if name not in self.body.effectors:
                valid = ", ".join(self.body.effectors)
                raise BodyError(f"posture asks for effector {name!r}; valid: {valid}")
        if self.com is not None:
            com = np.array(self.com, dtype=np.float64)
            if com.shape != (3,) or np.any(np.isinf(com)):
                raise InputError(f"posture com is {com.tolist()}; valid: 3 numbers, nan for a free axis")
            com.setflags(write=False)
            object.__setattr__(self, "com", com)
        reference = self.body.standing_posture() if self.reference is None else self.reference
        shape = (self.body.nq,)
        object.__setattr__(self, "reference", frozen_array(reference, "posture reference", shape, BodyError))
        finite_number(self.clearance, "posture clearance [m]")
        finite_number(self.self_clearance, "posture self_clearance [m]")
        finite_number(self.range_margin, "posture range_margin [rad]", at_least=0.0)
        finite_number(self.learnt_margin or 0.0, "posture learnt_margin [rad]", at_least=0.0)

    def requirements(self) -> tuple[PostureRequirement, ...]:
        """Terms that must be zero."""
        terms: list[PostureRequirement] = []
        for contact in self.contacts:
            if contact.part is not SolePart.FULL:
                terms.append(self._edge(contact))
                continue
            terms.append(PositionTerm(contact.effector, contact.position, "contact"))
            if contact.kind is ContactKind.SOLE:
                terms.append(RotationTerm(contact.effector, contact.rotation_contact_to_world, "contact"))
        for name, placement in self.placements.items():
            if placement.position is not None and placement.position_weight is None:
                terms.append(PositionTerm(name, placement.position))
            if placement.rotation is not None and placement.rotation_weight is None:
                terms.append(RotationTerm(name, placement.rotation))
        if self.com is not None and self.com_weight is None and np.any(np.isfinite(self.com)):
            terms.append(ComTerm(self.com))
        if self.learnt_margin is not None:
            terms.append(LearntRangeTerm(self.body, self.learnt_margin))
        return tuple(terms)

    def _edge(self, contact: Contact) -> EdgeTerm:
        """A sole that pitches about the part that touches."""
        if contact.rolls:
            return EdgeTerm(
                contact.effector, contact.pivot, contact.position, contact.rotation_contact_to_world,
                *LEANT, radius=contact.edge_radius,
            )  # fmt: skip
        on_toes = contact.part is SolePart.TOES
        x = contact.points[:, 0].min() if on_toes else contact.points[:, 0].max()
        toes = hanging_segment(self.body, self.body.effector(contact.effector).segment) if on_toes else None
        hinge = None if toes is None else toe_hinge(self.body, contact.effector)
        return EdgeTerm(
            contact.effector, np.array([float(x), 0.0, 0.0]) if hinge is None else hinge, contact.position,
            contact.rotation_contact_to_world, *((0.0, HEEL_UP) if on_toes else (-TOES_UP, 0.0)),
            None if toes is None else 6 + self.body.joint_index(toes.hinges[0].name),
        )  # fmt: skip

    def wishes(self) -> tuple[tuple[FloatArray, Term], ...]:
        """Terms that should be small, with the weight of each row."""
        weights = self.preferences
        assert self.reference is not None  # set on construction
        of_hinges = [
            next((w for key, w in weights.hinges.items() if key in name), weights.hinge)
            for name in self.body.joint_names
        ]
        wishes: list[tuple[FloatArray, Term]] = [(np.array(of_hinges), ReferenceTerm(self.reference[7:]))]
        for contact in self.contacts:
            if contact.kind is ContactKind.GRASP and contact.oriented:
                term = RotationTerm(contact.effector, contact.rotation_contact_to_world)
                wishes.append((np.full(3, weights.grasp), term))
        for name, item in self.placements.items():
            if item.position is not None and item.position_weight is not None:
                wishes.append((np.full(3, item.position_weight), PositionTerm(name, item.position)))
            if item.rotation is not None and item.rotation_weight is not None:
                wishes.append((np.full(3, item.rotation_weight), RotationTerm(name, item.rotation)))
        if self.com is not None and self.com_weight is not None and np.any(np.isfinite(self.com)):
            wishes.append((np.full(np.isfinite(self.com).sum(), self.com_weight), ComTerm(self.com)))
        if self.upright:
            names = {segment.name for segment in self.body.segments}
            tilts = {"pelvis": weights.pelvis, "thorax": weights.trunk, "head": weights.head}
            tilts |= {"left_upper_arm": weights.arms, "right_upper_arm": weights.arms}
            tilts = {name: weight for name, weight in tilts.items() if name in names}
            if tilts:
                wishes.append((np.repeat([*tilts.values()], 3), UprightTerm(tuple(tilts))))
        return tuple(wishes)


def touching_pairs(body: BodyModel, effector_obstacles: Iterable[tuple[str, str]]) -> Ignored:
    """Pairs (segment, obstacle) of contacts (effector, obstacle): with what an effector touches.

    What hangs on the root may touch what the root sits on as well.
    """
    pairs = set()
    for effector, obstacle in effector_obstacles:
        pairs.update((name, obstacle) for name in end_segments(body, effector))
        if not hangs(body, effector):
            root = body.effector(effector).segment
            pairs.update((other.name, obstacle) for other in body.segments if other.parent == root)
    return frozenset(pairs)


def pairs_beside(body: BodyModel, effector_obstacles: Iterable[tuple[str, str]]) -> Ignored:
    """Pairs of :func:`touching_pairs` that need not overlap: the segment's shapes end before its effector.

    So does the shank of a creature that stands on its tip alone, and thigh and shank of one who kneels.
    """
    return frozenset(
        (segment, obstacle)
        for effector, obstacle in effector_obstacles if ends_before_tip(body, effector)
        for segment in end_segments(body, effector)
    )  # fmt: skip


def com_target(
    x: ArrayLike | None = None, y: ArrayLike | None = None, z: ArrayLike | None = None
) -> FloatArray:
    """(3,) centre-of-mass target with the axes that are not given left free."""
    return np.array([np.nan if value is None else float(np.asarray(value)) for value in (x, y, z)])


def place_over_contacts(problem: PostureProblem, q: FloatArray) -> FloatArray:
    """(nq,) posture ``q`` moved as a rigid whole to where its effectors must be.

    The root is turned about the vertical to the mean heading of the required rotations and moved so that
    the mean of the effectors' positions matches.
    """
    positions = [t for t in problem.requirements() if isinstance(t, PositionTerm)]
    rotations = [t for t in problem.requirements() if isinstance(t, RotationTerm)]
    feet = [t for t in positions if t.kind == "contact" and "foot" in t.effector] or positions
    configuration = Configuration(problem.body, q)
    turned = np.array(configuration.q)
    if rotations:
        turns = [t.rotation @ configuration.effector_placement(t.effector)[0].T for t in rotations]
        headings = [np.arctan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]) for r in turns]
        yaw = float(np.arctan2(np.sum(np.sin(headings)), np.sum(np.cos(headings))))
        turn = pin.SE3(pin.utils.rotate("z", yaw), np.zeros(3))
        turned[:7] = pin.SE3ToXYZQUAT(turn * pin.XYZQUATToSE3(turned[:7]))
        configuration.update(turned)
    if feet:
        offsets = [t.position - configuration.effector_placement(t.effector)[1] for t in feet]
        turned[:3] += np.mean(offsets, axis=0)
    elif problem.com is not None:
        turned[:3] += np.nan_to_num(problem.com - configuration.com)
    return turned


def without_one(problem: PostureProblem) -> Iterator[tuple[str, PostureProblem]]:
    """The problem with one requirement left out at a time, and the name of that."""
    if problem.com is not None:
        yield "the centre-of-mass requirement", replace(problem, com=None)
    if problem.proximity is not None:
        yield "the clearances", replace(problem, proximity=None)
    if problem.learnt_margin is not None:
        yield "the learnt ranges of motion", replace(problem, learnt_margin=None)
    for contact in problem.contacts:
        rest = tuple(other for other in problem.contacts if other is not contact)
        yield f"contact '{contact.effector}'", replace(problem, contacts=rest)
    for name in problem.placements:
        rest_of = {key: value for key, value in problem.placements.items() if key != name}
        yield f"placement '{name}'", replace(problem, placements=rest_of)
