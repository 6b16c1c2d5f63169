"""Bringing effectors exactly onto surfaces: inverse kinematics of a limb ([Tonneau2015]_ 5.3.2)."""

from dataclasses import dataclass

import numpy as np

from manikin.body import LimbKinematics
from manikin.contact_planning.alignment_step import LEVER, AlignmentStep
from manikin.spatial import FloatArray

POSITION_TOLERANCE = 1e-5
"""How far the effector may be from the surface point [m]."""
TILT_TOLERANCE = 1e-4
"""Angle between the effector's z axis and the normal that counts as aligned [rad]."""
STEPS = 7
"""Steps for position and normal, and again for the position alone."""
_STALLED = 0.9  # what comes no nearer than this share of its distance is left alone


@dataclass(frozen=True, eq=False)
class Alignment:
    """A limb put onto a point.

    Attributes:
        angles: (k,) [rad], within the joint ranges.
        rotation: (3, 3) from the effector's axes to the limb frame's.
        error: Distance of the effector to its point [m].
        tilt: Angle between the effector's z axis and the normal [rad].
    """

    angles: FloatArray
    rotation: FloatArray
    error: float
    tilt: float

    def lies(self, max_tilt: float, max_error: float = POSITION_TOLERANCE) -> bool:
        """Whether the effector is at its point, to ``max_error`` [m] and upright, to ``max_tilt`` [rad]."""
        return self.error <= max_error and self.tilt <= max_tilt


class Aligner:
    """Puts the effector of one limb onto points; works on buffers of its own."""

    def __init__(self, chain: LimbKinematics) -> None:
        """Prepare the steps of a limb."""
        self._level = AlignmentStep(chain, level=True)
        self._shift = AlignmentStep(chain, level=False)

    def align(
        self, angles: FloatArray, point: FloatArray, normal: FloatArray, max_tilt: float = TILT_TOLERANCE
    ) -> Alignment:
        """Move the effector to a point, its z axis along a normal, by damped least squares.

        The joint ranges are kept. Where a tilt is allowed, the position comes first: what is not
        there, upright, after some steps makes the last ones for the position alone.

        Args:
            angles: (k,) to begin with [rad].
            point: (3,) in the limb's frame [m].
            normal: (3,) unit vector in the limb's frame.
            max_tilt: Angle between z axis and normal that the caller will accept [rad].
        """
        found = _descend(self._level, angles, point, normal, LEVER)
        if max_tilt <= TILT_TOLERANCE or found.error <= POSITION_TOLERANCE:
            return found
        return _descend(self._shift, found.angles, point, normal, 0.0)


def _descend(
    step: AlignmentStep, angles: FloatArray, point: FloatArray, normal: FloatArray, lever: float
) -> Alignment:
    """Take steps until the effector has arrived or gets no nearer."""
    step.q[:], step.point[:], step.normal[:] = angles, point, normal
    last = np.inf
    error, tilt = step()
    for _ in range(STEPS):
        left = error + lever * tilt
        arrived = error <= POSITION_TOLERANCE and (tilt <= TILT_TOLERANCE or lever == 0.0)
        if arrived or left > _STALLED * last:
            break
        last = left
        step.q[:] = step.moved
        error, tilt = step()
    return Alignment(step.q.copy(), step.rotation.reshape(3, 3).T.copy(), error, tilt)
