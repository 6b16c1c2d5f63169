"""The stages of a run: each reads the one before it and reports what it found."""

from manikin.stages.context import RunContext
from manikin.stages.report import Failure, Progress, Report
from manikin.stages.requirements import ExecutionRequirements
from manikin.stages.result import RunResult

__all__ = ["ExecutionRequirements", "Failure", "Progress", "Report", "RunContext", "RunResult"]
