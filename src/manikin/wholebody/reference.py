"""The posture a person would keep where the task leaves freedom."""

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.centroidal import CentroidalTrajectory
from manikin.contact import ContactSchedule
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import align_quaternions
from manikin.wholebody.manner import READY, Manner


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


def foot_lead(schedule: ContactSchedule, time: FloatArray) -> FloatArray:
    """(n,) how far the left foot is ahead of the right one along the heading [m]; 0 without both."""
    heading = heading_of(schedule, time)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    places = [_foot_path(schedule, f"{side}_foot", time) for side in ("left", "right")]
    if places[0] is None or places[1] is None:
        return np.zeros(len(time))
    return np.sum(forward * (places[0] - places[1]), axis=1)


def _foot_path(schedule: ContactSchedule, effector: str, time: FloatArray) -> FloatArray | None:
    """(n, 2) where an effector is, seen from above; smoothly from one contact to the next."""
    known: list[float] = []
    places: list[FloatArray] = []
    for index, phase in enumerate(schedule.sequence):
        if effector in phase.stance:
            known.extend(schedule.instants[index : index + 2])
            places.extend([phase.stance[effector].position[:2]] * 2)
    if not known:
        return None
    after = np.clip(np.searchsorted(known, time, side="right"), 1, len(known) - 1)
    start, end = np.array(known)[after - 1], np.array(known)[after]
    share = np.clip((time - start) / np.maximum(end - start, 1e-9), 0.0, 1.0)[:, None]
    blend = share**2 * (3.0 - 2.0 * share)
    return (1.0 - blend) * np.array(places)[after - 1] + blend * np.array(places)[after]


def reference_motion(
    body: BodyModel, trajectory: CentroidalTrajectory, time: FloatArray, manner: Manner = READY
) -> FloatArray:
    """(n, nq) preferred posture carried along the centre of mass, facing as the feet do.

    Args:
        body: The body.
        trajectory: Centre of mass and contacts in time.
        time: (n,) [s].
        manner: Preferred posture and swing of the arms.
    """
    standing = manner.posture(body)
    model = body.pinocchio
    offset = pin.centerOfMass(model, model.createData(), standing) - standing[:3]
    com = trajectory.position(time)
    out = np.tile(standing, (len(time), 1))
    for row, yaw, centre in zip(out, heading_of(trajectory.schedule, time), com, strict=True):
        turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, float(yaw)))
        row[:3] = centre - turn.matrix() @ offset
        row[3:7] = (turn * pin.Quaternion(*standing[[6, 3, 4, 5]])).coeffs()
    _swing_arms(body, out, manner.arm_swing * foot_lead(trajectory.schedule, time))
    return align_quaternions(out)


def _swing_arms(body: BodyModel, configurations: FloatArray, angle: FloatArray) -> None:
    """Add the shoulders' flexion (n,) [rad], the right forward and the left back when positive."""
    for side, sign in (("left", -1.0), ("right", 1.0)):
        name = f"{side}_shoulder_flexion"
        if name in body.joint_names:
            configurations[:, 7 + body.joint_index(name)] += sign * angle
