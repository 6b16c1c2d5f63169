"""Start and goal of a scenario as contacts with a posture."""

import numpy as np

from manikin.contact_planning import Endpoints, Habit, Stage
from manikin.scenarios import Scenario


def stage_at(endpoints: Endpoints, scenario: Scenario, end: str) -> Stage | str:
    """Contacts and posture at the start or the goal of a scenario, or why there are none.

    Args:
        endpoints: Finds them.
        scenario: With start and goal.
        end: ``"start"`` or ``"goal"``.
    """
    state = getattr(scenario.file.task, end)
    heading, habit = float(np.deg2rad(state.heading_deg or 0.0)), Habit(state.posture or "standing")
    found = endpoints.find(np.array(state.at), heading, habit, state.height_m)
    return found.stage or f"the {end}: {found.failure}"
