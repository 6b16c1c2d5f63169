"""Balance with room to spare: the margin of the whole body's wrench in the polytope of its stance.

What the contact-force program allows may lie on the very edge of what friction and soles admit.  Here
the distance to every facet of the stance's wrench polytope ([Qiu2012]_ 4.36), its caps included and moments
about the CoM, is wanted to be larger than a margin.
"""

import numpy as np
from scipy.special import expit

from manikin.balance import stability_margins, wrench_polytope
from manikin.balance.friction import cross
from manikin.balance.margin import wrench_levers
from manikin.contact import Stance
from manikin.spatial import FloatArray, wrench_map
from manikin.wholebody.refine_physics import WrenchCost, centre_of

FLAT = 1.0
"""Radius of the largest ball in a polytope below which it is flat: it has no inside to stay in [N.m]."""

SHARE = 0.4
"""Most of the largest margin of any wrench that is wanted as margin."""


class BalanceRoom:
    """The margin of one stance.

    Args:
        stance: The contacts with their caps.

    Attributes:
        polytope: Its wrenches about the mean contact point.
        is_flat: Whether the stance's wrenches fill no volume, as without contacts or on two points.
    """

    def __init__(self, stance: Stance) -> None:
        self._to_local = wrench_map(centre_of(stance))
        self.polytope = wrench_polytope(stance, reference=centre_of(stance))
        self.is_flat = self.polytope.inscribed_ball()[1] < FLAT

    def wanted(self, margin: float, com: FloatArray) -> float:
        """A wanted margin, or :data:`SHARE` of the largest one of any wrench when that is less [N.m].

        Args:
            margin: [N.m].
            com: (3,) where the CoM is about, about which the moments are [m].
        """
        if self.is_flat:
            return margin
        return min(margin, SHARE * self.polytope.at_reference(com).inscribed_ball()[1])

    def margin(self, wrench: FloatArray, com: FloatArray) -> FloatArray:
        """(n,) margin about the CoM (n, 3) of wrenches (n, 6) about the world origin [N.m]."""
        found = stability_margins(self.polytope, wrench @ self._to_local.T, com)
        return found.wrench_about_com

    def cost(
        self, wrench: FloatArray, com: FloatArray, wanted: float, violation: float, softness: float
    ) -> WrenchCost:
        """Softened squares of what the distances to the facets lack, with derivatives by wrench and CoM.

        Args:
            wrench: (n, 6) about the world origin.
            com: (n, 3) CoM [m].
            wanted: Margin, see :meth:`wanted` [N.m].
            violation: Missing margin that costs one unit [N.m].
            softness: Width of the bend of the penalty [N.m].
        """
        n = len(wrench)
        if self.is_flat:
            return WrenchCost(np.zeros(n), np.zeros((n, 6)), np.zeros((n, 6, 6)), np.zeros((n, 3)))
        H = self.polytope.H
        arm = com - self.polytope.reference
        length = wrench_levers(H, arm)
        distance = self.polytope.distances(wrench @ self._to_local.T) / length
        near = np.flatnonzero(np.any(distance < wanted + 6.0 * softness, axis=0))
        rows, missing = H[near] @ self._to_local, (wanted - distance[:, near]) / softness
        residual = softness * np.logaddexp(0.0, missing) / violation
        length = length[:, near]
        slope = expit(missing) / violation / length
        # A row's length l has the derivative (H1 + H2 arm^) x H2 / l by the CoM.
        moment = H[near, 3:]
        at_com = H[near, :3] + cross(moment, arm[:, None, :])
        by_length = residual * slope * distance[:, near] / length
        outer = (rows[:, :, None] * rows[:, None, :]).reshape(len(near), 36)
        return WrenchCost(
            0.5 * np.sum(residual**2, axis=1),
            (residual * slope) @ rows,
            (slope**2 @ outer).reshape(n, 6, 6),
            np.einsum("nf,nfc->nc", by_length, cross(at_com, moment)),
        )
