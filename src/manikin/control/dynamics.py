"""Mass matrix, bias forces, Jacobians and their drifts at one state of the body."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.numerics.spatial import GRAVITY_VECTOR, FloatArray

_WORLD_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, eq=False)
class FrameState:
    """Placement, velocity and differential kinematics of one frame, in world axes.

    Attributes:
        rotation: (3, 3) frame to world.
        position: (3,) of the frame's origin [m].
        twist: (6,) velocity of the origin, angular velocity [m/s, rad/s].
        jacobian: (6, nv) ``twist = jacobian @ v``.
        drift: (6,) ``d(jacobian)/dt @ v`` [m/s^2, rad/s^2].
    """

    rotation: FloatArray
    position: FloatArray
    twist: FloatArray
    jacobian: FloatArray
    drift: FloatArray


@dataclass(frozen=True, eq=False)
class DynamicsState:
    """What the controller needs to know about one state ``q, v``.

    The equation of motion is ``mass_matrix @ a + bias = [0; tau] + sum J^T force``.

    Attributes:
        q: (nq,) configuration.
        v: (nv,) velocity.
        mass_matrix: (nv, nv) symmetric.
        bias: (nv,) Coriolis, centrifugal and gravity forces [N, N.m].
        mass: Total mass [kg].
        com: (3,) centre of mass [m].
        momentum: (6,) linear momentum [kg.m/s], angular momentum about the CoM [kg.m^2/s].
        centroidal_map: (6, nv) ``momentum = centroidal_map @ v``.
        momentum_drift: (6,) ``d(centroidal_map)/dt @ v``.
        frames: State of each frame asked for, by name.
    """

    q: FloatArray
    v: FloatArray
    mass_matrix: FloatArray
    bias: FloatArray
    mass: float
    com: FloatArray
    momentum: FloatArray
    centroidal_map: FloatArray
    momentum_drift: FloatArray
    frames: dict[str, FrameState]


class Dynamics:
    """Evaluates :class:`DynamicsState` with Pinocchio; holds its work space."""

    def __init__(self, body: BodyModel, frames: dict[str, int]) -> None:
        """Evaluate frames: Pinocchio indices by the names they get in ``DynamicsState.frames``."""
        self._model, self._data = body.pinocchio, body.pinocchio.createData()
        self._frames = dict(frames)
        self._rest = np.zeros(self._model.nv)
        self._mass = float(pin.computeTotalMass(self._model))

    def evaluate(
        self, q: FloatArray, v: FloatArray, carried: Mapping[str, float] = MappingProxyType({})
    ) -> DynamicsState:
        """Compute all terms at the configuration ``q`` (nq,) and the velocity ``v`` (nv,).

        Point masses ``carried`` [kg] at the origins of frames, by their names, are in the mass matrix and the
        bias; mass, centre of mass and momentum stay the body's.
        """
        model, data = self._model, self._data
        inertia = pin.crba(model, data, q).copy()
        bias = pin.nonLinearEffects(model, data, q, v).copy()
        # ccrba also leaves the joint Jacobians in the data, the next call velocities and drift accelerations.
        pin.ccrba(model, data, q, v)
        centroidal_map, momentum = data.Ag.copy(), data.hg.vector.copy()
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, self._rest)
        drift, com = data.dhg.vector.copy(), data.com[0].copy()
        frames = {name: self._frame(index) for name, index in self._frames.items()}
        for name, mass in carried.items():
            jacobian = frames[name].jacobian[:3]
            inertia += mass * jacobian.T @ jacobian
            bias += mass * jacobian.T @ (frames[name].drift[:3] - GRAVITY_VECTOR)
        return DynamicsState(q, v, inertia, bias, self._mass, com, momentum, centroidal_map, drift, frames)

    def _frame(self, index: int) -> FrameState:
        model, data = self._model, self._data
        placement = pin.updateFramePlacement(model, data, index)
        return FrameState(
            placement.rotation.copy(), placement.translation.copy(),
            twist=pin.getFrameVelocity(model, data, index, _WORLD_ALIGNED).vector,
            jacobian=pin.getFrameJacobian(model, data, index, _WORLD_ALIGNED),
            drift=pin.getFrameClassicalAcceleration(model, data, index, _WORLD_ALIGNED).vector,
        )  # fmt: skip
