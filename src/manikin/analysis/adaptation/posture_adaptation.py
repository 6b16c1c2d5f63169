"""The recorded postures on exact stances and with a planned centre of mass ([Qiu2012]_ 5.3.3)."""

from dataclasses import dataclass, replace

import numpy as np

from manikin.analysis.adaptation.effector_adaptation import EffectorPaths, effector_paths
from manikin.balance import WrenchPolytope
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline, align_quaternions
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory, RecordedCom
from manikin.planning.whole_body.certificate import MotionCertificate, certify
from manikin.planning.whole_body.fit import spline_through
from manikin.planning.whole_body.fit_job import FitJob
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import FitScales, MotionScales
from manikin.planning.whole_body.fit_targets import FitTargets, ignored_pairs, lay_toes_flat
from manikin.planning.whole_body.posture_style import Guide
from manikin.planning.whole_body.sliding_touchdown import Ignored
from manikin.scene import Proximity, Scene
from manikin.walking.gait.stance_foot import smooth_step

KNOT_SPACING = 0.035
"""Largest distance of the spline's knots [s]."""

FINE = 1
"""How often the knots near the key instants are doubled: heels that rise there turn at up to 8 rad/s."""

STEP = 1e-3
"""Distance of the finished motion's samples [s]."""

POSTURE = 0.06
"""Deviation of a hinge or of the pelvis' turn from the recording that costs one unit [rad]."""

TRUNK_POSTURE = 0.04
"""Deviation of the pelvis' turn, trunk and head that costs one unit [rad]."""

TRUNK = ("lumbar", "thorax", "neck")
"""First words of the hinges of trunk and head."""

ARMS = ("left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist")
"""First words of the hinges of the arms."""

END_SHARE = 0.25
"""Share of these deviations of trunk and arms that costs as much at a clip's ends, where a bend of the
spline is cheap."""

UNSURE = 0.1
"""Time at both ends in which accelerations of a recording are not known well [s]."""

SCALES = FitScales(rest=1e6, force=8.0, moment_share=0.25, acceleration=16.0, pelvis_acceleration=8.0)
"""Scales of the fit. A recording need not begin or end at rest, and a rate of angular momentum of 5 N.m
costs one unit, for the centre of mass is planned as that of a point mass."""

LOOSE = replace(SCALES, moment_share=1e3, force=1e3, com=0.01)
"""Scales of a fit without dynamics."""


@dataclass(frozen=True, eq=False)
class AdaptedMotion:
    """A whole-body motion with its certificate.

    Attributes:
        motion: Every millisecond, with forces, torques and whole-body margin.
        posture_rms: Root mean square deviation of all joints from the recorded postures [rad]; without
            toes, which lie flat and which no marker shows.
    """

    motion: Motion
    certificate: MotionCertificate
    posture_rms: float


def adapt_postures(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory,
    polytopes: tuple[WrenchPolytope, ...], recorded: tuple[FloatArray, FloatArray],
    clock: tuple[FloatArray, FloatArray],
) -> AdaptedMotion:  # fmt: skip
    """Fit one smooth motion to contacts and centre of mass that stays near recorded postures.

    Args:
        recorded: (n,) instants [s] and (n, nq) postures.
        clock: (k,) key instants of the trajectory and the recorded instants that they stand for [s].
    """
    schedule = trajectory.schedule
    task = _Task.of(body, scene, schedule, recorded, clock)
    spline = task.follow(trajectory)
    dense = np.linspace(0.0, trajectory.duration, max(2, round(trajectory.duration / STEP) + 1))
    motion, wrench = full_motion(body, schedule, polytopes, dense, *spline.evaluate(dense))
    ignored = ignored_pairs(body, scene, schedule, dense)
    certificate = certify(body, task.proximity, trajectory, motion, ignored, wrench, polytopes=polytopes)
    compared = [7 + joint for joint in range(body.nq - 7) if joint not in task.paths.toes]
    away = motion.q[:, compared] - _postures(recorded, np.interp(dense, *clock))[:, compared]
    return AdaptedMotion(motion, certificate, float(np.sqrt(np.mean(away**2))))


def rate_on_contacts(
    body: BodyModel, scene: Scene, recording: RecordedCom, recorded: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(n, 3) rate of the angular momentum of recorded postures put on exact contacts [N.m].

    At a recording's samples. Soles that stay in place and land flat make legs swing a little
    otherwise than they were recorded, and with them the rest of the body.

    Args:
        recording: The recorded centre of mass on the contacts.
        recorded: (n,) instants [s] and (n, nq) postures.
    """
    clock = recording.key_times, recording.key_times
    task = _Task.of(body, scene, recording.schedule, recorded, clock)
    velocity = np.gradient(recording.com, recording.time, axis=0, edge_order=2)
    second = np.gradient(velocity, recording.time, axis=0, edge_order=2)
    com, acceleration = (
        np.column_stack([np.interp(task.time, recording.time, column) for column in values.T])
        for values in (recording.com, second)
    )
    return _angular_momentum_rate(
        body, task.fit(com, acceleration, np.zeros_like(com), LOOSE), recording.time
    )


def rate_on_plan(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory,
    recorded: tuple[FloatArray, FloatArray], recording: RecordedCom,
) -> FloatArray:  # fmt: skip
    """(n, 3) rate of the angular momentum of recorded postures adapted to a plan [N.m].

    At a recording's samples.

    Args:
        trajectory: Planned near the recording, at its pace.
        recorded: (n,) instants [s] and (n, nq) postures.
        recording: On whose stances it was planned.
    """
    clock = trajectory.schedule.instants, recording.key_times
    spline = _Task.of(body, scene, trajectory.schedule, recorded, clock).follow(trajectory)
    return _angular_momentum_rate(body, spline, recording.time)


def _angular_momentum_rate(body: BodyModel, spline: ConfigurationSpline, time: FloatArray) -> FloatArray:
    return centroidal_motion(body, *spline.evaluate(time)).angular_momentum_rate


@dataclass(frozen=True, eq=False)
class _Task:
    """Recorded postures and the contacts to put them on, at the samples of a spline.

    Attributes:
        time: (n,) samples [s].
        reference: (n, nq) recorded postures, with the toes that the contacts need.
        scale: (n, nv) deviation from them that costs one unit [rad].
        ignored: Pairs that may touch, per sample.
    """

    body: BodyModel
    proximity: Proximity
    schedule: ContactSchedule
    job: FitJob
    time: FloatArray
    reference: FloatArray
    scale: FloatArray
    paths: EffectorPaths
    ignored: tuple[Ignored, ...]

    @classmethod
    def of(
        cls,
        body: BodyModel,
        scene: Scene,
        schedule: ContactSchedule,
        recorded: tuple[FloatArray, FloatArray],
        clock: tuple[FloatArray, FloatArray],
    ) -> "_Task":
        job = FitJob(KNOT_SPACING)
        time, _ = job.samples(job.knots(schedule, FINE))
        reference = _postures(recorded, np.interp(time, *clock))
        paths = effector_paths(body, schedule, time, reference)
        scale = _posture_scale(body, time)
        lay_toes_flat(paths.toes, reference, scale)
        ignored = ignored_pairs(body, scene, schedule, time)
        return cls(body, Proximity(body, scene), schedule, job, time, reference, scale, paths, ignored)

    def follow(self, trajectory: CentroidalTrajectory) -> ConfigurationSpline:
        """Fit to a planned centre of mass and its angular momentum."""
        return self.fit(
            trajectory.position(self.time), trajectory.acceleration(self.time),
            trajectory.angular_momentum_rate(self.time), SCALES,
        )  # fmt: skip

    def fit(
        self, com: FloatArray, acceleration: FloatArray, turning: FloatArray, scales: FitScales
    ) -> ConfigurationSpline:
        """Fit to a centre of mass [m], its acceleration and a rate of angular momentum [N.m], (n, 3) each."""
        return self.job.solve(_AdaptationGoal(self, com, acceleration, turning), scales, FINE)[1].spline


@dataclass(frozen=True, eq=False)
class _AdaptationGoal:
    """A centre of mass (n, 3) with its acceleration and a rate of angular momentum for recorded postures."""

    task: _Task
    com: FloatArray
    acceleration: FloatArray
    turning: FloatArray

    @property
    def schedule(self) -> ContactSchedule:
        """Contacts in time."""
        return self.task.schedule

    def objective(self, time: FloatArray, basis: SampledBasis, scales: MotionScales) -> MotionObjective:
        """Residuals at the task's samples."""
        del scales
        task = self.task
        start = spline_through(task.reference, basis, task.job.knots(task.schedule, FINE))
        targets = FitTargets(
            time=time, effectors=task.paths.targets, com=self.com, com_weight=np.ones(len(time)),
            com_acceleration=self.acceleration, margin=np.zeros(len(time)), reference=task.reference,
            reference_scale=task.scale, ignored=task.ignored, turning=self.turning,
            reference_second=_steady_ends(time, basis.evaluate(start.control_points, 2)),
        )  # fmt: skip
        return MotionObjective(task.body, task.proximity, targets, basis)


def _posture_scale(body: BodyModel, time: FloatArray) -> FloatArray:
    """(n, nv) deviation from the recording that costs one unit [rad]; infinite for the pelvis' place."""
    scale = np.full((len(time), body.nv), POSTURE)
    trunk = [3, 4, 5, *(6 + k for k, name in enumerate(body.joint_names) if name.startswith(TRUNK))]
    arms = [6 + k for k, name in enumerate(body.joint_names) if name.startswith(ARMS)]
    scale[:, trunk] = TRUNK_POSTURE
    away = np.minimum(time - time[0], time[-1] - time) / UNSURE
    scale[:, [*trunk, *arms]] *= (END_SHARE + (1.0 - END_SHARE) * smooth_step(away))[:, None]
    scale[:, :3] = np.inf
    return scale


def _steady_ends(time: FloatArray, second: FloatArray) -> FloatArray:
    """Second derivatives (n, nq) that do not change near both ends, where a spline through samples bends."""
    inside = np.flatnonzero((time >= time[0] + UNSURE) & (time <= time[-1] - UNSURE))
    if len(inside) == 0:
        return np.zeros_like(second)
    return second[np.clip(np.arange(len(time)), inside[0], inside[-1])]


def _postures(recorded: tuple[FloatArray, FloatArray], time: FloatArray) -> FloatArray:
    """(n, nq) postures between the recorded ones."""
    return Guide(recorded[0], align_quaternions(np.array(recorded[1])), ()).at(time)
