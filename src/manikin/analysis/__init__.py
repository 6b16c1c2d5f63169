"""Recorded motion, measured: supports, timing, balance, forces, walking segments and effort in one value."""

from manikin.analysis.analysis import Analysis
from manikin.analysis.analyze import (
    AnalysisEntry,
    AnalysisJob,
    AnalysisOptions,
    analyze,
    analyze_file,
    recordings_in,
)

__all__ = [
    "Analysis", "AnalysisEntry", "AnalysisJob", "AnalysisOptions", "analyze", "analyze_file",
    "recordings_in",
]  # fmt: skip
