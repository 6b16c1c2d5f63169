"""Arms that are raised and swung: what arms can do against a fall ahead.

Of hanging arms that swing back, the angular momentum about the centre of mass is next to nothing: that of
their turning is undone by that of their centres, which are as high as the centre of mass and move back. Of
arms overhead that swing forward and down both go with the fall, over a range of half a turn and more. A
program that looks at one instant cannot find that out. So arms go up first, sideways to begin with, where
raising them costs little, and are then swung; meanwhile the trunk turns. This part is ours.
"""

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.control.balance_recovery.joint_groups import JointGroups
from manikin.control.dynamics import DynamicsState
from manikin.control.settings import Impedance
from manikin.spatial import FloatArray

APART = 0.183
"""Time for which arms that go up go sideways too [s]."""

RAISED = 0.246
"""Time after which raised arms are swung [s]: about as long as raising them takes."""

SWUNG = 1.25
"""Time after which the swing is over [s]."""

PULL = Impedance(112.4, 21.2)
"""Of shoulders and elbows: critically damped, in some 0.3 s at the angle wanted."""

RAISING, SWINGING = 0.07, 0.3
"""Weights of their accelerations while they are raised and swung, against 1 of the other joints."""

UP, SIDEWAYS, BENT, DOWN = 3.057, 1.39, 0.63, -1.04
"""Angles of shoulders and elbows: flexion and abduction at most, the elbow on the way up, the end [rad]."""

CLEAR = 0.2
"""Abduction of swung arms: their hands pass by the thighs [rad]."""

FAR = 1.3
"""Reach of the settled point over the soles from which on arms are raised; the trunk alone does for less."""

AHEAD = np.cos(np.radians(60.0))
"""Cosine of the largest angle between straight ahead and a fall that is one ahead."""


class ArmSwing:
    """Raises and swings the arms once, where a body falls ahead and the trunk alone may not do."""

    def __init__(self, body: BodyModel, groups: JointGroups) -> None:
        """Find the joints.

        Args:
            body: The body; one whose shoulders are not as a person's is left alone.
            groups: Its joints by group.
        """
        arms = {int(index): body.joint_names[index] for index in groups.joints["arm"]}
        flexion, abduction, elbow = (
            [index for index, name in arms.items() if name.endswith(end)]
            for end in ("shoulder_flexion", "shoulder_abduction", "elbow_flexion")
        )
        whole = len(flexion) == len(abduction) == len(elbow)
        self._joints = np.array(flexion + abduction + elbow if whole else [], dtype=np.int64)
        self._arms = len(flexion)
        self._began: float | None = None

    @property
    def joints(self) -> NDArray[np.int64]:
        """Hinge indices: flexion, then abduction of the shoulders, then elbows."""
        return self._joints

    def begin(self, time: float, fall: FloatArray, reach: float, ahead: FloatArray) -> None:
        """Begin where the body falls far ahead, unless the arms are on their way or have been.

        Args:
            time: Of the control [s].
            fall: (2,) direction of the fall, of any length.
            reach: Of its settled point over the soles.
            ahead: (2,) unit vector to where the body looks.
        """
        if self._began is None and reach > FAR and fall @ ahead > AHEAD * np.linalg.norm(fall):
            self._began = time

    def reset(self) -> None:
        """Forget the swing, so that another can begin."""
        self._began = None

    def wish(self, state: DynamicsState, time: float) -> tuple[FloatArray, float] | None:
        """Accelerations (k,) wanted of the joints [rad/s^2] and their weight; None when nothing is.

        Args:
            state: Of the body.
            time: Of the control [s].
        """
        since = np.inf if self._began is None else time - self._began
        if since >= SWUNG:
            return None
        angles = (UP, SIDEWAYS if since < APART else 0.0, BENT) if since < RAISED else (DOWN, CLEAR, 0.0)
        error = np.repeat(angles, self._arms) - state.q[7 + self._joints]
        pull = PULL.stiffness * error - PULL.damping * state.v[6 + self._joints]
        return pull, RAISING if since < RAISED else SWINGING
