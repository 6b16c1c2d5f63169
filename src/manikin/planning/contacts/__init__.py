"""Contacts found on their own: the searches for feet and limbs, and the request for one contact."""

from manikin.planning.contacts.best_first import Extension, heading_of
from manikin.planning.contacts.candidates import Candidates, Situation, find_candidates
from manikin.planning.contacts.contact_plan import ContactPlan, ContactRules, Stage
from manikin.planning.contacts.crawl_search import CrawlSearch
from manikin.planning.contacts.endpoint import Endpoint, Endpoints, Habit, starts_on_limbs
from manikin.planning.contacts.footholds import Footholds
from manikin.planning.contacts.generator import (
    ContactGenerator,
    GeneratedContact,
    GeneratorSettings,
    Hindrance,
)
from manikin.planning.contacts.heuristics import (
    HEURISTICS,
    BalanceScore,
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
)
from manikin.planning.contacts.limb_places import limb_holds
from manikin.planning.contacts.limb_search import LimbHolds, LimbSearch, LimbSettings
from manikin.planning.contacts.posture_finder import PostureFinder, PostureFinderSettings
from manikin.planning.contacts.seat import leave_seat, rising_times, take_seat
from manikin.planning.contacts.walk_search import WalkSearch, WalkSettings

__all__ = [
    "HEURISTICS", "BalanceScore", "Candidates", "ClosestDistance", "Comfort", "ContactGenerator",
    "ContactPlan", "ContactRules", "CrawlSearch", "Duration", "Efort", "Endpoint", "Endpoints",
    "Extension", "Footholds", "GeneratedContact", "GeneratorSettings", "Habit", "Heuristic", "Hindrance",
    "LimbHolds", "LimbSearch", "LimbSettings", "Manipulability",
    "PostureFinder", "PostureFinderSettings", "Random", "Situation", "Stage", "StrongEfort",
    "WalkSearch", "WalkSettings", "WeightedSum", "duration",
    "find_candidates", "heading_of", "leave_seat", "limb_holds", "rising_times", "starts_on_limbs",
    "take_seat",
]  # fmt: skip
