"""What happens while a pushed body keeps its balance, step by step, and what follows from it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.balance import wrench_polytope
from manikin.body import BodyModel
from manikin.contact import Stance
from manikin.control.balance_recovery import BalanceRecovery, RecoveryOutput, zmp_of
from manikin.motion import Motion
from manikin.spatial import GRAVITY, FloatArray, skew


@dataclass(frozen=True, eq=False)
class RecoveryTrace:
    """Samples of a recovery, one per control step.

    Attributes:
        motion: What happened; ``contact_force`` is what the controller expected of each foot and ``margin``
            that of the measured wrench of the ground in the polytope of both soles.
        zmp: (n, 2) of the measured force of the ground over the step, NaN where nothing carries [m].
        strategies: (n,) what decided the torques.
        gain_share: (n,) share of the largest posture gains.
        com_velocity: (n, 3) [m/s].
        momentum: (n, 3) angular momentum about the centre of mass of each group of segments, by name.
        power: (n,) power of the joints of each group, by name [W].
        fallbacks: Time [s] and reason of every step whose program was not solved.
        control_ms: Mean time of a control step [ms].
    """

    motion: Motion
    zmp: FloatArray
    strategies: NDArray[np.str_]
    gain_share: FloatArray
    com_velocity: FloatArray
    momentum: dict[str, FloatArray]
    power: dict[str, FloatArray]
    fallbacks: tuple[tuple[float, str], ...]
    control_ms: float

    def work(self, group: str) -> tuple[float, float]:
        """Work given and taken by the joints of a group [J], both positive."""
        power, time = self.power[group], self.motion.time
        return float(np.trapezoid(np.maximum(power, 0.0), time)), float(
            np.trapezoid(np.maximum(-power, 0.0), time)
        )


class RecoveryRecorder:
    """Keeps every control step of a recovery."""

    def __init__(self, body: BodyModel, controller: BalanceRecovery) -> None:
        """Start empty."""
        self._body, self._controller = body, controller
        self._momenta = SegmentMomenta(body, controller.groups.segments)
        self._rows: list[tuple[float, RecoveryOutput, FloatArray, FloatArray]] = []

    def add(self, time: float, output: RecoveryOutput, a: FloatArray, wrench: FloatArray) -> None:
        """Add a step.

        Args:
            time: Of its beginning [s].
            output: What the controller decided then.
            a: (nv,) measured acceleration.
            wrench: (6,) mean force and moment of the ground about the world's origin.
        """
        self._rows.append((time, output, a, wrench))

    def trace(self, control_ms: float) -> RecoveryTrace:
        """Turn the steps into a trace."""
        outputs = [output for _, output, _, _ in self._rows]
        states = [output.state for output in outputs]
        momentum = [self._momenta.at(state.q, state.v, state.com) for state in states]
        torque = np.array([output.tau for output in outputs])
        speed = np.array([state.v[6:] for state in states])
        joints = self._controller.groups.joints
        return RecoveryTrace(
            motion=self._motion(torque),
            zmp=np.array([self._zmp(wrench) for *_, wrench in self._rows]),
            strategies=np.array([str(output.strategy) for output in outputs]),
            gain_share=np.array([output.gain_share for output in outputs]),
            com_velocity=np.array([state.momentum[:3] / state.mass for state in states]),
            momentum={group: np.array([row[group] for row in momentum]) for group in momentum[0]},
            power={
                group: np.sum(torque[:, index] * speed[:, index], axis=1) for group, index in joints.items()
            },
            fallbacks=tuple((time, output.fallback) for time, output, *_ in self._rows if output.fallback),
            control_ms=control_ms,
        )

    def _zmp(self, wrench: FloatArray) -> FloatArray:
        # About the origin instead of the centre of mass: the formula holds for any point.
        return zmp_of(wrench[:3], wrench[3:], np.zeros(3), self._controller.area.height)

    def _motion(self, torque: FloatArray) -> Motion:
        outputs = [output for _, output, _, _ in self._rows]
        states = [output.state for output in outputs]
        soles = self._controller.soles
        wrenches = np.array([wrench for *_, wrench in self._rows])
        stance = Stance(soles, 3.0 * self._body.mass * GRAVITY)
        expected = np.array([output.wrenches for output in outputs])
        return Motion(
            time=np.array([time for time, *_ in self._rows]),
            q=np.array([state.q for state in states]),
            v=np.array([state.v for state in states]),
            a=np.array([a for _, _, a, _ in self._rows]),
            tau=np.concatenate((np.zeros((len(torque), 6)), torque), axis=1),
            com=np.array([state.com for state in states]),
            angular_momentum=np.array([state.momentum[3:] for state in states]),
            margin=np.asarray(wrench_polytope(stance).margin(wrenches)),
            support=np.linalg.norm(expected[..., :3], axis=-1) > 1.0,
            contact_force=expected,
            contact_names=tuple(contact.effector for contact in soles),
            joint_names=self._body.joint_names,
        )


class SegmentMomenta:
    """Angular momentum of groups of segments about the centre of mass of the whole body."""

    def __init__(self, body: BodyModel, groups: dict[str, tuple[str, ...]]) -> None:
        """Choose the groups, by names of segments."""
        self._model = body.pinocchio
        self._data = self._model.createData()
        self._groups = {
            group: [(body.segment_frame(name), body.segment(name)) for name in names]
            for group, names in groups.items()
        }

    def at(self, q: FloatArray, v: FloatArray, com: FloatArray) -> dict[str, FloatArray]:
        """(3,) by group, in world axes [kg.m^2/s]; their sum is that of the body.

        Args:
            q: (nq,) configuration.
            v: (nv,) velocity.
            com: (3,) centre of mass [m].
        """
        pin.forwardKinematics(self._model, self._data, q, v)
        velocity = self._mean_velocity()
        found: dict[str, FloatArray] = {}
        for group, members in self._groups.items():
            total = np.zeros(3)
            for frame, segment in members:
                placement = pin.updateFramePlacement(self._model, self._data, frame)
                twist = pin.getFrameVelocity(self._model, self._data, frame, pin.LOCAL)
                rotation = placement.rotation
                speed = rotation @ (twist.linear + skew(twist.angular) @ segment.com)
                arm = placement.translation + rotation @ segment.com - com
                total += rotation @ (segment.inertia @ twist.angular)
                total += segment.mass * (skew(arm) @ (speed - velocity))
            found[group] = total
        return found

    def _mean_velocity(self) -> FloatArray:
        """(3,) of the centre of mass; taken off, so that each group's share does not depend on it."""
        return np.array(pin.computeCentroidalMomentum(self._model, self._data).linear) / float(
            pin.computeTotalMass(self._model)
        )
