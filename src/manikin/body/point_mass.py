"""A body without limbs: all its mass in one small ball, on feet that weigh nothing ([Qiu2012]_ 5.4.4).

It can be planned for, but has no joints to move and nothing to execute.  Its feet are where
the contact schedule has them, see :func:`manikin.motion.massless.foot_positions`.
"""

import numpy as np

from manikin.body.model import BodyModel
from manikin.body.segments import Segment, Shape, ShapeKind
from manikin.errors import BodyError
from manikin.spatial import finite_number

RADIUS = 0.1
"""Radius of the ball that stands for the point [m]."""


def point_mass(mass: float) -> BodyModel:
    """Make a point mass.

    Args:
        mass: [kg], > 0.

    Raises:
        BodyError: If the mass is not a positive number.
    """
    mass = finite_number(mass, "mass [kg]", above=0.0, error=BodyError)
    ball = Shape("ball", ShapeKind.SPHERE, np.array([RADIUS]), np.zeros(3), np.eye(3))
    root = Segment(
        name="body",
        parent=None,
        origin=np.zeros(3),
        hinges=(),
        mass=mass,
        com=np.zeros(3),
        inertia=0.4 * mass * RADIUS**2 * np.eye(3),
        shapes=(ball,),
    )
    return BodyModel(name="point mass", segments=(root,), effectors={}, nominal_mass=mass)
