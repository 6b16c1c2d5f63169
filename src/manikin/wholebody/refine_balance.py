"""Balance with room to spare: the margin of the whole body's wrench in the polytope of its stance.

What the contact-force program allows may lie on the very edge of what friction and soles admit.  Here
the distance to every facet of the stance's wrench polytope ([Qiu2012]_ 4.36), its caps included, is wanted
to be larger than a margin.
"""

import numpy as np
from scipy.special import expit

from manikin.balance import wrench_polytope
from manikin.contact import Stance
from manikin.spatial import FloatArray, wrench_map
from manikin.wholebody.refine_physics import WrenchCost, centre_of

FLAT = 1.0
"""Radius of the largest ball in a polytope below which it is flat: it has no inside to stay in [N.m]."""

SHARE = 0.4
"""Most of that radius that is wanted as margin."""


class BalanceRoom:
    """The margin of one stance.

    Args:
        stance: The contacts with their caps.

    Attributes:
        polytope: Its wrenches about the mean contact point.
        radius: Of the largest ball in it [N.m].
    """

    def __init__(self, stance: Stance) -> None:
        self._to_local = wrench_map(centre_of(stance))
        self.polytope = wrench_polytope(stance, reference=centre_of(stance))
        self.radius = self.polytope.inscribed_ball()[1]

    @property
    def is_flat(self) -> bool:
        """Whether the stance's wrenches fill no volume, as without contacts or on two points."""
        return self.radius < FLAT

    def margin(self, wrench: FloatArray) -> FloatArray:
        """(n,) margin about the mean contact point of wrenches (n, 6) about the world origin [N.m]."""
        return self.polytope.margin(wrench @ self._to_local.T)

    def cost(self, wrench: FloatArray, wanted: float, violation: float, softness: float) -> WrenchCost:
        """Softened squares of what the distances to the facets lack.

        Args:
            wrench: (n, 6) about the world origin.
            wanted: Margin [N.m]; at most :data:`SHARE` of the largest ball's radius.
            violation: Missing margin that costs one unit [N.m].
            softness: Width of the bend of the penalty [N.m].
        """
        n = len(wrench)
        if self.is_flat:
            return WrenchCost(np.zeros(n), np.zeros((n, 6)), np.zeros((n, 6, 6)))
        H = self.polytope.H
        wanted = min(wanted, SHARE * self.radius)
        distance = self.polytope.distances(wrench @ self._to_local.T)
        near = np.flatnonzero(np.any(distance < wanted + 6.0 * softness, axis=0))
        rows, missing = H[near] @ self._to_local, (wanted - distance[:, near]) / softness
        residual = softness * np.logaddexp(0.0, missing) / violation
        slope = expit(missing) / violation
        outer = (rows[:, :, None] * rows[:, None, :]).reshape(len(near), 36)
        return WrenchCost(
            0.5 * np.sum(residual**2, axis=1),
            (residual * slope) @ rows,
            (slope**2 @ outer).reshape(n, 6, 6),
        )
