"""Every control step of a pushed body that keeps its balance, as a motion with its measures."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import end_segments
from manikin.contact import ContactModel, Stance
from manikin.control.recovery import BalanceRecovery, RecoveryOutput, Standing, zmp_of
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, skew
from manikin.simulation.carrying import CarriedPoints, CarryingContacts, Sensed, carried_margin
from manikin.simulation.recorder import executed_motion


@dataclass(frozen=True, eq=False)
class RecoveryTrace:
    """Samples of a recovery, one per control step.

    Attributes:
        motion: Executed motion; ``contact_force`` is what the ground did to each foot, measured on free feet
            and, on held ones, the measured whole in equal shares, and ``margin`` that of the measured wrench
            of the ground about the centre of mass, in the polytope of the contacts that carry.
        zmp: (n, 2) of the measured force of the ground over the step, NaN where nothing carries [m].
        zmp_inside: (n,) distance of the ZMP to the edge of the soles that carry, negative outside [m].
        standings: n ways to stand about which the balance was kept.
        strategies: (n,) strategy that decided the torques.
        gain_share: (n,) share of the largest posture gains.
        com_velocity: (n, 3) [m/s].
        momenta: Measures the angular momentum of groups of segments.
        power: (n,) power of the joints of each group, by name [W].
        fallbacks: Time [s] and reason of every step whose program was not solved.
        control_ms: Mean time of a control step [ms].
    """

    motion: Motion
    zmp: FloatArray
    zmp_inside: FloatArray
    standings: tuple[Standing, ...]
    strategies: NDArray[np.str_]
    gain_share: FloatArray
    com_velocity: FloatArray
    momenta: "SegmentMomenta"
    power: dict[str, FloatArray]
    fallbacks: tuple[tuple[float, str], ...]
    control_ms: float

    @cached_property
    def momentum(self) -> dict[str, FloatArray]:
        """(n, 3) angular momentum about the centre of mass of each group, by name [kg.m^2/s].

        Measured when it is asked for first; a search for the strongest push has no need of it.
        """
        motion = self.motion
        rows = [self.momenta.at(*state) for state in zip(motion.q, motion.v, motion.com, strict=True)]
        return {group: np.array([row[group] for row in rows]) for group in rows[0]}

    def work(self, group: str) -> tuple[float, float]:
        """Work given and taken by the joints of a group [J], both positive."""
        power, time = self.power[group], self.motion.time
        given, taken = (np.trapezoid(np.maximum(part, 0.0), time) for part in (power, -power))
        return float(given), float(taken)


class RecoveryRecorder:
    """Keeps every control step of a recovery."""

    def __init__(self, body: BodyModel, controller: BalanceRecovery) -> None:
        """Start empty."""
        self._body, self._controller = body, controller
        self._momenta = SegmentMomenta(body, controller.groups.segments)
        self._ends = {foot: end_segments(body, foot) for foot in controller.groups.feet}
        self._rows: list[tuple[float, RecoveryOutput, FloatArray, FloatArray]] = []
        self._forces: list[FloatArray] = []
        self._stances: list[Stance] = []
        self._carrying = CarryingContacts(self._ends, body.mass)
        self._model = ContactModel.of_body(body.mass, controller.settings.friction_model)

    def add(
        self, time: float, output: RecoveryOutput, sensed: Sensed, wrench: FloatArray, carried: CarriedPoints,
        *, held: bool = False,
    ) -> None:  # fmt: skip
        """Add a step that begins at a time [s], with what is sensed in the first engine step after it.

        Args:
            wrench: (6,) mean force and moment of the ground about the world's origin.
            carried: Contact points of the scene that carried that wrench.
            held: Whether the feet are welded to the ground, which is no touch.
        """
        standing = output.standing
        stance = Stance(standing.soles, model=self._model) if held else self._carrying_stance(output, carried)
        self._stances.append(stance)
        self._rows.append((time, output, sensed.a, wrench))
        forces = {foot: np.zeros(6) for foot in self._ends}
        share = wrench / len(self._controller.standing.soles)
        for foot, names in self._ends.items():
            position = output.state.frames[foot].position
            if not held:
                forces[foot] = sensed.wrench(position, names)
            elif foot in standing.feet:
                forces[foot] = np.concatenate((share[:3], share[3:] - skew(position) @ share[:3]))
        self._forces.append(np.array(list(forces.values())))

    def trace(self, control_ms: float) -> RecoveryTrace:
        """Turn the steps into a trace."""
        outputs = [output for _, output, _, _ in self._rows]
        states = [output.state for output in outputs]
        torque, speed = np.array([o.tau for o in outputs]), np.array([state.v[6:] for state in states])
        joints, height = self._controller.groups.joints, self._controller.standing.area.height
        wrenches = np.array([wrench for *_, wrench in self._rows])
        # About the origin instead of the centre of mass: the formula holds for any point.
        zmp = np.array([zmp_of(wrench[:3], wrench[3:], np.zeros(3), height) for wrench in wrenches])
        # Held feet are judged by the soles on which the body stands.
        com = np.array([state.com for state in states])
        inside = [float(o.standing.area.inside(point)) for o, point in zip(outputs, zmp, strict=True)]
        motion = executed_motion(
            np.array([time for time, *_ in self._rows]), states, a=np.array([a for _, _, a, _ in self._rows]),
            tau=torque, margin=carried_margin(self._stances, wrenches, com).margin,
            contact_force=np.array(self._forces), contact_names=self._controller.groups.feet,
            joint_names=self._body.joint_names,
        )  # fmt: skip
        return RecoveryTrace(
            motion, zmp, np.array(inside),
            standings=tuple(output.standing for output in outputs),
            strategies=np.array([str(output.strategy) for output in outputs]),
            gain_share=np.array([output.gain_share for output in outputs]),
            com_velocity=np.array([state.momentum[:3] / state.mass for state in states]),
            momenta=self._momenta,
            power={name: np.sum(torque[:, row] * speed[:, row], axis=1) for name, row in joints.items()},
            fallbacks=tuple((time, output.fallback) for time, output, *_ in self._rows if output.fallback),
            control_ms=control_ms,
        )  # fmt: skip

    def _carrying_stance(self, output: RecoveryOutput, carried: CarriedPoints) -> Stance:
        """Stance of the contacts that really carry: soles as far as they touch, and anything else."""
        frames = output.state.frames
        soles = {sole.effector: sole for sole in (*self._controller.standing.soles, *output.standing.soles)}
        return self._carrying.stance(
            carried, lambda name: (frames[name].position, frames[name].rotation), soles, model=self._model
        )


class SegmentMomenta:
    """Angular momentum of groups of segments about the centre of mass of the whole body."""

    def __init__(self, body: BodyModel, groups: dict[str, tuple[str, ...]]) -> None:
        """Choose the groups, by names of segments."""
        self._model, self._data = body.pinocchio, body.pinocchio.createData()
        self._groups = {
            group: [(body.segment_frame(name), body.segment(name)) for name in names]
            for group, names in groups.items()
        }

    def at(self, q: FloatArray, v: FloatArray, com: FloatArray) -> dict[str, FloatArray]:
        """(3,) by group, in world axes [kg.m^2/s], at a state with its CoM [m]; the sum is the body's."""
        pin.forwardKinematics(self._model, self._data, q, v)
        # The velocity of the centre of mass is taken off, so that no group's share depends on it.
        momentum = pin.computeCentroidalMomentum(self._model, self._data).linear
        velocity = np.array(momentum) / float(pin.computeTotalMass(self._model))
        momenta: dict[str, FloatArray] = {}
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
            momenta[group] = total
        return momenta
