"""Contacts, stances and their sequences: plain data, no geometry engine."""

from manikin.contact.contact import (
    Contact,
    ContactKind,
    SolePart,
    grasp,
    point,
    sole,
    sole_part,
    soles_overlap,
)
from manikin.contact.model import (
    BODY_WEIGHTS_CAP,
    FRICTION_MODELS,
    ContactModel,
    FrictionModel,
    default_normal_force_cap,
)
from manikin.contact.rolling import Rolling, roll_feet
from manikin.contact.schedule import ContactSchedule
from manikin.contact.sequence import Phase, StanceSequence, Swing
from manikin.contact.stance import Stance

__all__ = [
    "BODY_WEIGHTS_CAP",
    "FRICTION_MODELS",
    "Contact",
    "ContactKind",
    "ContactModel",
    "ContactSchedule",
    "FrictionModel",
    "Phase",
    "Rolling",
    "SolePart",
    "Stance",
    "StanceSequence",
    "Swing",
    "default_normal_force_cap",
    "grasp",
    "point",
    "roll_feet",
    "sole",
    "sole_part",
    "soles_overlap",
]
