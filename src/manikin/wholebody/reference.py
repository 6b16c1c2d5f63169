"""The posture a person would keep where the task leaves freedom."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.centroidal import CentroidalTrajectory
from manikin.contact import ContactSchedule
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import align_quaternions


def heading_of(schedule: ContactSchedule, time: FloatArray) -> FloatArray:
    """(n,) heading of the body [rad]: mean direction of the soles, interpolated over the phases."""
    feet = {name for name in schedule.sequence.effectors if name.endswith("foot")}
    middles = 0.5 * (schedule.instants[:-1] + schedule.instants[1:])
    headings = []
    for phase in schedule.sequence:
        directions = [c.rotation_contact_to_world[:2, 0] for c in phase.stance if c.effector in feet]
        mean = np.sum(directions, axis=0) if directions else np.array([1.0, 0.0])
        headings.append(np.arctan2(mean[1], mean[0]))
    return np.interp(time, middles, np.unwrap(headings))


READY_ANGLES: Mapping[str, float] = {
    "shoulder_flexion": np.deg2rad(20.0),
    "shoulder_abduction": np.deg2rad(25.0),
    "elbow_flexion": np.deg2rad(60.0),
}
"""Arms of a person who steps over something: slightly raised and bent, clear of the thighs [rad]."""


def ready_posture(body: BodyModel) -> FloatArray:
    """(nq,) standing posture with the arms ready."""
    q = np.array(body.standing_posture())
    for index, name in enumerate(body.joint_names):
        for key, angle in READY_ANGLES.items():
            if key in name:
                q[7 + index] = angle
    return q


def reference_motion(body: BodyModel, trajectory: CentroidalTrajectory, time: FloatArray) -> FloatArray:
    """(n, nq) standing posture carried along the centre of mass, facing as the feet do."""
    standing = ready_posture(body)
    model = body.pinocchio
    offset = pin.centerOfMass(model, model.createData(), standing) - standing[:3]
    com = trajectory.position(time)
    out = np.tile(standing, (len(time), 1))
    for row, yaw, centre in zip(out, heading_of(trajectory.schedule, time), com, strict=True):
        turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, float(yaw)))
        row[:3] = centre - turn.matrix() @ offset
        row[3:7] = (turn * pin.Quaternion(*standing[[6, 3, 4, 5]])).coeffs()
    return align_quaternions(out)


REFERENCE_SCALES: Mapping[str, float] = {
    "toe": 0.01, "hip": 1.0, "knee": 1.5, "ankle": 1.0, "lumbar": 0.35, "thorax": 0.35, "neck": 0.25,
    "shoulder": 0.35, "elbow": 0.35, "wrist": 0.1,
}  # fmt: skip
"""Deviation of a joint from the reference posture that costs one unit [rad], by name."""


def reference_scale(body: BodyModel) -> FloatArray:
    """(nv,) scales of the deviation from the reference posture."""
    scale = np.full(body.nv, np.inf)
    scale[3:6] = 0.3
    for index, name in enumerate(body.joint_names):
        scale[6 + index] = next((s for key, s in REFERENCE_SCALES.items() if key in name), 0.5)
    return scale
