"""Dynamics of sampled motions: the wrench that all contacts together must supply, and momentum rates.

:func:`centroidal_motion` gives the wrench with the centre of mass and the angular momentum, and
:class:`FreeDynamics` with the torques of a body without contacts. Both agree to rounding.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.strength import with_masses
from manikin.contact import CarriedLoad, ContactSchedule
from manikin.motion.configuration_spline import StateSamples, by_raw_spline, states_from_raw, tangent_map
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import GRAVITY_VECTOR, FloatArray, cross, rotation_from_quaternion, skew
from manikin.scene.distance import moves_by_joint
from manikin.scene.distance_bounds import PlacedShapes, PlacementReader


@dataclass(frozen=True, eq=False)
class MomentumRate:
    """Rate of linear and angular momentum about the centre of mass, (n, 6) [N, N.m], world axes.

    Its three Jacobians (n, 6, nq) are by the raw coordinates, their rates and their second derivatives.
    """

    value: FloatArray
    jacobians: tuple[FloatArray, FloatArray, FloatArray]


class MomentumRateSamples:
    """Collects Pinocchio's derivatives sample by sample, those by acceleration in ``by_a`` (n, 6, nv)."""

    def __init__(self, model: pin.Model, count: int) -> None:
        self._model, self._value = model, np.zeros((count, 6))
        self._by_q, self._by_v, self.by_a = np.zeros((3, count, 6, model.nv))

    def record(self, sample: int, data: pin.Data, states: StateSamples) -> None:
        """Evaluate one sample; ``data`` then holds its kinematics and joint Jacobians."""
        _, by_q, by_v, by_a = pin.computeCentroidalDynamicsDerivatives(
            self._model, data, states.q[sample], states.v[sample], states.a[sample]
        )
        self._value[sample] = data.dhg.vector
        self._by_q[sample], self._by_v[sample], self.by_a[sample] = by_q, by_v, by_a

    def by_raw(
        self, states: StateSamples, raw: tuple[FloatArray, FloatArray, FloatArray], tangent: FloatArray
    ) -> MomentumRate:
        """Differentiate by raw values, rates and second derivatives (n, nq), with :func:`tangent_map`."""
        by_state = self._by_q, self._by_v, self.by_a
        return MomentumRate(self._value, by_raw_spline(by_state, states, raw, tangent))


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """A spline's states with their kinematics.

    Attributes:
        raw: Raw spline values, rates and second derivatives (n, nq) each.
        states: Configurations, velocities and accelerations.
        tangent: (n, 7, 7) :func:`~manikin.motion.configuration_spline.tangent_map`.
        com: (n, 3) centre of mass [m].
        com_jacobian: (n, 3, nv).
        momentum: Rate of the centroidal momentum, with what is carried.
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
    """Evaluates splines of one basis with the frames of some effectors, and what is carried at samples."""

    def __init__(
        self, body: BodyModel, frames: tuple[str, ...], basis: SampledBasis,
        loads: Sequence[CarriedLoad | None] | None = None,
    ) -> None:  # fmt: skip
        self._model: pin.Model = body.pinocchio
        self._data = self._model.createData()
        self._geometry, self._geometry_data = body.geometry, pin.GeometryData(body.geometry)
        self._basis, self._mass = basis, body.mass
        indices = [body.effector_frame(name) for name in frames]
        self._shape_reader = PlacementReader(self._geometry_data.oMg)
        self._frame_reader = PlacementReader(self._data.oMf, indices)
        moves = moves_by_joint(self._model)
        self._moving = [np.flatnonzero(moves[self._model.frames[index].parentJoint]) for index in indices]
        carried: dict[int, tuple[CarriedLoad, list[int]]] = {}
        for sample, load in enumerate(loads or ()):
            if load is not None:
                carried.setdefault(id(load), (load, []))[1].append(sample)
        self._loaded = [(with_masses(body, load.masses).pinocchio, rows) for load, rows in carried.values()]

    def sample(self, points: FloatArray) -> MotionSamples:
        """Evaluate the spline with control points (k, nq)."""
        basis = self._basis
        raw = basis.evaluate(points), basis.evaluate(points, 1), basis.evaluate(points, 2)
        states, tangent = states_from_raw(*raw), tangent_map(raw[0])
        n, model, data = len(states.q), self._model, self._data
        momentum, com, jacobians = MomentumRateSamples(model, n), np.empty((n, 3)), np.empty((n, 6, model.nv))
        frames, shapes = (np.empty((n, k, 4, 4)) for k in (len(self._moving), self._geometry.ngeoms))
        for s in range(n):
            momentum.record(s, data, states)
            pin.updateFramePlacements(model, data)
            pin.updateGeometryPlacements(model, data, self._geometry, self._geometry_data)
            com[s], jacobians[s] = data.com[0], data.J
            self._frame_reader.read(frames[s])
            self._shape_reader.read(shapes[s])
        rate = momentum.by_raw(states, raw, tangent)
        for loaded, rows in self._loaded:
            # The rate of body and load, about their common centre, where the load is carried.
            part, data = StateSamples(*(item[rows] for item in states)), loaded.createData()
            both = MomentumRateSamples(loaded, len(rows))
            for k in range(len(rows)):
                both.record(k, data, part)
            own = both.by_raw(part, (raw[0][rows], raw[1][rows], raw[2][rows]), tangent[rows])
            rate.value[rows] = own.value
            for block, carried in zip(rate.jacobians, own.jacobians, strict=True):
                block[rows] = carried
        com_jacobian, placed = momentum.by_a[:, :3] / self._mass, PlacedShapes(shapes, jacobians)
        return MotionSamples(raw, states, tangent, com, com_jacobian, rate, frames, placed)

    def frame_jacobian(self, motion: MotionSamples, number: int) -> FloatArray:
        """(n, 6, nv) linear, then angular velocity of frame ``number`` in world axes, per ``v``."""
        columns, out = self._moving[number], np.zeros_like(motion.shapes.jacobians)
        joints = motion.shapes.jacobians[:, :, columns]
        out[:, :3, columns] = joints[:, :3] - skew(motion.frames[:, number, :3, 3]) @ joints[:, 3:]
        out[:, 3:, columns] = joints[:, 3:]
        return out


@dataclass(frozen=True, eq=False)
class CentroidalMotion:
    """Centre of mass, momentum and needed wrench of n samples; world axes.

    Attributes:
        com: (n, 3) centre of mass [m].
        angular_momentum: (n, 3) about the centre of mass [kg.m^2/s].
        angular_momentum_rate: (n, 3) its derivative [N.m].
        wrench: (n, 6) ``[m (c'' - g); c x m (c'' - g) + L']`` about the origin [N, N.m] ([Qiu2012]_ 4.51).
    """

    com: FloatArray
    angular_momentum: FloatArray
    angular_momentum_rate: FloatArray
    wrench: FloatArray


def centroidal_motion(body: BodyModel, q: FloatArray, v: FloatArray, a: FloatArray) -> CentroidalMotion:
    """Wrench that the scene must apply to a body in motion, by the rate of its centroidal momentum.

    Configurations are (n, nq), velocities and accelerations (n, nv).
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
        """By the recursive Newton-Euler equations; arguments as of :func:`centroidal_motion`."""
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

    def carrying(self, load: "CarriedForces") -> "FreeDynamics":
        """With what effectors carry besides."""
        return FreeDynamics(self.needed + load.needed, self.wrench + load.wrench, self.jacobians)


@dataclass(frozen=True, eq=False)
class CarriedForces:
    """What the loads of a schedule's phases need besides the body's own motion, at n samples.

    Attributes:
        needed: (n, nv) generalised forces [N, N.m]; the first six in the pelvis' frame.
        wrench: (n, 6) their weight and inertia, force [N] and moment about the world origin [N.m].
    """

    needed: FloatArray
    wrench: FloatArray

    @classmethod
    def of(
        cls, body: BodyModel, schedule: ContactSchedule, time: FloatArray, q: FloatArray, v: FloatArray,
        a: FloatArray,
    ) -> "CarriedForces | None":  # fmt: skip
        """Of what a body carries in the phases of a schedule at times (n,) [s]; None where it is nothing.

        The other arguments are as of :func:`centroidal_motion`, the body without the loads.
        """
        if all(phase.load is None for phase in schedule.sequence):
            return None
        model, data = body.pinocchio, body.pinocchio.createData()
        needed, wrench = np.zeros((len(time), body.nv)), np.zeros((len(time), 6))
        for k, number in enumerate(schedule.phase_at(time)):
            load = schedule.sequence[int(number)].load
            if load is None:
                continue
            pin.forwardKinematics(model, data, q[k], v[k], a[k])
            pin.computeJointJacobians(model, data, q[k])
            for effector, mass in load.masses.items():
                frame, axes = body.effector_frame(effector), pin.LOCAL_WORLD_ALIGNED
                position = pin.updateFramePlacement(model, data, frame).translation
                rate = pin.getFrameClassicalAcceleration(model, data, frame, axes).linear
                force = mass * (rate - GRAVITY_VECTOR)
                needed[k] += pin.getFrameJacobian(model, data, frame, axes)[:3].T @ force
                wrench[k] += np.concatenate([force, cross(position, force)])
        return cls(needed, wrench)
