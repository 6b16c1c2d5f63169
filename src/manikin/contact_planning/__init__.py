"""Contacts found on their own: samples of limbs, EFORT, and the request for one contact."""

from manikin.contact_planning.alignment import Aligner, Alignment
from manikin.contact_planning.candidates import Candidates, Situation, SurfaceTable, find_candidates
from manikin.contact_planning.collisions import LimbCollisions
from manikin.contact_planning.efort import (
    Ellipsoid,
    Task,
    efort,
    force_ellipsoid,
    force_transmission_ratio,
    pulling_efort,
    velocity_ellipsoid,
)
from manikin.contact_planning.endpoint import Endpoint, Endpoints, Habit
from manikin.contact_planning.exertable import exertable_force
from manikin.contact_planning.extend import ExtendSettings, extend
from manikin.contact_planning.extension import Extension
from manikin.contact_planning.footholds import Foothold, Footholds, FootholdSettings
from manikin.contact_planning.generator import (
    ContactGenerator,
    GeneratedContact,
    GeneratorSettings,
    Hindrance,
)
from manikin.contact_planning.guide_line import GuideLine, heading_of
from manikin.contact_planning.heuristics import (
    HEURISTICS,
    Balance,
    ClosestDistance,
    Comfort,
    Duration,
    Efort,
    Heuristic,
    Manipulability,
    Random,
    StrongEfort,
    WeightedSum,
    duration,
    heuristic_named,
)
from manikin.contact_planning.limb_extend import LimbExtendSettings, extend_limbs
from manikin.contact_planning.limb_places import LimbPlaces, Near
from manikin.contact_planning.limb_start import LimbStart, starts_on_limbs
from manikin.contact_planning.plan_certificate import PlanCertificate, certify_plan
from manikin.contact_planning.poser import Posed, Poser, PoserSettings
from manikin.contact_planning.samples import LimbSamples, manipulability, mirrored, sample_limb, sample_limbs
from manikin.contact_planning.stage import ContactPlan, Stage
from manikin.contact_planning.static_forces import static_room, static_torque_share
from manikin.contact_planning.static_region import StaticRegion
from manikin.contact_planning.storage import load_samples, samples_for, save_samples
from manikin.contact_planning.touch import ContactRules, make_contact

__all__ = [
    "HEURISTICS",
    "Aligner",
    "Alignment",
    "Balance",
    "Candidates",
    "ClosestDistance",
    "Comfort",
    "ContactGenerator",
    "ContactPlan",
    "ContactRules",
    "Duration",
    "Efort",
    "Ellipsoid",
    "Endpoint",
    "Endpoints",
    "ExtendSettings",
    "Extension",
    "Foothold",
    "FootholdSettings",
    "Footholds",
    "GeneratedContact",
    "GeneratorSettings",
    "GuideLine",
    "Habit",
    "Heuristic",
    "Hindrance",
    "LimbCollisions",
    "LimbExtendSettings",
    "LimbPlaces",
    "LimbSamples",
    "LimbStart",
    "Manipulability",
    "Near",
    "PlanCertificate",
    "Posed",
    "Poser",
    "PoserSettings",
    "Random",
    "Situation",
    "Stage",
    "StaticRegion",
    "StrongEfort",
    "SurfaceTable",
    "Task",
    "WeightedSum",
    "certify_plan",
    "duration",
    "efort",
    "exertable_force",
    "extend",
    "extend_limbs",
    "find_candidates",
    "force_ellipsoid",
    "force_transmission_ratio",
    "heading_of",
    "heuristic_named",
    "load_samples",
    "make_contact",
    "manipulability",
    "mirrored",
    "pulling_efort",
    "sample_limb",
    "sample_limbs",
    "samples_for",
    "save_samples",
    "starts_on_limbs",
    "static_room",
    "static_torque_share",
    "velocity_ellipsoid",
]
