"""Files made from results: figures and BVH file of a run, the comparison of two, a contact that was found."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from manikin.body import BodyModel
from manikin.pipeline.run_directory import read_run
from manikin.planning.contacts.single_contact import ContactAnswer
from manikin.reports.comparison import RunComparison
from manikin.reports.export import export_motion
from manikin.reports.figures import ChoicePanel, contact_choice_figure, write_comparison, write_figures
from manikin.reports.figures.write_figures import save_figure
from manikin.runtime.files import FIGURES, ResultDirectory, make_directory
from manikin.runtime.palette import readable
from manikin.scene import Scene

COMPARISON = "comparison.json"


def write_outputs(directory: str | Path, progress: Callable[[str, float], None] | None = None) -> list[Path]:
    """Draw the figures and write the BVH file of a run directory; a point mass has no skeleton for BVH.

    Args:
        directory: The directory of a finished run, successful or not.
        progress: Told the stage ``"figures"`` and the share that is done.

    Returns:
        The files written.

    Raises:
        InputError: If the run cannot be read or a file cannot be written.
    """
    folder = Path(directory)
    record = read_run(folder)
    if not record.tracks and record.schedule is None:
        return []
    make_directory(folder / FIGURES)
    report = progress or _silent
    written = write_figures(record, folder / FIGURES, lambda share: report("figures", 0.9 * share))
    if record.motions and record.body is not None and not record.body.is_point_mass:
        written.append(export_motion(record.content, folder, "bvh"))
    report("figures", 1.0)
    return written


class ComparisonDirectory(ResultDirectory):
    """Directory of the comparison of two runs; other files in it are left alone."""

    kind = "comparison"


def write_comparison_outputs(
    comparison: RunComparison, directory: str | Path, progress: Callable[[str, float], None] | None = None
) -> list[Path]:
    """Draw the figures of two runs and write ``comparison.json``.

    Args:
        directory: Created when it is missing.
        progress: Told the stage ``"figures"`` and the share that is done.

    Returns:
        The files written.

    Raises:
        MotionFileError: If the directory cannot be written to.
    """
    folder, report = ComparisonDirectory(directory), progress or _silent
    file = folder.write(COMPARISON, comparison.as_dict())
    return [file, *write_comparison(comparison, folder.path, lambda share: report("figures", share))]


def write_contact_figure(body: BodyModel, scene: Scene, answer: ContactAnswer, path: str | Path) -> None:
    """Draw the body before and after it made the contact that was asked for.

    Args:
        answer: What was found, or not.

    Raises:
        MotionFileError: If the file cannot be written.
    """
    result = answer.result
    task = np.array(answer.question.task) / np.linalg.norm(answer.question.task)
    panels = [ChoicePanel("before", answer.q, task=task)]
    if result.q is not None and result.contact is not None:
        title = f"{answer.question.heuristic}: {result.obstacle}, EFORT {answer.efort:.2f}"
        panels.append(ChoicePanel(title, result.q, (result.contact,), (result.limb,), task))
    save_figure(contact_choice_figure(body, scene, panels, f"Contact of {readable(result.limb)}"), Path(path))


def _silent(_stage: str, _share: float) -> None:
    """Take a progress report and do nothing."""
