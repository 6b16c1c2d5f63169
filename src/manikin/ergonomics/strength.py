"""Joint torques compared with strength, and the cumulative effort of the joints."""

from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number


@dataclass(frozen=True, eq=False)
class CumulativeEffort:
    """Effort of each joint, (j,) each, from frame to frame with the trapezoidal rule.

    Attributes:
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


LOADED = 0.5
"""Share of the strength above which a joint counts as loaded."""

SOURCES = {
    "human": "published isometric strength by joint and direction of a healthy adult of that sex, age and "
    "size (Anderson et al. 2007, Harbo et al. 2012 and others); no dependence on angle or speed",
    "kudoh": "ours, symmetric; the thesis prints none",
}
"""Where the torque limits of a body come from, by its name."""


@dataclass(frozen=True, eq=False)
class JointStrength:
    """Torques of a motion against the torque limits of its body.

    Attributes:
        limit: (j,) size of the torque limit in the direction in which the largest share is reached [N.m].
        share: (n, j) torque over the limit in its direction; NaN where the torque is not known.
        peak: (j,) largest share.
        peak_time: (j,) when it is reached [s].
        loaded: (j,) share of the time above ``fraction``.
        fraction: Share of the strength above which a joint counts as loaded.
        known: Share of the frames with torques.
        source: Where the limits come from.
    """

    joint_names: tuple[str, ...]
    limit: FloatArray
    share: FloatArray
    peak: FloatArray
    peak_time: FloatArray
    loaded: FloatArray
    fraction: float
    known: float
    source: str

    @property
    def order(self) -> list[int]:
        """Joints from the largest peak to the smallest."""
        return [int(index) for index in np.argsort(-self.peak, kind="stable")]

    @property
    def largest(self) -> FloatArray:
        """(n,) largest share of any joint; NaN where torques are not known."""
        return self.share.max(axis=1)


def joint_strength(body: BodyModel, motion: Motion, fraction: float = LOADED) -> JointStrength | None:
    """Compare torques with strength.

    Args:
        body: Whose torque limits are taken.
        fraction: Share of the strength above which a joint counts as loaded.

    Returns:
        None if the motion has no frame with torques, or the body no joint.

    Raises:
        InputError: If the fraction is not from 0 to 1.
    """
    finite_number(fraction, "fraction of the strength", at_least=0.0, at_most=1.0)
    rows = known_torques(motion)
    if not len(body.joint_names) or not rows.any():
        return None
    share = np.full((len(motion.time), len(body.joint_names)), np.nan)
    share[rows] = body.torque_share(motion.tau[rows, 6:])
    known = share[rows]
    peak = known.argmax(axis=0)
    pushed = motion.tau[rows, 6:][peak, np.arange(len(peak))] >= 0.0
    weight = durations(motion.time)[rows]
    return JointStrength(
        joint_names=body.joint_names,
        limit=np.where(pushed, body.torque_upper, -body.torque_lower),
        share=share,
        peak=known.max(axis=0),
        peak_time=motion.time[rows][peak],
        loaded=weight @ (known > fraction) / weight.sum(),
        fraction=fraction,
        known=float(rows.mean()),
        source=SOURCES.get(body.name, "the torque limits of the body"),
    )


def known_torques(motion: Motion) -> np.ndarray:
    """(n,) whether the torques of all joints are known; those of a recording may not be."""
    return np.asarray(np.isfinite(motion.tau).all(axis=1))


def durations(time: FloatArray) -> FloatArray:
    """(n,) time that each sample stands for, half to each neighbour [s]; 1 for a single sample."""
    if len(time) == 1:
        return np.ones(1)
    steps = np.diff(time)
    return 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
