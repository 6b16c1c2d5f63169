"""Physics: the body and the scene in MuJoCo."""

from manikin.simulation.compile import PhysicsOptions, compile_model
from manikin.simulation.execute import default_physics, execute
from manikin.simulation.execution import Execution
from manikin.simulation.push_force import Push, push_impulse, push_near_com, push_on_the_way
from manikin.simulation.push_map import PushMap, equal_directions, search_directions
from manikin.simulation.push_search import (
    DirectionSearch,
    HeldImpulse,
    PushTrials,
    feet_apart_posture,
    largest_held,
    one_foot_posture,
)
from manikin.simulation.recover import Feet, RecoveryTask, recover
from manikin.simulation.recovery import Recovery
from manikin.simulation.world import World

__all__ = [
    "DirectionSearch", "Execution", "Feet", "HeldImpulse", "PhysicsOptions", "Push", "PushMap",
    "PushTrials", "Recovery", "RecoveryTask", "World", "compile_model", "default_physics",
    "equal_directions", "execute", "feet_apart_posture", "largest_held",
    "one_foot_posture", "push_impulse", "push_near_com", "push_on_the_way", "recover", "search_directions",
]  # fmt: skip
