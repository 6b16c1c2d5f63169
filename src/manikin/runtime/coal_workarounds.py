"""Boxes of exactly their size in Coal, whatever was measured before.

Coal decides once per process, at the first support point of any box that it is asked for, whether the sides
of all boxes towards -x, -y and -z are moved outwards by 1e-10 of their half size: they are if that first
direction has a component of zero (``static const`` in ``getShapeSupport(const Box*, ...)``, seen in Coal
3.0 and before). Distances would then depend, in their eleventh digit, on which pair was the first, and
what is planned from them in digits that matter. Importing this module asks that first question in a
direction without zeros, which leaves boxes as they are; whatever works with Coal imports it.
"""

import coal
import numpy as np


def ask_for_a_box() -> float:
    """Distance of a capsule to a box, iterated from a direction that has no zero in it [m]."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_initial_guess = coal.GJKInitialGuess.CachedGuess
    request.cached_gjk_guess = np.array([1.0, 2.0, 3.0])
    place = coal.Transform3s(np.eye(3), np.array([3.0, 2.0, 1.0]))
    capsule, box = coal.Capsule(0.1, 0.2), coal.Box(1.0, 1.0, 1.0)
    return float(coal.distance(capsule, place, box, coal.Transform3s(), request, result))


ask_for_a_box()
