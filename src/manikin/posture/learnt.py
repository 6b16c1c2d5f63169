"""Hips and shoulders within the volumes that were learnt for them, as a requirement of a posture."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.body.configuration import Configuration
from manikin.body.model import BodyModel
from manikin.body.natural_range import LearntJoint, learnt_joints
from manikin.posture.terms import Linearised
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class LearntRangeTerm:
    """What each ball joint lacks of its learnt volume: ``r = min(d(q) - margin, 0)`` [rad].

    ``d`` is the signed distance of its three angles to the surface of the volume ([Tonneau2015]_ 4.3.3).

    Attributes:
        body: The body; one without learnt joints makes no rows.
        margin: Distance to keep to the surface, inside [rad].
    """

    body: BodyModel
    margin: float = 0.0

    @cached_property
    def joints(self) -> tuple[LearntJoint, ...]:
        """The ball joints of the body that have a volume."""
        return learnt_joints(self.body)

    def evaluate(self, configuration: Configuration) -> Linearised:
        """See :class:`~manikin.posture.terms.Term`."""
        angles = configuration.q[7:]
        residual, jacobian = np.zeros(len(self.joints)), np.zeros((len(self.joints), self.body.nv))
        for row, joint in enumerate(self.joints):
            own, volume = angles[joint.hinges], joint.range.volume
            missing = float(volume.distance(own)) - self.margin
            if missing < 0.0:
                residual[row] = missing
                jacobian[row, 6 + joint.hinges.start : 6 + joint.hinges.stop] = volume.gradient(own)
        return Linearised(residual, jacobian)

    def describe(self, residual: FloatArray) -> str:
        """See :class:`~manikin.posture.terms.Term`."""
        worst = int(np.argmin(residual))
        beyond = np.rad2deg(-residual[worst])
        return f"'{self.joints[worst].segment}' is {beyond:.1f} deg beyond its learnt range"
