"""Joint torques against what the joints can give."""

from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.spatial import FloatArray, finite_number

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
        joint_names: j hinges.
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
        motion: Of this body.
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
