"""Postures of a body that follow targets, instant by instant."""

import numpy as np

from manikin.body import BodyModel
from manikin.mocap.inverse_kinematics import InverseKinematics
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

POOR = 0.05
"""A frame with a point farther away than this [m] is searched from its own start, too."""


def follow(body: BodyModel, targets: Targets, starts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Postures that follow targets, each searched from the one before.

    Args:
        body: The body that carries the targets' points.
        targets: Of n instants.
        starts: (n, nq) postures within the limits; the first is where the search begins, the others
            are tried where the search from the frame before leaves a point farther than :data:`POOR`.

    Returns:
        (n, nq) postures and (n, k) distances of the points from their targets [m], NaN where not seen.
    """
    solver = InverseKinematics(body, targets)
    q, residual = np.empty((len(targets), body.nq)), np.empty((len(targets), len(targets.names)))
    start = starts[0]
    for frame, wanted in enumerate(targets.positions):
        start, cost = solver.solve(start, wanted)
        away = _distances(solver, start, wanted)
        if frame and np.nanmax(away[targets.weights >= 1.0], initial=0.0) > POOR:
            other, other_cost = solver.solve(starts[frame], wanted)
            if other_cost < 0.9 * cost:
                start, away = other, _distances(solver, other, wanted)
        q[frame], residual[frame] = start, away
    return q, residual


def _distances(solver: InverseKinematics, q: FloatArray, wanted: FloatArray) -> FloatArray:
    return np.linalg.norm(solver.places(q) - wanted, axis=1)
