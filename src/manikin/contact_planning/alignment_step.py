"""One step of the inverse kinematics of a limb as a compiled expression."""

from typing import Any, cast

import casadi as ca
import numpy as np

from manikin.body import LimbKinematics
from manikin.spatial import FloatArray

LEVER = 0.3
"""What one radian of tilt weighs beside one metre [m]."""
DAMPING = 1e-3
LARGEST_STEP = 0.4
"""Of each joint [rad]."""
_ZERO = 1e-12  # what is smaller comes from rounding


class AlignmentStep:
    """Measures how far an effector is from a point and a normal, and makes one damped step towards them.

    The expression of one limb has a thousand operations and takes microseconds, less than a single
    array operation on many limbs costs. Inputs and outputs are buffers that belong to the step.

    Attributes:
        q: (k,) joint angles, in [rad].
        point: (3,) target in the limb's frame, in [m].
        normal: (3,) unit target of the effector's z axis, in.
        moved: (k,) angles after the step, out [rad].
        rotation: (9,) the effector's axes at ``q`` in the limb's frame one after the other, out.
    """

    def __init__(self, chain: LimbKinematics, *, level: bool) -> None:
        """Compile the step of one limb.

        Args:
            chain: The limb.
            level: Whether the step turns the effector to the normal as well, or only moves it.
        """
        self.q, self.moved = np.zeros(len(chain)), np.zeros(len(chain))
        self.point, self.normal = np.zeros(3), np.zeros(3)
        self.rotation = np.zeros(9)
        self._missing = np.zeros(2)
        function = _step(chain, level=level)
        self._buffer, self._evaluate = cast(Any, function).buffer()
        for number, item in enumerate((self.q, self.point, self.normal)):
            self._buffer.set_arg(number, item.data)
        for number, item in enumerate((self.moved, self._missing, self.rotation)):
            self._buffer.set_res(number, item.data)
        self._read = self._missing.data

    def __call__(self) -> tuple[float, float]:
        """Evaluate at ``q``.

        Returns:
            Distance to the point [m], and angle to the normal [rad].
        """
        self._evaluate()
        return self._read[0], self._read[1]


def _step(chain: LimbKinematics, *, level: bool) -> ca.Function:
    q, point, normal = ca.SX.sym("q", len(chain)), ca.SX.sym("point", 3), ca.SX.sym("normal", 3)
    place, turn, axes, hinges = _forward(chain, q)
    gap = point - place
    tilt = _tilt(turn[:, 2], turn[:, 0], normal)
    none = ca.SX(3, 0)  # the columns of a limb without joints
    jacobian = ca.horzcat(none, *[ca.cross(a, place - h) for a, h in zip(axes, hinges, strict=True)])
    missing = gap
    if level:
        z = turn[:, 2]
        across = ca.horzcat(none, *[a - z * ca.dot(z, a) for a in axes])
        jacobian, missing = ca.vertcat(jacobian, LEVER * across), ca.vertcat(gap, LEVER * tilt)
    moved = _moved(chain, q, jacobian, missing)
    lengths = ca.vertcat(ca.sqrt(ca.sumsqr(gap)), ca.sqrt(ca.sumsqr(tilt)))
    return ca.Function("step", [q, point, normal], [moved, lengths, ca.vec(turn)], {"cse": True})


def _forward(chain: LimbKinematics, q: Any) -> tuple[Any, Any, list[Any], list[Any]]:
    """Effector's place and axes, the hinges' axes and places, in the limb's frame."""
    turn, place = ca.SX.eye(3), ca.SX.zeros(3, 1)
    axes, hinges = [], []
    for number, (axis, offset) in enumerate(zip(chain.axes, chain.offsets, strict=True)):
        place = place + turn @ _constant(offset)
        axes.append(turn @ _constant(axis))
        hinges.append(place)
        turn = turn @ _about(axis, q[number])
    return place + turn @ _constant(chain.tip), turn @ _constant(chain.tip_rotation), axes, hinges


def _about(axis: FloatArray, angle: Any) -> Any:
    """Rotation about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned = ca.sin(angle) * _constant(cross) + (1.0 - ca.cos(angle)) * _constant(cross @ cross)
    return ca.SX(_constant(np.eye(3))) + turned


def _tilt(z: Any, x: Any, normal: Any) -> Any:
    """Rotation vector that turns z to the normal by the shortest way."""
    across = ca.cross(z, normal)
    sine = ca.sqrt(ca.sumsqr(across))
    angle = ca.atan2(sine, ca.dot(z, normal))
    # At half a turn every axis across does, and the effector's x axis is one.
    opposite = ca.logic_and(sine < 1e-9, angle > 1.0)
    axis = ca.if_else(opposite, x, across)
    return axis * (angle / ca.if_else(opposite, 1.0, ca.fmax(sine, 1e-12)))


def _moved(chain: LimbKinematics, q: Any, jacobian: Any, missing: Any) -> Any:
    """Angles after one damped least squares step; joints that would leave their range are held."""
    lower, upper = ca.DM(chain.lower), ca.DM(chain.upper)
    pull = jacobian.T @ missing
    held = ca.logic_or(ca.logic_and(q <= lower, pull < 0.0), ca.logic_and(q >= upper, pull > 0.0))
    free = jacobian * ca.repmat((1.0 - held).T, jacobian.shape[0], 1)
    square = free @ free.T + DAMPING**2 * ca.DM.eye(jacobian.shape[0])
    move = free.T @ _solved(square, missing)
    step = ca.fmin(ca.fmax(move, -LARGEST_STEP), LARGEST_STEP)
    return ca.fmin(ca.fmax(q + step, lower), upper)


def _solved(square: Any, right: Any) -> Any:
    """Solution of a symmetric positive definite system by its Cholesky factor."""
    size = right.shape[0]
    factor = [[ca.SX(0)] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = square[i, j] - sum(factor[i][k] * factor[j][k] for k in range(j))
            factor[i][j] = ca.sqrt(rest) if i == j else rest / factor[j][j]
    forward: list[Any] = []
    for i in range(size):
        forward.append((right[i] - sum(factor[i][k] * forward[k] for k in range(i))) / factor[i][i])
    back: list[Any] = [ca.SX(0)] * size
    for i in reversed(range(size)):
        back[i] = (forward[i] - sum(factor[k][i] * back[k] for k in range(i + 1, size))) / factor[i][i]
    return ca.vertcat(*back)


def _constant(values: FloatArray) -> Any:
    """Constant whose zeros cost nothing."""
    array = np.asarray(values)
    return ca.sparsify(ca.DM(np.where(np.abs(array) < _ZERO, 0.0, array)))
