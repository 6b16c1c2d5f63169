"""Joint torques by force plates, beside those of a recorded motion alone.

With the plates' forces on the feet the torques of a leg follow from its own motion. Without plates the motion
of the whole body tells the sum of the forces, and how feet that both carry share it has to be assumed
(:mod:`manikin.mocap.force_sharing`).
"""

from dataclasses import dataclass

import numpy as np

from manikin.mocap.plate_forces import PlateForces
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_forces import torques_of
from manikin.motion import Motion
from manikin.spatial import FloatArray

JOINTS = ("hip_flexion", "hip_abduction", "knee_flexion", "ankle_dorsiflexion")
"""Hinges of a leg that are compared."""

SIDES = ("left", "right")


@dataclass(frozen=True)
class TorqueComparison:
    """Torques of one hinge, of both sides, while the foot below it is on a plate.

    Attributes:
        joint: The hinge, without its side.
        frames: Compared, of both sides.
        rms: Root mean square of the difference [N.m].
        mean: Of the difference, ours minus the plates' [N.m].
        peak: Largest magnitude of ours [N.m].
        peak_by_plates: Of theirs [N.m].
    """

    joint: str
    frames: int
    rms: float
    mean: float
    peak: float
    peak_by_plates: float


def plate_torques(dynamics: RecordedDynamics, measured: PlateForces) -> FloatArray:
    """(n, nv) generalised forces of a motion if the plates are all that pushes; told where ``apart``.

    The first six are what the plates' forces lack of the motion's, in the pelvis' frame [N, N.m].

    Args:
        dynamics: The motion.
        measured: The plates at its instants.
    """
    return torques_of(dynamics, measured.effectors, measured.of_effector)


def compare_torques(
    dynamics: RecordedDynamics, motion: Motion, measured: PlateForces
) -> tuple[TorqueComparison, ...]:
    """Compare the torques of legs with those by plates; none where no foot is on a plate of its own.

    Args:
        dynamics: The motion.
        motion: The same with forces and torques, of :func:`manikin.mocap.recorded_forces.motion_on_contacts`.
        measured: The plates at its instants.
    """
    theirs, names = plate_torques(dynamics, measured), motion.joint_names
    feet = [f"{side}_foot" for side in SIDES]
    held = {
        foot: measured.apart & motion.support[:, motion.contact_names.index(foot)]
        for foot in feet
        if foot in motion.contact_names
    }
    found = []
    for joint in JOINTS:
        ours, others = [np.zeros(0)], [np.zeros(0)]
        for side, foot in zip(SIDES, feet, strict=True):
            if foot in held:
                column = 6 + names.index(f"{side}_{joint}")
                ours.append(motion.tau[held[foot], column])
                others.append(theirs[held[foot], column])
        mine, plates = np.concatenate(ours), np.concatenate(others)
        if len(mine):
            apart = mine - plates
            found.append(
                TorqueComparison(
                    joint, len(mine), float(np.sqrt(np.mean(apart**2))), float(apart.mean()),
                    float(np.abs(mine).max()), float(np.abs(plates).max()),
                )
            )  # fmt: skip
    return tuple(found)
