"""Context, report and result of a run.

The stages work in the frame of the task (:mod:`manikin.scenarios.placement`); results are moved to the world
where they leave, in :class:`Report` and :class:`RunResult`.
"""

import re
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.ergonomics.load_report import ergonomics_in_short
from manikin.errors import ScenarioError
from manikin.motion import Motion
from manikin.motion.file import MotionFile, write_motions
from manikin.motion.naturalness import measure_naturalness
from manikin.motion.passage import measure_passage
from manikin.numerics.spatial import IDENTITY, PlanarTransform
from manikin.numerics.spline import BSpline
from manikin.pipeline.run_directory import CONTACT_PLAN, MOTION, SCENARIO, STAGES, SUMMARY, RunDirectory
from manikin.pipeline.stages.contact_guides import ContactSearch
from manikin.planning.com import CentroidalProblem, CentroidalResult, CentroidalTrajectory, KeyframeProblem
from manikin.planning.contacts import ContactPlan, Stage
from manikin.planning.whole_body import (
    FREE_HANDS,
    Handling,
    RefineResult,
    WholeBodyResult,
    WholeBodySettings,
)
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.planning.whole_body.refine import FittedParts
from manikin.runtime.parallel import Deadline
from manikin.runtime.requirement import RequirementTable
from manikin.scenarios import Scenario
from manikin.scenarios.found_supports import Pace
from manikin.scenarios.plausibility import check_plausible
from manikin.scene import Scene
from manikin.simulation import Execution, Recovery
from manikin.verification import PlannedContacts, PlannedStage

_PLACE = re.compile(r"\[(-?\d[\d.e+-]*(?:, -?\d[\d.e+-]*){1,2})\]")
"""A position as the stages write it into their reasons: two or three numbers in brackets."""


def motion_in_world(motion: Motion | None, transform_task_to_world: PlanarTransform) -> Motion | None:
    """A motion with its root, centre of mass, momentum and contact forces in the world; None of none."""
    transform = transform_task_to_world
    if motion is None or transform.is_identity:
        return motion
    forces = motion.contact_force.reshape(*motion.contact_force.shape[:-1], 2, 3)
    return replace(
        motion, q=transform.poses(motion.q), com=transform.points(motion.com),
        angular_momentum=transform.directions(motion.angular_momentum),
        contact_force=transform.directions(forces).reshape(motion.contact_force.shape),
    )  # fmt: skip


def trajectory_in_world(
    trajectory: CentroidalTrajectory, transform_task_to_world: PlanarTransform
) -> CentroidalTrajectory:
    """A trajectory of the centre of mass with its contacts in the world."""
    transform, spline, turning = transform_task_to_world, trajectory.spline, trajectory.turning
    if transform.is_identity:
        return trajectory
    return replace(
        trajectory,
        spline=BSpline(spline.degree, spline.knots, transform.points(spline.control_points)),
        schedule=trajectory.schedule.moved(transform),
        turning=None if turning is None
        else BSpline(turning.degree, turning.knots, transform.directions(turning.control_points)),
    )  # fmt: skip


def plan_in_world(plan: ContactPlan, transform_task_to_world: PlanarTransform) -> PlannedContacts:
    """A contact plan as other programs and the check read it, in the world."""
    transform = transform_task_to_world
    move = cache(lambda contact: contact.moved(transform))  # what several stages hold stays one
    stages = [
        PlannedStage(
            {name: move(contact) for name, contact in stage.contacts.items()},
            transform.poses(stage.q), transform.points(stage.com),
            via=None if stage.via is None else transform.poses(stage.via), duration=stage.min_duration,
            on_toes=frozenset(contact.effector for contact in stage.tilted),
        )
        for stage in plan.stages
    ]  # fmt: skip
    return PlannedContacts(tuple(stages), transform.poses(plan.goal), transform.points(plan.goal_com))


def reason_in_world(reason: str, transform_task_to_world: PlanarTransform) -> str:
    """A reason in one line with the positions in it, ``[1.2, 0.5]``, in the world; they keep their digits."""
    if transform_task_to_world.is_identity:
        return reason

    def moved(found: re.Match[str]) -> str:
        numbers = found[1].split(", ")
        digits = max(len(number.partition(".")[2]) for number in numbers)
        x, y = transform_task_to_world.points([float(number) for number in numbers[:2]])
        return f"[{', '.join([str(round(float(value), digits) + 0.0) for value in (x, y)] + numbers[2:])}]"

    return _PLACE.sub(moved, reason)


@dataclass(frozen=True, eq=False)
class Passing:
    """Way of a body through changes of contact, some of them without a rest.

    Attributes:
        asked: The scenario before supports were found.
        resting: The task with rests at all changes.
        paces: Of the stages of the contact plan.
        rolls: Whether its feet roll over heels and toes.
    """

    asked: Scenario
    resting: "RunContext"
    paces: tuple[Pace, ...]
    rolls: bool = True


@dataclass(frozen=True, eq=False)
class RunContext:
    """One job, in the frame of its task.

    Attributes:
        given: The scenario as it was given, in the world.
        transform_task_to_world: From the frame of the task to the world.
        scenario: With the supports that were found, where a file can list them.
        scene_in_world: The scene that was given.
        settings: Options of the whole-body stage.
        plan: The contacts that were found from start and goal, or None.
        search_again: Searches on for other contacts without the change of a phase, which failed for a reason.
        passing: How the body passes changes of contact without rests; None where it rests at all of them.
        start: Contacts and posture with which a motion before ended; None to find them.
        handling: What the hands do, and what the motion takes over from the one before.
        fitted: Parts of motions from rest to rest that were fitted for any plan of this job.
    """

    given: Scenario
    transform_task_to_world: PlanarTransform
    scenario: Scenario
    body: BodyModel
    scene: Scene
    scene_in_world: Scene
    settings: WholeBodySettings
    plan: ContactPlan | None = None
    search_again: Callable[[int, str], ContactSearch] | None = None
    passing: "Passing | None" = None
    start: Stage | None = None
    handling: Handling = FREE_HANDS
    fitted: FittedParts = field(default_factory=dict)

    def timed(self) -> "RunContext":
        """The same with the time limit of its scenario from now on."""
        deadline = Deadline.after(self.scenario.file.planning.time_limit_s)
        return replace(self, settings=replace(self.settings, deadline=deadline))

    @property
    def has_time(self) -> bool:
        """Whether something else may be tried."""
        return not self.settings.deadline.is_over

    @property
    def resting(self) -> "RunContext | None":
        """The task with rests at all changes of contact, where this one passes some without; or None."""
        return None if self.passing is None else self.passing.resting

    @classmethod
    def of(cls, scenario: Scenario, settings: WholeBodySettings | None = None) -> "RunContext":
        """Build what a scenario describes in the world, with supports or without, in the frame of its task.

        Raises:
            ScenarioError: If the body, the scene or the supports cannot be built.
        """
        settings = settings or WholeBodySettings(manner=posture_style_of(scenario.file.manner))
        body, scene = scenario.build_body(), scenario.build_scene()
        check_plausible(scenario, body, scene)
        if scenario.file.supports is not None:
            scenario.check_contacts(scene)
        transform, task = scenario.transform_task_to_world, scenario.in_task_frame()
        context = cls(scenario, transform, task, body, task.build_scene(), scene, settings)
        _ = context.problem  # now, so that a file with a fault is refused before anything is computed
        return context

    def with_supports(self, scenario: Scenario) -> "RunContext":
        """The same for a scenario of the task frame with supports, in its manner where that is another one.

        Raises:
            ScenarioError: If the supports do not fit the scene.
        """
        scenario.check_contacts(self.scene)
        settings, manner = self.settings, scenario.file.manner
        if manner != self.scenario.file.manner:
            settings = replace(settings, manner=posture_style_of(manner))
        return replace(self, scenario=scenario, settings=settings)

    @cached_property
    def problem(self) -> CentroidalProblem | KeyframeProblem | None:
        """What the centre of mass is planned for; None as long as there are no supports.

        It is posed when it is first asked for: of supports with and without rests mostly one is planned.

        Raises:
            ScenarioError: If a value of the supports is out of range.
        """
        if self.scenario.file.supports is None:
            return None
        try:
            return self.scenario.build_keyframe_problem() or self.scenario.build_centroidal_problem()
        except ScenarioError as error:
            raise ScenarioError(reason_in_world(str(error), self.transform_task_to_world)) from None

    @property
    def padded(self) -> tuple[str, ...]:
        """Names of the obstacles that any part of the body may lean on."""
        return self.scenario.padded

    def measured(self, schedule: ContactSchedule, motion: Motion) -> dict[str, Any]:
        """Lowest height of the body, distance of its head from the scene, and a person's naturalness."""
        passage = measure_passage(self.body, self.scene, schedule, motion, self.padded).summary()
        natural = measure_naturalness(self.body, motion)
        return {**passage, "naturalness": None if natural is None else natural.summary()}


Progress = Callable[[str, float], None]
"""Callback with the stage and the share of it that is done, in [0, 1]."""


@dataclass(frozen=True)
class StageFailure:
    """Reason in one line why a run ended without success.

    Attributes:
        stage: ``"contacts"``, ``"centroidal"``, ``"wholebody"``, ``"execution"`` or ``"push"``.
        time_s: When in the motion [s].
        where: Phase, contact, limb or pair.
    """

    stage: str
    reason: str
    time_s: float
    where: str


@dataclass(frozen=True, eq=False)
class _Reported:
    """What a report says of an attempt: its failure, how far it came, its tables, blocks and files."""

    failure: StageFailure
    planned: bool | None
    tables: dict[str, RequirementTable]
    blocks: dict[str, Any]
    files: dict[str, Callable[[RunDirectory], object]]


PLANNED_STAGES = ("centroidal", "wholebody", "act", "execution")
"""Stages that an attempt on given contacts goes through, in order."""


class Report:
    """Summary and files of one run; each is written as soon as it is known.

    Attributes:
        summary: As printed by ``manikin run --json``.
        progress: Called with the stage and the share of it that is done.
        failure: Why the run is no success so far, or None.
        planned: Whether a plan keeps every requirement of its certificate; None for a run without a plan.
        proved: Whether the body moved in the physics engine and kept every requirement.
        refused: Failures after which other contacts were tried: phase and failure of each.
        directory: The run directory, or None.
    """

    def __init__(
        self, context: RunContext, out: str | Path | None, progress: Progress | None, began: float
    ) -> None:
        """Open the run directory ``out``, or none, for a run that ``began`` by ``time.perf_counter`` [s].

        Raises:
            MotionFileError: If the directory cannot be made, or holds something that is not a run.
        """
        self._context, self._began = context, began
        self.progress: Progress = progress or (lambda _stage, _share: None)
        self.failure: StageFailure | None = None
        self.planned: bool | None = False
        self.proved = False
        self.refused: list[dict[str, Any]] = []
        self._tables: dict[str, RequirementTable] = {}
        self._files: dict[str, Callable[[RunDirectory], object]] = {}
        self._before: _Reported | None = None
        self._schedule: ContactSchedule | None = None
        self.directory = None if out is None else RunDirectory(out)
        scenario = context.given
        self._write(SCENARIO, lambda directory: directory.write(SCENARIO, scenario.to_yaml()))
        stature = None if scenario.is_point_mass else context.body.stature
        self.summary: dict[str, Any] = {
            "scenario": scenario.name, "stature_m": stature, "mass_kg": scenario.mass, "seed": scenario.seed,
            "verdict": "failed", "planned": False, "proved": False, "succeeded": False, "failure": None,
            "requirements": [], "contacts": None, "centroidal": None, "wholebody": None, "act": None,
            "operations": None, "execution": None, "trials": None, "push": None, "walk": None,
            "ergonomics": None, "wall_s": 0.0,
        }  # fmt: skip

    @property
    def transform(self) -> PlanarTransform:
        """Transform from the frame of the task to the world; results are kept in the world."""
        return self._context.transform_task_to_world

    @property
    def path(self) -> Path | None:
        """The run directory, or None."""
        return None if self.directory is None else self.directory.path

    def fail(self, stage: str, reason: str, time: float = 0.0, where: str = "") -> None:
        """Say why the run is no success; positions in the reason, in the task's frame, move to the world."""
        self.failure = StageFailure(stage, reason_in_world(reason, self.transform), float(time), where)

    def tell_end_of_time(self) -> None:
        """Add to a failure that the time limit of the run let nothing else be tried."""
        if self.failure is not None:
            limit = f"planning.time_limit_s: {self._context.scenario.file.planning.time_limit_s:g}"
            reason = f"{self.failure.reason}; no time was left to try anything else ({limit})"
            self.failure = replace(self.failure, reason=reason)

    def try_again(self, phase: int | None = None) -> None:
        """Begin again after a failure, which is kept among the refused with the phase it was traced to."""
        if self.failure is not None:
            blocks = {stage: self.summary[stage] for stage in PLANNED_STAGES}
            self._before = _Reported(self.failure, self.planned, self._tables, blocks, dict(self._files))
            self.refused.append({"phase": phase, **asdict(self.failure)})
        self.failure, self.planned, self.proved = None, False, False
        self._tables = {}
        self.summary |= dict.fromkeys(PLANNED_STAGES)

    def prefer_earlier(self) -> bool:
        """Report the attempt before the last beginning, where the run has not come as far since.

        Returns:
            Whether it did: failure, blocks, requirements and files are again those of that attempt.
        """
        now, before, order = self.failure, self._before, ("contacts", *PLANNED_STAGES)
        if now is None or before is None or order.index(now.stage) >= order.index(before.failure.stage):
            return False
        self.failure = replace(before.failure, reason=f"{before.failure.reason}; tried again: {now.reason}")
        self.planned, self._tables = before.planned, before.tables
        self.summary |= before.blocks
        self.refused.pop()
        for name, write in before.files.items():
            self._write(name, write)
        return True

    def require(self, stage: str, table: RequirementTable) -> None:
        """Take the requirements of a stage's result into the summary, in place of earlier ones."""
        self._tables[stage] = table

    def table(self, stage: str) -> RequirementTable:
        """Requirements of a stage's result; empty where there are none."""
        return self._tables.get(stage, RequirementTable(()))

    def finish(self, stage: str, block: Mapping[str, Any]) -> None:
        """Take a stage's block into the summary, and keep it."""
        self.summary[stage] = dict(block)
        self.keep(stage, block)

    def keep(self, name: str, result: Mapping[str, Any]) -> None:
        """Keep what a stage found among the files of the run."""
        file = f"{STAGES}/{name}.json"
        self._write(file, lambda directory: directory.write(file, result))

    def judge_ergonomics(self, motion: Motion | None) -> None:
        """Take the scores and loads of a person's last motion into the summary, in short.

        Not of one operation of several: the whole motion is judged.
        """
        judged = not self._context.scenario.is_point_mass and self._context.handling is FREE_HANDS
        if motion is not None and judged:
            self.summary["ergonomics"] = ergonomics_in_short(self._context.body, motion, self._schedule)

    def keep_scenario(self, scenario: Scenario) -> None:
        """Keep a scenario of the task frame with the supports that were found, in the world."""
        text = scenario.from_task_frame(self.transform).to_yaml()
        self._write(SCENARIO, lambda directory: directory.write(SCENARIO, text))

    def keep_contact_plan(self, plan: ContactPlan) -> None:
        """Keep a contact plan of the task frame as a contact-plan file, in the world."""
        if self.directory is not None:
            known = plan_in_world(plan, self.transform)
            self.directory.write(CONTACT_PLAN, known.to_dict(self._context.body, self._context.given))

    def keep_motions(
        self, schedule: ContactSchedule, planned: Motion | None, executed: Motion | None = None,
        file: str = MOTION,
    ) -> None:  # fmt: skip
        """Keep the motions that there are so far, moved to the world, in a file of the run directory."""
        if file == MOTION:
            self._schedule = schedule
        if self.directory is None:
            return
        transform = self.transform
        content = MotionFile(
            motion_in_world(planned, transform), motion_in_world(executed, transform), self._context.body,
            self._context.scene_in_world, schedule.moved(transform),
        )  # fmt: skip
        self._write(file, lambda directory: write_motions(directory.path / file, content))

    def _write(self, file: str, write: Callable[[RunDirectory], object]) -> None:
        if self.directory is not None:
            self._files[file] = write
            write(self.directory)

    def close(self) -> dict[str, Any]:
        """Complete the summary, write it and return it."""
        self.judge()
        failure, required = self.failure, self._context.scenario.execution_required
        word = "failed" if failure is not None else "proved" if required else "planned"
        rows = [row.as_dict(stage) for stage, table in self._tables.items() for row in table]
        self.summary |= {
            "verdict": word, "planned": self.planned, "proved": self.proved, "succeeded": failure is None,
            "failure": None if failure is None else asdict(failure), "requirements": rows,
            "wall_s": clock.perf_counter() - self._began,
        }  # fmt: skip
        if self.directory is not None:
            self.directory.write(SUMMARY, self.summary)
        return self.summary

    def judge_requirements(self) -> None:
        """A run that broke a requirement has failed."""
        for stage, table in self._tables.items():
            if self.failure is None and (broken := table.first_broken) is not None:
                self.fail(stage, broken.reason, broken.time_s or 0.0, broken.where)

    def judge(self) -> None:
        """A run that broke a requirement, or did not come to what was asked for, has failed."""
        self.judge_requirements()
        required = self._context.scenario.execution_required
        if self.failure is None and not (self.proved if required else self.planned):
            stage = "execution" if required else "wholebody"
            self.fail(stage, "the motion was not executed" if required else "there is no plan")


def place(phase: int | None, where: str) -> str:
    """Place of a failure in words: a phase with its contacts, or what is known of both."""
    return where if phase is None else f"phase {phase}" + (f" on {where}" if where else "")


@dataclass(frozen=True, eq=False)
class RunResult:
    """Outcome of one run.

    Attributes:
        summary: As printed by ``manikin run --json``.
        planned: Planned whole-body motion, or that of a point mass, in the world; None when there is none.
        executed: Executed motion in the world, or None.
        centroidal, wholebody, execution, recovery: Results of the stages, in the frame of the task; None of
            those that there were not.
        directory: Where the files are, or None.
        transform_task_to_world: From the frame of the task to the world.
        claim: Keeps other processes out of the directory while the result is there.
    """

    summary: dict[str, Any]
    planned: Motion | None
    executed: Motion | None
    centroidal: CentroidalResult | None
    wholebody: WholeBodyResult | RefineResult | None
    execution: Execution | None
    directory: Path | None
    recovery: Recovery | None = None
    transform_task_to_world: PlanarTransform = IDENTITY
    claim: RunDirectory | None = None

    @classmethod
    def of(
        cls, report: Report, centroidal: CentroidalResult | None = None,
        wholebody: WholeBodyResult | RefineResult | None = None, execution: Execution | None = None, *,
        planned: Motion | None = None, recovery: Recovery | None = None,
    ) -> "RunResult":  # fmt: skip
        """Close the report of a run and gather what its stages returned.

        Args:
            planned: The planned motion, where no whole body was planned.
        """
        executed = execution.motion if execution is not None else None
        if recovery is not None:
            executed = recovery.trace.motion
        planned = planned if wholebody is None else wholebody.motion
        planned, executed = (motion_in_world(item, report.transform) for item in (planned, executed))
        stages = centroidal, wholebody, execution, report.path, recovery
        report.judge_ergonomics(executed if executed is not None else planned)
        return cls(report.close(), planned, executed, *stages, report.transform, report.directory)

    @property
    def succeeded(self) -> bool:
        """Whether what the scenario asks for is proved, or for ``execution: none`` planned."""
        return bool(self.summary["succeeded"])

    @property
    def verdict(self) -> str:
        """``"proved"``, ``"planned"`` (a planned-only job that succeeded) or ``"failed"``."""
        return str(self.summary["verdict"])

    @property
    def motion(self) -> Motion | None:
        """The executed motion, or else the planned one."""
        return self.executed if self.executed is not None else self.planned
