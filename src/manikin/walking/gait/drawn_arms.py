"""Arms beside obstacles: where they would come too near they swing less, hanging close to the body."""

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import FloatArray
from manikin.scene import Scene
from manikin.scene.distance import Proximity, segment_of
from manikin.scene.scene import FLOOR

ARM_ROOM = 0.06
"""Arms that swing come no nearer to an obstacle than this, or are drawn in [m]."""

HELD, RAMP = 0.3, 0.6
"""Arms are drawn in from this time before to this time after, beyond the time that it takes them [s]."""

DRAWN_IN = {
    "shoulder_flexion": -0.05, "shoulder_abduction": 0.14, "shoulder_rotation": -0.1, "elbow_flexion": 0.08,
    "forearm_pronation": 0.0, "wrist_flexion": 0.0, "wrist_radial_deviation": 0.0,
}  # fmt: skip
"""Angles of arms that hang beside the body [rad]. They leave 15 mm to the trunk and the thighs of a walk.
In a person of 1.75 m they reach 0.31 m to the side and 0.1 m ahead of the pelvis, and 0.44 and 0.33 m as they
swing."""

_EVERY = 2
_ARM = ("upper_arm", "forearm", "hand")


class DrawnArms:
    """How far each arm of a walk is drawn in, for the sake of what stands there.

    Attributes:
        share: (2, n) of the left and the right arm: 0 as it swings, 1 close to the body.
    """

    def __init__(self, body: BodyModel, scene: Scene, time: FloatArray) -> None:
        """Begin with arms that swing.

        Args:
            body: A human.
            scene: What stands there; its floor does not count.
            time: (n,) even instants of the walk [s].
        """
        others = [item for item in scene if item.name != FLOOR]
        self._joints = [[body.joint_index(f"{side}_{name}") for name in DRAWN_IN] for side in SIDES]
        self._arms = [tuple(f"{side}_{part}" for part in _ARM) for side in SIDES]
        mine = {segment for arm in self._arms for segment in arm}
        rest = {segment.name for segment in body.segments} - mine
        self._ignored = frozenset((segment, item.name) for segment in rest for item in others)
        self._proximity = Proximity(body, Scene(others, None), self_collision=False)
        self._step, self._empty = float(time[1] - time[0]), not others
        self._near = np.zeros((2, len(time)), dtype=bool)
        self.share: FloatArray = np.zeros((2, len(time)))

    def look(self, q: FloatArray) -> bool:
        """Draw in what comes too near in (n, nq) postures, beside what did before; whether anything does."""
        if self._empty:
            return False
        close = self._proximity.evaluate_over(q[::_EVERY], ARM_ROOM, self._ignored)
        before = self._near.sum()
        for row, (shape, _) in zip(close.sample.tolist(), close.pairs, strict=True):
            arm = next(k for k, arm in enumerate(self._arms) if segment_of(shape) in arm)
            self._near[arm, row * _EVERY : (row + 1) * _EVERY] = True
        held, ramp = (2 * round(seconds / self._step) + 1 for seconds in (HELD + RAMP, RAMP))
        wide = maximum_filter1d(self._near.astype(np.float64), held, axis=1)
        self.share = least_jerk(np.clip(uniform_filter1d(wide, ramp, axis=1, mode="nearest"), 0.0, 1.0))[0]
        return bool(self._near.sum() > before)

    def applied(self, angles: FloatArray, free: FloatArray) -> FloatArray:
        """(n, h) hinge angles with the arms drawn in as far as they are to be [rad].

        Args:
            angles: (n, h) with the arms swinging [rad].
            free: (n,) how far the arms may be drawn in at all: 0 where a posture is given.
        """
        drawn = angles.copy()
        target = np.array(list(DRAWN_IN.values()))
        for joints, share in zip(self._joints, self.share * free, strict=True):
            drawn[:, joints] += share[:, None] * (target - drawn[:, joints])
        return drawn
