"""Bringing effectors exactly onto surfaces: inverse kinematics of a limb ([Tonneau2015]_ 5.3.2)."""

from dataclasses import dataclass
from typing import Any, cast

import casadi as ca
import numpy as np

from manikin.kinematics.limb_kinematics import LimbKinematics
from manikin.numerics.spatial import FloatArray, skew

LEVER = 0.3
"""Weight of one radian of tilt relative to one metre [m]."""
DAMPING = 1e-3
LARGEST_STEP = 0.4
"""Largest step of each joint [rad]."""
_ZERO = 1e-12  # what is smaller comes from rounding


class AlignmentStep:
    """Distance of an effector to a point and a normal and one damped step towards them, compiled.

    The expression of one limb has a thousand operations and takes microseconds, less than a single
    array operation on many limbs costs. Inputs and outputs are buffers that belong to the step.

    Attributes:
        q: (k,) joint angles, in [rad].
        point: (3,) target in the limb's frame, in [m].
        normal: (3,) unit target of the effector's z axis, in.
        moved: (k,) angles after the step, out [rad].
        rotation: (9,) the effector's axes at ``q`` in the limb's frame one after the other, out.
        product: (9,) ``J J^T`` of the effector's translation at ``q``, out [m^2].
    """

    def __init__(self, chain: LimbKinematics, *, level: bool) -> None:
        """Compile the step of one limb, which turns the effector to the normal too if it is to be level."""
        k = len(chain)
        self.q, self.point, self.normal, self.moved, missing, self.rotation, self.product = buffers = [
            np.zeros(size) for size in (k, 3, 3, k, 2, 9, 9)
        ]
        self._buffer, self._evaluate = cast(Any, _step(chain, level=level)).buffer()
        for number, item in enumerate(buffers[:3]):
            self._buffer.set_arg(number, item.data)
        for number, item in enumerate(buffers[3:]):
            self._buffer.set_res(number, item.data)
        self._read = missing.data

    def __call__(self) -> tuple[float, float]:
        """Distance to the point [m], and angle to the normal [rad] at ``q``."""
        self._evaluate()
        return self._read[0], self._read[1]

    def descend(
        self, angles: FloatArray, point: FloatArray, normal: FloatArray, lever: float
    ) -> tuple[float, float]:
        """Take steps from angles (k,) until the effector is there or gets no nearer; as :meth:`__call__`."""
        q, moved, evaluate, read = self.q, self.moved, self._evaluate, self._read
        q[:], self.point[:], self.normal[:] = angles, point, normal
        last = np.inf
        evaluate()
        for _ in range(STEPS):
            error, tilt = read
            left = error + lever * tilt
            arrived = error <= POSITION_TOLERANCE and (tilt <= TILT_TOLERANCE or lever == 0.0)
            if arrived or left > _STALLED * last:
                break
            last = left
            q[:] = moved
            evaluate()
        return read[0], read[1]


def _step(chain: LimbKinematics, *, level: bool) -> ca.Function:
    q, point, normal = ca.SX.sym("q", len(chain)), ca.SX.sym("point", 3), ca.SX.sym("normal", 3)
    place, turn, axes, hinges = _forward(chain, q)
    gap = point - place
    tilt = _tilt(turn[:, 2], turn[:, 0], normal)
    none, z = ca.SX(3, 0), turn[:, 2]  # the first: the columns of a limb without joints
    jacobian = ca.horzcat(none, *[ca.cross(a, place - h) for a, h in zip(axes, hinges, strict=True)])
    missing, product = gap, jacobian @ jacobian.T
    if level:
        across = ca.horzcat(none, *[a - z * ca.dot(z, a) for a in axes])
        jacobian, missing = ca.vertcat(jacobian, LEVER * across), ca.vertcat(gap, LEVER * tilt)
    moved = _moved(chain, q, jacobian, missing)
    lengths = ca.vertcat(ca.sqrt(ca.sumsqr(gap)), ca.sqrt(ca.sumsqr(tilt)))
    outputs = [moved, lengths, ca.vec(turn), ca.densify(ca.vec(product))]
    return ca.Function("step", [q, point, normal], outputs, {"cse": True})


def _forward(chain: LimbKinematics, q: Any) -> tuple[Any, Any, list[Any], list[Any]]:
    """Effector's position and axes, the hinges' axes and positions, in the limb's frame."""
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
    cross = skew(axis)
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


POSITION_TOLERANCE, TILT_TOLERANCE = 1e-5, 1e-4
"""Distance of the effector to the surface point [m], and of its z axis to the normal [rad], that do."""
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
        product: (3, 3) ``J J^T`` of the effector's translation in the limb's frame [m^2].
    """

    angles: FloatArray
    rotation: FloatArray
    error: float
    tilt: float
    product: FloatArray

    def lies(self, max_tilt: float, max_error: float = POSITION_TOLERANCE) -> bool:
        """Whether the effector is at its point, to ``max_error`` [m] and upright, to ``max_tilt`` [rad]."""
        return self.error <= max_error and self.tilt <= max_tilt


class Aligner:
    """Puts the effector of one limb onto points; works on buffers of its own."""

    def __init__(self, chain: LimbKinematics) -> None:
        self._level = AlignmentStep(chain, level=True)
        self._shift = AlignmentStep(chain, level=False)

    def align(
        self, angles: FloatArray, point: FloatArray, normal: FloatArray, max_tilt: float = TILT_TOLERANCE
    ) -> Alignment:
        """Move the effector to a point, its z axis along a normal, by damped least squares.

        The joint ranges are kept. Where a tilt is allowed, the last steps are for the position alone.

        Args:
            angles: (k,) to begin with [rad].
            point: (3,) in the limb's frame [m].
            normal: (3,) unit vector in the limb's frame.
            max_tilt: Angle between z axis and normal that the caller will accept [rad].
        """
        step = self._level
        error, tilt = step.descend(angles, point, normal, LEVER)
        if max_tilt > TILT_TOLERANCE and error > POSITION_TOLERANCE:
            step, start = self._shift, step.q
            error, tilt = step.descend(start, point, normal, 0.0)
        turn, product = step.rotation.reshape(3, 3).T.copy(), step.product.reshape(3, 3).copy()
        return Alignment(step.q.copy(), turn, error, tilt, product)
