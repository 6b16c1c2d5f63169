"""The contact that a section of a scenario or stance file describes."""

import math

import numpy as np

from manikin.contact import Contact, grasp, point, sole
from manikin.scenarios.sections import ContactSection, SoleSection
from manikin.spatial import rotation_from_normal, rotation_from_rpy


def build_contact(
    effector: str,
    entry: ContactSection,
    friction: float,
    default_sole: SoleSection,
    *,
    planning: bool = False,
    force_cap: float | None = None,
) -> Contact:
    """Build one contact from its section and the defaults around it.

    Args:
        effector: Name of the effector.
        entry: The contact's section.
        friction: Coulomb coefficient where the contact gives none.
        default_sole: Sole size where the contact gives none.
        planning: Let ``default_sole`` shrink a sole the contact gives itself.
        force_cap: Cap on the normal force where the contact gives none [N].

    Raises:
        ContactError: If a value is out of its range.
    """
    kind = entry.kind_for(effector)
    if kind == "grasp":
        rpy = None if entry.rpy_deg is None else np.radians(entry.rpy_deg)
        return grasp(
            effector,
            entry.position,
            max_force=(planning and entry.planning_max_force_N) or entry.max_force_N or 0.0,
            max_moment=entry.max_moment_Nm or 0.0,
            rotation=None if rpy is None else rotation_from_rpy(*rpy),
        )
    friction = entry.friction or friction
    force_cap = entry.normal_force_cap_N or force_cap
    if kind == "point":
        return point(
            effector, entry.position, friction=friction,
            rotation=rotation_from_normal(entry.normal or (0.0, 0.0, 1.0), math.radians(entry.yaw_deg)),
            normal_force_cap=force_cap,
        )  # fmt: skip
    own = entry.sole or default_sole
    shrink = planning and entry.sole is not None
    return sole(
        effector,
        entry.position,
        math.radians(entry.yaw_deg),
        length=min(own.length_m, default_sole.length_m) if shrink else own.length_m,
        width=min(own.width_m, default_sole.width_m) if shrink else own.width_m,
        friction=friction,
        normal=entry.normal,
        normal_force_cap=force_cap,
        torsion_limit=entry.torsion_limit_Nm,
        settle=entry.settle_s or 0.0,
    )
