"""One foot as time goes on: where it stands, and what its next step will be corrected by."""

from dataclasses import dataclass

import numpy as np

from manikin.locomotion.stance_foot import smooth_step
from manikin.spatial import FloatArray

LATE = 0.5
"""A foot that is found swinging after this share of the swing keeps its correction: it stood a moment ago."""


@dataclass(eq=False)
class FootState:
    """What a controller knows of a foot from one instant to the next.

    Attributes:
        pose: (3,) x, y [m], yaw [rad] where it stands.
        offset: (3,) of the last instant.
        before: (3,) at the begin of the swing.
        after: (3,) aimed at for the end of the swing.
        standing: Whether it stood.
    """

    pose: FloatArray
    offset: FloatArray
    before: FloatArray
    after: FloatArray
    standing: bool = True

    @classmethod
    def at(cls, pose: FloatArray) -> "FootState":
        """Standing somewhere."""
        return cls(pose, np.zeros(3), np.zeros(3), np.zeros(3))

    def lifted(self, swing: float, target: FloatArray) -> None:
        """Begin a swing towards a correction."""
        self.standing = False
        self.before = self.offset
        self.after = self.offset if swing > LATE else target

    def update(self, wanted: FloatArray, swing: float) -> None:
        """Go on to the next instant.

        Args:
            wanted: (3,) x, y [m], yaw [rad] where the gait has the foot.
            swing: How far it has swung, -1 while it stands.
        """
        if swing >= 0.0:
            share = float(smooth_step(np.array(swing)))
            self.offset = (1.0 - share) * self.before + share * self.after
            return
        if not self.standing:
            self.pose, self.standing = wanted + self.after, True
        self.offset = self.pose - wanted
        self.offset[2] = (self.offset[2] + np.pi) % (2.0 * np.pi) - np.pi

    @property
    def corrected_by(self) -> float:
        """Distance between the corrections of one step and the next [m]."""
        return float(np.hypot(*(self.after - self.before)[:2]))
