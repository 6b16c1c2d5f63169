"""Plan the whole-body motion of a centre-of-mass trajectory and its contacts.

Swings are smooth curves where that suffices and Bi-RRT paths where it does not
([Qiu2012]_ 6.2.3); the whole body then follows contacts, swings and centre of mass as one
spline, and the result is certified at 1 kHz.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.centroidal import CentroidalTrajectory
from manikin.contact import Contact, ContactSchedule, Swing
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import ConfigurationSpline, align_quaternions
from manikin.wholebody.effector_clearance import EffectorClearance
from manikin.wholebody.fit import EffectorTarget, FitResult, FitScales, FitTargets, Ignored, MotionFit
from manikin.wholebody.path import Pose
from manikin.wholebody.swing import SwingCurve, SwingLimits, SwingPlan, plan_swing


@dataclass(frozen=True)
class WholeBodySettings:
    """Options of :func:`plan_whole_body`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        samples_per_span: Samples between two knots.
        swing: What a swing must keep.
        fit: Scales and limits of the fit.
    """

    knot_spacing: float = 0.08
    samples_per_span: int = 3
    swing: SwingLimits = field(default_factory=SwingLimits)
    fit: FitScales = field(default_factory=FitScales)


@dataclass(frozen=True, eq=False)
class PlannedSwing:
    """A flight and the curve found for it."""

    swing: Swing
    plan: SwingPlan


def phase_knots(instants: FloatArray, spacing: float, degree: int) -> FloatArray:
    """Clamped knots with every key instant among them and at most ``spacing`` [s] apart."""
    inner: list[float] = []
    for start, end in zip(instants[:-1], instants[1:], strict=True):
        count = max(1, int(np.ceil((end - start) / spacing)))
        inner.extend(np.linspace(start, end, count, endpoint=False))
    ends = np.full(degree, instants[0]), np.full(degree + 1, instants[-1])
    return np.concatenate([ends[0], inner, ends[1]])


def sample_times(knots: FloatArray, per_span: int) -> FloatArray:
    """Times that split every knot span into equal parts, both ends included."""
    breaks = np.unique(knots)
    spans = [np.linspace(a, b, per_span, endpoint=False) for a, b in zip(breaks[:-1], breaks[1:], strict=True)]
    return np.append(np.concatenate(spans), breaks[-1])


def plan_swings(
    body: BodyModel,
    scene: Scene,
    trajectory: CentroidalTrajectory,
    limits: SwingLimits,
) -> tuple[PlannedSwing, ...]:
    """Find a curve for every flight between two contacts."""
    schedule = trajectory.schedule
    planned = []
    for swing in schedule.sequence.swings():
        if swing.start is None or swing.end is None:
            continue
        start, end = schedule.swing_interval(swing)
        clearance = EffectorClearance(
            body, scene, swing.effector, _standing(schedule, swing), lambda t: trajectory.position(t)
        )
        plan = plan_swing(
            _pose(swing.start), _pose(swing.end), start, end, clearance, limits=limits,
            start_normal=swing.start.normal, end_normal=swing.end.normal,
        )  # fmt: skip
        planned.append(PlannedSwing(swing, plan))
    return tuple(planned)


def _standing(schedule: ContactSchedule, swing: Swing) -> tuple[Contact, ...]:
    found: dict[tuple[str, bytes], Contact] = {}
    for index in range(swing.first_phase, swing.last_phase + 1):
        for contact in schedule.sequence[index].stance:
            found[(contact.effector, contact.position.tobytes())] = contact
    return tuple(found.values())


def _pose(contact: Contact) -> Pose:
    return Pose(contact.position, contact.rotation_contact_to_world)


def effector_targets(
    schedule: ContactSchedule, swings: tuple[PlannedSwing, ...], time: FloatArray
) -> dict[str, EffectorTarget]:
    """Placement of every effector of the schedule at every time; free where it has no task."""
    phases = schedule.phase_at(time)
    targets = {}
    for name in schedule.sequence.effectors:
        position, rotation = np.zeros((len(time), 3)), np.tile(np.eye(3), (len(time), 1, 1))
        weight, rotation_weight = np.zeros(len(time)), np.ones(len(time))
        for index, phase in enumerate(schedule.sequence):
            if name in phase.stance:
                contact, rows = phase.stance[name], phases == index
                position[rows], rotation[rows] = contact.position, contact.rotation_contact_to_world
                weight[rows] = 1.0
        for item in swings:
            if item.swing.effector == name:
                start, end = schedule.swing_interval(item.swing)
                rows = (time >= start) & (time < end)
                state = item.plan.curve.evaluate(time[rows])
                position[rows], rotation[rows], weight[rows] = state.position, state.rotation, 1.0
                rotation_weight[rows] = _flight_rotation_weight((time[rows] - start) / (end - start))
        targets[name] = EffectorTarget(position, rotation, weight, rotation_weight)
    return targets


def _flight_rotation_weight(share: FloatArray) -> FloatArray:
    """Importance of the orientation during a flight: full at its ends, a hint in the middle.

    The ankle may then follow the shank, as a person's does.
    """
    near = np.minimum(share, 1.0 - share) / 0.25
    blend = np.clip(near, 0.0, 1.0)
    return 1.0 - (1.0 - FREE_ROTATION_WEIGHT) * blend**2 * (3.0 - 2.0 * blend)


FREE_ROTATION_WEIGHT = 0.002
"""Importance of an effector's orientation in the middle of a flight."""


def ignored_pairs(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray
) -> tuple[Ignored, ...]:
    """Segments that may touch an obstacle at each time: those on, leaving or reaching a support."""
    sequence = schedule.sequence
    touching = [
        {contact.effector: _touch(body, scene, contact) for contact in phase.stance} for phase in sequence
    ]
    per_phase = []
    for index in range(len(sequence)):
        pairs: set[tuple[str, str]] = set()
        for found in touching[index].values():
            pairs |= found
        per_phase.append(pairs)
    for swing in sequence.swings():
        for index in range(swing.first_phase, swing.last_phase + 1):
            for contact in (swing.start, swing.end):
                if contact is not None:
                    per_phase[index] |= _touch(body, scene, contact)
    return tuple(frozenset(per_phase[index]) for index in schedule.phase_at(time))


def _touch(body: BodyModel, scene: Scene, contact: Contact) -> set[tuple[str, str]]:
    obstacle = scene.supporting_surface(contact, tolerance=0.02).obstacle
    return {(segment, obstacle) for segment in end_segments(body, contact.effector)}


def end_segments(body: BodyModel, effector: str) -> tuple[str, ...]:
    """Segment of an effector and those that hang on it."""
    names = [body.effector(effector).segment]
    names.extend(segment.name for segment in body.segments if segment.parent in names)
    return tuple(names)


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
    "shoulder_flexion": np.deg2rad(20.0), "shoulder_abduction": np.deg2rad(25.0), "elbow_flexion": np.deg2rad(60.0),
}  # fmt: skip
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


def fit_motion(
    body: BodyModel,
    scene: Scene,
    trajectory: CentroidalTrajectory,
    swings: tuple[PlannedSwing, ...],
    settings: WholeBodySettings,
    start: ConfigurationSpline | None = None,
) -> FitResult:
    """Fit the whole-body spline to contacts, swings and centre of mass."""
    schedule = trajectory.schedule
    knots = phase_knots(schedule.instants, settings.knot_spacing, 5)
    time = sample_times(knots, settings.samples_per_span)
    reference = reference_motion(body, trajectory, time)
    targets = FitTargets(
        time=time,
        effectors=effector_targets(schedule, swings, time),
        com=trajectory.position(time),
        reference=reference,
        reference_scale=reference_scale(body),
        ignored=ignored_pairs(body, scene, schedule, time),
    )
    fit = MotionFit(body, Proximity(body, scene), targets, knots, 5, settings.fit)
    return fit.solve(start or fit.initial_spline(time, reference))
