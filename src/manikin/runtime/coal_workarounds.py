"""Boxes of exactly their size in Coal, whatever was measured before.

Coal decides once per process, at the first support point of any box that it is asked for, whether the sides
of all boxes towards -x, -y and -z are moved outwards by 1e-10 of their half size: they are if that first
direction has a component of zero (``static const`` in ``getShapeSupport(const Box*, ...)``, seen in Coal
3.0 and before). It decides once more for boxes beside half-spaces, which another instance of the template
measures. Distances would then depend, in their eleventh digit, on which pair was the first, and what is
planned from them in digits that matter. Importing this module asks both first questions in directions
without zeros, which leaves boxes as they are; whatever works with Coal imports it.
"""

import coal
import numpy as np
from scipy.spatial.transform import Rotation


def ask_for_a_box() -> tuple[float, float]:
    """Distances of a capsule to a box and of a box to a half-space, in directions without a zero [m]."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_initial_guess = coal.GJKInitialGuess.CachedGuess
    request.cached_gjk_guess = np.array([1.0, 2.0, 3.0])
    place = coal.Transform3s(np.eye(3), np.array([3.0, 2.0, 1.0]))
    turned = coal.Transform3s(Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix(), np.array([0.0, 0.0, 2.0]))
    capsule, box, ground = coal.Capsule(0.1, 0.2), coal.Box(1.0, 1.0, 1.0), coal.Halfspace(_UP, 0.0)
    first = float(coal.distance(capsule, place, box, coal.Transform3s(), request, result))
    result.clear()
    return first, float(coal.distance(box, turned, ground, coal.Transform3s(), request, result))


_UP = np.array([0.0, 0.0, 1.0])
ask_for_a_box()
