"""The body: neutral description, human anthropometry, configurations."""

from manikin.body.anthropometry import Anthropometry
from manikin.body.configuration import Configuration, difference, integrate, interpolate, random_configuration
from manikin.body.creature import LimbSpec, creature_from_mjcf, creature_from_urdf
from manikin.body.dimensions import measured_dimensions
from manikin.body.further_bodies import kudoh, point_mass
from manikin.body.human import body_from_signature, human
from manikin.body.joint_volume import JointVolume, volume_of
from manikin.body.legged import insect, quadruped
from manikin.body.limbs import (
    are_mirrored,
    limb_named,
    limb_placement,
    with_further_contacts,
    with_knees_and_elbows,
    with_root,
)
from manikin.body.model import BodyModel
from manikin.body.natural_range import NaturalRange, human_volumes
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape, ShapeKind
from manikin.body.strength import carrying

__all__ = [
    "Anthropometry", "BodyModel", "Configuration", "Effector", "Hinge", "JointVolume", "Limb", "LimbSpec",
    "NaturalRange", "Segment", "Shape", "ShapeKind", "are_mirrored", "body_from_signature", "carrying",
    "creature_from_mjcf", "creature_from_urdf", "difference", "human", "human_volumes", "insect", "integrate",
    "interpolate", "kudoh", "limb_named", "limb_placement", "measured_dimensions", "point_mass", "quadruped",
    "random_configuration", "volume_of", "with_further_contacts", "with_knees_and_elbows", "with_root",
]  # fmt: skip
