"""How much each residual of the whole-body fit matters."""

from dataclasses import dataclass, replace
from typing import Self

from manikin.wholebody.motion_scales import MotionScales


@dataclass(frozen=True)
class FitScales(MotionScales):
    """Size at which each residual of the whole-body fit along a planned centre of mass costs one unit.

    Attributes:
        com: Centre of mass [m].
        force: Rate of linear momentum, against the planned one [N].
        moment_share: Rate of angular momentum about the centre of mass that costs one unit, as
            a share of the planned margin: where balance is scarce, the body turns less.
    """

    com: float = 3.0e-3
    force: float = 20.0
    moment_share: float = 0.15

    def loosened(self, factor: float) -> Self:
        """Return the same scales with contacts and centre of mass ``factor`` times looser."""
        return replace(super().loosened(factor), com=self.com * factor)
