"""Parts of the body that come near to each other, and are kept from touching.

A hand that makes up for an error swings a few centimetres off its plan, past a leg which swings, too. An
approach is braked as late as it can be, and only of parts that are nearer to each other than planned: what
passes by as planned turns away by itself.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import manikin.runtime.coal_workarounds  # noqa: F401  (before the first distance)
from manikin.body import BodyModel
from manikin.control.dynamics import DynamicsState
from manikin.control.reference import ReferenceSample
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, skew

WATCHED = 0.15
"""Parts of the body are watched that come nearer than this to each other in the plan [m]."""
NEAR = 0.12
"""Watched parts nearer than this are kept apart [m]."""
APART = 0.006
"""They keep this distance, or half of the least planned one if that is less [m]."""
OFF_PLAN = 0.01
"""Parts are left alone that are at most so much nearer to each other than planned [m]."""
BRAKING = 15.0
"""An approach that takes more than this to stop in time is braked [m/s^2]."""
FASTEST = 10.0
"""No two parts approach each other faster than this [m/s]: what is far is looked at again later."""
LARGEST = 100.0
"""They are not driven apart faster than this [m/s^2]."""
LOOK = 0.05
"""Time between two instants of the plan whose distances are measured [s]."""

_WORLD_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, eq=False)
class Parting:
    """Least second derivative of a distance between two parts of the body.

    Attributes:
        pair: Names of their shapes, ``"segment/shape"``.
        gradient: (nv,) ``d(distance)/dt = gradient @ v``.
        least: Of ``gradient @ a`` [m/s^2].
    """

    pair: tuple[str, str]
    gradient: FloatArray
    least: float


class SelfWatch:
    """Distances between parts of a body that follows a motion, step by step."""

    def __init__(self, body: BodyModel, motion: Motion) -> None:
        """Find the pairs of shapes that come near to each other in the motion."""
        self._model, every = body.pinocchio, body.geometry
        self._data, self._planned_data = self._model.createData(), self._model.createData()
        self._rest = np.zeros(self._model.nv)
        self._shapes = every.copy()
        self._placed = self._shapes.createData()
        count = len(every.collisionPairs)
        least = np.full(count, np.inf)
        step = max(1, round(LOOK * len(motion.time) / max(motion.duration, LOOK)))
        for q in motion.q[::step] if count else ():
            pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._placed, q)
            pin.computeDistances(self._shapes, self._placed)
            least = np.minimum(least, [result.min_distance for result in self._placed.distanceResults])
        self._shapes.removeAllCollisionPairs()
        for pair, gap in zip(every.collisionPairs, least, strict=True):
            if gap < WATCHED:
                self._shapes.addCollisionPair(pair)
        self._kept = np.minimum(APART, 0.5 * least[least < WATCHED])
        self._placed, self._planned = self._shapes.createData(), self._shapes.createData()
        self._step = 0
        self._due, self._gaps = np.zeros(len(self._kept), dtype=np.int64), np.full(len(self._kept), np.inf)
        self._names = [item.name for item in self._shapes.geometryObjects]

    def partings(
        self, state: DynamicsState, reference: ReferenceSample, horizon: float, period: float
    ) -> list[Parting]:
        """What keeps parts from touching that are near to each other at the state of the next step.

        Args:
            horizon: Time in which parts that are too near are brought apart [s].
            period: Time since the step before [s].
        """
        self._step += 1
        due = np.flatnonzero(self._due <= self._step).tolist()
        if not due:
            return []
        model, data = self._model, self._data
        pin.updateGeometryPlacements(model, data, self._shapes, self._placed, state.q)
        shapes, placed = self._shapes, self._placed
        gaps = np.array([pin.computeDistance(shapes, placed, index).min_distance for index in due])
        wait = (gaps - NEAR) / (FASTEST * period)
        # By how it changed, and a fifth more as it may have quickened: the rate itself takes longer.
        rates, room = 1.2 * (gaps - self._gaps[due]) / period, gaps - self._kept[due]
        self._gaps[due], self._due[due] = gaps, self._step + np.maximum(wait.astype(np.int64), 1)
        close = np.flatnonzero((gaps < NEAR) & is_braked(room, rates))
        found = [due[k] for k in close.tolist() if self._planned_gap(reference, due[k]) > gaps[k] + OFF_PLAN]
        if found:
            pin.computeJointJacobians(model, data, state.q)
            pin.forwardKinematics(model, data, state.q, state.v, self._rest)
        return [self._parting(state, index, horizon) for index in found]

    def _parting(self, state: DynamicsState, index: int, horizon: float) -> Parting:
        gradient, drift = self._derivatives(index)
        rate, pair = float(gradient @ state.v), self._shapes.collisionPairs[index]
        least = least_parting(self._gaps[index] - self._kept[index], rate, horizon)
        return Parting((self._names[pair.first], self._names[pair.second]), gradient, least - drift)

    def _planned_gap(self, reference: ReferenceSample, index: int) -> float:
        """Planned distance of a pair [m]."""
        pair, model, data = self._shapes.collisionPairs[index], self._model, self._planned_data
        pin.forwardKinematics(model, data, reference.q)
        for shape in (pair.first, pair.second):
            item = self._shapes.geometryObjects[shape]
            self._planned.oMg[shape] = data.oMi[item.parentJoint] * item.placement
        return float(pin.computeDistance(self._shapes, self._planned, index).min_distance)

    def _derivatives(self, index: int) -> tuple[FloatArray, float]:
        """Gradient (nv,) of a distance, and its second derivative without that of the joints [m/s^2].

        The points stay those that are nearest now; that others become nearest makes the distance of rounded
        shapes grow.
        """
        result, pair = self._placed.distanceResults[index], self._shapes.collisionPairs[index]
        shapes = self._shapes.geometryObjects[pair.first], self._shapes.geometryObjects[pair.second]
        points = result.getNearestPoint1(), result.getNearestPoint2()
        first, second = (self._point(*of) for of in zip(shapes, points, strict=True))
        normal = np.array(result.normal)  # from the first to the second
        return normal @ (second[0] - first[0]), float(normal @ (second[1] - first[1]))

    def _point(self, shape: Any, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Jacobian (3, nv) and acceleration (3,) without that of the joints of a point on a segment."""
        model, data, frame = self._model, self._data, shape.parentFrame
        arm = point - pin.updateFramePlacement(model, data, frame).translation
        jacobian = pin.getFrameJacobian(model, data, frame, _WORLD_ALIGNED)
        turning = pin.getFrameVelocity(model, data, frame, _WORLD_ALIGNED).angular
        drift = pin.getFrameClassicalAcceleration(model, data, frame, _WORLD_ALIGNED).vector
        along = drift[:3] + np.cross(drift[3:], arm) + np.cross(turning, np.cross(turning, arm))
        return jacobian[:3] - skew(arm) @ jacobian[3:], along


def is_braked(room: FloatArray, rate: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether approaches have a least second derivative, as of :func:`least_parting`."""
    return (room <= 0.0) | ((rate < 0.0) & (rate**2 > BRAKING * room))


def least_parting(room: float, rate: float, horizon: float) -> float:
    """Least second derivative of a distance with so much room left, which changes at a rate [m/s^2].

    It is what stops the approach within the room, from where that takes :data:`BRAKING` on; from half of it
    on it rises from minus :data:`LARGEST`, which is as good as none.
    """
    if room <= 0.0:
        return min(2.0 * (-room - horizon * rate) / horizon**2, LARGEST)
    needed = min(0.5 * rate**2 / room, LARGEST) if rate < 0.0 else 0.0
    share = min(max(2.0 * needed / BRAKING - 1.0, 0.0), 1.0)
    return share * needed - (1.0 - share) * LARGEST
