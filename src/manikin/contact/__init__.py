"""Contacts, stances and their sequences: plain data, no geometry engine."""

from manikin.contact.contact import (
    BODY_WEIGHTS_CAP,
    FRICTION_MODELS,
    Contact,
    ContactKind,
    ContactModel,
    FrictionModel,
    SolePart,
    default_normal_force_cap,
    grasp,
    point,
    rolling_front,
    sole,
    sole_part,
    soles_overlap,
)
from manikin.contact.stance import (
    CarriedLoad,
    ContactSchedule,
    ExertedForce,
    Phase,
    Stance,
    StanceSequence,
    Swing,
    roll_feet,
)

__all__ = [
    "BODY_WEIGHTS_CAP", "FRICTION_MODELS", "CarriedLoad", "Contact", "ContactKind", "ContactModel",
    "ContactSchedule", "ExertedForce", "FrictionModel", "Phase", "SolePart", "Stance",
    "StanceSequence", "Swing", "default_normal_force_cap", "grasp", "point", "roll_feet", "rolling_front",
    "sole", "sole_part", "soles_overlap",
]  # fmt: skip
