"""The body: neutral description, human anthropometry, configurations."""

from manikin.body.anthropometry import Anthropometry, Sex
from manikin.body.configuration import (
    Configuration,
    difference,
    integrate,
    interpolate,
    random_configuration,
)
from manikin.body.human import body_from_signature, human
from manikin.body.model import BodyModel
from manikin.body.point_mass import point_mass
from manikin.body.segments import Effector, Hinge, Segment, Shape, ShapeKind

__all__ = [
    "Anthropometry",
    "BodyModel",
    "Configuration",
    "Effector",
    "Hinge",
    "Segment",
    "Sex",
    "Shape",
    "ShapeKind",
    "body_from_signature",
    "difference",
    "human",
    "integrate",
    "interpolate",
    "point_mass",
    "random_configuration",
]
