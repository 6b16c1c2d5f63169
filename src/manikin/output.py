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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from manikin.errors import MotionFileError
from manikin.result_directory import FIGURES, ResultDirectory, write_result

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
STAGES = "stages"


def other_motion(name: str) -> str:
    """File of the motion of somebody else who walks there."""
    return OTHERS.replace("*", name)


def other_motions(directory: Path) -> dict[str, Path]:
    """Files of the motions of others in a run directory, by their names; none beside a single file."""
    first, last = OTHERS.split("*")
    return {path.name.removeprefix(first).removesuffix(last): path for path in sorted(directory.glob(OTHERS))}


class RunDirectory(ResultDirectory):
    """Writes the files of one run; those of an earlier run are removed first."""

    kind, marks = "run", (SCENARIO,)

    def __init__(self, path: str | Path) -> None:
        """Create the directory, or take over that of an earlier run and remove its files.

        Raises:
            MotionFileError: If it cannot be created, or holds something that is not a run.
        """
        super().__init__(path)
        # The summary goes first: without it the directory is known to be incomplete.
        self.remove(SUMMARY, MOTION, BVH, REPORT, f"{STAGES}/*.json", f"{FIGURES}/*.png", OTHERS)

    def write_scenario(self, yaml_text: str) -> Path:
        """Keep the resolved scenario."""
        return self.write(SCENARIO, yaml_text)

    def write_stage(self, name: str, result: Mapping[str, Any]) -> Path:
        """Keep what a stage found, as soon as it is known.

        Args:
            name: Of the stage, such as ``"centroidal"``.
            result: Plain values and arrays.
        """
        return write_result(self.folder(STAGES) / f"{name}.json", result)

    def write_summary(self, summary: Mapping[str, Any]) -> Path:
        """Write the summary; the last thing a run does."""
        return self.write(SUMMARY, summary)


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
