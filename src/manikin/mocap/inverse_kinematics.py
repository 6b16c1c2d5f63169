"""Postures within the joints' limits whose points lie closest to their targets."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

REST = 1e-3
"""Distance [m] that weighs as much as one radian away from the resting posture."""

STEADY = 3e-3
"""Distance [m] that weighs as much as one radian away from the start."""

_HOLD = REST**2 + STEADY**2

MOST_STEPS = 30
LEAST_GAIN = 1e-4
"""A step that lowers the cost by a smaller share is the last one."""

LEAST_COST = 1e-10
"""Cost [m^2] below which nothing is left to gain."""


@dataclass(frozen=True, eq=False)
class _Points:
    """Targets as Pinocchio sees them: joints, and which velocities move which point."""

    joints: tuple[int, ...]
    local: FloatArray
    weights: FloatArray
    moved: FloatArray


class InverseKinematics:
    """Levenberg-Marquardt on one posture, projected onto the joints' ranges.

    Minimised is the weighted sum of squared distances of points from their targets plus
    ``(REST * (angle - rest))^2 + (STEADY * (angle - start))^2`` of every hinge, which settles what the
    points leave open without leaps from one instant to the next. A hinge at
    the end of its range that the cost pushes outward is held for the step (Bertsekas, "Projected
    Newton methods for optimization problems with simple constraints", 1982).
    """

    def __init__(self, body: BodyModel, targets: Targets) -> None:
        """Prepare a body and the points of its segments; the resting posture is the standing one."""
        self._body, self._model = body, body.pinocchio
        self._data = self._model.createData()
        self._rest = self._held = body.standing_posture()[7:]
        self._points = _points(body, targets)

    def solve(self, start: FloatArray, wanted: FloatArray) -> tuple[FloatArray, float]:
        """The closest posture, searched from a start.

        Args:
            start: (nq,) posture within the limits.
            wanted: (k, 3) places of the targets [m]; NaN where one is not seen.

        Returns:
            (nq,) posture and its cost [m^2].
        """
        q, damping = np.array(start), 1e-6
        self._held = (REST**2 * self._rest + STEADY**2 * q[7:]) / _HOLD
        seen = ~np.isnan(wanted[:, 0])
        wanted = np.where(seen[:, None], wanted, 0.0)
        weights = self._points.weights * seen
        error = self.places(q) - wanted
        cost = self._cost(q, error, weights)
        for _ in range(MOST_STEPS):
            if cost < LEAST_COST:
                break
            gradient, hessian = self._system(q, error, weights)
            before = cost
            while damping < 1e3:
                trial = self._moved(q, gradient, hessian, damping)
                trial_error = self.places(trial) - wanted
                trial_cost = self._cost(trial, trial_error, weights)
                if trial_cost < cost:
                    q, error, cost, damping = trial, trial_error, trial_cost, max(0.1 * damping, 1e-8)
                    break
                damping *= 10.0
            if before - cost <= LEAST_GAIN * before:
                break
        return q, cost

    def places(self, q: FloatArray) -> FloatArray:
        """(k, 3) places of the points in the world [m]; Pinocchio's data follow the posture."""
        pin.forwardKinematics(self._model, self._data, q)
        frames = [self._data.oMi[joint] for joint in self._points.joints]
        turns = np.array([frame.rotation for frame in frames])
        shifts = np.array([frame.translation for frame in frames])
        return shifts + np.einsum("kij,kj->ki", turns, self._points.local)

    def _cost(self, q: FloatArray, error: FloatArray, weights: FloatArray) -> float:
        away = q[7:] - self._held
        return float(weights @ np.sum(error * error, axis=1) + _HOLD * away @ away)

    def _system(self, q: FloatArray, error: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gradient (nv,) and Gauss-Newton matrix (nv, nv) of half the cost."""
        places = self.places(q)
        columns: Any = pin.computeJointJacobians(self._model, self._data, q)
        linear, angular = columns[:3].T, columns[3:].T
        velocities = (linear + np.cross(angular, places[:, None])) * self._points.moved[..., None]
        root = np.sqrt(weights)[:, None]
        jacobian = (velocities * root[..., None]).transpose(0, 2, 1).reshape(-1, self._model.nv)
        gradient, hessian = jacobian.T @ (error * root).ravel(), jacobian.T @ jacobian
        gradient[6:] += _HOLD * (q[7:] - self._held)
        hessian[np.arange(6, len(hessian)), np.arange(6, len(hessian))] += _HOLD
        return gradient, hessian

    def _moved(self, q: FloatArray, gradient: FloatArray, hessian: FloatArray, damping: float) -> FloatArray:
        """The posture after one damped step, hinges at their ends held or stopped there."""
        lower, upper = self._body.lower, self._body.upper
        held = np.zeros(len(gradient), dtype=bool)
        held[6:] = ((q[7:] <= lower) & (gradient[6:] > 0.0)) | ((q[7:] >= upper) & (gradient[6:] < 0.0))
        free = ~held
        step = np.zeros(len(gradient))
        matrix = hessian[np.ix_(free, free)] + damping * np.eye(int(free.sum()))
        step[free] = -np.linalg.solve(matrix, gradient[free])
        step *= min(1.0, 1.0 / max(float(np.abs(step[3:]).max()), 1e-12))
        moved = pin.integrate(self._model, q, step)
        moved[7:] = np.clip(moved[7:], lower, upper)
        return np.asarray(moved)


def _points(body: BodyModel, targets: Targets) -> _Points:
    model, joints, local = body.pinocchio, [], []
    moved = np.zeros((len(targets.names), model.nv))
    for number, (segment, point) in enumerate(zip(targets.segments, targets.points, strict=True)):
        frame = model.frames[body.segment_frame(segment)]
        joints.append(frame.parentJoint)
        local.append(frame.placement.act(np.array(point)))
        for joint in list(model.supports[frame.parentJoint])[1:]:
            first = model.joints[joint].idx_v
            moved[number, first : first + model.joints[joint].nv] = 1.0
    return _Points(tuple(joints), np.array(local), np.array(targets.weights), moved)
