"""Contacts, stances and their sequences: plain data, no geometry engine."""

from manikin.contact.contact import Contact, ContactKind, grasp, point, sole, soles_overlap
from manikin.contact.schedule import ContactSchedule
from manikin.contact.sequence import Phase, StanceSequence, Swing
from manikin.contact.stance import Stance

__all__ = [
    "Contact",
    "ContactKind",
    "ContactSchedule",
    "Phase",
    "Stance",
    "StanceSequence",
    "Swing",
    "grasp",
    "point",
    "sole",
    "soles_overlap",
]
