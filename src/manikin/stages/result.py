"""The outcome of one run."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manikin.centroidal import CentroidalResult
from manikin.motion import Motion
from manikin.simulation import Execution, Recovery
from manikin.spatial import IDENTITY, PlanarTransform
from manikin.stages.report import Report
from manikin.stages.world_frame import motion_in_world
from manikin.wholebody import RefineResult, WholeBodyResult


@dataclass(frozen=True, eq=False)
class RunResult:
    """Outcome of one run.

    Attributes:
        summary: As printed by ``manikin run --json``.
        planned: Planned whole-body motion, or that of a point mass, in the world; None when there is none.
        executed: Executed motion in the world, or None.
        centroidal: Result of the centre-of-mass stage, or None where there was none; it and those of the
            other stages are in the frame of the task.
        wholebody: Result of the whole-body stage, or None.
        execution: Result of the execution, or None.
        directory: Where the files are, or None.
        recovery: Result of a recovery from a push, or None.
        transform_task_to_world: From the frame of the task to the world.
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

    @classmethod
    def of(
        cls,
        report: Report,
        centroidal: CentroidalResult | None = None,
        wholebody: WholeBodyResult | RefineResult | None = None,
        execution: Execution | None = None,
        *,
        planned: Motion | None = None,
        recovery: Recovery | None = None,
    ) -> "RunResult":
        """Close the report of a run and gather what its stages returned.

        Args:
            report: Of the run.
            centroidal: Of the centre of mass.
            wholebody: Of the whole body.
            execution: Of the physics engine.
            planned: The planned motion, where no whole body was planned.
            recovery: Of a recovery from a push.
        """
        executed = execution.motion if execution is not None else None
        if recovery is not None:
            executed = recovery.trace.motion
        planned = planned if wholebody is None else wholebody.motion
        transform = report.transform
        return cls(
            report.close(),
            None if planned is None else motion_in_world(planned, transform),
            None if executed is None else motion_in_world(executed, transform),
            centroidal,
            wholebody,
            execution,
            report.path,
            recovery,
            transform,
        )

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
