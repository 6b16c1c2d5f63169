"""Recorded people: read, measured, drawn."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from manikin.analysis import Analysis, AnalysisOptions
from manikin.analysis import analyze as measure
from manikin.motion.file import MotionFile
from manikin.recordings.readers import read_recording
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.runtime.display import Displayed
from manikin.viewer import serve

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class RecordedMotion(Displayed):
    """A recording of a person, as it was read.

    Attributes:
        recording: Markers, or joints of a skeleton.
        source: The file.
    """

    recording: Recording | MarkerRecording
    source: Path

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        kind = "markers" if isinstance(self.recording, MarkerRecording) else "skeleton"
        frames, rate = len(self.recording), self.recording.rate
        return {"file": self.source.name, "kind": kind, "frames": str(frames), "rate": f"{rate:g} Hz"}

    def analyze(self, **options: Any) -> "MeasuredRecording":
        """Measure it; options are those of :class:`manikin.analysis.AnalysisOptions`.

        Raises:
            InputError: If it is not a person's motion that can be measured.
        """
        return MeasuredRecording(measure(self.recording, AnalysisOptions(**options), self.source.stem))


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredRecording(Displayed):
    """A recorded person, measured with the yardsticks of plans.

    Attributes:
        analysis: Every measure.
    """

    analysis: Analysis

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        return self.analysis.facts()

    def to_frame(self) -> "DataFrame":
        """Table with one row for each frame; units stand in the names of the columns."""
        from pandas import DataFrame

        columns = self.analysis.series()
        return DataFrame(columns).set_index(next(iter(columns)))

    def plot(self) -> "Drawing":
        """Sheet of postures, supports, forces, margin, height and scores over time."""
        from manikin.reports.analysis_sheet import recording_sheet

        return Drawing(recording_sheet(self.analysis, str(self)))

    def view(self, port: int = 8080) -> None:
        """Show the measured motion in the browser until Ctrl-C."""
        serve(MotionFile(recorded=self.analysis.motion, body=self.analysis.body), port, print)


@dataclass(frozen=True)
class Drawing:
    """An SVG drawing, which notebooks show."""

    svg: str

    def __repr__(self) -> str:
        """Size of the text."""
        return f"Drawing({len(self.svg)} characters of SVG)"

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | Path) -> None:
        """Write it to a file."""
        Path(path).write_text(self.svg, encoding="utf-8")


def read(path: str | Path, frames: tuple[int, int] | None = None) -> RecordedMotion:
    """Read a recording of a person.

    Args:
        path: C3D or TRC for markers, BVH or AMC for a skeleton.
        frames: First frame and the one after the last; None for all.

    Raises:
        InputError: If the file cannot be read.
    """
    return RecordedMotion(read_recording(path, frames), Path(path))


def analyze(path: str | Path, **options: Any) -> MeasuredRecording:
    """Read a recording and measure it; options are those of :class:`manikin.analysis.AnalysisOptions`.

    Raises:
        InputError: If it cannot be read, or is not a person's motion that can be measured.
    """
    frames = options.get("frames")
    return read(path, frames).analyze(**options)
