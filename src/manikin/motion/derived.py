"""Quantities that follow from a motion: phases, velocities, placements, centre of pressure."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion.massless import foot_positions
from manikin.motion.motion import Motion
from manikin.spatial import FloatArray, frozen_array

SMALLEST_LOAD = 20.0
"""Vertical force [N] below which there is no centre of pressure."""


@dataclass(frozen=True, eq=False)
class PhaseTable:
    """When each contact is active.

    Attributes:
        instants: (phases + 1,) key instants [s].
        supports: Effectors in contact in each phase.
    """

    instants: FloatArray
    supports: tuple[tuple[str, ...], ...]

    def __len__(self) -> int:
        return len(self.supports)

    def phase_at(self, time: FloatArray) -> np.ndarray:
        """Index of the phase at each time."""
        return np.clip(np.searchsorted(self.instants, time, side="right") - 1, 0, len(self) - 1)


def phases_of(motion: Motion, schedule: ContactSchedule | None = None) -> PhaseTable:
    """Phases of the schedule, or, without one, of the motion's own support table."""
    if schedule is not None:
        return PhaseTable(
            schedule.instants, tuple(tuple(phase.stance.effectors) for phase in schedule.sequence)
        )
    changes = np.flatnonzero(np.any(motion.support[1:] != motion.support[:-1], axis=1)) + 1
    starts = np.concatenate([[0], changes])
    supports = tuple(
        tuple(name for name, on in zip(motion.contact_names, motion.support[index], strict=True) if on)
        for index in starts
    )
    instants = np.append(motion.time[starts], motion.time[-1])
    return PhaseTable(frozen_array(instants, "instants"), supports)


def com_velocity(motion: Motion) -> FloatArray:
    """(n, 3) velocity of the centre of mass by central differences [m/s]."""
    if len(motion.time) < 2:
        return np.zeros((len(motion.time), 3))
    return np.gradient(motion.com, motion.time, axis=0)


def effector_positions(
    body: BodyModel, motion: Motion, names: tuple[str, ...], schedule: ContactSchedule | None = None
) -> dict[str, FloatArray]:
    """(n, 3) position of each named effector [m]; the feet of a point mass follow the schedule."""
    if body.is_point_mass:
        if schedule is None:
            return dict.fromkeys(names, motion.com)
        return {name: foot_positions(schedule, motion.time)[name] for name in names}
    data = body.pinocchio.createData()
    frames = {name: body.effector_frame(name) for name in names}
    found = {name: np.empty((len(motion.time), 3)) for name in names}
    for index, q in enumerate(motion.q):
        pin.forwardKinematics(body.pinocchio, data, q)
        for name, frame in frames.items():
            found[name][index] = pin.updateFramePlacement(body.pinocchio, data, frame).translation
    return found


def segment_positions(body: BodyModel, q: FloatArray) -> dict[str, FloatArray]:
    """(3,) origin of each segment and effector in one configuration [m].

    Effectors are under ``effector/NAME``.
    """
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    found = {s.name: data.oMf[body.segment_frame(s.name)].translation.copy() for s in body.segments}
    for name in body.effectors:
        found[f"effector/{name}"] = data.oMf[body.effector_frame(name)].translation.copy()
    return found


def centre_of_pressure(body: BodyModel, motion: Motion) -> FloatArray:
    """(n, 3) centre of pressure of all contacts [m]; NaN where nothing carries load.

    The mean of the contacts' own centres of pressure, weighted with their vertical forces.
    On level ground it is the zero moment point; with feet at several heights it stays
    between them.
    """
    places = effector_positions(body, motion, motion.contact_names)
    moment = np.zeros((len(motion.time), 3))
    load = np.zeros(len(motion.time))
    for number, name in enumerate(motion.contact_names):
        force, torque = motion.contact_force[:, number, :3], motion.contact_force[:, number, 3:]
        vertical = force[:, 2]
        load += vertical
        moment += vertical[:, None] * places[name]
        moment[:, 0] -= torque[:, 1]
        moment[:, 1] += torque[:, 0]
    safe = np.where(load > SMALLEST_LOAD, load, np.nan)
    return moment / safe[:, None]
