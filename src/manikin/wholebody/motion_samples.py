"""Kinematics of a whole-body spline at its samples, with what one pass over them gives at once."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.scene.distance import moves_by_joint
from manikin.scene.placed import PlacedShapes, PlacementReader
from manikin.spatial import FloatArray, skew
from manikin.wholebody.banded import SampledBasis
from manikin.wholebody.configuration_spline import StateSamples, states_from_raw, tangent_map
from manikin.wholebody.momentum_rate import MomentumRate, MomentumRateSamples


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """A spline's states with their kinematics.

    Attributes:
        raw: Raw spline values, rates and second derivatives (n, nq) each.
        states: Configurations, velocities and accelerations.
        tangent: (n, 7, 7) :func:`~manikin.wholebody.configuration_spline.tangent_map`.
        com: (n, 3) centre of mass [m].
        com_jacobian: (n, 3, nv).
        momentum: Rate of the centroidal momentum.
        frames: (n, k, 4, 4) frame-to-world transforms of the frames asked for.
        shapes: The collision shapes, with the joints' Jacobians.
    """

    raw: tuple[FloatArray, FloatArray, FloatArray]
    states: StateSamples
    tangent: FloatArray
    com: FloatArray
    com_jacobian: FloatArray
    momentum: MomentumRate
    frames: FloatArray
    shapes: PlacedShapes


class MotionSampler:
    """Evaluates splines of one basis.

    Args:
        body: The body.
        frames: Names of the effectors whose frames are needed.
        basis: The spline's basis at the samples.
    """

    def __init__(self, body: BodyModel, frames: tuple[str, ...], basis: SampledBasis) -> None:
        self._model: pin.Model = body.pinocchio
        self._data = self._model.createData()
        self._geometry, self._geometry_data = body.geometry, pin.GeometryData(body.geometry)
        self._basis, self._mass = basis, body.mass
        indices = [body.effector_frame(name) for name in frames]
        self._shape_reader = PlacementReader(self._geometry_data.oMg)
        self._frame_reader = PlacementReader(self._data.oMf, indices)
        moves = moves_by_joint(self._model)
        self._moving = [np.flatnonzero(moves[self._model.frames[index].parentJoint]) for index in indices]

    def sample(self, points: FloatArray) -> MotionSamples:
        """Evaluate the spline with control points (k, nq)."""
        raw = (
            self._basis.evaluate(points), self._basis.evaluate(points, 1), self._basis.evaluate(points, 2)
        )  # fmt: skip
        states, tangent = states_from_raw(*raw), tangent_map(raw[0])
        n, model, data = len(states.q), self._model, self._data
        momentum = MomentumRateSamples(model, n)
        com, jacobians = np.empty((n, 3)), np.empty((n, 6, model.nv))
        frames = np.empty((n, len(self._moving), 4, 4))
        shapes = np.empty((n, self._geometry.ngeoms, 4, 4))
        for s in range(n):
            momentum.record(s, data, states)
            pin.updateFramePlacements(model, data)
            pin.updateGeometryPlacements(model, data, self._geometry, self._geometry_data)
            com[s], jacobians[s] = data.com[0], data.J
            self._frame_reader.read(frames[s])
            self._shape_reader.read(shapes[s])
        return MotionSamples(
            raw, states, tangent, com, momentum.linear_by_acceleration / self._mass,
            momentum.by_raw(states, raw, tangent), frames, PlacedShapes(shapes, jacobians),
        )  # fmt: skip

    def frame_jacobian(self, motion: MotionSamples, number: int) -> FloatArray:
        """(n, 6, nv) linear, then angular velocity of frame ``number`` in world axes, per ``v``."""
        columns = self._moving[number]
        joints = motion.shapes.jacobians[:, :, columns]
        out = np.zeros_like(motion.shapes.jacobians)
        out[:, :3, columns] = joints[:, :3] - skew(motion.frames[:, number, :3, 3]) @ joints[:, 3:]
        out[:, 3:, columns] = joints[:, 3:]
        return out
