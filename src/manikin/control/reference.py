"""The planned motion as the controller reads it: placements, velocities, accelerations."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.spatial import FloatArray

_WORLD_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, eq=False)
class EffectorReference:
    """Planned placement of a frame and its derivatives, in world axes.

    Attributes:
        rotation: (3, 3) frame to world.
        position: (3,) [m].
        twist: (6,) linear, angular [m/s, rad/s].
        acceleration: (6,) linear (of the frame's origin), angular [m/s^2, rad/s^2].
    """

    rotation: FloatArray
    position: FloatArray
    twist: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class ReferenceSample:
    """Planned state at one time.

    Attributes:
        q: (nq,) configuration.
        v: (nv,) velocity.
        a: (nv,) acceleration.
        com: (3,) [m].
        com_velocity: (3,) [m/s].
        com_acceleration: (3,) [m/s^2].
        angular_momentum: (3,) about the CoM [kg.m^2/s].
        angular_momentum_rate: (3,) [N.m].
        effectors: Reference of each frame by name.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    com: FloatArray
    com_velocity: FloatArray
    com_acceleration: FloatArray
    angular_momentum: FloatArray
    angular_momentum_rate: FloatArray
    effectors: dict[str, EffectorReference]


class Reference:
    """Samples a motion anywhere in time; before and after it the body is at rest."""

    def __init__(self, body: BodyModel, motion: Motion, frames: dict[str, int]) -> None:
        """Bind a motion to a body.

        Args:
            body: The body that the motion was planned for.
            motion: Planned motion.
            frames: Pinocchio frame indices by the name they get in ``ReferenceSample.effectors``.

        Raises:
            InputError: If the motion's joints are not the body's.
        """
        if tuple(motion.joint_names) != tuple(body.joint_names):
            raise InputError(
                f"motion has {len(motion.joint_names)} joints and body {body.name!r} "
                f"{len(body.joint_names)}, or they differ in name; valid: a motion planned for this body"
            )
        self.motion = motion
        self._model = body.pinocchio
        self._data = self._model.createData()
        self._frames = dict(frames)
        self._rest = np.zeros(self._model.nv)

    def sample(self, time: float) -> ReferenceSample:
        """Return the planned state at ``time`` [s], interpolated between the samples."""
        q, v, a, com_target = self._state(time)
        model, data = self._model, self._data
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        mass = data.mass[0]
        return ReferenceSample(
            q=q,
            v=v,
            a=a,
            com=com_target,
            com_velocity=data.hg.linear / mass,
            com_acceleration=data.dhg.linear / mass,
            angular_momentum=data.hg.angular.copy(),
            angular_momentum_rate=data.dhg.angular.copy(),
            effectors={name: self._frame(index) for name, index in self._frames.items()},
        )

    def _state(self, time: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        motion = self.motion
        if not motion.time[0] <= time <= motion.time[-1]:
            end = 0 if time < motion.time[0] else -1
            return motion.q[end], self._rest, self._rest, motion.com[end]
        after = int(np.searchsorted(motion.time, time - 1e-9))
        if after == 0 or abs(motion.time[after] - time) < 1e-9:
            return motion.q[after], motion.v[after], motion.a[after], motion.com[after]
        before = after - 1
        share = (time - motion.time[before]) / (motion.time[after] - motion.time[before])
        q = pin.interpolate(self._model, motion.q[before], motion.q[after], share)
        v, a, com = (
            (1 - share) * values[before] + share * values[after]
            for values in (motion.v, motion.a, motion.com)
        )
        return q, v, a, com

    def _frame(self, index: int) -> EffectorReference:
        model, data = self._model, self._data
        placement = pin.updateFramePlacement(model, data, index)
        return EffectorReference(
            rotation=placement.rotation.copy(),
            position=placement.translation.copy(),
            twist=pin.getFrameVelocity(model, data, index, _WORLD_ALIGNED).vector,
            acceleration=pin.getFrameClassicalAcceleration(model, data, index, _WORLD_ALIGNED).vector,
        )
