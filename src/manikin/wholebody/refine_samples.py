"""A refined motion at dense samples, with what is measured on them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manikin.balance import MotionMargin
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.dynamics import centroidal_motion
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import ConfigurationSpline
from manikin.wholebody.contact_slack import contact_slack
from manikin.wholebody.full_motion import full_motion
from manikin.wholebody.refine_balance import BalanceRoom
from manikin.wholebody.refine_certificate import RefineResiduals, certify_refined
from manikin.wholebody.refine_measures import balance_of, sample_uniformly
from manikin.wholebody.refine_obstacles import RefineObstacles


def sampled_motion(
    body: BodyModel,
    schedule: ContactSchedule,
    rooms: Sequence[BalanceRoom],
    spline: ConfigurationSpline,
    sampling: float,
) -> tuple[Motion, FloatArray, MotionMargin]:
    """Sample a spline with its contact forces and torques.

    Args:
        body: The body.
        schedule: Contacts in time.
        rooms: Wrench polytope of each phase.
        spline: The motion.
        sampling: Spacing of the samples [s].

    Returns:
        The motion, (n,) its physics violation [N] and its margins.
    """
    time = sample_uniformly(schedule, sampling)
    polytopes = [room.polytope for room in rooms]
    motion, wrench = full_motion(body, schedule, polytopes, time, *spline.evaluate(time))
    balance, violation = balance_of(schedule, tuple(rooms), time, wrench, motion.com)
    return motion, violation, balance


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
    motion, violation, balance = sampled_motion(body, schedule, rooms, spline, sampling)
    obstacles = RefineObstacles(body, scene, schedule, motion.time, padded)
    flat = tuple(room.is_flat for room in rooms)
    found = certify_refined(body, proximity, schedule, obstacles, motion, violation, flat)
    force = np.where(np.array(flat)[schedule.phase_at(motion.time)], np.inf, balance.force)
    found = replace(
        found,
        min_force_at_com_N=replace(balance, force=force).min_force,
        min_zmp_distance_m=balance.min_zmp_distance,
    )
    return motion, found


def least_slack(
    body: BodyModel, schedule: ContactSchedule, spline: ConfigurationSpline, time: FloatArray
) -> tuple[float, float]:
    """Least slack of the contacts' limits at samples (n,) [s] of a motion, and when [s]."""
    wrench = centroidal_motion(body, *spline.evaluate(time)).wrench
    slack = contact_slack(schedule, time, wrench)
    worst = int(np.argmin(slack))
    return float(slack[worst]), float(time[worst])
