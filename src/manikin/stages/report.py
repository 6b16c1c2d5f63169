"""What a run reports: its summary and verdict, the files of its directory, its progress.

The stages work in the frame of the task; what leaves through here is in the world.
"""

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.file import MotionFile, write_motions
from manikin.output import MOTION, RunDirectory, other_motion
from manikin.requirement import RequirementTable
from manikin.scenarios import Scenario
from manikin.spatial import PlanarTransform
from manikin.stages.context import RunContext
from manikin.stages.world_frame import motion_in_world, reason_in_world, schedule_in_world

Progress = Callable[[str, float], None]
"""Told the stage and the share of it that is done, in [0, 1]."""


@dataclass(frozen=True)
class Failure:
    """Why a run ended without success.

    Attributes:
        stage: ``"contacts"``, ``"centroidal"``, ``"wholebody"``, ``"execution"`` or ``"push"``.
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


class Report:
    """Summary and files of one run; each is written as soon as it is known.

    Attributes:
        summary: As printed by ``manikin run --json``.
        progress: Called with the stage and the share of it that is done.
        failure: Why the run is no success so far, or None.
        planned: Whether a plan keeps every requirement of its certificate; None for a run without a plan.
        proved: Whether the body moved in the physics engine and kept every requirement.
    """

    def __init__(
        self, context: RunContext, out: str | Path | None, progress: Progress | None, began: float
    ) -> None:
        """Open the run directory.

        Args:
            context: What is run.
            out: Run directory; nothing is written when None.
            progress: Told how far the run is, or None.
            began: Reading of ``time.perf_counter`` when the run began [s].

        Raises:
            MotionFileError: If the directory cannot be made, or holds something that is not a run.
        """
        self._context, self._began = context, began
        self.progress = progress or _silent
        self.failure: Failure | None = None
        self.planned: bool | None = False
        self.proved = False
        self._tables: dict[str, RequirementTable] = {}
        self._directory = None if out is None else RunDirectory(out)
        scenario = context.given
        self._keep_scenario(scenario)
        stature = None if scenario.is_point_mass else context.body.stature
        self.summary: dict[str, Any] = {
            "scenario": scenario.name, "stature_m": stature, "mass_kg": scenario.mass, "seed": scenario.seed,
            "verdict": "failed", "planned": False, "proved": False, "succeeded": False, "failure": None,
            "requirements": [],
            "contacts": None, "centroidal": None, "wholebody": None, "act": None, "execution": None,
            "push": None, "walk": None,
            "wall_s": 0.0,
        }  # fmt: skip

    @property
    def transform(self) -> PlanarTransform:
        """From the frame of the task to the world, where everything is that is kept."""
        return self._context.transform_task_to_world

    @property
    def path(self) -> Path | None:
        """The run directory, or None."""
        return None if self._directory is None else self._directory.path

    def fail(self, stage: str, reason: str, time: float = 0.0, where: str = "") -> None:
        """Say why the run is no success.

        Args:
            stage: Stage that failed.
            reason: In one line; positions in it, in the frame of the task, are moved to the world.
            time: When in the motion [s].
            where: Phase, contact, limb or pair.
        """
        self.failure = Failure(stage, reason_in_world(reason, self.transform), float(time), where)

    def require(self, stage: str, table: RequirementTable) -> None:
        """Take the requirements of a stage's result into the summary, in place of earlier ones.

        Args:
            stage: Stage whose result was measured.
            table: Its requirements.
        """
        self._tables[stage] = table

    def finish(self, stage: str, block: Mapping[str, Any]) -> None:
        """Take a stage's block into the summary, and keep it."""
        self.summary[stage] = dict(block)
        self.keep(stage, block)

    def keep(self, name: str, result: Mapping[str, Any]) -> None:
        """Keep what a stage found among the files of the run."""
        if self._directory is not None:
            self._directory.write_stage(name, result)

    def keep_scenario(self, scenario: Scenario) -> None:
        """Keep a scenario of the task frame with the supports that were found, in the world."""
        self._keep_scenario(scenario.from_task_frame(self.transform))

    def keep_motions(
        self, schedule: ContactSchedule, planned: Motion | None, executed: Motion | None = None
    ) -> None:
        """Keep the motions that there are so far, moved to the world."""
        self._keep_motions(MOTION, schedule, planned, executed)

    def keep_other(self, name: str, schedule: ContactSchedule, planned: Motion) -> None:
        """Keep the motion of somebody else, who has the same body, moved to the world."""
        self._keep_motions(other_motion(name), schedule, planned)

    def close(self) -> dict[str, Any]:
        """Complete the summary, write it and return it."""
        self._judge()
        failure, required = self.failure, self._context.scenario.execution_required
        word = "failed" if failure is not None else "proved" if required else "planned"
        self.summary |= {
            "verdict": word, "planned": self.planned, "proved": self.proved, "succeeded": failure is None,
            "failure": None if failure is None else failure.as_dict(),
            "requirements": [
                row.as_dict(stage) for stage, table in self._tables.items() for row in table
            ],
        }  # fmt: skip
        self.summary["wall_s"] = clock.perf_counter() - self._began
        if self._directory is not None:
            self._directory.write_summary(self.summary)
        return self.summary

    def _judge(self) -> None:
        """A run that broke a requirement, or did not come to what was asked for, has failed."""
        for stage, table in self._tables.items():
            if self.failure is None and (broken := table.first_broken) is not None:
                self.fail(stage, broken.reason, broken.time_s or 0.0, broken.where)
        required = self._context.scenario.execution_required
        if self.failure is None and not (self.proved if required else self.planned):
            stage = "execution" if required else "wholebody"
            self.fail(stage, "the motion was not executed" if required else "there is no plan")

    def _keep_scenario(self, scenario: Scenario) -> None:
        if self._directory is not None:
            self._directory.write_scenario(scenario.to_yaml())

    def _keep_motions(
        self, name: str, schedule: ContactSchedule, planned: Motion | None, executed: Motion | None = None
    ) -> None:
        if self._directory is None:
            return
        transform = self.transform
        content = MotionFile(
            None if planned is None else motion_in_world(planned, transform),
            None if executed is None else motion_in_world(executed, transform),
            self._context.body,
            self._context.scene_in_world,
            schedule_in_world(schedule, transform),
        )
        write_motions(self._directory.path / name, content)


def place(phase: int | None, where: str) -> str:
    """Where something failed, in words: a phase with its contacts, or what there is of both."""
    return where if phase is None else f"phase {phase}" + (f" on {where}" if where else "")


def _silent(stage: str, share: float) -> None:
    """Report progress to nobody."""
