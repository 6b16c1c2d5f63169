"""The body: neutral description, human anthropometry, configurations."""

from manikin.body.anthropometry import Anthropometry, Sex
from manikin.body.configuration import (
    Configuration,
    difference,
    integrate,
    interpolate,
    random_configuration,
)
from manikin.body.creature import LimbSpec, creature_from_urdf
from manikin.body.further_contacts import with_further_contacts, with_knees_and_elbows
from manikin.body.human import body_from_signature, human
from manikin.body.human_volumes import human_volumes
from manikin.body.insect import insect
from manikin.body.joint_volume import JointVolume, volume_of
from manikin.body.kudoh import kudoh
from manikin.body.limb_kinematics import EffectorPlacements, LimbKinematics
from manikin.body.limbs import are_mirrored, limb_named, limb_placement, limbs_of
from manikin.body.load import carrying
from manikin.body.model import BodyModel
from manikin.body.natural_range import NaturalRange
from manikin.body.point_mass import point_mass
from manikin.body.reach_volume import ReachVolume, reach_volume
from manikin.body.root import with_root
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape, ShapeKind

__all__ = [
    "Anthropometry",
    "BodyModel",
    "Configuration",
    "Effector",
    "EffectorPlacements",
    "Hinge",
    "JointVolume",
    "Limb",
    "LimbKinematics",
    "LimbSpec",
    "NaturalRange",
    "ReachVolume",
    "Segment",
    "Sex",
    "Shape",
    "ShapeKind",
    "are_mirrored",
    "body_from_signature",
    "carrying",
    "creature_from_urdf",
    "difference",
    "human",
    "human_volumes",
    "insect",
    "integrate",
    "interpolate",
    "kudoh",
    "limb_named",
    "limb_placement",
    "limbs_of",
    "point_mass",
    "random_configuration",
    "reach_volume",
    "volume_of",
    "with_further_contacts",
    "with_knees_and_elbows",
    "with_root",
]
