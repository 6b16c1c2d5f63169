"""The run directory: what one job leaves behind.

::

    DIR/scenario.yaml      the scenario with every default and override, ready to run again
    DIR/stages/*.json      what each stage found, written as soon as it is known
    DIR/motion.h5          planned motion, then planned and executed (manikin.motion.file)
    DIR/motion-NAME.h5     planned motion of somebody else who walks there
    DIR/summary.json       written when every stage is done
    DIR/report.html        verdict, requirements, figures and numbers in one page that needs no other file
    DIR/motion.bvh         drawn from the files above, for animation programs
    DIR/figures/*.png      drawn from the files above

Each file is written atomically, so an interrupted run leaves whole files of the stages
that were done and nothing half-written.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from manikin.atomic import write_text
from manikin.errors import MotionFileError

SCENARIO = "scenario.yaml"
MOTION = "motion.h5"
BVH = "motion.bvh"
OTHERS = "motion-*.h5"
WALK_PATHS = "walk_paths"
"""What the walking stage keeps of the ways over the floor, by the name of who walks."""
BODY = "the body"
"""In it, the body that the scenario is about."""
SUMMARY = "summary.json"
REPORT = "report.html"
FIGURES = "figures"
STAGES = "stages"


def other_motion(name: str) -> str:
    """File of the motion of somebody else who walks there."""
    return OTHERS.replace("*", name)


def other_motions(directory: Path) -> dict[str, Path]:
    """Files of the motions of others in a run directory, by their names; none beside a single file."""
    first, last = OTHERS.split("*")
    return {path.name.removeprefix(first).removesuffix(last): path for path in sorted(directory.glob(OTHERS))}


class RunDirectory:
    """Writes the files of one run.

    Attributes:
        path: The directory.
    """

    def __init__(self, path: str | Path) -> None:
        """Create the directory, or take over that of an earlier run and remove its files.

        Raises:
            MotionFileError: If it cannot be created, or holds something that is not a run.
        """
        self.path = Path(path)
        if self.path.exists() and not self.path.is_dir():
            raise MotionFileError(f"{self.path}: is a file; valid: a directory for the run's files")
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._check_ours()
            self._remove_earlier_run()
        except OSError as error:
            raise self._unwritable(self.path, error) from None

    @property
    def figures(self) -> Path:
        """Folder of the figures, created when asked for."""
        folder = self.path / FIGURES
        folder.mkdir(exist_ok=True)
        return folder

    def write_scenario(self, yaml_text: str) -> Path:
        """Keep the resolved scenario."""
        return self._write(self.path / SCENARIO, yaml_text)

    def write_stage(self, name: str, result: Mapping[str, Any]) -> Path:
        """Keep what a stage found, as soon as it is known.

        Args:
            name: Of the stage, such as ``"centroidal"``.
            result: Plain values and arrays.
        """
        folder = self.path / STAGES
        folder.mkdir(exist_ok=True)
        return self._write(folder / f"{name}.json", to_json(result) + "\n")

    def write_summary(self, summary: Mapping[str, Any]) -> Path:
        """Write the summary; the last thing a run does."""
        return self._write(self.path / SUMMARY, to_json(summary) + "\n")

    def _write(self, path: Path, text: str) -> Path:
        try:
            write_text(path, text)
        except OSError as error:
            raise self._unwritable(path, error) from None
        return path

    def _check_ours(self) -> None:
        content = [item.name for item in self.path.iterdir() if not item.name.startswith(".")]
        if content and SCENARIO not in content:
            raise MotionFileError(
                f"{self.path}: holds {sorted(content)[0]!r} but no {SCENARIO}, so it is not an earlier run; "
                "valid: a new or empty directory, or that of an earlier run"
            )

    def _remove_earlier_run(self) -> None:
        # The summary goes first: without it the directory is known to be incomplete.
        for name in (SUMMARY, MOTION, BVH, REPORT):
            (self.path / name).unlink(missing_ok=True)
        # What a killed run was about to write stays behind as a hidden .NAME.*.tmp file.
        for pattern in (f"{STAGES}/*.json", f"{FIGURES}/*.png", OTHERS, ".*.tmp", "*/.*.tmp"):
            for file in self.path.glob(pattern):
                file.unlink()

    @staticmethod
    def _unwritable(path: Path, error: OSError) -> MotionFileError:
        return MotionFileError(f"{path}: cannot be written ({error.strerror}); valid: a writable directory")


def make_directory(path: Path) -> None:
    """Create a directory that several runs share, unless it is there.

    Raises:
        MotionFileError: If it cannot be created.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MotionFileError(
            f"{path}: cannot be made ({error.strerror}); valid: a directory for the runs"
        ) from None


def read_summary(path: str | Path) -> dict[str, Any]:
    """Summary of a run directory.

    Raises:
        MotionFileError: If there is none, or it is damaged.
    """
    file = Path(path) / SUMMARY
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise MotionFileError(
            f"{file}: there is no such file; valid: the directory of a finished run"
        ) from None
    except (OSError, ValueError) as error:
        raise MotionFileError(f"{file}: cannot be read ({error}); valid: as written by manikin") from None
    if not isinstance(summary, dict):
        raise MotionFileError(f"{file}: is not a JSON object; valid: as written by manikin")
    return summary


def to_json(value: Any, indent: int | None = 2) -> str:
    """JSON text of plain values and numpy arrays; NaN and infinity, which JSON lacks, become null."""
    return json.dumps(_plain(value), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
