"""Sections of a scenario file, one pydantic model each; lengths are metres and angles degrees."""

from manikin.scenarios.sections.planning_sections import (
    BodySection,
    ComConstraintSection,
    ContactsSection,
    HeightBandSection,
    LimbSection,
    PlanningSection,
    WeightsSection,
    WholebodySection,
)
from manikin.scenarios.sections.support_sections import (
    ContactSection,
    PhaseSection,
    SoleSection,
    SupportsSection,
)
from manikin.scenarios.sections.task_sections import (
    ActSection,
    FrameSection,
    ObstacleSection,
    PushSection,
    RecoverySection,
    RoundSection,
    SphereSection,
    StandSection,
    StateSection,
    TaskSection,
    WalkerSection,
    WalkingSection,
    WaypointSection,
)

__all__ = [
    "ActSection", "BodySection", "ComConstraintSection", "ContactSection", "ContactsSection", "FrameSection",
    "HeightBandSection", "LimbSection", "ObstacleSection", "PhaseSection", "PlanningSection", "PushSection",
    "RecoverySection", "RoundSection", "SoleSection", "SphereSection", "StandSection", "StateSection",
    "SupportsSection", "TaskSection", "WalkerSection", "WalkingSection", "WaypointSection", "WeightsSection",
    "WholebodySection",
]  # fmt: skip
