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
from manikin.contact.rolling import Rolling, roll_feet
from manikin.contact.schedule import ContactSchedule
from manikin.contact.sequence import Phase, StanceSequence, Swing
from manikin.contact.stance import Stance

__all__ = [
    "Contact",
    "ContactKind",
    "ContactSchedule",
    "Phase",
    "Rolling",
    "SolePart",
    "Stance",
    "StanceSequence",
    "Swing",
    "grasp",
    "point",
    "roll_feet",
    "sole",
    "sole_part",
    "soles_overlap",
]
