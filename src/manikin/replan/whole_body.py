"""The recorded postures on exact stances and with a planned centre of mass ([Qiu2012]_ 5.3.3)."""

from dataclasses import dataclass

import numpy as np

from manikin.balance import WrenchPolytope
from manikin.body import BodyModel
from manikin.centroidal import CentroidalTrajectory
from manikin.motion import Motion
from manikin.replan.effectors import effector_paths
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.certificate import WholeBodyResiduals, certify
from manikin.wholebody.configuration_spline import align_quaternions
from manikin.wholebody.fit import MotionFit
from manikin.wholebody.fit_scales import FitScales
from manikin.wholebody.full_motion import full_motion
from manikin.wholebody.knots import phase_knots, sample_times
from manikin.wholebody.manner import WALKING
from manikin.wholebody.targets import FitTargets, ignored_pairs

DEGREE = 5
"""Degree of the whole-body spline."""

KNOT_SPACING = 0.05
"""Largest distance of its knots [s]."""

SAMPLES = 3
"""Samples between two knots."""

STEP = 1e-3
"""Distance of the finished motion's samples [s]."""

FLAT_TOES = 2e-3
"""Deviation of toes from lying flat that costs one unit [rad]."""

SCALES = FitScales(rest=1e6, moment_share=0.5)
"""Of the fit: a recording need not begin or end at rest, and a rate of angular momentum of 5 N.m costs one
unit, for the centre of mass is planned as that of a point mass."""


@dataclass(frozen=True, eq=False)
class AdaptedMotion:
    """A whole-body motion with its certificate.

    Attributes:
        motion: Every millisecond, with forces, torques and whole-body margin.
        certificate: Measured on its samples.
        posture_rms: Root mean square deviation of all joints from the recorded postures [rad].
    """

    motion: Motion
    certificate: WholeBodyResiduals
    posture_rms: float


def adapt_postures(
    body: BodyModel,
    scene: Scene,
    trajectory: CentroidalTrajectory,
    polytopes: tuple[WrenchPolytope, ...],
    recorded: tuple[FloatArray, FloatArray],
    clock: tuple[FloatArray, FloatArray],
) -> AdaptedMotion:
    """Fit one smooth motion to contacts and centre of mass that stays near recorded postures.

    Args:
        body: The body.
        scene: Obstacles and floor.
        trajectory: Centre of mass with the contacts.
        polytopes: Of its phases, about the world origin.
        recorded: (n,) instants [s] and (n, nq) postures.
        clock: (k,) key instants of the trajectory and the recorded instants that they stand for [s].
    """
    schedule = trajectory.schedule
    knots = phase_knots(schedule.instants, KNOT_SPACING, DEGREE)
    time = sample_times(knots, SAMPLES)
    reference = _postures(recorded, np.interp(time, *clock))
    paths = effector_paths(body, schedule, time, reference)
    scale = np.tile(WALKING.scale(body), (len(time), 1))
    for joint, angle in paths.toes.items():
        reference[:, 7 + joint], scale[:, 6 + joint] = angle, FLAT_TOES
    proximity = Proximity(body, scene)
    targets = FitTargets(
        time=time, effectors=paths.targets, com=trajectory.position(time), com_weight=np.ones(len(time)),
        com_acceleration=trajectory.acceleration(time), margin=np.zeros(len(time)), reference=reference,
        reference_scale=scale, ignored=ignored_pairs(body, scene, schedule, time),
    )  # fmt: skip
    fit = MotionFit(body, proximity, targets, knots, DEGREE, SCALES)
    found = fit.solve(fit.initial_spline(reference))
    dense = np.linspace(0.0, trajectory.duration, max(2, round(trajectory.duration / STEP) + 1))
    motion, wrench = full_motion(body, schedule, polytopes, dense, *found.spline.evaluate(dense))
    ignored = ignored_pairs(body, scene, schedule, dense)
    certificate = certify(body, proximity, trajectory, motion, ignored, wrench)
    away = motion.q[:, 7:] - _postures(recorded, np.interp(dense, *clock))[:, 7:]
    return AdaptedMotion(motion, certificate, float(np.sqrt(np.mean(away**2))))


def _postures(recorded: tuple[FloatArray, FloatArray], time: FloatArray) -> FloatArray:
    """(n, nq) postures between the recorded ones."""
    known, q = recorded[0], align_quaternions(np.array(recorded[1]))
    found = np.column_stack([np.interp(time, known, column) for column in q.T])
    found[:, 3:7] /= np.linalg.norm(found[:, 3:7], axis=1, keepdims=True)
    return found
