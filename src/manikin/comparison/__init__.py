"""Two runs side by side: timing, centre of mass, margins, postures."""

from manikin.comparison.alignment import PhasePair, align_phases
from manikin.comparison.compare import RunComparison, compare_runs
from manikin.comparison.timing import TimingRow, timing_rows

__all__ = ["PhasePair", "RunComparison", "TimingRow", "align_phases", "compare_runs", "timing_rows"]
