"""What a motion costs its joints over time."""

from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.ergonomics.strength import known_torques
from manikin.motion import Motion
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class CumulativeEffort:
    """Effort of each joint, (j,) each, from frame to frame with the trapezoidal rule.

    Attributes:
        joint_names: j hinges.
        squared_share: Integral of the square of torque per strength [s].
        positive_work: Integral of the power that the joint gives [J].
        negative_work: Integral of the power that it takes up, negative [J].
        duration: Time over which torques are known [s].
    """

    joint_names: tuple[str, ...]
    squared_share: FloatArray
    positive_work: FloatArray
    negative_work: FloatArray
    duration: float

    @property
    def absolute_work(self) -> FloatArray:
        """(j,) integral of the size of the power [J]."""
        return self.positive_work - self.negative_work

    @property
    def mean_share(self) -> float:
        """Root of the mean square of torque per strength, over all joints and the time."""
        if self.duration == 0.0:
            return 0.0
        return float(np.sqrt(self.squared_share.mean() / self.duration))


def cumulative_effort(body: BodyModel, motion: Motion) -> CumulativeEffort | None:
    """Add up what the joints do; frames without torques are left out.

    Args:
        body: Whose torque limits are taken.
        motion: Of this body.

    Returns:
        None if there are not two frames with torques, or the body has no joint.
    """
    rows = known_torques(motion)
    if not len(body.joint_names) or rows.sum() < 2:
        return None
    both = rows[1:] & rows[:-1]
    weight = np.zeros(len(motion.time))
    half = 0.5 * np.diff(motion.time) * both
    weight[:-1] += half
    weight[1:] += half
    weight, torque, rate = weight[rows], motion.tau[rows, 6:], motion.v[rows, 6:]
    power = torque * rate
    return CumulativeEffort(
        joint_names=body.joint_names,
        squared_share=weight @ body.torque_share(torque) ** 2,
        positive_work=weight @ np.maximum(power, 0.0),
        negative_work=weight @ np.minimum(power, 0.0),
        duration=float(weight.sum()),
    )
