"""Sections of a scenario file, one pydantic model each; lengths are metres and angles degrees."""

from manikin.scenarios.sections.body import BodySection, LimbSection
from manikin.scenarios.sections.com_constraint import ComConstraintSection, HeightBandSection
from manikin.scenarios.sections.contact import ContactSection, SoleSection
from manikin.scenarios.sections.contacts import ContactsSection
from manikin.scenarios.sections.frame import FrameSection
from manikin.scenarios.sections.obstacle import ObstacleSection, RoundSection, SphereSection
from manikin.scenarios.sections.phase import PhaseSection
from manikin.scenarios.sections.planning import PlanningSection, WeightsSection
from manikin.scenarios.sections.push import PushSection, RecoverySection
from manikin.scenarios.sections.supports import SupportsSection
from manikin.scenarios.sections.task import ActSection, StateSection, TaskSection
from manikin.scenarios.sections.walking import StandSection, WalkerSection, WalkingSection, WaypointSection
from manikin.scenarios.sections.wholebody import WholebodySection

__all__ = [
    "ActSection",
    "BodySection",
    "ComConstraintSection",
    "ContactSection",
    "ContactsSection",
    "FrameSection",
    "HeightBandSection",
    "LimbSection",
    "ObstacleSection",
    "PhaseSection",
    "PlanningSection",
    "PushSection",
    "RecoverySection",
    "RoundSection",
    "SoleSection",
    "SphereSection",
    "StandSection",
    "StateSection",
    "SupportsSection",
    "TaskSection",
    "WalkerSection",
    "WalkingSection",
    "WaypointSection",
    "WeightsSection",
    "WholebodySection",
]
