"""Task heights carried over to bodies of another stature.

A scenario gives the CoM's heights for a body of the reference stature.  For a body
``s`` times as tall every height above the supports is ``s`` times as large:
``z' = base + s (z - base)``, with the supports' level ``base`` blended smoothly from the
start to the goal.  At ``s = 1`` nothing changes.  This is our own rule; the theses plan
for one stature only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.scenarios.expressions import Expression, functions_for
from manikin.spatial import IDENTITY, FloatArray, PlanarTransform


@dataclass(frozen=True, eq=False)
class SupportLevel:
    """Height of the supports below the CoM, from the start's to the goal's.

    Attributes:
        start: (2,) horizontal position of the CoM at the start [m].
        goal: (2,) at the goal [m].
        start_level: Height of the supports at the start [m].
        goal_level: Height of the supports at the goal [m].
    """

    start: FloatArray
    goal: FloatArray
    start_level: float
    goal_level: float

    def __call__(self, x: Any, y: Any) -> Any:
        """Level at a horizontal CoM position: twice continuously differentiable.

        The blend is the smootherstep ``6 u^5 - 15 u^4 + 10 u^3`` of the position ``u`` in
        [0, 1] along the straight line from start to goal.

        Args:
            x: Float, array or CasADi expression [m].
            y: The same.
        """
        line = self.goal - self.start
        length_squared = float(line @ line)
        if length_squared < 1e-12 or self.start_level == self.goal_level:
            return self.start_level + 0.0 * x
        functions = functions_for(x, y)
        along = ((x - self.start[0]) * line[0] + (y - self.start[1]) * line[1]) / length_squared
        u = functions.fmin(functions.fmax(along, 0.0), 1.0)
        return self.start_level + (self.goal_level - self.start_level) * u**3 * (u * (6.0 * u - 15.0) + 10.0)


@dataclass(frozen=True, eq=False)
class HeightBand:
    """Lower and upper bound of the CoM's height, scaled to the body.

    Attributes:
        lower_expression: Lowest height for the reference stature.
        upper_expression: Greatest height for the reference stature.
        level: Height of the supports.
        scale: Stature over reference stature.
        transform_expressions_to_world: Where the expressions' x and y are measured.
    """

    lower_expression: Expression
    upper_expression: Expression
    level: SupportLevel
    scale: float = 1.0
    transform_expressions_to_world: PlanarTransform = IDENTITY

    def lower(self, x: Any, y: Any, z: Any) -> Any:
        """Lowest height of a CoM at (x, y, z) [m]; floats, arrays or CasADi expressions."""
        return self._scaled(self.lower_expression, x, y, z)

    def upper(self, x: Any, y: Any, z: Any) -> Any:
        """Greatest height of a CoM at (x, y, z) [m]; floats, arrays or CasADi expressions."""
        return self._scaled(self.upper_expression, x, y, z)

    def violation(self, com: FloatArray) -> FloatArray:
        """How far each CoM is outside the band; negative inside.

        Args:
            com: (..., 3) [m].

        Returns:
            (...) [m].
        """
        x, y, z = com[..., 0], com[..., 1], com[..., 2]
        return np.maximum(self.lower(x, y, z) - z, z - self.upper(x, y, z))

    def _scaled(self, expression: Expression, x: Any, y: Any, z: Any) -> Any:
        own_x, own_y = self._in_frame(x, y)
        if self.scale == 1.0:
            return expression(own_x, own_y, z)
        base = self.level(x, y)
        return base + self.scale * (expression(own_x, own_y, base + (z - base) / self.scale) - base)

    def _in_frame(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Horizontal position in the frame of the expressions."""
        frame = self.transform_expressions_to_world
        if frame.is_identity:
            return x, y
        cosine, sine, _ = frame.rotation[:, 0].tolist()
        x, y = x - frame.x, y - frame.y
        return cosine * x + sine * y, cosine * y - sine * x
