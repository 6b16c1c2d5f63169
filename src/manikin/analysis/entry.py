"""One file among several that are measured, and what came of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class AnalysisJob:
    """One file to measure.

    Attributes:
        path: The recording.
        directory: For its files; None to write none.
        draw: Whether the report has its figure.
    """

    path: Path
    directory: Path | None = None
    draw: bool = True


@dataclass(frozen=True)
class AnalysisEntry:
    """What came of one file.

    Attributes:
        job: The file.
        summary: As :meth:`manikin.analysis.Analysis.as_dict`; None where it was refused.
        refusal: Why, in one line.
    """

    job: AnalysisJob
    summary: dict[str, Any] | None
    refusal: str = ""
