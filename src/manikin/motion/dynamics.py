"""What a motion needs from outside: the wrench that all contacts together must supply.

Two ways lead there. The rate of the centroidal momentum gives the wrench with the centre of mass and the
angular momentum (:func:`centroidal_motion`); the recursive Newton-Euler equations give it with the torques of
a body without contacts (:class:`FreeDynamics`). Both agree to rounding.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.spatial import GRAVITY_VECTOR, FloatArray, rotation_from_quaternion


@dataclass(frozen=True, eq=False)
class CentroidalMotion:
    """Centre of mass, momentum and needed wrench of n samples; world axes.

    Attributes:
        com: (n, 3) centre of mass [m].
        angular_momentum: (n, 3) about the centre of mass [kg.m^2/s].
        angular_momentum_rate: (n, 3) its derivative [N.m].
        wrench: (n, 6) ``[m (c'' - g); c x m (c'' - g) + L']`` about the world origin, force [N] and moment
            [N.m] ([Qiu2012]_ 4.51).
    """

    com: FloatArray
    angular_momentum: FloatArray
    angular_momentum_rate: FloatArray
    wrench: FloatArray


def centroidal_motion(body: BodyModel, q: FloatArray, v: FloatArray, a: FloatArray) -> CentroidalMotion:
    """Wrench that the scene must apply to a body in motion, by the rate of its centroidal momentum.

    Args:
        body: Who moves.
        q: (n, nq) configurations.
        v: (n, nv) velocities.
        a: (n, nv) accelerations.
    """
    model, data = body.pinocchio, body.pinocchio.createData()
    com, momentum, rate = np.zeros((len(q), 3)), np.zeros((len(q), 3)), np.zeros((len(q), 6))
    for k in range(len(q)):
        pin.computeCentroidalMomentumTimeVariation(model, data, q[k], v[k], a[k])
        com[k], momentum[k], rate[k] = data.com[0], data.hg.angular, data.dhg.vector
    force = body.mass * (rate[:, :3] / body.mass - GRAVITY_VECTOR)
    wrench = np.hstack([force, np.cross(com, force) + rate[:, 3:]])
    return CentroidalMotion(com, momentum, rate[:, 3:], wrench)


@dataclass(frozen=True, eq=False)
class FreeDynamics:
    """Inverse dynamics of n samples of a motion without contacts.

    Attributes:
        needed: (n, nv) generalised forces [N, N.m]; the first six in the pelvis' frame.
        wrench: (n, 6) those six as force [N] and moment about the world origin [N.m].
        jacobians: (n, 6, nv) of all joints: velocity of the point at the world origin, and angular one.
    """

    needed: FloatArray
    wrench: FloatArray
    jacobians: FloatArray

    @classmethod
    def of(cls, body: BodyModel, q: FloatArray, v: FloatArray, a: FloatArray) -> "FreeDynamics":
        """By the recursive Newton-Euler equations.

        Args:
            body: Who moves.
            q: (n, nq) configurations.
            v: (n, nv) velocities.
            a: (n, nv) accelerations.
        """
        model, data = body.pinocchio, body.pinocchio.createData()
        needed, jacobians = np.empty((len(q), model.nv)), np.empty((len(q), 6, model.nv))
        for k in range(len(q)):
            needed[k] = pin.rnea(model, data, q[k], v[k], a[k])
            jacobians[k] = pin.computeJointJacobians(model, data, q[k])
        rotation = rotation_from_quaternion(q[:, 3:7])
        force = np.einsum("nij,nj->ni", rotation, needed[:, :3])
        moment = np.einsum("nij,nj->ni", rotation, needed[:, 3:6]) + np.cross(q[:, :3], force)
        return cls(needed, np.hstack([force, moment]), jacobians)

    def part(self, rows: NDArray[np.int64]) -> "FreeDynamics":
        """Some of the samples."""
        return FreeDynamics(self.needed[rows], self.wrench[rows], self.jacobians[rows])
