"""The planned motion as the controller reads it: placements, velocities, accelerations."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray

_WORLD_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, eq=False)
class EffectorReference:
    """Planned placement of a frame and its derivatives, in world axes.

    Attributes:
        rotation: (3, 3) frame to world.
        position: (3,) [m].
        twist: (6,) linear, angular [m/s, rad/s].
        acceleration: (6,) mean over the hold, linear (of the frame's origin), angular [m/s^2, rad/s^2].
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
        a: (nv,) mean acceleration over the hold.
        com: (3,) [m].
        com_velocity: (3,) [m/s].
        com_acceleration: (3,) mean over the hold [m/s^2].
        angular_momentum: (3,) about the CoM [kg.m^2/s].
        angular_momentum_rate: (3,) mean over the hold [N.m].
        effectors: Reference of each frame by name.
        later: Angles and speeds (nv - 6,) of the joints at the end of the horizon [rad, rad/s].
        wrenches: Force [N] and moment [N.m] (6,) of each contact about its own origin, in the middle of the
            hold, by effector; empty where none is known to carry.
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
    later: tuple[FloatArray, FloatArray] | None = None
    wrenches: Mapping[str, FloatArray] = field(default_factory=dict)

    def slowed(self, rate: float) -> "ReferenceSample":
        """The same state, passed at ``rate`` times the speed."""
        effectors = {name: replace(frame, twist=rate * frame.twist) for name, frame in self.effectors.items()}
        return replace(
            self, v=rate * self.v, com_velocity=rate * self.com_velocity,
            angular_momentum=rate * self.angular_momentum, effectors=effectors,
        )  # fmt: skip

    def until(
        self, end: "ReferenceSample", period: float, later: tuple[FloatArray, FloatArray],
        wrenches: Mapping[str, FloatArray],
    ) -> "ReferenceSample":  # fmt: skip
        """The same state with the mean accelerations over the time [s] until another one."""
        pairs = zip(self.effectors.items(), end.effectors.values(), strict=True)
        return ReferenceSample(
            self.q, self.v, (end.v - self.v) / period,
            self.com, self.com_velocity, (end.com_velocity - self.com_velocity) / period,
            self.angular_momentum, (end.angular_momentum - self.angular_momentum) / period,
            {name: EffectorReference(now.rotation, now.position, now.twist, (then.twist - now.twist) / period)
             for (name, now), then in pairs},
            later, wrenches,
        )  # fmt: skip


class Reference:
    """Samples a motion anywhere in time; before and after it the body is at rest.

    Accelerations are means over the hold, the difference of the planned velocities at its ends: a torque that
    is held cannot follow anything finer, and with the acceleration at its start the body would lag behind.
    """

    def __init__(
        self, body: BodyModel, motion: Motion, frames: dict[str, int], period: float, horizon: float
    ) -> None:
        """Bind a motion to the body that it was planned for.

        Args:
            frames: Pinocchio frame indices by the name they get in ``ReferenceSample.effectors``.
            period: Time for which torques are held [s].
            horizon: Time over which joints must stay admissible [s].

        Raises:
            InputError: If the motion's joints are not the body's.
        """
        own, joints = body.joint_names, motion.joint_names
        if tuple(joints) != tuple(own):
            told = f"motion has {len(joints)} joints and body {body.name!r} {len(own)}"
            raise InputError(f"{told}, or they differ in name; valid: a motion planned for this body")
        self.motion = motion
        self._model, self._data = body.pinocchio, body.pinocchio.createData()
        self._frames, self._period, self._horizon = dict(frames), period, horizon
        self._rest = np.zeros(self._model.nv)
        self._next: tuple[float, ReferenceSample] | None = None

    def sample(self, time: float, rate: float = 1.0, next_rate: float = 1.0) -> ReferenceSample:
        """Return the planned state at a time of the plan [s], interpolated between the samples.

        The plan's time goes at ``rate`` relative to real time now, at ``next_rate`` at the end of the hold.
        """
        end = time + next_rate * self._period
        now, then = self._rates(time), self._rates(end)
        if self._next is None or then is not self._next[1]:
            self._next = end, then
        if rate != 1.0 or next_rate != 1.0:
            now, then = now.slowed(rate), then.slowed(next_rate)
        q, v, _ = self._state(time + next_rate * self._horizon)
        wrenches = self._wrenches(time + 0.5 * next_rate * self._period)
        return now.until(then, self._period, (q[7:], next_rate * v[6:]), wrenches)

    def _wrenches(self, time: float) -> Mapping[str, FloatArray]:
        """Planned wrench of each contact at the next sample, if any of them carries."""
        motion = self.motion
        planned = motion.contact_force[min(int(motion.time.searchsorted(time)), len(motion.time) - 1)]
        return dict(zip(motion.contact_names, planned, strict=True)) if planned.any() else {}

    def _rates(self, time: float) -> ReferenceSample:
        """Planned state at a time [s], with no accelerations."""
        if self._next is not None and abs(self._next[0] - time) < 1e-9:
            return self._next[1]
        q, v, com = self._state(time)
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, q, v)
        pin.computeCentroidalMomentum(model, data)
        frames = {name: self._frame(index) for name, index in self._frames.items()}
        velocity, momentum, none = data.hg.linear / data.mass[0], data.hg.angular.copy(), np.zeros(3)
        return ReferenceSample(q, v, self._rest, com, velocity, none, momentum, none, frames)

    def _state(self, time: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        motion = self.motion
        if not motion.time[0] - 1e-9 <= time <= motion.time[-1] + 1e-9:
            end = 0 if time < motion.time[0] else -1
            return motion.q[end], self._rest, motion.com[end]
        after = min(int(motion.time.searchsorted(time - 1e-9)), len(motion.time) - 1)
        if after == 0 or abs(motion.time[after] - time) < 1e-9:
            return motion.q[after], motion.v[after], motion.com[after]
        before = after - 1
        share = (time - motion.time[before]) / (motion.time[after] - motion.time[before])
        q = pin.interpolate(self._model, motion.q[before], motion.q[after], share)
        v, com = ((1 - share) * values[before] + share * values[after] for values in (motion.v, motion.com))
        return q, v, com

    def _frame(self, index: int) -> EffectorReference:
        model, data = self._model, self._data
        placement = pin.updateFramePlacement(model, data, index)
        twist = pin.getFrameVelocity(model, data, index, _WORLD_ALIGNED).vector
        return EffectorReference(placement.rotation.copy(), placement.translation.copy(), twist, np.zeros(6))
