"""The pipeline: scenario, centre of mass, whole body, execution, report.

Each stage reads the one before it and its result is written as soon as it is known, so that
nothing already computed is lost.  A stage that finds nothing ends the run with an
explanation; only misuse and broken input raise.
"""

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from manikin.act_stage import ActStage, act_of
from manikin.acting import PlannedAct
from manikin.balance import pseudo_wrench
from manikin.body import BodyModel
from manikin.centroidal import (
    CentroidalResult,
    CentroidalTrajectory,
    KeyframeResult,
    plan_com,
    plan_com_through_key_frames,
)
from manikin.contact import ContactSchedule, StanceSequence
from manikin.contact_planning import ContactPlan
from manikin.contact_search import find_supports
from manikin.control import ControlSettings, SupportSettings
from manikin.errors import ScenarioError
from manikin.motion import Motion
from manikin.motion.file import MotionFile, write_motions
from manikin.output import MOTION, RunDirectory
from manikin.refinement import KeyedContacts, refined_summary
from manikin.scenarios import Scenario, load_scenario
from manikin.scenarios.contacts import BODY_WEIGHTS_CAP
from manikin.scene import Scene
from manikin.simulation import Execution, Push, execute
from manikin.spatial import GRAVITY, FloatArray, rotation_from_yaw
from manikin.wholebody import (
    Eligibility,
    KeyPostures,
    RefineResult,
    WholeBodyResult,
    WholeBodySettings,
    continue_seated,
    find_eligible_plan,
    find_key_postures,
    measure_passage,
    plan_whole_body,
    refine_motion,
)
from manikin.wholebody.configuration_spline import rotation_from_quaternion
from manikin.wholebody.manner import manner_of
from manikin.wholebody.point_mass import point_mass_motion

KEY_ROOM = 0.5
"""Share of the fit's distance from the ends of the joint ranges that key postures keep."""

KEY_TOLERANCES = (1.0e-3, 2.0e-4)
"""How exact key postures are [m]: as exact as the finished motion has to be; and more, where no motion is
found although each posture was just within reach."""

Progress = Callable[[str, float], None]
"""Told the stage and the share of it that is done, in [0, 1]."""

PUSHED_SEGMENT = "thorax"
"""Segment on whose centre of mass the scenario's push acts."""


@dataclass(frozen=True)
class ExecutionRequirements:
    """What an executed motion must keep to count as a success.

    Attributes:
        com_rms_error: Root mean square distance of the CoM from its plan [m].
        foot_error: Largest distance of an effector from its plan [m].
        margin: Least margin, exclusive [N.m].
        penetration: Deepest penetration of hard contacts [m]; ``padding_compression`` where the motion
            ends on a seat, whose impact shakes every contact.
        padding_compression: Deepest one of padded obstacles, which give way [m].
    """

    com_rms_error: float = 0.015
    foot_error: float = 0.02
    margin: float = 0.0
    penetration: float = 0.005
    padding_compression: float = 0.01

    def violation(self, execution: Execution, seated: bool = False) -> tuple[str, float] | None:
        """Explain the first requirement that is not kept, with a time [s], or None.

        Where what was measured does not say when, the time is that of the least margin.

        Args:
            execution: What happened.
            seated: Whether the motion ends on a seat.
        """
        penetration = self.padding_compression if seated else self.penetration
        thinnest = float(execution.motion.time[int(np.argmin(execution.motion.margin))])
        if execution.min_margin <= self.margin:
            return (
                f"executed margin falls to {execution.min_margin:.2f} N.m; allowed > {self.margin:g}",
                thinnest,
            )
        effector = f"error of {execution.worst_effector}"
        for value, limit, what, time in (
            (execution.com_rms_error_m, self.com_rms_error, "RMS error of the centre of mass", thinnest),
            (execution.max_foot_error_m, self.foot_error, effector, execution.worst_effector_time_s),
            (execution.max_penetration_m, penetration, "penetration", thinnest),
            (
                execution.max_padding_compression_m,
                self.padding_compression,
                "compression of padding",
                thinnest,
            ),
        ):
            if value > limit:
                return f"{what} is {value:.4f} m; allowed {limit:g} m", time
        return None


@dataclass(frozen=True)
class Failure:
    """Why a run ended without success.

    Attributes:
        stage: ``"contacts"``, ``"centroidal"``, ``"wholebody"`` or ``"execution"``.
        reason: In one line.
        time_s: When in the motion [s].
        where: Phase, contact, limb or pair.
    """

    stage: str
    reason: str
    time_s: float
    where: str

    def as_dict(self) -> dict[str, Any]:
        """Return the ``failure`` block of the summary."""
        return {"stage": self.stage, "reason": self.reason, "time_s": self.time_s, "where": self.where}


@dataclass(frozen=True, eq=False)
class RunResult:
    """Outcome of one run.

    Attributes:
        summary: As printed by ``manikin run --json``.
        planned: Planned whole-body motion, or that of a point mass; None when there is none.
        executed: Executed motion, or None.
        centroidal: Result of the centre-of-mass stage, or None where there was none.
        wholebody: Result of the whole-body stage, or None.
        execution: Result of the execution, or None.
        directory: Where the files are, or None.
    """

    summary: dict[str, Any]
    planned: Motion | None
    executed: Motion | None
    centroidal: CentroidalResult | None
    wholebody: WholeBodyResult | RefineResult | None
    execution: Execution | None
    directory: Path | None

    @property
    def succeeded(self) -> bool:
        """Whether every stage met its requirements; an execution only where the scenario requires it."""
        return bool(self.summary["succeeded"])

    @property
    def motion(self) -> Motion | None:
        """The executed motion, or else the planned one."""
        return self.executed if self.executed is not None else self.planned


def run(
    scenario: str | Path | Scenario,
    *,
    variant: str | None = None,
    overrides: Sequence[str] = (),
    out: str | Path | None = None,
    seed: int | None = None,
    settings: WholeBodySettings | None = None,
    requirements: ExecutionRequirements | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Plan a scenario, execute it in the physics engine and report.

    Args:
        scenario: Name of a built-in scenario, a scenario file, or a scenario.
        variant: Name of one of the scenario's variants.
        overrides: Values to set, ``"supports.friction=0.5"`` each.
        out: Run directory; nothing is written when omitted.
        seed: Seed of every random choice; the scenario's own when omitted.
        settings: Options of the whole-body stage; the defaults in the scenario's manner when omitted.
        requirements: What the execution must keep.
        progress: Called with the stage and the share of it that is done.

    Returns:
        The result; an infeasible task is a result with ``succeeded`` False.

    Raises:
        InputError: If the scenario, or a file it names, is not usable.
    """
    job = _job(scenario, variant, overrides)
    if seed is not None:
        job = job.with_seed(seed)
    # Threads make the many small products slower, and the last bits depend on their number.
    with threadpool_limits(1):
        return _Run(job, out, settings, requirements or ExecutionRequirements(), progress).run()


def _job(scenario: str | Path | Scenario, variant: str | None, overrides: Sequence[str]) -> Scenario:
    if not isinstance(scenario, Scenario):
        return load_scenario(str(scenario), variant, overrides)
    if variant is not None:
        raise ScenarioError(
            f"variant {variant!r} is given beside a scenario that is already loaded; valid: its name or file"
        )
    return scenario.with_overrides(overrides)


class _Run:
    """One job, with what its stages share."""

    def __init__(
        self,
        scenario: Scenario,
        out: str | Path | None,
        settings: WholeBodySettings | None,
        requirements: ExecutionRequirements,
        progress: Progress | None,
    ) -> None:
        self._began = clock.perf_counter()
        self._scenario, self._requirements = scenario, requirements
        self._settings = settings or WholeBodySettings(manner=manner_of(scenario.manner))
        self._progress = progress or _silent
        self._plan: ContactPlan | None = None
        self._acting: PlannedAct | None = None
        self._body: BodyModel = scenario.build_body()
        self._scene: Scene = scenario.build_scene()
        if scenario.file.supports is not None:
            self._take_scenario(scenario)
        self._directory = None if out is None else RunDirectory(out)
        if self._directory is not None:
            self._directory.write_scenario(scenario.to_yaml())
        stature = None if scenario.is_point_mass else self._body.stature
        self._summary: dict[str, Any] = {
            "scenario": scenario.name, "stature_m": stature, "mass_kg": scenario.mass, "seed": scenario.seed,
            "succeeded": False, "failure": None,
            "contacts": None, "centroidal": None, "wholebody": None, "act": None, "execution": None,
            "wall_s": 0.0,
        }  # fmt: skip

    def run(self) -> RunResult:
        if self._scenario.file.supports is None and not self._find_contacts():
            return self._result(None, None, None, None)
        if self._scenario.refines:
            return self._run_refined()
        centroidal = self._plan_com()
        if self._scenario.is_point_mass:
            return self._result(centroidal, self._move_point_mass(centroidal), None, None)
        planned, found = centroidal, self._test_key_postures(centroidal, KEY_TOLERANCES[0])
        centroidal, trajectory = self._take(planned, found)
        wholebody = None if trajectory is None else self._plan_whole_body(trajectory, _postures(found))
        if wholebody is not None and not wholebody.succeeded:
            other = self._stricter_plan(planned, found)
            if other is not None:
                centroidal, trajectory = self._take(planned, other)
                wholebody = None if trajectory is None else self._plan_whole_body(trajectory, other.postures)
        execution = None
        if trajectory is not None and wholebody is not None and wholebody.succeeded:
            motion, schedule = self._act(wholebody.motion, trajectory.schedule)
            wholebody = replace(wholebody, motion=motion)
            if self._summary["failure"] is None:
                execution = self._execute(schedule, motion)
        return self._result(centroidal, None if wholebody is None else wholebody.motion, wholebody, execution)

    def _run_refined(self) -> RunResult:
        centroidal, keyed = None, None
        if self._plan is not None:
            cap = BODY_WEIGHTS_CAP * self._scenario.mass * GRAVITY
            keyed = KeyedContacts.of_plan(self._plan, cap)
        else:
            planned = self._plan_com()
            found = self._test_key_postures(planned, KEY_TOLERANCES[0])
            centroidal, trajectory = self._take(planned, found)
            if trajectory is not None and found is not None and found.postures is not None:
                keyed = KeyedContacts.of_postures(trajectory.schedule, found.postures)
        if keyed is None:
            return self._result(centroidal, None, None, None)
        refined, execution = self._refine(keyed), None
        if refined.succeeded:
            execution = self._execute(refined.schedule, refined.motion)
        return self._result(centroidal, refined.motion, refined, execution)

    @property
    def _known_postures(self) -> FloatArray | None:
        return None if self._plan is None else self._plan.postures

    def _take_scenario(self, scenario: Scenario) -> None:
        """Pose the problem of a scenario with supports."""
        scenario.check_contacts(self._scene)
        self._scenario = scenario
        self._problem = scenario.build_centroidal_problem()
        self._keyframes = scenario.build_keyframe_problem()

    def _find_contacts(self) -> bool:
        """Plan the supports of a scenario that lists none, and go on with them; False without any."""
        if self._scenario.contact_limbs is not None and not self._scenario.refines:
            raise self._scenario.error(
                ("wholebody", "method"), "is follow; valid: refine, for contacts of any limbs"
            )
        self._progress("contacts", 0.0)
        rng = np.random.default_rng(self._scenario.seed)
        found = find_supports(self._scenario, self._body, self._scene, rng)
        self._summary["contacts"] = dict(found.summary)
        if self._directory is not None:
            self._directory.write_stage("contacts", found.to_dict())
        if found.plan is None:
            self._fail("contacts", found.failure or "", 0.0, found.where)
            return False
        self._plan = found.plan
        if not self._scenario.refines and found.scenario is not None:
            self._take_scenario(found.scenario)
            if self._directory is not None:
                self._directory.write_scenario(found.scenario.to_yaml())
        self._progress("contacts", 1.0)
        return True

    def _result(
        self,
        centroidal: CentroidalResult | None,
        planned: Motion | None,
        wholebody: WholeBodyResult | RefineResult | None,
        execution: Execution | None,
    ) -> RunResult:
        self._summary["succeeded"] = self._summary["failure"] is None
        self._summary["wall_s"] = clock.perf_counter() - self._began
        if self._directory is not None:
            self._directory.write_summary(self._summary)
        return RunResult(
            summary=self._summary,
            planned=planned,
            executed=None if execution is None else execution.motion,
            centroidal=centroidal,
            wholebody=wholebody,
            execution=execution,
            directory=None if self._directory is None else self._directory.path,
        )

    def _plan_com(self) -> CentroidalResult:
        self._progress("centroidal", 0.0)
        keyframes = self._keyframes
        result = plan_com(self._problem) if keyframes is None else plan_com_through_key_frames(keyframes)
        self._finish("centroidal", centroidal_summary(result))
        if result.failure is not None:
            failure = result.failure
            self._fail(
                "centroidal", failure.reason, failure.time or 0.0, _place(failure.phase, failure.where)
            )
        self._keep_trajectory(result)
        self._progress("centroidal", 1.0)
        return result

    def _keep_trajectory(self, result: CentroidalResult) -> None:
        if self._directory is not None and result.trajectory is not None:
            self._directory.write_stage("com_trajectory", result.trajectory.to_dict())

    def _test_key_postures(self, planned: CentroidalResult, tolerance: float) -> Eligibility | None:
        """The plan, or another one where a key posture fails; None where there is no plan."""
        if planned.trajectory is None:
            return None
        # The fit keeps its distance from the ends of the ranges: the key postures leave room for that,
        # if they can.
        found = self._eligible(planned, KEY_ROOM * self._settings.fit.joint_buffer, tolerance)
        if found.failure is not None or (found.trajectory is None and found.replans > 0):
            self._summary["failure"] = None  # of a seated part that did not fit another plan
            found = self._eligible(planned, 0.0, tolerance)
        return found

    def _stricter_plan(self, planned: CentroidalResult, before: Eligibility | None) -> Eligibility | None:
        """Another plan where no motion was found and a key posture is only just within reach, or None."""
        failure = self._summary["failure"]
        found = self._test_key_postures(planned, KEY_TOLERANCES[1])
        replans = 0 if before is None else before.replans
        if found is None or found.failure is not None or found.trajectory is None or found.replans <= replans:
            self._summary["failure"] = failure
            return None
        self._summary["failure"] = None
        return found

    def _take(
        self, planned: CentroidalResult, found: Eligibility | None
    ) -> tuple[CentroidalResult, CentroidalTrajectory | None]:
        """Report a plan that was tested, and return it with its trajectory if it can be done."""
        if found is None:
            return planned, None
        block = centroidal_summary(found.centroidal) | {
            "replans": found.replans,
            "key_postures": None if found.postures is None else found.postures.summary(),
        }
        self._finish("centroidal", block)
        self._keep_trajectory(found.centroidal)
        if self._directory is not None and found.postures is not None:
            self._directory.write_stage("key_postures", found.postures.to_dict())
        if found.failure is None:
            return found.centroidal, found.trajectory
        posture = found.failure.posture
        place = _place(posture.phase, ", ".join(posture.contacts))
        self._fail(found.failure.stage, found.failure.reason, posture.time, place)
        return found.centroidal, None

    def _eligible(self, planned: CentroidalResult, range_margin: float, tolerance: float) -> Eligibility:
        """Test the key postures of a plan, and plan again where they fail."""

        def look(trajectory: CentroidalTrajectory) -> KeyPostures:
            return find_key_postures(
                self._body, self._scene, trajectory, manner=self._settings.manner,
                requirements=self._settings.requirements, range_margin=range_margin,
                tolerance=tolerance, known=self._known_postures,
                padded=() if self._plan is None else self._scenario.padded,
            )  # fmt: skip

        return find_eligible_plan(planned, self._on_real_supports, look, replan=self._keyframes is None)

    def _on_real_supports(self, planned: CentroidalTrajectory) -> CentroidalTrajectory | None:
        """The plan on the real soles, friction and caps, with the seated part where there is one."""
        real, seat = self._scenario.build_sequence(), self._scenario.seated_from
        standing = real if seat is None else StanceSequence(real.phases[:seat])
        trajectory = replace(planned, schedule=ContactSchedule(standing, planned.schedule.instants))
        if seat is None:
            return trajectory
        continuation = continue_seated(
            self._body, self._scene, trajectory, StanceSequence(real.phases[seat:])
        )
        if continuation.failure is not None:
            self._fail("wholebody", continuation.failure, trajectory.duration, f"phase {seat}")
        return continuation.trajectory

    def _move_point_mass(self, centroidal: CentroidalResult) -> Motion | None:
        """Motion of a body that has no joints to plan for and nothing to execute."""
        if centroidal.trajectory is None:
            return None
        motion = point_mass_motion(centroidal.problem, centroidal.trajectory, centroidal.polytopes)
        self._keep_motions(centroidal.trajectory.schedule, motion, None)
        return motion

    def _plan_whole_body(
        self, trajectory: CentroidalTrajectory, waypoints: KeyPostures | None
    ) -> WholeBodyResult:
        rng = np.random.default_rng(self._scenario.seed)
        unused = rng.bit_generator.state
        result = plan_whole_body(
            self._body, self._scene, trajectory, rng=rng, settings=self._settings,
            padded=self._scenario.padded, key_postures=self._known_postures, waypoints=waypoints,
            progress=lambda share: self._progress("wholebody", share),
        )  # fmt: skip
        drawn = rng.bit_generator.state != unused
        block = wholebody_summary(result) | self._passage(trajectory.schedule, result.motion)
        self._finish("wholebody", block | {"seed_matters": drawn})
        if result.failure is not None:
            self._fail("wholebody", result.failure.reason, result.failure.time, result.failure.where)
        self._keep_motions(trajectory.schedule, result.motion, None)
        return result

    def _refine(self, keyed: KeyedContacts) -> RefineResult:
        keyed = keyed.at_pace(self._scenario.pace)
        keyed = keyed.with_lifted_feet(self._body, self._scene, self._scenario.padded)
        result = refine_motion(
            self._body, self._scene, keyed.time, keyed.q, keyed.schedule,
            padded=self._scenario.padded, progress=lambda share: self._progress("wholebody", share),
        )  # fmt: skip
        block = refined_summary(result) | self._passage(result.schedule, result.motion)
        self._finish("wholebody", block | {"seed_matters": self._plan is not None})
        if result.failure is not None:
            self._fail("wholebody", result.failure.reason, result.failure.time, result.failure.where)
        self._keep_motions(result.schedule, result.motion, None)
        return result

    def _act_stage(self) -> ActStage | None:
        act = act_of(self._scenario)
        return None if act is None else ActStage(self._scenario, self._body, act)

    def _act(self, motion: Motion, schedule: ContactSchedule) -> tuple[Motion, ContactSchedule]:
        """A motion and its contacts with the scenario's act at the end; without one, as they are."""
        stage = self._act_stage()
        if stage is None:
            return motion, schedule
        found = stage.plan(motion, schedule)
        self._finish("act", found.summary)
        if found.planned is None:
            self._fail("wholebody", found.failure or "", float(motion.time[-1]), stage.act.obstacle)
            return motion, schedule
        self._acting = found.planned
        self._keep_motions(found.planned.schedule, found.planned.motion, None)
        return found.planned.motion, found.planned.schedule

    def _act_failure(self, result: Execution) -> Failure | None:
        """Add what was exerted to the report; a failure where it is too little or too much."""
        stage, planned = self._act_stage(), self._acting
        if stage is None or planned is None:
            return None
        found = stage.measure(result.motion, planned)
        self._finish("act", self._summary["act"] | found.summary)
        if found.failure is None:
            return None
        return Failure("execution", found.failure, planned.timing.end, stage.act.obstacle)

    def _execute(self, schedule: ContactSchedule, planned: Motion) -> Execution:
        acting = self._acting
        result = execute(
            self._body, self._scene, planned, schedule, pushes=self._pushes(planned),
            padded=self._scenario.padded, settings=self._control_settings(),
            wishes=() if acting is None else acting.wishes,
            progress=lambda share: self._progress("execution", share),
        )  # fmt: skip
        failure = self._execution_failure(schedule, result)
        exerted = self._act_failure(result)
        failure = exerted if failure is None else failure
        required = self._scenario.execution_required
        block = {
            "required": required,
            "failure": None if failure is None else failure.as_dict(),
            **result.summary(),
            **self._passage(schedule, result.motion),
        }
        self._finish("execution", block)
        if failure is not None and required:
            self._summary["failure"] = failure.as_dict()
        self._keep_motions(schedule, planned, result.motion)
        return result

    def _execution_failure(self, schedule: ContactSchedule, result: Execution) -> Failure | None:
        broken = self._requirements.violation(result, self._scenario.seated_from is not None)
        if result.failure:
            broken = result.failure, float(result.failure_time_s or 0.0)
        if broken is None:
            return None
        reason, time = broken
        phase = int(schedule.phase_at(time))
        held = ", ".join(schedule.sequence[phase].stance.effectors)
        return Failure("execution", reason, time, _place(phase, held))

    def _passage(self, schedule: ContactSchedule, motion: Motion) -> dict[str, float | None]:
        """How low the body came, and how near its head to the scene."""
        return measure_passage(self._body, self._scene, schedule, motion, self._scenario.padded).summary()

    def _control_settings(self) -> ControlSettings:
        """The defaults; with the share of the friction that planning keeps to where it has its own."""
        return ControlSettings(supports=SupportSettings(friction_share=self._scenario.friction_share))

    def _pushes(self, motion: Motion) -> tuple[Push, ...]:
        push = self._scenario.push
        if push is None:
            return ()
        self._scenario.check_push(float(motion.time[-1]))
        sample = min(int(np.searchsorted(motion.time, push.at_s)), len(motion.time) - 1)
        forward = rotation_from_quaternion(motion.q[sample : sample + 1, 3:7])[0][:, 0]
        heading = float(np.arctan2(forward[1], forward[0]))
        direction = rotation_from_yaw(heading + np.deg2rad(push.direction_deg))[:, 0]
        return (Push(PUSHED_SEGMENT, push.force_N * direction, push.at_s, push.duration_s),)

    def _finish(self, stage: str, block: dict[str, Any]) -> None:
        self._summary[stage] = block
        if self._directory is not None:
            self._directory.write_stage(stage, block)

    def _fail(self, stage: str, reason: str, time: float, where: str) -> None:
        self._summary["failure"] = Failure(stage, reason, float(time), where).as_dict()

    def _keep_motions(self, schedule: ContactSchedule, planned: Motion, executed: Motion | None) -> None:
        if self._directory is not None:
            content = MotionFile(planned, executed, self._body, self._scene, schedule)
            write_motions(self._directory.path / MOTION, content)


def centroidal_summary(result: CentroidalResult) -> dict[str, Any]:
    """Return the ``centroidal`` block of the summary."""
    trajectory = result.trajectory
    recorded = isinstance(result, KeyframeResult)
    return {
        "method": "keyframes" if recorded else "timing-free",
        "added_key_frames_s": sorted(result.added_times) if recorded else None,
        "duration_s": None if trajectory is None else trajectory.duration,
        "phase_durations_s": None if trajectory is None else trajectory.schedule.durations.tolist(),
        "min_margin": result.d_min,
        "margin_unit": result.problem.margin_unit,
        "limiting_phase": result.limiting_phase,
        "limiting_contact": limiting_contact(result),
        "min_zmp_distance_m": None if result.certificate is None else result.certificate.min_zmp_distance,
        "feasibility_radius": result.feasibility_radius,
        "replans": 0,
        "key_postures": None,
        "wall_s": result.wall_time,
    }


def limiting_contact(result: CentroidalResult) -> str | None:
    """Contact and limit behind the smallest margin, such as ``"left_foot: tipping over ..."``."""
    certificate, trajectory = result.certificate, result.trajectory
    if certificate is None or trajectory is None:
        return None
    time = certificate.limiting_time
    wrench = pseudo_wrench(result.problem.mass, trajectory.position(time), trajectory.acceleration(time))
    return result.polytopes[certificate.limiting_phase].limiting(wrench).description


def wholebody_summary(result: WholeBodyResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary."""
    certificate = result.certificate
    return {
        "method": "follow",
        "max_support_error_m": certificate.max_support_error_m,
        "max_meeting_error_m": certificate.max_meeting_error_m,
        "max_com_error_m": certificate.max_com_error_m,
        "min_clearance_m": certificate.min_clearance_m,
        "closest_pair": list(certificate.closest_pair),
        "max_scuff_m": certificate.max_scuff_m,
        "max_joint_limit_violation_rad": certificate.max_joint_limit_violation_rad,
        "max_velocity_share": certificate.max_velocity_share,
        "max_torque_share": certificate.max_torque_share,
        "min_margin": float(result.motion.margin.min()),
        "min_zmp_distance_m": certificate.min_zmp_distance_m,
        "swings": [{"effector": s.swing.effector, "method": s.method} for s in result.swings],
        "wall_s": result.wall_time,
    }


def _postures(found: Eligibility | None) -> KeyPostures | None:
    return None if found is None else found.postures


def _place(phase: int | None, where: str) -> str:
    return where if phase is None else f"phase {phase}" + (f" on {where}" if where else "")


def _silent(stage: str, share: float) -> None:
    """Report progress to nobody."""
