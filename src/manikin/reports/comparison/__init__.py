"""Two runs side by side: timing, centre of mass, margins, postures."""

from manikin.reports.comparison.alignment import PhasePair, TimingRow, align_phases, timing_rows
from manikin.reports.comparison.compare import RunComparison, compare_runs

__all__ = ["PhasePair", "RunComparison", "TimingRow", "align_phases", "compare_runs", "timing_rows"]
