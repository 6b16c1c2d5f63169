"""Balance: admissible wrenches, margins and the classical criteria ([Qiu2012]_ chapter 4)."""

from manikin.balance.friction import FrictionModel
from manikin.balance.wrench import WrenchPolytope, pseudo_wrench, wrench_polytope

__all__ = ["FrictionModel", "WrenchPolytope", "pseudo_wrench", "wrench_polytope"]
