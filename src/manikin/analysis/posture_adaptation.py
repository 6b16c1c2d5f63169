"""The recorded postures on exact stances and with a planned centre of mass ([Qiu2012]_ 5.3.3).

Effectors stay on their contacts while they hold one and follow the recorded paths in between. A foot that
only stands on its toes tilts about their hinge, as far as it was recorded to, within what toes can bend. In
flight each effector goes smoothly from its contact to the recorded path and from there to its next contact,
the tips of a foot kept off the surface. All this is our own.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from manikin.analysis.contact_adaptation import effector_placements
from manikin.balance import WrenchPolytope
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment, toe_hinge
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline, align_quaternions
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.banded import SampledBasis
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory, RecordedCom
from manikin.planning.whole_body.certificate import MotionCertificate, certify
from manikin.planning.whole_body.fit import spline_through
from manikin.planning.whole_body.fit_job import FitJob, key_instants
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import FitScales, MotionScales
from manikin.planning.whole_body.fit_targets import (
    GRASP_ROTATION_WEIGHT,
    EffectorTarget,
    FitTargets,
    KeptDistances,
    flight_weight,
    ignored_pairs,
    lay_toes_flat,
)
from manikin.planning.whole_body.posture_style import Guide
from manikin.planning.whole_body.sliding_touchdown import Ignored
from manikin.scene import Proximity, Scene
from manikin.walking.gait.stance_foot import smooth_step

LARGEST_TILT, TILT_BEND = float(np.deg2rad(64.0)), float(np.deg2rad(3.0))
"""Tilt of a foot that stands on its toes, approached but not reached: they bend up to 70 degrees; and width
of the bend of the tilt below it [rad]."""

TILTING = 0.08
"""Longest time over which the recorded tilt sets in, and ceases where the heel comes down again [s]."""

JOINING = 0.45
"""Share of a flight at either end in which it leaves, or joins, the recorded path."""

SHORTEST_JOINING, LONGEST_JOINING = 0.2, 0.25
"""Time in which a foot in flight at a clip's end does so at least, as long as there is so much, and in which
any effector does so at most: buttocks that lag behind make the arms swing up [s]."""

SIDEWAYS = 0.15
"""Importance of a flying foot's place to the side, as a share of that ahead and upward: a recorded foot may
pass nearer to the other leg than the body's soles and shanks can."""

HEIGHT = 3.0
"""Importance of its height, as a multiple of that ahead: lifted feet shall not brush the ground."""

SWING_HEIGHT, CUT_HEIGHT = 0.03, 0.02
"""Least height of a foot's lowest point in mid-flight, and at a clip's end that cuts a flight [m]."""

ROUNDING, TOES_BACK = 0.005, 0.5
"""Width of the bend between a flight that is lifted to that height and one that is not [m], and share of the
flight after which bent toes are straight again, and before which those that land bent are so still."""

STEPPING = 0.4
"""Share of a flight in which the height of the ground below it changes from one contact's to the next's."""

SAME_INSTANT = 1e-6
"""Times nearer to each other are one [s]."""

FLIGHT_POSITION, FLIGHT_ROTATION, FLIGHT_END = 0.2, 0.1, 0.25
"""Importance of position and orientation in the middle of a flight, and the share at either end of it in
which they matter more."""


@dataclass(frozen=True, eq=False)
class EffectorPaths:
    """Targets of every effector of a schedule, and (n,) angles of toes by their index among hinges [rad]."""

    targets: dict[str, EffectorTarget]
    toes: dict[int, FloatArray]


def effector_paths(
    body: BodyModel, schedule: ContactSchedule, time: FloatArray, q: FloatArray
) -> EffectorPaths:
    """Adapt the recorded paths of the effectors, in postures (n, nq) at times (n,) [s], to their contacts."""
    targets, toes = {}, {}
    for name in schedule.sequence.effectors:
        path = _Path(body, schedule, time, q, name)
        targets[name] = path.target()
        if path.toe_joint is not None:
            toes[path.toe_joint] = path.toes
    return EffectorPaths(targets, toes)


class _Path:
    """One effector; recorded first, and then changed in place."""

    def __init__(
        self, body: BodyModel, schedule: ContactSchedule, time: FloatArray, q: FloatArray, name: str
    ) -> None:
        self.body, self.schedule, self.time, self.name = body, schedule, time, name
        self.phases, self.recorded = schedule.phase_at(time), effector_placements(body, q, name)
        self.position, self.rotation = (np.array(part) for part in self.recorded)
        n = len(time)
        self.weight, self.rotation_weight, self.toes = np.zeros(n), np.ones(n), np.zeros(n)
        self.along = np.tile(np.eye(3), (n, 1, 1))
        hanging = hanging_segment(body, body.effector(name).segment)
        self.toe_joint = None if hanging is None else body.joint_index(hanging.hinges[0].name)
        self.hinge = toe_hinge(body, name)

    def target(self) -> EffectorTarget:
        held = np.array([self.name in phase.stance for phase in self.schedule.sequence])
        for first, stop in mask_runs(held):
            self._hold(first, stop)
        for first, stop in mask_runs(self.weight == 0.0):
            self._fly(first, stop)
        parts = self.position, self.rotation, self.weight, self.rotation_weight, self.along
        return EffectorTarget(*parts, np.zeros_like(self.position))

    def _hold(self, first: int, stop: int) -> None:
        """Place it on one of its contacts, which lasts from a phase up to another."""
        tilt = _pitch(self.recorded[1])
        contacts = [self.schedule.sequence[phase].stance[self.name] for phase in range(first, stop)]
        flat = np.isin(self.phases, [first + i for i, c in enumerate(contacts) if c.part is SolePart.FULL])
        rest = float(np.median(tilt[flat])) if np.any(flat) else 0.0
        for part, begin, end in _parts(contacts):
            rows = (self.phases >= first + begin) & (self.phases < first + end)
            if end == len(contacts):  # at the very instant of its lift-off it still is where it was
                rows |= np.abs(self.time - self.schedule.instants[first + end]) < SAME_INSTANT
            contact = contacts[begin]
            place = np.tile(contact.position, (int(rows.sum()), 1))
            turn = np.tile(contact.rotation_contact_to_world, (len(place), 1, 1))
            if part is SolePart.TOES and self.hinge is not None:
                start, over = self.schedule.instants[[first + begin, first + end]]
                # A contact that a clip's end cuts goes on: there is no hurry.
                lasting = over - start if first + end < len(self.schedule.sequence) else np.inf
                setting = min(TILTING, lasting)
                angle = _up_to(LARGEST_TILT, np.maximum(tilt[rows] - rest, 0.0))
                angle *= smooth_step((self.time[rows] - start) / setting) if begin > 0 else 1.0
                angle *= smooth_step((over - self.time[rows]) / setting) if end < len(contacts) else 1.0
                turn = turn @ Rotation.from_rotvec(np.outer(angle, [0.0, 1.0, 0.0])).as_matrix()
                place = place + contact.rotation_contact_to_world @ self.hinge - turn @ self.hinge
                self.toes[rows] = angle
            self.position[rows], self.rotation[rows], self.weight[rows] = place, turn, 1.0
            if contact.kind is ContactKind.GRASP:
                self.rotation_weight[rows] = 0.0

    def _fly(self, first: int, stop: int) -> None:
        """Join contact and recording in a flight of some samples; a clip's ends have no contact."""
        rows = slice(first, stop)
        leaves, lands = first > 0, stop < len(self.time)
        start, end = self.time[max(first - 1, 0)], self.time[min(stop, len(self.time) - 1)]
        lasting = max(end - start, 1e-9)
        share = (self.time[rows] - start) / lasting
        joining = min(JOINING if leaves and lands else max(JOINING, SHORTEST_JOINING / lasting), 1.0)
        joining = min(joining, LONGEST_JOINING / lasting)
        # The hinge of the toes starts from rest, and the foot keeps turning about it.
        arm = np.zeros(3) if self.hinge is None else self.hinge
        points = self.position + self.rotation @ arm
        place, turn = points[rows].copy(), np.zeros((stop - first, 3))
        for there, at, along in ((leaves, first - 1, share), (lands, stop, 1.0 - share)):
            if there:
                rest = 1.0 - smooth_step(along / joining)
                place += rest[:, None] * (points[at] - points[rows])
                known = self.recorded[1][at] if at < first else self.rotation[rows]
                away = self.rotation[at] @ np.swapaxes(known, -1, -2)
                turn += rest[:, None] * Rotation.from_matrix(away).as_rotvec()
        self.rotation[rows] = Rotation.from_rotvec(turn).as_matrix() @ self.rotation[rows]
        self.position[rows] = place - self.rotation[rows] @ arm
        if leaves:
            self.toes[rows] += self._straightening(first - 1, -1, share, lasting)
        if lands:
            self.toes[rows] += self._straightening(stop, 1, 1.0 - share, lasting)
        near = np.maximum(share, 0.5 if not leaves else 0.0)
        near = np.clip(np.minimum(near, 0.5 if not lands else 1.0), 1e-6, 1.0 - 1e-6)
        self.weight[rows] = flight_weight(near, FLIGHT_POSITION, FLIGHT_END, FLIGHT_END)
        self.rotation_weight[rows] = flight_weight(near, FLIGHT_ROTATION, FLIGHT_END, FLIGHT_END)
        if self.hinge is not None:
            self._lift(rows, np.minimum(near, 1.0 - near), share, (not leaves, not lands))
            side = self.rotation[rows, :, 1] * [1.0, 1.0, 0.0]
            side /= np.linalg.norm(side, axis=1, keepdims=True)
            less = (1.0 - SIDEWAYS) * (1.0 - self.weight[rows]) / (1.0 - FLIGHT_POSITION)
            self.along[rows] -= less[:, None, None] * side[:, :, None] * side[:, None, :]
            self.along[rows, 2, 2] *= np.minimum(HEIGHT, 1.0 / self.weight[rows])
        if all(contact.kind is ContactKind.GRASP for contact in self._contacts()):
            self.rotation_weight[rows] = GRASP_ROTATION_WEIGHT

    def _straightening(self, at: int, inward: int, share: FloatArray, lasting: float) -> FloatArray:
        """Angle of the toes in a flight of a duration [s] beside the contact at a sample [rad].

        It goes on as it came, and then back to straight; before a landing on the toes, the other way round.
        The next sample of the contact is ``inward``; shares of the flight are (n,) since that contact.
        """
        inside, angle = min(max(at + inward, 0), len(self.time) - 1), self.toes[at]
        rate = (angle - self.toes[inside]) / max(abs(self.time[at] - self.time[inside]), 1e-9)
        gone = np.clip(share / TOES_BACK, 0.0, 1.0)
        found = angle * (1.0 - smooth_step(gone)) + rate * TOES_BACK * lasting * gone * (1.0 - gone) ** 2
        return _up_to(LARGEST_TILT, np.maximum(found, 0.0))

    def _lift(self, rows: slice, near: FloatArray, share: FloatArray, cut: tuple[bool, bool]) -> None:
        """Keep heel, hinge and tips of a foot off the surface in flight.

        At an end of the clip that cuts a flight, a foot may be as near to it as it was recorded, about to
        land. Shares of the flight are (n,) from its nearer contact and since its beginning.
        """
        tilt, half = _pitch(self.rotation[rows]), 0.5 * (self.body.sole_length or 0.0)
        height, hinge = self.position[rows, 2], 0.0 if self.hinge is None else float(self.hinge[0])
        ball = height - hinge * np.sin(tilt)
        tips = ball - (half - hinge) * np.sin(tilt - self.toes[rows])
        surface = self._surface(rows, share)
        low = np.minimum(np.minimum(height + half * np.sin(tilt), ball), tips) - surface
        wanted = SWING_HEIGHT * np.minimum(1.0, 4.0 * near)
        for is_cut, at, away in zip(cut, (0, -1), (share, 1.0 - share), strict=True):
            if is_cut:
                least = float(np.clip(low[at], CUT_HEIGHT, SWING_HEIGHT))
                wanted = np.minimum(wanted, least + (SWING_HEIGHT - least) * np.minimum(1.0, 4.0 * away))
        lift = ROUNDING * np.logaddexp(0.0, (wanted - low) / ROUNDING)
        self.position[rows, 2] += lift * np.minimum(1.0, 8.0 * near)

    def _surface(self, rows: slice, share: FloatArray) -> FloatArray:
        """(n,) height that a foot keeps above in a flight [m]: that of the contact it leaves, or will make.

        A higher one counts from early on, a lower one late; at a clip's end the one that there is.
        """
        last, coming = self.phases[[max(rows.start - 1, 0), min(rows.stop, len(self.time) - 1)]].tolist()
        stances = [phase.stance for phase in self.schedule.sequence]
        before = [stance[self.name] for stance in stances[: last + 1] if self.name in stance][-1:]
        after = [stance[self.name] for stance in stances[coming:] if self.name in stance][:1]
        left, made = (contact.position[2] for contact in ((before or after)[0], (after or before)[0]))
        passed = smooth_step(share / STEPPING if made > left else 1.0 - (1.0 - share) / STEPPING)
        return left + (made - left) * passed

    def _contacts(self) -> Iterator[Contact]:
        for phase in self.schedule.sequence:
            if self.name in phase.stance:
                yield phase.stance[self.name]


def _pitch(rotation: FloatArray) -> FloatArray:
    """(n,) of soles, heel up when positive [rad]."""
    return np.arcsin(np.clip(-rotation[:, 2, 0], -1.0, 1.0))


def _up_to(limit: float, angle: FloatArray) -> FloatArray:
    """Angles (n,) >= 0 with a smooth bend below a limit [rad]."""
    return np.maximum(limit - TILT_BEND * np.logaddexp(0.0, (limit - angle) / TILT_BEND), 0.0)


def _parts(contacts: list[Contact]) -> Iterator[tuple[SolePart, int, int]]:
    """Part of a contact with the first and the last but one phase in which it is the one."""
    for part, run in groupby(range(len(contacts)), key=lambda number: contacts[number].part):
        first, *more = run
        yield part, first, first + len(more) + 1


KNOT_SPACING = 0.035
"""Largest distance of the spline's knots [s]. Near key instants they are doubled: heels that rise there turn
at up to 8 rad/s."""

STEP = 1e-3
"""Distance of the finished motion's samples [s]."""

POSTURE, TRUNK_POSTURE = 0.06, 0.04
"""Deviation from the recording that costs one unit: of a hinge; of the pelvis' turn, trunk and head [rad]."""

TRUNK = ("lumbar", "thorax", "neck")
ARMS = ("left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist")
"""First words of the hinges of trunk and head, and of the arms."""

END_SHARE = 0.25
"""Share of these deviations of trunk and arms that costs as much at a clip's ends, where a bend of the
spline is cheap."""

UNSURE = 0.1
"""Time at both ends in which accelerations of a recording are not known well [s]."""

SCALES = FitScales(
    rest=1e6, force=8.0, moment_share=0.25, acceleration=16.0, pelvis_acceleration=8.0, torque_share=0.05,
    strength_share=0.9,
)  # fmt: skip
"""Scales of the fit. A recording need not begin or end at rest, and a rate of angular momentum of 2.5 N.m
costs one unit, for the centre of mass is planned as that of a point mass. A twentieth of a joint's strength
costs as much: beyond it there is no execution."""


@dataclass(frozen=True, eq=False)
class AdaptedMotion:
    """A whole-body motion every millisecond, with forces, torques and margin, and its certificate.

    Attributes:
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
    points = KeptDistances.of_points(body, scene, schedule, dense)
    certificate = certify(
        body, task.proximity, trajectory, motion, ignored, points, wrench, polytopes=polytopes
    )
    compared = [7 + joint for joint in range(body.nq - 7) if joint not in task.paths.toes]
    away = motion.q[:, compared] - _postures(recorded, np.interp(dense, *clock))[:, compared]
    return AdaptedMotion(motion, certificate, float(np.sqrt(np.mean(away**2))))


def rate_as_recorded(
    body: BodyModel, recording: RecordedCom, recorded: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(n, 3) rate of the angular momentum of recorded postures at a recording's samples [N.m].

    That of the same postures put on exact contacts, with nothing that makes up for the legs, was up to five
    times as large in walks: a plan for it throws trunk and arms about.
    """
    job = FitJob(KNOT_SPACING)
    knots = job.knots(recording.schedule)
    time, basis = job.samples(knots)
    spline = spline_through(_postures(recorded, time), basis, knots)
    return centroidal_motion(body, *spline.evaluate(recording.time)).angular_momentum_rate


def rate_on_plan(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory,
    recorded: tuple[FloatArray, FloatArray], recording: RecordedCom,
) -> FloatArray:  # fmt: skip
    """(n, 3) rate of the angular momentum of recorded postures adapted to a plan near them [N.m].

    At the samples of the recording on whose stances it was planned.
    """
    clock = trajectory.schedule.instants, recording.key_times
    spline = _Task.of(body, scene, trajectory.schedule, recorded, clock).follow(trajectory)
    return centroidal_motion(body, *spline.evaluate(recording.time)).angular_momentum_rate


@dataclass(frozen=True, eq=False)
class _Task:
    """Recorded postures and the contacts to put them on, at (n,) samples of a spline [s].

    Attributes:
        reference: (n, nq) recorded postures, with the toes that the contacts need.
        scale: (n, nv) deviation from them that costs one unit [rad].
        ignored: Pairs that may touch, per sample.
        kept: Distances that those of them keep which are held at a point.
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
    kept: KeptDistances

    @classmethod
    def of(
        cls, body: BodyModel, scene: Scene, schedule: ContactSchedule,
        recorded: tuple[FloatArray, FloatArray], clock: tuple[FloatArray, FloatArray],
    ) -> "_Task":  # fmt: skip
        job = FitJob(KNOT_SPACING)
        time, _ = job.samples(job.knots(schedule, (key_instants(schedule),)))
        reference = _postures(recorded, np.interp(time, *clock))
        paths, scale = effector_paths(body, schedule, time, reference), _posture_scale(body, time)
        lay_toes_flat(paths.toes, reference, scale)
        ignored = ignored_pairs(body, scene, schedule, time)
        kept = KeptDistances.of_points(body, scene, schedule, time)
        return cls(body, Proximity(body, scene), schedule, job, time, reference, scale, paths, ignored, kept)

    def follow(self, trajectory: CentroidalTrajectory) -> ConfigurationSpline:
        """Fit to a planned centre of mass and its angular momentum."""
        goal = _AdaptationGoal(
            self, trajectory.position(self.time), trajectory.acceleration(self.time),
            trajectory.angular_momentum_rate(self.time),
        )  # fmt: skip
        return self.job.solve(goal, SCALES, (key_instants(self.schedule),))[1].spline


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
        knots = task.job.knots(task.schedule, (key_instants(task.schedule),))
        start = spline_through(task.reference, basis, knots)
        targets = FitTargets(
            time=time, schedule=task.schedule, effectors=task.paths.targets, com=self.com,
            com_weight=np.ones(len(time)), com_acceleration=self.acceleration, margin=np.zeros(len(time)),
            reference=task.reference, reference_scale=task.scale, ignored=task.ignored, kept=task.kept,
            turning=self.turning,
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
    """(n, nq) postures between the recorded ones, smooth in time: kinks of a slow camera are no motion."""
    instants, postures = recorded[0], align_quaternions(np.array(recorded[1]))
    return Guide(instants, postures, (), CubicSpline(instants, postures).derivative()(instants)).at(time)
