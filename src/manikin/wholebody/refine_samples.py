"""A refined motion at dense samples, with what is measured on them."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import ConfigurationSpline
from manikin.wholebody.contact_slack import contact_slack
from manikin.wholebody.forces import plan_forces
from manikin.wholebody.refine_balance import BalanceRoom
from manikin.wholebody.refine_certificate import RefineResiduals, certify_refined
from manikin.wholebody.refine_measures import balance_of, sample_uniformly, whole_body_wrench
from manikin.wholebody.refine_obstacles import RefineObstacles


def sampled_motion(
    body: BodyModel,
    schedule: ContactSchedule,
    rooms: Sequence[BalanceRoom],
    spline: ConfigurationSpline,
    sampling: float,
) -> tuple[Motion, FloatArray]:
    """Sample a spline with its contact forces and torques.

    Args:
        body: The body.
        schedule: Contacts in time.
        rooms: Wrench polytope of each phase.
        spline: The motion.
        sampling: Spacing of the samples [s].

    Returns:
        The motion, and (n,) its physics violation [N].
    """
    time = sample_uniformly(schedule, sampling)
    q, v, a = spline.evaluate(time)
    forces = plan_forces(body, schedule, time, q, v, a)
    wrench = whole_body_wrench(body, q, v, a)
    _, violation = balance_of(schedule, tuple(rooms), time, wrench)
    names = schedule.sequence.effectors
    com, momentum = _centroidal(body, q, v)
    motion = Motion(
        time=time, q=q, v=v, a=a, tau=forces.tau, com=com, angular_momentum=momentum,
        margin=_margin(schedule, rooms, time, wrench), support=schedule.support(time, names),
        contact_force=forces.contact_force, contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip
    return motion, violation


def certified_motion(
    body: BodyModel,
    scene: Scene,
    proximity: Proximity,
    schedule: ContactSchedule,
    rooms: Sequence[BalanceRoom],
    spline: ConfigurationSpline,
    sampling: float,
    padded: Sequence[str] = (),
) -> tuple[Motion, RefineResiduals]:
    """Sample a spline and measure it against everything that is required.

    Args:
        body: The body.
        scene: Its surroundings.
        proximity: Distances to the scene and within the body.
        schedule: Contacts in time.
        rooms: Wrench polytope of each phase.
        spline: The motion.
        sampling: Spacing of the samples [s].
        padded: Obstacles that any part of the body may lean on.
    """
    motion, violation = sampled_motion(body, schedule, rooms, spline, sampling)
    obstacles = RefineObstacles(body, scene, schedule, motion.time, padded)
    flat = tuple(room.is_flat for room in rooms)
    return motion, certify_refined(body, proximity, schedule, obstacles, motion, violation, flat)


def least_slack(
    body: BodyModel, schedule: ContactSchedule, spline: ConfigurationSpline, time: FloatArray
) -> tuple[float, float]:
    """Least slack of the contacts' limits at samples (n,) [s] of a motion, and when [s]."""
    wrench = whole_body_wrench(body, *spline.evaluate(time))
    slack = contact_slack(schedule, time, wrench)
    worst = int(np.argmin(slack))
    return float(slack[worst]), float(time[worst])


def _margin(
    schedule: ContactSchedule, rooms: Sequence[BalanceRoom], time: FloatArray, wrench: FloatArray
) -> FloatArray:
    """(n,) margin about the world origin, as of every motion [N.m]."""
    phases = schedule.phase_at(time)
    margin = np.zeros(len(time))
    for number, room in enumerate(rooms):
        rows = phases == number
        margin[rows] = room.polytope.at_reference(np.zeros(3)).margin(wrench[rows])
    return margin


def _centroidal(body: BodyModel, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre of mass (n, 3) and angular momentum about it (n, 3)."""
    model, data = body.pinocchio, body.pinocchio.createData()
    com, momentum = np.zeros((len(q), 3)), np.zeros((len(q), 3))
    for k in range(len(q)):
        pin.computeCentroidalMomentum(model, data, q[k], v[k])
        com[k], momentum[k] = data.com[0], data.hg.angular
    return com, momentum
