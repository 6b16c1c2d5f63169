"""Physics: the body and the scene in MuJoCo."""

from manikin.simulation.compile import SimulationModel, compile_model
from manikin.simulation.options import PhysicsOptions

__all__ = ["PhysicsOptions", "SimulationModel", "compile_model"]
