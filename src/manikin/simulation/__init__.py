"""Physics: the body and the scene in MuJoCo."""

from manikin.simulation.compile import SimulationModel, compile_model
from manikin.simulation.execute import default_physics, execute
from manikin.simulation.execution import Execution
from manikin.simulation.options import PhysicsOptions
from manikin.simulation.pushed import PushOutcome, push_impulse, push_on_the_way
from manikin.simulation.recover import Feet, RecoveryTask, push_near_com, recover
from manikin.simulation.recovery import Recovery
from manikin.simulation.world import Push, Touch, World

__all__ = [
    "Execution",
    "Feet",
    "PhysicsOptions",
    "Push",
    "PushOutcome",
    "Recovery",
    "RecoveryTask",
    "SimulationModel",
    "Touch",
    "World",
    "compile_model",
    "default_physics",
    "execute",
    "push_impulse",
    "push_near_com",
    "push_on_the_way",
    "recover",
]
