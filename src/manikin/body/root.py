"""The frame of a body's root, for tasks that place it."""

from dataclasses import replace

import numpy as np

from manikin.body.model import BodyModel
from manikin.body.segments import Effector

PELVIS = "pelvis"
"""Effector of a human's root."""


def with_root(body: BodyModel) -> tuple[BodyModel, str]:
    """The body, and the name of the effector at the origin of its root; one is added where there is none.

    Configurations are the same for both bodies.
    """
    if PELVIS in body.effectors:
        return body, PELVIS
    name = body.segments[0].name
    while name in body.effectors:
        name += "_root"
    root = Effector(name, body.segments[0].name, np.zeros(3))
    return replace(body, effectors={**body.effectors, name: root}), name
