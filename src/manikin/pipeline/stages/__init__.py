"""The stages of a run: each reads the one before it and reports what it found."""

from manikin.pipeline.stages.context import Progress, Report, RunContext, RunResult, StageFailure
from manikin.pipeline.stages.execution_stage import ExecutionRequirements

__all__ = ["ExecutionRequirements", "Progress", "Report", "RunContext", "RunResult", "StageFailure"]
